//! The trajectory of the rig: through its waypoints, uniform, smooth.

use super::*;

/// The trajectory through waypoints with no common axis, at unequal intervals.
fn winding(attitude: Attitude) -> (Vec<(f64, Pose)>, Trajectory) {
    let pose = |x: f64, y: f64, z: f64, turn: [f64; 3]| {
        let [yaw, pitch, roll] = turn.map(f64::to_radians);
        Pose::from_parts(Translation3::new(x, y, z), yaw_pitch_roll(yaw, pitch, roll))
    };
    let waypoints = vec![
        (1.0, pose(0.0, 0.5, 1.0, [170.0, 3.0, -5.0])),
        (1.7, pose(1.0, 0.2, 1.4, [-150.0, 20.0, 10.0])),
        (2.0, pose(1.6, -0.6, 1.2, [-120.0, -15.0, 40.0])),
        (3.1, pose(3.0, 0.0, 2.0, [-30.0, 30.0, 0.0])),
    ];
    let trajectory = Trajectory::through(&waypoints, attitude).unwrap();
    (waypoints, trajectory)
}

#[test]
fn a_trajectory_passes_through_its_waypoints_and_rests_beyond_them() {
    for attitude in [Attitude::Slerp, Attitude::Squad] {
        let (waypoints, trajectory) = winding(attitude);
        for (t, pose) in &waypoints {
            let found = trajectory.room_from_rig(t - 1.0);
            assert!((found.translation.vector - pose.translation.vector).norm() < 1e-14);
            assert!(found.rotation.angle_to(&pose.rotation) < 1e-14);
        }
        assert_eq!(
            trajectory.room_from_rig(5.0),
            trajectory.room_from_rig(trajectory.duration_s())
        );
        assert_eq!(trajectory.first_from_rig(0.0), Pose::identity());
    }
    assert_eq!(
        Trajectory::through(&[(0.0, Pose::identity())], Attitude::Slerp),
        None
    );
    let still = [(1.0, Pose::identity()), (1.0, Pose::identity())];
    assert_eq!(Trajectory::through(&still, Attitude::Squad), None);
}

#[test]
fn uniform_motion_is_reproduced() {
    let (place, velocity) = (Vector3::new(3.0, -2.0, 1.0), Vector3::new(0.7, 2.1, -0.4));
    let acceleration = Vector3::new(-1.5, 0.3, 0.9);
    let (begin, rate) = (yaw_pitch_roll(2.9, 0.3, -0.7), Vector3::new(0.4, -1.3, 0.8));
    let times = [5.0, 5.3, 6.1, 6.2, 7.0];
    let turned = |t: f64| begin * UnitQuaternion::from_scaled_axis(rate * t);
    for attitude in [Attitude::Slerp, Attitude::Squad] {
        for acceleration in [Vector3::zeros(), acceleration] {
            let moved = |t: f64| place + velocity * t + acceleration * (0.5 * t * t);
            let pose = |t: f64| Pose::from_parts(moved(t).into(), turned(t));
            let waypoints = times.map(|t| (t, pose(t - 5.0)));
            let trajectory = Trajectory::through(&waypoints, attitude).unwrap();
            for k in 0..=400 {
                let t = f64::from(k) * 0.005;
                let found = trajectory.room_from_rig(t);
                assert!((found.translation.vector - moved(t)).norm() < 1e-12, "{t}");
                assert!(found.rotation.angle_to(&turned(t)) < 1e-12, "{t}");
            }
        }
    }
}

#[test]
fn velocity_is_continuous_and_with_squad_the_rotation_rate_too() {
    // The exact derivative of a cubic at one end, from four values.
    let slope =
        |f: [Vector3<f64>; 4], h: f64| (f[0] * -11.0 + f[1] * 18.0 - f[2] * 9.0 + f[3] * 2.0) / (6.0 * h);
    let jump = |trajectory: &Trajectory, t: f64| {
        let at = |k: usize, h: f64| trajectory.first_from_rig(t + k as f64 * h);
        let velocity = |h: f64| slope([0, 1, 2, 3].map(|k| at(k, h).translation.vector), h);
        let turn = |k: usize, h: f64| (at(0, h).rotation.inverse() * at(k, h).rotation).scaled_axis();
        let rate = |h: f64| slope([0, 1, 2, 3].map(|k| turn(k, h)), h);
        let h = 1e-3;
        (
            (velocity(h) - velocity(-h)).norm(),
            (rate(h) - rate(-h)).norm(),
            velocity(h).norm(),
        )
    };
    for t in [0.7, 1.0] {
        let (_, squad) = winding(Attitude::Squad);
        let (velocity, rate, speed) = jump(&squad, t);
        assert!(speed > 0.5 && velocity < 1e-10, "{t}: {velocity}");
        // Rotations are not cubics: the remainder is of third order in the step of one millisecond.
        assert!(rate < 1e-6, "{t}: {rate}");
        let (_, slerp) = winding(Attitude::Slerp);
        let (velocity, rate, _) = jump(&slerp, t);
        assert!(velocity < 1e-10 && rate > 0.3, "{t}: {velocity} {rate}");
    }
}
