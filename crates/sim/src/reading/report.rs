//! What the scanner reports in one scan: everything by chance, then rounding and codes.

use super::{Return, Sensor};
use crate::scene::ErrorModel;

/// Most echoes of a beam that have their own chance of being detected.
pub const MAX_ECHOES: usize = 8;

/// Everything by chance in one reading, each contribution by itself.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Chance {
    /// Constant of the pose, in metres.
    pub drift: f64,
    /// Constant of the beam in the pose, in metres.
    pub element: f64,
    /// What the scanner is off while it gets warm, in metres.
    pub warm_up: f64,
    /// Noise shared with the readings before, in metres.
    pub correlated: f64,
    /// Step by interference, in metres.
    pub interference: f64,
    /// White noise, a standard normal deviate: times [`Return::noise_sd`].
    pub noise: f64,
    /// Whether the reading is lost, a uniform deviate: below `errors.dropout` it is.
    pub dropout: f64,
    /// Whether each echo is detected, uniform deviates: below [`Return::probability`] it is.
    pub detection: [f64; MAX_ECHOES],
}

impl Sensor {
    /// A reading of one scan, in metres: the beam's range with everything by chance, rounded, or a code.
    ///
    /// What is no range stays none: noise never touches a code.
    pub fn read(&self, found: Option<&Return>, chance: &Chance) -> f64 {
        use catoptric_model::range::{INVALID, NO_RETURN};
        let detected = self.detected(found, chance).next();
        let Some(found) = detected else { return NO_RETURN };
        if self.errors.model != ErrorModel::None && chance.dropout < self.errors.dropout {
            return INVALID;
        }
        self.report(found, chance)
    }

    /// All echoes of a reading that are reported, in metres, nearest first; a lost reading has none.
    ///
    /// What is by chance in a reading is common to its echoes.
    pub fn read_all(&self, found: Option<&Return>, chance: &Chance) -> Vec<f64> {
        if self.errors.model != ErrorModel::None && chance.dropout < self.errors.dropout {
            return Vec::new();
        }
        self.detected(found, chance)
            .take(self.limits.echoes as usize)
            .map(|echo| self.report(echo, chance))
            .collect()
    }

    /// The echoes of a reading that are detected, in the order in which they are reported.
    fn detected<'a>(
        &self,
        found: Option<&'a Return>,
        chance: &'a Chance,
    ) -> impl Iterator<Item = &'a Return> + use<'a> {
        let echoes = found.into_iter().flat_map(Return::echoes);
        echoes
            .zip(chance.detection)
            .filter(|(echo, chance)| *chance < echo.probability)
            .map(|(echo, _)| echo)
    }

    /// An echo's range as it is reported, in metres, or the code of one that cannot be.
    fn report(&self, found: &Return, chance: &Chance) -> f64 {
        use catoptric_model::range::{NO_RETURN, TOO_CLOSE};
        if self.errors.model == ErrorModel::None {
            return if found.range() < self.limits.range_min_m {
                TOO_CLOSE
            } else {
                found.range()
            };
        }
        let white = found.range() + chance.drift + found.noise_sd * chance.noise;
        let range = white + (chance.warm_up + chance.correlated + chance.interference + chance.element);
        let step = self.errors.quantization_mm * 1e-3;
        let range = if step > 0.0 {
            (range / step).round() * step
        } else {
            range
        };
        if range < self.limits.range_min_m {
            TOO_CLOSE
        } else if range > self.limits.range_max_m {
            NO_RETURN
        } else {
            range
        }
    }
}
