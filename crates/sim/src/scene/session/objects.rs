//! Scanner, room, structure and boards, laid over those of the written session.

use super::over::{LieOver, overlay};
use catoptric_model::glass::GlassSheet;
use catoptric_model::session::{
    BareStructure, BoardSheet, Marker, MountTolerance, NominalFacet, RoomSurvey, ScannerSheet,
};
use catoptric_model::{PoseData, ScanAngles, ScanDirection, ScanError, ScanGeometry};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The scanner's data sheet.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ScannerOverlay {
    /// Name of the preset.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub preset: Option<String>,
    /// Number of beams, which must be that of the scanner.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 65536))]
    pub beams: Option<usize>,
    /// Angle between neighboring beams, in degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1e-6, max = 360.0))]
    pub step_deg: Option<f64>,
    /// Azimuth of the first beam, in degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub first_deg: Option<f64>,
    /// Sense of rotation seen from above.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<DirectionSchema>")]
    pub direction: Option<ScanDirection>,
    /// Scans per second.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.001, max = 10000.0))]
    pub scan_rate_hz: Option<f64>,
    /// Time from one beam to the next, in microseconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1e6))]
    pub beam_time_us: Option<f64>,
    /// Shortest range, in meters.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 10000.0))]
    pub range_min_m: Option<f64>,
    /// Longest range, in meters.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.01, max = 10000.0))]
    pub range_max_m: Option<f64>,
    /// Full 1/e² divergence of a beam along the longer axis of its spot, in milliradians.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub divergence_full_mrad: Option<f64>,
}

/// Sense of rotation seen from above.
#[derive(JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "SessionScanDirection")]
#[allow(dead_code)] // Read by the schema generator alone.
enum DirectionSchema {
    Ccw,
    Cw,
}

impl ScannerOverlay {
    /// Lays this over a data sheet.
    pub(super) fn lie_over_sheet(&self, sheet: &mut ScannerSheet) -> Result<(), ScanError> {
        if let Some(preset) = &self.preset {
            sheet.preset.clone_from(preset);
        }
        let changes = [
            (self.range_min_m, &mut sheet.range_min_m),
            (self.range_max_m, &mut sheet.range_max_m),
            (self.divergence_full_mrad, &mut sheet.divergence_full_mrad),
        ];
        for (new, old) in changes {
            *old = new.unwrap_or(*old);
        }
        sheet.scan = self.scan_over(&sheet.scan)?;
        Ok(())
    }

    /// The scan geometry with this laid over it.
    pub(crate) fn scan_over(&self, scan: &ScanGeometry) -> Result<ScanGeometry, ScanError> {
        let drawn = *scan.angles();
        let angles = ScanAngles {
            first_deg: self.first_deg.unwrap_or(drawn.first_deg),
            step_deg: self.step_deg.unwrap_or(drawn.step_deg),
            beams: self.beams.unwrap_or(drawn.beams),
            direction: self.direction.unwrap_or(drawn.direction),
        };
        if angles == drawn && self.scan_rate_hz.is_none() && self.beam_time_us.is_none() {
            return Ok(*scan);
        }
        let rate = self.scan_rate_hz.unwrap_or(scan.scan_rate_hz());
        let beam_time_us = self.beam_time_us.unwrap_or(scan.beam_time_s() * 1e6);
        ScanGeometry::new(angles, rate, Some(beam_time_us))
    }
}

overlay! {
    /// A pose.
    PoseOverlay over PoseData {
        /// Origin, in meters.
        #[schemars(inner(range(min = -10000.0, max = 10000.0)))]
        translation_m: [f64; 3],
        /// Rotation as a unit quaternion (x, y, z, w).
        #[schemars(inner(range(min = -1.0, max = 1.0)))]
        rotation_xyzw: [f64; 4],
    }
}

overlay! {
    /// Tolerance of the nominal pose, 1σ.
    MountToleranceOverlay over MountTolerance {
        /// Rotation about x, y and z, in degrees.
        #[schemars(inner(range(min = 0.0, max = 180.0)))]
        rotation_sd_deg: [f64; 3],
        /// Shift along x, y and z, in millimeters.
        #[schemars(inner(range(min = 0.0, max = 1000.0)))]
        translation_sd_mm: [f64; 3],
    }
}

overlay! {
    /// The room as surveyed.
    RoomOverlay over RoomSurvey {
        /// Corner with the smallest coordinates, in meters.
        #[schemars(inner(range(min = -10000.0, max = 10000.0)))]
        min_m: [f64; 3],
        /// Corner with the largest coordinates, in meters.
        #[schemars(inner(range(min = -10000.0, max = 10000.0)))]
        max_m: [f64; 3],
        /// Color of walls, floor and ceiling.
        color: String,
    }
}

overlay! {
    /// The bare structure.
    BareStructureOverlay over BareStructure {
        /// Thickness of the mirrors along their normals, in millimeters.
        #[schemars(range(min = 0.0, max = 100.0))]
        mirror_thickness_mm: f64,
        /// Uncertainty of a bare distance, in millimeters.
        #[schemars(range(min = 0.0, max = 1000.0))]
        distance_sd_mm: f64,
        /// Error of a bare distance that no other beam shares, in millimeters.
        #[schemars(range(min = 0.0, max = 1000.0))]
        noise_sd_mm: f64,
        /// Whether the scanner itself measured the distances.
        scanned: bool,
        /// First beam of `distance_m`.
        #[schemars(range(min = 0, max = 65535))]
        first_beam: usize,
        /// Range of each beam to the bare structure, in meters; 0 if there is none.
        #[schemars(inner(range(min = 0.0, max = 10000.0)))]
        distance_m: Vec<f64>,
    }
}

overlay! {
    /// Glass in front of the mirrors.
    GlassOverlay over GlassSheet {
        /// Thickness, in millimeters; 0 for none.
        #[schemars(range(min = 0.0, max = 100.0))]
        thickness_mm: f64,
        /// Uncertainty of the thickness, 1σ, in millimeters.
        #[schemars(range(min = 0.0, max = 100.0))]
        thickness_sd_mm: f64,
        /// Refractive index.
        #[schemars(range(min = 1.0, max = 4.0))]
        index: f64,
    }
}

overlay! {
    /// A marker.
    named MarkerOverlay over Marker {
        /// Position in its body's frame, in millimeters.
        #[schemars(inner(range(min = -100000.0, max = 100000.0)))]
        position_mm: [f64; 3],
    }
}

overlay! {
    /// A mirror as drawn.
    named FacetOverlay over NominalFacet {
        /// Corners in the nominal sensor frame, in millimeters.
        #[schemars(length(min = 3), inner(inner(range(min = -100000.0, max = 100000.0))))]
        corners_mm: Vec<[f64; 3]>,
        /// First and last beam that hit this facet, according to the drawing.
        #[schemars(inner(range(min = 0, max = 65535)))]
        beams: [usize; 2],
    }
}

overlay! {
    /// A target board.
    named BoardOverlay over BoardSheet {
        /// Extent along its x axis, in millimeters.
        #[schemars(range(min = 1.0, max = 100000.0))]
        width_mm: f64,
        /// Extent along its y axis, in millimeters.
        #[schemars(range(min = 1.0, max = 100000.0))]
        height_mm: f64,
        /// How far its face is in front of the plane of its markers, in millimeters.
        #[schemars(range(min = 0.0, max = 100.0))]
        thickness_mm: f64,
        /// Color.
        color: String,
        /// Its markers, by name.
        markers: Vec<MarkerOverlay>,
    }
}
