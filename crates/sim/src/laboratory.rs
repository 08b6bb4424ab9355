//! The virtual laboratory: a scene and a seed become stretches of scans, the session, and the truth.
//!
//! Every stretch is a pure function of (scene, seed, number), so that they can be computed in any order.

use crate::cast::Polygon;
use crate::color;
use crate::error::SimError;
use crate::mocap::{self, Body};
use crate::noise::{Draws, Purpose};
use crate::optics::{End, Mirrors, Role, Setting, Target};
use crate::placement::{self, Planned};
use crate::reading::{Return, Sensor};
use crate::scanner;
use crate::scene::{Board, ErrorModel, Marker, Scene};
use crate::structure::{self, Structure};
use crate::truth::{self, TrueBeam, TrueFacet, TruePose, Truth};
use catoptric_model::dataset::RIG_SUBJECT;
use catoptric_model::session::{self, Session};
use catoptric_model::{
    Dataset, Deflection, Pose, PoseData, PoseKind, PoseLabel, RangeBias, Rectangle, Stretch, beam,
};
use nalgebra::{Point3, Translation3, Unit, UnitQuaternion, Vector3};
use rayon::prelude::*;

/// A scene ready to be recorded.
pub struct Laboratory {
    scene: Scene,
    seed: u64,
    sensor: Sensor,
    structure: Structure,
    planned: Vec<Planned>,
    /// Where each planned board really stands, in the room frame.
    boards: Vec<Option<Pose>>,
    /// What step 1 believes the biases to be.
    believed: RangeBias,
}

/// What a beam met during a stretch, free of chance; `None` without an echo.
pub type Returns = Vec<Option<Return>>;

impl Laboratory {
    /// Builds the structure, sets up the procedure.
    ///
    /// # Errors
    /// A facet without a shape, an unknown color, a board that fits nowhere.
    pub fn new(scene: &Scene, seed: u64) -> Result<Self, SimError> {
        let sensor = Sensor::new(scene)?;
        let planned = placement::plan(scene, &sensor)?;
        let boards = planned
            .iter()
            .enumerate()
            .map(|(i, p)| Some(misplaced(scene, seed, i, &p.board?.1)))
            .collect();
        let laboratory = Self {
            seed,
            structure: Structure::as_built(scene, seed)?,
            believed: believed_bias(scene, seed, sensor.bias()),
            scene: scene.clone(),
            sensor,
            planned,
            boards,
        };
        laboratory.check_markers()?;
        Ok(laboratory)
    }

    fn check_markers(&self) -> Result<(), SimError> {
        let spans = |template: &[Point3<f64>]| {
            let all: Vec<_> = template.iter().copied().map(Some).collect();
            mocap::solve_pose(template, &all).is_some()
        };
        if !spans(&points(&self.scene.superstructure.marker)) {
            return Err(SimError::Markers {
                body: RIG_SUBJECT.to_owned(),
            });
        }
        match self
            .scene
            .board
            .iter()
            .find(|b| !spans(&points(&board_markers(b))))
        {
            Some(board) => Err(SimError::Markers {
                body: board.name.clone(),
            }),
            None => Ok(()),
        }
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Number of stretches.
    pub fn stretches(&self) -> usize {
        self.planned.len()
    }

    /// Scans of all stretches together.
    pub fn scans(&self) -> usize {
        self.planned.iter().map(|p| p.scans).sum()
    }

    /// Sub-rays of a beam.
    pub fn sub_rays(&self) -> usize {
        self.sensor.sub_rays()
    }

    fn room_from_sensor(&self) -> Pose {
        placement::room_from_rig(&self.scene.room) * self.structure.rig_from_sensor
    }

    /// Drift of a stretch, in metres.
    fn drift(&self, number: usize) -> f64 {
        if self.scene.errors.model == ErrorModel::None {
            return 0.0;
        }
        let mut draws = Draws::new(self.seed, Purpose::Drift, number as u64);
        draws.normal() * self.scene.errors.drift_sd_mm * 1e-3
    }

    /// Walls and the stretch's board, in the sensor frame.
    fn targets(&self, number: usize) -> Result<Vec<Target>, SimError> {
        let sensor_from_room = self.room_from_sensor().inverse();
        let wall_paint = color::paint(&self.scene, &self.scene.room.color)?;
        let polygon =
            |corners: Vec<Point3<f64>>| Polygon::new(corners.iter().map(|c| sensor_from_room * c).collect());
        let walls = walls(&self.scene).into_iter().filter_map(polygon);
        let mut targets: Vec<Target> = walls
            .map(|polygon| Target {
                polygon,
                role: Role::Wall,
                paint: wall_paint.clone(),
            })
            .collect();
        if let (Some((board, _)), Some(room_from_board)) = (&self.planned[number].board, &self.boards[number])
        {
            let board = &self.scene.board[*board];
            let corners = outline(board)
                .corners()
                .iter()
                .map(|c| room_from_board * c)
                .collect();
            if let Some(polygon) = polygon(corners) {
                targets.push(Target {
                    polygon,
                    role: Role::Board,
                    paint: color::paint(&self.scene, &board.color)?,
                });
            }
        }
        Ok(targets)
    }

    /// What every beam meets during a stretch: traced once, since nothing moves.
    ///
    /// # Errors
    /// An unknown color.
    pub fn returns(&self, number: usize) -> Result<Returns, SimError> {
        let mirrors = if self.planned[number].kind == PoseKind::Bare {
            Mirrors::Removed
        } else {
            Mirrors::Attached
        };
        let setting = Setting::new(&self.scene, &self.structure, mirrors, self.targets(number)?)?;
        Ok((0..beam::COUNT)
            .into_par_iter()
            .map(|b| self.sensor.observe(&setting, b))
            .collect())
    }

    /// Records a stretch.
    ///
    /// # Errors
    /// An unknown color.
    pub fn stretch(&self, number: usize) -> Result<Stretch, SimError> {
        Ok(self.record(number, &self.returns(number)?))
    }

    /// Records a stretch from what [`Laboratory::returns`] found for it.
    pub fn record(&self, number: usize, returns: &Returns) -> Stretch {
        let planned = &self.planned[number];
        let drift = self.drift(number);
        let first_scan: usize = self.planned[..number].iter().map(|p| p.scans).sum();
        let mut ranges = Vec::with_capacity(planned.scans * beam::COUNT);
        for scan in first_scan..first_scan + planned.scans {
            let mut draws = Draws::new(self.seed, Purpose::Reading, scan as u64);
            ranges.extend(returns.iter().enumerate().map(|(beam, found)| {
                draws.seek(beam as u64);
                self.sensor
                    .read(found.as_ref(), drift, draws.normal(), draws.uniform())
            }));
        }
        let scan_period_s = 1.0 / scanner::SCAN_RATE_HZ;
        let start_s = first_scan as f64 * scan_period_s + number as f64 * self.scene.experiment.pause_s;
        Stretch {
            label: self.label(number),
            start_s,
            scan_period_s,
            beams: beam::COUNT,
            ranges,
            tracks: self.tracks(number, start_s, planned.scans as f64 * scan_period_s),
        }
    }

    fn label(&self, number: usize) -> PoseLabel {
        let planned = &self.planned[number];
        let board = planned.board.as_ref().map(|(board, _)| &self.scene.board[*board]);
        PoseLabel {
            pose: number,
            kind: planned.kind,
            scans: planned.scans,
            board: board.map(|b| b.name.clone()),
            color: board.map(|b| b.color.clone()),
            facet: planned
                .facet
                .map(|f| self.scene.superstructure.facet[f].name.clone()),
            beams: planned.beams,
        }
    }

    /// The rig, and the stretch's board.
    fn tracks(&self, number: usize, start_s: f64, duration_s: f64) -> Vec<catoptric_model::Track> {
        let mocap = &self.scene.mocap;
        // Frame numbers and counts of a recording of hours stay far below 2³².
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let (first_frame, frames) = (
            (start_s * mocap.frame_rate_hz).round() as u64,
            ((duration_s * mocap.frame_rate_hz).floor() as u64).max(1),
        );
        let track = |body: &Body<'_>| mocap::track(mocap, self.seed, body, start_s, first_frame, frames);
        // The rig stays where it is for the whole experiment: one placement.
        let rig = points(&self.scene.superstructure.marker);
        let mut tracks = vec![track(&Body {
            subject: RIG_SUBJECT,
            index: 0,
            template: &rig,
            room_from_body: placement::room_from_rig(&self.scene.room),
            placement: 0,
        })];
        if let (Some((board, _)), Some(room_from_board)) = (&self.planned[number].board, &self.boards[number])
        {
            let template = points(&board_markers(&self.scene.board[*board]));
            tracks.push(track(&Body {
                subject: &self.scene.board[*board].name,
                index: board + 1,
                template: &template,
                room_from_body: *room_from_board,
                placement: number + 1,
            }));
        }
        tracks
    }

    /// What the experimenter knows.
    ///
    /// # Errors
    /// As [`Laboratory::returns`]: the bare structure is measured here.
    pub fn session(&self) -> Result<Session, SimError> {
        let scene = &self.scene;
        let mount = &scene.scanner.mount;
        // The standard deviation of a uniform error is its limit over √3.
        let sd = |limit: f64| limit / 3.0_f64.sqrt();
        let tilt = sd(mount.tilt_tolerance_deg);
        let [x, y, z] = scene.room.size_m;
        Ok(Session {
            schema_version: session::SCHEMA_VERSION,
            name: scene.name.clone(),
            scanner: session::ScannerSheet {
                preset: scene.scanner.preset.name().to_owned(),
                beams: beam::COUNT,
                step_deg: 0.25,
                scan_rate_hz: scanner::SCAN_RATE_HZ,
                range_min_m: scanner::RANGE_MIN_M,
                range_max_m: scanner::RANGE_MAX_M,
                divergence_full_mrad: scene.scanner.beam_shape().wide_full_mrad,
            },
            nominal_rig_from_sensor: PoseData::from(&structure::nominal_mount(scene)),
            mount_tolerance: session::MountTolerance {
                rotation_sd_deg: [tilt, tilt, sd(mount.yaw_tolerance_deg)],
                translation_sd_mm: [sd(mount.shift_tolerance_mm); 3],
            },
            room: session::RoomSurvey {
                min_m: [-0.5 * x, -0.5 * y, 0.0],
                max_m: [0.5 * x, 0.5 * y, z],
                color: scene.room.color.clone(),
            },
            believed: self.beliefs(),
            bare_structure: self.bare_structure()?,
            rig_markers: known_markers(&scene.superstructure.marker),
            facets: self.nominal_facets()?,
            boards: scene
                .board
                .iter()
                .map(|b| session::BoardSheet {
                    name: b.name.clone(),
                    width_mm: b.width_mm,
                    height_mm: b.height_mm,
                    color: b.color.clone(),
                    markers: known_markers(&board_markers(b)),
                })
                .collect(),
        })
    }

    fn beliefs(&self) -> session::Beliefs {
        let errors = &self.scene.errors;
        let known = &self.scene.characterization;
        let perfect = errors.model == ErrorModel::None;
        let unless_perfect = |value: f64| if perfect { 0.0 } else { value };
        let biased = matches!(errors.model, ErrorModel::Empirical | ErrorModel::Both);
        let if_biased = |value: f64| if biased { value } else { 0.0 };
        let noise = &errors.noise.sd_mm;
        session::Beliefs {
            range_noise_sd_mm: unless_perfect(noise.iter().sum::<f64>() / noise.len().max(1) as f64),
            drift_sd_mm: unless_perfect(errors.drift_sd_mm),
            marker_sd_mm: self.scene.mocap.profile.errors().constant.norm() / 3.0_f64.sqrt() * 1e3,
            bias: self.believed.clone(),
            distance_bias_sd_mm: if_biased(known.distance_sd_mm),
            angle_gain_sd_mm: if_biased(known.angle_gain_sd_mm),
            color_bias_sd_mm: if_biased(known.color_sd_mm),
        }
    }

    fn nominal_facets(&self) -> Result<Vec<session::NominalFacet>, SimError> {
        let nominal = Structure::nominal(&self.scene)?;
        let setting = Setting::new(&self.scene, &nominal, Mirrors::Attached, Vec::new())?;
        let paths: Vec<_> = (0..beam::COUNT)
            .map(|b| self.sensor.chief_path(&setting, b))
            .collect();
        let served = placement::served_beams(&paths, nominal.facets.len());
        Ok(nominal
            .facets
            .iter()
            .zip(served)
            .filter_map(|(facet, beams)| {
                Some(session::NominalFacet {
                    name: facet.name.clone(),
                    corners_mm: facet
                        .face
                        .corners
                        .iter()
                        .map(|c| (c.coords * 1e3).into())
                        .collect(),
                    beams: beams?,
                })
            })
            .collect())
    }

    /// Step 3: mean ranges to the bare structure, corrected with the incidence that the drawing gives.
    fn bare_structure(&self) -> Result<session::BareStructure, SimError> {
        let thickness = self.scene.superstructure.mirror.thickness_mm;
        let facet_normals = self.drawn_normals()?;
        let number = self.planned.iter().position(|p| p.kind == PoseKind::Bare);
        let stretch = number.map(|number| self.stretch(number)).transpose()?;
        let record = stretch.and_then(|s| s.into_record().ok());
        let summaries = record.map(|r| r.summarize()).unwrap_or_default();
        let mut distance_m = vec![0.0; beam::COUNT];
        let mut variance: f64 = 0.0;
        for (beam, summary) in summaries.iter().enumerate() {
            let Some(normal) = facet_normals[beam] else {
                continue;
            };
            if summary.count == 0 || summary.mean > FARTHEST_STRUCTURE {
                continue;
            }
            let cos = normal.dot(&beam::direction(beam::azimuth(beam))).abs();
            distance_m[beam] = summary.mean - self.believed.terms(summary.mean, cos, "structure").total();
            variance = variance.max(self.bare_variance(summary.count, cos));
        }
        Ok(session::BareStructure {
            mirror_thickness_mm: thickness,
            distance_sd_mm: variance.sqrt() * 1e3,
            first_beam: 0,
            distance_m,
        })
    }

    /// For every beam, the drawn normal of the facet that serves it or is nearest to it within a few beams.
    fn drawn_normals(&self) -> Result<Vec<Option<Unit<Vector3<f64>>>>, SimError> {
        let facets = self.nominal_facets()?;
        let away = |f: &session::NominalFacet, beam: usize| {
            f.beams[0]
                .saturating_sub(beam)
                .max(beam.saturating_sub(f.beams[1]))
        };
        let nearest = |beam| {
            facets
                .iter()
                .min_by_key(|f| away(f, beam))
                .filter(|f| away(f, beam) <= NEAR_FACET)
        };
        Ok((0..beam::COUNT)
            .map(|beam| Some(nearest(beam)?.plane()?.normal))
            .collect())
    }

    /// Variance that the experimenter ascribes to a bare distance, in square metres.
    fn bare_variance(&self, readings: usize, cos: f64) -> f64 {
        let believed = self.beliefs();
        let tilt = self.scene.superstructure.as_built.tilt_sd_deg.to_radians();
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let terms = [
            believed.range_noise_sd_mm / (readings as f64).sqrt(),
            believed.drift_sd_mm,
            believed.distance_bias_sd_mm,
            believed.color_bias_sd_mm,
            believed.angle_gain_sd_mm * (1.0 - cos),
            believed.bias.angle.gain_mm * sin * tilt,
        ];
        terms.iter().map(|mm| mm * mm * 1e-6).sum()
    }

    /// The truth beside it all.
    ///
    /// # Errors
    /// An unknown color.
    pub fn truth(&self) -> Result<Truth, SimError> {
        let setting = Setting::new(&self.scene, &self.structure, Mirrors::Attached, Vec::new())?;
        let facets = &self.structure.facets;
        let beams = (0..beam::COUNT)
            .into_par_iter()
            .map(|b| self.true_beam(&setting, b))
            .collect();
        Ok(Truth {
            schema_version: truth::SCHEMA_VERSION,
            name: self.scene.name.clone(),
            seed: self.seed,
            room_from_rig: PoseData::from(&placement::room_from_rig(&self.scene.room)),
            rig_from_sensor: PoseData::from(&self.structure.rig_from_sensor),
            bias: self.sensor.bias().clone(),
            facets: facets
                .iter()
                .map(|f| TrueFacet {
                    name: f.name.clone(),
                    normal: f.face.normal.into_inner().into(),
                    offset_m: f.face.normal.dot(&f.face.origin.coords),
                    corners_m: f.face.corners.iter().map(|c| c.coords.into()).collect(),
                })
                .collect(),
            beams,
            poses: (0..self.planned.len())
                .map(|number| TruePose {
                    pose: number,
                    kind: self.planned[number].kind,
                    room_from_board: self.boards[number].as_ref().map(PoseData::from),
                    drift_m: self.drift(number),
                })
                .collect(),
        })
    }

    fn true_beam(&self, setting: &Setting<'_>, beam: usize) -> TrueBeam {
        let (status, chief_energy) = self.sensor.classify(setting, beam);
        let chief = self.sensor.chief_path(setting, beam);
        let leaves = matches!(chief.end, End::Escaped) && !chief.facets().is_empty();
        let distance = chief.points().first().map(|p| p.coords.norm());
        let deflection = leaves.then(|| {
            Deflection::from_exit(
                beam::azimuth(beam),
                &chief.last.direction,
                distance.unwrap_or(0.0),
            )
        });
        TrueBeam {
            beam,
            status,
            facets: chief
                .facets()
                .iter()
                .map(|&f| self.structure.facets[f].name.clone())
                .collect(),
            points_m: chief.points().iter().map(|p| p.coords.into()).collect(),
            azimuth_rad: deflection.map(|d| d.azimuth),
            elevation_rad: deflection.map(|d| d.elevation),
            distance_m: distance,
            chief_energy,
        }
    }

    /// The whole experiment in memory.
    ///
    /// # Errors
    /// As [`Laboratory::stretch`].
    ///
    /// # Panics
    /// If motion capture never saw the rig during a stretch, which only a dropout of nearly 1 brings about.
    pub fn dataset(&self) -> Result<Dataset, SimError> {
        let poses = (0..self.stretches())
            .into_par_iter()
            .map(|number| {
                self.stretch(number)?
                    .into_record()
                    .map_err(|_| SimError::Markers {
                        body: RIG_SUBJECT.to_owned(),
                    })
            })
            .collect::<Result<_, _>>()?;
        Ok(Dataset {
            session: self.session()?,
            poses,
        })
    }
}

/// Bare readings beyond this are not of the structure, in metres.
const FARTHEST_STRUCTURE: f64 = 0.3;

/// How many beams beyond the drawn ones a bare distance is still noted for: as built, the edges move.
const NEAR_FACET: usize = 12;

/// Where a board really stands when a person means to put it somewhere.
fn misplaced(scene: &Scene, seed: u64, number: usize, meant: &Pose) -> Pose {
    if !scene.experiment.pose.is_empty() {
        return *meant;
    }
    let mut draws = Draws::new(seed, Purpose::Placement, number as u64);
    let shift = draws.normal3() * (scene.experiment.placement_sd_mm * 1e-3);
    let turn = draws.normal3() * scene.experiment.placement_sd_deg.to_radians();
    meant * Pose::from_parts(Translation3::from(shift), UnitQuaternion::from_scaled_axis(turn))
}

/// The biases as step 1 found them: the true ones, missed by the characterization's uncertainty.
fn believed_bias(scene: &Scene, seed: u64, truth: &RangeBias) -> RangeBias {
    let mut believed = truth.clone();
    if *truth == RangeBias::default() {
        return believed;
    }
    let known = &scene.characterization;
    let mut draws = Draws::new(seed, Purpose::Characterization, 0);
    for error in &mut believed.distance.error_mm {
        *error += known.distance_sd_mm * draws.normal();
    }
    draws.seek(1 << 20);
    let gain = known.angle_gain_sd_mm * draws.normal();
    believed.angle.gain_mm += gain;
    believed.angle.offset_mm -= gain;
    for (column, color) in believed.color.values_mut().enumerate() {
        draws.seek((1 << 21) + column as u64);
        color.offset_mm += known.color_sd_mm * draws.normal();
    }
    believed
}

fn outline(board: &Board) -> Rectangle {
    Rectangle {
        width: board.width_mm * 1e-3,
        height: board.height_mm * 1e-3,
    }
}

fn points(markers: &[Marker]) -> Vec<Point3<f64>> {
    markers
        .iter()
        .map(|m| Point3::from(Vector3::from(m.position_mm) * 1e-3))
        .collect()
}

fn known_markers(markers: &[Marker]) -> Vec<session::Marker> {
    markers
        .iter()
        .map(|m| session::Marker {
            name: m.name.clone(),
            position_mm: m.position_mm,
        })
        .collect()
}

/// A board's own markers, or five near its edges in no symmetry.
pub fn board_markers(board: &Board) -> Vec<Marker> {
    if !board.marker.is_empty() {
        return board.marker.clone();
    }
    let (x, y) = (0.5 * board.width_mm, 0.5 * board.height_mm);
    let places = [
        (-0.92, -0.9),
        (0.92, -0.85),
        (-0.88, 0.92),
        (0.9, 0.9),
        (0.35, 0.94),
    ];
    let names = ["P_p1", "P_p2", "P_p3", "P_p4", "P_p5"];
    let place = |(fx, fy): (f64, f64)| [fx * x, fy * y, 0.0];
    names
        .iter()
        .zip(places)
        .map(|(name, at)| Marker {
            name: (*name).to_owned(),
            position_mm: place(at),
        })
        .collect()
}

/// Corners of walls, floor and ceiling in the room frame, each counter-clockwise seen from inside.
fn walls(scene: &Scene) -> Vec<Vec<Point3<f64>>> {
    let [x, y, z] = scene.room.size_m;
    let (low, high) = (
        Vector3::new(-0.5 * x, -0.5 * y, 0.0),
        Vector3::new(0.5 * x, 0.5 * y, z),
    );
    let mut walls = Vec::new();
    for axis in 0..3 {
        let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
        for (at, inwards) in [(low[axis], true), (high[axis], false)] {
            let corner = |pa: f64, pb: f64| {
                let mut p = Vector3::zeros();
                (p[axis], p[a], p[b]) = (at, pa, pb);
                Point3::from(p)
            };
            let mut corners = vec![
                corner(low[a], low[b]),
                corner(high[a], low[b]),
                corner(high[a], high[b]),
                corner(low[a], high[b]),
            ];
            // The axes a, b, axis are right-handed: this order faces along +axis, into the room from the low side.
            if !inwards {
                corners.reverse();
            }
            walls.push(corners);
        }
    }
    walls
}
