//! Properties that must hold for any input: every closed form on random cases that are the same in every run.
//!
//! Each tolerance is a small multiple of the rounding of 64-bit floats at the magnitudes involved, unless the test says
//! otherwise. A property does not prove a value: values are proven where the closed forms are tested individually.

mod files;
mod geometry;
mod light;
mod receiver;
mod waveform;

use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// Random cases, the same in every run: a failure is due to a change of the code.
fn cases(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(1946),
        ..ProptestConfig::default()
    }
}

/// A number within ±1.
fn unit() -> std::ops::Range<f64> {
    -1.0..1.0
}

/// A vector whose coordinates are within ±1.
fn vector() -> impl Strategy<Value = nalgebra::Vector3<f64>> {
    [unit(), unit(), unit()].prop_map(nalgebra::Vector3::from)
}

/// A direction: not uniform on the sphere, but every direction is possible.
fn direction() -> impl Strategy<Value = nalgebra::Unit<nalgebra::Vector3<f64>>> {
    vector().prop_filter_map("a vector of no length", |v| nalgebra::Unit::try_new(v, 0.1))
}
