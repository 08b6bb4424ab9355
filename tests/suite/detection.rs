//! Every detector compared with closed forms and with an independently summed waveform.
//!
//! The closed forms model the light on a tilted board as a Gaussian in range: its mean is shifted by s·σ_δ²(½ − 2tan²α),
//! its standard deviation is σ_R = s·tan α·σ_δ. That neglects the skew of the distribution, μ₃ = 6s³·tan²α·(½ +
//! tan²α)·σ_δ⁴: with a pulse of 4 ns (p = 255 mm) it changes the leading edge at 4 m and 60° by 0.2 %, but the peak by
//! 1.9 %, which therefore has an extra term. For pulses of p near σ_R = 28 mm only the summed waveform is accurate.
//! None of this proves that a real scanner has the simulated detector.

use crate::common::{folder_with, run, stderr};
use crate::scenes::{BARE, scene};
use catoptric::cast::{Polygon, Shape};
use catoptric::files::scene as scene_file;
use catoptric::model::Stretch;
use catoptric::sim::build::Structure;
use catoptric::sim::build::color;
use catoptric::sim::light::{Mirrors, Role, Setting};
use catoptric::sim::receive::echo::Receiver;
use catoptric::sim::receive::phase;
use catoptric::sim::receive::{Return, Sensor};
use catoptric::sim::scene::{BeamShape, Detector, ErrorModel, Preset};
use catoptric::sim::{Laboratory, Scene};
use catoptric_fixtures::ust20lx;
use nalgebra::Point3;
use std::collections::BTreeMap;
use std::f64::consts::LN_2;

/// Full 1/e² width of the beams here, in milliradians, and the standard deviation of their light, a quarter of that.
const WIDTH_MRAD: f64 = 16.0;
const SIGMA: f64 = 0.25e-3 * WIDTH_MRAD;

/// Standard deviation of a 4 ns pulse, in meters of range.
fn pulse_sd(fwhm_ns: f64) -> f64 {
    0.5 * 299_792_458.0 * fwhm_ns * 1e-9 / (8.0 * LN_2).sqrt()
}

/// A scanner whose beam is a thin horizontal fan of light, and the physical error model.
fn physical() -> Scene {
    let mut scene = scene(BARE);
    scene.errors.model = ErrorModel::Physical;
    scene.errors.drift_sd_mm = 0.0;
    scene.errors.quantization_mm = 0.0;
    scene.scanner.sub_rays = 1000;
    scene.scanner.beam = Some(BeamShape {
        wide_full_mrad: WIDTH_MRAD,
        narrow_full_mrad: 0.0,
        wide_aperture_mm: 0.0,
        narrow_aperture_mm: 0.0,
        turns: true,
    });
    scene
}

/// A board in the sensor frame: distance, tilt about the vertical in degrees, extent in y, color.
struct Target(f64, f64, [f64; 2], &'static str);

/// A board that fills the spot.
fn filling(distance: f64, tilt_deg: f64, color: &'static str) -> Target {
    Target(distance, tilt_deg, [-3.0, 3.0], color)
}

/// What the forward beam returns from boards.
fn forward(scene: &Scene, boards: &[Target]) -> Option<Return> {
    let structure = Structure::nominal(scene).expect("there is none");
    let targets = boards
        .iter()
        .map(|Target(distance, tilt_deg, [from, to], color)| {
            let (sin, cos) = libm::sincos(tilt_deg.to_radians());
            let at = |y: f64, z: f64| Point3::new(distance + y * sin, y * cos, z);
            catoptric::sim::light::Target {
                name: "board".to_owned(),
                shape: Shape::Polygon(
                    Polygon::new(vec![at(*to, -1.0), at(*from, -1.0), at(*from, 1.0), at(*to, 1.0)])
                        .expect("it has an area"),
                ),
                role: Role::Board,
                paint: color::paint(scene, color).expect("it is defined"),
            }
        });
    let setting =
        Setting::new(scene, &structure, Mirrors::Attached, targets.collect()).expect("colors are built in");
    Sensor::new(scene)
        .expect("white is built in")
        .observe(&setting, ust20lx::FORWARD)
}

/// Height of the echo of the whole spot, in units of the threshold: a reflectivity of 0.1 at 8 m gives 1.
fn height(reflectivity: f64, distance: f64, tilt_deg: f64) -> f64 {
    reflectivity / 0.1 * (8.0 / distance).powi(2) * libm::cos(tilt_deg.to_radians())
}

/// The waveform of a tilted board, summed over the spot in small steps, and the range that a detector takes from it.
fn summed(distance: f64, tilt_deg: f64, sd: f64, detector: Detector) -> f64 {
    let tilt = tilt_deg.to_radians();
    let n = 4001;
    let pulses: Vec<(f64, f64)> = (0..n)
        .map(|k| {
            let x = -6.0 + 12.0 * f64::from(k) / f64::from(n - 1);
            // The Gaussian is in the slope of the rays.
            let angle = libm::atan(libm::tan(0.5e-3 * WIDTH_MRAD) * 0.5 * x);
            let range = distance * libm::cos(tilt) / libm::cos(angle + tilt);
            let share = libm::exp(-0.5 * x * x);
            (range, share * libm::cos(angle + tilt) / (range * range))
        })
        .collect();
    let light: f64 = pulses.iter().map(|p| p.1).sum();
    let mean = pulses.iter().map(|(r, w)| r * w).sum::<f64>() / light;
    // The echo of a spot that hits the board face on has the height of Eq. (1).
    let whole: f64 = (0..n)
        .map(|k| libm::exp(-0.5 * (-6.0 + 12.0 * f64::from(k) / f64::from(n - 1)).powi(2)))
        .sum();
    let scale = 0.9 / 0.1 * 64.0 / whole;
    let wave = |x: f64| -> f64 {
        let at = |(r, w): &(f64, f64)| scale * w * libm::exp(-0.5 * ((x - r) / sd).powi(2));
        pulses.iter().map(at).sum()
    };
    let search = |mut low: f64, mut high: f64, below: &dyn Fn(f64) -> bool| {
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if below(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    };
    let top = search(mean - sd, mean + sd, &|x| {
        wave(x + 1e-6 * sd) > wave(x - 1e-6 * sd)
    });
    let level = match detector {
        Detector::Centroid => return mean,
        Detector::Peak => return top,
        Detector::LeadingEdge => 1.0,
        Detector::ConstantFraction => 0.5 * wave(top),
    };
    search(
        mean - 6.0 * sd - 6.0 * distance * SIGMA * libm::tan(tilt),
        top,
        &|x| wave(x) < level,
    )
}

/// How early the detector takes a Gaussian echo of a given height and standard deviation, in meters.
fn lead(detector: Detector, sd: f64, height: f64) -> f64 {
    let receiver = Receiver {
        detector,
        fraction: 0.5,
        sd,
        threshold: 1.0,
        saturation: f64::INFINITY,
    };
    receiver.lead(height)
}

/// The offset that the calibration at a white board 2 m away, face on, removes.
fn reference(detector: Detector, sd: f64) -> f64 {
    lead(detector, sd, height(0.9, 2.0, 0.0))
}

#[test]
fn a_tilted_board_reads_as_in_the_closed_forms() {
    let p = pulse_sd(4.0);
    for detector in Detector::ALL {
        let (mut worst, mut worst_summed) = (0.0_f64, 0.0_f64);
        for distance in [0.5, 1.0, 2.0, 4.0] {
            for tilt_deg in [0.0_f64, 15.0, 30.0, 45.0, 60.0] {
                let mut scene = physical();
                scene.detection.detector = detector;
                let found = forward(&scene, &[filling(distance, tilt_deg, "white")]);
                let error = found.expect("it is bright").range() - distance;
                let t = libm::tan(tilt_deg.to_radians());
                let centroid = distance * SIGMA * SIGMA * (0.5 - 2.0 * t * t);
                let spread = p.hypot(distance * t * SIGMA);
                // The peak of the echo is lower the more it is spread.
                let lambert = 1.0 + (3.0 * t * t - 1.5) * SIGMA * SIGMA;
                let f = height(0.9, distance, tilt_deg) * lambert * p / spread;
                let skew = match detector {
                    // A skewed echo peaks μ₃/2p² before its mean, μ₃ = 6s³·tan²α·(½ + tan²α)·σ_δ⁴.
                    Detector::Peak => {
                        -3.0 * (distance * SIGMA).powi(3) * t * t * (0.5 + t * t) * SIGMA / (spread * spread)
                    }
                    Detector::LeadingEdge | Detector::ConstantFraction | Detector::Centroid => 0.0,
                };
                let walk = reference(detector, p) - lead(detector, spread, f) + skew;
                let expected = centroid + walk;
                // 1 % of the magnitudes of the terms, since their sum passes through 0.
                let size = distance * SIGMA * SIGMA * (0.5 + 2.0 * t * t) + walk.abs();
                let miss = (error - expected).abs();
                worst = worst.max(miss / size);
                assert!(
                    miss < 0.01 * size + 1e-9,
                    "{detector:?} at {distance} m, {tilt_deg} degrees: {error} against {expected}"
                );
                let exact = summed(distance, tilt_deg, p, detector) - distance + reference(detector, p);
                worst_summed = worst_summed.max((error - exact).abs() / size);
                assert!(
                    (error - exact).abs() < 0.01 * size + 1e-9,
                    "{detector:?} at {distance} m, {tilt_deg} degrees: {error} against a summed {exact}"
                );
            }
        }
        eprintln!(
            "{detector:?}: {:.3} % of the closed form, {:.3} % of the sum",
            100.0 * worst,
            100.0 * worst_summed
        );
    }
}

#[test]
fn a_pulse_as_short_as_the_depth_of_the_spot_reads_as_the_summed_waveform() {
    let (distance, tilt_deg, fwhm_ns) = (4.0, 60.0, 0.47);
    let p = pulse_sd(fwhm_ns);
    let spread = p.hypot(distance * libm::tan(f64::to_radians(tilt_deg)) * SIGMA);
    for detector in Detector::ALL {
        let mut scene = physical();
        scene.detection.detector = detector;
        scene.detection.pulse_fwhm_ns = fwhm_ns;
        let found = forward(&scene, &[filling(distance, tilt_deg, "white")]).expect("it is bright");
        let exact = summed(distance, tilt_deg, p, detector) + reference(detector, p);
        // Far down the edge, at 1/13 of the height, the beam's tail counts, which the sub-rays sample at a single
        // radius: 1.6 %.
        assert!(
            (found.range() - exact).abs() < 0.02 * (spread - p) + 1e-9,
            "{detector:?}: {found:?}"
        );
    }
}

#[test]
fn a_darker_color_walks_as_far_as_the_closed_form_says() {
    let p = pulse_sd(4.0);
    for detector in Detector::ALL {
        for (name, reflectivity) in [("white", 0.9), ("pencil_grey", 0.4), ("jet_black", 0.05)] {
            // The device takes out none of it, most of it, all of it.
            for (distance, taken_out) in [(0.5, 0.0), (1.0, 0.9), (2.0, 0.0), (4.0, 1.0)] {
                let mut scene = physical();
                scene.scanner.sub_rays = 1;
                scene.detection.detector = detector;
                scene.detection.walk_compensated = taken_out;
                let found = forward(&scene, &[filling(distance, 0.0, name)]).expect("it is bright enough");
                let walk = reference(detector, p) - lead(detector, p, height(reflectivity, distance, 0.0));
                let expected = (1.0 - taken_out) * walk;
                assert!(
                    (found.range() - distance - expected).abs() < 1e-9,
                    "{detector:?}, {name}: {found:?}"
                );
            }
        }
    }
}

/// A scene of the repository, checked as the program does, and the stretch with its board.
fn recorded(name: &str, text: &str) -> (Laboratory, Stretch) {
    let scene = scene_file::parse(text, name, &[]).unwrap_or_else(|e| panic!("{name}: {e}"));
    let laboratory = Laboratory::new(&scene, scene.seed).expect("the scene is valid");
    let stretch = laboratory.stretch(2).expect("it is recorded");
    (laboratory, stretch)
}

/// The forward beam's first reading.
fn reading(name: &str, text: &str) -> f64 {
    recorded(name, text).1.ranges[ust20lx::FORWARD]
}

macro_rules! scene_text {
    ($name:literal) => {
        ($name, include_str!(concat!("../../scenes/", $name, ".toml")))
    };
}

#[test]
fn the_detector_scenes_give_the_stated_results() {
    let p = pulse_sd(4.0);
    let lead = |h: f64| p * (2.0 * libm::log(h)).sqrt();
    for ((name, text), expected, tolerance) in [
        (scene_text!("walk-of-grey"), 2.0 + lead(144.0) - lead(64.0), 1e-9),
        (scene_text!("no-walk-of-grey"), 2.0, 1e-9),
        (
            scene_text!("saturated-fraction"),
            2.0 + lead(28.8) - lead(12.8),
            1e-9,
        ),
        // The part beyond the edge has no chief ray: its mean range exceeds the wall's nearest range by a few
        // micrometers.
        (scene_text!("last-echo"), 5.0, 2e-4),
        (scene_text!("phase-ambiguity"), 6.0 - phase::ambiguity(3e7), 1e-9),
    ] {
        let found = reading(name, text);
        assert!(
            (found - expected).abs() < tolerance,
            "{name}: {found} against {expected}"
        );
    }
}

#[test]
fn the_scenes_of_two_surfaces_give_the_stated_results() {
    let (name, text) = scene_text!("two-echoes");
    let (laboratory, stretch) = recorded(name, text);
    let sheet = laboratory.session().expect("known").scanner;
    assert_eq!(
        (sheet.preset.as_str(), sheet.range_min_m, sheet.range_max_m),
        ("utm-30lx-ew", 0.1, 30.0)
    );
    assert!((stretch.ranges[ust20lx::FORWARD] - 2.0).abs() < 1e-9);
    let echoes = &stretch.echoes.as_ref().expect("they are recorded")[ust20lx::FORWARD];
    assert!(
        echoes.len() == 2 && (echoes[0] - 2.0).abs() < 1e-9 && (echoes[1] - 5.0).abs() < 2e-4,
        "{echoes:?}"
    );
    // The edge is 1 mm from the center of the beam; the share of the board is Φ of that over the spot's standard
    // deviation.
    let covered = |distance: f64| {
        let spread = 0.5 * distance * libm::tan(8e-3);
        0.5 * libm::erfc(-1e-3 / spread / std::f64::consts::SQRT_2)
    };
    let (name, text) = scene_text!("merged-echo");
    let found = reading(name, text);
    let (near, far) = (covered(4.7) / 4.7_f64.powi(2), (1.0 - covered(4.7)) / 25.0);
    let expected = (near * 4.7 + far * 5.0) / (near + far);
    // With a thousand rays the edge is located to a few parts in a thousand of 0.3 m.
    assert!(
        (found - expected).abs() < 0.005,
        "{name}: {found} against {expected}"
    );
    let (name, text) = scene_text!("phase-mixed-pixel");
    let found = reading(name, text);
    let ambiguity = phase::ambiguity(46.55e6);
    let turn = std::f64::consts::TAU * 2.2 / ambiguity;
    let (near, far) = (covered(1.0), (1.0 - covered(1.0)) / 3.2_f64.powi(2));
    let turned = libm::atan2(far * libm::sin(turn), near + far * libm::cos(turn));
    let expected = 1.0 + ambiguity * turned / std::f64::consts::TAU;
    assert!(
        found < 1.0 - 0.01 && (found - expected).abs() < 0.005,
        "{name}: {found} against {expected}"
    );
}

#[test]
fn the_scenes_of_random_effects_and_limits_give_the_stated_results() {
    let (name, text) = scene_text!("faint-board");
    let (_, stretch) = recorded(name, text);
    let readings = stretch
        .ranges
        .iter()
        .skip(ust20lx::FORWARD)
        .step_by(ust20lx::COUNT);
    let (mut seen, mut missed) = (0.0, 0.0);
    for reading in readings {
        if reading.is_finite() {
            assert_eq!(*reading, 4.0);
            seen += 1.0;
        } else {
            assert_eq!(*reading, f64::INFINITY);
            missed += 1.0;
        }
    }
    let (n, expected) = (seen + missed, 0.5 * libm::erfc(-1.0 / std::f64::consts::SQRT_2));
    let bound = 3.2905 * (expected * (1.0 - expected) / n).sqrt();
    assert!((seen / n - expected).abs() < bound, "{name}: {} of {n}", seen);

    let (name, text) = scene_text!("custom-scanner");
    let (laboratory, stretch) = recorded(name, text);
    assert!((stretch.ranges[ust20lx::FORWARD] - 2.0).abs() < 1e-12);
    assert_eq!(
        stretch.ranges[ust20lx::FORWARD + 13],
        f64::INFINITY,
        "the far wall"
    );
    assert_eq!(
        stretch.ranges[ust20lx::FORWARD + 360],
        f64::NEG_INFINITY,
        "the near one"
    );
    let sheet = laboratory.session().expect("known").scanner;
    assert_eq!((stretch.scan_period_s, sheet.scan.scan_rate_hz()), (0.1, 10.0));
    assert_eq!((sheet.range_min_m, sheet.range_max_m), (0.5, 4.0));

    let (name, text) = scene_text!("warm-up");
    let (laboratory, stretch) = recorded(name, text);
    for (scan, ranges) in stretch.ranges.chunks(ust20lx::COUNT).enumerate() {
        let expected = 2.0 + 8e-3 * libm::exp(-(10.05 + scan as f64 / 40.0) / 100.0);
        assert!(
            (ranges[ust20lx::FORWARD] - expected).abs() < 1e-12,
            "{name}, scan {scan}"
        );
    }
    let truth = laboratory.truth().expect("known").poses[2]
        .warm_up_m
        .expect("it is recorded");
    assert!((truth[1] - 8e-3 * libm::exp(-(10.05 + 199.0 / 40.0) / 100.0)).abs() < 1e-15);
}

#[test]
fn contradictory_settings_are_refused() {
    let (name, text) = scene_text!("walk-of-grey");
    for (sets, key) in [
        (
            vec!["detection.principle=phase", "detection.detector=centroid"],
            "detection.detector",
        ),
        (
            vec!["detection.principle=phase", "detection.echo=last"],
            "detection.echo",
        ),
        (
            vec!["detection.saturation_over_threshold=0.5"],
            "detection.saturation_over_threshold",
        ),
        (
            vec!["detection.noise_over_threshold=0.5"],
            "detection.noise_over_threshold",
        ),
        (vec!["detection.fraction=1"], "detection.fraction"),
        (vec!["detection.echo=all"], "detection.echo"),
        (vec!["scanner.preset=custom"], "scanner.preset"),
        (vec!["scanner.custom.range_max_m=5"], "scanner.custom"),
    ] {
        let sets: Vec<String> = sets.into_iter().map(str::to_owned).collect();
        let error = scene_file::parse(text, name, &sets).expect_err(key).to_string();
        assert!(error.contains(key), "{sets:?}: {error}");
    }
    let table = |nodes: &str| {
        let text = text.replace("[errors]", &format!("[errors.angle]\ngain_mm = 0\noffset_mm = 0\ntable = {{ incidence_deg = {nodes}, error_mm = [1, 2] }}\n\n[errors]"));
        scene_file::parse(&text, name, &[])
    };
    assert_eq!(table("[0, 40]").expect("good").errors.angle.error(1.0), 1e-3);
    for nodes in ["[40, 0]", "[0]", "[0, 95]"] {
        let error = table(nodes).expect_err(nodes).to_string();
        assert!(error.contains("errors.angle.table"), "{error}");
    }
}

#[test]
fn the_truth_adds_up_to_every_reading() {
    let (folder, _) = folder_with(scene_text!("faint-board").1);
    let mut arguments = vec![
        "simulate",
        "scene.toml",
        "--out",
        "set",
        "--returns",
        "--readings",
    ];
    for set in [
        "experiment.scans_per_pose=3",
        "errors.model=both",
        "errors.quantization_mm=0",
        "errors.dropout=0.1",
        "errors.warm_up={amplitude_mm=5,time_constant_s=20}",
        "errors.correlated={sd_mm=2,time_constant_s=0.1}",
        "errors.interference={step_mm=40,probability=0.1}",
    ] {
        arguments.extend(["--set", set]);
    }
    let output = run(folder.path(), &arguments);
    assert!(output.status.success(), "{}", stderr(&output));
    let table = |name: &str| -> Vec<Vec<String>> {
        let text = std::fs::read_to_string(folder.path().join("set/truth").join(name)).unwrap();
        let rows = text.lines().skip(1);
        rows.map(|row| row.split(',').map(str::to_owned).collect())
            .collect()
    };
    let number = |field: &String| field.parse::<f64>().unwrap();
    let key = |pose: &str, beam: &str, echo: &str| format!("{pose},{beam},{echo}");
    let ranges: BTreeMap<String, f64> = table("returns.csv")
        .iter()
        .map(|row| {
            let sum = [4, 8, 9, 10, 11, 12].iter().map(|k| number(&row[*k])).sum();
            (key(&row[0], &row[1], &row[14]), sum)
        })
        .collect();
    let (mut ranged, mut lost, mut missed) = (0, 0, 0);
    for row in table("readings.csv") {
        let reading = number(&row[10]);
        if row[3].is_empty() {
            assert_eq!(reading, f64::INFINITY);
            missed += 1;
        } else if row[4] == "1" {
            assert!(reading.is_nan());
            lost += 1;
        } else {
            let expected =
                ranges[&key(&row[0], &row[2], &row[3])] + row[5..10].iter().map(number).sum::<f64>();
            assert!((reading - expected).abs() < 1e-12, "{row:?} against {expected}");
            ranged += 1;
        }
    }
    assert!(
        ranged > 4000 && lost > 300 && missed > 10,
        "{ranged}, {lost}, {missed}"
    );
}

/// The figures in the guide's chapter on Table 3, in millimeters: growth of the error from 0.9° to 18.5° and to 44.7°.
#[test]
fn the_guide_states_the_simulated_figures_of_table_3() {
    let guide = include_str!("../../docs/guide/6-physics-of-table-3.md");
    let mut missing = false;
    for (preset, spot) in [(Preset::Ust20lx, "manual"), (Preset::Ust20lxCooper, "Table 1")] {
        for detector in Detector::ALL {
            let mut row = format!("| {} | {spot} |", name_of(detector));
            for distance in [0.5, 1.0, 2.0, 4.0] {
                let mut scene = physical();
                scene.scanner.preset = preset;
                scene.scanner.beam = None;
                scene.scanner.sub_rays = 61;
                scene.detection.detector = detector;
                let error = |tilt_deg: f64| {
                    let found = forward(&scene, &[filling(distance, tilt_deg, "white")]);
                    1e3 * (found.expect("it is bright").range() - distance)
                };
                let upright = error(0.9);
                row += &format!(" {:+.1} / {:+.1} |", error(18.5) - upright, error(44.7) - upright);
            }
            let row = row.replace("-0.0", "+0.0");
            eprintln!("{row}");
            missing |= !guide.contains(&row);
        }
    }
    assert!(!missing, "the guide must contain the rows printed above");
}

/// Its word in files, as people write it.
fn name_of(detector: Detector) -> String {
    let word = serde_json::to_value(detector).expect("a word");
    word.as_str().expect("a word").replace('_', " ")
}
