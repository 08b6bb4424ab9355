//! What a search is given, and what it reports while it runs.

use super::goal::Goal;
use crate::layout::{Detail, Requirement};
use serde::Serialize;

/// Goals, requirements and extent of a search.
#[derive(Debug, Clone)]
pub struct Options {
    /// The goals.
    pub goals: Vec<Goal>,
    /// Requirements that every layout has to meet.
    pub requirements: Vec<Requirement>,
    /// Number of layouts to evaluate.
    pub evaluations: usize,
    /// Seed of the search.
    pub seed: u64,
    /// Level of detail of each evaluation.
    pub detail: Detail,
}

/// A parameter that the search varied.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OpenParameter {
    /// Its name.
    pub name: String,
    /// Lower limit.
    pub low: f64,
    /// Upper limit.
    pub high: f64,
    /// Value in the scene.
    pub start: f64,
}

/// Progress of a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Number of layouts evaluated since the last report.
    pub more: usize,
    /// Number of layouts on the front so far.
    pub front: usize,
}
