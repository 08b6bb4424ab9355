//! Finds elements whose readings are not those of a beam of their facet on their boards.

use super::linear::Linear;
use super::problem::Joint;
use crate::lsq::State;

/// Gate on χ² of an element's rows, in standard deviations of χ² above its mean.
const GATE_SIGMAS: f64 = 7.0;

/// Share of elements beyond the gate above which the model is at fault, not the elements.
const LARGEST_SHARE: f64 = 0.2;

impl Joint<'_> {
    /// Beams of these elements; empty if they are so many that the model is at fault.
    pub(super) fn strange(&self, state: &State) -> Vec<usize> {
        let (mut strange, mut all) = (Vec::new(), 0);
        for (number, group) in self.groups.iter().enumerate() {
            let own = state.own(number);
            let Some(boards) = self.boards(group, &state.shared, own) else {
                continue;
            };
            for element in group.elements.iter().filter(|e| e.facet.is_some()) {
                if let Some(linear) = self.element(element, &state.shared, own, &boards) {
                    all += 1;
                    if self.is_strange(&linear) {
                        strange.push(element.beam);
                    }
                }
            }
        }
        if strange.len() as f64 > LARGEST_SHARE * f64::from(all) {
            strange.clear();
        }
        strange
    }

    fn is_strange(&self, linear: &Linear) -> bool {
        let tau = self.flatness.tau;
        let deviation = if tau > 0.0 {
            linear.delta.norm_squared() / (tau * tau)
        } else {
            0.0
        };
        let chi_squared = linear.rest().norm_squared() + deviation;
        let freedom = linear.y.len() as f64;
        chi_squared > freedom + GATE_SIGMAS * (2.0 * freedom).sqrt() + GATE_SIGMAS * GATE_SIGMAS
    }
}
