//! The cloud of a room matches the room, in every frame; readings that cannot be lifted are counted.

use super::*;
use catoptric_fixtures::ust20lx;
use catoptric_fixtures::{perfect, sample};
use catoptric_model::glass::GlassSheet;
use catoptric_model::{ColorBias, DistanceBias, RangeBias};
use nalgebra::{Point3, Unit};

/// The first scan.
fn scan(dataset: &Dataset) -> &[f64] {
    dataset.poses[0].readings.held().expect("in memory")
}

/// Distance of a point from the nearest wall, in meters.
fn off_wall(dataset: &Dataset, p: &Point3<f64>) -> f64 {
    let room = dataset.session.room.as_ref().expect("the sample has walls");
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
    let all: usize = s.dataset.poses[0].readings.len();
    assert_eq!(
        cloud.points.len() + cloud.without_range + cloud.without_direction,
        all
    );
    // Exact readings, two scans: only the ranges of rejected and blocked elements are omitted.
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
    assert!((first(CloudFrame::Room).position - room_from_rig * rig_from_sensor * in_sensor).norm() < 1e-12);
}

#[test]
fn direct_elements_stay_in_the_plane() {
    let s = sample();
    let cloud = apply(&s.dataset, &perfect(&s.truth), None, CloudFrame::Sensor).expect("there is a room");
    let forward = cloud
        .points
        .iter()
        .find(|p| p.beam == ust20lx::FORWARD)
        .expect("it is direct");
    assert_eq!((forward.position.y, forward.position.z), (0.0, 0.0));
    assert_eq!(forward.position.x, scan(&s.dataset)[ust20lx::FORWARD]);
    assert!(cloud.points.iter().any(|p| p.position.z > 1.0));
}

#[test]
fn ranges_are_corrected_for_distance_and_color_but_not_for_incidence() {
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
        .find(|p| p.beam == ust20lx::FORWARD)
        .expect("it is direct");
    let range = scan(&s.dataset)[ust20lx::FORWARD];
    assert!((forward.position.x - (range - 0.010)).abs() < 1e-12);
}

#[test]
fn codes_become_no_points() {
    let mut s = sample();
    for (place, code) in [(540, f64::NAN), (541, f64::INFINITY), (542, f64::NEG_INFINITY)] {
        let ranges = s.dataset.poses[0].readings.held_mut().expect("in memory");
        ranges[place] = code;
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
fn a_missing_stretch_is_an_error() {
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
fn without_a_mounting_the_drawing_is_used_and_reported() {
    let s = sample();
    let mut calibration = perfect(&s.truth);
    calibration.rig_from_sensor = None;
    let cloud = apply(&s.dataset, &calibration, None, CloudFrame::Room).expect("there is a room");
    assert!(cloud.mount_is_nominal);
}

/// What glass adds to the range comes off again, and the mirror is as far behind its front as it seems.
#[test]
fn the_cloud_is_the_room_through_glass_too() {
    let mut s = sample();
    let session = &mut s.dataset.session;
    session.glass = Some(GlassSheet {
        thickness_mm: 3.0,
        ..GlassSheet::default()
    });
    let calibration = perfect(&s.truth);
    let scan = session.scanner.scan;
    let room = session.room.clone().expect("the sample has walls");
    let room_from_sensor = s.dataset.poses[0].room_from_rig * Pose::from(&s.truth.rig_from_sensor);
    let beams = scan.beams();
    let ranges = s.dataset.poses[0].readings.held_mut().expect("in memory");
    let mut set_back = 0;
    for estimate in &calibration.beams {
        let Some(deflection) = estimate.deflection() else {
            continue;
        };
        let azimuth = scan.azimuth(estimate.beam);
        let (bare, delay) = session.without_glass(azimuth, &deflection);
        let origin = room_from_sensor * bare.deflection_point(azimuth);
        let exit = Unit::new_unchecked(room_from_sensor * deflection.exit_direction(azimuth).into_inner());
        let (beyond, _) = room.cast(&origin, &exit).expect("walls all around");
        for range in ranges.iter_mut().skip(estimate.beam).step_by(beams) {
            if range.is_finite() {
                *range = bare.distance + beyond + delay;
            }
        }
        // 3 mm at any incidence: more than the thickness over n, less than at grazing incidence.
        let by = bare.distance - deflection.distance;
        assert!((1.98e-3..2.66e-3).contains(&by) && delay > 4.0e-3, "{by} {delay}");
        set_back += 1;
    }
    assert!(set_back > 300, "{set_back}");
    let cloud = apply(&s.dataset, &calibration, None, CloudFrame::Room).expect("there is a room");
    for p in &cloud.points {
        assert!(off_wall(&s.dataset, &p.position) < 1e-9, "beam {}", p.beam);
    }
}

/// The header of a file counts what follows it, though the tracker lost the rig.
#[test]
fn readings_without_a_pose_of_the_rig_are_counted_and_no_points() {
    let mut s = sample();
    let here = s.dataset.poses[0].room_from_rig;
    let motion = |frames: &[f64]| catoptric_model::Motion {
        start_s: 0.0,
        scan_period_s: 1.0,
        scan_starts_s: Vec::new(),
        frames: frames.iter().map(|t| (*t, here)).collect(),
    };
    let calibration = perfect(&s.truth);
    let whole = apply(&s.dataset, &calibration, None, CloudFrame::Room).expect("at rest");
    for (frames, lost) in [(&[0.0, 0.01][..], 2), (&[][..], 1)] {
        s.dataset.poses[0].motion = Some(motion(frames));
        let lift = Lift::new(&s.dataset, &calibration, None, CloudFrame::Room).expect("it is there");
        let mut points = 0;
        lift.each(|_| {
            points += 1;
            Ok::<_, ApplyError>(())
        })
        .expect("in memory");
        assert_eq!(lift.sheet.points, points);
        assert_eq!(points + lift.sheet.without_pose, whole.points.len());
        assert_eq!(lift.sheet.without_pose, whole.points.len() / lost);
    }
}
