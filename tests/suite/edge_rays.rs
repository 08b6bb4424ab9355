//! Beams that edges divide, compared with random rays from the same beam: the same optics and detection, with nothing in
//! between that could miss an edge.

use catoptric::files::scene;
use catoptric::sim::laboratory::Laboratory;
use catoptric::sim::light::edges::{EdgeRays, REACH};
use catoptric::sim::light::footprint::SubRay;
use catoptric::sim::receive::BeamClass;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use std::path::Path;

/// What a beam reads by its own sub-rays, by random rays, and by each half of these.
#[derive(Debug)]
#[expect(dead_code, reason = "pose and beam are printed")]
struct Compared {
    pose: usize,
    beam: usize,
    own: Option<f64>,
    random: Option<f64>,
    halves: [Option<f64>; 2],
    looks_whole: bool,
}

impl Compared {
    /// Difference from the random rays, in millimeters, where their halves agree within one.
    fn error_mm(&self) -> Option<f64> {
        let [a, b] = self.halves;
        ((a? - b?).abs() < 1e-3).then_some(1e3 * (self.own? - self.random?).abs())
    }
}

/// A list of random rays from the Gaussian that ends at [`REACH`].
fn random_rays(count: usize, draws: &mut ChaCha8Rng) -> Vec<SubRay> {
    let mut rays = Vec::with_capacity(count);
    while rays.len() < count {
        // The standard deviation is half of the 1/e² half-axis.
        let [wide, narrow] = [0, 1].map(|_| {
            let z: f64 = StandardNormal.sample(draws);
            0.5 * z
        });
        if wide * wide + narrow * narrow <= REACH * REACH {
            let weight = 1.0 / count as f64;
            rays.push(SubRay { wide, narrow, weight });
        }
    }
    rays
}

/// Beams of the prototype that edges of its structure divide, drawn by a seed, each with a number of random rays.
fn compare(sets: &[&str], beams: usize, rays: usize, seed: u64) -> Vec<Compared> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/prototype.toml");
    let mut all = vec!["scanner.preset=ust-20lx-measured", "errors.model=physical"];
    all.extend(sets);
    let all: Vec<String> = all.into_iter().map(str::to_owned).collect();
    let scene = scene::load(&path, &all).unwrap();
    let laboratory = Laboratory::new(&scene, 1).unwrap();
    let truth = laboratory.truth().unwrap();
    let sensor = laboratory.sensor();
    let mut draws = ChaCha8Rng::seed_from_u64(seed);
    let mut compared = Vec::new();
    while compared.len() < beams {
        let pose = draws.random_range(0..laboratory.stretches());
        let beam = draws.random_range(0..sensor.scan().beams());
        let sight = laboratory.sight(pose).unwrap();
        let setting = sight.setting();
        if sensor.sub_rays_in(setting, beam).len() == sensor.sub_rays() {
            continue;
        }
        let read = |list: &[SubRay]| {
            let only = (0..=beam).map(|b| (b == beam).then(|| list.to_vec()));
            let lists: EdgeRays = only.collect();
            let setting = setting.seen_from(&catoptric::model::Pose::identity());
            let found = sensor.observe(&setting.with_edge_rays(Some(&lists)), beam)?;
            Some(found.range())
        };
        let random = random_rays(rays, &mut draws);
        let half = |part: &[SubRay]| {
            let doubled = |r: &SubRay| SubRay {
                weight: 2.0 * r.weight,
                ..*r
            };
            read(&part.iter().map(doubled).collect::<Vec<_>>())
        };
        let (first, second) = random.split_at(rays / 2);
        compared.push(Compared {
            pose,
            beam,
            own: sensor.observe(setting, beam).map(|found| found.range()),
            random: read(&random),
            halves: [half(first), half(second)],
            looks_whole: truth.beams[beam].status != BeamClass::Split,
        });
    }
    compared
}

/// Compares both detectors and returns for each the median and the largest error in millimeters.
///
/// Beams of which even random rays do not say within a millimeter what they read, since an echo is about as high as the
/// threshold, are left out, and so is nothing else.
#[expect(clippy::print_stdout, reason = "the evidence shows it")]
fn errors_mm(beams: usize, rays: usize) -> [(f64, f64); 2] {
    [&[][..], &["detection.detector=constant_fraction"]].map(|sets| {
        let compared = compare(sets, beams, rays, 1);
        let mut errors: Vec<f64> = compared.iter().filter_map(Compared::error_mm).collect();
        errors.sort_by(f64::total_cmp);
        let settled = |c: &&Compared| c.error_mm().is_some();
        let whole = compared.iter().filter(settled).filter(|c| c.looks_whole).count();
        let (median, worst) = (errors[errors.len() / 2], errors[errors.len() - 1]);
        println!(
            "{sets:?}: {} of {beams} beams, {whole} of which count as whole: median {median:.2} mm, worst {worst:.2} mm",
            errors.len()
        );
        for c in compared.iter().filter(|c| c.error_mm().is_none()) {
            println!("left out: {c:?}");
        }
        assert!(2 * errors.len() >= beams && whole > 0, "{} of {beams}, {whole} whole", errors.len());
        (median, worst)
    })
}

#[test]
fn divided_beams_read_what_random_rays_read() {
    for (median, worst) in errors_mm(24, 60_000) {
        assert!(median < 0.5 && worst < 2.0, "{median}, {worst}");
    }
}

/// Two minutes: run by `.ci/long edges`.
#[test]
#[ignore = "a million rays for each of 40 beams and both detectors"]
fn divided_beams_read_what_a_million_random_rays_read() {
    for (median, worst) in errors_mm(40, 1_000_000) {
        assert!(median <= 0.5 && worst <= 5.0, "{median}, {worst}");
    }
}
