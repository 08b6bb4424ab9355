//! The search for a layout: named parameters within their limits, one or several goals, and requirements to keep.
//!
//! Every candidate is the scene with other numbers for its parameters, checked as any scene is and looked at by
//! [`crate::layout::analyze`]. With several goals there is no best layout but a front of those that no other beats in all of
//! them. The search is argmin's particle swarm (Kennedy and Eberhart's, as in the Standard PSO of 2011), which needs no
//! derivatives of what jumps from beam to beam; for every direction λ along the front one swarm goes after the least
//!
//! ```text
//! max_k λ_k (c_k − z_k)/s_k + 0.05 Σ_k λ_k (c_k − z_k)/s_k            Σ λ_k = 1
//! ```
//!
//! (the augmented Chebyshev distance of Steuer and Choo 1983), c the goals so that less is better, s their spread over the
//! first candidates, z the best seen of each. The first swarm has the layout as drawn for z: it looks for one that is
//! better in all goals at once (Wierzbicki's achievement function). The front is gathered from everything that was
//! looked at.
//!
//! Candidates that break a requirement come after all that break none, by how far; scenes that are refused come last.
//! Draws come from one generator with a seed, candidates are looked at in parallel and noted in order: the same seed gives
//! the same answer on any number of threads.

mod candidate;
mod explain;
mod front;
mod goal;
mod search;

pub use candidate::Candidate;
pub use explain::{LeftAsItWas, Why};
pub use goal::{Better, Goal, GoalError, Wanted};

use crate::layout::{Detail, Requirement, RequirementError};
use candidate::Judge;
use catoptric_files::parametric::ParametricScene;
use catoptric_sim::SimError;
use search::Search;
use serde::Serialize;

/// Version of what a search is written as.
pub const SCHEMA_VERSION: u32 = 1;

/// What to look for, and for how long.
#[derive(Debug, Clone)]
pub struct Options {
    /// The goals.
    pub goals: Vec<Goal>,
    /// What every layout has to keep.
    pub requirements: Vec<Requirement>,
    /// How many layouts to look at.
    pub evaluations: usize,
    /// Seed of the search.
    pub seed: u64,
    /// How closely to look at each.
    pub detail: Detail,
}

/// Why there is no search.
#[derive(Debug, thiserror::Error)]
pub enum OptimizeError {
    /// There is nothing to choose.
    #[error("the scene has no parameter with both `low` and `high`")]
    NothingOpen,
    /// There is nothing to look for.
    #[error("a search needs a goal")]
    NoGoal,
    /// A goal is none.
    #[error(transparent)]
    Goal(#[from] GoalError),
    /// A requirement is none.
    #[error(transparent)]
    Requirement(#[from] RequirementError),
    /// The scene cannot be set up.
    #[error(transparent)]
    Setup(#[from] SimError),
    /// The swarm stopped for a reason of its own.
    #[error("the search ended early: {0}")]
    Search(String),
}

impl OptimizeError {
    /// What to do about it, where that is known.
    pub fn help(&self) -> Option<String> {
        match self {
            Self::Goal(GoalError::Unknown { help, .. } | GoalError::Figure { help, .. }) => {
                Some(help.clone())
            }
            Self::Requirement(error) => error.help(),
            Self::Goal(GoalError::Direction { .. } | GoalError::Directions)
            | Self::NothingOpen
            | Self::NoGoal
            | Self::Setup(_)
            | Self::Search(_) => None,
        }
    }
}

/// A parameter that was open.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Open {
    /// Its name.
    pub name: String,
    /// The least it may be.
    pub low: f64,
    /// The most it may be.
    pub high: f64,
    /// What it is in the scene.
    pub start: f64,
}

/// A goal in words.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Stated {
    /// Its name.
    pub name: String,
    /// Whether more or less of it is better.
    pub better: Better,
    /// Its unit; `None` for a share or a count.
    pub unit: Option<&'static str>,
}

/// What a search found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Optimum {
    /// Version of this format.
    pub schema_version: u32,
    /// Name of the scene.
    pub name: String,
    /// Seed of the search.
    pub seed: u64,
    /// Layouts that were looked at, the reasons aside.
    pub evaluations: usize,
    /// Whether it was told to stop before it was done.
    pub interrupted: bool,
    /// The goals.
    pub goals: Vec<Stated>,
    /// What every layout had to keep.
    pub requirements: Vec<String>,
    /// What could be chosen.
    pub parameters: Vec<Open>,
    /// The layout as the scene has it.
    pub start: Candidate,
    /// The one that gains most in the goal in which it gains least; `None` if none keeps the requirements.
    pub best: Option<Candidate>,
    /// Whether it is better than the start in every goal.
    pub beats_start_in_every_goal: bool,
    /// Layouts that no other beats in all goals, the best of the first goal first.
    pub front: Vec<Candidate>,
    /// Why the best is better than the start.
    pub why: Option<Why>,
    /// Goals of every layout that keeps the requirements, in the order in which they were looked at.
    #[serde(skip)]
    pub tried: Vec<Vec<f64>>,
}

/// How far a search is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Layouts looked at since the last time.
    pub more: usize,
    /// Layouts on the front so far.
    pub front: usize,
}

/// Searches; `watch` is told of every batch and stops the search by returning `false`.
///
/// ```
/// use catoptric_files::parametric::ParametricScene;
/// use catoptric_design::layout::Detail;
/// use catoptric_design::optimize::{Goal, Options, optimize};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let text = include_str!("../../../../scenes/prototype-parametric.toml");
/// let template = ParametricScene::parse(text, "prototype-parametric.toml", &[])?;
/// let options = Options {
///     goals: vec![Goal::parse("field_of_regard", &[])?, Goal::parse("size", &[])?],
///     requirements: Vec::new(),
///     evaluations: 60,
///     seed: 1,
///     detail: Detail::Coarse,
/// };
/// let found = optimize(&template, &options, &mut |_| true)?;
/// assert!(!found.front.is_empty());
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// [`OptimizeError`]: nothing to choose or to look for, or goals and requirements that no layout has.
pub fn optimize(
    template: &ParametricScene,
    options: &Options,
    watch: &mut dyn FnMut(Progress) -> bool,
) -> Result<Optimum, OptimizeError> {
    let parameters: Vec<Open> = template
        .open()
        .into_iter()
        .map(|(name, parameter, [low, high])| Open {
            name: name.to_owned(),
            low,
            high,
            start: parameter.value,
        })
        .collect();
    if parameters.is_empty() {
        return Err(OptimizeError::NothingOpen);
    }
    if options.goals.is_empty() {
        return Err(OptimizeError::NoGoal);
    }
    let judge = Judge::new(template, &parameters, options)?;
    let mut search = Search::new(&judge, options, watch);
    let outcome = search.run();
    let interrupted = search.stopped();
    let (all, start) = search.done();
    if !interrupted {
        outcome.map_err(OptimizeError::Search)?;
    }
    let best = front::best(&all, &start);
    let beats = best.as_ref().is_some_and(|b| front::beats_in_all(b, &start));
    let why = best
        .as_ref()
        .filter(|b| b.number != start.number && !interrupted)
        .and_then(|b| explain::explain(&judge, &start, b));
    let kept = all.iter().filter(|c| c.is_kept());
    Ok(Optimum {
        schema_version: SCHEMA_VERSION,
        name: template.scene().name.clone(),
        seed: options.seed,
        evaluations: all.len(),
        interrupted,
        goals: options.goals.iter().map(Goal::stated).collect(),
        requirements: options.requirements.iter().map(ToString::to_string).collect(),
        tried: kept.map(|c| c.goals(&options.goals)).collect(),
        front: front::front(&all),
        parameters,
        start,
        best,
        beats_start_in_every_goal: beats,
        why,
    })
}
