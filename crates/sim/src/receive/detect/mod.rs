//! From a sum of pulses to a range: the leading edge of the first echo.
//!
//! Every sub-ray returns a Gaussian pulse. The echo is their sum; the detector takes the point where it first rises
//! through a fixed threshold. A weaker pulse crosses later: this is the walk error, since a Gaussian of height A
//! crosses √(2 ln(A/V))·σ before its peak. Surfaces closer together than the length of a pulse merge into one echo;
//! others give successive echoes. Other detectors and the echoes after the first are in [`echo`](crate::receive::echo).

mod pulse;
pub(crate) mod root;

pub use pulse::{Pulse, walk};
pub(crate) use pulse::{height, slope};

/// The first echo that rises through the threshold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// Where the threshold is crossed, in meters of range.
    pub crossing: f64,
    /// Height of the echo's first peak, in watts.
    pub peak: f64,
}

/// Speed of light, in meters per second.
pub const SPEED_OF_LIGHT: f64 = 299_792_458.0;

/// Standard deviation in range of a pulse of the given full width at half maximum in nanoseconds, in meters.
pub fn pulse_sd(fwhm_ns: f64) -> f64 {
    0.5 * SPEED_OF_LIGHT * fwhm_ns * 1e-9 / (8.0 * std::f64::consts::LN_2).sqrt()
}

/// Full width at half maximum of a pulse of the given standard deviation, both in meters of range.
pub fn pulse_length(sd: f64) -> f64 {
    sd * (8.0 * std::f64::consts::LN_2).sqrt()
}

/// Whether a sum of pulses reaches the threshold anywhere, that is, whether there is a [`leading_edge`].
pub fn is_seen(pulses: &[Pulse], sd: f64, threshold: f64) -> bool {
    is_surely_seen(pulses, sd, threshold) || bracket(pulses, sd, threshold).is_some()
}

/// Whether a bound proves that the threshold is reached: at the nearest pulse all pulses have at least
/// exp(−δ²/2) ≥ 1 − δ²/2 of their height, with δ the distance of the farthest divided by σ.
fn is_surely_seen(pulses: &[Pulse], sd: f64, threshold: f64) -> bool {
    /// Far above the rounding error of the sums.
    const ROUNDING: f64 = 1e-9;
    let Span {
        total,
        nearest,
        farthest,
    } = Span::of(pulses);
    let spread = (farthest - nearest) / sd;
    total * (1.0 - 0.5 * spread * spread) > threshold * (1.0 + ROUNDING)
}

/// The leading edge of the first echo; `None` if the threshold is never reached.
///
/// Accurate to 1e-13 m for one pulse and for any sum.
pub fn leading_edge(pulses: &[Pulse], sd: f64, threshold: f64) -> Option<Edge> {
    let (below, above) = bracket(pulses, sd, threshold)?;
    let crossing = root::crossing(pulses, sd, (below, above), threshold);
    let top = root::first_top(pulses, sd, crossing);
    Some(Edge {
        crossing,
        peak: height(pulses, sd, top),
    })
}

/// Total light of some pulses, in watts, and their smallest and largest range, in meters.
struct Span {
    total: f64,
    nearest: f64,
    farthest: f64,
}

impl Span {
    fn of(pulses: &[Pulse]) -> Self {
        let (mut total, mut nearest, mut farthest) = (-0.0, f64::INFINITY, 0.0);
        for pulse in pulses {
            total += pulse.power;
            nearest = if pulse.range < nearest {
                pulse.range
            } else {
                nearest
            };
            farthest = if pulse.range > farthest {
                pulse.range
            } else {
                farthest
            };
        }
        Self {
            total,
            nearest,
            farthest,
        }
    }
}

/// Two positions between which the sum first reaches the threshold: still below it, and at or above it.
fn bracket(pulses: &[Pulse], sd: f64, threshold: f64) -> Option<(f64, f64)> {
    let Span {
        total,
        nearest,
        farthest,
    } = Span::of(pulses);
    if total < threshold || pulses.is_empty() {
        return None;
    }
    // Before this position even all pulses together at the nearest range stay below the threshold.
    let mut below = nearest - sd * walk(total, threshold) - 1e-12;
    // Up to the nearest pulse the echo only rises; beyond it, a peak is never narrower than a quarter of σ.
    let mut above = nearest;
    while height(pulses, sd, above) < threshold {
        if above > farthest {
            return None;
        }
        below = above;
        above += 0.25 * sd;
    }
    Some((below, above))
}

impl Edge {
    /// The range of this echo if it were one Gaussian pulse: its crossing, corrected for the walk.
    pub fn compensated(&self, sd: f64, threshold: f64) -> f64 {
        self.crossing + sd * walk(self.peak, threshold)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SD: f64 = 0.25;

    #[test]
    fn what_is_seen_has_an_edge() {
        let pulse = |range, power| Pulse { range, power };
        for (pulses, seen) in [
            (vec![], false),
            (vec![pulse(3.0, 0.999)], false),
            (vec![pulse(3.0, 1.0)], true),
            // Each too dim alone, and bright enough together only if they are close.
            (vec![pulse(3.0, 0.6), pulse(3.1, 0.6)], true),
            (vec![pulse(3.0, 0.6), pulse(4.5, 0.6)], false),
            (vec![pulse(3.0, 0.6), pulse(4.5, 1.2)], true),
        ] {
            assert_eq!(is_seen(&pulses, SD, 1.0), seen, "{pulses:?}");
            assert_eq!(leading_edge(&pulses, SD, 1.0).is_some(), seen, "{pulses:?}");
        }
    }

    #[test]
    fn one_pulse_has_its_closed_form() {
        for power in [1.0, 1.5, 40.0, 1e6] {
            let edge = leading_edge(&[Pulse { range: 3.0, power }], SD, 1.0).expect("it is bright enough");
            assert!((edge.crossing - (3.0 - SD * (2.0 * libm::log(power)).sqrt())).abs() < 1e-12);
            // Near the top a position is known only to the square root of the precision; the height is not affected.
            assert!((edge.peak / power - 1.0).abs() < 1e-14);
            assert!((edge.compensated(SD, 1.0) - 3.0).abs() < 1e-12);
        }
        assert_eq!(
            leading_edge(
                &[Pulse {
                    range: 3.0,
                    power: 0.999
                }],
                SD,
                1.0
            ),
            None
        );
        assert_eq!(leading_edge(&[], SD, 1.0), None);
    }

    #[test]
    fn distant_surfaces_are_two_echoes_and_the_first_counts() {
        let near = Pulse {
            range: 1.0,
            power: 5.0,
        };
        let far = Pulse {
            range: 1.0 + 16.0 * SD,
            power: 50.0,
        };
        let alone = leading_edge(&[near], SD, 1.0).expect("bright");
        let both = leading_edge(&[far, near], SD, 1.0).expect("bright");
        assert!((alone.crossing - both.crossing).abs() < 1e-9 && (both.peak - 5.0).abs() < 1e-9);
        let faint = leading_edge(&[far, Pulse { power: 0.5, ..near }], SD, 1.0).expect("bright");
        assert!((faint.compensated(SD, 1.0) - far.range).abs() < 1e-9);
    }

    #[test]
    fn close_surfaces_merge_between_them() {
        let pulses = [
            Pulse {
                range: 1.0,
                power: 5.0,
            },
            Pulse {
                range: 1.2,
                power: 5.0,
            },
        ];
        let range = leading_edge(&pulses, SD, 1.0)
            .expect("bright")
            .compensated(SD, 1.0);
        assert!(range > 1.0 && range < 1.2, "{range}");
    }
}
