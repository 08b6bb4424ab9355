//! The result: `calibration.json`, which is also what anybody's own calibrator submits.

use crate::assessment::Assessment;
use crate::beam::Deflection;
use crate::bias::RangeBias;
use crate::dataset::Dataset;
use crate::error::ModelError;
use crate::frame::PoseData;
use crate::scan::ScanAngles;
use crate::session::Session;
use serde::{Deserialize, Serialize};

/// Version of `calibration.json`. Version 1 had neither `scanner` nor `dataset`.
pub const SCHEMA_VERSION: u32 = 2;

/// What became of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
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
    /// The iteration did not settle.
    NotConverged,
    /// Its readings are not those of one beam on one board.
    Rejected,
}

impl Status {
    /// All of them, in the order of the file format's documentation.
    pub const ALL: [Self; 6] = [
        Self::Solved,
        Self::Direct,
        Self::TooFewPoses,
        Self::Unobservable,
        Self::NotConverged,
        Self::Rejected,
    ];

    /// The word files use.
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

/// What is known about one element. An angle that cannot be observed is absent, never a number.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BeamEstimate {
    /// Index of the beam, from 0.
    pub beam: usize,
    /// What became of it.
    pub status: Status,
    /// Why it was not solved.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Facet that deflects it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub facet: Option<String>,
    /// θ_a, in radians.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub azimuth_rad: Option<f64>,
    /// φ, in radians.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub elevation_rad: Option<f64>,
    /// d, in metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distance_m: Option<f64>,
    /// Covariance of (θ_a, φ) under every error believed in, in square radians.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance_rad2: Option<[[f64; 2]; 2]>,
    /// The paper's own covariance, σ²(HᵀH)⁻¹ with range noise alone, in square radians.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise_covariance_rad2: Option<[[f64; 2]; 2]>,
    /// Direction in (θ_a, φ) that the boards leave free.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub null_direction: Option<[f64; 2]>,
    /// Boards used.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub poses: Option<usize>,
    /// Readings used.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub readings: Option<usize>,
    /// Steps of the iteration.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub iterations: Option<usize>,
    /// Root mean square of the residuals over the boards, in metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rms_residual_m: Option<f64>,
}

/// What is known about one facet: the plane m·x = h in the sensor frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FacetEstimate {
    /// Name.
    pub facet: String,
    /// Unit normal m.
    pub normal: [f64; 3],
    /// h, in metres.
    pub offset_m: f64,
    /// Covariance of (two tilts in radians, offset in metres).
    pub covariance: [[f64; 3]; 3],
}

/// Where the sensor sits in the rig body.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MountEstimate {
    /// Origin of the sensor in the rig frame, in metres.
    pub translation_m: [f64; 3],
    /// Rotation from sensor to rig (x, y, z, w).
    pub rotation_xyzw: [f64; 4],
    /// Covariance of a small motion of the sensor frame: three shifts in metres, three turns in radians, about the
    /// sensor's own axes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance: Option<[[f64; 6]; 6]>,
}

/// A calibration: one entry for each element that was looked at.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// Version of this file's format.
    pub schema_version: u32,
    /// Name of the method.
    pub method: String,
    /// Frame of the angles; always "sensor".
    pub frame: String,
    /// The scanner that it is of; unless it is given, nothing is checked.
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
    /// What the method noticed about the dataset that its user should know, in words.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// How far it is to be believed, for methods that can tell.
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

impl MountEstimate {
    /// The pose `rig_from_sensor`.
    pub fn pose(&self) -> crate::frame::Pose {
        (&PoseData {
            translation_m: self.translation_m,
            rotation_xyzw: self.rotation_xyzw,
        })
            .into()
    }
}

impl Calibration {
    /// Whether it is of the scanner of a session, as far as it says.
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

    /// The dataset it was made from, and this one, if it says that they are two.
    pub fn other_dataset<'a>(&'a self, dataset: &'a Dataset) -> Option<[&'a str; 2]> {
        let ids = [self.dataset.as_deref()?, dataset.id.as_deref()?];
        (!ids[0].eq_ignore_ascii_case(ids[1])).then_some(ids)
    }

    /// The entry of a beam.
    pub fn beam(&self, beam: usize) -> Option<&BeamEstimate> {
        // Our own files list every element in order; others' need not.
        self.beams
            .get(beam)
            .filter(|b| b.beam == beam)
            .or_else(|| self.beams.iter().find(|b| b.beam == beam))
    }
}
