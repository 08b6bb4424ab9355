//! Boards in the sensor frame (step 6), and an element's readings of them.

use catoptric_model::{BoardPlane, Pose, PoseRecord, RawRange, Rectangle, Session, Summary};
use nalgebra::{Point3, Unit, Vector3};

/// Number of spot radii (1/e²) that have to be on a board for a reading to be of that board alone.
///
/// One and a half: beyond an edge 0.13 % of a Gaussian beam is outside, a millimeter against a wall one meter behind.
pub const SPOT_RADII: f64 = 1.5;

/// The board of one pose, in the sensor frame.
#[derive(Debug, Clone, PartialEq)]
pub struct BoardInSensor {
    /// Pose of its face: the tracked one, in front by the board's thickness.
    pub sensor_from_board: Pose,
    /// The plane of its face.
    pub plane: BoardPlane,
    /// Its outline.
    pub outline: Rectangle,
    /// Its markers from the template, in the sensor frame, in meters.
    pub markers: Vec<Point3<f64>>,
    /// Its color.
    pub color: String,
}

/// Where a ray hits the plane of a board.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance along the ray, in meters.
    pub distance: f64,
    /// The point in the sensor frame.
    pub point: Point3<f64>,
    /// The point in the board frame.
    pub in_board: Point3<f64>,
    /// Tangent of the ray's slope against the board's normal, along the board's x and y.
    pub slope: [f64; 2],
}

/// Everything about a board and an element's readings of it, except the range itself, that decides how well it
/// determines the element's direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardView<'a> {
    /// Plane (c, n) of the board in the sensor frame.
    pub plane: BoardPlane,
    /// The board's markers from the template, in the sensor frame, in meters.
    pub markers: &'a [Point3<f64>],
    /// Color of the board.
    pub color: &'a str,
    /// White noise of one reading, 1σ, in meters.
    pub noise_sd: f64,
    /// Number of readings of it.
    pub count: usize,
}

/// The readings of one board by one element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation<'a> {
    /// The board.
    pub board: BoardView<'a>,
    /// Mean of the readings.
    pub mean: RawRange,
}

impl BoardInSensor {
    /// The board of a pose, seen by a sensor mounted at `rig_from_sensor`; `None` if the pose has none.
    pub fn of(record: &PoseRecord, session: &Session, rig_from_sensor: &Pose) -> Option<Self> {
        let sheet = session.board(record.label.board.as_deref()?)?;
        let room_from_board = record.room_from_board?;
        let tracked = (record.room_from_rig * rig_from_sensor).inverse() * room_from_board;
        let sensor_from_board = sheet.face(&tracked);
        Some(Self {
            sensor_from_board,
            plane: BoardPlane::of_pose(&sensor_from_board),
            outline: sheet.outline(),
            markers: sheet.markers.iter().map(|m| tracked * m.position()).collect(),
            color: record.label.color.clone().unwrap_or_else(|| sheet.color.clone()),
        })
    }

    /// Where a ray hits the board's plane; `None` if it misses.
    pub fn hit(&self, origin: &Point3<f64>, direction: &Unit<Vector3<f64>>) -> Option<Hit> {
        let distance = self.plane.distance_along(origin, direction)?;
        let point = origin + direction.into_inner() * distance;
        let along = self
            .sensor_from_board
            .rotation
            .inverse_transform_vector(&direction.into_inner());
        Some(Hit {
            distance,
            point,
            in_board: self.sensor_from_board.inverse_transform_point(&point),
            slope: [along.x / along.z, along.y / along.z],
        })
    }

    /// Whether the board holds a spot of the given radius (measured across the beam, in meters) plus `margin`.
    ///
    /// On a board at a slope the round spot is an ellipse; its half extent along x is radius·√(1 + slope_x²).
    pub fn holds(&self, hit: &Hit, spot_radius: f64, margin: f64) -> bool {
        let half = [0.5 * self.outline.width, 0.5 * self.outline.height];
        (0..2).all(|axis| {
            let extent = spot_radius * (1.0 + hit.slope[axis] * hit.slope[axis]).sqrt();
            hit.in_board[axis].abs() + extent + margin <= half[axis]
        })
    }

    /// The board for an element that read it `summary.count` times.
    pub fn view(&self, noise_sd: f64, count: usize) -> BoardView<'_> {
        BoardView {
            plane: self.plane,
            markers: &self.markers,
            color: &self.color,
            noise_sd,
            count,
        }
    }

    /// The board with the mean of an element's readings of it.
    pub fn observation(&self, noise_sd: f64, summary: &Summary) -> Observation<'_> {
        Observation {
            board: self.view(noise_sd, summary.count),
            mean: RawRange(summary.mean),
        }
    }
}

/// Base azimuth of a beam of the session's scanner, in radians.
pub fn azimuth(session: &Session, beam: usize) -> f64 {
    session.scanner.scan.azimuth(beam)
}

/// Half angle of the cone that has to be on one surface, in radians: [`SPOT_RADII`] times half the divergence.
pub fn cone_half_angle(session: &Session) -> f64 {
    SPOT_RADII * 0.5e-3 * session.scanner.divergence_full_mrad
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Translation3, UnitQuaternion};

    #[test]
    fn a_sloping_ray_needs_more_room() {
        let board = BoardInSensor {
            sensor_from_board: Pose::from_parts(
                Translation3::new(2.0, 0.0, 0.0),
                UnitQuaternion::from_scaled_axis(Vector3::y() * -std::f64::consts::FRAC_PI_2),
            ),
            plane: BoardPlane::new(Point3::new(2.0, 0.0, 0.0), -Vector3::x_axis()),
            outline: Rectangle {
                width: 0.4,
                height: 0.2,
            },
            markers: Vec::new(),
            color: String::new(),
        };
        let straight = board
            .hit(&Point3::origin(), &Vector3::x_axis())
            .expect("the beam hits the board");
        assert!((straight.distance - 2.0).abs() < 1e-15 && straight.in_board.coords.norm() < 1e-12);
        assert!(board.holds(&straight, 0.09, 0.0) && !board.holds(&straight, 0.09, 0.02));
        // From the side, at 60° against the normal and along the board's y: the spot is twice as long there.
        let from = Point3::new(1.0, -3.0_f64.sqrt(), 0.0);
        let direction = Unit::new_normalize(Point3::new(2.0, 0.0, 0.0) - from);
        let sloped = board.hit(&from, &direction).expect("the beam hits the board");
        assert!((sloped.slope[1].abs() - 3.0_f64.sqrt()).abs() < 1e-12);
        assert!(board.holds(&sloped, 0.049, 0.0) && !board.holds(&sloped, 0.051, 0.0));
    }
}
