//! `constant_fraction`: where an echo rises through a fraction of its own height, which does not walk; but where the
//! receiver clips the echo, the fraction is one of the height that is left.

use super::receiver::Rule;

pub(super) const RULE: Rule = Rule::Comparator {
    level: |receiver, peak| receiver.fraction * peak.min(receiver.saturation),
    known_height: |_, _, hill| hill.peak,
};

#[cfg(test)]
mod tests {
    use crate::receive::echo::Receiver;
    use crate::receive::echo::tests::{SD, receiver, shift_by_saturation};
    use crate::scene::Detector;

    #[test]
    fn one_pulse_walks_only_if_it_is_clipped() {
        let whole = receiver(Detector::ConstantFraction);
        for height in [40.0, 4000.0] {
            let lead = SD * (2.0 * std::f64::consts::LN_2).sqrt();
            assert!((whole.lead(height) - lead).abs() < 1e-15);
        }
        let clipped = Receiver {
            saturation: 4.0,
            ..whole
        };
        // A height of 40 over half of 4.
        assert!((clipped.lead(40.0) - SD * (2.0 * libm::log(20.0)).sqrt()).abs() < 1e-15);
        assert!(shift_by_saturation(Detector::ConstantFraction) < -0.1);
    }
}
