//! What a beam brings home.

use crate::light::optics::Role;
use catoptric_model::BiasTerms;

/// Most echoes of a beam that have their own chance of being detected.
pub const MAX_ECHOES: usize = 8;

/// What a beam brings home, each contribution by itself. The reading is their sum, then drift, noise and rounding.
#[derive(Debug, Clone, PartialEq)]
pub struct Return {
    /// Surface that dominates the echo.
    pub role: Role,
    /// Facets on the way there.
    pub facets: Vec<usize>,
    /// Path length to it, of the chief ray if that meets it and else the mean over its light, in metres.
    pub geometric: f64,
    /// Cosine of the incidence on it.
    pub cos_incidence: f64,
    /// Cosine of the incidence on each of the facets, as for the surface of the chief ray or the mean.
    pub facet_cos_incidence: Vec<f64>,
    /// Power received from it, in watts.
    pub power: f64,
    /// Share of the beam's energy that falls on it.
    pub share: f64,
    /// Shift of the range because other surfaces are in the same echo, in metres.
    pub mixed: f64,
    /// Shift by pulse and threshold for this surface alone, in metres; 0 unless the error model is physical. Ranging by
    /// phase has the ambiguities that are missing here, whatever the error model.
    pub detection: f64,
    /// The biases of Eqs. 3–5, in metres.
    pub bias: BiasTerms,
    /// Standard deviation of its noise, in metres.
    pub noise_sd: f64,
    /// Chance that the echo is detected: 1 but near a threshold with noise.
    pub probability: f64,
    /// Other echoes of the beam, each without any of its own: what is reported when this one is missed, in the order
    /// of `detection.echo`, and beside it when that is "all".
    pub others: Vec<Return>,
}

impl Return {
    /// The reading without drift, noise and rounding, in metres.
    pub fn range(&self) -> f64 {
        self.geometric + self.mixed + self.detection + self.bias.total()
    }

    /// This echo and the others, in the order in which they are reported.
    pub fn echoes(&self) -> impl Iterator<Item = &Self> {
        std::iter::once(self).chain(&self.others)
    }
}
