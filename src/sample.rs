//! A small experiment for tests: eight mirrors, their truth, exact readings of boards and room, a calibration.

use catoptric_model::calibration::{MountEstimate, SCHEMA_VERSION};
use catoptric_model::frame::yaw_pitch_roll;
use catoptric_model::session::{
    self, BareStructure, Beliefs, BoardSheet, Marker, MountTolerance, NominalFacet, RoomSurvey, ScannerSheet,
};
use catoptric_model::{
    BeamEstimate, BoardPlane, Calibration, Dataset, Deflection, MirrorPlane, Pose, PoseData, PoseKind,
    PoseLabel, PoseRecord, RangeBias, Session, Status, beam, range,
};
use catoptric_sim::Truth;
use catoptric_sim::layout;
use catoptric_sim::scene::{FacetShape, Wedge};
use catoptric_sim::truth::{BeamClass, TrueBeam, TrueFacet};
use nalgebra::{Point3, Translation3, Unit, Vector3};

/// Numbers spread like noise of unit size, the same every time.
pub(crate) struct Noise(u64);

impl Noise {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    /// Sum of twelve uniform numbers less six: mean 0, variance 1.
    pub(crate) fn next(&mut self) -> f64 {
        let uniform = |state: &mut u64| {
            *state ^= *state << 13;
            *state ^= *state >> 7;
            *state ^= *state << 17;
            (*state >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..12).map(|_| uniform(&mut self.0)).sum::<f64>() - 6.0
    }
}

/// A dataset without errors, and its truth.
pub(crate) struct Sample {
    pub(crate) dataset: Dataset,
    pub(crate) truth: Truth,
}

struct Mirror {
    name: &'static str,
    corners: Vec<Point3<f64>>,
    plane: MirrorPlane,
    azimuth_deg: [f64; 2],
}

const NAMES: [&str; 8] = [
    "port 1",
    "port 2",
    "port 3",
    "port 4",
    "starboard 1",
    "starboard 2",
    "starboard 3",
    "starboard 4",
];

fn mirrors() -> Vec<Mirror> {
    let build = |(i, name): (usize, &&'static str)| {
        let side = if i < 4 { 1.0 } else { -1.0 };
        let place = (i % 4) as f64;
        let first = 62.0 + 16.8 * place;
        let azimuth_deg = if side > 0.0 {
            [first, first + 15.0]
        } else {
            [-first - 15.0, -first]
        };
        let up = if i % 2 == 0 { 1.0 } else { -1.0 };
        let corners = layout::corners(&FacetShape::Wedge(Wedge {
            azimuth_deg,
            distance_mm: 62.0 + 7.0 * place,
            exit_azimuth_deg: 0.5 * (azimuth_deg[0] + azimuth_deg[1]) - side * 25.0,
            exit_elevation_deg: up * (42.0 + 8.0 * place),
            height_mm: 14.0,
        }))
        .expect("it is a mirror");
        let normal = Unit::new_normalize(layout::area_vector(&corners));
        Mirror {
            name,
            plane: MirrorPlane::through(corners[0], normal),
            corners,
            azimuth_deg,
        }
    };
    NAMES.iter().enumerate().map(build).collect()
}

fn true_beam(beam: usize, mirrors: &[Mirror]) -> TrueBeam {
    let azimuth = beam::azimuth(beam).to_degrees();
    // Half the width of a beam at the mirror, in degrees.
    let half = 0.8;
    let inside = |m: &&Mirror, margin: f64| {
        m.azimuth_deg[0] + margin <= azimuth && azimuth <= m.azimuth_deg[1] - margin
    };
    let (status, mirror) = match mirrors.iter().find(|m| inside(m, 0.0)) {
        Some(m) if inside(&m, half) => (BeamClass::Deflected, Some(m)),
        Some(m) => (BeamClass::Split, Some(m)),
        None if azimuth.abs() < 60.0 => (BeamClass::Direct, None),
        None => (BeamClass::Blocked, None),
    };
    let deflection = mirror.and_then(|m| m.plane.deflect(beam::direction(beam::azimuth(beam))));
    let is_direct = status == BeamClass::Direct;
    TrueBeam {
        beam,
        status,
        facets: mirror.iter().map(|m| m.name.to_owned()).collect(),
        points_m: deflection
            .iter()
            .map(|d| d.deflection_point(beam::azimuth(beam)).coords.into())
            .collect(),
        azimuth_rad: deflection.map(|d| d.azimuth).or(is_direct.then_some(0.0)),
        elevation_rad: deflection.map(|d| d.elevation).or(is_direct.then_some(0.0)),
        distance_m: deflection.map(|d| d.distance),
        chief_energy: if status == BeamClass::Split { 0.7 } else { 1.0 },
    }
}

fn session(mirrors: &[Mirror]) -> Session {
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
        room: RoomSurvey {
            min_m: [-3.0, -4.0, 0.0],
            max_m: [5.0, 3.5, 3.0],
            color: "white".to_owned(),
        },
        believed: Beliefs {
            range_noise_sd_mm: 2.0,
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

/// Boards of a facet: six around the fan's middle, each tilted another way.
fn boards_of(mirror: &Mirror, room_from_sensor: &Pose) -> Vec<Pose> {
    let middle = 0.5 * (mirror.azimuth_deg[0] + mirror.azimuth_deg[1]);
    let azimuth = middle.to_radians();
    let deflection = mirror
        .plane
        .deflect(beam::direction(azimuth))
        .expect("it faces the scanner");
    let exit = deflection.exit_direction(azimuth);
    (0..6)
        .map(|k| {
            let turn = std::f64::consts::TAU * f64::from(k) / 6.0;
            let range = 0.9 + 0.15 * f64::from(k % 3);
            let point = deflection.deflection_point(azimuth) + exit.into_inner() * range;
            let (across, up) = catoptric_model::frame::tangent_basis(&exit);
            let tilt = across.into_inner() * turn.cos() + up.into_inner() * turn.sin();
            let normal = -exit.into_inner() + tilt * 0.8;
            let rotation = nalgebra::UnitQuaternion::rotation_between(&Vector3::z(), &normal)
                .expect("a board does not face straight down");
            room_from_sensor * Pose::from_parts(Translation3::from(point.coords), rotation)
        })
        .collect()
}

fn record(
    pose: usize,
    kind: PoseKind,
    facet: Option<&str>,
    room_from_rig: Pose,
    board: Option<Pose>,
) -> PoseRecord {
    PoseRecord {
        label: PoseLabel {
            pose,
            kind,
            scans: 2,
            board: board.map(|_| "board".to_owned()),
            color: board.map(|_| "white".to_owned()),
            facet: facet.map(str::to_owned),
            beams: None,
        },
        room_from_rig,
        room_from_board: board,
        beams: beam::COUNT,
        ranges: Vec::new(),
    }
}

/// Eight mirrors, six boards for each, an empty room; readings are exact.
pub(crate) fn sample() -> Sample {
    let mirrors = mirrors();
    let session = session(&mirrors);
    let beams: Vec<TrueBeam> = (0..beam::COUNT).map(|b| true_beam(b, &mirrors)).collect();
    let room_from_rig = Pose::from_parts(
        Translation3::new(0.1, -0.2, 1.3),
        yaw_pitch_roll(0.1, 0.02, -0.01),
    );
    let rig_from_sensor = Pose::from_parts(
        Translation3::new(0.001, 0.0, -0.041),
        yaw_pitch_roll(0.004, -0.008, 0.01),
    );
    let room_from_sensor = room_from_rig * rig_from_sensor;
    let mut poses = vec![record(0, PoseKind::Room, None, room_from_rig, None)];
    for mirror in &mirrors {
        for board in boards_of(mirror, &room_from_sensor) {
            poses.push(record(
                poses.len(),
                PoseKind::Facet,
                Some(mirror.name),
                room_from_rig,
                Some(board),
            ));
        }
    }
    for pose in &mut poses {
        let scan: Vec<f64> = beams
            .iter()
            .map(|b| reading(b, pose, &session, &room_from_sensor))
            .collect();
        pose.ranges = [scan.clone(), scan].concat();
    }
    let truth = Truth {
        schema_version: catoptric_sim::truth::SCHEMA_VERSION,
        name: session.name.clone(),
        seed: 1,
        room_from_rig: PoseData::from(&room_from_rig),
        rig_from_sensor: PoseData::from(&rig_from_sensor),
        bias: RangeBias::default(),
        facets: mirrors
            .iter()
            .map(|m| TrueFacet {
                name: m.name.to_owned(),
                normal: m.plane.normal.into_inner().into(),
                offset_m: m.plane.offset,
                corners_m: m.corners.iter().map(|c| c.coords.into()).collect(),
            })
            .collect(),
        beams,
        poses: Vec::new(),
    };
    Sample {
        dataset: Dataset { session, poses },
        truth,
    }
}

fn reading(b: &TrueBeam, pose: &PoseRecord, session: &Session, room_from_sensor: &Pose) -> f64 {
    let deflection = match b.status {
        BeamClass::Blocked => return 0.06,
        BeamClass::Direct => Deflection::NONE,
        _ => b.deflection().expect("it is deflected"),
    };
    let azimuth = beam::azimuth(b.beam);
    let exit = deflection.exit_direction(azimuth);
    if let Some(room_from_board) = pose.room_from_board {
        let sensor_from_board = room_from_sensor.inverse() * room_from_board;
        let plane = BoardPlane::of_pose(&sensor_from_board);
        if let Some(r) = range::predict(&deflection, azimuth, &plane) {
            let hit = deflection.deflection_point(azimuth) + exit.into_inner() * (r - deflection.distance);
            let sheet = &session.boards[0];
            if sheet
                .outline()
                .contains(&(sensor_from_board.inverse() * hit), 0.0)
            {
                return r;
            }
        }
    }
    let origin = room_from_sensor * deflection.deflection_point(azimuth);
    let exit = Unit::new_unchecked(room_from_sensor * exit.into_inner());
    let wall = session.room.cast(&origin, &exit);
    wall.map_or(range::NO_RETURN, |(s, _)| deflection.distance + s)
}

/// The truth as a submission: every deflected beam solved, split ones rejected.
pub(crate) fn perfect(truth: &Truth) -> Calibration {
    let estimate = |b: &TrueBeam| {
        let without = |status, reason: Option<&str>| {
            BeamEstimate::without_angles(b.beam, status, reason.map(str::to_owned))
        };
        match b.status {
            BeamClass::Direct => without(Status::Direct, None),
            BeamClass::Deflected => BeamEstimate {
                facet: b.facets.first().cloned(),
                azimuth_rad: b.azimuth_rad,
                elevation_rad: b.elevation_rad,
                distance_m: b.distance_m,
                covariance_rad2: Some([[1e-6, 0.0], [0.0, 1e-6]]),
                poses: Some(6),
                readings: Some(600),
                iterations: Some(3),
                rms_residual_m: Some(0.0),
                ..without(Status::Solved, None)
            },
            BeamClass::Split | BeamClass::MultiBounce => without(
                Status::Rejected,
                Some("spread of 9 mm on 3 boards: it falls on an edge"),
            ),
            BeamClass::Blocked | BeamClass::Lost => {
                without(Status::TooFewPoses, Some("1 board, 3 are needed"))
            }
        }
    };
    Calibration {
        schema_version: SCHEMA_VERSION,
        method: "oracle".to_owned(),
        frame: "sensor".to_owned(),
        beams: truth.beams.iter().map(estimate).collect(),
        facets: Vec::new(),
        rig_from_sensor: Some(MountEstimate {
            translation_m: truth.rig_from_sensor.translation_m,
            rotation_xyzw: truth.rig_from_sensor.rotation_xyzw,
            covariance: None,
        }),
        bias: None,
    }
}

/// A submission with independent errors of the given size per axis, in radians, and a covariance that says so.
pub(crate) fn noisy(truth: &Truth, sd: f64, seed: u64) -> Calibration {
    let mut noise = Noise::new(seed);
    let mut calibration = perfect(truth);
    calibration.method = "noisy".to_owned();
    for b in calibration
        .beams
        .iter_mut()
        .filter(|b| b.status == Status::Solved)
    {
        let cos = b.elevation_rad.map_or(1.0, f64::cos);
        b.azimuth_rad = b.azimuth_rad.map(|a| a + sd * noise.next() / cos);
        b.elevation_rad = b.elevation_rad.map(|e| e + sd * noise.next());
        b.distance_m = b.distance_m.map(|d| d + 0.5e-3 * noise.next());
        b.covariance_rad2 = Some([[(sd / cos).powi(2), 0.0], [0.0, sd * sd]]);
        b.rms_residual_m = Some(1e-3 * noise.next().abs());
    }
    calibration
}

/// The same with every direction turned by a rotation of the given angle about (1, 2, 2)/3.
pub(crate) fn turned(mut calibration: Calibration, angle: f64) -> Calibration {
    let axis = Unit::new_normalize(Vector3::new(1.0, 2.0, 2.0));
    let rotation = nalgebra::UnitQuaternion::from_axis_angle(&axis, angle);
    for b in &mut calibration.beams {
        if let Some(d) = b.deflection() {
            let azimuth = beam::azimuth(b.beam);
            let exit = Unit::new_unchecked(rotation * d.exit_direction(azimuth).into_inner());
            let d = Deflection::from_exit(azimuth, &exit, d.distance);
            b.azimuth_rad = Some(d.azimuth);
            b.elevation_rad = Some(d.elevation);
        }
    }
    calibration
}
