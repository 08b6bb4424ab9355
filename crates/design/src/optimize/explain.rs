//! Explains why the best layout is better: how the classes of its elements changed, and the contribution of each
//! parameter.

use super::candidate::{Judge, LayoutCandidate};
use crate::layout::{Analysis, Class};
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeMap;

/// Why the best layout is better than the start.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Why {
    /// Number of elements of each class, at the start and in the best.
    pub elements: BTreeMap<Class, [usize; 2]>,
    /// Number of elements that each facet deflects alone, at the start and in the best.
    pub facets: BTreeMap<String, [usize; 2]>,
    /// The best layout with one parameter at a time reset to its start value, the costliest first.
    pub left_as_it_was: Vec<LeftAsItWas>,
}

/// The best layout with one parameter reset to its start value.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LeftAsItWas {
    /// The parameter.
    pub parameter: String,
    /// Value at the start.
    pub start: f64,
    /// Value in the best layout.
    pub best: f64,
    /// The goals of the layout with the reset parameter; empty for a scene that is refused.
    pub goals: BTreeMap<String, f64>,
    /// Requirements that this layout does not meet.
    pub unmet: Vec<String>,
}

/// Compares start and best; `None` if either is refused.
pub(super) fn explain(judge: &Judge<'_>, start: &LayoutCandidate, best: &LayoutCandidate) -> Option<Why> {
    let numbers = |c: &LayoutCandidate| -> Vec<f64> {
        let names = judge.parameters().iter();
        names.filter_map(|p| c.parameters.get(&p.name).copied()).collect()
    };
    let (from, to) = (numbers(start), numbers(best));
    let (_, at_start) = judge.evaluate(&from);
    let (_, at_best) = judge.evaluate(&to);
    let (at_start, at_best) = (at_start?, at_best?);
    let count = |a: &Analysis, class: Class| a.counts.get(&class).copied().unwrap_or(0);
    let pairs = Class::ALL.map(|c| (c, [count(&at_start, c), count(&at_best, c)]));
    let elements = pairs.into_iter().filter(|(_, pair)| *pair != [0, 0]).collect();
    let facets = at_start.facets.iter().zip(&at_best.facets);
    let facets = facets
        .map(|(a, b)| (b.name.clone(), [a.elements, b.elements]))
        .collect();
    let changed: Vec<usize> = (0..from.len()).filter(|i| from[*i] != to[*i]).collect();
    let mut left: Vec<(f64, LeftAsItWas)> = changed
        .into_par_iter()
        .map(|i| {
            let mut numbers = to.clone();
            numbers[i] = from[i];
            let (without, _) = judge.evaluate(&numbers);
            let left = LeftAsItWas {
                parameter: judge.parameters()[i].name.clone(),
                start: from[i],
                best: to[i],
                goals: without.goals.clone(),
                unmet: without.unmet.clone(),
            };
            (loss(&without, start, best), left)
        })
        .collect();
    left.sort_by(|(a, x), (b, y)| b.total_cmp(a).then_with(|| x.parameter.cmp(&y.parameter)));
    Some(Why {
        elements,
        facets,
        left_as_it_was: left.into_iter().map(|(_, left)| left).collect(),
    })
}

/// Returns the largest loss in a goal, as a fraction of what was gained in it; infinite if a requirement is not met.
fn loss(without: &LayoutCandidate, start: &LayoutCandidate, best: &LayoutCandidate) -> f64 {
    if !without.is_kept() {
        return f64::INFINITY;
    }
    let goals = without.costs.iter().zip(&start.costs).zip(&best.costs);
    let shares = goals.map(|((without, start), best)| {
        let gained = (start - best).abs();
        if gained > 0.0 {
            (without - best) / gained
        } else {
            0.0
        }
    });
    shares.fold(0.0, f64::max)
}
