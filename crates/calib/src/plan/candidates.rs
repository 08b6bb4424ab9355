//! Possible board poses in front of a facet: a low-discrepancy sequence without the poses that are impossible.
//!
//! A pose is given by the beam aimed at, the range s, the tilt α, its direction ψ and the roll about the normal. Number
//! n of the sequence has them at the fractional parts of n/γ, n/γ², …, γ⁶ = γ + 1 (Roberts' generalization of the
//! golden ratio). A pose is possible if the board is inside the room, clear of the rig, serves some elements with their
//! whole spots, and is hit by none of these at an incidence beyond the limit.
//!
//! Beam divergence bounds the lever s·tan α. A spot on a tilted board bends the leading edge by about κ(s·tan α)², κ =
//! k·σ_δ²/(2p), which no belief of a session covers; where that exceeds `UNMODELED` a longer lever gains nothing.

use super::request::Request;
use super::situation::{Element, Fan, Situation, in_sensor};
use crate::error::CalibError;
use crate::readings::observations::{BoardInSensor, cone_half_angle};
use catoptric_model::frame::tangent_basis;
use catoptric_model::session::BoardSheet;
use catoptric_model::{Pose, Session, Stop};
use nalgebra::{Matrix3, Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};

/// Minimum distance between a board and the shell of the room, in meters.
const WALL_CLEARANCE: f64 = 0.03;

/// Minimum distance between a board and the outermost part of the rig, in meters.
const RIG_CLEARANCE: f64 = 0.1;

/// Number of poses tried around each chosen one.
const NEAR: usize = 48;

/// Their initial offsets: beams, meters, and degrees of tilt, direction and roll.
const AROUND: (f64, f64, f64, f64, f64) = (12.0, 0.3, 10.0, 25.0, 40.0);

/// Real root of γ⁶ = γ + 1.
const GAMMA: f64 = 1.134_724_138_401_519_4;

/// Tolerated range error from a spot on a tilted board, in meters: about a pose's drift.
const UNMODELED: f64 = 1e-3;

/// Standard deviation of a pulse in range, in meters: 1 ns (assumed).
const PULSE_SD: f64 = 0.15;

/// √(2·ln 2): the edge is timed at half its height (assumed).
const HALF_HEIGHT: f64 = 1.177_410_022_515_474_7;

/// A possible pose of a board.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The board.
    pub board: String,
    /// Its pose.
    pub room_from_board: Pose,
    /// Beam at which its center is aimed.
    pub beam: usize,
    /// Distance from the mirror to its center, in meters.
    pub range_m: f64,
    /// Tilt against that beam, in degrees.
    pub tilt_deg: f64,
    /// Direction to which its normal leans, seen along that beam in the room, in degrees: 0 to growing azimuth, 90 up.
    pub direction_deg: f64,
    /// Rotation about its normal, in degrees; at 0 its x axis is along the fan as far as the tilt allows.
    pub roll_deg: f64,
    /// Beams that it serves, in order.
    pub beams: Vec<usize>,
    /// The board in the sensor frame.
    pub(crate) in_sensor: BoardInSensor,
    /// The elements of those beams, by their index in the fan.
    pub(crate) served: Vec<usize>,
}

/// A pose that the sequence proposes.
struct Wish {
    element: usize,
    board: usize,
    range: f64,
    tilt_deg: f64,
    direction_deg: f64,
    roll_deg: f64,
}

/// Longest lever s·tan α that is useful despite beam divergence, in meters.
pub fn longest_lever(session: &Session) -> f64 {
    // The full 1/e² width is four standard deviations.
    let spread = 0.25e-3 * session.scanner.divergence_full_mrad;
    let kappa = HALF_HEIGHT * spread * spread / (2.0 * PULSE_SD);
    (UNMODELED / kappa).sqrt()
}

/// All poses of the sequence that are possible in front of a facet, in order.
///
/// # Errors
/// [`CalibError::UnknownFacet`], [`CalibError::Session`] for limits that exclude everything, [`CalibError::NoPlace`] if
/// no pose is possible, with the most frequent obstacle.
pub fn candidates(
    situation: &Situation,
    facet: &str,
    request: &Request,
    stop: &Stop,
) -> Result<Vec<Candidate>, CalibError> {
    let session = situation.session();
    let fan = situation.fan(facet).ok_or_else(|| CalibError::UnknownFacet {
        name: facet.to_owned(),
        known: names(session),
    })?;
    check(request)?;
    let none = |reason: &str| CalibError::NoPlace {
        facet: facet.to_owned(),
        reason: reason.to_owned(),
    };
    if session.boards.is_empty() {
        return Err(none("there is no board"));
    }
    if fan.elements.is_empty() {
        return Err(none("no beam of it needs a board"));
    }
    let site = Site::new(situation, fan, request);
    let mut found = Vec::new();
    let mut refused = [0_usize; Refusal::ALL.len()];
    for number in 0..request.tries {
        stop.check()?;
        match site.candidate(&site.wish(number)) {
            Ok(candidate) => found.push(candidate),
            Err(refusal) => refused[refusal as usize] += 1,
        }
    }
    if found.is_empty() {
        let most = (0..refused.len()).max_by_key(|r| refused[*r]).unwrap_or(0);
        return Err(none(Refusal::ALL[most].words()));
    }
    Ok(found)
}

fn whole_centimeters(meters: f64) -> f64 {
    (meters * 100.0).round() / 100.0
}

catoptric_model::closed_set! {
    /// Why a pose is not possible.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    enum Refusal {
        Range,
        Room,
        Rig,
        Incidence,
        Unserved,
    }
}

impl Refusal {
    fn words(self) -> &'static str {
        match self {
            Self::Range => "walls, floor or ceiling are nearer than the minimum range",
            Self::Room => "the board would reach through a wall, floor or ceiling",
            Self::Rig => "the board would be inside the rig",
            Self::Incidence => "a beam would hit the board beyond the largest incidence",
            Self::Unserved => {
                "the board would hold no beam's whole spot, given how well directions are known"
            }
        }
    }
}

/// Inputs shared by all candidates of a facet.
pub(super) struct Site<'a> {
    situation: &'a Situation,
    fan: &'a Fan,
    request: Request,
    rig_radius: f64,
    cone: f64,
    lever: f64,
    least_cos: f64,
}

fn check(request: &Request) -> Result<(), CalibError> {
    let fail = |key: &str, needed, found| {
        Err(CalibError::Session {
            key: key.to_owned(),
            needed,
            found,
        })
    };
    let [low, high] = request.range_m;
    if !(low.is_finite() && low > 0.0) {
        return fail("minimum range", "a positive number of meters", low);
    }
    if !(high.is_finite() && high >= low) {
        return fail("maximum range", "at least the minimum range", high);
    }
    if !(request.max_incidence_deg > 0.0 && request.max_incidence_deg < 90.0) {
        return fail(
            "largest incidence",
            "between 0 and 90 degrees",
            request.max_incidence_deg,
        );
    }
    Ok(())
}

fn names(session: &Session) -> String {
    let names: Vec<&str> = session.facets.iter().map(|f| f.name.as_str()).collect();
    names.join(", ")
}

/// Radius around the sensor within which all markers and mirrors are, in meters.
fn rig_radius(session: &Session) -> f64 {
    let sensor_from_rig = Pose::from(&session.nominal_rig_from_sensor).inverse();
    let markers = session.rig_markers.iter().map(|m| sensor_from_rig * m.position());
    let corners = session.facets.iter().flat_map(|f| f.corners());
    markers
        .chain(corners)
        .fold(0.0, |r: f64, p| r.max(p.coords.norm()))
}

impl<'a> Site<'a> {
    pub(super) fn new(situation: &'a Situation, fan: &'a Fan, request: &Request) -> Self {
        let session = situation.session();
        Self {
            situation,
            fan,
            request: *request,
            rig_radius: rig_radius(session),
            cone: cone_half_angle(session),
            lever: longest_lever(session),
            least_cos: libm::cos(request.max_incidence_deg.to_radians()),
        }
    }

    /// The possible ones among some poses around another; later rounds try closer ones.
    pub(super) fn near(&self, center: &Candidate, round: i32) -> Vec<Candidate> {
        let elements = &self.fan.elements;
        let boards = &self.situation.session().boards;
        let Some(board) = boards.iter().position(|b| b.name == center.board) else {
            return Vec::new();
        };
        let aimed = elements.iter().position(|e| e.beam == center.beam).unwrap_or(0);
        let width = 0.5_f64.powi(round);
        let wishes = (0..NEAR).map(|number| {
            let off = |dimension: i32, reach: f64| {
                (2.0 * (0.5 + number as f64 * GAMMA.powi(-dimension)).fract() - 1.0) * reach * width
            };
            let element = (aimed as f64 + off(1, AROUND.0))
                .round()
                .clamp(0.0, elements.len() as f64 - 1.0);
            // Not negative and below the number of elements.
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            Wish {
                element: element as usize,
                board,
                range: whole_centimeters(center.range_m + off(2, AROUND.1)),
                tilt_deg: (center.tilt_deg + off(3, AROUND.2)).round().max(0.0),
                direction_deg: (center.direction_deg + off(4, AROUND.3))
                    .round()
                    .rem_euclid(360.0),
                roll_deg: (center.roll_deg + off(5, AROUND.4)).round().rem_euclid(180.0),
            }
        });
        wishes.filter_map(|wish| self.candidate(&wish).ok()).collect()
    }

    /// Number n of the sequence.
    fn wish(&self, number: usize) -> Wish {
        // An even start, and for each seed one step of the sequence, which moves all dimensions.
        let at = |dimension: i32| {
            let start = 0.5 + (self.request.seed % 1_000_003) as f64 * 0.618_033_988_749_894_9;
            (start + number as f64 * GAMMA.powi(-dimension)).fract()
        };
        let [low, high] = self.request.range_m;
        let elements = self.fan.elements.len();
        // In range: a fractional part is below one.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let element = ((at(1) * elements as f64) as usize).min(elements - 1);
        let reach = self.reach(&self.fan.elements[element]).min(high);
        // Whole centimeters and degrees, so that a person can set up the pose as printed.
        Wish {
            element,
            board: number % self.situation.session().boards.len(),
            range: whole_centimeters(low + (reach - low) * at(2)),
            tilt_deg: (self.request.max_incidence_deg * at(3)).round(),
            direction_deg: (360.0 * at(4)).round() % 360.0,
            roll_deg: (180.0 * at(5)).round() % 180.0,
        }
    }

    /// Distance along an element's ray to the shell of the room, in meters.
    fn reach(&self, element: &Element) -> f64 {
        let (origin, v) = self.ray(element);
        let room = self.situation.session().room.as_ref();
        room.and_then(|room| Some(room.cast(&origin, &v)?.0))
            .unwrap_or(f64::INFINITY)
    }

    /// An element's ray in the room.
    fn ray(&self, element: &Element) -> (Point3<f64>, Unit<Vector3<f64>>) {
        let room_from_sensor = self.situation.room_from_sensor();
        let origin = element.deflection.deflection_point(element.azimuth);
        let v = element.deflection.exit_direction(element.azimuth);
        (room_from_sensor * origin, room_from_sensor.rotation * v)
    }

    fn candidate(&self, wish: &Wish) -> Result<Candidate, Refusal> {
        let session = self.situation.session();
        let sheet = &session.boards[wish.board];
        let aimed = &self.fan.elements[wish.element];
        let (sin, cos) = libm::sincos(wish.tilt_deg.to_radians());
        let [min, max] = self.request.range_m;
        if wish.range < min || wish.range > max || wish.range * sin > self.lever * cos {
            return Err(Refusal::Range);
        }
        let room_from_board = self.pose(wish);
        if !stands_in(session, sheet, &room_from_board) {
            return Err(Refusal::Room);
        }
        let board = in_sensor(sheet, self.situation.room_from_sensor(), &room_from_board);
        if distance_from_sensor(&board) < self.rig_radius + RIG_CLEARANCE {
            return Err(Refusal::Rig);
        }
        let mut served = Vec::new();
        for (number, element) in self.fan.elements.iter().enumerate() {
            if element.is_held(&board, self.cone, self.fan.margin) {
                let v = element.deflection.exit_direction(element.azimuth);
                if board.plane.cos_incidence(&v) < self.least_cos {
                    return Err(Refusal::Incidence);
                }
                served.push(number);
            }
        }
        if served.is_empty() {
            return Err(Refusal::Unserved);
        }
        Ok(Candidate {
            board: sheet.name.clone(),
            room_from_board,
            beam: aimed.beam,
            range_m: wish.range,
            tilt_deg: wish.tilt_deg,
            direction_deg: wish.direction_deg,
            roll_deg: wish.roll_deg,
            beams: served.iter().map(|n| self.fan.elements[*n].beam).collect(),
            in_sensor: board,
            served,
        })
    }

    /// The board on the ray, tilted against it; without a roll its x axis is along the fan as far as the tilt allows.
    fn pose(&self, wish: &Wish) -> Pose {
        let elements = &self.fan.elements;
        let (origin, v) = self.ray(&elements[wish.element]);
        let (across, up) = tangent_basis(&v);
        let (sin_turn, cos_turn) = libm::sincos(wish.direction_deg.to_radians());
        let (sin_tilt, cos_tilt) = libm::sincos(wish.tilt_deg.to_radians());
        let sideways = across.into_inner() * cos_turn + up.into_inner() * sin_turn;
        let normal = Unit::new_normalize(sideways * sin_tilt - v.into_inner() * cos_tilt);
        let fan =
            self.ray(&elements[elements.len() - 1]).1.into_inner() - self.ray(&elements[0]).1.into_inner();
        let flat = fan - normal.into_inner() * normal.dot(&fan);
        let along = Unit::try_new(flat, 1e-9).unwrap_or_else(|| tangent_basis(&normal).0);
        let beside = normal.cross(&along);
        let (sin_roll, cos_roll) = libm::sincos(wish.roll_deg.to_radians());
        let x = along.into_inner() * cos_roll + beside * sin_roll;
        let axes = Matrix3::from_columns(&[x, normal.cross(&x), normal.into_inner()]);
        Pose::from_parts(
            Translation3::from(origin.coords + v.into_inner() * wish.range),
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes)),
        )
    }
}

/// Whether all corners of a board are inside the room.
fn stands_in(session: &Session, sheet: &BoardSheet, room_from_board: &Pose) -> bool {
    let Some(room) = &session.room else {
        return true;
    };
    sheet.outline().corners().iter().all(|corner| {
        let p = room_from_board * corner;
        (0..3).all(|i| p[i] >= room.min_m[i] + WALL_CLEARANCE && p[i] <= room.max_m[i] - WALL_CLEARANCE)
    })
}

/// Distance between the sensor and the nearest point of a board, in meters.
fn distance_from_sensor(board: &BoardInSensor) -> f64 {
    let sensor = board.sensor_from_board.inverse_transform_point(&Point3::origin());
    let half = [0.5 * board.outline.width, 0.5 * board.outline.height];
    let beyond = |axis: usize| (sensor[axis].abs() - half[axis]).max(0.0);
    Vector3::new(beyond(0), beyond(1), sensor.z).norm()
}
