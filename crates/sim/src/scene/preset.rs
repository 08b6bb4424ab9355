//! The scanner's presets: numbers from data sheets, and from Cooper's Table 1.
//!
//! To add a preset, add its variant, and its data with their sources to the table.

use super::sheet::{BeamShape, HousingBox, Limits};
use catoptric_model::ScanDirection;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

catoptric_model::closed_set! {
    /// The model of the scanner.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
    pub enum Preset {
        /// Hokuyo UST-20LX with the spot given in its manual: 160 × 25 mm at 10 m.
        #[serde(rename = "ust-20lx")]
        Ust20lx,
        /// The same with the spot of Cooper's Table 1, read as three neighboring beams.
        #[serde(rename = "ust-20lx-cooper")]
        Ust20lxCooper,
        /// Hokuyo UTM-30LX-EW: up to three echoes per beam, 30 m. Its spot is assumed to be the UST-20LX's.
        #[serde(rename = "utm-30lx-ew")]
        Utm30lxEw,
        /// A custom scanner: `scanner.custom` and `scanner.beam`. Its beams are the 1081 of the others, 0.25° apart.
        #[serde(rename = "custom")]
        Custom,
    }
}

/// What is known of a scanner.
struct Data {
    /// The name used in files.
    name: &'static str,
    /// What it can report, and when.
    limits: Limits,
    /// Boxes of its housing in the sensor frame.
    housing: &'static [HousingBox],
    /// Shape of a beam.
    beam: BeamShape,
    /// Mass in grams, if it is known.
    mass_g: Option<f64>,
}

impl Preset {
    /// The table of the presets.
    const fn data(self) -> &'static Data {
        match self {
            Self::Ust20lx => &Data {
                name: "ust-20lx",
                limits: UST_20LX,
                housing: &UST_20LX_HOUSING,
                beam: MANUAL_SPOT,
                mass_g: UST_20LX_MASS,
            },
            Self::Ust20lxCooper => &Data {
                name: "ust-20lx-cooper",
                limits: UST_20LX,
                housing: &UST_20LX_HOUSING,
                beam: TABLE_1_SPOT,
                mass_g: UST_20LX_MASS,
            },
            Self::Utm30lxEw => &Data {
                name: "utm-30lx-ew",
                limits: UTM_30LX_EW,
                housing: &UTM_30LX_EW_HOUSING,
                // No spot is published for it, which is of the same maker and wavelength: assumed equal.
                beam: MANUAL_SPOT,
                // Data sheet: about 210 g.
                mass_g: Some(210.0),
            },
            // The scene defines its limits and its beam; these are defaults.
            Self::Custom => &Data {
                name: "custom",
                limits: UST_20LX,
                housing: &UST_20LX_HOUSING,
                beam: MANUAL_SPOT,
                mass_g: None,
            },
        }
    }

    /// The name used in files.
    pub fn name(self) -> &'static str {
        self.data().name
    }

    /// What the scanner can report.
    pub fn limits(self) -> Limits {
        self.data().limits
    }

    /// Boxes of its housing in the sensor frame. A custom scanner without boxes has those of the UST-20LX.
    pub fn housing(self) -> &'static [HousingBox] {
        self.data().housing
    }

    /// Shape of a beam. A custom scanner defines its own.
    pub fn beam_shape(self) -> BeamShape {
        self.data().beam
    }

    /// Mass in grams; `None` for a custom scanner.
    pub fn mass_g(self) -> Option<f64> {
        self.data().mass_g
    }
}

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

/// Mass of the UST-20LX, in grams (data sheet: about 130 g).
const UST_20LX_MASS: Option<f64> = Some(130.0);

/// Spot of the UST-20LX: 160 × 25 mm at 10 m to the front, 25 × 160 mm to the side (Hokuyo's manual).
const MANUAL_SPOT: BeamShape = BeamShape {
    wide_full_mrad: 16.0,
    narrow_full_mrad: 2.5,
    wide_aperture_mm: 0.0,
    narrow_aperture_mm: 0.0,
    turns: true,
};

/// Table 1 as the union of three neighbors: width 33.6 mrad·R minus two steps of 0.25°, height 3.0 mm + 0.85 mrad·R. The
/// interpretation as a union is assumed. 33.6 mrad is the slope through the origin of all widths except that at 2 m, which
/// is 12 mm below the line between its neighbors at 1 m and 3 m.
const TABLE_1_SPOT: BeamShape = BeamShape {
    wide_full_mrad: 24.9,
    narrow_full_mrad: 0.85,
    wide_aperture_mm: 0.0,
    narrow_aperture_mm: 3.0,
    turns: true,
};

impl Default for Limits {
    fn default() -> Self {
        UST_20LX
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Mount, Scanner};
    use catoptric_model::ScanGeometry;

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
        for preset in Preset::ALL {
            let size = match preset {
                Preset::Ust20lx | Preset::Ust20lxCooper | Preset::Custom => [50.0, 50.0, 70.0],
                Preset::Utm30lxEw => [62.0, 62.0, 87.5],
            };
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
    fn every_preset_has_its_word_in_files() {
        for preset in Preset::ALL {
            let word = toml::Value::try_from(preset).expect("a word");
            assert_eq!(word.as_str(), Some(preset.name()));
        }
    }

    #[test]
    fn the_presets_scan_as_their_data_sheets_say() {
        for preset in Preset::ALL {
            let expected = match preset {
                // All of Hokuyo's scan 1081 beams in steps of 0.25°, 40 times a second.
                Preset::Ust20lx | Preset::Ust20lxCooper | Preset::Utm30lxEw | Preset::Custom => {
                    ScanGeometry::default()
                }
            };
            let scanner = Scanner {
                preset,
                sub_rays: 1,
                beam: None,
                custom: None,
                housing: true,
                housing_box: None,
                mount: Mount::default(),
            };
            assert_eq!(scanner.scan(), Ok(expected), "{preset:?}");
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
