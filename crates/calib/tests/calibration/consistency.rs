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

/// Mean normalized squared errors over the seeds, per degree of freedom.
struct Nees {
    /// Of one beam per facet.
    angles: [f64; 3],
    /// Of the same beams under the paper's own covariance.
    noise_only: f64,
    mount: f64,
}

fn nees(world: impl Fn(u64) -> World) -> Nees {
    let mut sums = Nees {
        angles: [0.0; 3],
        noise_only: 0.0,
        mount: 0.0,
    };
    let runs = SEEDS as f64;
    for seed in 0..SEEDS {
        let world = world(seed);
        let made = world.make();
        let calibration =
            calibrate(&made.dataset, Method::Beam, &Options::default()).expect("a sound dataset");
        for (facet, sum) in sums.angles.iter_mut().enumerate() {
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
            *sum += squared(estimate.covariance_rad2) / (2.0 * runs);
            sums.noise_only += squared(estimate.noise_covariance_rad2) / (6.0 * runs);
        }
        let mount = calibration.rig_from_sensor.expect("it is always estimated");
        let off = pose::motion_between(&mount.pose(), &made.rig_from_sensor);
        let covariance = Matrix6::from(mount.covariance.expect("it is always given"));
        let inverse = covariance.try_inverse().expect("it is positive definite");
        sums.mount += (off.transpose() * inverse * off)[0] / (6.0 * runs);
    }
    sums
}

fn assert_honest(found: &Nees) {
    let runs = SEEDS as f64;
    let within = |dof: f64, mean: f64| (bound(dof, -Z)..bound(dof, Z)).contains(&mean);
    for mean in found.angles {
        assert!(within(2.0 * runs, mean), "angles: mean NEES {:?}", found.angles);
    }
    assert!(
        within(6.0 * runs, found.mount),
        "mounting: mean NEES {}",
        found.mount
    );
}

#[test]
fn angles_and_mounting_err_as_much_as_they_say() {
    let found = nees(|seed| World::noisy(1000 + 17 * seed));
    assert_honest(&found);
    // The paper's own covariance is far too small here, and this test would see it.
    assert!(
        found.noise_only > bound(2.0 * SEEDS as f64, Z),
        "{}",
        found.noise_only
    );
}

#[test]
fn biases_that_mounting_and_elements_share_are_counted_once() {
    // The mounting errs by the very biases that the elements are then corrected with.
    let found = nees(|seed| World {
        distance_bias_sd_mm: 5.0,
        angle_gain_sd_mm: 8.0,
        color_bias_sd_mm: 4.0,
        noise_mm: 2.0,
        drift_mm: 0.3,
        marker_mm: 0.1,
        ..World::noisy(9000 + 13 * seed)
    });
    assert_honest(&found);
}
