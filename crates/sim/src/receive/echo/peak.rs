//! `peak`: where an echo is highest, or the middle of a top that the receiver clips.

use super::receiver::{Hill, Receiver, Rule};
use crate::receive::detect::Pulse;

pub(super) const RULE: Rule = Rule::Digitizer {
    lead: |_, _| 0.0,
    place: middle,
};

/// The peak, or the middle of a clipped one.
fn middle(receiver: &Receiver, pulses: &[Pulse], hill: &Hill) -> f64 {
    if hill.peak <= receiver.saturation {
        return hill.top;
    }
    let runs = receiver.clipped(pulses, hill);
    let run = runs.iter().find(|(from, to)| (*from..=*to).contains(&hill.top));
    run.map_or(hill.top, |(from, to)| 0.5 * (from + to))
}

#[cfg(test)]
mod tests {
    use crate::receive::echo::tests::shift_by_saturation;
    use crate::scene::Detector;

    #[test]
    fn a_clipped_top_is_taken_in_its_middle() {
        assert!(shift_by_saturation(Detector::Peak) > 0.0);
    }
}
