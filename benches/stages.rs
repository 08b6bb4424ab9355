//! Duration of each stage of a run: compiling a rig, analyzing a layout, tracing, detecting, drawing noise, writing, fitting
//! an element, calibrating.
//!
//! Compare two versions with criterion's `--save-baseline` and `--baseline`; absolute times depend on the machine.
#![allow(missing_docs, clippy::unwrap_used)]

use catoptric::calib::observations::{BoardView, Observation};
use catoptric::calib::solve::{self, BareDistance, Element};
use catoptric::calib::{self, Method, Options};
use catoptric::files::RecordingWriter;
use catoptric::layout::{Detail, Layout, analyze};
use catoptric::model::{BoardPlane, Deflection, RawRange, range};
use catoptric::sim::build::Structure;
use catoptric::sim::light::{Mirrors, Setting};
use catoptric::sim::noise::{Columns, Purpose};
use catoptric::sim::receive::Sensor;
use catoptric::sim::receive::detect::{self, Pulse};
use catoptric::sim::scene::{FacetShape, PolygonShape};
use catoptric::sim::{Laboratory, Scene};
use catoptric_fixtures::ust20lx;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::{Unit, Vector3};
use std::hint::black_box;
use std::path::Path;

fn prototype() -> Scene {
    toml::from_str(include_str!("../scenes/prototype.toml")).unwrap()
}

/// Number of the first stretch with a board in front of a facet.
const FACET_STRETCH: usize = 11;

fn simulate(c: &mut Criterion) {
    let laboratory = Laboratory::new(&prototype(), 1).unwrap();
    let mut group = c.benchmark_group("simulate");
    let sub_rays = (ust20lx::COUNT * laboratory.sub_rays()) as u64;
    group.throughput(Throughput::Elements(sub_rays));
    group.bench_function("trace one pose, sub-rays", |b| {
        b.iter(|| laboratory.returns(FACET_STRETCH).unwrap())
    });
    let readings = laboratory.stretch(FACET_STRETCH).unwrap().ranges.len() as u64;
    group.throughput(Throughput::Elements(readings));
    group.bench_function("record one pose, readings", |b| {
        b.iter(|| laboratory.stretch(FACET_STRETCH).unwrap())
    });
    group.finish();
}

/// The part of all paths that is on the structure, computed once per laboratory.
fn compile(c: &mut Criterion) {
    let scene = prototype();
    let sensor = Sensor::new(&scene).unwrap();
    let structure = Structure::as_built(&scene, 1).unwrap();
    let bare = Setting::new(&scene, &structure, Mirrors::Attached, Vec::new()).unwrap();
    let mut group = c.benchmark_group("compile");
    group.throughput(Throughput::Elements((ust20lx::COUNT * sensor.sub_rays()) as u64));
    group.bench_function("rig of the prototype, sub-rays", |b| {
        b.iter(|| sensor.compile(&bare))
    });
    group.finish();
}

/// A layout as a whole, and after one facet was moved slightly.
fn layout(c: &mut Criterion) {
    let scene = prototype();
    let mut moved = scene.clone();
    let facet = &mut moved.superstructure.facet[3];
    let corners = facet.shape.corners(&Default::default()).unwrap();
    let corners_mm = corners
        .iter()
        .map(|c| [c.x * 1e3 + 0.3, c.y * 1e3 - 0.2, c.z * 1e3]);
    facet.shape = FacetShape::Polygon(PolygonShape {
        corners_mm: corners_mm.collect(),
    });
    let mut group = c.benchmark_group("layout");
    for (name, detail) in [("full", Detail::Full), ("coarse", Detail::Coarse)] {
        let known = Layout::new(&scene, None, detail).unwrap();
        group.bench_function(format!("{name}, as a whole"), |b| {
            b.iter(|| analyze(&moved, None, detail).unwrap());
        });
        group.bench_function(format!("{name}, one facet edited"), |b| {
            b.iter(|| known.edited(&moved).unwrap().analysis().unwrap());
        });
        group.bench_function(format!("{name}, one facet edited, without its results"), |b| {
            b.iter(|| known.edited(&moved).unwrap());
        });
    }
    group.finish();
}

/// A scan in flight: every beam from a different pose, with nothing reused but the rig.
fn fly(c: &mut Criterion) {
    let mut scene = prototype();
    scene.flight.push(toml::from_str(FLIGHT).unwrap());
    let laboratory = Laboratory::new(&scene, 1).unwrap();
    let sight = laboratory.sight(laboratory.stretches() - 1).unwrap();
    let mut group = c.benchmark_group("fly");
    group.throughput(Throughput::Elements(
        (ust20lx::COUNT * laboratory.sub_rays()) as u64,
    ));
    group.bench_function("trace and detect a scan, sub-rays", |b| {
        b.iter(|| sight.returns(20))
    });
    group.finish();
}

const FLIGHT: &str = r#"
name = "bench"
waypoint = [
    { time_s = 0, position_m = [0, 0, 1.6] },
    { time_s = 1, position_m = [0.5, 0.3, 1.7], yaw_deg = 15, roll_deg = 5 },
]
"#;

/// A beam on one slanted plane, and beams cut by an edge.
fn detection(c: &mut Criterion) {
    let beam = |apart: f64| -> Vec<Pulse> {
        let range = |i: u32| 2.0 + 0.001 * f64::from(i) + if i > 9 { apart } else { 0.0 };
        (0..19)
            .map(|i| Pulse {
                range: range(i),
                power: 1.0,
            })
            .collect()
    };
    let mut group = c.benchmark_group("detect");
    group.throughput(Throughput::Elements(1));
    for (name, apart) in [
        ("one plane, beams", 0.0),
        ("mixed, beams", 0.2),
        ("two echoes, beams", 1.5),
    ] {
        let pulses = beam(apart);
        group.bench_function(name, |b| {
            b.iter(|| detect::leading_edge(black_box(&pulses), 0.25, 2.0))
        });
    }
    group.finish();
}

fn noise(c: &mut Criterion) {
    let mut columns = Columns::default();
    let mut normals = Vec::new();
    let mut group = c.benchmark_group("noise");
    group.throughput(Throughput::Elements(ust20lx::COUNT as u64));
    group.bench_function("normal deviates of a scan", |b| {
        b.iter(|| {
            columns.draw(ust20lx::COUNT, 1, Purpose::Reading, black_box(7));
            columns.normals(0, &mut normals);
        });
    });
    let laboratory = Laboratory::new(&prototype(), 1).unwrap();
    let returns = laboratory.returns(FACET_STRETCH).unwrap();
    let first_seen = laboratory.first_seen(FACET_STRETCH);
    let drawn = laboratory.draw(FACET_STRETCH, 0..64);
    group.throughput(Throughput::Elements(64 * ust20lx::COUNT as u64));
    group.bench_function("readings of 64 scans", |b| {
        b.iter(|| {
            let mut recorder = laboratory.excerpt_recorder(&drawn);
            for _ in drawn.scans() {
                recorder.add(&returns, false);
            }
            recorder.finish(&first_seen)
        });
    });
    group.finish();
}

/// To memory: encoding on one thread, compression of chunks on all.
fn write(c: &mut Criterion) {
    let laboratory = Laboratory::new(&prototype(), 1).unwrap();
    let session = laboratory.session().unwrap();
    let stretch = laboratory.stretch(FACET_STRETCH).unwrap();
    let mut group = c.benchmark_group("write");
    group.throughput(Throughput::Elements(stretch.ranges.len() as u64));
    group.bench_function("a stretch, readings", |b| {
        b.iter(|| {
            let mut writer = RecordingWriter::create(Vec::new(), Path::new("bench.mcap"), &session).unwrap();
            writer.write_stretch(&stretch).unwrap();
            writer.finish().unwrap()
        });
    });
    group.finish();
}

fn calibrate(c: &mut Criterion) {
    let dataset = Laboratory::new(&prototype(), 1).unwrap().dataset().unwrap();
    let mut group = c.benchmark_group("calibrate");
    group
        .sample_size(10)
        .throughput(Throughput::Elements(ust20lx::COUNT as u64));
    for method in Method::ALL {
        group.bench_function(method.name(), |b| {
            b.iter(|| calib::calibrate(&dataset, method, &Options::default()).unwrap());
        });
    }
    group.finish();
}

/// Both angles by the paper's method, from a start 0.05 rad away, with the believed biases.
fn fit(c: &mut Criterion) {
    let bias = Laboratory::new(&prototype(), 1)
        .unwrap()
        .session()
        .unwrap()
        .believed
        .bias;
    let truth = Deflection {
        azimuth: 0.1,
        elevation: 0.7,
        distance: 0.06,
    };
    let v = truth.exit_direction(0.3).into_inner();
    let boards: Vec<Observation> = (0..10).map(|i| board(&truth, &v, i)).collect();
    let element = Element {
        azimuth: 0.3,
        observations: &boards,
        distance: BareDistance {
            distance: truth.distance,
            thickness: 0.0,
        },
        bias: &bias,
    };
    let start = Deflection {
        azimuth: 0.15,
        elevation: 0.65,
        ..truth
    };
    let options = Options {
        step_tolerance_rad: 1e-9,
        ..Options::default()
    };
    let mut group = c.benchmark_group("fit");
    group.throughput(Throughput::Elements(1));
    group.bench_function("ten boards, elements", |b| {
        b.iter(|| solve::batch(black_box(&element), black_box(&start), &options).unwrap())
    });
    group.finish();
}

/// The i-th of ten boards around a ray, 0.5 m to 4 m away and tilted by up to 30°, with a range error of a few millimeters.
fn board(truth: &Deflection, v: &Vector3<f64>, i: u8) -> Observation<'static> {
    let turn = f64::from(i) * 2.4;
    let tilt = Vector3::new(turn.cos(), turn.sin(), (0.7 * turn).cos()) * 0.35;
    let origin = truth.deflection_point(0.3);
    let plane = BoardPlane::new(
        origin + v * (0.5 + 0.35 * f64::from(i)),
        Unit::new_normalize(tilt - v),
    );
    let off = 0.005 * (1.7 * turn).sin();
    Observation {
        board: BoardView {
            plane,
            markers: &[],
            color: "white",
            noise_sd: 5e-3,
            count: 100,
        },
        mean: RawRange(range::predict(truth, 0.3, &plane).unwrap() + off),
    }
}

criterion_group!(
    stages, compile, layout, simulate, fly, detection, noise, write, fit, calibrate
);
criterion_main!(stages);
