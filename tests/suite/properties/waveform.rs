//! The closed-form detection compared with the general one: the same bits.
//!
//! The general algorithm is implemented here by its definition: steps of a quarter of σ, each interval bisected to the
//! end, every exponential by `libm`. It is independent of other root finders.

use super::cases;
use catoptric::sim::receive::detect::{self, Edge, Pulse, walk};
use proptest::collection::vec;
use proptest::prelude::*;

fn height(pulses: &[Pulse], sd: f64, at: f64) -> f64 {
    let light = |p: &Pulse| {
        let x = (at - p.range) / sd;
        p.power * libm::exp(-0.5 * x * x)
    };
    pulses.iter().map(light).sum()
}

fn slope(pulses: &[Pulse], sd: f64, at: f64) -> f64 {
    let light = |p: &Pulse| {
        let x = (at - p.range) / sd;
        (p.range - at) * p.power * libm::exp(-0.5 * x * x)
    };
    pulses.iter().map(light).sum()
}

fn halve(mut no: f64, mut yes: f64, holds: impl Fn(f64) -> bool) -> f64 {
    loop {
        let middle = 0.5 * (no + yes);
        if middle <= no || middle >= yes || yes - no < 1e-14 {
            return yes;
        }
        if holds(middle) { yes = middle } else { no = middle }
    }
}

/// The leading edge by its definition.
fn defined(pulses: &[Pulse], sd: f64, threshold: f64) -> Option<Edge> {
    let total: f64 = pulses.iter().map(|p| p.power).sum();
    if total < threshold || pulses.is_empty() {
        return None;
    }
    let nearest = pulses.iter().map(|p| p.range).fold(f64::INFINITY, f64::min);
    let farthest = pulses.iter().map(|p| p.range).fold(0.0, f64::max);
    let mut below = nearest - sd * walk(total, threshold) - 1e-12;
    let mut above = nearest;
    while height(pulses, sd, above) < threshold {
        if above > farthest {
            return None;
        }
        below = above;
        above += 0.25 * sd;
    }
    let crossing = halve(below, above, |x| height(pulses, sd, x) >= threshold);
    let mut rising = crossing;
    let mut falling = crossing + 0.25 * sd;
    while slope(pulses, sd, falling) > 0.0 {
        rising = falling;
        falling += 0.25 * sd;
    }
    let top = halve(rising, falling, |x| slope(pulses, sd, x) <= 0.0);
    Some(Edge {
        crossing,
        peak: height(pulses, sd, top),
    })
}

fn bits(edge: Option<Edge>) -> Option<[u64; 2]> {
    edge.map(|e| [e.crossing.to_bits(), e.peak.to_bits()])
}

fn same(pulses: &[Pulse], sd: f64, threshold: f64) -> Result<(), TestCaseError> {
    let expected = defined(pulses, sd, threshold);
    prop_assert_eq!(
        bits(detect::leading_edge(pulses, sd, threshold)),
        bits(expected),
        "{:?}",
        expected
    );
    prop_assert_eq!(detect::is_seen(pulses, sd, threshold), expected.is_some());
    Ok(())
}

/// Light of one place: some sub-rays, spread over a fraction of σ.
fn sub_rays(spread: f64) -> impl Strategy<Value = Vec<Pulse>> {
    let sub_ray = (0.0..1.0_f64, 0.5..1.5_f64);
    (0.1..60.0_f64, vec(sub_ray, 1..40)).prop_map(move |(range, sub_rays)| {
        let pulse = |(place, power)| Pulse {
            range: range + spread * place,
            power,
        };
        sub_rays.into_iter().map(pulse).collect()
    })
}

proptest! {
    #![proptest_config(cases(3000))]

    /// One plane: all sub-rays within a range of zero to a third of σ, from bright to barely not detected.
    #[test]
    fn the_common_beam_is_bit_identical(pulses in sub_rays(0.08), share in 1e-5..1.02_f64) {
        let total: f64 = pulses.iter().map(|p| p.power).sum();
        same(&pulses, 0.25, total * share)?;
    }

    #[test]
    fn sub_rays_at_one_range_are_bit_identical(pulses in sub_rays(0.0), share in 1e-5..1.02_f64) {
        let total: f64 = pulses.iter().map(|p| p.power).sum();
        same(&pulses, 0.25, total * share)?;
    }

    /// Two places, near and far from each other, with different brightness.
    #[test]
    fn mixed_beams_are_bit_identical(
        near in sub_rays(0.05), far in sub_rays(0.3), apart in 0.0..3.0_f64, gain in 0.01..100.0_f64, level in 0.001..50.0_f64
    ) {
        let base = near[0].range - far[0].range + apart;
        let moved = far.iter().map(|p| Pulse { range: p.range + base, power: p.power * gain });
        let pulses: Vec<Pulse> = near.iter().copied().chain(moved).collect();
        same(&pulses, 0.25, level)?;
    }

    /// Pulses with nothing in common.
    #[test]
    fn any_pulses_are_bit_identical(
        pulses in vec((0.05..200.0_f64, 1e-3..1e3_f64), 0..12), sd in 0.01..2.0_f64, level in 1e-3..1e3_f64
    ) {
        let pulses: Vec<Pulse> = pulses.into_iter().map(|(range, power)| Pulse { range, power }).collect();
        same(&pulses, sd, level)?;
    }
}
