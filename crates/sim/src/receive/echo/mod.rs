//! The echoes of a beam, and the point of each that a detector takes for its range.
//!
//! The waveform over range is w(x) = Σ Pᵢ·exp(−(x − rᵢ)²/2σ²); a receiver that saturates at S sees min(w, S). Each
//! local maximum of w is an echo of its own, from the valley before it to the valley after it, but two maxima within a
//! pulse's full width at half maximum (c·τ/2 in range) are one. A comparator needs w to fall below its level before it
//! can fire again: `leading_edge` and `constant_fraction` merge what they cannot separate.
//!
//! | detector | takes | one Gaussian pulse of height A reads early by | clipped at S < A |
//! |---|---|---|---|
//! | `leading_edge` | w rises through the threshold V | σ√(2 ln(A/V)): walk | the same |
//! | `constant_fraction` | w rises through f·A | σ√(2 ln(1/f)), whatever A | σ√(2 ln(A/(f·S))): it walks again |
//! | `peak` | w is highest, or the middle of the clipped top | 0 | 0, but a skewed echo shifts |
//! | `centroid` | ∫x·w/∫w over the echo | 0 | 0, but a skewed echo shifts |

mod centroid;
mod constant_fraction;
mod leading_edge;
mod peak;
mod receiver;

pub use receiver::Receiver;

use crate::receive::detect::root::turning;
use crate::receive::detect::{self, Pulse, height, slope, walk};
use crate::scene::Detector;
use receiver::{Hill, Rule, STEP};

/// The rule of a detector: to add one, write its file and add its row here and in the table above.
const fn rule(detector: Detector) -> &'static Rule {
    match detector {
        Detector::LeadingEdge => &leading_edge::RULE,
        Detector::ConstantFraction => &constant_fraction::RULE,
        Detector::Peak => &peak::RULE,
        Detector::Centroid => &centroid::RULE,
    }
}

/// An echo as a detector sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Echo {
    /// The point that it takes, in meters of range.
    pub place: f64,
    /// That point, corrected for what the detector does to a single Gaussian pulse of this height, in meters.
    pub compensated: f64,
    /// Height of its highest point before clipping, in watts.
    pub peak: f64,
    /// Where its light begins: the valley before it, or −∞, in meters.
    pub start: f64,
    /// Where its light ends, in meters.
    pub end: f64,
}

impl Receiver {
    /// How far before its peak a single Gaussian pulse of a given height is taken, in meters.
    pub fn lead(&self, peak: f64) -> f64 {
        match rule(self.detector) {
            Rule::Comparator { level, .. } => self.sd * walk(peak, level(self, peak)),
            Rule::Digitizer { lead, .. } => lead(self, peak),
        }
    }

    /// The level at which a comparator fires for an echo of a given height, in watts; `None` for a digitizer.
    pub fn level(&self, peak: f64) -> Option<f64> {
        match rule(self.detector) {
            Rule::Comparator { level, .. } => Some(level(self, peak)),
            Rule::Digitizer { .. } => None,
        }
    }

    /// The echoes that are at least `least` watts high, nearest first.
    pub fn echoes(&self, pulses: &[Pulse], least: f64) -> Vec<Echo> {
        let mut hills: Vec<Hill> = Vec::new();
        for hill in self.hills(pulses) {
            match hills.last_mut() {
                Some(before) if self.is_one(pulses, before, &hill) => before.join(&hill),
                _ => hills.push(hill),
            }
        }
        hills
            .iter()
            .filter(|h| h.peak >= least)
            .map(|h| self.echo(pulses, h))
            .collect()
    }

    /// Whether the detector takes two neighboring hills for one echo.
    fn is_one(&self, pulses: &[Pulse], before: &Hill, after: &Hill) -> bool {
        let cannot_fire_again =
            (self.level(after.peak)).is_some_and(|level| height(pulses, self.sd, after.start) >= level);
        cannot_fire_again || after.first - before.last < detect::pulse_length(self.sd)
    }

    /// Splits the waveform at its valleys.
    fn hills(&self, pulses: &[Pulse]) -> Vec<Hill> {
        let nearest = pulses.iter().map(|p| p.range).fold(f64::INFINITY, f64::min);
        let farthest = pulses.iter().map(|p| p.range).fold(f64::NEG_INFINITY, f64::max);
        let rises = |x: f64| slope(pulses, self.sd, x) > 0.0;
        let step = STEP * self.sd;
        let mut hills = Vec::new();
        let (mut start, mut top, mut rising) = (f64::NEG_INFINITY, None, true);
        let mut at = nearest - step;
        while at <= farthest + step {
            let next = at + step;
            if rising && !rises(next) {
                top = Some(turning(pulses, self.sd, (at, next), true));
                rising = false;
            } else if !rising && rises(next) {
                let valley = turning(pulses, self.sd, (at, next), false);
                hills.extend(top.take().map(|t| self.hill(pulses, start, valley, t)));
                (start, rising) = (valley, true);
            }
            at = next;
        }
        hills.extend(top.map(|t| self.hill(pulses, start, f64::INFINITY, t)));
        hills
    }

    fn hill(&self, pulses: &[Pulse], start: f64, end: f64, top: f64) -> Hill {
        Hill {
            start,
            end,
            first: top,
            last: top,
            top,
            peak: height(pulses, self.sd, top),
        }
    }

    fn echo(&self, pulses: &[Pulse], hill: &Hill) -> Echo {
        let (place, known_height) = match rule(self.detector) {
            Rule::Comparator { level, known_height } => (
                self.rise(pulses, hill, level(self, hill.peak)),
                known_height(self, pulses, hill),
            ),
            Rule::Digitizer { place, .. } => (place(self, pulses, hill), hill.peak),
        };
        Echo {
            place,
            compensated: place + self.lead(known_height),
            peak: hill.peak,
            start: hill.start,
            end: hill.end,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) const SD: f64 = 0.25;

    /// With a threshold of 1 W and a fraction of ½, never saturated.
    pub(super) fn receiver(detector: Detector) -> Receiver {
        Receiver {
            detector,
            fraction: 0.5,
            sd: SD,
            threshold: 1.0,
            saturation: f64::INFINITY,
        }
    }

    pub(super) fn at(range: f64, power: f64) -> Pulse {
        Pulse { range, power }
    }

    /// By how much a receiver that clips at 5 W reads a skewed echo later than one that never does.
    pub(super) fn shift_by_saturation(detector: Detector) -> f64 {
        let pulses = [at(2.0, 50.0), at(2.3, 20.0)];
        let place = |saturation| {
            let receiver = Receiver {
                saturation,
                ..receiver(detector)
            };
            receiver.echoes(&pulses, 1.0)[0].place
        };
        place(5.0) - place(f64::INFINITY)
    }

    #[test]
    fn one_pulse_clipped_or_not_is_taken_where_its_closed_form_says() {
        for detector in Detector::ALL {
            for saturation in [f64::INFINITY, 4.0] {
                let receiver = Receiver {
                    saturation,
                    ..receiver(detector)
                };
                let found = receiver.echoes(&[at(3.0, 40.0)], 1.0);
                assert_eq!(found.len(), 1);
                let echo = found[0];
                let expected = 3.0 - receiver.lead(40.0);
                assert!((echo.place - expected).abs() < 1e-9, "{detector:?}: {echo:?}");
                assert!((echo.compensated - 3.0).abs() < 1e-9, "{detector:?}: {echo:?}");
            }
        }
    }

    #[test]
    fn surfaces_within_a_pulse_are_one_echo_between_them() {
        for detector in Detector::ALL {
            for apart in [0.2, 0.45, 0.58] {
                let found = receiver(detector).echoes(&[at(2.0, 5.0), at(2.0 + apart, 4.0)], 1.0);
                assert_eq!(found.len(), 1, "{detector:?} at {apart} m");
                let range = found[0].compensated;
                assert!(range > 2.0 - 1e-9 && range < 2.0 + apart, "{detector:?}: {range}");
            }
            // Far apart they are two, and neither affects the other.
            let found = receiver(detector).echoes(&[at(2.0, 5.0), at(6.0, 4.0)], 1.0);
            assert_eq!(found.len(), 2);
            assert!((found[0].compensated - 2.0).abs() < 1e-9 && (found[1].compensated - 6.0).abs() < 1e-9);
        }
        // A little farther than the pulse length: a digitizer separates them, a comparator has not fallen below its
        // level.
        let close = [at(2.0, 5.0), at(2.7, 5.0)];
        for detector in Detector::ALL {
            let receiver = receiver(detector);
            let expected = if receiver.level(5.0).is_some() { 1 } else { 2 };
            assert_eq!(receiver.echoes(&close, 1.0).len(), expected, "{detector:?}");
        }
    }
}
