//! What the scanner reports in one scan: random effects, then rounding and codes.

use super::returned::{MAX_ECHOES, Return};
use super::sensor::Sensor;
use crate::scene::ErrorModel;

/// The random effects in one reading, each contribution separately.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RandomEffects {
    /// Constant of the pose, in meters.
    pub drift: f64,
    /// Constant of the beam in the pose, in meters.
    pub element: f64,
    /// Warm-up error of the scanner, in meters.
    pub warm_up: f64,
    /// Noise correlated with that of earlier readings, of the beam itself and of all, in meters.
    pub correlated: f64,
    /// Step due to interference, in meters.
    pub interference: f64,
    /// White noise: a standard normal deviate, to be multiplied by [`Return::noise_sd`].
    pub noise: f64,
    /// Noise of the intensity: a standard normal deviate.
    pub intensity: f64,
    /// Whether the reading is lost: a uniform deviate; lost if below `errors.dropout`.
    pub dropout: f64,
    /// Whether each echo is detected: uniform deviates; detected if below [`Return::probability`].
    pub detection: [f64; MAX_ECHOES],
}

/// [`f64::round`] without a call into the system's library, and without a branch that half of all readings take.
fn rounded(x: f64) -> f64 {
    /// Adding this rounds a number to an integer, to the even one of two that are as near.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    /// Below this it does.
    const LARGE: f64 = 2_251_799_813_685_248.0;
    if x.is_nan() || x.abs() >= LARGE {
        return x.round();
    }
    let nearest = (x + ROUND) - ROUND;
    // A tie goes away from zero; ties are rare.
    if (x - nearest).abs() == 0.5 {
        return x + 0.5_f64.copysign(x);
    }
    nearest
}

impl Sensor {
    /// A reading of one scan, in meters: the beam's range with its random effects, rounded, or a code.
    ///
    /// Noise is never applied to a code.
    pub fn read(&self, found: Option<&Return>, effects: &RandomEffects) -> f64 {
        use catoptric_model::range::NO_RETURN;
        let detected = self.detected(found, effects).next();
        detected.map_or(NO_RETURN, |found| {
            self.read_echo(found.range(), found.noise_sd, effects)
        })
    }

    /// The reading of an echo that is detected, by its [`Return::range`] and the standard deviation of its noise, in
    /// meters.
    #[inline]
    pub fn read_echo(&self, range: f64, noise_sd: f64, effects: &RandomEffects) -> f64 {
        use catoptric_model::range::INVALID;
        if self.errors.model != ErrorModel::None && effects.dropout < self.errors.dropout {
            return INVALID;
        }
        self.report(range, noise_sd, effects)
    }

    /// All echoes of a reading that are reported, in meters, nearest first; none if the reading is lost.
    ///
    /// The random effects of a reading are common to its echoes.
    pub fn read_all(&self, found: Option<&Return>, effects: &RandomEffects) -> Vec<f64> {
        if self.errors.model != ErrorModel::None && effects.dropout < self.errors.dropout {
            return Vec::new();
        }
        self.detected(found, effects)
            .take(self.limits.echoes as usize)
            .map(|echo| self.report(echo.range(), echo.noise_sd, effects))
            .collect()
    }

    /// Intensity of a reading, in counts; 0 for a code, and if the scene has none.
    pub fn intensity(&self, range: f64, found: Option<&Return>, effects: &RandomEffects) -> f64 {
        let detected = || self.detected(found, effects).next();
        match range.is_finite().then(detected).flatten() {
            Some(found) => self.counts(found.received, effects),
            None => 0.0,
        }
    }

    /// Intensities of the echoes of a reading, in the order of [`Sensor::read_all`].
    pub fn intensities(&self, ranges: &[f64], found: Option<&Return>, effects: &RandomEffects) -> Vec<f64> {
        let of = |(range, echo): (&f64, &Return)| {
            if range.is_finite() {
                self.counts(echo.received, effects)
            } else {
                0.0
            }
        };
        ranges.iter().zip(self.detected(found, effects)).map(of).collect()
    }

    /// Counts of an echo by its power.
    fn counts(&self, power: f64, effects: &RandomEffects) -> f64 {
        let Some(law) = &self.detection.intensity else {
            return 0.0;
        };
        let noisy = if self.errors.model == ErrorModel::None {
            0.0
        } else {
            law.noise_share * effects.intensity
        };
        let power = power.min(self.receiver.saturation);
        let counts = law.counts_at_threshold * power / self.receiver.threshold * (1.0 + noisy);
        rounded(counts.clamp(0.0, law.largest))
    }

    /// The echoes of a reading that are detected, in the order in which they are reported.
    fn detected<'a>(
        &self,
        found: Option<&'a Return>,
        effects: &'a RandomEffects,
    ) -> impl Iterator<Item = &'a Return> + use<'a> {
        let echoes = found.into_iter().flat_map(Return::echoes);
        echoes
            .zip(effects.detection)
            .filter(|(echo, draw)| *draw < echo.probability)
            .map(|(echo, _)| echo)
    }

    /// The range of an echo as reported, in meters, or the code of one that cannot be reported.
    #[inline]
    fn report(&self, range: f64, noise_sd: f64, effects: &RandomEffects) -> f64 {
        use catoptric_model::range::{NO_RETURN, TOO_CLOSE};
        if self.errors.model == ErrorModel::None {
            return if range < self.limits.range_min_m {
                TOO_CLOSE
            } else {
                range
            };
        }
        let white = range + effects.drift + noise_sd * effects.noise;
        let range = white + (effects.warm_up + effects.correlated + effects.interference + effects.element);
        let step = self.errors.quantization_mm * 1e-3;
        let range = if step > 0.0 {
            rounded(range / step) * step
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_is_that_of_the_standard_library() {
        let edges = [
            0.0,
            0.49999999999999994,
            0.5,
            1.5,
            2.5,
            4503599627370495.5,
            9e15,
            f64::INFINITY,
        ];
        let between = (0..100_000).map(|i| f64::from(i) * 0.0173);
        for x in edges.into_iter().chain(between) {
            assert_eq!(rounded(x), x.round(), "{x}");
            assert_eq!(rounded(-x), (-x).round(), "{}", -x);
        }
        assert!(rounded(f64::NAN).is_nan());
    }
}
