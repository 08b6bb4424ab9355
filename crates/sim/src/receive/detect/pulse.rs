//! Pulses and their sum: its height and its slope.

use crate::lanes::{LANES, exponential};

/// The light of one sub-ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pulse {
    /// Path length, in meters.
    pub range: f64,
    /// Peak power, in watts.
    pub power: f64,
}

/// How far before its peak a Gaussian pulse of height `peak` crosses the threshold, in units of its σ.
pub fn walk(peak: f64, threshold: f64) -> f64 {
    (2.0 * libm::log(peak / threshold)).max(0.0).sqrt()
}

/// Sum over the pulses, in order, of `term` of their distance, power and bell exp(−(x − r)²/2σ²).
#[inline(always)]
pub(super) fn sum(pulses: &[Pulse], sd: f64, at: f64, mut term: impl FnMut(f64, f64, f64) -> f64) -> f64 {
    let mut total = -0.0;
    for group in pulses.chunks(LANES) {
        let mut exponents = [0.0; LANES];
        for (exponent, pulse) in exponents.iter_mut().zip(group) {
            let x = (at - pulse.range) / sd;
            *exponent = -0.5 * x * x;
        }
        let (mut bells, mut rare) = ([0.0; LANES], false);
        for (bell, exponent) in bells.iter_mut().zip(exponents) {
            let (value, left) = exponential(exponent);
            *bell = value;
            rare |= left;
        }
        if rare {
            bells = exponents.map(libm::exp);
        }
        for (pulse, bell) in group.iter().zip(bells) {
            total += term(pulse.range - at, pulse.power, bell);
        }
    }
    total
}

/// Height of the echo at a range, in watts.
pub(crate) fn height(pulses: &[Pulse], sd: f64, at: f64) -> f64 {
    sum(pulses, sd, at, |_, power, bell| power * bell)
}

/// Slope of the echo, up to the positive factor 1/σ².
pub(crate) fn slope(pulses: &[Pulse], sd: f64, at: f64) -> f64 {
    sum(pulses, sd, at, |distance, power, bell| distance * power * bell)
}
