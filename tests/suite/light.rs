//! What the receiver sees of near and vignetted light, and what coatings take of it, from the scene to the calibration.

use crate::scenes::TWO_MIRROR;
use catoptric::calib::{self, Method, Options};
use catoptric::files::scene::parse;
use catoptric::sim::{Laboratory, Scene};

/// The empty room.
const ROOM: usize = 1;

fn with(sets: &[&str]) -> Scene {
    let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
    parse(TWO_MIRROR, "two-mirror.toml", &sets).expect("the case is valid")
}

/// Solved elements and the error of a calibration, in degrees.
fn calibrated(sets: &[&str]) -> (usize, f64) {
    let scene = with(&[&["experiment.scans_per_pose=20"], sets].concat());
    let laboratory = Laboratory::new(&scene, 1).expect("the scene is valid");
    let (dataset, truth) = (
        laboratory.dataset().expect("recorded"),
        laboratory.truth().expect("known"),
    );
    let found = calib::calibrate(&dataset, Method::Joint, &Options::default()).expect("it ends");
    let score = catoptric::score(&dataset, &found, Some(&truth)).expect("in memory");
    (score.beams.solved, score.per_axis_rms_deg)
}

/// A thousandth of the light, scattered 65 mm away, is the first echo of every deflected beam; unless the lens is beside
/// the laser, where a spot so near is not in view.
#[test]
fn a_mirror_that_scatters_ends_a_calibration_only_in_the_receiver_s_view() {
    let (all, error) = calibrated(&[]);
    assert!(all > 350, "{all}");
    let scatters = "superstructure.mirror.diffuse_reflectivity=0.001";
    assert_eq!(calibrated(&[scatters]).0, 0);
    let beside = [
        scatters,
        "light.receiver_field_of_view_mrad=20",
        "light.receiver_offset_mm=[0,15]",
    ];
    let (solved, found) = calibrated(&beside);
    assert_eq!(solved, all);
    assert!((found / error - 1.0).abs() < 0.2, "{found}° against {error}°");
}

/// Powers of the deflected beams of a stretch, and those of the direct ones.
fn powers(sets: &[&str]) -> [Vec<f64>; 2] {
    let laboratory = Laboratory::new(&with(sets), 1).expect("the scene is valid");
    let sight = laboratory.sight(ROOM).expect("the room");
    let returns = sight.returns(0);
    [true, false].map(|deflected| {
        let of_kind = returns
            .iter()
            .flatten()
            .filter(|r| r.facets.is_empty() != deflected);
        of_kind.map(|r| r.power).collect()
    })
}

#[test]
fn losses_are_those_of_the_path() {
    let [plain, direct] = powers(&[]);
    assert!(plain.len() > 300 && direct.len() > 600);
    let ratios = |sets: &[&str]| -> [Vec<f64>; 2] {
        let [deflected, others] = powers(sets);
        assert_eq!((deflected.len(), others.len()), (plain.len(), direct.len()));
        let over = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a / b).collect();
        [over(&deflected, &plain), over(&others, &direct)]
    };
    let [of_mirrors, of_others] = ratios(&["superstructure.facet.0.reflectivity=0.45"]);
    // Half of 0.9, out and home, on one facet; the other keeps its own.
    assert!(of_others.iter().all(|r| (r - 1.0).abs() < 1e-12));
    let quarter = of_mirrors.iter().filter(|r| (**r - 0.25).abs() < 1e-9).count();
    let whole = of_mirrors.iter().filter(|r| (**r - 1.0).abs() < 1e-9).count();
    assert!(quarter > 100 && whole > 100 && quarter + whole == of_mirrors.len());
    // Dust that scatters nothing back takes its share before and after the mirror, on both passes.
    let [dusty, clean] = ratios(&["superstructure.mirror.dust={cover=0.1,reflectivity=0}"]);
    assert!(
        dusty.iter().all(|r| (r - 0.9_f64.powi(4)).abs() < 1e-9),
        "{dusty:?}"
    );
    assert!(clean.iter().all(|r| (r - 1.0).abs() < 1e-12));
    // A lens is larger than what a facet shows it, most of all at its edges; direct beams lose what facets hide.
    let [vignetted, beside] = ratios(&["light.vignetting=true"]);
    let least = |r: &[f64]| r.iter().copied().fold(f64::INFINITY, f64::min);
    let most = |r: &[f64]| r.iter().copied().fold(0.0, f64::max);
    assert!(
        most(&vignetted) <= 1.0 + 1e-12 && least(&vignetted) < 0.6,
        "{vignetted:?}"
    );
    assert!(most(&beside) <= 1.0 + 1e-12 && least(&beside) < 0.8);
    assert!(beside.iter().filter(|r| **r > 0.999).count() > beside.len() / 2);
}
