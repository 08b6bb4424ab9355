//! The effect of manufacturing errors in `tolerance` equals that of reflection.
//!
//! Errors of directions are compared with closed forms, the structures with the simulated ones. These do not prove that
//! real mirrors have the errors that a scene states.

use crate::common::{run, stderr, stdout};
use catoptric::files::scene as scenes;
use catoptric::layout::{self, Class, Detail};
use catoptric::model::beam;
use catoptric::sim::build::Structure;
use catoptric::sim::scene::AsBuilt;
use catoptric::sim::{Laboratory, Scene};
use catoptric::tolerance::{Bounds, Built, Calibrated, Cause, Workshop, calibrate};
use catoptric_fixtures::ust20lx;
use std::path::Path;

fn root(path: &str) -> String {
    format!("{}/{path}", env!("CARGO_MANIFEST_DIR"))
}

fn load(path: &str, sets: &[&str]) -> Scene {
    let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
    let path = root(&format!("scenes/{path}"));
    scenes::load(Path::new(&path), &sets).unwrap_or_else(|e| panic!("{path}: {e}"))
}

const EXACT: AsBuilt = AsBuilt {
    tilt_sd_deg: 0.0,
    shift_sd_mm: 0.0,
    slope_rms_mrad: 0.0,
    thickness_sd_mm: 0.0,
};

/// One flat facet of 60 pencil beams; the scanner is mounted as drawn.
fn one_facet(as_built: AsBuilt) -> Scene {
    let mut scene = load("reference-facet.toml", &[]);
    scene.superstructure.as_built = as_built;
    scene.superstructure.mirror.thickness_mm = 2.0;
    scene
}

fn built(workshop: &Workshop, seeds: std::ops::RangeInclusive<u64>) -> Vec<Built> {
    seeds.map(|seed| workshop.build(seed).unwrap()).collect()
}

#[test]
fn a_tilt_rotates_beams_by_its_closed_form() {
    let sigma = 0.1_f64;
    let scene = one_facet(AsBuilt {
        tilt_sd_deg: sigma,
        ..EXACT
    });
    let m = Structure::nominal(&scene).unwrap().facets[0].face.normal;
    let workshop = Workshop::new(&scene).unwrap();
    let draws = built(&workshop, 1..=4000);
    // E|δv|² = 4σ²(1 + cos² i), over the elements of the facet; they share its rotation, so structures are the sample.
    let sigma = sigma.to_radians();
    let ratios: Vec<f64> = draws
        .iter()
        .map(|draw| {
            let found: f64 = draw.whole.departures.iter().map(|d| d.direction.powi(2)).sum();
            let expected: f64 = draw
                .whole
                .departures
                .iter()
                .map(|d| {
                    let cos = m.dot(&beam::direction(ust20lx::azimuth(d.beam)));
                    4.0 * sigma * sigma * (1.0 + cos * cos)
                })
                .sum();
            found / expected
        })
        .collect();
    let n = ratios.len() as f64;
    let mean = ratios.iter().sum::<f64>() / n;
    let variance = ratios.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / (n - 1.0);
    // 3.2905 standard errors: one seed in a thousand. They are 6 % of the square, 3 % of the root mean square.
    let limit = 3.2905 * (variance / n).sqrt();
    assert!(limit < 0.07 && (mean - 1.0).abs() < limit, "{mean} ± {limit}");
    // The summary is their root mean square.
    let found = workshop.summarize(&draws);
    let all = || draws.iter().flat_map(|d| &d.whole.departures);
    let square: f64 = all().map(|d| d.direction.to_degrees().powi(2)).sum();
    let rms = (square / all().count() as f64).sqrt();
    assert!((found.direction_deg.rms.unwrap() / rms - 1.0).abs() < 1e-12);
    assert!((found.facets[0].direction_deg.rms.unwrap() / rms - 1.0).abs() < 1e-12);
    assert!((found.sources[0].direction_rms_deg.unwrap() / rms - 1.0).abs() < 1e-12);
    assert_eq!(found.sources.len(), 1);
    assert_eq!(found.histogram.counts.iter().sum::<usize>(), all().count());
}

#[test]
fn every_element_has_the_error_of_its_facet_s_normal() {
    let scene = one_facet(AsBuilt {
        tilt_sd_deg: 1.0,
        shift_sd_mm: 0.5,
        ..EXACT
    });
    let drawn = Structure::nominal(&scene).unwrap().facets[0].face.normal;
    let workshop = Workshop::new(&scene).unwrap();
    for draw in built(&workshop, 1..=5) {
        let normal = Structure::as_built(&scene, draw.whole.seed).unwrap().facets[0]
            .face
            .normal;
        assert!(draw.whole.departures.len() > 50);
        for departure in &draw.whole.departures {
            let u = beam::direction(ust20lx::azimuth(departure.beam)).into_inner();
            let reflected = |m: &nalgebra::Vector3<f64>| u - m * (2.0 * m.dot(&u));
            let (from, to) = (reflected(&drawn), reflected(&normal));
            let angle = from.cross(&to).norm().atan2(from.dot(&to));
            assert!(
                (departure.direction - angle).abs() < 1e-12,
                "{departure:?} {angle}"
            );
        }
    }
}

#[test]
fn a_thicker_mirror_moves_points_by_twice_as_much_and_rotates_nothing() {
    let scene = one_facet(AsBuilt {
        thickness_sd_mm: 0.1,
        ..EXACT
    });
    let nominal = Structure::nominal(&scene).unwrap();
    let [drawn] = &nominal.facets[..] else {
        panic!("one facet");
    };
    let workshop = Workshop::new(&scene).unwrap();
    let mut thicker = Vec::new();
    for draw in built(&workshop, 1..=200) {
        let structure = Structure::as_built(&scene, draw.whole.seed).unwrap();
        let facet = &structure.facets[0];
        // The bare structure stays; the face is in front of it by the thickness of the mirror.
        assert_eq!(facet.backing.corners, drawn.backing.corners);
        let ahead = facet
            .face
            .normal
            .dot(&(facet.face.corners[0] - facet.backing.corners[0]));
        assert!((ahead - facet.thickness).abs() < 1e-15);
        let change = facet.thickness - drawn.thickness;
        for departure in &draw.whole.departures {
            assert!(departure.direction < 1e-12);
            assert!((departure.point - 2.0 * change.abs()).abs() < 1e-12);
        }
        thicker.push(change / 1e-4);
    }
    // Two hundred standard normal draws: 3.2905 standard errors of mean and variance.
    let n = thicker.len() as f64;
    let mean = thicker.iter().sum::<f64>() / n;
    let square = thicker.iter().map(|t| t * t).sum::<f64>() / n;
    assert!(mean.abs() < 3.2905 / n.sqrt(), "{mean}");
    assert!(
        (square - 1.0).abs() < 3.2905 * (2.0 / n).sqrt() && square > 0.5,
        "{square}"
    );
}

#[test]
fn the_experimenter_adds_the_nominal_thickness_of_the_mirror() {
    // Step 3 measures the bare structure, whose pose is correct; the face of the mirror is not at its nominal pose.
    let scene = |thickness_sd_mm| {
        let mut scene = one_facet(AsBuilt {
            thickness_sd_mm,
            ..EXACT
        });
        scene.experiment.scans_per_pose = 3;
        scene
    };
    let session = |scene: &Scene| Laboratory::new(scene, 4).unwrap().session().unwrap();
    let (exact, other) = (session(&scene(0.0)), session(&scene(0.3)));
    assert_eq!(
        exact.bare_structure.mirror_thickness_mm,
        other.bare_structure.mirror_thickness_mm
    );
    for (a, b) in exact
        .bare_structure
        .distance_m
        .iter()
        .zip(&other.bare_structure.distance_m)
    {
        assert!((a - b).abs() < 1e-12, "{a} {b}");
    }
    // The session believes that mirror thicknesses vary.
    assert!(other.bare_structure.distance_sd_mm >= 0.3);
    assert!(exact.bare_structure.distance_sd_mm < other.bare_structure.distance_sd_mm);
}

#[test]
fn structures_equal_the_simulated_ones() {
    for name in ["prototype.toml", "gallery/pyramid.toml", "gallery/altimeter.toml"] {
        let scene = load(name, &[]);
        let workshop = Workshop::new(&scene).unwrap();
        let draws = built(&workshop, 3..=5);
        let found = workshop.summarize(&draws);
        assert_eq!((found.seed, found.draws), (3, 3));
        let drawn = layout::analyze(&scene, None, Detail::Full).unwrap();
        assert_eq!(found.drawn.lost, drawn.lost);
        assert_eq!(found.drawn.deflected, drawn.counts[&Class::Deflected]);
        let mut worst = 0;
        for draw in &draws {
            let analysis = layout::analyze(&scene, Some(draw.whole.seed), Detail::Full).unwrap();
            assert_eq!(draw.whole.split, analysis.counts[&Class::Split]);
            assert_eq!(draw.whole.lost, analysis.lost);
            worst = worst.max(analysis.lost);
            let truth = Laboratory::new(&scene, draw.whole.seed).unwrap().truth().unwrap();
            let drawn_exit = |beam: usize| {
                let e = &drawn.elements[beam];
                let [azimuth, elevation] =
                    [e.exit_azimuth_deg, e.exit_elevation_deg].map(|a| a.unwrap().to_radians());
                beam::spherical(azimuth, elevation)
            };
            for departure in &draw.whole.departures {
                let exit = truth.beams[departure.beam]
                    .exit_direction(ust20lx::azimuth(departure.beam))
                    .unwrap();
                let angle = beam::angle_between(&drawn_exit(departure.beam), &exit);
                assert!(
                    (departure.direction - angle).abs() < 1e-9,
                    "{name} {departure:?} {angle}"
                );
            }
            assert_eq!(
                draw.whole.departures.len() + draw.whole.changed,
                found.drawn.deflected
            );
        }
        assert_eq!(found.lost_worst, worst);
        let causes: Vec<Cause> = workshop.causes().collect();
        assert_eq!(causes, [Cause::Tilt, Cause::Shift, Cause::Flatness, Cause::Mount]);
    }
}

#[test]
fn a_structure_built_as_drawn_has_no_errors() {
    let workshop = Workshop::new(&one_facet(EXACT)).unwrap();
    let found = workshop.summarize(&built(&workshop, 1..=2));
    assert_eq!(found.direction_deg.max, Some(0.0));
    assert_eq!(found.point_at_4m_mm.max, Some(0.0));
    assert_eq!((found.changed_worst, found.sources.len()), (0, 0));
}

#[test]
fn the_errors_left_by_calibrations_are_those_that_a_study_finds() {
    let scene = load("reference-facet.toml", &[]);
    let runs: Vec<_> = [1, 2, 3].map(|seed| calibrate(&scene, seed).unwrap()).to_vec();
    let found = Calibrated::of(&runs);
    let mean = runs.iter().map(|r| r.square).sum::<f64>() / 3.0;
    assert!((found.per_axis_deg.unwrap().to_radians().powi(2) / mean - 1.0).abs() < 1e-12);
    assert_eq!((found.structures, found.failed), (3, 0));
    // The bound of each experiment is predicted before anything is recorded: boards and structure are the same.
    let predicted: Vec<_> = [1, 2, 3].map(|seed| layout::predict(&scene, seed)).to_vec();
    let bounds = Bounds::of(&predicted);
    let ratio = bounds.per_axis_deg.unwrap() / found.bound_per_axis_deg.unwrap();
    assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
    assert!(bounds.worst_per_axis_deg.unwrap() >= bounds.per_axis_deg.unwrap());
    assert_eq!(bounds.open_worst, Some(0));
}

#[test]
fn the_verb_judges_and_writes_the_same_on_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let scene = root("scenes/gallery/altimeter.toml");
    let of = |threads: &str| {
        let arguments = [
            "tolerance",
            &scene,
            "--draws",
            "20",
            "--bounds",
            "2",
            "--calibrate",
            "1",
            "--set",
            "experiment.scans_per_pose=20",
            "--threads",
            threads,
            "--out",
            threads,
            "--json",
        ];
        let output = run(folder.path(), &arguments);
        assert!(output.status.success(), "{}", stderr(&output));
        let files = ["tolerance.json", "directions.svg", "report.html"];
        let read = |name: &str| std::fs::read_to_string(folder.path().join(threads).join(name)).unwrap();
        (stdout(&output), files.map(read))
    };
    let (one, three) = (of("1"), of("3"));
    assert_eq!(one, three);
    let (printed, [json, plot, page]) = one;
    assert_eq!(printed, json);
    assert!(plot.starts_with("<svg xmlns") && page.contains("altimeter"));
    assert!(!page.contains("http") && !page.contains("could not be drawn"));
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!((&json["schema_version"], &json["draws"]), (&1.into(), &20.into()));
    assert_eq!(json["calibrated"]["structures"], 1);
    // Calibration reduces the errors.
    let left = json["calibrated"]["direction_rms_deg"].as_f64().unwrap();
    assert!(left < 0.1 * json["direction_deg"]["rms"].as_f64().unwrap());
}

#[test]
fn requirements_decide_the_exit_code() {
    let folder = tempfile::tempdir().unwrap();
    let scene = root("scenes/gallery/altimeter.toml");
    let with = |requirement: &str, more: &[&str]| {
        let mut arguments = vec![
            "tolerance",
            &scene,
            "--draws",
            "5",
            "--bounds",
            "0",
            "--require",
            requirement,
        ];
        arguments.extend(more);
        let output = run(folder.path(), &arguments);
        (output.status.code(), stderr(&output))
    };
    for met in [
        "direction_deg.rms<10",
        "facets.*.direction_deg.p95 <= 20",
        "facets.down.elements>10",
        "drawn.deflected>=11",
    ] {
        assert_eq!(with(met, &[]).0, Some(0), "{met}");
    }
    let (code, said) = with("direction_deg.p95<=0.01", &[]);
    assert_eq!(code, Some(1));
    assert!(
        said.contains("not met: altimeter: direction_deg.p95 is "),
        "{said}"
    );
    // Tighter manufacturing meets it.
    let tight = ["--set", "superstructure.as_built.tilt_sd_deg=0.001"];
    let mount = ["--set", "scanner.mount.yaw_tolerance_deg=0"];
    let tilt = ["--set", "scanner.mount.tilt_tolerance_deg=0"];
    let even = ["--set", "superstructure.as_built.slope_rms_mrad=0"];
    let all = [tight, mount, tilt, even].concat();
    assert_eq!(with("direction_deg.p95<=0.01", &all).0, Some(0));
    for (requirement, hint) in [
        ("direction_deg.p96<1", "did you mean direction_deg.p95?"),
        (
            "facets.*.direction_deg.rm<1",
            "did you mean facets.*.direction_deg.rms?",
        ),
        ("wings<1", "every number of --json has a name"),
        ("bound.per_axis_deg<1", "is not a figure"),
        ("direction_deg.p95", "is not a requirement"),
    ] {
        let (code, said) = with(requirement, &[]);
        assert_eq!(code, Some(2), "{requirement}: {said}");
        assert!(said.contains(hint), "{requirement}: {said}");
    }
}
