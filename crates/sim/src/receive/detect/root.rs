//! Where a sum of pulses crosses a level, and where it is highest: in closed form, then to the last bit.
//!
//! Around a place x₀ the logarithm of one pulse is a parabola of curvature −1/σ²: with w = w(x₀) and
//! w′ = σ²·dw/dx the level V is crossed at h from there with h²/2 − h·w′/w − σ²·ln(w/V) = 0. For a single pulse that is its
//! closed form. Sub-rays on one plane lie within a small part δ of σ and are nearly one pulse, at the center of their
//! light: each step leaves the error times δ or less. Any other sum takes a few steps more, or is left to bisection.
//!
//! **What is promised.** The place is the one that halving the interval would have ended at, bit by bit: halving is
//! repeated with the root to compare with, and the sum itself is asked only where the root is nearer than its error. So
//! no result depends on which way it was found. The exception is an interval with more than one root, which a quarter of
//! σ holds only where two tops are about to merge: then another of its roots may be found.

use super::pulse::{Pulse, height, slope, sum};

/// Steps after which halving is left to itself.
const STEPS: usize = 12;

/// A root with what it may be off, in metres.
#[derive(Debug, Clone, Copy)]
struct Root {
    at: f64,
    error: f64,
}

/// Where the sum first reaches a level, between a place below it and one at or above it.
pub(crate) fn crossing(pulses: &[Pulse], sd: f64, (below, above): (f64, f64), level: f64) -> f64 {
    let found = cross(pulses, sd, (below, above), level);
    halve(below, above, found, |x| height(pulses, sd, x) >= level)
}

/// Where the sum stops rising, or where it begins to, between two places.
pub(crate) fn turning(pulses: &[Pulse], sd: f64, (from, to): (f64, f64), top: bool) -> f64 {
    let found = turn(pulses, sd, (from, to));
    halve(from, to, found, |x| (slope(pulses, sd, x) > 0.0) != top)
}

/// The first top after a place where the sum rises.
pub(super) fn first_top(pulses: &[Pulse], sd: f64, crossing: f64) -> f64 {
    let found = single_top(pulses, sd);
    let rises = |x: f64| match found {
        Some(root) if (x - root.at).abs() > root.error => x < root.at,
        _ => slope(pulses, sd, x) > 0.0,
    };
    let mut rising = crossing;
    let mut falling = crossing + 0.25 * sd;
    while rises(falling) {
        rising = falling;
        falling += 0.25 * sd;
    }
    let found = found.or_else(|| turn(pulses, sd, (rising, falling)));
    halve(rising, falling, found, |x| slope(pulses, sd, x) <= 0.0)
}

/// The place between `no` and `yes` where a condition begins to hold, by halving; near `root` the condition is asked,
/// elsewhere the root tells.
fn halve(mut no: f64, mut yes: f64, root: Option<Root>, holds: impl Fn(f64) -> bool) -> f64 {
    loop {
        let middle = 0.5 * (no + yes);
        if middle <= no || middle >= yes || yes - no < 1e-14 {
            return yes;
        }
        let beyond = match root {
            Some(root) if (middle - root.at).abs() > root.error => middle > root.at,
            _ => holds(middle),
        };
        if beyond { yes = middle } else { no = middle }
    }
}

/// The place between `no` and `yes` where a condition begins to hold.
pub(crate) fn bisect(no: f64, yes: f64, holds: impl Fn(f64) -> bool) -> f64 {
    halve(no, yes, None, holds)
}

/// What a sum of so many pulses is off by rounding, as a part of it, amply.
fn rounding(pulses: &[Pulse]) -> f64 {
    (16.0 + 2.0 * pulses.len() as f64) * f64::EPSILON
}

/// Height, slope, the slope's own slope by 1/σ² less the height, and the slope of all light on one side: of one reading of
/// the sum, and not in the order of [`slope`].
fn local(pulses: &[Pulse], sd: f64, at: f64) -> [f64; 4] {
    let per_variance = 1.0 / (sd * sd);
    let mut sums = [0.0; 4];
    sum(pulses, sd, at, |distance, power, bell| {
        let light = power * bell;
        sums[0] += light;
        sums[1] += distance * light;
        sums[2] += (distance * distance * per_variance - 1.0) * light;
        sums[3] += distance.abs() * light;
        0.0
    });
    sums
}

fn cross(pulses: &[Pulse], sd: f64, (below, above): (f64, f64), level: f64) -> Option<Root> {
    let (power, moment) = pulses.iter().fold((0.0, 0.0), |(p, m), pulse| {
        (p + pulse.power, m + pulse.power * pulse.range)
    });
    let closed = moment / power - sd * super::walk(power, level);
    let mut at = closed.clamp(below, above);
    for _ in 0..STEPS {
        let [w, dw, ..] = local(pulses, sd, at);
        if w <= 0.0 || dw <= 0.0 {
            return None;
        }
        let (lift, rate) = (libm::log(w / level), dw / w);
        let root = rate * rate + 2.0 * sd * sd * lift;
        if root < 0.0 {
            return None;
        }
        // rate − √root without cancellation.
        let step = -2.0 * sd * sd * lift / (rate + root.sqrt());
        at += step;
        if !(below..=above).contains(&at) {
            return None;
        }
        if step.abs() < 1e-11 {
            // The step itself was exact to a part that is far below 1e-3.
            let error = rounding(pulses) * sd * sd / rate + 1e-3 * step.abs() + 4.0 * f64::EPSILON * at.abs();
            return Some(Root { at, error });
        }
    }
    None
}

/// The top of pulses that have no other: all within 2σ of each other.
fn single_top(pulses: &[Pulse], sd: f64) -> Option<Root> {
    let ranges = pulses.iter().map(|p| p.range);
    let (near, far) = ranges.fold((f64::INFINITY, f64::NEG_INFINITY), |(near, far), r| {
        (f64::min(near, r), f64::max(far, r))
    });
    (far - near < 2.0 * sd).then(|| turn(pulses, sd, (near - sd, far + sd)))?
}

/// Where the slope is zero, by Newton's steps; near a top that is flat it is not found well, and not given.
fn turn(pulses: &[Pulse], sd: f64, (from, to): (f64, f64)) -> Option<Root> {
    let (power, moment) = pulses.iter().fold((0.0, 0.0), |(p, m), pulse| {
        (p + pulse.power, m + pulse.power * pulse.range)
    });
    let center = moment / power;
    let mut at = if (from..=to).contains(&center) {
        center
    } else {
        0.5 * (from + to)
    };
    for _ in 0..STEPS {
        let [_, first, second, size] = local(pulses, sd, at);
        let step = -first / second;
        at += step;
        if !(from..=to).contains(&at) {
            return None;
        }
        if step.abs() < 1e-10 {
            let error =
                rounding(pulses) * size / second.abs() + 1e-3 * step.abs() + 4.0 * f64::EPSILON * at.abs();
            return (error < 1e-12).then_some(Root { at, error });
        }
    }
    None
}
