//! The types of a score: its counts and figures, as written by `score --json`.

use super::gate::Gate;
use super::mistake::Mistake;
use super::residual::Normalized;
use super::verdict::{Honesty, Verdict};
use super::{ElementError, Mounting, SurfaceResidual};
use catoptric_sim::truth::BeamClass;
use serde::Serialize;
use std::collections::BTreeMap;

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
    /// Error of the stated range biases at the reference where it is largest in units of its standard deviation, in
    /// millimeters.
    pub range_bias_mm: f64,
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
    /// Solved elements that state a covariance, and are known by it.
    #[serde(skip)]
    pub(super) blind_stated: usize,
    /// Solved elements that state to be hardly known.
    #[serde(skip)]
    pub(super) useless: usize,
    /// Residuals of each mirror's elements on the boards and on the walls, on blind data.
    #[serde(skip)]
    pub(super) boards_by_mirror: Vec<Normalized>,
    #[serde(skip)]
    pub(super) walls_by_mirror: Vec<Normalized>,
}

impl Score {
    /// The elements that accuracy is computed over: solved, deflected and unsplit.
    pub fn scored(&self) -> impl Iterator<Item = &ElementError> {
        self.elements.iter().filter(|e| e.class == BeamClass::Deflected)
    }
}
