//! Where a sum of pulses crosses a level, and where it is highest: in closed form, then bit for bit.
//!
//! Around a position x₀ the logarithm of one pulse is a parabola of curvature −1/σ². With w = w(x₀) and w′ = σ²·dw/dx,
//! the level V is crossed at x₀ + h, where h²/2 − h·w′/w − σ²·ln(w/V) = 0. For a single pulse this is the closed form.
//! Sub-rays on one plane are within a small fraction δ of σ and are nearly one pulse at their center of energy: each
//! step leaves the error times δ or less. Any other sum takes a few more steps, or is left to bisection.
//!
//! **Guarantee.** The result is the position at which bisection of the interval would have ended, bit for bit: the
//! bisection is repeated by comparing with the root, and the sum itself is evaluated only where the root is closer than
//! its error. So no result depends on how the root was found. The exception is an interval with more than one root,
//! which a quarter of σ holds only where two peaks are about to merge: then another of its roots may be found.

use super::pulse::{Pulse, height, slope, sum};

/// Number of steps after which bisection has to do without a root.
const STEPS: usize = 12;

/// A root and a bound on its error, in meters.
#[derive(Debug, Clone, Copy)]
struct Root {
    at: f64,
    error: f64,
}

/// Where the sum first reaches a level, between a position below it and one at or above it.
pub(crate) fn crossing(pulses: &[Pulse], sd: f64, (below, above): (f64, f64), level: f64) -> f64 {
    let found = cross(pulses, sd, (below, above), level);
    halve(below, above, found, |x| height(pulses, sd, x) >= level)
}

/// Where the sum stops rising (`top`) or starts to rise, between two positions.
pub(crate) fn turning(pulses: &[Pulse], sd: f64, (from, to): (f64, f64), top: bool) -> f64 {
    let found = turn(pulses, sd, (from, to));
    halve(from, to, found, |x| (slope(pulses, sd, x) > 0.0) != top)
}

/// The first peak after a position where the sum rises.
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

/// The position between `no` and `yes` where a condition starts to hold, by bisection. The condition is evaluated near
/// `root` only; elsewhere the root decides.
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

/// The position between `no` and `yes` where a condition starts to hold.
pub(crate) fn bisect(no: f64, yes: f64, holds: impl Fn(f64) -> bool) -> f64 {
    halve(no, yes, None, holds)
}

/// Ample bound on the rounding error of a sum of pulses, as a fraction of the sum.
fn rounding(pulses: &[Pulse]) -> f64 {
    (16.0 + 2.0 * pulses.len() as f64) * f64::EPSILON
}

/// Height, slope, derivative of the slope, and the slope if all light were on one side: from one evaluation of the sum,
/// and not in the order of operations of [`slope`].
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
            // The step itself was exact to within a fraction far below 1e-3.
            let error = rounding(pulses) * sd * sd / rate + 1e-3 * step.abs() + 4.0 * f64::EPSILON * at.abs();
            return Some(Root { at, error });
        }
    }
    None
}

/// The peak of pulses that have no other: all within 2σ of each other.
fn single_top(pulses: &[Pulse], sd: f64) -> Option<Root> {
    let ranges = pulses.iter().map(|p| p.range);
    let (near, far) = ranges.fold((f64::INFINITY, f64::NEG_INFINITY), |(near, far), r| {
        (f64::min(near, r), f64::max(far, r))
    });
    (far - near < 2.0 * sd).then(|| turn(pulses, sd, (near - sd, far + sd)))?
}

/// Where the slope is zero, by Newton's method; `None` near a flat peak, which it does not locate well.
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
