//! The covariance is honest: over seeds the normalized squared error averages to one within 99.9 % χ² bounds.

use crate::synthetic::World;
use catoptric_calib::{Method, Options, calibrate, pose};
use nalgebra::{Matrix2, Matrix6, Vector2};

const SEEDS: u64 = 250;

/// χ² quantile by Wilson and Hilferty, good to 0.1 % at these many degrees of freedom, over its mean.
fn bound(dof: f64, z: f64) -> f64 {
    let c = 2.0 / (9.0 * dof);
    (1.0 - c + z * c.sqrt()).powi(3)
}

/// Two-sided 99.9 %.
const Z: f64 = 3.2905;

#[test]
fn angles_and_mounting_err_as_much_as_they_say() {
    let (mut nees, mut noise_only, mut mount_nees) = ([0.0; 3], 0.0, 0.0);
    for seed in 0..SEEDS {
        let world = World::noisy(1000 + 17 * seed);
        let made = world.make();
        let calibration =
            calibrate(&made.dataset, Method::Beam, &Options::default()).expect("a sound dataset");
        for (facet, sum) in nees.iter_mut().enumerate() {
            // One beam of each facet, another in every run.
            let [first, last] = world.served[facet];
            #[allow(clippy::cast_possible_truncation)]
            let index = first + seed as usize % (last - first + 1);
            let (estimate, truth) = (&calibration.beams[index], made.deflections[&index]);
            let found = estimate
                .deflection()
                .unwrap_or_else(|| panic!("seed {seed}, beam {index}: {:?}", estimate.reason));
            let error = Vector2::new(found.azimuth - truth.azimuth, found.elevation - truth.elevation);
            let squared = |c: Option<[[f64; 2]; 2]>| {
                let c = Matrix2::from(c.expect("it is solved"));
                (error.transpose() * c.try_inverse().expect("it is positive definite") * error)[0]
            };
            *sum += squared(estimate.covariance_rad2);
            noise_only += squared(estimate.noise_covariance_rad2);
        }
        let mount = calibration.rig_from_sensor.expect("it is always estimated");
        let off = pose::motion_between(&mount.pose(), &made.rig_from_sensor);
        let covariance = Matrix6::from(mount.covariance.expect("it is always given"));
        mount_nees += (off.transpose() * covariance.try_inverse().expect("it is positive definite") * off)[0];
    }
    let runs = SEEDS as f64;
    for sum in nees {
        let mean = sum / (2.0 * runs);
        assert!(
            (bound(2.0 * runs, -Z)..bound(2.0 * runs, Z)).contains(&mean),
            "angles: mean NEES {mean} ({nees:?})"
        );
    }
    let mean = mount_nees / (6.0 * runs);
    assert!(
        (bound(6.0 * runs, -Z)..bound(6.0 * runs, Z)).contains(&mean),
        "mounting: mean NEES {mean}"
    );
    // The paper's own covariance is far too small here, and this test would see it.
    assert!(noise_only / (6.0 * runs) > bound(2.0 * runs, Z));
}
