//! Lifts the readings of a stretch to points in space, given a calibration: Cooper, Eqs. (9) and (10).

mod sketch;

use crate::score::residual;
use crate::validate::{Problem, Severity, validate_for};
#[cfg(doc)]
use catoptric_model::Motion;
use catoptric_model::cloud::{self, CloudFrame, CloudPoint, PointCloud};
use catoptric_model::{
    Calibration, Dataset, Deflection, Pose, PoseKind, PoseRecord, RangeBias, ScanGeometry, Session, Status,
    Unreadable,
};
pub use sketch::{CloudSketch, Extent};

/// Why no cloud can be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
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
    /// Readings that the dataset's recording gives no more.
    #[error(transparent)]
    Unreadable(#[from] Unreadable),
    /// The calibration is refused by [`validate_for`], or is of another scanner.
    #[error("the calibration is invalid: {}{}", .0[0], more(.0))]
    Invalid(Vec<Problem>),
}

/// How many problems follow the first.
fn more(problems: &[Problem]) -> String {
    match problems.len() {
        0 | 1 => String::new(),
        n => format!("; and {} more, which `catoptric validate` lists", n - 1),
    }
}

/// Lifts every range of a stretch into space: of pose number `pose`, or by default of the first stretch of the empty
/// room.
///
/// Solved elements follow Eq. (9), direct ones stay in the scan plane, the others are omitted and counted. Ranges are
/// corrected by E_r and by E_c of the room's color (of the board's, in a stretch with a board), as calibrated or
/// believed, and for glass in front of the mirrors, at its stated thickness. Unlike the paper, Eq. (3), E_a is not
/// subtracted: the incidence on an unknown scene is unknown.
///
/// In a flight, the pose of the rig is the one tracked by motion capture at the time of each reading (see
/// [`Motion::room_from_rig`]); the sensor and rig frames are those of that time, too.
///
/// The cloud is in memory; [`Lift`] hands on point by point.
///
/// # Errors
/// [`ApplyError`] if there is no such stretch, its readings are there no more, or the calibration is invalid or of another
/// scanner.
pub fn apply(
    dataset: &Dataset,
    calibration: &Calibration,
    pose: Option<usize>,
    frame: CloudFrame,
) -> Result<PointCloud, ApplyError> {
    let lift = Lift::new(dataset, calibration, pose, frame)?;
    let mut points = Vec::with_capacity(lift.sheet.points);
    lift.each(|point| {
        points.push(point);
        Ok::<_, ApplyError>(())
    })?;
    let CloudSheet {
        frame,
        pose,
        mount_is_nominal,
        points: _,
        without_range,
        without_direction,
        without_pose,
        unsolved_elements,
    } = lift.sheet;
    Ok(PointCloud {
        frame,
        pose,
        mount_is_nominal,
        points,
        without_range,
        without_direction,
        without_pose,
        unsolved_elements,
    })
}

/// What is known of a cloud before a point of it is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CloudSheet {
    /// Its frame.
    pub frame: CloudFrame,
    /// Stretch it is made from.
    pub pose: usize,
    /// Whether the mounting is taken from the drawing because the calibration has none.
    pub mount_is_nominal: bool,
    /// Number of its points.
    pub points: usize,
    /// Readings that are no ranges: no return, too close, invalid.
    pub without_range: usize,
    /// Ranges of elements that the calibration gives no direction.
    pub without_direction: usize,
    /// Ranges of times for which motion capture gives the rig no pose.
    pub without_pose: usize,
    /// Elements that the calibration gives no direction.
    pub unsolved_elements: usize,
}

/// A stretch as [`apply`] lifts it, point by point and in memory that does not grow with its scans.
#[derive(Debug)]
pub struct Lift<'a> {
    /// What is known of the cloud.
    pub sheet: CloudSheet,
    record: &'a PoseRecord,
    /// Of every beam that has a direction, with the delay by glass, in meters.
    deflections: Vec<Option<(Deflection, f64)>>,
    rig_from_sensor: Pose,
    scan: &'a ScanGeometry,
    bias: &'a RangeBias,
    color: &'a str,
}

impl<'a> Lift<'a> {
    /// Prepares a stretch.
    ///
    /// # Errors
    /// [`ApplyError`] if there is no such stretch, or the calibration is invalid or of another scanner.
    pub fn new(
        dataset: &'a Dataset,
        calibration: &'a Calibration,
        pose: Option<usize>,
        frame: CloudFrame,
    ) -> Result<Self, ApplyError> {
        let mut problems = validate_for(calibration, &dataset.session);
        problems.retain(|p| p.severity == Severity::Error);
        if !problems.is_empty() {
            return Err(ApplyError::Invalid(problems));
        }
        let record = find(dataset, pose)?;
        // Nothing is believed about a color without a name.
        let room_color = dataset.session.room.as_ref().map_or("", |room| &room.color);
        let deflections: Vec<Option<(Deflection, f64)>> = (0..record.beams())
            .map(|b| deflection(calibration, &dataset.session, b))
            .collect();
        let mut sheet = CloudSheet {
            frame,
            pose: record.label.pose,
            mount_is_nominal: frame != CloudFrame::Sensor && calibration.rig_from_sensor.is_none(),
            points: 0,
            without_range: 0,
            without_direction: 0,
            without_pose: 0,
            unsolved_elements: deflections.iter().filter(|d| d.is_none()).count(),
        };
        for (of, deflection) in record.readings.statistics().iter().zip(&deflections) {
            sheet.without_range += of.missing;
            match deflection {
                Some(_) => sheet.points += of.all.count,
                None => sheet.without_direction += of.all.count,
            }
        }
        let mut lift = Self {
            sheet,
            record,
            deflections,
            rig_from_sensor: residual::mount(dataset, calibration),
            scan: &dataset.session.scanner.scan,
            bias: residual::bias(dataset, calibration),
            color: record.label.color.as_deref().unwrap_or(room_color),
        };
        if record.motion.is_some() && frame == CloudFrame::Room {
            let mut points = 0;
            lift.each(|_| {
                points += 1;
                Ok::<_, Unreadable>(())
            })?;
            lift.sheet.without_pose = lift.sheet.points - points;
            lift.sheet.points = points;
        }
        Ok(lift)
    }

    /// Makes the points, scan after scan, and hands each on.
    ///
    /// # Errors
    /// [`Unreadable`] if the readings are there no more, or what `take` says.
    pub fn each<E: From<Unreadable>>(
        &self,
        mut take: impl FnMut(CloudPoint) -> Result<(), E>,
    ) -> Result<(), E> {
        for (scan, ranges) in self.record.scans().enumerate() {
            for (beam, (&range, deflection)) in ranges?.iter().zip(&self.deflections).enumerate() {
                let Some((deflection, delay)) = deflection.as_ref().filter(|_| range.is_finite()) else {
                    continue;
                };
                // E_a of whatever incidence is not added, so any will do here.
                let terms = self.bias.terms(range, 1.0, self.color);
                let corrected = range - terms.distance - terms.color - delay;
                let in_sensor = cloud::lift(deflection, self.scan.azimuth(beam), corrected);
                // During a flight, the rig is nowhere known while motion capture has lost it.
                let Some(frame_from_sensor) = self.frame_from_sensor(scan, beam) else {
                    continue;
                };
                take(CloudPoint {
                    position: frame_from_sensor * in_sensor,
                    beam,
                    scan,
                })?;
            }
        }
        Ok(())
    }

    fn frame_from_sensor(&self, scan: usize, beam: usize) -> Option<Pose> {
        match self.sheet.frame {
            CloudFrame::Sensor => Some(Pose::identity()),
            CloudFrame::Rig => Some(self.rig_from_sensor),
            CloudFrame::Room => Some(self.room_from_rig(scan, beam)? * self.rig_from_sensor),
        }
    }

    fn room_from_rig(&self, scan: usize, beam: usize) -> Option<Pose> {
        match &self.record.motion {
            Some(motion) => motion.room_from_rig(motion.time_s(scan, beam, self.scan.beam_time_s())),
            None => Some(self.record.room_from_rig),
        }
    }
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

/// Returns the deflection of a beam according to the calibration, as a front-surface mirror's, and the delay by glass;
/// `None` if it has no direction.
fn deflection(calibration: &Calibration, session: &Session, beam: usize) -> Option<(Deflection, f64)> {
    let estimate = calibration.beam(beam)?;
    match estimate.status {
        Status::Solved => {
            Some(session.without_glass(session.scanner.scan.azimuth(beam), &estimate.deflection()?))
        }
        Status::Direct => Some((Deflection::NONE, 0.0)),
        Status::TooFewPoses | Status::Unobservable | Status::NotConverged | Status::Rejected => None,
    }
}

#[cfg(test)]
mod tests;
