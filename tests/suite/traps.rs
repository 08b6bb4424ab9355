//! The hard scenes of `scenes/traps/`: each file states the expected result in its first comment, and is tested for it
//! here.
//!
//! Proven is that none of these mistakes is made in its own scene; that they are made nowhere else is covered by the
//! properties and the physics.

use crate::common::{run, stderr};
use catoptric::cast::Ray;
use catoptric::files::scene;
use catoptric::model::beam;
use catoptric::sim::light::Role;
use catoptric::sim::light::footprint::{SubRay, sub_rays};
use catoptric::sim::receive::{Return, Stop};
use catoptric::sim::scene::{BeamShape, Limits, Preset};
use catoptric::sim::trace::{Fate, Scenery, Vertex};
use catoptric::sim::truth::BeamClass;
use catoptric::sim::{Laboratory, Scene};
use catoptric_fixtures::ust20lx;
use nalgebra::{Point3, Unit, Vector3};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

pub(crate) fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/traps/{name}.toml"))
}

pub(crate) fn trap(name: &str) -> Scene {
    scene::load(&file(name), &[]).unwrap_or_else(|e| panic!("{name}: {e}"))
}

pub(crate) fn ray(origin: [f64; 3], direction: [f64; 3]) -> Ray {
    Ray {
        origin: Point3::from(origin),
        direction: Unit::new_normalize(Vector3::from(direction)),
    }
}

/// The path of a ray, the names of what it hits, and how it ends.
pub(crate) fn traced_path(scene: &Scene, ray: &Ray) -> (Vec<Vertex>, Vec<String>, Fate) {
    let scenery = Scenery::new(scene).unwrap();
    let tracer = scenery.tracer(1000).unwrap();
    let mut vertices = Vec::new();
    let fate = tracer.follow(ray, &mut vertices);
    let names = tracer.surfaces();
    let met = vertices.iter().map(|v| names[v.surface].to_owned()).collect();
    (vertices, met, fate)
}

pub(crate) fn path(vertices: &[Vertex]) -> f64 {
    vertices.last().unwrap().path
}

pub(crate) fn forward(scene: &Scene) -> Return {
    // The second stretch is the empty room.
    let returns = Laboratory::new(scene, 1).unwrap().returns(1).unwrap();
    returns[ust20lx::FORWARD].clone().expect("it is bright")
}

#[test]
fn every_trap_states_what_it_shows_and_is_a_valid_scene() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/traps");
    let mut count = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(
            text.starts_with("# ") && text.contains("Exact answer"),
            "{}",
            path.display()
        );
        scene::load(&path, &[]).unwrap_or_else(|e| panic!("{e}"));
        count += 1;
    }
    assert_eq!(count, 18);
}

#[test]
fn mirror_and_wall() {
    let (vertices, met, fate) = traced_path(&trap("mirror-and-wall"), &ray([0.0; 3], [1.0, 0.0, 0.0]));
    assert_eq!(
        (met, fate),
        (vec!["fold".to_owned(), "wall".to_owned()], Fate::Hit)
    );
    assert!((path(&vertices) - 3.75).abs() < 1e-15);
}

#[test]
fn ridge() {
    let scene = trap("ridge");
    let laboratory = Laboratory::new(&scene, 1).unwrap();
    let truth = laboratory.truth().unwrap();
    assert_eq!(truth.beams[ust20lx::FORWARD].status, BeamClass::Split);
    let found = forward(&scene);
    assert_eq!(found.role, Role::Wall);
    // Rays that hit the ridge itself may be reflected to either side.
    let on_ridge = |r: &&SubRay| r.wide.abs() < 1e-9;
    let undecided: f64 = sub_rays(256).iter().filter(on_ridge).map(|r| r.weight).sum();
    assert!(
        undecided < 0.1 && (found.share - 0.5).abs() <= 0.5 * undecided + 1e-12,
        "{found:?}"
    );
    for y in [-0.04, -1e-9, 1e-9, 0.03] {
        // In the room the rig is 2 m up.
        let (vertices, met, _) = traced_path(&scene, &ray([0.0, y, 2.0], [1.0, 0.0, 0.0]));
        let expected = if y > 0.0 {
            ["left", "+y wall"]
        } else {
            ["right", "-y wall"]
        };
        assert_eq!(met, expected);
        assert!((path(&vertices) - 2.5).abs() < 1e-14);
    }
}

#[test]
fn facet_edge() {
    let scene = trap("facet-edge");
    for (y, end, length) in [
        (0.1 - 1e-9, "behind", 3.0),
        (0.1 + 1e-9, "ahead", 3.0),
        (-0.1 + 1e-9, "behind", 3.0),
        (-0.1 - 1e-9, "ahead", 3.0),
    ] {
        let (vertices, met, _) = traced_path(&scene, &ray([0.0, y, 0.0], [1.0, 0.0, 0.0]));
        assert_eq!(met.last().unwrap(), end);
        assert!((path(&vertices) - length).abs() < 1e-15);
    }
}

#[test]
fn nearest_first() {
    let mut scene = trap("nearest-first");
    let ahead = ray([0.0; 3], [1.0, 0.0, 0.0]);
    for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        let listed = trap("nearest-first").room.mirror;
        scene.room.mirror = order.map(|i: usize| listed[i].clone()).to_vec();
        let (vertices, met, _) = traced_path(&scene, &ahead);
        assert_eq!(met, ["first", "left"]);
        assert!((path(&vertices) - 2.0).abs() < 1e-15);
    }
}

#[test]
fn no_offset() {
    let (vertices, met, fate) =
        traced_path(&trap("no-offset"), &ray([-0.0005, -0.0005, 0.0], [1.0, 1.0, 0.0]));
    assert_eq!((met.len(), fate), (201, Fate::Hit));
    assert!(met[..200].chunks(2).all(|pair| pair == ["upper", "lower"]));
    assert_eq!(met[200], "wall");
    assert!((path(&vertices) - 1.0005 * 2.0_f64.sqrt()).abs() < 1e-12);
}

#[test]
fn label() {
    let scene = trap("label");
    let found = forward(&scene);
    assert_eq!(
        (found.role, found.facets.as_slice()),
        (Role::Wall, [0].as_slice())
    );
    assert!((found.range() - 3.0).abs() < 1e-12, "{found:?}");
    // The mirror is at 45° and deflects the light straight up.
    let [on_mirror] = found.facet_cos_incidence[..] else {
        panic!("{found:?}")
    };
    assert!((on_mirror - 0.5_f64.sqrt()).abs() < 1e-12, "{on_mirror}");
    let (_, met, _) = traced_path(&scene, &ray([0.0, 0.0, 2.0], [1.0, 0.0, 0.0]));
    assert_eq!(met, ["lift", "ceiling"]);
}

#[test]
fn hole() {
    let found = forward(&trap("hole"));
    assert_eq!(found.role, Role::Object);
    assert!(found.share > 0.0 && found.share < 0.9, "{found:?}");
    assert!((found.range() - 3.0).abs() < 1e-3, "{found:?}");
}

#[test]
fn board_edge() {
    let found = forward(&trap("board-edge"));
    assert_eq!(found.role, Role::Object);
    assert!(found.share > 0.1 && found.share < 0.5, "{found:?}");
    assert!((found.range() - 2.0).abs() < 1e-3, "{found:?}");
}

#[test]
fn grazing() {
    let scene = trap("grazing");
    let (vertices, met, _) = traced_path(&scene, &ray([0.0, 0.0, 0.00005], [1.0, 0.0, -0.0001]));
    assert_eq!(met, ["floor", "wall"]);
    assert!((vertices[1].point.z - 0.00015).abs() < 1e-15);
    assert!((path(&vertices) - 2.0 * (1.0 + 1e-8_f64).sqrt()).abs() < 1e-12);
    let (_, met, _) = traced_path(&scene, &ray([0.0, 0.0, 1e-9], [1.0, 0.0, 1e-9]));
    assert_eq!(met, ["wall"]);
}

/// The laboratory of a trap, and the number of its stretch in the empty room.
fn laboratory(name: &str) -> Laboratory {
    Laboratory::new(&trap(name), 1).unwrap()
}
const ROOM: usize = 1;

#[test]
fn tied_distances() {
    let laboratory = laboratory("tied-distances");
    let ends = laboratory.sight(ROOM).unwrap().sub_ray_ends(0, ust20lx::FORWARD);
    assert_eq!(ends.len(), 256);
    let distances: BTreeSet<u64> = ends.iter().map(|e| e.path.to_bits()).collect();
    assert!(
        distances.len() < 200,
        "the trap is set: {} distances",
        distances.len()
    );
    assert!(ends.iter().all(|e| matches!(e.stop, Stop::Hit { .. })));
    // Eq. (1) with τ_o = 0.9, D_R = 20 mm, ρ_t = 0.9, P_t = 10 W, θ_R = π; face on, the cosine is 5 m over the path
    // length.
    let term =
        |w: f64, r: f64| 0.9 * 0.02 * 0.02 * 0.9 * 10.0 * w * (5.0 / r) / (r * r * std::f64::consts::PI);
    let expected: f64 = ends.iter().map(|e| term(e.sub_ray.weight, e.path)).sum();
    let found = forward(laboratory.scene());
    assert!((found.power / expected - 1.0).abs() < 1e-12 && (found.share - 1.0).abs() < 1e-12);
    assert_eq!(found.range(), 5.0);
}

#[test]
fn full_angle() {
    let found = forward(&trap("full-angle"));
    assert_eq!(found.role, Role::Object);
    // An edge is located to 0.3 % with 4096 rays, and there are two.
    let expected = libm::erf(std::f64::consts::SQRT_2);
    assert!((found.share - expected).abs() < 0.006, "{}", found.share);
}

#[test]
fn equal_noise() {
    let laboratory = laboratory("equal-noise");
    let noise = |number: usize| -> Vec<f64> {
        let returns = laboratory.returns(number).unwrap();
        let ranges = laboratory.record(number, &returns).ranges;
        let free = returns.iter().map(|r| r.as_ref().expect("a wall").range());
        let free: Vec<f64> = free.collect();
        ranges
            .iter()
            .zip(free.iter().cycle())
            .map(|(r, f)| (r - f) / 4e-3)
            .collect()
    };
    let (first, second) = (noise(ROOM), noise(ROOM + 1));
    let n = first.len();
    assert_eq!((n, second.len()), (200 * ust20lx::COUNT, 200 * ust20lx::COUNT));
    let all: BTreeSet<u64> = first.iter().chain(&second).map(|z| z.to_bits()).collect();
    assert_eq!(all.len(), 2 * n, "no noise value repeats");
    let correlation = |a: &[f64], b: &[f64]| {
        let sum: f64 = a.iter().zip(b).map(|(x, y)| x * y).sum();
        sum / a.len().min(b.len()) as f64
    };
    // 99.9 % for each; the seed is fixed.
    let bound = 3.2905 / ((n - ust20lx::COUNT) as f64).sqrt();
    assert!((correlation(&first, &first) - 1.0).abs() < bound * 2.0_f64.sqrt());
    assert!(
        correlation(&first, &first[1..]).abs() < bound,
        "neighboring beams"
    );
    assert!(
        correlation(&first, &first[ust20lx::COUNT..]).abs() < bound,
        "successive scans"
    );
    assert!(correlation(&first, &second).abs() < bound, "stretches");
}

#[test]
fn no_return() {
    let stretch = laboratory("no-return").stretch(ROOM).unwrap();
    let ahead =
        ust20lx::nearest(-8.0_f64.to_radians()).unwrap()..=ust20lx::nearest(8.0_f64.to_radians()).unwrap();
    let mut aside = Vec::new();
    for scan in stretch.ranges.chunks(ust20lx::COUNT) {
        assert!(scan[ahead.clone()].iter().all(|r| *r == f64::INFINITY));
        aside.push(scan[ust20lx::FORWARD + 360]);
    }
    // Noise is present: mean and spread over 200 scans, at 99.9 %.
    let n = aside.len() as f64;
    let mean = aside.iter().sum::<f64>() / n;
    let variance = aside.iter().map(|r| (r - mean) * (r - mean)).sum::<f64>() / (n - 1.0);
    assert!((mean - 3.0).abs() < 3.2905 * 0.04 / n.sqrt(), "{mean}");
    assert!(
        (variance.sqrt() / 0.04 - 1.0).abs() < 3.2905 / (2.0 * n).sqrt(),
        "{variance}"
    );
}

#[test]
fn both_outputs() {
    let stretch = laboratory("both-outputs").stretch(2).unwrap();
    let echoes = stretch.echoes.as_ref().expect("they are recorded");
    assert_eq!(echoes.len(), stretch.ranges.len());
    let (mut several, mut none) = (0, 0);
    for (range, echoes) in stretch.ranges.iter().zip(echoes) {
        if range.is_finite() {
            assert_eq!(echoes[0].to_bits(), range.to_bits());
            several += usize::from(echoes.len() > 1);
        } else {
            assert!(echoes.is_empty(), "{echoes:?} where the scan has {range}");
            none += 1;
        }
    }
    assert!(several > 10 && none > 500, "{several}, {none}");
}

#[test]
fn workers() {
    let folder = tempfile::tempdir().unwrap();
    let scene = file("workers");
    let record = |threads: &str| {
        let arguments = [
            "simulate",
            scene.to_str().unwrap(),
            "--out",
            threads,
            "--threads",
            threads,
        ];
        let tables = ["--returns", "--readings", "--sub-rays"];
        let output = run(folder.path(), &[&arguments[..], &tables].concat());
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        let read = |name: &str| std::fs::read(folder.path().join(threads).join(name)).unwrap();
        [
            "manifest.json",
            "session.toml",
            "observations.mcap",
            "truth/truth.json",
            "truth/returns.csv",
            "truth/readings.csv",
            "truth/sub_rays.csv",
        ]
        .map(read)
    };
    let one = record("1");
    assert!(one.iter().all(|bytes| !bytes.is_empty()));
    assert!(one == record("2") && one == record("7"));
}

#[test]
fn static_wall() {
    let ranges = laboratory("static-wall").stretch(ROOM).unwrap().ranges;
    assert_eq!(ranges.len(), 1000 * ust20lx::COUNT);
    for beam in 0..ust20lx::COUNT {
        let first = ranges[beam];
        let of_beam = ranges.iter().skip(beam).step_by(ust20lx::COUNT);
        let squares: f64 = of_beam.map(|r| (r - first) * (r - first)).sum();
        assert!(
            first.is_finite() && squares == 0.0,
            "beam {beam}: {first}, {squares}"
        );
    }
}

#[test]
fn flat_wall() {
    let ranges = laboratory("flat-wall").stretch(ROOM).unwrap().ranges;
    assert_eq!(ranges.len(), ust20lx::COUNT);
    for (index, range) in ranges.iter().enumerate() {
        let point = beam::direction(ust20lx::azimuth(index)).into_inner() * *range;
        let off = (point.x.abs() - 5.0).abs().min((point.y.abs() - 3.0).abs());
        assert!(off < 1e-9, "beam {index} is {off} m off");
    }
}

#[test]
fn same_direction() {
    let scene = trap("same-direction");
    let scenery = Scenery::new(&scene).unwrap();
    let tracer = scenery.tracer(8).unwrap();
    let (mut compared, mut folded) = (0, 0);
    let finite = Preset::ALL.into_iter().zip([19, 256, 61, 7].into_iter().cycle());
    for (preset, sub_rays) in finite.chain([(Preset::Ust20lx, 1)]) {
        let own = preset == Preset::Custom;
        let mut scene = scene.clone();
        scene.scanner.preset = preset;
        scene.scanner.sub_rays = sub_rays;
        scene.scanner.custom = own.then(|| Limits {
            range_min_m: 0.5,
            range_max_m: 4.0,
            ..Limits::default()
        });
        scene.scanner.beam = own.then_some(BeamShape {
            wide_full_mrad: 1.0,
            narrow_full_mrad: 1.0,
            wide_aperture_mm: 0.0,
            narrow_aperture_mm: 0.0,
            turns: false,
        });
        let scan = scene.scanner.scan().unwrap();
        let returns = Laboratory::new(&scene, 1).unwrap().returns(ROOM).unwrap();
        for (index, found) in returns.iter().enumerate() {
            let Some(found) = found.as_ref().filter(|r| (r.share - 1.0).abs() < 1e-12) else {
                continue;
            };
            let mut vertices = Vec::new();
            let direction = beam::direction(scan.azimuth(index));
            let origin = Point3::new(0.0, 0.0, 2.0);
            assert_eq!(
                tracer.follow(&Ray { origin, direction }, &mut vertices),
                Fate::Hit
            );
            let expected = path(&vertices);
            assert!(
                (found.range() - expected).abs() < 1e-12,
                "{preset:?}, beam {index}"
            );
            compared += 1;
            folded += usize::from(vertices.len() > 1);
        }
    }
    assert!(compared > 4000 && folded > 100, "{compared}, {folded}");
}
