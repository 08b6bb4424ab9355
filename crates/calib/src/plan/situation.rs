//! What the experimenter knows before the next pose: the drawing or a recording, never the truth.

use crate::calibrate::calibrate;
use crate::element::choose;
use crate::element::facet_plane::{plane_as_built, plane_as_drawn, plane_at};
use crate::error::CalibError;
use crate::judge::covariance::MountUncertainty;
use crate::method::Method;
use crate::mount::pose;
use crate::options::Options;
use crate::prepare::{believable, prepare};
use crate::readings::observations::{BoardInSensor, azimuth, cone_half_angle};
use crate::readings::spread;
use catoptric_model::session::{BoardSheet, NominalFacet};
use catoptric_model::{
    BoardPlane, Dataset, Deflection, MirrorPlane, Pose, PoseKind, PoseLabel, PoseRecord, Readings, Session,
    Status, Stop, Summary, beam,
};
use nalgebra::Point3;

/// Direction error allowed for a drawing, in radians: the same as in the rules that set boards up (3°).
const DRAWN_MARGIN: f64 = 0.05;

/// Direction error allowed for a facet's plane as built, in radians.
const BUILT_MARGIN: f64 = 0.01;

/// A board that is or will be set up somewhere.
#[derive(Debug, Clone, PartialEq)]
pub struct Placed {
    /// The board.
    pub board: String,
    /// Facet in whose fan it is; `None` in front of beams that no mirror deflects.
    pub facet: Option<String>,
    /// Its pose.
    pub room_from_board: Pose,
    /// First and last beam that it is set up for, if noted.
    pub beams: Option<[usize; 2]>,
    /// Number of readings of each element.
    pub readings: usize,
}

/// One element of a facet.
#[derive(Debug, Clone)]
pub(crate) struct PlannedElement {
    pub(crate) beam: usize,
    pub(crate) azimuth: f64,
    pub(crate) deflection: Deflection,
    /// Boards that it reads: index, noise of one reading in meters, number of readings.
    pub(crate) read: Vec<(usize, f64, usize)>,
}

/// A facet with its elements.
#[derive(Debug, Clone)]
pub(crate) struct Fan {
    pub(crate) elements: Vec<PlannedElement>,
    /// Elements that no board can help, and why.
    pub(crate) excluded: Vec<(usize, String)>,
    /// Direction error allowed, in radians.
    pub(crate) margin: f64,
    /// Number of boards in front of this facet.
    pub(crate) boards: usize,
}

/// Everything known before the next pose.
#[derive(Debug, Clone)]
pub struct Situation {
    session: Session,
    room_from_sensor: Pose,
    pub(crate) mount: MountUncertainty,
    pub(crate) boards: Vec<BoardInSensor>,
    fans: Vec<Fan>,
}

impl Situation {
    /// Before anything is recorded: the drawing, with the boards that will be recorded in any case.
    ///
    /// Boards in front of undeflected beams determine how well the mounting will be known.
    ///
    /// # Errors
    /// [`CalibError::Facet`] for a facet without a plane.
    pub fn drawn(session: &Session, room_from_rig: &Pose, placed: &[Placed]) -> Result<Self, CalibError> {
        let planes = planes_as_drawn(session)?;
        let rig_from_sensor = Pose::from(&session.nominal_rig_from_sensor);
        let room_from_sensor = room_from_rig * rig_from_sensor;
        let mut boards = Vec::new();
        let mut of_facet = Vec::new();
        for place in placed {
            if let (Some(facet), Some(sheet)) = (&place.facet, session.board(&place.board)) {
                boards.push(in_sensor(sheet, &room_from_sensor, &place.room_from_board));
                of_facet.push((facet.as_str(), place.readings));
            }
        }
        let cone = cone_half_angle(session);
        let mut fans = Vec::new();
        for (facet, plane) in session.facets.iter().zip(&planes) {
            let mut fan = Fan::new(session, facet, plane, DRAWN_MARGIN);
            fan.boards = of_facet.iter().filter(|(name, _)| *name == facet.name).count();
            for element in &mut fan.elements {
                for (number, board) in boards.iter().enumerate() {
                    let (name, readings) = of_facet[number];
                    if name == facet.name && element.is_held(board, cone, DRAWN_MARGIN) {
                        let noise = noise_on(session, board);
                        element.read.push((number, noise, readings));
                    }
                }
            }
            fans.push(fan);
        }
        Ok(Self {
            mount: expected_mount(session, room_from_rig, placed),
            session: session.clone(),
            room_from_sensor,
            boards,
            fans,
        })
    }

    /// After a recording: starts from what its boards determine.
    ///
    /// # Errors
    /// As [`calibrate`](fn@calibrate).
    pub fn recorded(dataset: &Dataset) -> Result<Self, CalibError> {
        let (dataset, _) = believable(dataset)?;
        let dataset = dataset.as_ref();
        let session = &dataset.session;
        let (options, stop) = (Options::default(), Stop::default());
        let calibration = calibrate(dataset, Method::BeamGls, &options)?;
        let prepared = prepare(dataset)?;
        let work = prepared.workspace(dataset, &options, &stop);
        // Boards that could not be placed are in no element's list.
        let mut boards = Vec::new();
        let mut number_of = vec![None; dataset.poses.len()];
        for (pose, board) in work.boards.iter().enumerate() {
            if let Some(board) = board {
                number_of[pose] = Some(boards.len());
                boards.push(board.clone());
            }
        }
        let mut fans = Vec::new();
        for (facet, drawn) in session.facets.iter().zip(&prepared.drawn) {
            let built = plane_as_built(session, facet, &calibration.beams);
            let plane = built.unwrap_or(*drawn);
            let margin = if built.is_some() {
                BUILT_MARGIN
            } else {
                DRAWN_MARGIN
            };
            let mut fan = Fan::new(session, facet, &plane, margin);
            fan.boards = dataset
                .of_kind(PoseKind::Facet)
                .filter(|p| p.label.facet.as_ref() == Some(&facet.name))
                .count();
            let mut elements = Vec::new();
            for mut element in std::mem::take(&mut fan.elements) {
                let estimate = calibration.beam(element.beam);
                if let Some(e) = estimate.filter(|e| matches!(e.status, Status::Rejected | Status::Direct)) {
                    let reason = e
                        .reason
                        .clone()
                        .unwrap_or_else(|| e.status.word().replace('_', " "));
                    fan.excluded.push((element.beam, reason));
                    continue;
                }
                if let Some(found) = estimate.and_then(|e| e.deflection()) {
                    element.deflection = found;
                }
                let hit = choose::boards_at(&work, element.beam, facet, &plane, &element.deflection);
                for pose in hit.unwrap_or_default() {
                    if let Some(number) = number_of[pose] {
                        let summary = &work.summaries[pose][element.beam];
                        let color = &boards[number].color;
                        let sd = spread::noise_sd(summary, session.believed.noise_sd(summary.mean, color));
                        element.read.push((number, sd, summary.count));
                    }
                }
                elements.push(element);
            }
            fan.elements = elements;
            fans.push(fan);
        }
        let room_from_rig = dataset
            .poses
            .first()
            .map_or_else(Pose::identity, |p| p.room_from_rig);
        Ok(Self {
            room_from_sensor: room_from_rig * prepared.mount.rig_from_sensor,
            mount: prepared.mount.uncertainty.clone(),
            session: session.clone(),
            boards,
            fans,
        })
    }

    /// The session.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Pose of the sensor in the room, as far as it is known.
    pub fn room_from_sensor(&self) -> &Pose {
        &self.room_from_sensor
    }

    /// The beams of a facet that a board can help, with their rays in the room; empty for an unknown name.
    pub fn rays(&self, facet: &str) -> Vec<(usize, Point3<f64>, nalgebra::Unit<nalgebra::Vector3<f64>>)> {
        let fan = self.fan(facet).map_or(&[][..], |fan| &fan.elements);
        fan.iter()
            .map(|e| {
                let direction = self.room_from_sensor.rotation * e.deflection.exit_direction(e.azimuth);
                let origin = self.room_from_sensor * e.deflection.deflection_point(e.azimuth);
                (e.beam, origin, direction)
            })
            .collect()
    }

    pub(crate) fn fan(&self, facet: &str) -> Option<&Fan> {
        let number = self.session.facets.iter().position(|f| f.name == facet)?;
        self.fans.get(number)
    }
}

impl Fan {
    /// The elements of a facet whose plane is believed to be `plane`.
    fn new(session: &Session, facet: &NominalFacet, plane: &MirrorPlane, margin: f64) -> Self {
        let mut fan = Self {
            elements: Vec::new(),
            excluded: Vec::new(),
            margin,
            boards: 0,
        };
        for beam in session.scanner.scan.run(facet.beams) {
            let azimuth = azimuth(session, beam);
            let u = beam::direction(azimuth);
            let Some(deflection) = plane_at(facet, plane, &u).deflect(u) else {
                let reason = "the facet's plane does not face it".to_owned();
                fan.excluded.push((beam, reason));
                continue;
            };
            let element = PlannedElement {
                beam,
                azimuth,
                deflection,
                read: Vec::new(),
            };
            match element.shaded_by(session, facet) {
                Some(other) => fan.excluded.push((beam, format!("facet {other:?} shades it"))),
                None => fan.elements.push(element),
            }
        }
        fan
    }
}

impl PlannedElement {
    /// Whether a board holds the element's whole spot on its face, for direction errors up to `margin`.
    pub(crate) fn is_held(&self, board: &BoardInSensor, cone: f64, margin: f64) -> bool {
        /// Margin of board required around a spot, in meters.
        const EDGE_MARGIN: f64 = 5e-3;
        let (origin, v) = (
            self.deflection.deflection_point(self.azimuth),
            self.deflection.exit_direction(self.azimuth),
        );
        board.plane.normal.dot(&v) < 0.0
            && board.hit(&origin, &v).is_some_and(|hit| {
                let radius = cone * (self.deflection.distance + hit.distance) + margin * hit.distance;
                board.holds(&hit, radius, EDGE_MARGIN)
            })
    }

    /// Another facet that the outgoing ray hits.
    fn shaded_by<'s>(&self, session: &'s Session, own: &NominalFacet) -> Option<&'s str> {
        let origin = self.deflection.deflection_point(self.azimuth);
        let v = self.deflection.exit_direction(self.azimuth);
        let others = session.facets.iter().filter(|f| f.name != own.name);
        others
            .filter(|f| {
                let Some(plane) = f.plane() else { return false };
                let Some(s) = plane.distance_along(&origin, &v) else {
                    return false;
                };
                is_inside(&f.corners(), &plane, &(origin + v.into_inner() * s))
            })
            .map(|f| f.name.as_str())
            .next()
    }
}

/// Whether a point in the plane of a convex polygon is inside it; corners counterclockwise about the normal.
fn is_inside(corners: &[Point3<f64>], plane: &BoardPlane, at: &Point3<f64>) -> bool {
    let edges = corners.iter().zip(corners.iter().cycle().skip(1));
    edges
        .into_iter()
        .all(|(a, b)| plane.normal.dot(&(b - a).cross(&(at - a))) >= 0.0)
}

fn planes_as_drawn(session: &Session) -> Result<Vec<MirrorPlane>, CalibError> {
    session.facets.iter().map(plane_as_drawn).collect()
}

/// A board in the sensor frame.
pub(crate) fn in_sensor(
    sheet: &BoardSheet,
    room_from_sensor: &Pose,
    room_from_board: &Pose,
) -> BoardInSensor {
    let sensor_from_board = room_from_sensor.inverse() * room_from_board;
    BoardInSensor {
        sensor_from_board,
        plane: BoardPlane::of_pose(&sensor_from_board),
        outline: sheet.outline(),
        markers: sheet
            .markers
            .iter()
            .map(|m| sensor_from_board * m.position())
            .collect(),
        color: sheet.color.clone(),
    }
}

/// How well the boards in front of undeflected beams will place the sensor: step 5 on the readings predicted from the
/// drawing.
fn expected_mount(session: &Session, room_from_rig: &Pose, placed: &[Placed]) -> MountUncertainty {
    let rig_from_sensor = Pose::from(&session.nominal_rig_from_sensor);
    let mut poses = Vec::new();
    let mut summaries = Vec::new();
    for place in placed.iter().filter(|p| p.facet.is_none()) {
        let Some(sheet) = session.board(&place.board) else {
            continue;
        };
        let board = in_sensor(sheet, &(room_from_rig * rig_from_sensor), &place.room_from_board);
        summaries.push(predicted(session, &board, place.readings));
        poses.push(PoseRecord {
            label: PoseLabel {
                board: Some(place.board.clone()),
                beams: place.beams,
                ..PoseLabel::of(poses.len(), PoseKind::Direct, place.readings)
            },
            room_from_rig: *room_from_rig,
            room_from_board: Some(place.room_from_board),
            motion: None,
            watched: Vec::new(),
            readings: Readings::in_memory(session.scanner.scan.beams(), Vec::new()),
        });
    }
    let dataset = Dataset {
        session: session.clone(),
        poses,
        id: None,
        warnings: Vec::new(),
    };
    pose::estimate(&dataset, &summaries).uncertainty
}

/// Believed noise of one reading of a board, at the distance of its middle, in meters.
pub(super) fn noise_on(session: &Session, board: &BoardInSensor) -> f64 {
    session
        .believed
        .noise_sd(board.plane.point.coords.norm(), &board.color)
}

/// The noise-free readings of a board by every undeflected beam.
fn predicted(session: &Session, board: &BoardInSensor, readings: usize) -> Vec<Summary> {
    let believed = &session.believed;
    (0..session.scanner.scan.beams())
        .map(|b| {
            let u = beam::direction(azimuth(session, b));
            match board.hit(&Point3::origin(), &u) {
                Some(hit) => {
                    let cos_incidence = board.plane.cos_incidence(&u);
                    let bias = believed.bias.terms(hit.distance, cos_incidence, &board.color);
                    Summary {
                        count: readings,
                        outliers: 0,
                        missing: 0,
                        mean: hit.distance + bias.total(),
                        sd: believed.noise_sd(hit.distance, &board.color),
                    }
                }
                None => Summary {
                    count: 0,
                    outliers: 0,
                    missing: readings,
                    mean: f64::NAN,
                    sd: f64::NAN,
                },
            }
        })
        .collect()
}
