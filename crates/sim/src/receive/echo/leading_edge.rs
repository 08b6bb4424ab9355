//! `leading_edge`: where an echo rises through the threshold V. A weaker pulse reads longer: walk.

use super::receiver::{Hill, Receiver, Rule};
use crate::receive::detect::{Pulse, height};

pub(super) const RULE: Rule = Rule::Comparator {
    level: |receiver, _| receiver.threshold,
    known_height: first_peak,
};

/// The first peak that the comparator fires on: it does not know a higher one that follows.
fn first_peak(receiver: &Receiver, pulses: &[Pulse], hill: &Hill) -> f64 {
    let first = height(pulses, receiver.sd, hill.first);
    if first >= receiver.threshold {
        first
    } else {
        hill.peak
    }
}

#[cfg(test)]
mod tests {
    use crate::receive::detect;
    use crate::receive::echo::Receiver;
    use crate::receive::echo::tests::{SD, at, receiver, shift_by_saturation};
    use crate::scene::Detector;

    #[test]
    fn one_pulse_clipped_or_not_is_taken_early_by_its_walk() {
        for saturation in [f64::INFINITY, 4.0] {
            let receiver = Receiver {
                saturation,
                ..receiver(Detector::LeadingEdge)
            };
            let walk = SD * (2.0 * libm::log(40.0)).sqrt();
            assert!((receiver.lead(40.0) - walk).abs() < 1e-15);
        }
        assert_eq!(shift_by_saturation(Detector::LeadingEdge), 0.0);
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
}
