//! Tests of scores: the truth has no error, known errors yield the expected figures, and every element is counted once.

mod claims;

use super::element::wrap;
use super::*;
use crate::requirement::Requirement;
use catoptric_fixtures::{noisy, perfect, sample, turned};
use catoptric_model::{BeamEstimate, Status};
use nalgebra::Vector3;

fn estimate(calibration: &mut Calibration, beam: usize) -> &mut BeamEstimate {
    &mut calibration.beams[beam]
}

/// The first deflected, unsplit beams.
fn deflected(truth: &Truth) -> Vec<usize> {
    let of = |b: &&catoptric_sim::truth::TrueBeam| b.status == BeamClass::Deflected;
    truth.beams.iter().filter(of).map(|b| b.beam).collect()
}

#[test]
fn the_truth_itself_has_no_error_and_passes() {
    let s = sample();
    let score = score(&s.dataset, &perfect(&s.truth), Some(&s.truth)).expect("in memory");
    assert_eq!(score.verdict, Verdict::Pass, "{:?}", score.warnings);
    let deflected = deflected(&s.truth).len();
    assert!(deflected > 300);
    assert_eq!(
        score.beams,
        BeamCounts {
            deflected: Some(deflected),
            solved: deflected,
            abstained: 0,
            missed: Some(0),
            wrong: Some(0)
        }
    );
    assert_eq!(score.direction_deg.max, 0.0);
    assert_eq!(score.per_axis_rms_deg, 0.0);
    assert_eq!(score.distance_mm.max, 0.0);
    assert_eq!(score.point_mm.at_10m, 0.0);
    assert_eq!((score.nees_mean, score.coverage_95), (0.0, 1.0));
    assert!(score.common_mode_deg < 1e-12);
    // The mean of the tracked poses is rounded, so the room frame agrees only up to rounding.
    assert!(score.per_axis_rms_room_deg < 1e-12 && score.point_room_mm.at_10m < 1e-10);
    assert!(score.crlb_per_axis_deg > 0.001 && score.crlb_per_axis_deg < 1.0);
    // Readings are exact, so points are on boards and walls.
    assert!(score.boards_mm.stretches == 48 && score.boards_mm.rms < 1e-9);
    assert!(score.walls_mm.elements == deflected && score.walls_mm.rms < 1e-9);
}

#[test]
fn a_common_rotation_appears_only_in_the_common_mode() {
    let s = sample();
    let angle = 0.5_f64.to_radians();
    let score = score(&s.dataset, &turned(perfect(&s.truth), angle), Some(&s.truth)).expect("in memory");
    assert!((score.common_mode_deg - 0.5).abs() < 1e-12);
    assert!(score.differential_per_axis_rms_deg < 1e-12);
    assert!(score.per_axis_rms_deg > 0.1);
    assert!(score.direction_deg.max <= 0.5 + 1e-12);
    assert!(
        score
            .warnings
            .iter()
            .any(|w| w.starts_with("common mode dominates"))
    );
}

#[test]
fn a_wrong_mounting_shows_in_the_room_only() {
    let s = sample();
    let mut calibration = perfect(&s.truth);
    let mount = calibration.rig_from_sensor.as_mut().expect("it has one");
    let off = mount.pose()
        * Pose::from_parts(
            nalgebra::Translation3::new(0.0, 0.0, 0.003),
            nalgebra::UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.01),
        );
    let data = catoptric_model::PoseData::from(&off);
    mount.translation_m = data.translation_m;
    mount.rotation_xyzw = data.rotation_xyzw;
    let with = score(&s.dataset, &calibration, Some(&s.truth)).expect("in memory");
    assert_eq!(with.per_axis_rms_deg, 0.0);
    assert!((with.common_mode_room_deg - 0.01_f64.to_degrees()).abs() < 1e-10);
    assert!(with.point_room_mm.at_1m > 3.0);

    calibration.rig_from_sensor = None;
    let without = score(&s.dataset, &calibration, Some(&s.truth)).expect("in memory");
    assert!(without.per_axis_rms_room_deg.is_nan());
    assert_eq!(
        without.nulls["per_axis_rms_room_deg"],
        "the calibration has no rig_from_sensor"
    );
}

#[test]
fn figures_follow_the_formulas() {
    // Two elements with given errors.
    let s = sample();
    let mut calibration = perfect(&s.truth);
    let beams = deflected(&s.truth);
    for &b in &beams[2..] {
        *estimate(&mut calibration, b) =
            BeamEstimate::without_angles(b, Status::Rejected, Some("left out".to_owned()));
    }
    let [a, b] = [beams[0], beams[1]];
    let error = [[3e-4, 0.0], [0.0, 4e-4]];
    let covariance = [[1e-8, 0.0], [0.0, 4e-8]];
    let mut squares = 0.0;
    for (beam, [theta, phi]) in [a, b].into_iter().zip(error) {
        let e = estimate(&mut calibration, beam);
        squares += (theta * e.elevation_rad.expect("solved").cos()).powi(2) + phi * phi;
        e.azimuth_rad = e.azimuth_rad.map(|x| x + theta);
        e.elevation_rad = e.elevation_rad.map(|x| x + phi);
        e.covariance_rad2 = Some(covariance);
    }
    estimate(&mut calibration, a).distance_m = s.truth.beams[a].distance_m.map(|d| d + 3e-3);
    estimate(&mut calibration, b).distance_m = s.truth.beams[b].distance_m.map(|d| d - 4e-3);
    let score = score(&s.dataset, &calibration, Some(&s.truth)).expect("in memory");
    let per_axis = (squares / 4.0).sqrt().to_degrees();
    assert!((score.per_axis_rms_deg - per_axis).abs() < 1e-12);
    assert!((score.direction_deg.rms - per_axis * 2.0_f64.sqrt()).abs() < 1e-7);
    // eᵀP⁻¹e is 9 for the first and 4 for the second: the mean over two dimensions is (9 + 4)/4, one of two is inside.
    assert!((score.nees_mean - 13.0 / 4.0).abs() < 1e-9);
    assert_eq!(score.coverage_95, 0.5);
    assert!((score.distance_mm.rms - 12.5_f64.sqrt()).abs() < 1e-9);
    assert!((score.distance_mm.max - 4.0).abs() < 1e-9);
    assert_eq!(score.beams.abstained, beams.len() - 2);
    // ‖δP + s·δv‖² is quadratic in s: mean δd², 2s times a cross term, s² times the mean squared chord.
    let p = &score.point_mm;
    let chord = squares / 2.0 * 1e6;
    let cross = p.at_1m.powi(2) - 12.5 - chord;
    for (s, found) in [(4.0, p.at_4m), (10.0, p.at_10m)] {
        let expected = 12.5 + s * cross + s * s * chord;
        assert!((found.powi(2) - expected).abs() < 1e-3 * expected, "{s} m");
    }
    let bounds = bound::knowable(&s.dataset, &s.truth).expect("in memory").limits;
    let trace = mean([a, b].iter().map(|beam| {
        let c = s.truth.beams[*beam].elevation_rad.expect("deflected").cos();
        bounds[beam][(0, 0)] * c * c + bounds[beam][(1, 1)]
    }));
    assert!((score.efficiency - trace / (squares / 2.0)).abs() < 1e-12 * score.efficiency);
}

#[test]
fn an_honest_covariance_is_judged_honest() {
    let s = sample();
    let score = score(&s.dataset, &noisy(&s.truth, 1e-3, 3), Some(&s.truth)).expect("in memory");
    // About 450 independent elements: the mean of χ²₂/2 scatters by 1/√450 = 0.05; four of those.
    assert!((score.nees_mean - 1.0).abs() < 0.2, "{}", score.nees_mean);
    assert!((score.coverage_95 - 0.95).abs() < 0.05, "{}", score.coverage_95);
    assert!((score.per_axis_rms_deg - 1e-3_f64.to_degrees()).abs() < 0.1 * 1e-3_f64.to_degrees());
    assert!(score.common_mode_deg < 0.3 * score.per_axis_rms_deg);
    assert_eq!(score.verdict, Verdict::Pass, "{:?}", score.warnings);
    assert!(score.boards_mm.rms > 0.1 && score.walls_mm.rms > 0.1);
}

#[test]
fn a_covariance_a_tenth_too_small_per_axis_fails() {
    let s = sample();
    let mut calibration = noisy(&s.truth, 1e-3, 3);
    for b in &mut calibration.beams {
        b.covariance_rad2 = b.covariance_rad2.map(|c| c.map(|row| row.map(|x| x / 100.0)));
    }
    let score = score(&s.dataset, &calibration, Some(&s.truth)).expect("in memory");
    assert_eq!(score.verdict, Verdict::Fail);
    assert!(score.warnings[0].starts_with("fails: over-confident: errors are "));
    assert!((score.nees_mean - 100.0).abs() < 20.0);
}

/// A calibration with known errors whose covariance is `factor` times what it should be.
fn stated(truth: &Truth, factor: f64) -> Calibration {
    let mut calibration = noisy(truth, 1e-3, 3);
    for b in &mut calibration.beams {
        b.covariance_rad2 = b.covariance_rad2.map(|c| c.map(|row| row.map(|x| x * factor)));
    }
    calibration
}

#[test]
fn honesty_is_reported_with_its_size() {
    let s = sample();
    let of = |calibration: &Calibration, truth| score(&s.dataset, calibration, truth).expect("in memory");
    let honest = of(&stated(&s.truth, 1.0), Some(&s.truth));
    assert_eq!(honest.honesty, Some(Honesty::Honest));
    assert!(!honest.warnings.iter().any(|w| w.contains("-confident")));
    let under = of(&stated(&s.truth, 25.0), Some(&s.truth));
    assert_eq!(under.honesty, Some(Honesty::UnderConfident));
    assert!(
        under
            .warnings
            .iter()
            .any(|w| w.starts_with("under-confident: errors are 0.2"))
    );
    // Errors of 1 under a covariance of (1/8)², with the scatter of some 400 elements.
    let over = of(&stated(&s.truth, 1.0 / 64.0), Some(&s.truth));
    assert_eq!(
        (over.honesty, over.verdict),
        (Some(Honesty::OverConfident), Verdict::Fail)
    );
    let times: f64 = over.warnings[0]
        .split("errors are ")
        .nth(1)
        .and_then(|rest| rest.split(' ').next()?.parse().ok())
        .expect("the warning states a factor");
    assert!((times - 8.0).abs() < 0.5, "{}", over.warnings[0]);
    assert_eq!(
        over.warnings
            .iter()
            .filter(|w| w.contains("over-confident"))
            .count(),
        1
    );
    // A mean of 4 could be one error that all share, but not the worst of some 400 elements.
    let half = of(&stated(&s.truth, 1.0 / 4.0), Some(&s.truth));
    assert_eq!(half.verdict, Verdict::Fail);
    assert!(
        half.reasons()[0].starts_with("fails: the direction of beam "),
        "{:?}",
        half.reasons()
    );
    for (not_judged, reason) in [
        (of(&stated(&s.truth, 1.0), None), "there is no truth"),
        (
            of(&perfect(&s.truth), Some(&s.truth)),
            "the errors are only numerical",
        ),
    ] {
        assert_eq!(not_judged.honesty, None);
        assert_eq!(not_judged.nulls["honesty"], reason);
    }
}

#[test]
fn abstaining_is_correct_where_the_boards_leave_elements_open() {
    let s = sample();
    let mut dataset = s.dataset.clone();
    // No board in front of any mirror.
    dataset
        .poses
        .retain(|p| p.label.kind != catoptric_model::PoseKind::Facet);
    let all = deflected(&s.truth).len();
    let mut abstaining = perfect(&s.truth);
    for b in abstaining.beams.iter_mut().filter(|b| b.status == Status::Solved) {
        *b = BeamEstimate::without_angles(b.beam, Status::TooFewPoses, Some("no board".to_owned()));
    }
    let right = score(&dataset, &abstaining, Some(&s.truth))
        .expect("in memory")
        .with_limit(0.1);
    let counts = |abstained, solved, wrong| {
        Some(OpenCounts {
            elements: all,
            abstained,
            solved,
            wrong,
        })
    };
    assert_eq!((right.verdict, right.open), (Verdict::Pass, counts(all, 0, 0)));
    assert!(
        right
            .warnings
            .iter()
            .any(|w| w.starts_with("the limit of 0.1° was not tested"))
    );
    // Where nothing is open the same abstentions do not reach the limit.
    let needless = score(&s.dataset, &abstaining, Some(&s.truth))
        .expect("in memory")
        .with_limit(0.1);
    assert_eq!(
        (needless.verdict, needless.open.map(|o| o.elements)),
        (Verdict::Fail, Some(0))
    );
    // Who knows more than the boards may solve; who claims more than he knows is wrong.
    let knows = score(&dataset, &noisy(&s.truth, 1e-3, 3), Some(&s.truth)).expect("in memory");
    assert_eq!(knows.verdict, Verdict::Pass, "{:?}", knows.warnings);
    assert!(knows.open.is_some_and(|o| o.solved == all && o.wrong <= 3));
    let claims = score(&dataset, &stated(&s.truth, 1e-4), Some(&s.truth)).expect("in memory");
    assert!(claims.open.is_some_and(|o| 2 * o.wrong > o.solved));
    assert!(
        claims
            .warnings
            .iter()
            .any(|w| w.starts_with("fails: ") && w.contains("left open by the boards")),
        "{:?}",
        claims.warnings
    );
}

#[test]
fn without_a_mirror_there_is_nothing_to_judge() {
    let s = sample();
    let mut truth = s.truth.clone();
    for b in &mut truth.beams {
        b.status = BeamClass::Direct;
    }
    let mut nothing_solved = perfect(&truth);
    nothing_solved.method = "nothing".to_owned();
    let score_of =
        |calibration: &Calibration| score(&s.dataset, calibration, Some(&truth)).expect("in memory");
    let nothing = score_of(&nothing_solved);
    assert_eq!(
        (nothing.verdict, nothing.beams.deflected),
        (Verdict::NotJudged, Some(0))
    );
    assert!(nothing.warnings[0].ends_with("there is nothing to judge"));
    // A direction for a beam that no mirror deflects is false.
    let solved = perfect(&s.truth);
    assert_eq!(score_of(&solved).verdict, Verdict::Fail);
}

#[test]
fn a_covariance_of_zero_is_infinitely_dishonest() {
    let s = sample();
    let mut calibration = noisy(&s.truth, 1e-3, 3);
    let beam = deflected(&s.truth)[0];
    estimate(&mut calibration, beam).covariance_rad2 = Some([[0.0; 2]; 2]);
    let score = score(&s.dataset, &calibration, Some(&s.truth)).expect("in memory");
    assert_eq!(score.verdict, Verdict::Fail);
    let json = serde_json::to_value(&score).expect("it is JSON");
    assert!(json["nees_mean"].is_null());
    assert!(
        json["nulls"]["nees_mean"]
            .as_str()
            .is_some_and(|r| r.starts_with("infinite"))
    );
}

#[test]
fn every_deflected_element_is_solved_abstained_or_missed() {
    let s = sample();
    let beams = deflected(&s.truth);
    let mut calibration = perfect(&s.truth);
    let without =
        |b, status, reason: Option<&str>| BeamEstimate::without_angles(b, status, reason.map(str::to_owned));
    *estimate(&mut calibration, beams[0]) = without(beams[0], Status::Unobservable, Some("one tilt axis"));
    *estimate(&mut calibration, beams[1]) = without(beams[1], Status::Direct, None);
    *estimate(&mut calibration, beams[2]) = without(beams[2], Status::Direct, None);
    // As the entry of another beam, this element is absent and the direct beam 540 is called solved.
    estimate(&mut calibration, beams[4]).beam = 540;
    calibration.beams.remove(540);
    calibration.beams.retain(|b| b.beam != beams[3]);
    let score = score(&s.dataset, &calibration, Some(&s.truth)).expect("in memory");
    let counts = score.beams;
    assert_eq!(counts.deflected, Some(beams.len()));
    assert_eq!(
        (counts.abstained, counts.missed, counts.wrong),
        (1, Some(4), Some(1))
    );
    assert_eq!(counts.solved, beams.len() - 5);
    assert_eq!(score.verdict, Verdict::Fail);
    assert_eq!(score.statuses["absent"], 2);
    assert_eq!(score.statuses["unobservable"], 1);
    assert!(score.scored().all(|e| !beams[..5].contains(&e.beam)));
}

#[test]
fn split_elements_are_reported_separately() {
    let s = sample();
    let mut calibration = perfect(&s.truth);
    let split = s
        .truth
        .beams
        .iter()
        .find(|b| b.status == BeamClass::Split)
        .expect("there are edges");
    *estimate(&mut calibration, split.beam) = BeamEstimate {
        azimuth_rad: split.azimuth_rad,
        elevation_rad: split.elevation_rad.map(|e| e + 0.1),
        ..BeamEstimate::without_angles(split.beam, Status::Solved, None)
    };
    let score = score(&s.dataset, &calibration, Some(&s.truth)).expect("in memory");
    assert_eq!(score.per_axis_rms_deg, 0.0);
    assert_eq!((score.verdict, score.split.solved), (Verdict::Pass, 1));
    assert!((score.split.per_axis_rms_deg - (0.1_f64 / 2.0_f64.sqrt()).to_degrees()).abs() < 1e-9);
}

#[test]
fn without_truth_the_score_is_blind() {
    let s = sample();
    let score = score(&s.dataset, &noisy(&s.truth, 1e-3, 5), None)
        .expect("in memory")
        .with_limit(0.1);
    assert_eq!(score.verdict, Verdict::Blind);
    assert!(score.boards_mm.rms > 0.1);
    let json = serde_json::to_value(&score).expect("it is JSON");
    assert!(json["beams"]["missed"].is_null() && json["per_axis_rms_deg"].is_null());
    assert_eq!(json["nulls"]["per_axis_rms_deg"], "there is no truth");
    assert_eq!(json["verdict"], "blind");
}

#[test]
fn the_limit_decides() {
    let s = sample();
    let calibration = noisy(&s.truth, 1e-3, 3);
    let verdict = |limit| {
        score(&s.dataset, &calibration, Some(&s.truth))
            .expect("in memory")
            .with_limit(limit)
            .verdict
    };
    assert_eq!(verdict(0.07), Verdict::Pass);
    assert_eq!(verdict(0.04), Verdict::Fail);
}

#[test]
fn json_has_the_keys_of_the_interface() {
    let s = sample();
    let score = score(&s.dataset, &noisy(&s.truth, 1e-3, 3), Some(&s.truth)).expect("in memory");
    let json = serde_json::to_value(&score).expect("it is JSON");
    for (key, inner) in [
        ("schema_version", &[][..]),
        ("verdict", &[]),
        ("beams", &["deflected", "solved", "abstained", "missed", "false"]),
        ("direction_deg", &["rms", "median", "p95", "max"]),
        ("direction_room_deg", &["rms", "median", "p95", "max"]),
        ("per_axis_rms_deg", &[]),
        ("per_axis_rms_room_deg", &[]),
        ("common_mode_deg", &[]),
        ("distance_mm", &["rms", "max"]),
        ("point_mm", &["at_1m", "at_4m", "at_10m"]),
        ("nees_mean", &[]),
        ("coverage_95", &[]),
        ("crlb_per_axis_deg", &[]),
        ("efficiency", &[]),
        ("warnings", &[]),
    ] {
        assert!(!json[key].is_null(), "{key}");
        for inner in inner {
            assert!(json[key][inner].is_number(), "{key}.{inner}");
        }
    }
    assert!(json.get("elements").is_none());
    assert_eq!(json["honesty"], "honest");
    assert_eq!(json["open"]["elements"], 0);
    assert_eq!(
        json["nulls"].as_object().map(serde_json::Map::len),
        Some(5),
        "{}",
        json["nulls"]
    );
}

#[test]
fn azimuth_differences_wrap_around_the_circle() {
    use std::f64::consts::PI;
    assert_eq!(wrap(0.3), 0.3);
    assert!((wrap(2.0 * PI - 1e-3) + 1e-3).abs() < 1e-15);
    assert!((wrap(-2.0 * PI + 1e-3) - 1e-3).abs() < 1e-15);
}

/// The score of a calibration with noise of a milliradian, changed afterwards.
fn falsified(change: impl FnOnce(&mut Calibration)) -> Score {
    let s = sample();
    let mut calibration = noisy(&s.truth, 1e-3, 3);
    change(&mut calibration);
    score(&s.dataset, &calibration, Some(&s.truth)).expect("in memory")
}

/// The names of the gates that are not met.
fn unmet(score: &Score) -> Vec<&str> {
    let all = score
        .gates
        .iter()
        .filter(|g| !matches!(g.outcome, Outcome::Pass | Outcome::NotTested));
    all.map(|g| g.name.as_str()).collect()
}

fn solved(calibration: &mut Calibration) -> impl Iterator<Item = &mut BeamEstimate> {
    calibration
        .beams
        .iter_mut()
        .filter(|b| b.status == Status::Solved)
}

/// The only mistake that was recognized.
fn mistake(score: &Score) -> &Mistake {
    assert_eq!(score.mistakes.len(), 1, "{:?}", score.mistakes);
    &score.mistakes[0]
}

#[test]
fn wrong_distances_fail_and_are_explained() {
    for (change, words) in [
        ((|d| d + 0.020) as fn(f64) -> f64, "20.0 mm subtracted from all d"),
        (|d| d - 0.020, "20.0 mm added to all d"),
        (|d| d * 2.0, "d halved, as of a round trip"),
        (|d| d / 2.54, "d in inches"),
    ] {
        let found = falsified(|c| {
            for b in solved(c) {
                b.distance_m = b.distance_m.map(change);
                if words == "d in inches" {
                    b.distance_m = b.distance_m.map(|d| d * 100.0);
                }
            }
        });
        assert_eq!(found.verdict, Verdict::Fail, "{words}");
        assert_eq!(unmet(&found), ["distance", "worst_distance"], "{words}");
        assert_eq!(mistake(&found).correction, words);
        assert!(mistake(&found).would_be < 0.2 * mistake(&found).found);
    }
    // One wrong distance among some 450.
    let one = falsified(|c| {
        let b = solved(c).next().expect("some are solved");
        b.distance_m = b.distance_m.map(|d| d + 0.010);
    });
    assert_eq!(unmet(&one), ["worst_distance"]);
    // None at all, and those of one half.
    let none = falsified(|c| solved(c).for_each(|b| b.distance_m = None));
    assert_eq!(
        (none.verdict, unmet(&none)),
        (Verdict::NotJudged, vec!["distances"])
    );
    let half = falsified(|c| solved(c).step_by(2).for_each(|b| b.distance_m = None));
    assert_eq!((half.verdict, unmet(&half)), (Verdict::Fail, vec!["distances"]));
    // A stated standard deviation takes the place of the session's belief.
    let stated = |sd| {
        falsified(|c| {
            for b in solved(c) {
                b.distance_m = b.distance_m.map(|d| d + 0.020);
                b.distance_sd_m = Some(sd);
            }
        })
    };
    assert_eq!(stated(0.015).verdict, Verdict::Pass);
    assert_eq!(unmet(&stated(0.005)), ["distance"]);
}

#[test]
fn a_wrong_mounting_fails_with_its_covariance_and_without() {
    let covariance = |sd: f64| {
        let mut c = [[0.0; 6]; 6];
        for (i, row) in c.iter_mut().enumerate() {
            row[i] = sd * sd;
        }
        Some(c)
    };
    let turned = |angle: f64, c: Option<[[f64; 6]; 6]>| {
        falsified(|calibration| {
            let mount = calibration.rig_from_sensor.as_mut().expect("it has one");
            let off = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle);
            let data = catoptric_model::PoseData::from(&(mount.pose() * off));
            mount.rotation_xyzw = data.rotation_xyzw;
            mount.covariance = c;
        })
    };
    assert_eq!(turned(0.0, covariance(1e-4)).verdict, Verdict::Pass);
    for c in [covariance(1e-3), None] {
        let found = turned(5.0_f64.to_radians(), c);
        assert_eq!((found.verdict, unmet(&found)), (Verdict::Fail, vec!["mounting"]));
        let mounting = found.mounting.expect("it is tracked");
        assert!((mounting.attitude_deg - 5.0).abs() < 1e-9 && mounting.position_mm < 1e-9);
        assert!(found.mistakes.is_empty(), "{:?}", found.mistakes);
    }
    let shifted = falsified(|c| c.rig_from_sensor.as_mut().expect("it has one").translation_m[0] += 0.1);
    assert_eq!(unmet(&shifted), ["mounting"]);
    // The usual mistakes.
    let inverted = falsified(|c| {
        let mount = c.rig_from_sensor.as_mut().expect("it has one");
        let data = catoptric_model::PoseData::from(&mount.pose().inverse());
        (mount.translation_m, mount.rotation_xyzw) = (data.translation_m, data.rotation_xyzw);
    });
    assert_eq!(
        mistake(&inverted).correction,
        "the mounting inverted (it is sensor_from_rig)"
    );
    let ordered = falsified(|c| {
        let mount = c.rig_from_sensor.as_mut().expect("it has one");
        let [x, y, z, w] = mount.rotation_xyzw;
        mount.rotation_xyzw = [w, x, y, z];
    });
    assert_eq!(
        mistake(&ordered).correction,
        "the quaternion in the order (w, x, y, z)"
    );
    // Without a mounting there is nothing to test.
    let none = falsified(|c| c.rig_from_sensor = None);
    assert_eq!((none.verdict, none.mounting), (Verdict::Pass, None));
}

#[test]
fn what_the_boards_determine_has_to_be_solved() {
    let abstaining = |share: usize| {
        falsified(|c| {
            for b in solved(c).step_by(share) {
                *b = BeamEstimate::without_angles(b.beam, Status::Rejected, Some("no time".to_owned()));
            }
        })
    };
    let half = abstaining(2);
    assert_eq!((half.verdict, unmet(&half)), (Verdict::Fail, vec!["solved"]));
    assert_eq!(half.knowable, half.beams.deflected);
    assert_eq!(half.clone().with_min_solved(0.4).verdict, Verdict::Pass);
    assert_eq!(unmet(&abstaining(1)), ["solved"]);
    assert_eq!(abstaining(11).verdict, Verdict::Pass);
    assert_eq!(abstaining(11).with_min_solved(0.95).verdict, Verdict::Fail);
    // On blind data nobody knows what is knowable: the share of what the calibration calls deflected, if it is asked for.
    let s = sample();
    let mut halved = perfect(&s.truth);
    for b in solved(&mut halved).step_by(2) {
        *b = BeamEstimate::without_angles(b.beam, Status::Rejected, Some("no time".to_owned()));
    }
    let blind = score(&s.dataset, &halved, None).expect("in memory");
    assert!(!unmet(&blind).contains(&"solved"));
    assert!(unmet(&blind.clone().with_min_solved(0.9)).contains(&"solved"));
    assert!(!unmet(&blind.with_min_solved(0.2)).contains(&"solved"));
}

#[test]
fn honest_takes_a_covariance_of_nearly_all() {
    let without =
        |every: usize| falsified(|c| solved(c).step_by(every).for_each(|b| b.covariance_rad2 = None));
    let none = without(1);
    assert_eq!(
        (none.verdict, unmet(&none)),
        (Verdict::NotJudged, vec!["covariance"])
    );
    let half = without(2);
    assert_eq!((half.verdict, half.honesty), (Verdict::Fail, None));
    assert_eq!(half.nulls["honesty"], "too few scored elements have a covariance");
    assert!((half.stated - 0.5).abs() < 0.01);
    assert_eq!(without(50).honesty, Some(Honesty::Honest));
}

#[test]
fn figures_can_be_required() {
    let found = falsified(|_| {});
    let with = |text: &str| {
        let requirement = Requirement::parse(text).expect("it is one");
        found.clone().with_requirement(&requirement)
    };
    assert_eq!(
        with("per_axis_rms_deg<=0.1").expect("a figure").verdict,
        Verdict::Pass
    );
    let missed = with("beams.solved>=1000").expect("a figure");
    assert_eq!(missed.verdict, Verdict::Fail);
    assert!(
        missed.warnings[0].starts_with("fails: beams.solved is "),
        "{:?}",
        missed.warnings
    );
    assert!(missed.warnings[0].ends_with(", required beams.solved>=1000"));
    let error = with("per_axis_rms>=1").expect_err("no figure");
    assert_eq!(error.help().as_deref(), Some("did you mean per_axis_rms_deg?"));
}

#[test]
fn the_usual_mistakes_are_recognized() {
    use catoptric_model::{Deflection, beam, mirror};
    let s = sample();
    let scan = &s.dataset.session.scanner.scan;
    let rig_from_sensor = Pose::from(&s.truth.rig_from_sensor);
    let room_from_sensor = Pose::from(&s.truth.room_from_rig) * rig_from_sensor;
    let exit = |base: f64, [azimuth, elevation]: [f64; 2]| beam::spherical(base + azimuth, elevation);
    let angles = |base: f64, v: Vector3<f64>| {
        let d = Deflection::from_exit(base, &nalgebra::Unit::new_normalize(v), 0.0);
        [d.azimuth, d.elevation]
    };
    type Change<'c> = (&'c str, &'c dyn Fn(f64, [f64; 2]) -> [f64; 2]);
    let changes: [Change<'_>; 13] = [
        ("φ negated", &|_, [a, e]| [a, -e]),
        ("θ_a negated", &|_, [a, e]| [-a, e]),
        ("θ_a and φ exchanged", &|_, [a, e]| [e, a.clamp(-1.5, 1.5)]),
        (
            "the azimuth read from the sensor's x axis (θ_a is measured from the undeflected beam)",
            &|base, [a, e]| [wrap(base + a), e],
        ),
        ("φ read from the zenith", &|_, [a, e]| {
            [a, std::f64::consts::FRAC_PI_2 - e]
        }),
        ("the angles converted to radians twice", &|_, [a, e]| {
            [a.to_radians(), e.to_radians()]
        }),
        ("the angles halved", &|_, [a, e]| {
            [wrap(2.0 * a), (2.0 * e).clamp(-1.57, 1.57)]
        }),
        ("y negated (a left-handed frame)", &|base, found| {
            let v = exit(base, found);
            angles(base, Vector3::new(v.x, -v.y, v.z))
        }),
        ("the direction reversed", &|base, found| {
            angles(base, -exit(base, found).into_inner())
        }),
        ("the axes (−y, x, z) taken for (x, y, z)", &|base, found| {
            let v = exit(base, found);
            angles(base, Vector3::new(v.y, -v.x, v.z))
        }),
        ("the directions read in the rig frame", &|base, found| {
            angles(base, rig_from_sensor * exit(base, found).into_inner())
        }),
        ("the directions read in the room frame", &|base, found| {
            angles(base, room_from_sensor * exit(base, found).into_inner())
        }),
        (
            "the angles read as those of the mirror's normal",
            &|base, found| {
                let u = beam::direction(base);
                let normal = mirror::normal_between(&u, &exit(base, found)).expect("it is deflected");
                angles(base, normal.into_inner())
            },
        ),
    ];
    let of = |words: &str, change: &dyn Fn(f64, [f64; 2]) -> [f64; 2]| {
        let mut calibration = noisy(&s.truth, 1e-4, 3);
        for b in solved(&mut calibration) {
            let found = [b.azimuth_rad, b.elevation_rad].map(|a| a.expect("solved"));
            let [azimuth, elevation] = change(scan.azimuth(b.beam), found);
            (b.azimuth_rad, b.elevation_rad) = (Some(azimuth), Some(elevation));
        }
        let found = score(&s.dataset, &calibration, Some(&s.truth)).expect("in memory");
        // Some of the angles from the zenith are beyond what an elevation can be.
        assert!(found.verdict.exit_code() > 0, "{words}");
        found
    };
    for (words, change) in changes {
        if ["θ_a and φ exchanged", "the angles halved"].contains(&words) {
            continue; // not every angle can be the other one
        }
        let found = of(words, change);
        let mistake = found
            .mistakes
            .first()
            .unwrap_or_else(|| panic!("{words}: {:?}", found.warnings));
        assert_eq!(mistake.correction, words);
        assert!(mistake.would_be < 0.03, "{words}: {mistake:?}");
        assert!(
            found
                .warnings
                .iter()
                .any(|w| w.starts_with(&format!("with {words}, the per-axis error would be 0.0")))
        );
    }
    // Beams counted from 1, and honest errors, which are no mistake.
    let mut shifted = noisy(&s.truth, 1e-4, 3);
    for b in &mut shifted.beams {
        b.beam += 1;
    }
    shifted.beams.pop();
    let found = score(&s.dataset, &shifted, Some(&s.truth)).expect("in memory");
    assert_eq!(found.mistakes[0].correction, "beams counted from 1");
    let honest = falsified(|_| {});
    assert_eq!(honest.mistakes, []);
    let turned = score(
        &s.dataset,
        &turned(noisy(&s.truth, 1e-4, 3), 0.01),
        Some(&s.truth),
    )
    .expect("in memory");
    assert!(
        turned.mistakes.iter().all(|m| m.figure == "nees_mean"),
        "a rotation is no convention: {:?}",
        turned.mistakes
    );
}

#[test]
fn a_covariance_in_another_form_is_recognized() {
    let with = |change: fn(f64) -> f64| {
        let found = falsified(|c| {
            for b in solved(c) {
                b.covariance_rad2 = b.covariance_rad2.map(|c| c.map(|row| row.map(change)));
            }
        });
        found
            .mistakes
            .into_iter()
            .map(|m| m.correction)
            .collect::<Vec<_>>()
    };
    let degrees = |x: f64| x * (180.0 / std::f64::consts::PI).powi(2);
    assert_eq!(with(degrees), ["the covariance in square degrees"]);
    assert_eq!(with(f64::sqrt), ["standard deviations instead of variances"]);
    assert_eq!(with(|x| x), [""; 0]);
    // The reverse of the first makes errors 57 times what is stated, and is recognized too.
    assert_eq!(
        with(|x| x * (std::f64::consts::PI / 180.0).powi(2)),
        ["the covariance converted to square radians twice"]
    );
}

#[test]
fn on_blind_data_boards_and_walls_judge() {
    let s = sample();
    let of = |change: &dyn Fn(&mut Calibration)| {
        let mut calibration = noisy(&s.truth, 1e-3, 3);
        // Otherwise the mounting would be as uncertain as the drawing.
        let mut certain = [[0.0; 6]; 6];
        (0..6).for_each(|i| certain[i][i] = 1e-8);
        calibration
            .rig_from_sensor
            .as_mut()
            .expect("it has one")
            .covariance = Some(certain);
        change(&mut calibration);
        score(&s.dataset, &calibration, None).expect("in memory")
    };
    let honest = of(&|_| {});
    assert_eq!(honest.verdict, Verdict::Blind, "{:?}", honest.warnings);
    assert!(honest.walls_normalized < 1.0, "{}", honest.walls_normalized);
    for (name, change) in [
        (
            "φ",
            (|b| b.elevation_rad = b.elevation_rad.map(|e| -e)) as fn(&mut BeamEstimate),
        ),
        ("2°", |b| b.azimuth_rad = b.azimuth_rad.map(|a| a + 0.035)),
        ("d", |b| b.distance_m = b.distance_m.map(|d| d + 0.02)),
    ] {
        let found = of(&|c| solved(c).for_each(change));
        assert_eq!(found.verdict, Verdict::Fail, "{name}: {:?}", found.gates);
    }
    let none = of(&|c| solved(c).for_each(|b| b.covariance_rad2 = None));
    assert_eq!(none.verdict, Verdict::NotJudged);
    let nothing = of(&|c| {
        for b in solved(c) {
            *b = BeamEstimate::without_angles(b.beam, Status::Rejected, Some("no time".to_owned()));
        }
    });
    assert_eq!(nothing.verdict, Verdict::Fail);
}

#[test]
fn what_is_not_valid_has_no_score() {
    let s = sample();
    for (key, change) in [
        ("frame", (|c| c.frame = "room".to_owned()) as fn(&mut Calibration)),
        ("beam", |c| c.beams[3].beam = 4),
        ("distance_m", |c| {
            solved(c).for_each(|b| b.distance_m = Some(-0.06))
        }),
        ("covariance_rad2", |c| {
            solved(c).for_each(|b| b.covariance_rad2 = Some([[1e-6, 2e-6], [1e-6, 1e-6]]));
        }),
        ("scanner", |c| {
            c.scanner.as_mut().expect("it has one").step_deg *= 2.0
        }),
    ] {
        for truth in [Some(&s.truth), None] {
            let mut calibration = noisy(&s.truth, 1e-3, 3);
            change(&mut calibration);
            let found = score(&s.dataset, &calibration, truth).expect("in memory");
            assert_eq!(
                (found.verdict, found.verdict.exit_code()),
                (Verdict::Invalid, 2),
                "{key}"
            );
            assert!(found.warnings[0].starts_with("invalid: ") && found.warnings[0].contains(key));
            assert!(found.per_axis_rms_deg.is_nan() && found.elements.is_empty());
        }
    }
}

#[test]
fn an_index_beyond_the_scan_is_no_element() {
    let s = sample();
    let mut truth = s.truth.clone();
    truth.beams.last_mut().expect("there are beams").beam = 1081;
    let last = truth.beams.iter_mut().rfind(|b| b.status == BeamClass::Deflected);
    last.expect("some are deflected").beam = 5000;
    let found = score(&s.dataset, &perfect(&s.truth), Some(&truth)).expect("in memory");
    assert!(found.verdict != Verdict::Invalid);
}

/// In a flight the rig is elsewhere, which is no error of the mounting.
#[test]
fn a_flight_does_not_count_for_the_mounting() {
    let mut s = sample();
    let calibration = perfect(&s.truth);
    let mounting = |s: &catoptric_fixtures::Sample| {
        let scored = score(&s.dataset, &calibration, Some(&s.truth)).expect("in memory");
        scored.mounting.expect("it is known")
    };
    let before = mounting(&s);
    let mut flight = s.dataset.poses[0].clone();
    flight.label.kind = catoptric_model::PoseKind::Flight;
    flight.label.pose = 1000;
    flight.room_from_rig = Pose::translation(1.0, 0.5, 0.2) * flight.room_from_rig;
    flight.motion = Some(catoptric_model::Motion {
        start_s: 0.0,
        scan_period_s: 0.025,
        scan_starts_s: Vec::new(),
        frames: Vec::new(),
    });
    s.dataset.poses.push(flight);
    assert_eq!(mounting(&s), before);
}
