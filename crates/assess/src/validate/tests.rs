//! Tests of validation: valid calibrations have no problem; each mistake is reported with its key.

use super::*;
use catoptric_fixtures::{noisy, perfect, sample};
use catoptric_model::calibration::FacetEstimate;
use catoptric_model::{BeamEstimate, RangeBias, Status};

/// The problems of a valid calibration after one change.
fn after(change: impl FnOnce(&mut Calibration, usize)) -> Vec<Problem> {
    let truth = sample().truth;
    let mut calibration = noisy(&truth, 1e-3, 1);
    let solved = calibration
        .beams
        .iter()
        .position(|b| b.status == Status::Solved)
        .expect("some are solved");
    change(&mut calibration, solved);
    validate(&calibration)
}

fn one(problems: &[Problem]) -> &Problem {
    assert_eq!(problems.len(), 1, "{problems:?}");
    &problems[0]
}

#[test]
fn a_valid_calibration_has_no_problem() {
    let truth = sample().truth;
    assert_eq!(validate(&noisy(&truth, 1e-3, 1)), []);
    assert_eq!(validate(&perfect(&truth)), []);
}

#[test]
fn degrees_are_recognized() {
    let problems = after(|c, i| {
        for b in &mut c.beams {
            b.azimuth_rad = b.azimuth_rad.map(f64::to_degrees);
            b.elevation_rad = b.elevation_rad.map(f64::to_degrees);
        }
        c.beams[i].elevation_rad = Some(45.0);
    });
    assert!(problems.len() > 300);
    let at_45 = problems
        .iter()
        .find(|p| p.message.contains("is 45,"))
        .expect("it is found");
    assert_eq!(
        at_45.message,
        "is 45, outside ±π/2; it looks like degrees: 45° is 0.7854 rad"
    );
    assert!(at_45.key.ends_with("].elevation_rad") && at_45.severity == Severity::Error);
    assert_eq!(
        at_45.to_string(),
        format!(
            "error: {} (beam {}): {}",
            at_45.key,
            at_45.beam.expect("of a beam"),
            at_45.message
        )
    );
}

#[test]
fn angles_have_limits_and_numbers() {
    let problem = after(|c, i| c.beams[i].azimuth_rad = Some(3.2));
    assert!(one(&problem).message.starts_with("is 3.2, outside ±π"));
    assert!(!one(&problem).message.contains("degrees"));
    for bad in [f64::NAN, f64::INFINITY] {
        let problem = after(|c, i| c.beams[i].elevation_rad = Some(bad));
        assert!(one(&problem).message.ends_with("not a number"));
    }
    let problem = after(|c, i| c.beams[i].elevation_rad = None);
    assert!(one(&problem).message.contains("missing from a solved element"));
}

#[test]
fn distances_are_positive_meters() {
    assert!(
        one(&after(|c, i| c.beams[i].distance_m = Some(65.0)))
            .message
            .contains("millimeters")
    );
    assert!(
        one(&after(|c, i| c.beams[i].distance_m = Some(-0.06)))
            .key
            .ends_with("distance_m")
    );
    assert_eq!(after(|c, i| c.beams[i].distance_m = None), []);
}

#[test]
fn a_covariance_is_symmetric_and_positive() {
    for (covariance, what) in [
        ([[1e-6, 2e-7], [-2e-7, 1e-6]], "is not symmetric"),
        ([[1e-6, 2e-6], [2e-6, 1e-6]], "is not positive semi-definite"),
        ([[-1e-6, 0.0], [0.0, 1e-6]], "has the negative variance -1e-6"),
        (
            [[f64::NAN, 0.0], [0.0, 1e-6]],
            "contains a value that is not a number",
        ),
        (
            [[100.0, 0.0], [0.0, 1e-6]],
            "means a standard deviation of 10.000 rad, which is meaningless; is it in degrees?",
        ),
    ] {
        let problems = after(|c, i| c.beams[i].covariance_rad2 = Some(covariance));
        assert_eq!(one(&problems).message, what);
        assert_eq!(one(&problems).severity, Severity::Error);
    }
    let tiny = after(|c, i| c.beams[i].covariance_rad2 = Some([[1e-24, 0.0], [0.0, 1e-24]]));
    assert_eq!(one(&tiny).severity, Severity::Warning);
    // Perfectly correlated is semi-definite, and valid.
    assert_eq!(
        after(|c, i| c.beams[i].covariance_rad2 = Some([[4e-6, 2e-6], [2e-6, 1e-6]])),
        []
    );
}

#[test]
fn a_status_is_consistent_with_the_rest() {
    let unsolved = |status, reason: Option<&str>, angle| {
        after(|c, i| {
            let mut b = BeamEstimate::without_angles(c.beams[i].beam, status, reason.map(str::to_owned));
            b.azimuth_rad = angle;
            c.beams[i] = b;
        })
    };
    assert!(
        one(&unsolved(Status::Rejected, None, None))
            .key
            .ends_with("reason")
    );
    assert!(
        one(&unsolved(Status::Rejected, Some(" "), None))
            .key
            .ends_with("reason")
    );
    assert!(
        one(&unsolved(Status::Unobservable, Some("one axis"), Some(0.1)))
            .message
            .contains("never a number")
    );
    assert_eq!(unsolved(Status::Direct, None, None), []);
    assert_eq!(unsolved(Status::Unobservable, Some("one axis"), None), []);
    assert!(
        one(&unsolved(Status::Direct, None, Some(0.1)))
            .key
            .ends_with("status")
    );
}

#[test]
fn the_rest_of_the_file_is_checked_too() {
    let key = |change: fn(&mut Calibration, usize)| {
        let problems = after(change);
        one(&problems).key.clone()
    };
    assert_eq!(key(|c, _| c.schema_version = 3), "schema_version");
    assert_eq!(key(|c, _| c.frame = "room".to_owned()), "frame");
    assert_eq!(key(|c, _| c.method.clear()), "method");
    assert_eq!(key(|c, _| c.beams[3].beam = 1081), "beams[3].beam");
    assert_eq!(key(|c, _| c.beams[3].beam = 2), "beams[3].beam");
    assert_eq!(
        key(|c, i| c.beams[i].null_direction = Some([1.0, 1.0]))
            .split('.')
            .next_back(),
        Some("null_direction")
    );
    assert_eq!(
        key(|c, _| {
            let mount = c.rig_from_sensor.as_mut().expect("it has one");
            mount.rotation_xyzw = [0.0, 0.0, 0.0, 2.0];
        }),
        "rig_from_sensor.rotation_xyzw"
    );
    assert_eq!(
        key(|c, _| c.facets.push(FacetEstimate {
            facet: "port".to_owned(),
            normal: [0.0, 0.0, 1.1],
            offset_m: 0.05,
            covariance: [[0.0; 3]; 3],
        })),
        "facets[0].normal"
    );
    assert_eq!(
        key(|c, _| {
            let mut bias = RangeBias::default();
            bias.distance.range_m = vec![1.0];
            c.bias = Some(bias);
        }),
        "bias.distance"
    );
}

#[test]
fn whole_turns_are_recognized_and_are_no_degrees() {
    use std::f64::consts::TAU;
    for (turn, words) in [(TAU, "much: minus"), (-TAU, "little: plus")] {
        let problems = after(|c, _| {
            for b in &mut c.beams {
                b.azimuth_rad = b.azimuth_rad.map(|a| a + turn);
            }
        });
        assert!(problems.len() > 300);
        for problem in &problems {
            assert!(
                problem
                    .message
                    .contains(&format!("; it looks like a whole turn too {words} 2π it is ")),
                "{problem}"
            );
        }
    }
    let problem = after(|c, i| c.beams[i].elevation_rad = Some(TAU + 0.5));
    assert!(one(&problem).message.ends_with("minus 2π it is 0.5000 rad"));
    // The nearest whole turn leaves it beyond its limit.
    let problem = after(|c, i| c.beams[i].elevation_rad = Some(2.0));
    assert_eq!(one(&problem).message, "is 2, outside ±π/2");
}

#[test]
fn straight_up_and_down_are_elevations() {
    use std::f64::consts::FRAC_PI_2;
    // Nine digits round it up.
    let rounded = (FRAC_PI_2 * 1e9).round() / 1e9;
    for elevation in [FRAC_PI_2, -FRAC_PI_2, rounded, -rounded] {
        assert_eq!(after(|c, i| c.beams[i].elevation_rad = Some(elevation)), []);
    }
    assert_eq!(
        after(|c, i| c.beams[i].elevation_rad = Some(-FRAC_PI_2 - 1e-6)).len(),
        1
    );
}

#[test]
fn mirrors_that_the_session_does_not_have_are_named() {
    let s = sample();
    let session = &s.dataset.session;
    let known = session.facets[0].name.clone();
    let with = |name: &str| {
        let mut calibration = noisy(&s.truth, 1e-3, 1);
        let b = calibration.beams.iter_mut().find(|b| b.facet.is_some());
        b.expect("some are deflected").facet = Some(name.to_owned());
        calibration.facets = vec![FacetEstimate {
            facet: name.to_owned(),
            normal: [0.0, 0.0, 1.0],
            offset_m: 0.05,
            covariance: [[0.0; 3]; 3],
        }];
        validate_for(&calibration, session)
    };
    assert_eq!(with(&known), []);
    let problems = with(&format!("{known}x"));
    let keys: Vec<&str> = problems
        .iter()
        .map(|p| p.key.rsplit('.').next().unwrap_or_default())
        .collect();
    assert_eq!(keys, ["facet", "facet"]);
    for problem in &problems {
        assert_eq!(problem.severity, Severity::Error);
        let words = format!("is \"{known}x\", a mirror that the session does not have; did you mean ");
        assert!(problem.message.starts_with(&words), "{problem}");
    }
    let words = format!("it has \"{known}\", ");
    assert!(with("quite another")[0].message.contains(&words));
    let mut unlisted = session.clone();
    unlisted.facets.clear();
    assert_eq!(validate_for(&noisy(&s.truth, 1e-3, 1), &unlisted), []);
}

#[test]
fn covariances_of_mountings_and_mirrors_that_mean_nothing_are_refused() {
    for (row, sd, unit) in [(0, 11.0, "11.000 m"), (5, 32.0, "32.000 rad")] {
        let problems = after(|c, _| {
            let mut covariance = [[0.0; 6]; 6];
            covariance[row][row] = sd * sd;
            c.rig_from_sensor.as_mut().expect("it has one").covariance = Some(covariance);
        });
        assert_eq!(
            one(&problems).message,
            format!("means a standard deviation of {unit} in row {row}, which is meaningless")
        );
    }
    let facet = |row: usize, variance: f64| {
        let problems = after(|c, _| {
            let mut covariance = [[0.0; 3]; 3];
            covariance[row][row] = variance;
            c.facets.push(FacetEstimate {
                facet: "port".to_owned(),
                normal: [0.0, 0.0, 1.0],
                offset_m: 0.05,
                covariance,
            });
        });
        problems.len()
    };
    assert_eq!(
        [facet(0, 9.0), facet(0, 10.0), facet(2, 99.0), facet(2, 101.0)],
        [0, 1, 0, 1]
    );
}
