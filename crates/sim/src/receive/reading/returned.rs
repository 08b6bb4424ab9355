//! What a beam receives.

use crate::light::optics::Role;
use catoptric_model::BiasTerms;

/// Maximum number of echoes of a beam that have their own probability of detection.
pub const MAX_ECHOES: usize = 8;

/// What a beam receives, each contribution separately. The reading is their sum, plus drift and noise, rounded.
#[derive(Debug, Clone, PartialEq)]
pub struct Return {
    /// Surface that dominates the echo.
    pub role: Role,
    /// Facets on the path there.
    pub facets: Vec<usize>,
    /// Path length to it, in meters: of the chief ray if that hits it, otherwise the mean over its light.
    pub geometric: f64,
    /// Cosine of the incidence on it.
    pub cos_incidence: f64,
    /// Cosine of the incidence on each of the facets: of the chief ray or the mean, as for the surface.
    pub facet_cos_incidence: Vec<f64>,
    /// Power received from it, in watts.
    pub power: f64,
    /// Share of the beam's energy that falls on it.
    pub share: f64,
    /// Power of the whole echo, whichever surfaces it comes from, in watts.
    pub received: f64,
    /// Shift of the range due to other surfaces in the same echo, in meters.
    pub mixed: f64,
    /// Shift by pulse and threshold for this surface alone, in meters; 0 unless the error model is physical. For
    /// ranging by phase it includes the missing multiples of the ambiguity, whatever the error model.
    pub detection: f64,
    /// The biases of Eqs. (3)–(5), in meters.
    pub bias: BiasTerms,
    /// Standard deviation of its noise, in meters.
    pub noise_sd: f64,
    /// Probability that the echo is detected: 1 except near a threshold with noise.
    pub probability: f64,
    /// Other echoes of the beam, each with no others of its own, in the order of `detection.echo`: what is reported if
    /// this one is missed, and in addition to it if that is "all".
    pub others: Vec<Return>,
}

impl Return {
    /// The reading without drift, noise and rounding, in meters.
    pub fn range(&self) -> f64 {
        self.geometric + self.mixed + self.detection + self.bias.total()
    }

    /// This echo and the others, in the order in which they are reported.
    pub fn echoes(&self) -> impl Iterator<Item = &Self> {
        std::iter::once(self).chain(&self.others)
    }
}
