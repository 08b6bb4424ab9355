//! What the experimenter knows about the eight mirrors.

use super::structure::Mirror;
use catoptric_model::session::{
    self, BareStructure, Beliefs, BoardSheet, Marker, MountTolerance, NominalFacet, RoomSurvey, ScannerSheet,
};
use catoptric_model::{Pose, PoseData, RangeBias, Session, beam};

/// The session: scanner, room, beliefs, mirrors as drawn, one board.
pub(super) fn session(mirrors: &[Mirror]) -> Session {
    let marker = |name: &str, x: f64, y: f64| Marker {
        name: name.to_owned(),
        position_mm: [x, y, 0.0],
    };
    Session {
        schema_version: session::SCHEMA_VERSION,
        name: "eight mirrors".to_owned(),
        scanner: ScannerSheet {
            preset: "ust-20lx".to_owned(),
            beams: beam::COUNT,
            step_deg: 0.25,
            scan_rate_hz: 40.0,
            range_min_m: 0.02,
            range_max_m: 30.0,
            divergence_full_mrad: 16.0,
        },
        nominal_rig_from_sensor: PoseData::from(&Pose::translation(0.0, 0.0, -0.04)),
        mount_tolerance: MountTolerance {
            rotation_sd_deg: [0.5, 0.5, 0.2],
            translation_sd_mm: [0.5, 0.5, 0.5],
        },
        room: Some(RoomSurvey {
            min_m: [-3.0, -4.0, 0.0],
            max_m: [5.0, 3.5, 3.0],
            color: "white".to_owned(),
        }),
        believed: Beliefs {
            range_noise_sd_mm: 2.0,
            element_sd_mm: 0.0,
            drift_sd_mm: 0.9,
            marker_sd_mm: 0.2,
            bias: RangeBias::default(),
            distance_bias_sd_mm: 1.0,
            angle_gain_sd_mm: 1.0,
            color_bias_sd_mm: 1.0,
        },
        bare_structure: BareStructure {
            mirror_thickness_mm: 1.0,
            distance_sd_mm: 0.5,
            scanned: false,
            first_beam: 0,
            distance_m: Vec::new(),
        },
        rig_markers: vec![
            marker("a", 75.0, 75.0),
            marker("b", -75.0, 75.0),
            marker("c", 75.0, -75.0),
        ],
        facets: mirrors
            .iter()
            .map(|m| NominalFacet {
                name: m.name.to_owned(),
                corners_mm: m.corners.iter().map(|c| (c.coords * 1e3).into()).collect(),
                beams: m
                    .azimuth_deg
                    .map(|a| beam::nearest(a.to_radians()).expect("mirrors stand before the scanner")),
            })
            .collect(),
        boards: vec![BoardSheet {
            name: "board".to_owned(),
            width_mm: 1200.0,
            height_mm: 900.0,
            color: "white".to_owned(),
            markers: vec![
                marker("1", -580.0, -430.0),
                marker("2", 580.0, -430.0),
                marker("3", 580.0, 430.0),
                marker("4", -580.0, 430.0),
            ],
        }],
    }
}
