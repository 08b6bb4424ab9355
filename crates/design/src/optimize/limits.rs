//! What holds a search back: the requirements that the best layout would be better without, and why no layout is left.

use super::candidate::LayoutCandidate;
use super::front::dominates;
use crate::layout::Requirement;
use serde::Serialize;
use std::collections::BTreeMap;

/// What all evaluated layouts reach of a requirement.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Hold {
    /// The requirement.
    pub requirement: String,
    /// Number of evaluated layouts that do not meet it, without the scenes that are refused.
    pub unmet: usize,
    /// The value of the evaluated layout that comes closest to meeting it, or exceeds it most; of several figures the one
    /// that is farthest from being allowed. `None` if it has a value in no layout.
    pub reached: Option<f64>,
    /// Whether it is what keeps the best layout from being better: an evaluated layout that fails only this requirement is
    /// at least as good in every goal and better in one.
    pub binding: bool,
}

/// A reason for which scenes were refused.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Refusal {
    /// The first problem of the first such scene.
    pub reason: String,
    /// Number of evaluated layouts whose first problem it is, at whatever place and by whatever amount.
    pub layouts: usize,
}

/// What all layouts reach of each requirement, in order.
pub(super) fn holds(
    requirements: &[Requirement],
    all: &[LayoutCandidate],
    best: Option<&LayoutCandidate>,
) -> Vec<Hold> {
    let hold = |(number, requirement): (usize, &Requirement)| {
        let reached = || all.iter().filter_map(|c| c.reached.get(number));
        let better = |a: f64, b: f64| {
            if requirement.at_least().is_some() {
                a.max(b)
            } else {
                a.min(b)
            }
        };
        let fails_only_this = |c: &&LayoutCandidate| {
            let others = || c.reached.iter().enumerate().filter(|(n, _)| *n != number);
            c.reached.get(number).is_some_and(|r| !r.met) && others().all(|(_, r)| r.met)
        };
        let binding = best.is_some_and(|best| {
            let rivals = all.iter().filter(fails_only_this);
            rivals
                .filter(|c| c.costs.len() == best.costs.len())
                .any(|c| dominates(c, best))
        });
        Hold {
            requirement: requirement.to_string(),
            unmet: reached().filter(|r| !r.met).count(),
            reached: reached().filter_map(|r| r.worst).reduce(better),
            binding,
        }
    };
    requirements.iter().enumerate().map(hold).collect()
}

/// Why scenes were refused, the most frequent reason first.
pub(super) fn refusals(all: &[LayoutCandidate]) -> Vec<Refusal> {
    let mut counts: BTreeMap<String, (&str, usize)> = BTreeMap::new();
    for candidate in all.iter().filter(|c| c.reached.is_empty() && c.costs.is_empty()) {
        if let Some(first) = candidate.unmet.first() {
            // The same problem at another place, by another amount, is the same reason; the first stands for all.
            let words = first.replace(|c: char| c.is_ascii_digit() || c == '.' || c == '-', "");
            counts.entry(words).or_insert((first, 0)).1 += 1;
        }
    }
    let mut found: Vec<Refusal> = counts
        .into_values()
        .map(|(reason, layouts)| Refusal {
            reason: reason.to_owned(),
            layouts,
        })
        .collect();
    found.sort_by(|a, b| b.layouts.cmp(&a.layouts).then_with(|| a.reason.cmp(&b.reason)));
    found
}
