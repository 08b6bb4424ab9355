//! The types of a score: its verdict, counts and figures, as written by `score --json`.

use super::gate::{Gate, Outcome, verdict};
use super::mistakes::Mistake;
use super::{ElementError, Honesty, Mounting, SurfaceResidual, judge};
use crate::requirement::{Requirement, RequirementError, numbers};
use catoptric_sim::truth::BeamClass;
use serde::Serialize;
use std::collections::BTreeMap;

/// Outcome of a score.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Every gate is met.
    Pass,
    /// A gate is not met.
    Fail,
    /// No gate fails, but one cannot be judged: no covariance is stated, or nothing is deflected.
    NotJudged,
    /// There is no truth, and the residuals on boards and walls are as large as they may be.
    Blind,
    /// The calibration is not valid.
    Invalid,
}

impl Verdict {
    /// The word used in files and on pages.
    pub fn word(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Fail => "fail",
            Self::NotJudged => "not_judged",
            Self::Blind => "blind",
            Self::Invalid => "invalid",
        }
    }

    /// The worse of two verdicts: invalid, failed, not judged, then the rest.
    #[must_use]
    pub fn worse(self, other: Self) -> Self {
        let rank = |verdict: Self| match verdict {
            Self::Invalid => 3,
            Self::Fail => 2,
            Self::NotJudged => 1,
            Self::Pass | Self::Blind => 0,
        };
        if rank(other) > rank(self) { other } else { self }
    }

    /// Exit code of a program that ends with this verdict.
    pub fn exit_code(self) -> u8 {
        match self {
            Self::Pass | Self::Blind => 0,
            Self::Fail | Self::NotJudged => 1,
            Self::Invalid => 2,
        }
    }
}

/// Counts of elements by outcome. Without a truth, solved and abstained count the entries of the calibration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct BeamCounts {
    /// Elements that are deflected and unsplit in truth: the sum of the next three. `None` without a truth.
    pub deflected: Option<usize>,
    /// Of these, those with a direction.
    pub solved: usize,
    /// Of these, those with a status and a reason instead of a direction.
    pub abstained: usize,
    /// Of these, those with neither: absent, called direct, or without a reason. `None` without a truth.
    pub missed: Option<usize>,
    /// Solved elements that are direct, blocked or lost in truth, or do not exist. `None` without a truth.
    #[serde(rename = "false")]
    pub wrong: Option<usize>,
}

/// Counts of the elements, deflected and unsplit in truth, that their own boards leave open.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct OpenCounts {
    /// Number of such elements.
    pub elements: usize,
    /// Of these, those with a status and a reason instead of a direction, which is correct.
    pub abstained: usize,
    /// Of these, those with a direction.
    pub solved: usize,
    /// Of the solved ones, those whose truth is outside the stated 99.9 % ellipse.
    pub wrong: usize,
}

/// Distribution of an angle, in degrees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// Root mean square.
    pub rms: f64,
    /// Median.
    pub median: f64,
    /// 95th percentile; see [`percentile`](super::percentile).
    pub p95: f64,
    /// Maximum.
    pub max: f64,
}

/// Errors of d, in millimeters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DistanceError {
    /// Root mean square.
    pub rms: f64,
    /// Maximum absolute value.
    pub max: f64,
}

/// Root mean square error of a point, in millimeters, at three distances behind the mirror.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PointError {
    /// At 1 m.
    pub at_1m: f64,
    /// At 4 m.
    pub at_4m: f64,
    /// At 10 m.
    pub at_10m: f64,
}

/// Score of the elements that are reported separately: split at an edge, or reflected more than once.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ApartScore {
    /// Number of such elements in truth.
    pub elements: usize,
    /// Number of those that the calibration solved.
    pub solved: usize,
    /// Per-axis error of the chief ray, over those whose chief ray is deflected once.
    pub per_axis_rms_deg: f64,
}

/// A score, as printed by `score --json`. A figure that does not exist is NaN.
#[derive(Debug, Clone, Serialize)]
pub struct Score {
    /// Version of this format.
    pub schema_version: u32,
    /// Method of the calibration.
    pub method: String,
    /// Outcome.
    pub verdict: Verdict,
    /// What decides it, one by one.
    pub gates: Vec<Gate>,
    /// The usual mistakes that would explain the errors.
    pub mistakes: Vec<Mistake>,
    /// Whether errors are as large as the stated covariance; `None` if that cannot be judged.
    pub honesty: Option<Honesty>,
    /// Counts of elements by outcome.
    pub beams: BeamCounts,
    /// Counts of the elements that the boards leave open. `None` without a truth.
    pub open: Option<OpenCounts>,
    /// Elements, deflected and unsplit, whose own boards determine both angles well: three or more of them, and to a degree
    /// or better. `None` without a truth.
    pub knowable: Option<usize>,
    /// Of these, those with a direction.
    pub knowable_solved: Option<usize>,
    /// Share of the scored elements that state a covariance.
    pub stated: f64,
    /// Number of elements of each status; "absent" for those without an entry.
    pub statuses: BTreeMap<&'static str, usize>,
    /// Angle between estimated and true direction, in the sensor frame.
    pub direction_deg: Spread,
    /// Root mean square of (cos φ·δθ, δφ), in the sensor frame.
    pub per_axis_rms_deg: f64,
    /// Angle of the rotation that is common to all scored elements.
    pub common_mode_deg: f64,
    /// Per-axis error that remains after removing that rotation.
    pub differential_per_axis_rms_deg: f64,
    /// Angle between estimated and true direction in the room: with the rig as tracked and the mounting as calibrated,
    /// compared with their true poses.
    pub direction_room_deg: Spread,
    /// Per-axis error in the room: length of the error divided by √2.
    pub per_axis_rms_room_deg: f64,
    /// Angle of the common rotation in the room.
    pub common_mode_room_deg: f64,
    /// Error of d.
    pub distance_mm: DistanceError,
    /// Mean squared error of d in units of its standard deviation.
    pub distance_nees: f64,
    /// Error of the mounting, with the rig as tracked. `None` without a truth, a mounting or a tracked rig.
    pub mounting: Option<Mounting>,
    /// Error of a point, in the sensor frame.
    pub point_mm: PointError,
    /// Error of a point in the room.
    pub point_room_mm: PointError,
    /// Mean normalized estimation error squared.
    #[doc(alias = "ANEES")]
    pub nees_mean: f64,
    /// Share of elements whose error is inside the stated 95 % ellipse.
    pub coverage_95: f64,
    /// Per-axis bound on any estimate from these data.
    #[doc(alias = "CRLB")]
    pub crlb_per_axis_deg: f64,
    /// Elements that it is the mean of; those whose bound is no bound, above 3°, are left out.
    pub crlb_elements: usize,
    /// Per-axis bound on a method that treats every element separately.
    #[doc(alias = "CRLB")]
    pub alone_crlb_per_axis_deg: f64,
    /// Elements that it is the mean of, as above.
    pub alone_crlb_elements: usize,
    /// Bound over error, as mean squares; 1 is optimal on average, and single runs scatter around it.
    pub efficiency: f64,
    /// Elements that are split in truth.
    pub split: ApartScore,
    /// Elements that are reflected more than once in truth.
    pub multi_bounce: ApartScore,
    /// Point-to-board residuals of the solved elements.
    pub boards_mm: SurfaceResidual,
    /// Point-to-wall residuals of the solved elements in the empty room, to which no method fits angles.
    pub walls_mm: SurfaceResidual,
    /// Median over the elements and boards of the squared residual in units of what is allowed; computed on blind data.
    pub boards_normalized: f64,
    /// The same for the walls.
    pub walls_normalized: f64,
    /// Why a figure is null, by key.
    pub nulls: BTreeMap<&'static str, &'static str>,
    /// Warnings as text; the reasons for a failure come first.
    pub warnings: Vec<String>,
    /// Errors of every solved element that is deflected once in truth, including split ones.
    #[serde(skip)]
    pub elements: Vec<ElementError>,
    /// Warnings that are no reasons of the verdict.
    #[serde(skip)]
    pub(super) remarks: Vec<String>,
    /// Whether there is a truth.
    #[serde(skip)]
    pub(super) has_truth: bool,
    /// Solved elements that state a covariance.
    #[serde(skip)]
    pub(super) blind_stated: usize,
}

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

    /// Sets the share of the knowable elements that must be solved, instead of nine tenths.
    #[must_use]
    pub fn with_min_solved(mut self, share: f64) -> Self {
        let gate = judge::solved(&self, share);
        if let Some(there) = self.gates.iter_mut().find(|g| g.name == gate.name)
            && there.outcome != Outcome::NotJudged
            && self.has_truth
        {
            *there = gate;
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

    /// The elements that accuracy is computed over: solved, deflected and unsplit.
    pub fn scored(&self) -> impl Iterator<Item = &ElementError> {
        self.elements.iter().filter(|e| e.class == BeamClass::Deflected)
    }
}
