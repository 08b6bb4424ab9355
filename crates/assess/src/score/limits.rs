//! Limits and requirements that are set on a score, and the verdict that follows.

use super::figures::Score;
use super::gate::{Gate, Outcome};
use super::judge;
use super::verdict::verdict;
use crate::requirement::{Requirement, RequirementError, numbers};

impl Score {
    /// Sets a limit for the per-axis error, in degrees: a score whose error exceeds it or does not exist fails.
    ///
    /// A blind score stays blind, and one that correctly solves nothing, because the boards leave every element open,
    /// keeps its verdict.
    #[must_use]
    pub fn with_limit(mut self, max_rms_deg: f64) -> Self {
        let error = self.per_axis_rms_deg;
        let untested = if !self.has_truth || self.beams.deflected == Some(0) {
            Some("there is nothing to judge")
        } else if self.rightly_solves_nothing() {
            Some("the boards leave every element open, and none is solved")
        } else {
            None
        };
        let gate = match untested {
            Some(why) => {
                let words = format!("the limit of {max_rms_deg}° was not tested: {why}");
                self.remarks.push(words.clone());
                Gate::without("max_rms_deg", Outcome::NotTested, words)
            }
            None => {
                let found = if error.is_finite() {
                    format!("is {error:.4}°")
                } else {
                    "does not exist".to_owned()
                };
                let words = format!("the per-axis error {found}, the limit is {max_rms_deg}°");
                Gate::at_most("max_rms_deg", error, max_rms_deg, words)
            }
        };
        self.gates.insert(0, gate);
        self.settled()
    }

    /// Sets the share of the knowable elements that must be solved, instead of nine tenths; on blind data, where none must
    /// be by default, of the elements that the calibration calls deflected.
    #[must_use]
    pub fn with_min_solved(mut self, share: f64) -> Self {
        let gate = judge::solved(&self, share);
        match self.gates.iter_mut().find(|g| g.name == gate.name) {
            Some(there) if there.outcome != Outcome::NotJudged => *there = gate,
            None if !self.has_truth => self.gates.push(gate),
            Some(_) | None => {}
        }
        self.settled()
    }

    /// Adds a requirement on one of its figures; a figure without a value meets no limit, and cannot be judged on blind
    /// data.
    ///
    /// # Errors
    /// [`RequirementError::Unknown`] if no figure has that name.
    pub fn with_requirement(mut self, requirement: &Requirement) -> Result<Self, RequirementError> {
        let found = requirement.check(
            &self.figures(),
            "per_axis_rms_deg, distance_mm.rms, coverage_95, beams.solved",
        )?;
        for figure in found.into_iter().rev() {
            let value = figure.value.unwrap_or(f64::NAN);
            let is = figure
                .value
                .map_or("has no value".to_owned(), |v| format!("is {v}"));
            let words = format!("{} {is}, required {requirement}", figure.key);
            let mut gate = Gate::of(&requirement.to_string(), figure.met, value, words);
            (gate.at_least, gate.at_most) = (requirement.at_least(), requirement.at_most());
            if figure.value.is_none() && !self.has_truth {
                gate.outcome = Outcome::NotJudged;
            }
            self.gates.insert(0, gate);
        }
        Ok(self.settled())
    }

    /// Returns every number of the score with its name; `None` for one without a value.
    pub fn figures(&self) -> Vec<(String, Option<f64>)> {
        // A score has string keys, so its conversion cannot fail.
        let value = serde_json::to_value(self).unwrap_or_default();
        numbers(
            &value,
            &[
                "schema_version",
                "gates",
                "mistakes",
                "nulls",
                "warnings",
                "honesty",
            ],
        )
    }

    /// The sentences of all gates that are not met: what was found, and what is allowed.
    pub fn reasons(&self) -> Vec<String> {
        self.gates.iter().filter_map(Gate::sentence).collect()
    }

    /// The score with the verdict that follows from its gates, and their reasons first among the warnings.
    pub(super) fn settled(mut self) -> Self {
        // An invalid calibration has no other figures to judge.
        self.verdict = verdict(&self.gates, self.has_truth);
        self.warnings = self.reasons();
        self.warnings.extend(self.remarks.iter().cloned());
        self
    }

    fn rightly_solves_nothing(&self) -> bool {
        let open = self.open.map_or(0, |o| o.elements);
        self.beams.solved == 0 && open > 0 && Some(open) == self.beams.deflected
    }
}
