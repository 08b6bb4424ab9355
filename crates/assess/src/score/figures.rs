//! What a score consists of.

use super::{ElementError, Honesty, SurfaceResidual};
use catoptric_sim::truth::BeamClass;
use serde::Serialize;
use std::collections::BTreeMap;

/// What a score comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Nothing is wrong.
    Pass,
    /// An element is missed or false, the covariance is dishonest, or the error is above the limit set.
    Fail,
    /// There is nothing to judge: no truth, or no mirror that deflects anything.
    Blind,
}

impl Verdict {
    /// The word files and pages use.
    pub fn word(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Fail => "fail",
            Self::Blind => "blind",
        }
    }
}

/// What became of the elements. Without a truth, solved and abstained count what the calibration says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct BeamCounts {
    /// Elements that are deflected and unsplit in truth: the sum of the next three. `None` without a truth.
    pub deflected: Option<usize>,
    /// Of these, those with a direction.
    pub solved: usize,
    /// Of these, those without a direction whose status says so and why.
    pub abstained: usize,
    /// Of these, those with neither: absent, called direct, or without a reason. `None` without a truth.
    pub missed: Option<usize>,
    /// Solved elements that are direct, blocked or lost in truth, or do not exist. `None` without a truth.
    #[serde(rename = "false")]
    pub wrong: Option<usize>,
}

/// Elements, deflected and unsplit in truth, that their own boards leave open.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct OpenCounts {
    /// How many there are.
    pub elements: usize,
    /// Of these, those without a direction whose status says so and why: that is right.
    pub abstained: usize,
    /// Of these, those with a direction.
    pub solved: usize,
    /// Of the solved ones, those whose truth lies outside of the 99.9 % ellipse that is stated.
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
    /// Largest.
    pub max: f64,
}

/// Errors of d, in millimetres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DistanceError {
    /// Root mean square.
    pub rms: f64,
    /// Largest absolute value.
    pub max: f64,
}

/// Root mean square displacement of a point, in millimetres, at three distances behind the mirror.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PointError {
    /// At 1 m.
    pub at_1m: f64,
    /// At 4 m.
    pub at_4m: f64,
    /// At 10 m.
    pub at_10m: f64,
}

/// Elements that are reported apart: split at an edge, or reflected more than once.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ApartScore {
    /// How many there are in truth.
    pub elements: usize,
    /// How many the calibration solved.
    pub solved: usize,
    /// Per-axis error of the chief ray, over those whose chief ray is deflected once.
    pub per_axis_rms_deg: f64,
}

/// A score: what `score --json` prints. A figure that does not exist is NaN.
#[derive(Debug, Clone, Serialize)]
pub struct Score {
    /// Version of this format.
    pub schema_version: u32,
    /// Method of the calibration.
    pub method: String,
    /// What it comes to.
    pub verdict: Verdict,
    /// Whether errors are as large as the stated covariance says; `None` where nothing tells.
    pub honesty: Option<Honesty>,
    /// What became of the elements.
    pub beams: BeamCounts,
    /// What became of the elements that the boards leave open. `None` without a truth.
    pub open: Option<OpenCounts>,
    /// How many elements the calibration gives each status; "absent" for those it does not mention.
    pub statuses: BTreeMap<&'static str, usize>,
    /// Angle between estimated and true direction, in the sensor frame.
    pub direction_deg: Spread,
    /// Root mean square of (cos φ·δθ, δφ), in the sensor frame.
    pub per_axis_rms_deg: f64,
    /// Angle of the rotation that all scored elements share.
    pub common_mode_deg: f64,
    /// Per-axis error that is left once that rotation is taken out.
    pub differential_per_axis_rms_deg: f64,
    /// Angle between estimated and true direction in the room: with the rig as tracked and the mounting as
    /// calibrated, against rig and mounting as they were.
    pub direction_room_deg: Spread,
    /// Per-axis error in the room: length of the error over √2.
    pub per_axis_rms_room_deg: f64,
    /// Angle of the shared rotation in the room.
    pub common_mode_room_deg: f64,
    /// Error of d.
    pub distance_mm: DistanceError,
    /// Error of a point, in the sensor frame.
    pub point_mm: PointError,
    /// Error of a point in the room.
    pub point_room_mm: PointError,
    /// Mean normalised estimation error squared.
    #[doc(alias = "ANEES")]
    pub nees_mean: f64,
    /// Share of elements whose error is inside its own 95 % ellipse.
    pub coverage_95: f64,
    /// Per-axis bound: what the best of all estimates could reach with these data.
    #[doc(alias = "CRLB")]
    pub crlb_per_axis_deg: f64,
    /// Per-axis bound on a method that treats every element by itself.
    #[doc(alias = "CRLB")]
    pub alone_crlb_per_axis_deg: f64,
    /// Bound over error, as mean squares; 1 is the best that can be expected, and one run scatters about it.
    pub efficiency: f64,
    /// Elements that are split in truth.
    pub split: ApartScore,
    /// Elements that are reflected more than once in truth.
    pub multi_bounce: ApartScore,
    /// Point-to-board residuals of the solved elements.
    pub boards_mm: SurfaceResidual,
    /// Point-to-wall residuals of the solved elements in the empty room, which no method fits angles to.
    pub walls_mm: SurfaceResidual,
    /// Why a figure is null, by its key.
    pub nulls: BTreeMap<&'static str, &'static str>,
    /// What a reader should know, in words; the reasons of a failure first.
    pub warnings: Vec<String>,
    /// Errors of every solved element that the truth deflects once, split ones too.
    #[serde(skip)]
    pub elements: Vec<ElementError>,
}

impl Score {
    /// Sets a limit for the per-axis error, in degrees: a score above it, or without one, fails.
    ///
    /// A blind score stays blind, and one that rightly solves nothing, since the boards leave every element open, keeps
    /// its verdict.
    #[must_use]
    pub fn with_limit(mut self, max_rms_deg: f64) -> Self {
        let error = self.per_axis_rms_deg;
        match self.verdict {
            Verdict::Blind => self.warnings.push(format!(
                "the limit of {max_rms_deg}° was not tested: there is nothing to judge"
            )),
            Verdict::Pass | Verdict::Fail if self.rightly_solves_nothing() => self.warnings.push(format!(
                "the limit of {max_rms_deg}° was not tested: the boards leave every element open, and none is solved"
            )),
            Verdict::Pass | Verdict::Fail if error <= max_rms_deg => {}
            Verdict::Pass | Verdict::Fail => {
                self.verdict = Verdict::Fail;
                let found = if error.is_finite() {
                    format!("is {error:.4}°")
                } else {
                    "does not exist".to_owned()
                };
                self.warnings.insert(
                    0,
                    format!("fails: the per-axis error {found}, the limit is {max_rms_deg}°"),
                );
            }
        }
        self
    }

    fn rightly_solves_nothing(&self) -> bool {
        let open = self.open.map_or(0, |o| o.elements);
        self.beams.solved == 0 && open > 0 && Some(open) == self.beams.deflected
    }

    /// The errors that the accuracy is counted from: solved, deflected and unsplit.
    pub fn scored(&self) -> impl Iterator<Item = &ElementError> {
        self.elements.iter().filter(|e| e.class == BeamClass::Deflected)
    }
}
