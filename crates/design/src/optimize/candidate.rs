//! Candidates of the search: a choice of parameter values with the goals and requirements of its layout.

use super::error::OptimizeError;
use super::goal::{Goal, requires_accuracy};
use super::options::{OpenParameter, SearchOptions};
use crate::layout::{self, Analysis, Layout, Requirement};
use catoptric_files::parametric::ParametricScene;
use catoptric_sim::Scene;
use serde::Serialize;
use std::collections::BTreeMap;

/// Minimum number of steps between the limits of a parameter that is neither a length nor an angle. Values are rounded to
/// decimal steps, so that the value written is the value evaluated.
const STEPS: f64 = 1e4;

/// Steps per unit of what a workshop can make, by the end of a parameter's name: a tenth of a millimeter, a hundredth of a
/// degree.
const MAKEABLE: [(&str, f64); 3] = [("_mm", 10.0), ("_m", 1e4), ("_deg", 100.0)];

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
    /// What became of every requirement, in order; empty for a scene that is refused.
    #[serde(skip)]
    pub(super) reached: Vec<Reached>,
}

/// What a layout reaches of one requirement.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Reached {
    /// The value farthest from being allowed, among the figures that the requirement names.
    pub(super) worst: Option<f64>,
    /// Whether all of them are allowed.
    pub(super) met: bool,
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
    /// Those of them that the search varies, by number.
    varied: Vec<usize>,
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
            varied: (0..parameters.len()).collect(),
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

    /// Leaves a parameter as drawn.
    pub(super) fn leave(&mut self, number: usize) {
        self.varied.retain(|n| *n != number);
    }

    pub(super) fn dimensions(&self) -> usize {
        self.varied.len()
    }

    /// Returns the position of the unchanged scene between the limits.
    pub(super) fn start(&self) -> Vec<f64> {
        let place = |p: &OpenParameter| (p.start - p.low) / (p.high - p.low);
        self.varied.iter().map(|n| place(&self.parameters[*n])).collect()
    }

    /// Returns the parameter values of the unchanged scene.
    pub(super) fn drawn(&self) -> Vec<f64> {
        self.parameters.iter().map(|p| p.start).collect()
    }

    /// Returns the parameter values at a position between the limits, as they can be made.
    fn numbers(&self, place: &[f64]) -> Vec<f64> {
        let mut numbers = self.drawn();
        for (n, x) in self.varied.iter().zip(place) {
            let open = &self.parameters[*n];
            numbers[*n] = makeable(open, open.low + x * (open.high - open.low));
        }
        numbers
    }

    /// Evaluates the candidate at a position.
    pub(super) fn candidate(&self, number: usize, place: &[f64]) -> LayoutCandidate {
        let numbers = if place == self.start() {
            self.drawn()
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
            reached: Vec::new(),
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
            let checked = requirement.check(&figures, "").unwrap_or_default();
            let values = checked.iter().map(|c| c.value);
            candidate.reached.push(Reached {
                worst: values.reduce(|a, b| farther(requirement, a, b)).flatten(),
                met: checked.iter().all(|c| c.met),
            });
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

/// The value nearest to one that can be made and written in few digits, between the limits. Limits that lie closer
/// together than a tenth of such steps are searched in finer ones.
pub(super) fn makeable(open: &OpenParameter, value: f64) -> f64 {
    let span = open.high - open.low;
    let made = MAKEABLE.iter().find(|(end, _)| open.name.ends_with(end));
    let mut unit = match made {
        Some((_, unit)) if unit * span >= 10.0 => *unit,
        _ => 1.0,
    };
    if made.is_none_or(|(_, u)| *u != unit) {
        while unit * span < STEPS {
            unit *= 10.0;
        }
    }
    let (least, most) = ((open.low * unit).ceil(), (open.high * unit).floor());
    (value * unit).round().clamp(least, most.max(least)) / unit
}

/// Of two values of a requirement's figures, the one that is farther from being allowed; none is farthest.
fn farther(requirement: &Requirement, a: Option<f64>, b: Option<f64>) -> Option<f64> {
    let (a, b) = (a?, b?);
    Some(if requirement.at_least().is_some() {
        a.min(b)
    } else {
        a.max(b)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(name: &str, low: f64, high: f64) -> OpenParameter {
        OpenParameter {
            name: name.to_owned(),
            low,
            high,
            start: low,
        }
    }

    #[test]
    fn values_are_those_that_can_be_made_within_the_limits() {
        assert_eq!(makeable(&open("reach_mm", 55.0, 85.0), 70.3178), 70.3);
        assert_eq!(makeable(&open("rise_deg", 40.0, 60.0), 54.28849), 54.29);
        assert_eq!(makeable(&open("height_m", 0.0, 1.0), 0.123456), 0.1235);
        // Limits between two steps, and limits closer together than ten of them.
        assert_eq!(makeable(&open("reach_mm", 55.06, 85.04), 85.04), 85.0);
        assert_eq!(makeable(&open("reach_mm", 55.06, 85.04), 55.06), 55.1);
        assert_eq!(makeable(&open("gap_mm", 0.0, 0.2), 0.123456), 0.12346);
        assert_eq!(makeable(&open("share", 0.0, 1.0), 0.123456), 0.1235);
        assert_eq!(makeable(&open("count", 0.0, 2e4), 12345.678), 12346.0);
    }
}
