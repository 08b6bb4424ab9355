//! How long each stage of the main job takes: tracing a pose, drawing its scans, calibrating.
//!
//! Compare two versions with criterion's `--save-baseline` and `--baseline`; absolute times depend on the machine.
#![allow(missing_docs, clippy::unwrap_used)]

use catoptric::calib::{self, Method, Options};
use catoptric::model::beam;
use catoptric::sim::{Laboratory, Scene};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

fn prototype() -> Scene {
    toml::from_str(include_str!("../scenes/prototype.toml")).unwrap()
}

/// Number of the first stretch with a board before a facet.
const FACET_STRETCH: usize = 11;

fn simulate(c: &mut Criterion) {
    let laboratory = Laboratory::new(&prototype(), 1).unwrap();
    let mut group = c.benchmark_group("simulate");
    let sub_rays = (beam::COUNT * laboratory.sub_rays()) as u64;
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

fn calibrate(c: &mut Criterion) {
    let dataset = Laboratory::new(&prototype(), 1).unwrap().dataset().unwrap();
    let mut group = c.benchmark_group("calibrate");
    group
        .sample_size(10)
        .throughput(Throughput::Elements(beam::COUNT as u64));
    for method in Method::ALL {
        group.bench_function(method.name(), |b| {
            b.iter(|| calib::calibrate(&dataset, method, &Options::default()).unwrap());
        });
    }
    group.finish();
}

criterion_group!(stages, simulate, calibrate);
criterion_main!(stages);
