//! A mounting read in another way: the inverse, another order of the quaternion, another unit.

use crate::score::mistake::{LEFT, Mistake};
use crate::score::{Mounting, gate};
use catoptric_model::calibration::MountEstimate;
use catoptric_model::{Pose, PoseData};

pub(super) fn recognize(
    found: &Mounting,
    estimate: &MountEstimate,
    error: impl Fn(&Pose) -> Mounting,
) -> Option<Mistake> {
    if found.nees <= gate::mean_limit(6.0) {
        return None;
    }
    let [x, y, z, w] = estimate.rotation_xyzw;
    let read = |translation_m: [f64; 3], rotation_xyzw: [f64; 4]| {
        Pose::from(&PoseData {
            translation_m,
            rotation_xyzw,
        })
    };
    let (at, turned) = (estimate.translation_m, estimate.rotation_xyzw);
    let pose = estimate.pose();
    let turned_back = [-x, -y, -z, w];
    let candidates = [
        ("the mounting inverted (it is sensor_from_rig)", pose.inverse()),
        ("the quaternion in the order (w, x, y, z)", read(at, [y, z, w, x])),
        ("the rotation inverted", read(at, turned_back)),
        ("the translation negated", read(at.map(|c| -c), turned)),
        (
            "the translation given along the sensor's axes",
            Pose::from_parts((pose.rotation * pose.translation.vector).into(), pose.rotation),
        ),
        (
            "the translation in millimeters",
            read(at.map(|c| c * 1e-3), turned),
        ),
        ("the translation in kilometers", read(at.map(|c| c * 1e3), turned)),
    ];
    let is_better = |m: &Mounting| m.nees <= LEFT * LEFT * found.nees;
    let (words, better) = candidates
        .iter()
        .map(|(words, pose)| (*words, error(pose)))
        .filter(|(_, m)| is_better(m))
        .min_by(|(_, a), (_, b)| a.nees.total_cmp(&b.nees))?;
    let turned = better.attitude_deg <= LEFT * found.attitude_deg;
    let (figure, found, would_be) = if turned {
        ("mounting.attitude_deg", found.attitude_deg, better.attitude_deg)
    } else {
        ("mounting.position_mm", found.position_mm, better.position_mm)
    };
    Some(Mistake {
        correction: words.to_owned(),
        figure,
        found,
        would_be,
    })
}
