//! Lifts the readings of a stretch to points in space, given a calibration: Cooper, Eqs. (9) and (10).

use crate::score::residual;
#[cfg(doc)]
use catoptric_model::Motion;
use catoptric_model::cloud::{self, CloudFrame, CloudPoint, PointCloud};
use catoptric_model::{Calibration, Dataset, Deflection, Pose, PoseKind, PoseRecord, Status, beam};

/// Why no point cloud can be computed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ApplyError {
    /// No stretch has the requested number.
    #[error("the dataset has no pose {asked}; its poses are numbered {first} to {last}")]
    NoSuchPose {
        /// The requested number.
        asked: usize,
        /// The smallest number in the dataset.
        first: usize,
        /// The largest number in the dataset.
        last: usize,
    },
    /// No stretch was requested, and there is none of the empty room.
    #[error("the dataset has no stretch of the empty room; specify the pose to apply the calibration to")]
    NoRoom,
}

/// Lifts every range of a stretch into space: of pose number `pose`, or by default of the first stretch of the empty
/// room.
///
/// Solved elements follow Eq. (9), direct ones stay in the scan plane, the others are omitted and counted. Ranges are
/// corrected by E_r and by E_c of the room's color (of the board's, in a stretch with a board), as calibrated or
/// believed. Unlike the paper, Eq. (3), E_a is not subtracted: the incidence on an unknown scene is unknown.
///
/// In a flight, the pose of the rig is the one tracked by motion capture at the time of each reading (see
/// [`Motion::room_from_rig`]); the sensor and rig frames are those of that time, too.
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
    let step_period_s = dataset.session.scanner.step_period_s();
    let room_from_rig = |scan, beam| {
        let motion = record.motion.as_ref();
        motion
            .and_then(|m| m.room_from_rig(m.time_s(scan, beam, step_period_s)))
            .unwrap_or(record.room_from_rig)
    };
    let frame_from_sensor = |scan, beam| match frame {
        CloudFrame::Sensor => Pose::identity(),
        CloudFrame::Rig => rig_from_sensor,
        CloudFrame::Room => room_from_rig(scan, beam) * rig_from_sensor,
    };
    let bias = residual::bias(dataset, calibration);
    // There are no beliefs about a color without a name.
    let room_color = dataset.session.room.as_ref().map_or("", |room| &room.color);
    let color = record.label.color.as_deref().unwrap_or(room_color);
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
            // E_a is not subtracted, so the incidence does not matter here.
            let terms = bias.terms(range, 1.0, color);
            let corrected = range - terms.distance - terms.color;
            let in_sensor = cloud::lift(deflection, beam::azimuth(beam), corrected);
            result.points.push(CloudPoint {
                position: frame_from_sensor(scan, beam) * in_sensor,
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

/// Returns the deflection of a beam according to the calibration; `None` if it has none.
fn deflection(calibration: &Calibration, beam: usize) -> Option<Deflection> {
    let estimate = calibration.beam(beam)?;
    match estimate.status {
        Status::Solved => estimate.deflection(),
        Status::Direct => Some(Deflection::NONE),
        Status::TooFewPoses | Status::Unobservable | Status::NotConverged | Status::Rejected => None,
    }
}

#[cfg(test)]
mod tests;
