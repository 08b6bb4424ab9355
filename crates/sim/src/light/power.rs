//! Received power: Cooper, Eq. (1).

use crate::scene::Light;

/// Properties of a target that Eq. (1) depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Illumination {
    /// Reflectivity of the target, ρ_t.
    pub reflectivity: f64,
    /// Cosine of the incidence on it (Lambert's law, which the paper's equation leaves to dA).
    pub cos_incidence: f64,
    /// Share of the beam's area that falls on it: dA / (θ_d·R)².
    pub share: f64,
    /// Path length R, in meters.
    pub range: f64,
    /// Reflectivity of the mirrors on the outgoing path; it applies again to the return.
    pub mirrors: f64,
    /// Share of the receiver's lens that sees it.
    pub seen: f64,
}

/// Power at the detector, in watts: P = τ_o·τ_a²·D_R²·ρ_t·dA·P_t / (R²·θ_R·(θ_d·R)²) — Eq. (1).
///
/// dA is the part of the spot (θ_d·R)² that a sub-ray represents, so that the size of the spot cancels and the sub-rays
/// of a beam whose spot is entirely on the target add up to the closed form. Unlike the paper, the cosine of the
/// incidence, the losses at the mirrors and the share of the lens that sees the spot are written out.
#[doc(alias = "P_detector")]
pub fn received(light: &Light, on: &Illumination) -> f64 {
    Target::new(light, on.reflectivity, on.mirrors).received(on.share, on.range, on.cos_incidence) * on.seen
}

/// A target and the mirrors in front of it: everything that is the same for all sub-rays that go there.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Target {
    /// τ_o·τ_a²·D_R²·ρ_t.
    sent_back: f64,
    power: f64,
    dispersion: f64,
    mirrors: f64,
}

impl Target {
    /// A target of some reflectivity behind mirrors, as in [`Illumination`].
    pub(crate) fn new(light: &Light, reflectivity: f64, mirrors: f64) -> Self {
        let aperture = light.receiver_diameter_mm * 1e-3;
        let out_and_back = light.air_transmission * light.air_transmission;
        Self {
            sent_back: light.optics_transmission * out_and_back * aperture * aperture * reflectivity,
            power: light.power_w,
            dispersion: light.target_dispersion_sr,
            mirrors: mirrors * mirrors,
        }
    }

    /// [`received`] from this target.
    #[inline]
    pub(crate) fn received(&self, share: f64, range: f64, cos_incidence: f64) -> f64 {
        self.sent_back * share * self.power / (range * range * self.dispersion) * cos_incidence * self.mirrors
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equation_1_by_hand_and_by_parts() {
        let light = Light {
            air_transmission: 0.95,
            ..Light::default()
        };
        let whole = Illumination {
            reflectivity: 0.8,
            cos_incidence: 0.5,
            share: 1.0,
            range: 3.0,
            mirrors: 0.9,
            seen: 1.0,
        };
        // τ_o = 0.9, τ_a = 0.95, D_R = 20 mm, P_t = 10 W, θ_R = π, dA = (θ_d·R)².
        let by_hand =
            0.9 * 0.95 * 0.95 * 0.02 * 0.02 * 0.8 * 10.0 / (9.0 * std::f64::consts::PI) * 0.5 * 0.81;
        assert!((received(&light, &whole) / by_hand - 1.0).abs() < 1e-14);
        let parts: f64 = crate::light::footprint::sub_rays(19)
            .iter()
            .map(|ray| {
                received(
                    &light,
                    &Illumination {
                        share: ray.weight,
                        ..whole
                    },
                )
            })
            .sum();
        assert!((parts / by_hand - 1.0).abs() < 1e-13);
    }
}
