//! Datasets from the estimator's own forward model, with errors drawn from its own beliefs.

use catoptric_calib::pose::moved;
use catoptric_model::session::*;
use catoptric_model::*;
use nalgebra::{ComplexField, Matrix3, Point3, Translation3, Unit, UnitQuaternion, Vector3, Vector6};
use std::collections::BTreeMap;

/// A small deterministic generator: SplitMix64 and Box–Muller.
pub(crate) struct Draw(pub(crate) u64);

impl Draw {
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * ComplexField::ln(1.0 - self.uniform())).sqrt();
        radius * beam::direction(std::f64::consts::TAU * self.uniform()).x
    }
}

/// A board relative to the ray it is set up for: distance from the mirror, tilt and direction of tilt.
#[derive(Clone, Copy)]
pub(crate) struct Placement {
    pub(crate) s: f64,
    pub(crate) tilt_deg: f64,
    pub(crate) psi_deg: f64,
}

pub(crate) fn placements(list: &[(f64, f64, f64)]) -> Vec<Placement> {
    list.iter()
        .map(|&(s, tilt_deg, psi_deg)| Placement { s, tilt_deg, psi_deg })
        .collect()
}

/// A dataset to record, and its errors.
#[derive(Clone)]
pub(crate) struct World {
    pub(crate) seed: u64,
    pub(crate) beams: usize,
    pub(crate) step_deg: f64,
    pub(crate) scans: usize,
    /// Served beams of each facet.
    pub(crate) served: Vec<[usize; 2]>,
    /// Groups of neighboring beams of each facet, each with its own boards.
    pub(crate) groups: usize,
    /// Boards of each group.
    pub(crate) facet_boards: Vec<Placement>,
    /// Azimuths, in degrees, of the boards for the mounting.
    pub(crate) direct_boards: Vec<(f64, Placement)>,
    /// Full width of a beam along the scan, in radians, with its light spread evenly. 0 for an infinitely thin beam.
    pub(crate) width: f64,
    /// Number of beams by which the mirrors as built start later (first) or end later (last) than drawn.
    pub(crate) edges: [i64; 2],
    pub(crate) board_mm: f64,
    pub(crate) thickness_mm: f64,
    /// True motion of the sensor against the drawing.
    pub(crate) mount_motion: [f64; 6],
    pub(crate) facet_tilt_deg: f64,
    pub(crate) facet_shift_mm: f64,
    pub(crate) noise_mm: f64,
    pub(crate) drift_mm: f64,
    pub(crate) marker_mm: f64,
    pub(crate) distance_bias_sd_mm: f64,
    pub(crate) angle_gain_sd_mm: f64,
    pub(crate) color_bias_sd_mm: f64,
    pub(crate) distance_sd_mm: f64,
    /// Random deviation of each beam from the direction that its facet's plane gives it, 1σ along each axis.
    pub(crate) deviation_deg: f64,
}

/// A dataset and the quantities it was made from.
pub(crate) struct Made {
    pub(crate) dataset: Dataset,
    pub(crate) deflections: BTreeMap<usize, Deflection>,
    pub(crate) rig_from_sensor: Pose,
}

impl World {
    /// The whole scanner without noise: mounting off by 1°, facets off by 1° and half a millimeter.
    pub(crate) fn exact() -> Self {
        Self {
            seed: 1,
            beams: 1081,
            step_deg: 0.25,
            scans: 2,
            served: vec![[240, 300], [510, 570], [780, 840]],
            groups: 1,
            facet_boards: placements(&[
                (1.3, 40.0, 10.0),
                (1.6, 35.0, 100.0),
                (1.2, 45.0, 190.0),
                (1.5, 30.0, 280.0),
                (1.4, 40.0, 330.0),
            ]),
            direct_boards: [-115.0, -35.0, 35.0, 115.0, -35.0, 35.0, -115.0, 115.0]
                .iter()
                .zip([0.0, 60.0, 120.0, 180.0, 240.0, 300.0, 90.0, 270.0])
                .map(|(a, psi_deg)| {
                    let s = 1.2 + psi_deg / 400.0;
                    (
                        *a,
                        Placement {
                            s,
                            tilt_deg: 40.0,
                            psi_deg,
                        },
                    )
                })
                .collect(),
            width: 0.0,
            edges: [0, 0],
            board_mm: 1000.0,
            thickness_mm: 2.0,
            mount_motion: [0.004, -0.003, 0.002, 0.015, -0.012, 0.01],
            facet_tilt_deg: 1.0,
            facet_shift_mm: 0.5,
            noise_mm: 0.0,
            drift_mm: 0.0,
            marker_mm: 0.0,
            distance_bias_sd_mm: 0.0,
            angle_gain_sd_mm: 0.0,
            color_bias_sd_mm: 0.0,
            distance_sd_mm: 0.0,
            deviation_deg: 0.0,
        }
    }

    /// A coarse scanner with every error that a session can state a belief about.
    pub(crate) fn noisy(seed: u64) -> Self {
        Self {
            seed,
            beams: 271,
            step_deg: 1.0,
            scans: 10,
            served: vec![[60, 75], [128, 142], [195, 210]],
            noise_mm: 4.0,
            drift_mm: 0.88,
            marker_mm: 0.2,
            distance_bias_sd_mm: 1.0,
            angle_gain_sd_mm: 3.0,
            color_bias_sd_mm: 0.5,
            distance_sd_mm: 0.5,
            ..Self::exact()
        }
    }

    fn scan(&self) -> ScanGeometry {
        let angles = ScanAngles::centered(self.step_deg, self.beams);
        ScanGeometry::new(angles, 40.0, None).expect("a scanner can have it")
    }

    pub(crate) fn azimuth(&self, beam: usize) -> f64 {
        self.scan().azimuth(beam)
    }

    /// The plane of a facet, as built or as drawn.
    pub(crate) fn mirror(&self, facet: usize, as_built: bool) -> MirrorPlane {
        let [first, last] = self.served[facet];
        let middle = 0.5 * (self.azimuth(first) + self.azimuth(last));
        let u = beam::direction(middle);
        let tau = beam::direction(65.0_f64.to_radians());
        let mut normal = Unit::new_normalize(-u.into_inner() * tau.x + Vector3::z() * tau.y);
        let mut distance = 0.07;
        if as_built {
            let axis = Unit::new_normalize(Vector3::new(0.3, 1.0 - facet as f64, 0.5));
            normal = UnitQuaternion::from_axis_angle(&axis, self.facet_tilt_deg.to_radians()) * normal;
            distance += 1e-3 * self.facet_shift_mm;
        }
        MirrorPlane::through(Point3::from(u.into_inner() * distance), normal)
    }

    /// Deflection of a ray by the mirrors as built.
    fn mirrored(&self, azimuth: f64) -> Option<Deflection> {
        let step = self.step_deg.to_radians();
        let facet = self.served.iter().position(|s| {
            let first = self.azimuth(s[0]) + step * (self.edges[0] as f64 - 0.5);
            let last = self.azimuth(s[1]) + step * (self.edges[1] as f64 + 0.5);
            (first..=last).contains(&azimuth)
        })?;
        self.mirror(facet, true).deflect(beam::direction(azimuth))
    }

    fn deviated(&self, azimuth: f64, deflection: &Deflection, draw: &mut Draw) -> Deflection {
        if self.deviation_deg == 0.0 {
            return *deflection;
        }
        let v = deflection.exit_direction(azimuth);
        let (across, up) = frame::tangent_basis(&v);
        let mut by = || self.deviation_deg.to_radians() * draw.normal();
        let exit = Unit::new_normalize(v.into_inner() + across.into_inner() * by() + up.into_inner() * by());
        Deflection::from_exit(azimuth, &exit, deflection.distance)
    }

    pub(crate) fn make(&self) -> Made {
        let mut draw = Draw(self.seed);
        let believed = RangeBias {
            distance: DistanceBias {
                range_m: vec![0.5, 2.0, 4.0],
                error_mm: vec![-2.8, 6.1, -0.1],
            },
            angle: AngleBias {
                gain_mm: -70.3,
                offset_mm: 70.3,
                table: None,
            },
            color: BTreeMap::from([(
                "white".to_owned(),
                ColorBias {
                    slope_mm_per_m: 0.3,
                    offset_mm: 1.0,
                },
            )]),
        };
        let mut actual = believed.clone();
        for error in &mut actual.distance.error_mm {
            *error += self.distance_bias_sd_mm * draw.normal();
        }
        let gain = self.angle_gain_sd_mm * draw.normal();
        actual.angle.gain_mm += gain;
        actual.angle.offset_mm -= gain;
        if let Some(white) = actual.color.get_mut("white") {
            white.offset_mm += self.color_bias_sd_mm * draw.normal();
        }
        let nominal = Pose::from_parts(
            Translation3::new(0.01, -0.02, 0.05),
            UnitQuaternion::from_euler_angles(0.02, -0.03, 0.4),
        );
        let rig_from_sensor = moved(&nominal, &Vector6::from(self.mount_motion));
        let room_from_rig = Pose::from_parts(
            Translation3::new(0.2, -0.1, 0.9),
            UnitQuaternion::from_euler_angles(0.01, 0.02, -0.3),
        );
        let mut deflections = BTreeMap::new();
        let mut bare = vec![0.0; self.beams];
        for (facet, served) in self.served.iter().enumerate() {
            let mirror = self.mirror(facet, true);
            for (beam, bare) in bare.iter_mut().enumerate().take(served[1] + 1).skip(served[0]) {
                let u = beam::direction(self.azimuth(beam));
                let deflection = mirror.deflect(u).expect("the facet faces its beams");
                *bare = deflection.distance
                    + 1e-3 * self.thickness_mm / mirror.normal.dot(&u).abs()
                    + 1e-3 * self.distance_sd_mm * draw.normal();
                deflections.insert(beam, self.deviated(self.azimuth(beam), &deflection, &mut draw));
            }
        }
        let session = self.session(&nominal, believed, bare);
        let lab = Lab {
            world: self,
            session: &session,
            bias: &actual,
            room_from_rig,
            room_from_sensor: room_from_rig * rig_from_sensor,
            deflections: &deflections,
        };
        let mut poses = vec![lab.record(PoseKind::Room, None, None, &mut draw)];
        for (azimuth_deg, placement) in &self.direct_boards {
            let v = beam::direction(azimuth_deg.to_radians());
            let board = set_up(&Point3::origin(), &v, placement);
            poses.push(lab.record(PoseKind::Direct, None, Some(board), &mut draw));
        }
        for (facet, served) in self.served.iter().enumerate() {
            for group in 0..self.groups {
                let middle = served[0] + (served[1] - served[0]) * (2 * group + 1) / (2 * self.groups);
                let (azimuth, deflection) = (self.azimuth(middle), deflections[&middle]);
                for placement in &self.facet_boards {
                    let v = deflection.exit_direction(azimuth);
                    let board = set_up(&deflection.deflection_point(azimuth), &v, placement);
                    let name = Some(format!("facet {facet}"));
                    poses.push(lab.record(PoseKind::Facet, name, Some(board), &mut draw));
                }
            }
        }
        for (i, pose) in poses.iter_mut().enumerate() {
            pose.label.pose = i;
        }
        Made {
            dataset: Dataset {
                session,
                poses,
                id: None,
                warnings: Vec::new(),
            },
            deflections,
            rig_from_sensor,
        }
    }

    fn session(&self, nominal: &Pose, bias: RangeBias, bare: Vec<f64>) -> Session {
        let facets = (0..self.served.len()).map(|f| {
            let mirror = self.mirror(f, false);
            let middle = Point3::from(mirror.normal.into_inner() * mirror.offset);
            let (a, b) = frame::tangent_basis(&mirror.normal);
            let corner =
                |x: f64, y: f64| ((middle + a.into_inner() * x + b.into_inner() * y).coords * 1e3).into();
            NominalFacet {
                name: format!("facet {f}"),
                corners_mm: vec![
                    corner(-0.05, -0.05),
                    corner(0.05, -0.05),
                    corner(0.05, 0.05),
                    corner(-0.05, 0.05),
                ],
                curve: None,
                beams: self.served[f],
            }
        });
        let marker = |name: &str, x: f64, y: f64| Marker {
            name: name.to_owned(),
            position_mm: [x * self.board_mm, y * self.board_mm, 0.0],
        };
        Session {
            schema_version: SCHEMA_VERSION,
            name: "inverse crime".to_owned(),
            scanner: ScannerSheet {
                preset: "ust-20lx".to_owned(),
                scan: self.scan(),
                range_min_m: 0.06,
                range_max_m: 20.0,
                divergence_full_mrad: 10.0,
            },
            nominal_rig_from_sensor: PoseData::from(nominal),
            mount_tolerance: MountTolerance {
                rotation_sd_deg: [1.0; 3],
                translation_sd_mm: [5.0; 3],
            },
            room: Some(RoomSurvey {
                min_m: [-3.2, -2.7, 0.0],
                max_m: [3.3, 2.9, 3.4],
                color: "white".to_owned(),
            }),
            believed: Beliefs {
                range_noise_sd_mm: self.noise_mm,
                noise: None,
                noise_of: Default::default(),
                drift_sd_mm: self.drift_mm,
                element_sd_mm: 0.0,
                marker_sd_mm: self.marker_mm,
                bias,
                distance_bias_sd_mm: self.distance_bias_sd_mm,
                angle_gain_sd_mm: self.angle_gain_sd_mm,
                color_bias_sd_mm: self.color_bias_sd_mm,
            },
            glass: None,
            bare_structure: BareStructure {
                mirror_thickness_mm: self.thickness_mm,
                distance_sd_mm: self.distance_sd_mm,
                noise_sd_mm: 0.0,
                scanned: false,
                first_beam: 0,
                distance_m: bare,
            },
            rig_markers: Vec::new(),
            facets: facets.collect(),
            boards: vec![BoardSheet {
                name: "board".to_owned(),
                width_mm: self.board_mm,
                height_mm: self.board_mm,
                thickness_mm: 0.0,
                color: "white".to_owned(),
                markers: vec![
                    marker("1", -0.45, -0.45),
                    marker("2", 0.45, -0.4),
                    marker("3", 0.4, 0.45),
                    marker("4", -0.35, 0.45),
                ],
            }],
        }
    }
}

/// `sensor_from_board` of a board at a distance along a ray, its normal tilted away from the ray.
fn set_up(origin: &Point3<f64>, v: &Unit<Vector3<f64>>, p: &Placement) -> Pose {
    let (across, up) = frame::tangent_basis(v);
    let psi = beam::direction(p.psi_deg.to_radians());
    let tilt = beam::direction(p.tilt_deg.to_radians());
    let side = across.into_inner() * psi.x + up.into_inner() * psi.y;
    let normal = -v.into_inner() * tilt.x + side * tilt.y;
    let turn = UnitQuaternion::face_towards(&normal, &up.into_inner());
    Pose::from_parts(Translation3::from((origin + v.into_inner() * p.s).coords), turn)
}

struct Lab<'a> {
    world: &'a World,
    session: &'a Session,
    bias: &'a RangeBias,
    room_from_rig: Pose,
    room_from_sensor: Pose,
    deflections: &'a BTreeMap<usize, Deflection>,
}

impl Lab<'_> {
    fn record(
        &self,
        kind: PoseKind,
        facet: Option<String>,
        board: Option<Pose>,
        draw: &mut Draw,
    ) -> PoseRecord {
        let world = self.world;
        let drift = 1e-3 * world.drift_mm * draw.normal();
        let exact: Vec<f64> = (0..world.beams)
            .map(|b| self.range(b, board.as_ref()) + drift)
            .collect();
        let mut ranges = Vec::with_capacity(world.scans * world.beams);
        for _ in 0..world.scans {
            for r in &exact {
                let noise = if world.noise_mm > 0.0 { draw.normal() } else { 0.0 };
                ranges.push(r + 1e-3 * world.noise_mm * noise);
            }
        }
        PoseRecord {
            label: PoseLabel {
                board: board.map(|_| "board".to_owned()),
                color: board.map(|_| "white".to_owned()),
                facet,
                ..PoseLabel::of(0, kind, world.scans)
            },
            room_from_rig: self.room_from_rig,
            room_from_board: board.map(|b| self.tracked(&(self.room_from_sensor * b), draw)),
            motion: None,
            watched: Vec::new(),
            readings: Readings::in_memory(world.beams, ranges),
        }
    }

    /// The board's pose as tracked with markers that have a constant error: height and two tilts of the plane through
    /// them.
    fn tracked(&self, room_from_board: &Pose, draw: &mut Draw) -> Pose {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for marker in &self.session.boards[0].markers {
            let a = Vector3::new(1.0, marker.position().x, marker.position().y);
            normal += a * a.transpose();
            right += a * (1e-3 * self.world.marker_mm * draw.normal());
        }
        let fit = normal.try_inverse().expect("markers span a plane") * right;
        let tilt = UnitQuaternion::from_scaled_axis(Vector3::new(fit.z, -fit.y, 0.0));
        room_from_board * Pose::from_parts(Translation3::new(0.0, 0.0, fit.x), tilt)
    }

    /// Range of a beam: the mean over the first surfaces that its light hits, of those within a pulse of the nearest.
    fn range(&self, beam: usize, sensor_from_board: Option<&Pose>) -> f64 {
        const PARTS: usize = 9;
        const PULSE: f64 = 0.45;
        let world = self.world;
        if world.width == 0.0 {
            let deflection = self.deflections.get(&beam).copied();
            return self.part(world.azimuth(beam), deflection, sensor_from_board);
        }
        let parts: Vec<f64> = (0..PARTS)
            .map(|k| {
                let off = (k as f64 + 0.5) / PARTS as f64 - 0.5;
                let azimuth = world.azimuth(beam) + off * world.width;
                self.part(azimuth, world.mirrored(azimuth), sensor_from_board)
            })
            .collect();
        let nearest = parts.iter().copied().fold(f64::INFINITY, f64::min);
        let merged: Vec<f64> = parts.into_iter().filter(|r| r - nearest < PULSE).collect();
        merged.iter().sum::<f64>() / merged.len() as f64
    }

    /// Range of a ray, with its biases.
    fn part(&self, azimuth: f64, deflection: Option<Deflection>, sensor_from_board: Option<&Pose>) -> f64 {
        let deflection = deflection.unwrap_or(Deflection::NONE);
        let (origin, v) = (
            deflection.deflection_point(azimuth),
            deflection.exit_direction(azimuth),
        );
        let outline = self.session.boards[0].outline();
        let on_board = sensor_from_board.and_then(|pose| {
            let plane = BoardPlane::of_pose(pose);
            let s = plane.distance_along(&origin, &v)?;
            let point = pose.inverse() * (origin + v.into_inner() * s);
            outline
                .contains(&point, 0.0)
                .then(|| (s, plane.cos_incidence(&v)))
        });
        let (s, cos_incidence) = on_board.unwrap_or_else(|| {
            let (from, toward) = (self.room_from_sensor * origin, self.room_from_sensor.rotation * v);
            let (s, wall) = self
                .session
                .room
                .as_ref()
                .expect("this laboratory has walls")
                .cast(&from, &toward)
                .expect("the scanner is inside the room");
            (s, wall.cos_incidence(&toward))
        });
        let range = deflection.distance + s;
        range + self.bias.terms(range, cos_incidence, "white").total()
    }
}
