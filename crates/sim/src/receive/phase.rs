//! Ranging by the phase of amplitude-modulated light (AMCW): one phasor for everything that a beam hits.
//!
//! Light of modulation frequency f that has made the round trip over r is delayed by the phase 4πf·r/c. The receiver
//! sees the sum Σ Pᵢ·exp(j·4πf·rᵢ/c) and takes its argument for one range: it repeats every c/2f, and where two
//! surfaces are more than c/4f apart the sum of their phasors can point outside the two (Godbaz, Cree & Dorrington
//! 2012).

use crate::receive::detect::{Pulse, SPEED_OF_LIGHT};

/// The sum of the phasors of some returns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Phasor {
    /// Its range, in meters, from 0 to the ambiguity.
    pub range: f64,
    /// Its length, in watts.
    pub amplitude: f64,
}

/// The distance after which ranges repeat, in meters: c/2f.
pub fn ambiguity(modulation_hz: f64) -> f64 {
    0.5 * SPEED_OF_LIGHT / modulation_hz
}

/// A range as the phase shows it: minus whole multiples of the ambiguity.
pub fn fold(range: f64, ambiguity: f64) -> f64 {
    range - ambiguity * (range / ambiguity).floor()
}

/// The difference of two ranges as phases show it: within half an ambiguity of 0.
pub fn wrap(difference: f64, ambiguity: f64) -> f64 {
    difference - ambiguity * (difference / ambiguity).round()
}

/// The sum of the returns' phasors; `None` without light.
pub fn sum(pulses: &[Pulse], ambiguity: f64) -> Option<Phasor> {
    // Phases are relative to the strongest return, so that a single one keeps its range bit for bit.
    let strongest = pulses.iter().max_by(|a, b| a.power.total_cmp(&b.power))?;
    let (mut real, mut imaginary) = (0.0, 0.0);
    for pulse in pulses {
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * (pulse.range - strongest.range) / ambiguity);
        real += pulse.power * cos;
        imaginary += pulse.power * sin;
    }
    let turns = libm::atan2(imaginary, real) / std::f64::consts::TAU;
    Some(Phasor {
        range: fold(strongest.range + ambiguity * turns, ambiguity),
        amplitude: libm::hypot(real, imaginary),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_surfaces_can_read_outside_both() {
        // 0.7 of the ambiguity apart, 4 to 1: the phasors are 252° apart, their sum at atan2(−0.951, 3.691) from the
        // stronger one, before it.
        let at = |range: f64, power: f64| Pulse { range, power };
        let found = sum(&[at(1.0, 4.0), at(1.7, 1.0)], 1.0).expect("light");
        let turn = 0.7 * std::f64::consts::TAU;
        let (x, y) = (4.0 + libm::cos(turn), libm::sin(turn));
        let expected = fold(1.0 + libm::atan2(y, x) / std::f64::consts::TAU, 1.0);
        assert!((found.range - expected).abs() < 1e-15 && expected > 0.95 && expected < 1.0);
        assert!((found.amplitude - libm::hypot(x, y)).abs() < 1e-15);
        // Half an ambiguity apart and equally bright they cancel.
        let dark = sum(&[at(0.2, 1.0), at(0.7, 1.0)], 1.0).expect("light");
        assert!(dark.amplitude < 1e-15);
        assert_eq!(sum(&[], 1.0), None);
    }

    #[test]
    fn folding_and_wrapping() {
        assert!((fold(7.3, 3.0) - 1.3).abs() < 1e-15 && fold(2.5, 3.0) == 2.5);
        assert!((wrap(2.9, 3.0) + 0.1).abs() < 1e-15 && wrap(-1.0, 3.0) == -1.0);
    }
}
