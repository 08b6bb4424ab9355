//! Round trips of recordings and datasets. These tests do not show that third parties can read what we write:
//! `tests/mcap_peers.py` does, on the dataset of the last test of `datasets`.

mod datasets;
mod foreign;
mod recordings;
mod surveys;
mod unsteady;

use super::error::IoError;
use super::playback::parse_recording;
use super::*;
use catoptric_model::frame::{PoseData, yaw_pitch_roll};
use catoptric_model::session::*;
use catoptric_model::{
    Pose, PoseKind, PoseLabel, RangeBias, ScanAngles, ScanDirection, ScanGeometry, Session, Stretch, Track,
    TrackedFrame,
};
use nalgebra::{Point3, Translation3};
use std::io::{self, Write};
use std::path::Path;

const NAME: &str = "x.mcap";

/// A scan with a given number of beams, 40 times a second.
fn scan(step_deg: f64, beams: usize) -> ScanGeometry {
    let angles = ScanAngles::centered(step_deg, beams);
    ScanGeometry::new(angles, 40.0, None).expect("a valid scan")
}

/// A session with a rig, two boards and a scanner with a given number of beams.
pub(crate) fn session(beams: usize) -> Session {
    let marker = |name: &str, position_mm| Marker {
        name: name.to_owned(),
        position_mm,
    };
    let corners = [("a", -1.0, -1.0), ("b", 1.0, -1.0), ("c", -1.0, 1.0)];
    let board = |name: &str, color: &str| BoardSheet {
        name: name.to_owned(),
        width_mm: 600.0,
        height_mm: 400.0,
        thickness_mm: 0.0,
        color: color.to_owned(),
        markers: corners
            .map(|(n, x, y)| marker(n, [x * 280.0, y * 180.0, 0.0]))
            .into(),
    };
    let first = 2.min(beams - 1);
    Session {
        schema_version: SCHEMA_VERSION,
        name: "round trip".to_owned(),
        scanner: ScannerSheet {
            preset: "test".to_owned(),
            scan: scan(0.25, beams),
            range_min_m: 0.023,
            range_max_m: 60.0,
            divergence_full_mrad: 3.0,
        },
        nominal_rig_from_sensor: PoseData {
            translation_m: [0.01, 0.0, -0.1],
            rotation_xyzw: [0.0, 0.0, 0.6, 0.8],
        },
        mount_tolerance: MountTolerance {
            rotation_sd_deg: [0.5; 3],
            translation_sd_mm: [2.0; 3],
        },
        room: Some(RoomSurvey {
            min_m: [-5.0, -4.0, 0.0],
            max_m: [5.0, 4.0, 3.0],
            color: "white".to_owned(),
        }),
        believed: Beliefs {
            range_noise_sd_mm: 10.0,
            noise: None,
            noise_of: Default::default(),
            drift_sd_mm: 1.0,
            element_sd_mm: 0.0,
            marker_sd_mm: 0.2,
            bias: RangeBias::default(),
            distance_bias_sd_mm: 1.0,
            angle_gain_sd_mm: 0.5,
            color_bias_sd_mm: 0.5,
        },
        glass: None,
        bare_structure: BareStructure {
            mirror_thickness_mm: 3.0,
            distance_sd_mm: 1.0,
            noise_sd_mm: 0.0,
            scanned: false,
            first_beam: first,
            distance_m: [0.1, 0.0, 0.12].into_iter().take(beams - first).collect(),
        },
        rig_markers: vec![
            marker("top", [0.0, 0.0, 120.0]),
            marker("left", [0.0, 90.0, 40.0]),
            marker("right", [0.0, -90.0, 40.0]),
            marker("nose", [100.0, 0.0, 60.0]),
        ],
        facets: Vec::new(),
        boards: vec![board("white", "white"), board("black", "matte black")],
    }
}

/// A sequence of numbers in 0…1 (Lehmer's generator with Park and Miller's multiplier).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0 * 48_271 % 2_147_483_647;
        self.0 as f64 / 2_147_483_647.0
    }
}

/// Readings in whole millimeters as 32-bit numbers, with every code among them.
fn ranges(numbers: &mut Numbers, count: usize) -> Vec<f64> {
    let code = |r: f64| match r {
        r if r < 0.02 => f64::NEG_INFINITY,
        r if r < 0.2 => f64::INFINITY,
        r if r < 0.21 => f64::NAN,
        r => f64::from(super::messages::single((r * 1e4).round() / 1e3)),
    };
    (0..count).map(|_| code(numbers.next())).collect()
}

/// Motion capture of a body: occasionally without a pose or without every marker.
fn track(numbers: &mut Numbers, subject: &str, template: &[Marker], start_s: f64, frames: usize) -> Track {
    let mut center = || 2.0 * numbers.next() - 1.0;
    let turn = yaw_pitch_roll(center(), center(), center());
    let place = Translation3::new(center(), center(), 1.0 + center());
    let frames = (0..frames).map(|k| {
        let pose = Pose::from_parts(place, turn);
        let mut see = |m: &Marker| {
            let error = (numbers.next() - 0.5) * 1e-3;
            (numbers.next() > 0.1).then(|| pose * m.position() + nalgebra::Vector3::repeat(error))
        };
        let markers: Vec<Option<Point3<f64>>> = template.iter().map(&mut see).collect();
        TrackedFrame {
            time_s: start_s + k as f64 * 0.01,
            pose: (markers.iter().flatten().count() > 2).then_some(pose),
            markers,
        }
    });
    Track {
        subject: subject.to_owned(),
        frames: frames.collect(),
    }
}

/// A stretch with a rig and the white board.
fn stretch(session: &Session, pose: usize, scans: usize, frames: usize, seed: u64) -> Stretch {
    let mut numbers = Numbers(seed + 1);
    // Longer than any of them lasts.
    let start_s = 1000.0 * pose as f64;
    // The sum of two decimals is not always the number nearest to a decimal, as which times are read back.
    let whole = |t: f64| (t * 1e9).round() / 1e9;
    let mut tracks = vec![
        track(&mut numbers, "rig", &session.rig_markers, start_s, frames),
        track(&mut numbers, "white", &session.boards[0].markers, start_s, frames),
    ];
    for frame in tracks.iter_mut().flat_map(|t| &mut t.frames) {
        frame.time_s = whole(frame.time_s);
    }
    tracks.retain(|t| !t.frames.is_empty());
    Stretch {
        label: PoseLabel {
            board: Some("white".to_owned()),
            color: Some("white".to_owned()),
            facet: Some("port".to_owned()),
            beams: Some([0, session.scanner.scan.beams() - 1]),
            ..PoseLabel::of(pose, PoseKind::Facet, scans)
        },
        start_s,
        scan_period_s: 0.025,
        beams: session.scanner.scan.beams(),
        ranges: ranges(&mut numbers, scans * session.scanner.scan.beams()),
        echoes: None,
        intensities: None,
        echo_intensities: None,
        tracks,
    }
}

fn record(session: &Session, stretches: &[Stretch]) -> Vec<u8> {
    let mut recording = RecordingWriter::create(Vec::new(), Path::new(NAME), session).expect("begun");
    for stretch in stretches {
        recording.write_stretch(stretch).expect("written");
    }
    recording.finish().expect("ended")
}

fn play(session: &Session, bytes: &[u8]) -> Result<Vec<Stretch>, IoError> {
    parse_recording(bytes, Path::new(NAME), session)
}

/// Equality that treats NaN as equal to NaN.
fn same(a: &[Stretch], b: &[Stretch]) -> bool {
    format!("{a:?}") == format!("{b:?}")
}
