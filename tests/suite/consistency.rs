//! Whether the stated uncertainty is correct: errors over independent seeds compared with their covariances.
//!
//! One element of each seed, so that the sample is independent: elements of one run share errors. The simulator includes
//! all effects that the estimator's model lacks (wide beams, edges, slope errors of mirrors, rounding), so this is not
//! the inverse crime. It does not prove that the estimate is as accurate as possible.

use crate::scenes::{PROTOTYPE, scene};
use catoptric::calib::{self, Method, Options};
use catoptric::model::Status;
use catoptric::score;
use catoptric::sim::Laboratory;
use catoptric::sim::truth::BeamClass;
use rayon::prelude::*;

/// Number of seeds, and the exact 99.9 % bounds of χ² with 400 degrees of freedom, divided by 400: 1 is honest.
const SEEDS: u64 = 200;
const MEAN_NEES: (f64, f64) = (0.7836, 1.2492);

#[test]
fn errors_match_the_stated_covariance() {
    let mut scene = scene(PROTOTYPE);
    scene.superstructure.facet.truncate(2);
    scene.superstructure.post.truncate(1);
    scene.experiment.scans_per_pose = 20;
    scene.scanner.sub_rays = 7;
    let nees: Vec<f64> = (1..=SEEDS)
        .into_par_iter()
        .map(|seed| {
            let laboratory = Laboratory::new(&scene, seed).expect("the scene is valid");
            let dataset = laboratory.dataset().expect("recorded");
            let truth = laboratory.truth().expect("known");
            let calibration = calib::calibrate(&dataset, Method::Beam, &Options::default())
                .expect("the calibration succeeds");
            let deflected: Vec<_> = truth
                .beams
                .iter()
                .filter(|b| b.status == BeamClass::Deflected)
                .collect();
            let middle = deflected[deflected.len() / 4];
            let found = calibration.beam(middle.beam).expect("every element has an entry");
            assert_eq!(found.status, Status::Solved, "seed {seed}: {:?}", found.reason);
            let (is, should) = (
                found.deflection().expect("solved"),
                middle.deflection().expect("it is deflected"),
            );
            let error = nalgebra::Vector2::new(is.azimuth - should.azimuth, is.elevation - should.elevation);
            let [[a, b], [c, d]] = found.covariance_rad2.expect("solved");
            let inverse = nalgebra::Matrix2::new(a, b, c, d)
                .try_inverse()
                .expect("both angles are known");
            (error.transpose() * inverse * error)[0]
        })
        .collect();
    let mean = nees.iter().sum::<f64>() / (2.0 * SEEDS as f64);
    assert!(
        MEAN_NEES.0 < mean && mean < MEAN_NEES.1,
        "mean normalized squared error {mean}"
    );
    // 95 % of 200 errors are inside their ellipses; exact binomial bounds at 99.9 %.
    let inside = nees.iter().filter(|n| **n <= score::CHI_SQUARED_95).count();
    assert!(
        (179..=198).contains(&inside),
        "{inside} of {SEEDS} errors inside their 95 % ellipses"
    );
}
