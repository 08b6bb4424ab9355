//! The same scene and seed give the same numbers, on any number of threads and in any order.

use crate::scenes::{PROTOTYPE, scene};
use catoptric::sim::Laboratory;
use catoptric::testing::same_result;

#[test]
fn a_stretch_recorded_alone_equals_the_same_stretch_recorded_in_sequence() {
    let mut scene = scene(PROTOTYPE);
    scene.experiment.scans_per_pose = 3;
    let laboratory = Laboratory::new(&scene, 5).expect("the scene is valid");
    let in_turn: Vec<_> = (0..laboratory.stretches())
        .map(|i| laboratory.stretch(i).expect("recorded"))
        .collect();
    let again = Laboratory::new(&scene, 5).expect("the scene is valid");
    for number in [40, 3, 17] {
        assert_eq!(again.stretch(number).expect("recorded"), in_turn[number]);
    }
    let other = Laboratory::new(&scene, 6).expect("the scene is valid");
    assert_ne!(other.stretch(3).expect("recorded").ranges, in_turn[3].ranges);
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let mut scene = scene(PROTOTYPE);
    scene.experiment.scans_per_pose = 2;
    scene.experiment.poses_per_group = 3;
    let record = || {
        let laboratory = Laboratory::new(&scene, 1).expect("the scene is valid");
        (
            laboratory.dataset().expect("recorded"),
            laboratory.truth().expect("known"),
        )
    };
    same_result(&[1, 2, 7], record).expect("all are the same");
}
