//! From the readings of a stretch to points in space: Cooper, Eqs. (9) and (10), with a calibration.

use crate::score::residual;
use catoptric_model::{Calibration, Dataset, Deflection, Pose, PoseKind, PoseRecord, Status, beam, cloud};
use nalgebra::Point3;

/// Frame of a cloud.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum CloudFrame {
    /// The laser base frame.
    Sensor,
    /// The marker body on the superstructure.
    Rig,
    /// The frame of motion capture.
    #[default]
    Room,
}

impl CloudFrame {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Sensor, Self::Rig, Self::Room];

    /// The word that files and commands use.
    pub fn word(self) -> &'static str {
        match self {
            Self::Sensor => "sensor",
            Self::Rig => "rig",
            Self::Room => "room",
        }
    }
}

/// A point and the reading it comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudPoint {
    /// Where it is, in metres.
    pub position: Point3<f64>,
    /// Beam.
    pub beam: usize,
    /// Scan of the stretch, from 0.
    pub scan: usize,
}

/// A cloud and what is not in it.
#[derive(Debug, Clone, PartialEq)]
pub struct PointCloud {
    /// Its frame.
    pub frame: CloudFrame,
    /// Stretch it was made from.
    pub pose: usize,
    /// Whether the mounting was taken from the drawing because the calibration has none.
    pub mount_is_nominal: bool,
    /// The points, scan after scan.
    pub points: Vec<CloudPoint>,
    /// Readings that are no ranges: no return, too close, invalid.
    pub without_range: usize,
    /// Ranges of elements that the calibration gives no direction.
    pub without_direction: usize,
    /// Elements that the calibration gives no direction.
    pub unsolved_elements: usize,
}

/// Why no cloud can be made.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ApplyError {
    /// No stretch has the number asked for.
    #[error("the dataset has no pose {asked}; its poses are numbered {first} to {last}")]
    NoSuchPose {
        /// The number asked for.
        asked: usize,
        /// The smallest there is.
        first: usize,
        /// The largest there is.
        last: usize,
    },
    /// No stretch was asked for, and there is none of the room.
    #[error("the dataset has no stretch of the empty room; say which pose to apply the calibration to")]
    NoRoom,
}

/// Lifts every range of a stretch into space: of pose number `pose`, or else of the first stretch of the empty room.
///
/// Solved elements follow Eq. 9, direct ones stay in the scan plane, the others are left out and counted. Ranges are
/// corrected by E_r and by E_c of the room's color (of the board's, in a stretch with a board), as calibrated or
/// believed. Unlike the paper's Eq. 3, E_a is not taken off: the incidence on an unknown scene is unknown.
///
/// # Errors
/// [`ApplyError`] if there is no such stretch.
pub fn apply(
    dataset: &Dataset,
    calibration: &Calibration,
    pose: Option<usize>,
    frame: CloudFrame,
) -> Result<PointCloud, ApplyError> {
    let record = find(dataset, pose)?;
    let rig_from_sensor = residual::mount(dataset, calibration);
    let frame_from_sensor = match frame {
        CloudFrame::Sensor => Pose::identity(),
        CloudFrame::Rig => rig_from_sensor,
        CloudFrame::Room => record.room_from_rig * rig_from_sensor,
    };
    let bias = residual::bias(dataset, calibration);
    let color = record
        .label
        .color
        .as_deref()
        .unwrap_or(&dataset.session.room.color);
    let deflections: Vec<Option<Deflection>> =
        (0..record.beams).map(|b| deflection(calibration, b)).collect();

    let mut result = PointCloud {
        frame,
        pose: record.label.pose,
        mount_is_nominal: frame != CloudFrame::Sensor && calibration.rig_from_sensor.is_none(),
        points: Vec::new(),
        without_range: 0,
        without_direction: 0,
        unsolved_elements: deflections.iter().filter(|d| d.is_none()).count(),
    };
    for (scan, ranges) in record.ranges.chunks(record.beams.max(1)).enumerate() {
        for (beam, (&range, deflection)) in ranges.iter().zip(&deflections).enumerate() {
            if !range.is_finite() {
                result.without_range += 1;
                continue;
            }
            let Some(deflection) = deflection else {
                result.without_direction += 1;
                continue;
            };
            // E_a of whatever incidence is not added, so any will do here.
            let terms = bias.terms(range, 1.0, color);
            let corrected = range - terms.distance - terms.color;
            let in_sensor = cloud::lift(deflection, beam::azimuth(beam), corrected);
            result.points.push(CloudPoint {
                position: frame_from_sensor * in_sensor,
                beam,
                scan,
            });
        }
    }
    Ok(result)
}

fn find(dataset: &Dataset, pose: Option<usize>) -> Result<&PoseRecord, ApplyError> {
    let Some(asked) = pose else {
        return dataset.first(PoseKind::Room).ok_or(ApplyError::NoRoom);
    };
    let numbers = || dataset.poses.iter().map(|p| p.label.pose);
    let found = dataset.poses.iter().find(|p| p.label.pose == asked);
    found.ok_or_else(|| ApplyError::NoSuchPose {
        asked,
        first: numbers().min().unwrap_or(0),
        last: numbers().max().unwrap_or(0),
    })
}

/// What the calibration says becomes of a beam; `None` where it does not know.
fn deflection(calibration: &Calibration, beam: usize) -> Option<Deflection> {
    let estimate = calibration.beam(beam)?;
    match estimate.status {
        Status::Solved => estimate.deflection(),
        Status::Direct => Some(Deflection::NONE),
        Status::TooFewPoses | Status::Unobservable | Status::NotConverged | Status::Rejected => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::{perfect, sample};
    use catoptric_model::{ColorBias, DistanceBias, RangeBias};

    /// Distance of a point from the nearest wall, in metres.
    fn off_wall(dataset: &Dataset, p: &Point3<f64>) -> f64 {
        let room = &dataset.session.room;
        (0..3)
            .flat_map(|i| [(p[i] - room.min_m[i]).abs(), (p[i] - room.max_m[i]).abs()])
            .fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn the_cloud_of_the_empty_room_is_the_room() {
        let s = sample();
        let cloud = apply(&s.dataset, &perfect(&s.truth), None, CloudFrame::Room).expect("there is a room");
        assert_eq!(cloud.pose, 0);
        assert!(cloud.points.len() > 1500);
        assert!(
            cloud
                .points
                .iter()
                .all(|p| off_wall(&s.dataset, &p.position) < 1e-9)
        );
        let all: usize = s.dataset.poses[0].ranges.len();
        assert_eq!(
            cloud.points.len() + cloud.without_range + cloud.without_direction,
            all
        );
        // Exact readings, two scans: what is left out are the ranges of rejected and blocked elements.
        assert_eq!(
            (cloud.without_range, cloud.without_direction),
            (0, 2 * cloud.unsolved_elements)
        );
        assert!(cloud.unsolved_elements > 0 && !cloud.mount_is_nominal);
    }

    #[test]
    fn frames_differ_by_the_poses_between_them() {
        let s = sample();
        let calibration = perfect(&s.truth);
        let first = |frame| {
            apply(&s.dataset, &calibration, None, frame)
                .expect("there is a room")
                .points[0]
        };
        let in_sensor = first(CloudFrame::Sensor).position;
        let rig_from_sensor = Pose::from(&s.truth.rig_from_sensor);
        let room_from_rig = s.dataset.poses[0].room_from_rig;
        assert!((first(CloudFrame::Rig).position - rig_from_sensor * in_sensor).norm() < 1e-12);
        assert!(
            (first(CloudFrame::Room).position - room_from_rig * rig_from_sensor * in_sensor).norm() < 1e-12
        );
    }

    #[test]
    fn direct_elements_stay_in_the_plane() {
        let s = sample();
        let cloud = apply(&s.dataset, &perfect(&s.truth), None, CloudFrame::Sensor).expect("there is a room");
        let forward = cloud
            .points
            .iter()
            .find(|p| p.beam == beam::FORWARD)
            .expect("it is direct");
        assert_eq!((forward.position.y, forward.position.z), (0.0, 0.0));
        assert_eq!(forward.position.x, s.dataset.poses[0].ranges[beam::FORWARD]);
        assert!(cloud.points.iter().any(|p| p.position.z > 1.0));
    }

    #[test]
    fn ranges_lose_what_depends_on_distance_and_color_but_not_on_incidence() {
        let s = sample();
        let mut calibration = perfect(&s.truth);
        let mut bias = RangeBias {
            distance: DistanceBias {
                range_m: vec![1.0],
                error_mm: vec![7.0],
            },
            ..RangeBias::default()
        };
        bias.angle.offset_mm = 50.0;
        bias.color.insert(
            "white".to_owned(),
            ColorBias {
                slope_mm_per_m: 0.0,
                offset_mm: 3.0,
            },
        );
        calibration.bias = Some(bias);
        let cloud = apply(&s.dataset, &calibration, Some(0), CloudFrame::Sensor).expect("there is a room");
        let forward = cloud
            .points
            .iter()
            .find(|p| p.beam == beam::FORWARD)
            .expect("it is direct");
        let range = s.dataset.poses[0].ranges[beam::FORWARD];
        assert!((forward.position.x - (range - 0.010)).abs() < 1e-12);
    }

    #[test]
    fn codes_are_no_points() {
        let mut s = sample();
        for (place, code) in [(540, f64::NAN), (541, f64::INFINITY), (542, f64::NEG_INFINITY)] {
            s.dataset.poses[0].ranges[place] = code;
        }
        let cloud = apply(&s.dataset, &perfect(&s.truth), None, CloudFrame::Room).expect("there is a room");
        assert_eq!(cloud.without_range, 3);
        assert!(
            cloud
                .points
                .iter()
                .all(|p| p.position.iter().all(|x| x.is_finite()))
        );
    }

    #[test]
    fn a_stretch_that_is_not_there_is_an_error() {
        let mut s = sample();
        let calibration = perfect(&s.truth);
        let error = apply(&s.dataset, &calibration, Some(99), CloudFrame::Room).expect_err("there are 49");
        assert_eq!(
            error.to_string(),
            "the dataset has no pose 99; its poses are numbered 0 to 48"
        );
        s.dataset.poses.remove(0);
        let error = apply(&s.dataset, &calibration, None, CloudFrame::Room).expect_err("no room is left");
        assert_eq!(error, ApplyError::NoRoom);
    }

    #[test]
    fn without_a_mounting_the_drawing_is_used_and_said_so() {
        let s = sample();
        let mut calibration = perfect(&s.truth);
        calibration.rig_from_sensor = None;
        let cloud = apply(&s.dataset, &calibration, None, CloudFrame::Room).expect("there is a room");
        assert!(cloud.mount_is_nominal);
    }
}
