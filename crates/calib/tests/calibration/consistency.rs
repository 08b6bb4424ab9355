//! The covariance is honest: over seeds the normalized squared error averages to one within 99.9 % χ² bounds.

use crate::synthetic::World;
use catoptric_calib::{Method, Options, calibrate, pose};
use nalgebra::{Matrix2, Matrix6, Vector2};

const SEEDS: u64 = 250;

/// χ² quantile over its mean, by Wilson and Hilferty; accurate to 0.1 % for this many degrees of freedom.
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

fn nees(method: Method, world: impl Fn(u64) -> World) -> Nees {
    let mut sums = Nees {
        angles: [0.0; 3],
        noise_only: 0.0,
        mount: 0.0,
    };
    let runs = SEEDS as f64;
    for seed in 0..SEEDS {
        let world = world(seed);
        let made = world.make();
        let calibration = calibrate(&made.dataset, method, &Options::default()).expect("a sound dataset");
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
                let c = Matrix2::from(c.expect("the element is solved"));
                (error.transpose() * c.try_inverse().expect("a covariance is positive definite") * error)[0]
            };
            *sum += squared(estimate.covariance_rad2) / (2.0 * runs);
            if estimate.noise_covariance_rad2.is_some() {
                sums.noise_only += squared(estimate.noise_covariance_rad2) / (6.0 * runs);
            }
        }
        let mount = calibration
            .rig_from_sensor
            .expect("the mounting is always estimated");
        let off = pose::motion_between(&mount.pose(), &made.rig_from_sensor);
        let covariance = Matrix6::from(mount.covariance.expect("its covariance is always given"));
        let inverse = covariance
            .try_inverse()
            .expect("a covariance is positive definite");
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
fn angles_and_mounting_have_honest_covariances() {
    let found = nees(Method::Beam, |seed| World::noisy(1000 + 17 * seed));
    assert_honest(&found);
    // The paper's own covariance is far too small here, and this test detects it.
    assert!(
        found.noise_only > bound(2.0 * SEEDS as f64, Z),
        "{}",
        found.noise_only
    );
}

#[test]
fn biases_that_mounting_and_elements_share_are_counted_once() {
    // The mounting has errors from the very biases that the elements are then corrected with.
    let found = nees(Method::Beam, |seed| World {
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

#[test]
fn every_other_method_has_honest_covariances() {
    // `beam` has its own tests above, `recursive` gives the same estimate, `prior` states no covariance.
    let others = |m: &Method| !matches!(m, Method::Beam | Method::Recursive | Method::Prior);
    for method in Method::ALL.into_iter().filter(others) {
        let found = nees(method, |seed| World::noisy(31_000 + 11 * seed));
        assert_honest(&found);
    }
}

/// Mean squared error along both axes, in square degrees, of every beam, over some seeds.
fn mean_square(method: Method, deviation_deg: f64) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for seed in 0..40 {
        let world = World {
            deviation_deg,
            ..World::noisy(70_000 + seed)
        };
        let made = world.make();
        let calibration = calibrate(&made.dataset, method, &Options::default()).expect("a sound dataset");
        for (index, truth) in &made.deflections {
            let found = calibration.beams[*index].deflection();
            let found =
                found.unwrap_or_else(|| panic!("beam {index}: {:?}", calibration.beams[*index].reason));
            let azimuth = world.azimuth(*index);
            let off = catoptric_model::beam::angle_between(
                &found.exit_direction(azimuth),
                &truth.exit_direction(azimuth),
            );
            sum += 0.5 * off.to_degrees().powi(2);
            count += 1.0;
        }
    }
    sum / count
}

/// However far beams deviate from their planes, solving them together is never worse.
#[test]
fn joint_is_never_worse_than_each_element_individually() {
    for deviation_deg in [0.0, 0.005, 0.01, 0.02, 0.05, 0.1, 0.3] {
        let (joint, alone) = (
            mean_square(Method::Joint, deviation_deg).sqrt(),
            mean_square(Method::BeamGls, deviation_deg).sqrt(),
        );
        let facet = mean_square(Method::Facet, deviation_deg).sqrt();
        // A thousand errors each, of which those of one run are correlated: one percent is statistical fluctuation.
        assert!(joint < 1.01 * alone, "{deviation_deg}°: {joint} against {alone}");
        // Facet by facet, with the mounting as found, a little is lost.
        assert!(facet < 1.1 * alone, "{deviation_deg}°: {facet} against {alone}");
    }
}
