//! Gate on the mean error over independent trials, θ_a and φ apart.
//!
//! ```text
//! x_i   mean over the scored elements of trial i of cos φ·δθ, or of δφ
//! t     x̄·√n / s: Student's t with n − 1 degrees of freedom without a bias; two-sided, half of the rate for each axis
//! ```

use super::{Failure, Significance, Trial};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Gate on the mean error: a constant error of either angle, which neither ANEES nor coverage finds where it is within what
/// is stated.
///
/// It uses the mean error of all scored elements of a trial and no covariance. Errors that cancel over the elements, such as
/// opposite ones of two mirrors, are not found.
#[derive(Debug, Clone, Copy)]
pub struct Bias<'t>(&'t [Trial]);

/// Names of the axes, in the order of the errors.
const AXES: [&str; 2] = [
    "the mean error of θ_a (cos φ·δθ, in degrees)",
    "the mean error of φ (in degrees)",
];

impl<'t> Bias<'t> {
    /// The gate over some trials.
    pub fn over(trials: &'t [Trial]) -> Self {
        Self(trials)
    }

    /// Returns the mean errors along θ_a and φ, in radians, unless one of them is significantly above `within_rad`; 0
    /// allows no bias at all.
    ///
    /// # Errors
    /// [`Failure::Gate`] if one is significantly above it; [`Failure::Nothing`] with fewer than three trials that have
    /// scored elements.
    pub fn gate(self, within_rad: f64, significance: Significance) -> Result<[f64; 2], Failure> {
        let with: Vec<(u64, [f64; 2], usize)> = self
            .0
            .iter()
            .filter_map(|t| Some((t.seed, t.mean_error?, t.drawn.map_or(0, |d| d.beam))))
            .collect();
        let n = with.len();
        if n < 3 {
            let words = format!("{n} trials have scored elements, and a mean error takes three");
            return Err(Failure::Nothing(words));
        }
        let quantile = quantile(n, significance.among(2));
        let mut means = [0.0; 2];
        for (axis, what) in AXES.into_iter().enumerate() {
            let values = || with.iter().map(|(_, error, _)| error[axis]);
            let mean = values().sum::<f64>() / n as f64;
            let variance = values().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1) as f64;
            let limit = within_rad + quantile * (variance / n as f64).sqrt();
            means[axis] = mean;
            if mean.abs() <= limit {
                continue;
            }
            // The trial that contributes most to the mean.
            let worst = with
                .iter()
                .max_by(|(_, a, _), (_, b, _)| (a[axis] * mean).total_cmp(&(b[axis] * mean)));
            let (seed, beam) = worst.map_or((0, 0), |(seed, _, beam)| (*seed, *beam));
            return Err(Failure::Gate {
                what,
                found: mean.to_degrees(),
                low: -limit.to_degrees(),
                high: limit.to_degrees(),
                trials: n,
                significance,
                meaning: "biased: the errors do not average out over experiments",
                seed,
                beam,
            });
        }
        Ok(means)
    }

    /// Same as [`gate`](Self::gate), but panics.
    ///
    /// # Panics
    /// With the text of the failure.
    #[track_caller]
    pub fn assert(self, within_rad: f64, significance: Significance) {
        if let Err(failure) = self.gate(within_rad, significance) {
            panic!("{failure}");
        }
    }
}

/// Two-sided quantile of Student's t over n values.
fn quantile(n: usize, significance: Significance) -> f64 {
    StudentsT::new(0.0, 1.0, (n - 1) as f64)
        .map_or(f64::NAN, |d| d.inverse_cdf(1.0 - 0.5 * significance.rate()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use catoptric_fixtures::Noise;

    /// Trials with errors of a standard deviation of 0.03°, shifted by constants.
    fn trials(n: u64, seed: u64, shift_deg: [f64; 2]) -> Vec<Trial> {
        let mut noise = Noise::new(seed);
        let mut of = |shift: f64| (shift + 0.03 * noise.draw()).to_radians();
        (1..=n)
            .map(|seed| Trial {
                seed,
                drawn: None,
                mean_error: Some(shift_deg.map(&mut of)),
            })
            .collect()
    }

    #[test]
    fn a_constant_error_of_either_angle_is_found() {
        for shift in [[0.05, 0.0], [0.0, -0.05]] {
            let failure = Bias::over(&trials(40, 1, shift))
                .gate(0.0, Significance::PER_MILLE)
                .expect_err("it is biased");
            let axis = if shift[0] > 0.0 { "θ_a" } else { "φ (" };
            assert!(failure.to_string().contains(axis), "{failure}");
            // Within what is allowed it passes.
            let within = 0.06_f64.to_radians();
            Bias::over(&trials(40, 1, shift)).assert(within, Significance::PER_MILLE);
        }
        Bias::over(&trials(40, 1, [0.0; 2])).assert(0.0, Significance::PER_MILLE);
        assert!(matches!(
            Bias::over(&trials(2, 1, [0.0; 2])).gate(0.0, Significance::PER_MILLE),
            Err(Failure::Nothing(_))
        ));
    }

    #[test]
    fn the_rate_of_false_alarms_is_the_significance() {
        // Of 2000 unbiased samples 5 % alarm: 100, within five standard deviations of a binomial number.
        let rate = Significance::new(0.05).expect("between 0 and 1");
        let alarms = (1..=2000)
            .filter(|seed| Bias::over(&trials(12, *seed, [0.0; 2])).gate(0.0, rate).is_err())
            .count();
        assert!((51..=149).contains(&alarms), "{alarms}");
    }
}
