//! Data taken from Cooper, Raquet, Patton (2018): its tables, and the layout of Figure 5.
//!
//! The error tables are reproduced by construction; these tests prove that nothing distorts them in between, and that the
//! constants taken from the tables equal those of the tables. They do not prove that the sensor is like that.

use crate::scenes::{BARE, PROTOTYPE, scene, set_board_ahead};
use catoptric::model::PoseKind;
use catoptric::sim::scene::{ErrorModel, Errors, Preset};
use catoptric::sim::{Laboratory, build::Structure};
use catoptric_fixtures::ust20lx;

/// Table 2: mean errors of three trials and their standard deviations, in meters.
const TABLE_2: [(f64, [f64; 3], [f64; 3]); 3] = [
    (0.5, [-0.0017, -0.0032, -0.0036], [0.0041, 0.0041, 0.0042]),
    (2.0, [0.0070, 0.0058, 0.0054], [0.0038, 0.0039, 0.0039]),
    (4.0, [0.0008, -0.0004, -0.0007], [0.0047, 0.0046, 0.0046]),
];

/// Table 3: angle between board and beam in degrees, and mean errors of three trials, in meters.
const TABLE_3: [(f64, [f64; 3]); 3] = [
    (0.9, [0.0099, 0.0088, 0.0090]),
    (18.5, [0.0271, 0.0274, 0.0277]),
    (-44.7, [0.0354, 0.0357, 0.0330]),
];

/// Table 1: distance, height and width of the spot of three neighboring beams, in meters and millimeters.
const TABLE_1: [(f64, f64, f64); 5] = [
    (0.5, 3.2, 15.9),
    (1.0, 4.0, 33.3),
    (2.0, 4.8, 55.6),
    (3.0, 5.6, 98.4),
    (4.0, 6.3, 136.5),
];

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Slope and offset of the least-squares line through points.
fn line(points: &[(f64, f64)]) -> (f64, f64) {
    let n = points.len() as f64;
    let (x, y) = (
        points.iter().map(|p| p.0).sum::<f64>() / n,
        points.iter().map(|p| p.1).sum::<f64>() / n,
    );
    let slope = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>()
        / points.iter().map(|p| (p.0 - x) * (p.0 - x)).sum::<f64>();
    (slope, y - slope * x)
}

#[test]
fn the_defaults_are_the_tables_means() {
    let errors = Errors::default();
    for (index, (range, means, sds)) in TABLE_2.iter().enumerate() {
        assert_eq!(errors.distance.range_m[index], *range);
        assert_eq!(errors.noise.range_m[index], *range);
        // The defaults are rounded to a tenth of a millimeter.
        assert!(
            (errors.distance.error_mm[index] - 1e3 * mean(means)).abs() <= 0.05 + 1e-9,
            "{range} m"
        );
        assert!(
            (errors.noise.sd_mm[index] - 1e3 * mean(sds)).abs() <= 0.05 + 1e-9,
            "{range} m"
        );
    }
    let scatter = TABLE_2
        .iter()
        .flat_map(|(_, means, _)| means.map(|m| (m - mean(means)).powi(2)));
    let pooled = (scatter.sum::<f64>() / 6.0).sqrt() * 1e3;
    assert!(
        (errors.drift_sd_mm - pooled).abs() < 0.005,
        "pooled trial scatter {pooled} mm"
    );
}

#[test]
fn equation_4_is_the_line_through_table_3() {
    let points = TABLE_3.map(|(angle, means)| (angle.to_radians().cos(), 1e3 * mean(&means)));
    let (gain, offset) = line(&points);
    let angle = Errors::default().angle;
    assert!((angle.gain_mm - gain).abs() < 0.05, "A_a = {gain} mm");
    // The offset is part of E_r: it is zero at normal incidence, where the table alone has B_a = +86.1 mm.
    assert_eq!(angle.offset_mm, -angle.gain_mm);
    assert!((offset - 86.1).abs() < 0.05, "B_a = {offset} mm");
    // The law deviates from its own table, as documented.
    let worst = points
        .iter()
        .map(|(cos, error)| (gain * cos + offset - error).abs())
        .fold(0.0, f64::max);
    assert!((worst - 8.0).abs() < 0.05, "{worst} mm");
}

#[test]
fn the_cooper_preset_is_table_1_read_as_three_beams() {
    let shape = Preset::Ust20lxCooper.beam_shape();
    let step_mrad = 1e3 * ust20lx::STEP;
    let but_2_m = TABLE_1.iter().filter(|(r, ..)| *r != 2.0);
    let (products, squares) = but_2_m.fold((0.0, 0.0), |(p, s), (r, _, w)| (p + r * w, s + r * r));
    let width = products / squares;
    let (height, height_at_0) = line(&TABLE_1.map(|(r, h, _)| (r, h)));
    assert!(
        (shape.wide_full_mrad + 2.0 * step_mrad - width).abs() < 0.1,
        "width grows by {width} mrad"
    );
    assert!(
        (shape.narrow_full_mrad - height).abs() < 0.02,
        "height grows by {height} mrad"
    );
    assert!(
        (shape.narrow_aperture_mm - height_at_0).abs() < 0.02,
        "from {height_at_0} mm"
    );
}

#[test]
fn no_straight_beam_has_all_of_table_1() {
    // Within 5 % or 1 mm of every width: at 1, 2 and 3 m that would require a beam whose width is not linear in distance.
    let allowed = |index: usize| {
        let (_, _, width) = TABLE_1[index];
        let slack = f64::max(1.0, 0.05 * width);
        (width - slack, width + slack)
    };
    let (at_1, at_2, at_3) = (allowed(1), allowed(2), allowed(3));
    // Halfway between two distances a straight edge has the mean of both; even the smallest allowed values are too
    // large.
    assert!(
        0.5 * (at_1.0 + at_3.0) > at_2.1 + 4.0,
        "{at_1:?} {at_2:?} {at_3:?}"
    );
}

#[test]
fn a_white_board_reads_as_in_table_2() {
    let scans = 4000_u32;
    for (range, means, sds) in TABLE_2 {
        let mut scene = scene(BARE);
        scene.errors = Errors {
            drift_sd_mm: 0.0,
            quantization_mm: 0.0,
            ..Errors::default()
        };
        assert_eq!(scene.errors.model, ErrorModel::Empirical);
        set_board_ahead(&mut scene, range);
        scene.experiment.scans_per_pose = scans;
        let laboratory = Laboratory::new(&scene, 2).expect("the scene is valid");
        let record = laboratory
            .stretch(2)
            .expect("recorded")
            .into_record()
            .expect("tracked");
        assert_eq!(record.label.kind, PoseKind::Direct);
        let found = record.summarize()[ust20lx::FORWARD];
        // 3.2905 standard errors: 99.9 % of seeds. The defaults are rounded to 0.05 mm of the table.
        let (sd, n) = (mean(&sds), f64::from(scans));
        assert!(
            (found.mean - range - mean(&means)).abs() < 3.2905 * sd / n.sqrt() + 0.05e-3,
            "at {range} m"
        );
        assert!(
            (found.sd / sd - 1.0).abs() < 3.2905 / (2.0 * n).sqrt() + 0.05e-3 / sd,
            "at {range} m"
        );
    }
}

#[test]
fn the_prototype_is_figure_5_as_far_as_it_is_known() {
    let scene = scene(PROTOTYPE);
    let structure = Structure::nominal(&scene).expect("the facets are mirrors");
    assert_eq!(structure.facets.len(), 8);
    let truth = {
        let mut as_drawn = scene.clone();
        as_drawn.superstructure.as_built.tilt_sd_deg = 0.0;
        as_drawn.superstructure.as_built.shift_sd_mm = 0.0;
        as_drawn.superstructure.as_built.slope_rms_mrad = 0.0;
        as_drawn.scanner.mount.yaw_tolerance_deg = 0.0;
        as_drawn.scanner.mount.tilt_tolerance_deg = 0.0;
        as_drawn.scanner.mount.shift_tolerance_mm = 0.0;
        Laboratory::new(&as_drawn, 1)
            .expect("the scene is valid")
            .truth()
            .expect("known")
    };
    let azimuth = |b: usize| ust20lx::azimuth(b).to_degrees();
    // The forward ±60° are free; every facet serves about 15° between 62° and 128°.
    for b in &truth.beams {
        assert!(
            azimuth(b.beam).abs() > 60.0 || b.facets.is_empty(),
            "beam {}",
            b.beam
        );
    }
    for (side, names) in [(1.0, "left"), (-1.0, "right")] {
        let mut before: Option<f64> = None;
        for number in 1..=4 {
            let name = format!("{names}-{number}");
            let served: Vec<_> = truth
                .beams
                .iter()
                .filter(|b| b.facets == [name.clone()])
                .collect();
            let (first, last) = (azimuth(served[0].beam), azimuth(served[served.len() - 1].beam));
            assert!(
                (13.0..=15.1).contains(&(last - first)),
                "{name} serves {} degrees",
                last - first
            );
            assert!(
                62.0 <= first.abs().min(last.abs()) && first.abs().max(last.abs()) <= 128.0,
                "{name}"
            );
            assert!(first * side > 0.0);
            let middle = served[served.len() / 2];
            let distance = middle.distance_m.expect("it is deflected");
            assert!((0.060..=0.085).contains(&distance), "{name} at {distance} m");
            let elevation = middle.elevation_rad.expect("it leaves").to_degrees();
            assert!(
                (40.0..=70.0).contains(&elevation.abs()),
                "{name} sends its beams to {elevation} degrees"
            );
            assert!(
                before.is_none_or(|b| b * elevation < 0.0),
                "{name} alternates with its neighbor"
            );
            before = Some(elevation);
        }
    }
}
