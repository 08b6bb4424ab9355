//! The result: `calibration.json`, which third-party calibrators submit as well.

use crate::assessment::Assessment;
use crate::beam::Deflection;
use crate::bias::RangeBias;
use crate::dataset::Dataset;
use crate::error::ModelError;
use crate::limits;
pub use crate::mount::MountEstimate;
use crate::scan::ScanAngles;
use crate::session::Session;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Version of `calibration.json`. Version 1 had neither `scanner` nor `dataset`.
pub const SCHEMA_VERSION: u32 = 2;

crate::closed_set! {
    /// Outcome for an element.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
    #[serde(rename_all = "snake_case")]
    pub enum Status {
        /// θ_a and φ were estimated.
        Solved,
        /// No mirror deflects it.
        Direct,
        /// Fewer boards than the angles need.
        TooFewPoses,
        /// The boards do not determine both angles.
        Unobservable,
        /// The iteration did not converge.
        NotConverged,
        /// Its readings are not consistent with one beam on one board.
        Rejected,
    }
}

impl Status {
    /// The word used in files.
    pub fn word(self) -> &'static str {
        match self {
            Self::Solved => "solved",
            Self::Direct => "direct",
            Self::TooFewPoses => "too_few_poses",
            Self::Unobservable => "unobservable",
            Self::NotConverged => "not_converged",
            Self::Rejected => "rejected",
        }
    }
}

/// The result for one element. An unobservable angle is absent, never a number.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BeamEstimate {
    /// Index of the beam, from 0.
    #[schemars(range(max = limits::LAST_BEAM))]
    pub beam: usize,
    /// Its status.
    pub status: Status,
    /// Why it was not solved.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Facet that deflects it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub facet: Option<String>,
    /// θ_a, in radians.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -limits::TURN_DEG, max = limits::TURN_DEG))]
    pub azimuth_rad: Option<f64>,
    /// φ, in radians.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -limits::TURN_DEG, max = limits::TURN_DEG))]
    pub elevation_rad: Option<f64>,
    /// d, in meters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -limits::FAR_M, max = limits::FAR_M))]
    pub distance_m: Option<f64>,
    /// Standard deviation of d under all assumed errors, in meters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = limits::FAR_M))]
    pub distance_sd_m: Option<f64>,
    /// Covariance of (θ_a, φ) under all assumed errors, in square radians.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(inner(range(min = -limits::ANY, max = limits::ANY))))]
    pub covariance_rad2: Option<[[f64; 2]; 2]>,
    /// The paper's covariance, σ²(HᵀH)⁻¹ with range noise alone, in square radians.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(inner(range(min = -limits::ANY, max = limits::ANY))))]
    pub noise_covariance_rad2: Option<[[f64; 2]; 2]>,
    /// Direction in (θ_a, φ) that the boards do not determine.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = -limits::ANY, max = limits::ANY)))]
    pub null_direction: Option<[f64; 2]>,
    /// Number of boards used.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = limits::COUNT))]
    pub poses: Option<usize>,
    /// Number of readings used.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = limits::COUNT))]
    pub readings: Option<usize>,
    /// Number of iterations.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = limits::COUNT))]
    pub iterations: Option<usize>,
    /// Root mean square of the residuals over the boards, in meters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -limits::FAR_M, max = limits::FAR_M))]
    pub rms_residual_m: Option<f64>,
}

/// The result for one facet: the plane m·x = h in the sensor frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FacetEstimate {
    /// Name.
    pub facet: String,
    /// Unit normal m.
    #[schemars(inner(range(min = -limits::ANY, max = limits::ANY)))]
    pub normal: [f64; 3],
    /// h, in meters.
    #[schemars(range(min = -limits::FAR_M, max = limits::FAR_M))]
    pub offset_m: f64,
    /// Covariance of (two tilts in radians, offset in meters).
    #[schemars(inner(inner(range(min = -limits::ANY, max = limits::ANY))))]
    pub covariance: [[f64; 3]; 3],
}

/// A calibration: one entry for each element that was analyzed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// Version of this file's format.
    #[schemars(range(min = 1, max = SCHEMA_VERSION))]
    pub schema_version: u32,
    /// Name of the method.
    pub method: String,
    /// Frame of the angles; always "sensor".
    pub frame: String,
    /// The scanner it belongs to; not checked if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scanner: Option<ScanAngles>,
    /// [`Dataset::id`] of the dataset it was made from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dataset: Option<String>,
    /// The elements.
    pub beams: Vec<BeamEstimate>,
    /// The facets, for methods that estimate them.
    #[serde(default)]
    pub facets: Vec<FacetEstimate>,
    /// The mounting, for methods that estimate it.
    #[serde(default)]
    pub rig_from_sensor: Option<MountEstimate>,
    /// Range biases, for methods that estimate them.
    #[serde(default)]
    pub bias: Option<RangeBias>,
    /// Notes by the method about the dataset, as text for the user.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// Self-assessment, for methods that provide one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub assessment: Option<Assessment>,
}

impl BeamEstimate {
    /// An element without angles.
    pub fn without_angles(beam: usize, status: Status, reason: Option<String>) -> Self {
        Self {
            beam,
            status,
            reason,
            facet: None,
            azimuth_rad: None,
            elevation_rad: None,
            distance_m: None,
            distance_sd_m: None,
            covariance_rad2: None,
            noise_covariance_rad2: None,
            null_direction: None,
            poses: None,
            readings: None,
            iterations: None,
            rms_residual_m: None,
        }
    }

    /// θ_a, φ and d of a solved element.
    pub fn deflection(&self) -> Option<Deflection> {
        (self.status == Status::Solved).then_some(())?;
        Some(Deflection {
            azimuth: self.azimuth_rad?,
            elevation: self.elevation_rad?,
            distance: self.distance_m.unwrap_or(0.0),
        })
    }
}

impl Calibration {
    /// Whether it belongs to the scanner of a session, as far as it states one.
    ///
    /// # Errors
    /// [`ModelError::OtherScanner`].
    pub fn check_scanner(&self, session: &Session) -> Result<(), ModelError> {
        let dataset = *session.scanner.scan.angles();
        match self.scanner {
            Some(calibration) if !calibration.same_as(&dataset) => {
                Err(ModelError::OtherScanner { calibration, dataset })
            }
            _ => Ok(()),
        }
    }

    /// The dataset it was made from and the given one, if their identifiers differ.
    pub fn other_dataset<'a>(&'a self, dataset: &'a Dataset) -> Option<[&'a str; 2]> {
        let ids = [self.dataset.as_deref()?, dataset.id.as_deref()?];
        (!ids[0].eq_ignore_ascii_case(ids[1])).then_some(ids)
    }

    /// The entry of a beam.
    pub fn beam(&self, beam: usize) -> Option<&BeamEstimate> {
        // Our own files list every element in order; third-party files may not.
        self.beams
            .get(beam)
            .filter(|b| b.beam == beam)
            .or_else(|| self.beams.iter().find(|b| b.beam == beam))
    }
}
