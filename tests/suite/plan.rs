//! Planned board poses, recorded by the simulator and calibrated: whether the accuracy predicted by `plan` is attained.
//!
//! Only comparable quantities are compared. The bound excludes the mounting, so the scanner is mounted exactly as
//! drawn. It is that of a geometry, so the mirror is built nearly as drawn, and of the boards that a beam reads, so
//! only beams served by every board count. It assumes noise and d as the session believes them, so these beliefs are
//! true here. It neglects that E_a changes with the direction, which adds a little information, so the law of E_a is
//! flat, but its uncertainty is not. The estimator is `beam-gls`, which attains the bound of a single element. It does
//! not prove that no design is better.

use crate::common::{run, stderr, stdout};
use crate::scenes::{PROTOTYPE, scene};
use catoptric::calib::plan::{Criterion, Designer, Plan, Request, Situation, plan};
use catoptric::calib::{self, Method, Options};
use catoptric::model::{Dataset, Status};
use catoptric::plan::{completed, situation, with_poses};
use catoptric::sim::scene::{BoardPose, Color};
use catoptric::sim::truth::BeamClass;
use catoptric::sim::{Laboratory, Scene};
use nalgebra::{Unit, Vector3};
use rayon::prelude::*;

const FACET: &str = "left-1";

/// One facet of the default experiment, with the scanner mounted as drawn.
fn one_facet() -> Scene {
    let mut scene = scene(PROTOTYPE);
    scene.superstructure.facet.truncate(1);
    scene.superstructure.post.clear();
    scene.superstructure.as_built.tilt_sd_deg = 0.1;
    scene.superstructure.as_built.shift_sd_mm = 0.1;
    scene.superstructure.as_built.slope_rms_mrad = 0.0;
    scene.scanner.sub_rays = 7;
    scene.scanner.mount.yaw_tolerance_deg = 0.0;
    scene.scanner.mount.tilt_tolerance_deg = 0.0;
    scene.scanner.mount.shift_tolerance_mm = 0.0;
    scene.mocap.rig_exact = true;
    scene.experiment.scans_per_pose = 20;
    scene.experiment.room_scans = 20;
    scene.experiment.bare_scans = 20;
    scene.experiment.direct_poses = 0;
    scene.experiment.bare_distance_sd_mm = Some(0.3);
    scene.errors.angle.gain_mm = 0.0;
    scene.errors.angle.offset_mm = 0.0;
    scene.errors.noise.sd_mm = vec![4.0; scene.errors.noise.range_m.len()];
    let card = Color {
        reflectivity: 0.8,
        noise: Some(scene.errors.noise.clone()),
    };
    scene.color.insert("card".to_owned(), card);
    scene.board[0].color = "card".to_owned();
    scene
}

fn request(poses: usize, scene: &Scene) -> Request {
    Request {
        poses,
        readings: scene.experiment.scans_per_pose as usize,
        tries: 3000,
        ..Request::default()
    }
}

/// Mean square error per axis over some beams, in deg², for each of 60 seeds; nearly all of them must be solved.
fn square_errors(scene: &Scene, beams: &[usize]) -> Vec<f64> {
    (1..=200)
        .into_par_iter()
        .map(|seed| {
            let laboratory = Laboratory::new(scene, seed).expect("the scene is valid");
            let (dataset, truth) = (
                laboratory.dataset().expect("recorded"),
                laboratory.truth().expect("known"),
            );
            let found = calib::calibrate(&dataset, Method::BeamGls, &Options::default())
                .expect("the calibration succeeds");
            let (mut sum, mut count) = (0.0, 0);
            for beam in beams {
                let real = truth
                    .beams
                    .iter()
                    .find(|b| b.beam == *beam)
                    .expect("every beam has a truth");
                let estimate = found.beam(*beam).expect("every element has an entry");
                let (Status::Solved, BeamClass::Deflected, Some(is), Some(should)) = (
                    estimate.status,
                    real.status,
                    estimate.deflection(),
                    real.deflection(),
                ) else {
                    continue;
                };
                let across = should.elevation.cos() * (is.azimuth - should.azimuth);
                let up = is.elevation - should.elevation;
                sum += 0.5 * (across * across + up * up);
                count += 1;
            }
            // Beams at the edges of the facet are split, as built, and correctly unsolved.
            assert!(
                count + 8 >= beams.len(),
                "seed {seed}: {count} of {}",
                beams.len()
            );
            sum / count as f64 * 1_f64.to_degrees().powi(2)
        })
        .collect()
}

/// Beams of the facet that are served by all of some poses.
fn served_by_all(designer: &Designer, situation: &Situation, chosen: &[usize]) -> Vec<usize> {
    let beams = situation.rays(FACET).into_iter().map(|ray| ray.0);
    let all = |beam: &usize| chosen.iter().all(|c| designer.candidate(*c).beams.contains(beam));
    beams.filter(all).collect()
}

/// Root mean square of the bounds of some beams, all of them determined, in degrees.
fn bound(designer: &Designer, beams: &[usize], chosen: &[usize]) -> f64 {
    let square = |beam: &usize| {
        designer
            .bound_deg(*beam, chosen)
            .expect("it is determined")
            .powi(2)
    };
    (beams.iter().map(square).sum::<f64>() / beams.len() as f64).sqrt()
}

/// Mean and its standard error.
fn mean_of(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

/// Whether the mean square error equals the square of a bound, to three standard errors.
#[track_caller]
fn confirms(errors: &[f64], bound_deg: f64, what: &str) -> f64 {
    let (mean, error) = mean_of(errors);
    let expected = bound_deg * bound_deg;
    eprintln!(
        "{what}: predicted {bound_deg:.4}°, found {:.4}°; mean square {:.3} ± {:.3} of the predicted",
        mean.sqrt(),
        mean / expected,
        error / expected
    );
    // If the sample scatters too much, the test proves nothing.
    assert!(
        error < 0.2 * expected,
        "{what}: too few seeds, {error} of {expected}"
    );
    assert!(
        (mean - expected).abs() < 3.0 * error,
        "{what}: {mean} ± {error}, predicted {expected}"
    );
    mean.sqrt()
}

#[test]
fn a_planned_scene_reaches_its_bound() {
    let scene = one_facet();
    let (situation, asked) = (situation(&scene).unwrap(), request(5, &scene));
    let plan = plan(&situation, &[], &asked).unwrap();
    assert_eq!(plan.facets[0].after.open, 0);
    let planned = with_poses(&scene, &plan).unwrap();
    assert_eq!(planned.experiment.pose.len(), 5);
    let mut designer = Designer::new(&situation, FACET, &asked).unwrap();
    let chosen = designer.best(5);
    let beams = served_by_all(&designer, &situation, &chosen);
    assert!(beams.len() > 30, "{beams:?}");
    let errors = square_errors(&planned, &beams);
    confirms(&errors, bound(&designer, &beams, &chosen), "planned");
}

#[test]
fn five_planned_poses_are_worth_three_times_five_random_ones() {
    let scene = one_facet();
    let situation = situation(&scene).unwrap();
    for criterion in [Criterion::D, Criterion::A] {
        let asked = Request {
            criterion,
            ..request(5, &scene)
        };
        let mut designer = Designer::new(&situation, FACET, &asked).unwrap();
        let drawn = designer.len();
        let rays = situation.rays(FACET);
        let middle = rays[rays.len() / 2].0;
        // Both choose from the same possible poses: the same ranges, incidences and room.
        let mut state = 1_u64;
        let mut random: Vec<f64> = (0..200)
            .map(|_| {
                let design: Vec<usize> = (0..5)
                    .map(|_| {
                        // Knuth's linear congruential generator, whose upper bits are random enough for choosing.
                        state = state
                            .wrapping_mul(6_364_136_223_846_793_005)
                            .wrapping_add(1_442_695_040_888_963_407);
                        usize::try_from(state >> 33).unwrap() % drawn
                    })
                    .collect();
                designer.bound_deg(middle, &design).unwrap_or(f64::INFINITY)
            })
            .collect();
        random.sort_by(f64::total_cmp);
        let best = designer.best(5);
        let planned = designer.bound_deg(middle, &best).expect("it is determined");
        let open = random.iter().filter(|r| r.is_infinite()).count();
        eprintln!(
            "{criterion:?}: planned {planned:.4}°, random median {:.4}°, tenth {:.4}°, best {:.4}°; {open} of 200 leave it open",
            random[100], random[20], random[0]
        );
        assert!(3.0 * planned < random[100], "{planned} and {}", random[100]);
        assert!(planned < random[0], "{planned} and {}", random[0]);
    }
}

/// The scene with boards in front of the middle beam at 1.3 m, by tilt and its direction in degrees.
fn with_boards(scene: &Scene, tilts: &[(f64, f64)]) -> Scene {
    let situation = situation(scene).unwrap();
    let rays = situation.rays(FACET);
    let (_, origin, v) = rays[rays.len() / 2];
    let (across, up) = catoptric::model::frame::tangent_basis(&v);
    let mut scene = scene.clone();
    for (tilt, direction) in tilts {
        let ((sin_t, cos_t), (sin_d, cos_d)) =
            (tilt.to_radians().sin_cos(), direction.to_radians().sin_cos());
        let sideways: Vector3<f64> = across.into_inner() * cos_d + up.into_inner() * sin_d;
        let normal = Unit::new_normalize(sideways * sin_t - v.into_inner() * cos_t);
        scene.experiment.pose.push(BoardPose {
            board: scene.board[0].name.clone(),
            facet: Some(FACET.to_owned()),
            center_m: (origin + v.into_inner() * 1.3).coords.into(),
            normal: normal.into_inner().into(),
            turn_deg: 0.0,
        });
    }
    scene
}

fn recorded(scene: &Scene, seed: u64) -> Dataset {
    Laboratory::new(scene, seed).unwrap().dataset().unwrap()
}

fn next(dataset: &Dataset, scene: &Scene, poses: usize) -> Plan {
    plan(
        &Situation::recorded(dataset).unwrap(),
        &[],
        &request(poses, scene),
    )
    .unwrap()
}

#[test]
fn the_gain_of_a_dataset_equals_the_predicted_gain() {
    // Little tilt, and all of it to one side: determined, but poorly.
    let poor = with_boards(
        &one_facet(),
        &[(25.0, 0.0), (20.0, 70.0), (25.0, 140.0), (15.0, 30.0)],
    );
    let dataset = recorded(&poor, poor.seed);
    let (situation, asked) = (Situation::recorded(&dataset).unwrap(), request(2, &poor));
    let plan = plan(&situation, &[], &asked).unwrap();
    let complete = completed(&poor, &dataset, &plan);
    assert_eq!(complete.experiment.pose.len(), 6);
    let mut designer = Designer::new(&situation, FACET, &asked).unwrap();
    let chosen = designer.best(2);
    let mut beams = served_by_all(&designer, &situation, &chosen);
    beams.retain(|beam| designer.bound_deg(*beam, &[]).is_some());
    assert!(beams.len() > 30, "{beams:?}");
    let (before, after) = (bound(&designer, &beams, &[]), bound(&designer, &beams, &chosen));
    let found = [
        confirms(&square_errors(&poor, &beams), before, "as it was"),
        confirms(&square_errors(&complete, &beams), after, "completed"),
    ];
    assert!(found[1] < 0.5 * found[0] && after < 0.5 * before);
}

#[test]
fn a_hinge_is_resolved_by_a_pose_across_it() {
    // Tilted along the fan, so that the boards form a hinge for all of its beams, not only for the middle one.
    let scene = one_facet();
    let rays = situation(&scene).unwrap().rays(FACET);
    let (across, up) = catoptric::model::frame::tangent_basis(&rays[rays.len() / 2].2);
    let fan = rays[rays.len() - 1].2.into_inner() - rays[0].2.into_inner();
    let along = up.dot(&fan).atan2(across.dot(&fan)).to_degrees();
    let back = along + 180.0;
    let hinge = with_boards(
        &scene,
        &[(30.0, along), (20.0, back), (10.0, along), (35.0, back)],
    );
    let dataset = recorded(&hinge, hinge.seed);
    let calibrated = |d: &Dataset| calib::calibrate(d, Method::BeamGls, &Options::default()).unwrap();
    let solved = |d: &Dataset| {
        let beams = calibrated(d).beams;
        beams.iter().filter(|b| b.status == Status::Solved).count()
    };
    assert_eq!(solved(&dataset), 0);
    let plan = next(&dataset, &hinge, 1);
    let facet = &plan.facets[0];
    assert!(facet.before.bound_deg.is_none());
    assert!(
        facet
            .lacking
            .iter()
            .any(|o| o.reason.contains("tilted along one direction only")),
        "{:?}",
        facet.lacking
    );
    let pose = &facet.poses[0];
    assert!(
        pose.direction_deg.to_radians().sin().abs() > std::f64::consts::FRAC_1_SQRT_2,
        "{}",
        pose.words
    );
    let complete = recorded(&completed(&hinge, &dataset, &plan), hinge.seed);
    assert!(
        solved(&complete) >= facet.after.determined - 8,
        "{} solved",
        solved(&complete)
    );
}

#[test]
fn the_program_plans_the_same_on_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let scene = one_facet();
    std::fs::write(folder.path().join("one.toml"), toml::to_string(&scene).unwrap()).unwrap();
    let at = |arguments: &[&str]| run(folder.path(), arguments);
    let plan = |threads: &str, seed: &str| {
        let output = at(&[
            "plan",
            "one.toml",
            "--poses",
            "3",
            "--json",
            "--threads",
            threads,
            "--seed",
            seed,
        ]);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        stdout(&output)
    };
    let one = plan("1", "1");
    assert_eq!(one, plan("2", "1"));
    assert_ne!(one, plan("2", "2"));
    let json: serde_json::Value = serde_json::from_str(&one).unwrap();
    assert_eq!(json["facets"][0]["poses"].as_array().unwrap().len(), 3);
    // The page and the scene are complete, and the scene is valid.
    let output = at(&[
        "plan",
        "one.toml",
        "--poses",
        "3",
        "--report",
        "plan.html",
        "--out",
        "planned.toml",
    ]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stdout(&output).contains("next: catoptric simulate planned.toml --out planned-dataset"));
    let page = std::fs::read_to_string(folder.path().join("plan.html")).unwrap();
    assert_eq!(page.matches("<svg").count(), 2);
    assert!(page.contains("toward ψ") && !page.contains("http"));
    assert_eq!(at(&["check", "planned.toml"]).status.code(), Some(0));
    // From its recording, which is then extended.
    let output = at(&["simulate", "planned.toml", "--out", "data"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let output = at(&["plan", "data", "--poses", "1", "--out", "more.toml"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stdout(&output).contains("4 poses"), "{}", stdout(&output));
    std::fs::remove_dir_all(folder.path().join("data/truth")).unwrap();
    assert_eq!(at(&["plan", "data", "--poses", "1", "-q"]).status.code(), Some(0));
    let output = at(&["plan", "data", "--poses", "1", "--out", "blind.toml"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("blind"));
}

#[test]
fn impossible_plans_are_explained() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("one.toml"),
        toml::to_string(&one_facet()).unwrap(),
    )
    .unwrap();
    for (arguments, words) in [
        (&["--facet", "left-2"][..], "did you mean --facet left-1?"),
        (&["--range-m", "8,9"], "nearer than the minimum range"),
        (&["--range-m", "2"], "takes two numbers"),
        (&["--range-m", "2,1"], "at least the minimum range"),
        (&["--max-incidence-deg", "90"], "between 0 and 90"),
        (&["--poses", "0"], "--poses"),
        (&["--set", "board.0.width_mm=9000"], "reach through a wall"),
    ] {
        let output = run(folder.path(), &[&["plan", "one.toml"], arguments].concat());
        assert_eq!(
            output.status.code(),
            Some(2),
            "{arguments:?}: {}",
            stderr(&output)
        );
        assert!(
            stderr(&output).contains(words),
            "{arguments:?}: {}",
            stderr(&output)
        );
    }
}
