//! Beliefs about the biases, as found in step 1.

use crate::noise::{Draws, Purpose};
use crate::scene::Scene;
use catoptric_model::RangeBias;

/// The biases as found in step 1: the true ones plus random errors of the size of the characterization's uncertainty.
pub(super) fn believed_bias(scene: &Scene, seed: u64, truth: &RangeBias) -> RangeBias {
    let mut believed = truth.clone();
    if *truth == RangeBias::default() {
        return believed;
    }
    let known = &scene.characterization;
    let mut draws = Draws::new(seed, Purpose::Characterization, 0);
    for error in &mut believed.distance.error_mm {
        *error += known.distance_sd_mm * draws.normal();
    }
    draws.seek(1 << 20);
    let gain = known.angle_gain_sd_mm * draws.normal();
    believed.angle.gain_mm += gain;
    believed.angle.offset_mm -= gain;
    for (column, color) in believed.color.values_mut().enumerate() {
        draws.seek((1 << 21) + column as u64);
        color.offset_mm += known.color_sd_mm * draws.normal();
    }
    believed
}
