//! The receiver, the hills of a waveform, and what a detector has to define.

use crate::receive::detect::root::{bisect, crossing};
use crate::receive::detect::{Pulse, height, walk};
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

/// What a detector does with an echo.
pub(super) enum Rule {
    /// It fires where an echo rises through a level, and again only after the waveform has fallen below it.
    Comparator {
        /// The level for an echo of a given height, in watts.
        level: fn(&Receiver, f64) -> f64,
        /// The height of an echo as far as it is known when the detector fires, in watts.
        known_height: fn(&Receiver, &[Pulse], &Hill) -> f64,
    },
    /// It takes a point of an echo that is recorded as a whole.
    Digitizer {
        /// How far before its peak a single Gaussian pulse of a given height is taken, in meters.
        lead: fn(&Receiver, f64) -> f64,
        /// The point, in meters of range.
        place: fn(&Receiver, &[Pulse], &Hill) -> f64,
    },
}

/// The part of the waveform from one valley to the next.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hill {
    pub(super) start: f64,
    pub(super) end: f64,
    /// Its first local maximum, whose height is known to a comparator that fired on it.
    pub(super) first: f64,
    /// Its last local maximum, from which the distance to the next hill is measured.
    pub(super) last: f64,
    /// Its highest local maximum.
    pub(super) top: f64,
    pub(super) peak: f64,
}

/// Step of the search through the waveform, as a fraction of σ: local maxima of a sum of equal Gaussians are 2σ apart
/// or more.
pub(super) const STEP: f64 = 0.25;

impl Receiver {
    /// Where a hill rises through a level; its peak if it never does.
    pub(super) fn rise(&self, pulses: &[Pulse], hill: &Hill, level: f64) -> f64 {
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

    /// The intervals in which a hill is above the saturation.
    pub(super) fn clipped(&self, pulses: &[Pulse], hill: &Hill) -> Vec<(f64, f64)> {
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
    pub(super) fn join(&mut self, next: &Self) {
        self.end = next.end;
        self.last = next.last;
        if next.peak > self.peak {
            (self.top, self.peak) = (next.top, next.peak);
        }
    }
}
