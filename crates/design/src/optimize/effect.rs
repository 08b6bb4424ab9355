//! Which parameters matter: those that change nothing stay as drawn, and what the best layout does not need is undone.

use super::candidate::{Judge, LayoutCandidate, makeable};
use super::options::OpenParameter;
use rayon::prelude::*;

/// How far a parameter is moved on its own to see whether anything changes: to its limits, and parts of the way.
const SHARES: [f64; 3] = [0.1, 0.4, 1.0];

/// The parameters that change no goal and no requirement when they alone are moved from the drawing, by number.
pub(super) fn without_effect(judge: &Judge<'_>) -> Vec<usize> {
    let drawn = judge.drawn();
    let (start, _) = judge.evaluate(&drawn);
    // Nothing is known of a scene that is refused, so everything may matter.
    if start.costs.is_empty() {
        return Vec::new();
    }
    let changes = |(number, open): (usize, &OpenParameter)| {
        let values = [open.low, open.high]
            .into_iter()
            .flat_map(|limit| SHARES.map(|share| open.start + share * (limit - open.start)));
        values.map(|value| makeable(open, value)).any(|value| {
            let mut numbers = drawn.clone();
            numbers[number] = value;
            let (moved, _) = judge.evaluate(&numbers);
            moved.costs != start.costs || moved.reached != start.reached || moved.unmet != start.unmet
        })
    };
    let parameters: Vec<(usize, &OpenParameter)> = judge.parameters().iter().enumerate().collect();
    let kept: Vec<bool> = parameters.into_par_iter().map(changes).collect();
    (0..kept.len()).filter(|n| !kept[*n]).collect()
}

/// The best layout with every parameter back as drawn that it is no worse without, one after the other; `None` if it needs
/// all that it changes.
pub(super) fn undone(judge: &Judge<'_>, best: &LayoutCandidate) -> Option<LayoutCandidate> {
    let mut found = None;
    let mut now = best.clone();
    for open in judge.parameters() {
        if now
            .parameters
            .get(&open.name)
            .is_none_or(|value| *value == open.start)
        {
            continue;
        }
        let numbers = judge.parameters().iter().map(|p| {
            let value = now.parameters.get(&p.name).copied().unwrap_or(p.start);
            if p.name == open.name { p.start } else { value }
        });
        let (without, _) = judge.evaluate(&numbers.collect::<Vec<f64>>());
        let no_worse = without.costs.len() == now.costs.len()
            && without.costs.iter().zip(&now.costs).all(|(a, b)| a <= b);
        if without.is_kept() && no_worse {
            now = without;
            found = Some(now.clone());
        }
    }
    found
}
