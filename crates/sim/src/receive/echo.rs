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

use crate::receive::detect::root::{bisect, crossing, turning};
use crate::receive::detect::{self, Pulse, height, slope, walk};
use crate::scene::Detector;

/// A receiver, which turns a waveform into ranges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Receiver {
    /// The point of an echo that it takes.
    pub detector: Detector,
    /// The fraction of [`Detector::ConstantFraction`].
    pub fraction: f64,
    /// Standard deviation σ of a pulse in range, in meters.
    pub sd: f64,
    /// The threshold V, in watts.
    pub threshold: f64,
    /// The height S above which echoes are clipped, in watts; infinite without clipping.
    pub saturation: f64,
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

/// The part of the waveform from one valley to the next.
#[derive(Debug, Clone, Copy)]
struct Hill {
    start: f64,
    end: f64,
    /// Its first local maximum, whose height is known to a comparator that fired on it.
    first: f64,
    /// Its last local maximum, from which the distance to the next hill is measured.
    last: f64,
    /// Its highest local maximum.
    top: f64,
    peak: f64,
}

/// Step of the search through the waveform, as a fraction of σ: local maxima of a sum of equal Gaussians are 2σ apart
/// or more.
const STEP: f64 = 0.25;

impl Receiver {
    /// How far before its peak a single Gaussian pulse of a given height is taken, in meters.
    pub fn lead(&self, peak: f64) -> f64 {
        match self.detector {
            Detector::LeadingEdge => self.sd * walk(peak, self.threshold),
            Detector::ConstantFraction => self.sd * walk(peak, self.fraction * peak.min(self.saturation)),
            Detector::Peak | Detector::Centroid => 0.0,
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
        let valley = height(pulses, self.sd, after.start);
        let cannot_fire_again = match self.detector {
            Detector::LeadingEdge => valley >= self.threshold,
            Detector::ConstantFraction => valley >= self.fraction * after.peak.min(self.saturation),
            Detector::Peak | Detector::Centroid => false,
        };
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
        let place = match self.detector {
            Detector::LeadingEdge => self.rise(pulses, hill, self.threshold),
            Detector::ConstantFraction => {
                self.rise(pulses, hill, self.fraction * hill.peak.min(self.saturation))
            }
            Detector::Peak => self.middle(pulses, hill),
            Detector::Centroid => self.centroid(pulses, hill),
        };
        // A comparator knows the first peak that it fires on, not a higher one that follows.
        let seen = match self.detector {
            Detector::LeadingEdge => {
                let first = height(pulses, self.sd, hill.first);
                if first >= self.threshold { first } else { hill.peak }
            }
            _ => hill.peak,
        };
        Echo {
            place,
            compensated: place + self.lead(seen),
            peak: hill.peak,
            start: hill.start,
            end: hill.end,
        }
    }

    /// Where a hill rises through a level; its peak if it never does.
    fn rise(&self, pulses: &[Pulse], hill: &Hill, level: f64) -> f64 {
        let reaches = |x: f64| height(pulses, self.sd, x) >= level;
        let total: f64 = pulses.iter().map(|p| p.power).sum();
        let nearest = pulses.iter().map(|p| p.range).fold(f64::INFINITY, f64::min);
        // Before this position even all pulses together at the nearest range stay below the level.
        let mut below = hill.start.max(nearest - self.sd * walk(total, level) - 1e-12);
        while below < hill.top {
            let next = (below + STEP * self.sd).min(hill.top);
            if reaches(next) {
                return crossing(pulses, self.sd, (below, next), level);
            }
            below = next;
        }
        hill.top
    }

    /// The peak, or the middle of a clipped one.
    fn middle(&self, pulses: &[Pulse], hill: &Hill) -> f64 {
        if hill.peak <= self.saturation {
            return hill.top;
        }
        let runs = self.clipped(pulses, hill);
        let run = runs.iter().find(|(from, to)| (*from..=*to).contains(&hill.top));
        run.map_or(hill.top, |(from, to)| 0.5 * (from + to))
    }

    /// The centroid of what the receiver passes on.
    fn centroid(&self, pulses: &[Pulse], hill: &Hill) -> f64 {
        // Moments about the peak: about 0, the first moment would lose digits.
        let (mut area, mut moment) = self.moments(pulses, hill.top, hill.start, hill.end);
        if hill.peak > self.saturation {
            for (from, to) in self.clipped(pulses, hill) {
                let (lost_area, lost_moment) = self.moments(pulses, hill.top, from, to);
                let kept = self.saturation * (to - from);
                area -= lost_area - kept;
                moment -= lost_moment - kept * (0.5 * (from + to) - hill.top);
            }
        }
        hill.top + moment / area
    }

    /// ∫w and ∫(x − about)·w between two positions, in closed form.
    fn moments(&self, pulses: &[Pulse], about: f64, from: f64, to: f64) -> (f64, f64) {
        let root = std::f64::consts::SQRT_2 * self.sd;
        let bell = |x: f64| libm::exp(-(x / root) * (x / root));
        pulses.iter().fold((0.0, 0.0), |(area, moment), p| {
            let (a, b) = (from - p.range, to - p.range);
            let half_root_pi = 0.5 * std::f64::consts::PI.sqrt();
            let own = p.power * root * half_root_pi * (libm::erf(b / root) - libm::erf(a / root));
            let ends = p.power * self.sd * self.sd * (bell(a) - bell(b));
            (area + own, moment + own * (p.range - about) + ends)
        })
    }

    /// The intervals in which a hill is above the saturation.
    fn clipped(&self, pulses: &[Pulse], hill: &Hill) -> Vec<(f64, f64)> {
        let over = |x: f64| height(pulses, self.sd, x) > self.saturation;
        let step = STEP * self.sd;
        let mut at = self.rise(pulses, hill, self.saturation);
        let (mut runs, mut from) = (Vec::new(), Some(at));
        let farthest = pulses.iter().map(|p| p.range).fold(f64::NEG_INFINITY, f64::max);
        let total: f64 = pulses.iter().map(|p| p.power).sum();
        let end = hill
            .end
            .min(farthest + self.sd * walk(total, self.saturation) + step);
        while at < end {
            let next = (at + step).min(end);
            match from {
                Some(begun) if !over(next) => {
                    runs.push((begun, bisect(at, next, |x| !over(x))));
                    from = None;
                }
                None if over(next) => from = Some(bisect(at, next, over)),
                _ => {}
            }
            at = next;
        }
        runs.extend(from.map(|begun| (begun, end)));
        runs
    }
}

impl Hill {
    /// Merges the following hill into this one.
    fn join(&mut self, next: &Self) {
        self.end = next.end;
        self.last = next.last;
        if next.peak > self.peak {
            (self.top, self.peak) = (next.top, next.peak);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SD: f64 = 0.25;

    fn receiver(detector: Detector) -> Receiver {
        Receiver {
            detector,
            fraction: 0.5,
            sd: SD,
            threshold: 1.0,
            saturation: f64::INFINITY,
        }
    }

    const ALL: [Detector; 4] = [
        Detector::LeadingEdge,
        Detector::ConstantFraction,
        Detector::Peak,
        Detector::Centroid,
    ];

    fn at(range: f64, power: f64) -> Pulse {
        Pulse { range, power }
    }

    #[test]
    fn one_pulse_clipped_or_not_has_its_closed_form() {
        for detector in ALL {
            for saturation in [f64::INFINITY, 4.0] {
                let receiver = Receiver {
                    saturation,
                    ..receiver(detector)
                };
                let found = receiver.echoes(&[at(3.0, 40.0)], 1.0);
                assert_eq!(found.len(), 1);
                let lead = match detector {
                    Detector::LeadingEdge => SD * (2.0 * libm::log(40.0)).sqrt(),
                    Detector::ConstantFraction => {
                        SD * (2.0 * libm::log(40.0 / (0.5 * saturation.min(40.0)))).sqrt()
                    }
                    Detector::Peak | Detector::Centroid => 0.0,
                };
                let echo = found[0];
                assert!((echo.place - (3.0 - lead)).abs() < 1e-9, "{detector:?}: {echo:?}");
                assert!((echo.compensated - 3.0).abs() < 1e-9, "{detector:?}: {echo:?}");
            }
        }
    }

    #[test]
    fn the_leading_edge_is_that_of_the_single_echo() {
        let pulses = [at(1.0, 5.0), at(1.2, 7.0), at(1.5, 2.0), at(6.0, 9.0)];
        let first = detect::leading_edge(&pulses, SD, 1.0).expect("bright");
        let found = receiver(Detector::LeadingEdge).echoes(&pulses, 1.0);
        assert_eq!(found.len(), 2);
        assert!((found[0].place - first.crossing).abs() < 1e-12);
        assert!((found[0].compensated - first.compensated(SD, 1.0)).abs() < 1e-12);
        assert!((found[1].compensated - 6.0).abs() < 1e-9);
    }

    #[test]
    fn surfaces_within_a_pulse_are_one_echo_between_them() {
        for detector in ALL {
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
        let count = |detector| receiver(detector).echoes(&close, 1.0).len();
        assert_eq!(ALL.map(count), [1, 1, 2, 2]);
    }

    #[test]
    fn centroids_agree_with_a_sum_over_the_waveform() {
        let pulses = [at(2.0, 5.0), at(2.3, 3.0), at(3.4, 6.0)];
        for saturation in [f64::INFINITY, 3.0] {
            let receiver = Receiver {
                saturation,
                ..receiver(Detector::Centroid)
            };
            let found = receiver.echoes(&pulses, 1.0);
            assert_eq!(found.len(), 2);
            for echo in found {
                let (from, to) = (echo.start.max(0.0), echo.end.min(6.0));
                let n = 400_000;
                let (mut area, mut moment) = (0.0, 0.0);
                for k in 0..n {
                    let x = from + (to - from) * (f64::from(k) + 0.5) / f64::from(n);
                    let w = height(&pulses, SD, x).min(saturation);
                    area += w;
                    moment += w * x;
                }
                assert!((echo.place - moment / area).abs() < 1e-8, "{echo:?}");
            }
        }
    }

    #[test]
    fn saturation_shifts_a_skewed_echo() {
        let pulses = [at(2.0, 50.0), at(2.3, 20.0)];
        let shift = |detector| {
            let place = |saturation| {
                Receiver {
                    saturation,
                    ..receiver(detector)
                }
                .echoes(&pulses, 1.0)[0]
                    .place
            };
            place(5.0) - place(f64::INFINITY)
        };
        assert_eq!(shift(Detector::LeadingEdge), 0.0);
        assert!(shift(Detector::ConstantFraction) < -0.1);
        assert!(shift(Detector::Peak) > 0.0 && shift(Detector::Centroid) > 0.0);
    }
}
