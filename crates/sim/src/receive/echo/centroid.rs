//! `centroid`: ∫x·w/∫w over an echo, in closed form.

use super::receiver::{Hill, Receiver, Rule};
use crate::receive::detect::Pulse;

pub(super) const RULE: Rule = Rule::Digitizer {
    lead: |_, _| 0.0,
    place: centroid,
};

/// The centroid of what the receiver passes on.
fn centroid(receiver: &Receiver, pulses: &[Pulse], hill: &Hill) -> f64 {
    // Moments about the peak: about 0, the first moment would lose digits.
    let (mut area, mut moment) = moments(receiver.sd, pulses, hill.top, hill.start, hill.end);
    if hill.peak > receiver.saturation {
        for (from, to) in receiver.clipped(pulses, hill) {
            let (lost_area, lost_moment) = moments(receiver.sd, pulses, hill.top, from, to);
            let kept = receiver.saturation * (to - from);
            area -= lost_area - kept;
            moment -= lost_moment - kept * (0.5 * (from + to) - hill.top);
        }
    }
    hill.top + moment / area
}

/// ∫w and ∫(x − about)·w between two positions, in closed form.
fn moments(sd: f64, pulses: &[Pulse], about: f64, from: f64, to: f64) -> (f64, f64) {
    let root = std::f64::consts::SQRT_2 * sd;
    let bell = |x: f64| libm::exp(-(x / root) * (x / root));
    pulses.iter().fold((0.0, 0.0), |(area, moment), p| {
        let (a, b) = (from - p.range, to - p.range);
        let half_root_pi = 0.5 * std::f64::consts::PI.sqrt();
        let own = p.power * root * half_root_pi * (libm::erf(b / root) - libm::erf(a / root));
        let ends = p.power * sd * sd * (bell(a) - bell(b));
        (area + own, moment + own * (p.range - about) + ends)
    })
}

#[cfg(test)]
mod tests {
    use crate::receive::detect::height;
    use crate::receive::echo::Receiver;
    use crate::receive::echo::tests::{SD, at, receiver, shift_by_saturation};
    use crate::scene::Detector;

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
    fn saturation_shifts_a_skewed_echo_toward_its_tail() {
        assert!(shift_by_saturation(Detector::Centroid) > 0.0);
    }
}
