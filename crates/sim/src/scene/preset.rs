//! The scanner's presets: numbers from data sheets, and from Cooper's Table 1.

use super::scanner::{BeamShape, HousingBox, Limits, Preset, Scanner};
use catoptric_model::{ScanAngles, ScanDirection, ScanError, ScanGeometry};

/// Limits of the UST-20LX (data sheet): 40 Hz, 20 m, one echo. Its accuracy is specified from 60 mm on, but it reports
/// ranges from 21 mm on.
const UST_20LX: Limits = Limits {
    range_min_m: 0.021,
    range_max_m: 20.0,
    first_deg: -135.0,
    step_deg: 0.25,
    beams: 1081,
    direction: ScanDirection::Ccw,
    scan_rate_hz: 40.0,
    beam_time_us: None,
    echoes: 1,
};

/// Limits of the UTM-30LX-EW (data sheet): 25 ms per scan, 0.1 to 30 m, up to three echoes per beam, 905 nm. It is
/// assumed that it reports nothing closer than the specified 0.1 m.
const UTM_30LX_EW: Limits = Limits {
    range_min_m: 0.1,
    range_max_m: 30.0,
    echoes: 3,
    // The same 270° in steps of 0.25°, and 40 Hz.
    ..UST_20LX
};

/// Housing of the UST-20LX in the sensor frame: the body below the window and the cap above it. It is 50 × 50 × 70 mm
/// (data sheet); how it is divided around the scan plane is assumed.
const UST_20LX_HOUSING: [HousingBox; 2] = [
    HousingBox {
        center_mm: [0.0, 0.0, -32.0],
        size_mm: [50.0, 50.0, 36.0],
    },
    HousingBox {
        center_mm: [0.0, 0.0, 16.0],
        size_mm: [40.0, 40.0, 8.0],
    },
];

/// Housing of the UTM-30LX-EW, likewise: 62 × 62 × 87.5 mm (data sheet). The scan plane 55 mm above its base is that of
/// common robot models of the UTM-30LX; the window, as high as the UST-20LX's, and the width of the cap are assumed.
const UTM_30LX_EW_HOUSING: [HousingBox; 2] = [
    HousingBox {
        center_mm: [0.0, 0.0, -34.5],
        size_mm: [62.0, 62.0, 41.0],
    },
    HousingBox {
        center_mm: [0.0, 0.0, 22.25],
        size_mm: [50.0, 50.0, 20.5],
    },
];

impl Preset {
    /// The name used in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ust20lx => "ust-20lx",
            Self::Ust20lxCooper => "ust-20lx-cooper",
            Self::Utm30lxEw => "utm-30lx-ew",
            Self::Custom => "custom",
        }
    }

    /// What the scanner can report.
    pub fn limits(self) -> Limits {
        match self {
            Self::Ust20lx | Self::Ust20lxCooper | Self::Custom => UST_20LX,
            Self::Utm30lxEw => UTM_30LX_EW,
        }
    }

    /// Boxes of its housing in the sensor frame. A custom scanner without boxes has those of the UST-20LX.
    pub fn housing(self) -> &'static [HousingBox] {
        match self {
            Self::Ust20lx | Self::Ust20lxCooper | Self::Custom => &UST_20LX_HOUSING,
            Self::Utm30lxEw => &UTM_30LX_EW_HOUSING,
        }
    }

    /// Shape of a beam.
    pub fn beam_shape(self) -> BeamShape {
        match self {
            // 160 × 25 mm at 10 m to the front, 25 × 160 mm to the side (Hokuyo's manual). No spot is published for the
            // UTM-30LX-EW, of the same maker and wavelength: assumed equal. A custom scanner defines its own.
            Self::Ust20lx | Self::Utm30lxEw | Self::Custom => BeamShape {
                wide_full_mrad: 16.0,
                narrow_full_mrad: 2.5,
                wide_aperture_mm: 0.0,
                narrow_aperture_mm: 0.0,
                turns: true,
            },
            // Table 1 as the union of three neighbors: width 33.6 mrad·R minus two steps of 0.25°, height 3.0 mm + 0.85
            // mrad·R. The interpretation as a union is assumed. 33.6 mrad is the slope through the origin of all widths
            // except that at 2 m, which is 12 mm below the line between its neighbors at 1 m and 3 m.
            Self::Ust20lxCooper => BeamShape {
                wide_full_mrad: 24.9,
                narrow_full_mrad: 0.85,
                wide_aperture_mm: 0.0,
                narrow_aperture_mm: 3.0,
                turns: true,
            },
        }
    }
}

impl Scanner {
    /// Shape of a beam: the scene's, otherwise the preset's.
    pub fn beam_shape(&self) -> BeamShape {
        self.beam.unwrap_or_else(|| self.preset.beam_shape())
    }

    /// Boxes of the housing in the sensor frame: none, the scene's, or otherwise the preset's.
    pub fn housing_boxes(&self) -> &[HousingBox] {
        match (self.housing, &self.housing_box) {
            (false, _) => &[],
            (true, Some(boxes)) => boxes,
            (true, None) => self.preset.housing(),
        }
    }

    /// What the scanner can report: the scene's limits for a custom scanner, otherwise the preset's.
    pub fn limits(&self) -> Limits {
        match self.preset {
            Preset::Custom => self.custom.unwrap_or(UST_20LX),
            preset => preset.limits(),
        }
    }

    /// How it scans.
    ///
    /// # Errors
    /// [`ScanError`] names the first number under `scanner.custom` that no scan can have.
    pub fn scan(&self) -> Result<ScanGeometry, ScanError> {
        let limits = self.limits();
        let angles = ScanAngles {
            first_deg: limits.first_deg,
            step_deg: limits.step_deg,
            beams: limits.beams as usize,
            direction: limits.direction,
        };
        ScanGeometry::new(angles, limits.scan_rate_hz, limits.beam_time_us)
    }
}

impl Default for Limits {
    fn default() -> Self {
        UST_20LX
    }
}

impl Limits {
    /// Time from the start of one scan to the start of the next, in seconds.
    pub fn scan_period_s(&self) -> f64 {
        1.0 / self.scan_rate_hz
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Mount;

    /// Extents of all boxes together.
    fn extents(boxes: &[HousingBox]) -> [f64; 3] {
        [0, 1, 2].map(|axis| {
            let end = |sign: f64| {
                let ends = boxes
                    .iter()
                    .map(|b| b.center_mm[axis] + sign * 0.5 * b.size_mm[axis]);
                ends.map(|e| sign * e).fold(f64::NEG_INFINITY, f64::max)
            };
            end(1.0) + end(-1.0)
        })
    }

    #[test]
    fn housings_are_as_large_as_their_data_sheets_say_and_leave_the_scan_plane_free() {
        for (preset, size) in [
            (Preset::Ust20lx, [50.0, 50.0, 70.0]),
            (Preset::Ust20lxCooper, [50.0, 50.0, 70.0]),
            (Preset::Utm30lxEw, [62.0, 62.0, 87.5]),
        ] {
            assert_eq!(extents(preset.housing()), size, "{preset:?}");
            for part in preset.housing() {
                assert!(
                    part.center_mm[2].abs() > 0.5 * part.size_mm[2] + 10.0,
                    "{preset:?}"
                );
            }
        }
    }

    #[test]
    fn the_presets_scan_as_the_default_does() {
        for preset in [Preset::Ust20lx, Preset::Ust20lxCooper, Preset::Utm30lxEw] {
            let scanner = Scanner {
                preset,
                sub_rays: 1,
                beam: None,
                custom: None,
                housing: true,
                housing_box: None,
                mount: Mount::default(),
            };
            assert_eq!(scanner.scan(), Ok(ScanGeometry::default()), "{preset:?}");
        }
    }

    #[test]
    fn a_scene_can_have_no_housing_its_own_or_the_presets() {
        let own = HousingBox {
            center_mm: [0.0, 0.0, -40.0],
            size_mm: [60.0, 60.0, 50.0],
        };
        let boxes = |preset, housing, housing_box: Option<Vec<HousingBox>>| {
            let scanner = Scanner {
                preset,
                sub_rays: 1,
                beam: None,
                custom: None,
                housing,
                housing_box,
                mount: Mount::default(),
            };
            scanner.housing_boxes().to_vec()
        };
        assert!(boxes(Preset::Utm30lxEw, false, None).is_empty());
        assert_eq!(boxes(Preset::Utm30lxEw, true, None), UTM_30LX_EW_HOUSING);
        assert_eq!(boxes(Preset::Custom, true, None), UST_20LX_HOUSING);
        assert_eq!(boxes(Preset::Custom, true, Some(vec![own])), [own]);
    }
}
