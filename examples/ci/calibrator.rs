//! Property tests of a calibrator of your own: `tests/calibrator.rs` in your crate.

use catoptric::calib::{CalibError, Calibrator, Method};
use catoptric::model::{Calibration, Dataset};
use catoptric::sim::Scene;
use catoptric::testing::{self, Anees, Bias, Coverage, Significance};
use proptest::prelude::*;

/// Yours; here it calls one of ours.
struct Mine;

impl Calibrator for Mine {
    fn name(&self) -> &str {
        "mine"
    }

    fn calibrate(&self, dataset: &Dataset) -> Result<Calibration, CalibError> {
        Method::Beam.calibrate(dataset)
    }
}

fn scene() -> Scene {
    let text = catoptric::files::scene::Template::TwoMirror.text();
    let mut scene: Scene = toml::from_str(text).unwrap();
    scene.experiment.scans_per_pose = 10; // a tenth of the time
    scene.scanner.sub_rays = 7;
    scene
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn closes_without_errors(scene in testing::layouts(), seed in 1..=999_u64) {
        if let Err(failure) = testing::closure(&scene, seed, &Mine, 1e-8) {
            return Err(TestCaseError::fail(failure.to_string()));
        }
    }
}

#[test]
fn states_its_errors() {
    let trials = testing::trials(&scene(), 1..=40, &Mine).unwrap();
    let significance = Significance::PER_MILLE.among(3);
    Anees::over(&trials).assert(significance);
    Coverage::over(&trials, 0.95).assert(significance);
    Bias::over(&trials).assert(0.0, significance); // in radians: no mean error at all
}

#[test]
fn gives_the_same_bytes() {
    testing::assert_deterministic(&scene(), 1, &Mine, &[1, 2, 4]);
}
