//! The Pareto front: the layouts that no other beats in all goals.

use super::candidate::LayoutCandidate;

/// Whether one is at least as good in every goal and better in one.
pub(super) fn dominates(a: &LayoutCandidate, b: &LayoutCandidate) -> bool {
    let pairs = || a.costs.iter().zip(&b.costs);
    pairs().all(|(a, b)| a <= b) && pairs().any(|(a, b)| a < b)
}

/// Whether one is better in every goal.
pub(super) fn beats_in_all(a: &LayoutCandidate, b: &LayoutCandidate) -> bool {
    a.is_kept() && !b.costs.is_empty() && a.costs.iter().zip(&b.costs).all(|(a, b)| a < b)
}

/// Returns the layouts that meet the requirements and that no other beats, without duplicates, sorted by the first
/// goal, best first.
pub(super) fn front(all: &[LayoutCandidate]) -> Vec<LayoutCandidate> {
    let mut front: Vec<&LayoutCandidate> = Vec::new();
    for candidate in all.iter().filter(|c| c.is_kept()) {
        let beaten = |by: &&LayoutCandidate| dominates(by, candidate) || by.costs == candidate.costs;
        if !front.iter().any(beaten) {
            front.retain(|other| !dominates(candidate, other));
            front.push(candidate);
        }
    }
    let by_goals = |a: &&LayoutCandidate, b: &&LayoutCandidate| {
        let pairs = a.costs.iter().zip(&b.costs);
        let differ = pairs.map(|(a, b)| a.total_cmp(b)).find(|o| o.is_ne());
        differ.unwrap_or_else(|| a.number.cmp(&b.number))
    };
    front.sort_by(by_goals);
    front.into_iter().cloned().collect()
}

/// Returns the layout whose smallest gain in any goal is largest; gains are relative to the spread of the front.
pub(super) fn best(all: &[LayoutCandidate], start: &LayoutCandidate) -> Option<LayoutCandidate> {
    let front = front(all);
    let spans = spreads(front.iter());
    let from = |goal: usize| match start.costs.get(goal) {
        Some(cost) => *cost,
        None => front
            .iter()
            .map(|c| c.costs[goal])
            .fold(f64::NEG_INFINITY, f64::max),
    };
    let min_gain = |c: &LayoutCandidate| {
        let gains = c
            .costs
            .iter()
            .enumerate()
            .map(|(goal, cost)| (from(goal) - cost) / spans[goal]);
        gains.fold(f64::INFINITY, f64::min)
    };
    let mut best: Option<(f64, &LayoutCandidate)> = None;
    for candidate in &front {
        let gain = min_gain(candidate);
        if best.is_none_or(|(most, _)| gain > most) {
            best = Some((gain, candidate));
        }
    }
    best.map(|(_, candidate)| candidate.clone())
}

/// Returns the spread of layouts in every goal; 1 where all are equal.
pub(super) fn spreads<'a>(some: impl Iterator<Item = &'a LayoutCandidate>) -> Vec<f64> {
    let mut limits: Vec<[f64; 2]> = Vec::new();
    for candidate in some {
        for (goal, cost) in candidate.costs.iter().enumerate() {
            match limits.get_mut(goal) {
                Some(limit) => *limit = [limit[0].min(*cost), limit[1].max(*cost)],
                None => limits.push([*cost; 2]),
            }
        }
    }
    let span = |[low, high]: [f64; 2]| if high > low { high - low } else { 1.0 };
    limits.into_iter().map(span).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    fn candidate(number: usize, costs: &[f64], kept: bool) -> LayoutCandidate {
        LayoutCandidate {
            number,
            parameters: BTreeMap::new(),
            goals: BTreeMap::new(),
            unmet: if kept { Vec::new() } else { vec!["no".to_owned()] },
            place: Vec::new(),
            costs: costs.to_vec(),
            shortfall: 0.0,
            reached: Vec::new(),
        }
    }

    #[test]
    fn the_front_holds_the_undominated_layouts() {
        let all = [
            candidate(0, &[5.0, 5.0], true),
            candidate(1, &[1.0, 9.0], true),
            candidate(2, &[4.0, 4.0], true),
            candidate(3, &[4.0, 4.0], true),
            candidate(4, &[0.0, 0.0], false),
            candidate(5, &[9.0, 1.0], true),
            candidate(6, &[1.0, 10.0], true),
        ];
        let numbers: Vec<usize> = front(&all).iter().map(|c| c.number).collect();
        assert_eq!(numbers, [1, 2, 5]);
        // The ends gain nothing in one goal; the middle gains in both.
        let best = best(&all, &all[0]).expect("some are kept");
        assert_eq!(best.number, 2);
        assert!(beats_in_all(&best, &all[0]) && !beats_in_all(&all[1], &all[0]));
    }
}
