//! The search for a layout: named parameters within limits, one or several goals, and requirements to meet.
//!
//! Every candidate is the scene with other values of its parameters, checked as any scene is and evaluated by
//! [`crate::layout::analyze`]. With several goals there is no single best layout but a front of those that no other
//! beats in all goals. The search is argmin's particle swarm (Kennedy and Eberhart's, as in the Standard PSO of 2011),
//! which needs no derivatives of functions that jump from beam to beam; for every direction λ along the front one swarm
//! minimizes
//!
//! ```text
//! max_k λ_k (c_k − z_k)/s_k + 0.05 Σ_k λ_k (c_k − z_k)/s_k            Σ λ_k = 1
//! ```
//!
//! (the augmented Chebyshev distance of Steuer and Choo 1983), where c are the goals with signs such that less is
//! better, s their spread over the first candidates, and z the best value found of each. For the first swarm z is the
//! layout as drawn: it searches for a layout that is better in all goals at once (Wierzbicki's achievement function).
//! The front is collected from all evaluated layouts.
//!
//! Candidates that violate a requirement rank after all that meet them, by the size of the violation; scenes that are
//! refused rank last. Parameters are searched in steps that a workshop can make. One that changes nothing on its own is not
//! searched, and what the best layout is no worse without is undone at the end. Random numbers come from one generator with a seed, candidates are evaluated in parallel and
//! stored in order: the same seed gives the same result on any number of threads.

mod candidate;
mod effect;
mod error;
mod explain;
mod front;
mod goal;
mod limits;
mod options;
mod search;

pub use candidate::LayoutCandidate;
pub use error::OptimizeError;
pub use explain::{LeftAsItWas, Why};
pub use goal::{Better, Goal, GoalError, Stated, Wanted};
pub use limits::{Hold, Refusal};
pub use options::{OpenParameter, Progress, SearchOptions};

use candidate::Judge;
use catoptric_files::parametric::ParametricScene;
use search::Search;
use serde::Serialize;

/// Version of the format of a search result.
pub const SCHEMA_VERSION: u32 = 1;

/// The result of a search.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Optimum {
    /// Version of this format.
    pub schema_version: u32,
    /// Name of the scene.
    pub name: String,
    /// Seed of the search.
    pub seed: u64,
    /// Number of layouts evaluated, without those for the explanation.
    pub evaluations: usize,
    /// Whether the search was stopped before it was finished.
    pub interrupted: bool,
    /// The goals.
    pub goals: Vec<Stated>,
    /// Requirements that every layout had to meet.
    pub requirements: Vec<String>,
    /// What all evaluated layouts reach of each requirement, and which of them holds the best layout back.
    pub holds: Vec<Hold>,
    /// Why scenes were refused, the most frequent reason first.
    pub refused: Vec<Refusal>,
    /// The parameters with limits.
    pub parameters: Vec<OpenParameter>,
    /// Those of them that change neither a goal nor a requirement when they alone are moved; they stay as drawn.
    pub without_effect: Vec<String>,
    /// The layout as the scene has it.
    pub start: LayoutCandidate,
    /// The layout whose smallest gain in any goal is largest; `None` if none meets the requirements.
    pub best: Option<LayoutCandidate>,
    /// Whether it is better than the start in every goal.
    pub beats_start_in_every_goal: bool,
    /// Layouts that no other beats in all goals, sorted by the first goal, best first.
    pub front: Vec<LayoutCandidate>,
    /// Why the best is better than the start.
    pub why: Option<Why>,
    /// Goals of every layout that meets the requirements, in order of evaluation.
    #[serde(skip)]
    pub tried: Vec<Vec<f64>>,
}

/// Runs a search; `watch` is called after every batch and stops the search by returning `false`.
///
/// ```
/// use catoptric_files::parametric::ParametricScene;
/// use catoptric_design::layout::Detail;
/// use catoptric_design::optimize::{Goal, SearchOptions, optimize};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let text = include_str!("../../../../scenes/prototype-parametric.toml");
/// let template = ParametricScene::parse(text, "prototype-parametric.toml", &[])?;
/// let options = SearchOptions {
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
/// [`OptimizeError`]: no parameters or no goal, or goals and requirements that layouts do not have.
pub fn optimize(
    template: &ParametricScene,
    options: &SearchOptions,
    watch: &mut dyn FnMut(Progress) -> bool,
) -> Result<Optimum, OptimizeError> {
    let parameters: Vec<OpenParameter> = template
        .open()
        .into_iter()
        .map(|(name, parameter, [low, high])| OpenParameter {
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
    let mut judge = Judge::new(template, &parameters, options)?;
    let idle = effect::without_effect(&judge);
    if idle.len() == parameters.len() {
        return Err(OptimizeError::NothingChanges);
    }
    for number in &idle {
        judge.leave(*number);
    }
    let mut search = Search::new(&judge, options, watch);
    let outcome = search.run();
    let interrupted = search.stopped();
    let (mut all, start) = search.finish();
    if !interrupted {
        outcome.map_err(OptimizeError::Search)?;
    }
    let evaluations = all.len();
    let found = front::best(&all, &start);
    let undone = found.filter(|b| b.number != start.number && !interrupted);
    if let Some(mut simpler) = undone.and_then(|best| effect::undone(&judge, &best)) {
        simpler.number = evaluations;
        // Of layouts that are equally good, the front has the first.
        all.insert(1, simpler);
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
        evaluations,
        interrupted,
        goals: options.goals.iter().map(Goal::stated).collect(),
        requirements: options.requirements.iter().map(ToString::to_string).collect(),
        tried: kept.map(|c| c.goals(&options.goals)).collect(),
        front: front::front(&all),
        holds: limits::holds(&options.requirements, &all, best.as_ref()),
        refused: limits::refusals(&all),
        without_effect: idle.iter().map(|n| parameters[*n].name.clone()).collect(),
        parameters,
        start,
        best,
        beats_start_in_every_goal: beats,
        why,
    })
}
