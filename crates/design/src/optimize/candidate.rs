//! Candidates of the search: a choice of parameter values with the goals and requirements of its layout.

use super::error::OptimizeError;
use super::goal::{Goal, requires_accuracy};
use super::options::{OpenParameter, SearchOptions};
use crate::layout::{self, Analysis, Layout};
use catoptric_files::parametric::ParametricScene;
use catoptric_sim::Scene;
use serde::Serialize;
use std::collections::BTreeMap;

/// Minimum number of steps between a parameter's limits. Values are rounded to decimal steps, so that the value written
/// is the value evaluated.
const STEPS: f64 = 1e4;

/// A choice of parameter values, with the results for its layout.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LayoutCandidate {
    /// Number of the layout in order of evaluation; 0 is the start.
    pub number: usize,
    /// Values of the parameters.
    pub parameters: BTreeMap<String, f64>,
    /// Values of the goals; empty for a scene that is refused.
    pub goals: BTreeMap<String, f64>,
    /// Requirements that it does not meet, or why the scene is refused, as text.
    pub unmet: Vec<String>,
    /// Position between the limits, 0 to 1 for each parameter.
    #[serde(skip)]
    pub(super) place: Vec<f64>,
    /// Costs: the goals with signs such that less is better.
    #[serde(skip)]
    pub(super) costs: Vec<f64>,
    /// Violation of the requirements, as a fraction of their limits.
    #[serde(skip)]
    pub(super) shortfall: f64,
}

impl LayoutCandidate {
    /// Whether it is a valid scene that meets every requirement.
    pub fn is_kept(&self) -> bool {
        self.unmet.is_empty()
    }

    /// Returns its parameters as name and value.
    pub fn choice(&self) -> Vec<(&str, f64)> {
        self.parameters
            .iter()
            .map(|(name, value)| (name.as_str(), *value))
            .collect()
    }

    /// Returns its goals in the order given.
    pub(super) fn goals(&self, goals: &[Goal]) -> Vec<f64> {
        goals
            .iter()
            .filter_map(|g| self.goals.get(g.name()).copied())
            .collect()
    }
}

/// Evaluates candidates.
pub(super) struct Judge<'a> {
    template: &'a ParametricScene,
    parameters: &'a [OpenParameter],
    options: &'a SearchOptions,
    accuracy: bool,
    /// The unchanged scene's layout; most candidates differ from it in part only.
    start: Layout,
}

impl<'a> Judge<'a> {
    /// Checks that goals and requirements name existing figures.
    pub(super) fn new(
        template: &'a ParametricScene,
        parameters: &'a [OpenParameter],
        options: &'a SearchOptions,
    ) -> Result<Self, OptimizeError> {
        let accuracy = options.goals.iter().any(Goal::needs_accuracy)
            || options.requirements.iter().any(requires_accuracy);
        let judge = Self {
            template,
            parameters,
            options,
            accuracy,
            start: Layout::new(template.scene(), None, options.detail)?,
        };
        let analysis = judge.analyze(template.scene())?;
        let figures = layout::figures(&analysis);
        for goal in &options.goals {
            goal.check(&figures)?;
        }
        for requirement in &options.requirements {
            layout::judge(requirement, &analysis)?;
        }
        Ok(judge)
    }

    pub(super) fn dimensions(&self) -> usize {
        self.parameters.len()
    }

    /// Returns the position of the unchanged scene between the limits.
    pub(super) fn start(&self) -> Vec<f64> {
        let place = |p: &OpenParameter| (p.start - p.low) / (p.high - p.low);
        self.parameters.iter().map(place).collect()
    }

    /// Returns the parameter values at a position between the limits.
    fn numbers(&self, place: &[f64]) -> Vec<f64> {
        let one = |(open, x): (&OpenParameter, &f64)| {
            let number = open.low + x * (open.high - open.low);
            // Rounded to decimals, so that the value is short to write.
            let mut unit = 1.0;
            while unit * (open.high - open.low) < STEPS {
                unit *= 10.0;
            }
            ((number * unit).round() / unit).clamp(open.low, open.high)
        };
        self.parameters.iter().zip(place).map(one).collect()
    }

    /// Evaluates the candidate at a position.
    pub(super) fn candidate(&self, number: usize, place: &[f64]) -> LayoutCandidate {
        let numbers = if place == self.start() {
            self.parameters.iter().map(|p| p.start).collect()
        } else {
            self.numbers(place)
        };
        let (mut found, _) = self.evaluate(&numbers);
        found.number = number;
        found.place = place.to_vec();
        found
    }

    /// Evaluates a choice of values, in the order of the parameters.
    pub(super) fn evaluate(&self, numbers: &[f64]) -> (LayoutCandidate, Option<Analysis>) {
        let names = self.parameters.iter().map(|p| p.name.clone());
        let mut candidate = LayoutCandidate {
            number: 0,
            parameters: names.zip(numbers.iter().copied()).collect(),
            goals: BTreeMap::new(),
            unmet: Vec::new(),
            place: Vec::new(),
            costs: Vec::new(),
            shortfall: f64::INFINITY,
        };
        let scene = match self.template.with(&candidate.choice()) {
            Ok(scene) => scene,
            Err(problems) => {
                candidate.unmet = problems;
                return (candidate, None);
            }
        };
        let analysis = match self.analyze(&scene) {
            Ok(analysis) => analysis,
            Err(error) => {
                candidate.unmet = vec![error.to_string()];
                return (candidate, None);
            }
        };
        let figures = layout::figures(&analysis);
        for goal in &self.options.goals {
            match goal.value(&analysis, &figures) {
                Some(value) => {
                    candidate.goals.insert(goal.name().to_owned(), value);
                    candidate.costs.push(goal.cost(value));
                }
                None => candidate.unmet.push(format!("{} has no value", goal.name())),
            }
        }
        if !candidate.unmet.is_empty() {
            return (candidate, Some(analysis));
        }
        candidate.shortfall = 0.0;
        for requirement in &self.options.requirements {
            candidate.shortfall += requirement.shortfall(&figures);
            match layout::judge(requirement, &analysis) {
                Ok(unmet) => candidate.unmet.extend(unmet.iter().map(ToString::to_string)),
                Err(error) => candidate.unmet.push(error.to_string()),
            }
        }
        (candidate, Some(analysis))
    }

    fn analyze(&self, scene: &Scene) -> Result<Analysis, catoptric_sim::SimError> {
        let mut analysis = self.start.edited(scene)?.analysis()?;
        if self.accuracy {
            analysis.accuracy = Some(layout::predict(scene, scene.seed));
        }
        Ok(analysis)
    }

    pub(super) fn parameters(&self) -> &[OpenParameter] {
        self.parameters
    }
}
