//! Tests of claims that are of no use, or wrong: range biases, covariances, a single mirror on blind data, boards that were
//! held out.

use super::*;
use catoptric_model::RangeBias;
use catoptric_model::assessment::{Assessment, HeldOut, SharedParameter};
use catoptric_model::bias::ColorBias;

/// Biases that are a constant number of millimeters off.
fn shifted(off_mm: f64) -> RangeBias {
    let mut bias = RangeBias::default();
    bias.angle.offset_mm = off_mm;
    bias
}

#[test]
fn a_wrong_range_bias_fails() {
    let stating = |bias: RangeBias| falsified(|c| c.bias = Some(bias));
    let right = stating(RangeBias::default());
    assert_eq!((right.verdict, right.range_bias_mm), (Verdict::Pass, 0.0));
    for off in [20.0, -20.0, 900.0] {
        let found = stating(shifted(off));
        assert_eq!(
            (found.verdict, unmet(&found)),
            (Verdict::Fail, vec!["range_bias"]),
            "{off}"
        );
        assert!((found.range_bias_mm - off).abs() < 1e-9);
    }
    // E_c of white is believed to 1 mm, as is A_a; with a table E_r is, too: at 45° their variances and that of rounding add.
    let mut table = shifted(0.0);
    (table.distance.range_m, table.distance.error_mm) = (vec![0.5, 2.0], vec![0.0, 3.0]);
    let found = stating(table.clone());
    let gate = found
        .gates
        .iter()
        .find(|g| g.name == "range_bias")
        .expect("it is judged");
    assert!((gate.found - 9.0 / (1.0 + 0.09)).abs() < 1e-9, "{}", gate.message);
    // Only at an angle, and only on one color.
    let mut steep = shifted(40.0);
    steep.angle.gain_mm = -40.0;
    assert_eq!(unmet(&stating(steep)), ["range_bias"]);
    let mut white = RangeBias::default();
    let line = ColorBias {
        slope_mm_per_m: 0.0,
        offset_mm: 8.0,
    };
    white.color.insert("white".to_owned(), line);
    assert_eq!(unmet(&stating(white)), ["range_bias"]);
    // No board is black.
    let mut black = RangeBias::default();
    black.color.insert("black".to_owned(), line);
    assert_eq!(stating(black).verdict, Verdict::Pass);
}

#[test]
fn a_range_bias_is_judged_by_what_it_claims_within_limits() {
    let claiming = |sd: f64| {
        falsified(|c| {
            c.bias = Some(shifted(8.0));
            c.assessment = Some(Assessment {
                parameters: vec![SharedParameter {
                    name: "E_c of white (mm)".to_owned(),
                    change: 8.0,
                    believed_sd: 1.0,
                    sd,
                }],
                ..Assessment::default()
            });
        })
    };
    assert_eq!(unmet(&claiming(1.0)), ["range_bias"]);
    assert_eq!(claiming(4.0).verdict, Verdict::Pass);
    // Knowing nothing is no excuse.
    let at = |sd| {
        let found = claiming(sd);
        let gate = found.gates.into_iter().find(|g| g.name == "range_bias");
        gate.expect("it is judged").found
    };
    assert_eq!(at(5.0), at(900.0));
}

#[test]
fn biases_without_anything_to_compare_are_null_with_the_reason() {
    let s = sample();
    let mut calibration = perfect(&s.truth);
    let reason = |calibration: &Calibration, truth: Option<&Truth>| {
        let found = score(&s.dataset, calibration, truth).expect("in memory");
        assert!(found.range_bias_mm.is_nan());
        assert!(!unmet(&found).contains(&"range_bias"));
        found.nulls["range_bias_mm"]
    };
    assert_eq!(
        reason(&calibration, Some(&s.truth)),
        "the calibration states no range biases"
    );
    calibration.bias = Some(shifted(20.0));
    assert_eq!(reason(&calibration, None), "there is no truth");
    let mut walking = s.truth.clone();
    walking.detector_errors = true;
    let words = reason(&calibration, Some(&walking));
    assert!(words.starts_with("the detector has errors of its own"), "{words}");
}

#[test]
fn an_element_without_a_covariance_is_no_free_pass() {
    let off = |radians: f64| {
        falsified(|c| {
            for (n, b) in solved(c).step_by(20).enumerate() {
                b.covariance_rad2 = None;
                if n == 3 {
                    b.elevation_rad = b.elevation_rad.map(|e| e + radians);
                }
            }
        })
    };
    assert_eq!(off(0.0).verdict, Verdict::Pass);
    for radians in [0.05, -0.5] {
        let found = off(radians);
        assert_eq!((found.verdict, unmet(&found)), (Verdict::Fail, vec!["unstated"]));
        let words = &found.reasons()[0];
        assert!(words.contains("states no covariance and is "), "{words}");
    }
}

#[test]
fn what_is_hardly_known_is_not_solved() {
    let stating = |sd: f64, every: usize| {
        falsified(|c| {
            for b in solved(c).step_by(every) {
                b.covariance_rad2 = Some([[sd * sd, 0.0], [0.0, sd * sd]]);
            }
        })
    };
    let useless = stating(30.0_f64.to_radians(), 1);
    assert_eq!(
        (useless.verdict, unmet(&useless)),
        (Verdict::Fail, vec!["solved"])
    );
    assert_eq!(useless.knowable_solved, Some(0));
    // Below the limit it is as wide as its author likes.
    assert!(!unmet(&stating(2.9_f64.to_radians(), 1)).contains(&"solved"));
    let few = stating(0.1, 20);
    assert_eq!(few.verdict, Verdict::Pass);
    assert!(
        few.warnings
            .iter()
            .any(|w| w.starts_with("useless: ") && w.ends_with("above 3°, and do not count as solved")),
        "{:?}",
        few.warnings
    );
    assert_eq!(few.with_min_solved(0.96).verdict, Verdict::Fail);
    // Without a truth neither.
    let s = sample();
    let mut blind = noisy(&s.truth, 1e-3, 3);
    for b in solved(&mut blind) {
        b.covariance_rad2 = Some([[0.3, 0.0], [0.0, 0.3]]);
    }
    let blind = score(&s.dataset, &blind, None).expect("in memory");
    assert_eq!(unmet(&blind), ["covariance"]);
    assert!(unmet(&blind.with_min_solved(0.5)).contains(&"solved"));
}

#[test]
fn a_mounting_known_worse_than_drawn_fails_with_a_truth_and_without() {
    let s = sample();
    // The drawing knows the shifts to 1 mm at least, the turns to 0.5° and 0.2°.
    for (sd, met) in [
        ([2.9e-3, 0.6_f64.to_radians()], true),
        ([3.1e-3, 0.1_f64.to_radians()], false),
        ([1e-3, 3.0], false),
    ] {
        let mut calibration = noisy(&s.truth, 1e-3, 3);
        let mut covariance = [[0.0; 6]; 6];
        (0..6).for_each(|i| covariance[i][i] = sd[i / 3] * sd[i / 3]);
        calibration
            .rig_from_sensor
            .as_mut()
            .expect("it has one")
            .covariance = Some(covariance);
        for truth in [Some(&s.truth), None] {
            let found = score(&s.dataset, &calibration, truth).expect("in memory");
            assert_eq!(!unmet(&found).contains(&"mounting_claim"), met, "{sd:?}");
        }
    }
}

#[test]
fn distances_known_worse_than_mirrors_are_far_are_not_stated() {
    let found = falsified(|c| {
        for b in solved(c) {
            b.distance_m = b.distance_m.map(|d| d + 0.030);
            b.distance_sd_m = Some(1.0);
        }
    });
    assert_eq!(unmet(&found), ["distances"]);
}

/// Each mirror has a median of its own: the other seven cannot outvote it.
#[test]
fn one_wrong_mirror_of_eight_fails_without_a_truth() {
    let s = sample();
    let certain = |calibration: &mut Calibration| {
        let mut known = [[0.0; 6]; 6];
        (0..6).for_each(|i| known[i][i] = 1e-8);
        calibration
            .rig_from_sensor
            .as_mut()
            .expect("it has one")
            .covariance = Some(known);
    };
    for facet in &s.truth.facets {
        for is_named in [true, false] {
            let mut calibration = noisy(&s.truth, 1e-3, 3);
            certain(&mut calibration);
            for b in solved(&mut calibration).filter(|b| b.facet.as_deref() == Some(&facet.name)) {
                b.elevation_rad = b.elevation_rad.map(|e| e + 0.05);
            }
            if !is_named {
                solved(&mut calibration).for_each(|b| b.facet = None);
            }
            let found = score(&s.dataset, &calibration, None).expect("in memory");
            assert_eq!(found.verdict, Verdict::Fail);
            let unmet = unmet(&found);
            assert!(
                unmet.contains(&"boards_by_mirror") && !unmet.contains(&"boards"),
                "{unmet:?}"
            );
            let named = format!("mirror {:?} is ", facet.name);
            assert!(
                found.reasons().iter().all(|why| why.contains(&named)),
                "{:?}",
                found.reasons()
            );
        }
    }
}

#[test]
fn held_out_boards_are_judged_with_a_truth_and_without() {
    let s = sample();
    let with = |rms_mm: f64, truth: Option<&Truth>| {
        let mut calibration = noisy(&s.truth, 1e-3, 3);
        calibration.assessment = Some(Assessment {
            held_out: Some(HeldOut {
                boards: 48,
                means: 900,
                rms_mm,
                expected_mm: 4.0,
                mean_mm: 0.1,
            }),
            ..Assessment::default()
        });
        score(&s.dataset, &calibration, truth).expect("in memory")
    };
    for truth in [Some(&s.truth), None] {
        assert!(!unmet(&with(4.1, truth)).contains(&"held_out"));
        // χ² of one degree of freedom at 99.5 % is 7.879: 2.8 times, 11.26 mm with the rounding of 0.3 mm.
        assert!(!unmet(&with(11.2, truth)).contains(&"held_out"));
        let bad = with(11.3, truth);
        assert_eq!((bad.verdict, unmet(&bad)), (Verdict::Fail, vec!["held_out"]));
        assert!(
            bad.reasons()[0].starts_with("fails: the 48 boards that were held out are 11.30 mm"),
            "{:?}",
            bad.reasons()
        );
    }
}
