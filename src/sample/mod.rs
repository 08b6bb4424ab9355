//! A small experiment for tests: eight mirrors, their truth, exact readings of boards and room, a calibration.

mod noise;
mod readings;
mod session;
mod structure;
mod submission;

use catoptric_model::frame::yaw_pitch_roll;
use catoptric_model::{Dataset, Pose, PoseData, PoseKind, RangeBias, beam};
use catoptric_sim::Truth;
use catoptric_sim::truth::{TrueBeam, TrueFacet};
use nalgebra::Translation3;
use readings::{boards_of, reading, record};
use session::session;
use structure::{mirrors, true_beam};

pub(crate) use noise::Noise;
pub(crate) use submission::{noisy, perfect, turned};

/// A dataset without errors, and its truth.
pub(crate) struct Sample {
    pub(crate) dataset: Dataset,
    pub(crate) truth: Truth,
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
