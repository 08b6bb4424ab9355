//! Logarithms of small probabilities.

use super::evidence::Statistic;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use statrs::function::gamma::ln_gamma;

/// Probability below which the distribution function has lost its digits.
const SMALLEST: f64 = 1e-250;

impl Statistic {
    /// ln of the probability of a χ² at least as large; 0 without degrees of freedom.
    pub(super) fn ln_p(&self) -> f64 {
        if self.freedom <= 0.0 || self.chi_squared <= 0.0 {
            return 0.0;
        }
        let p = ChiSquared::new(self.freedom).map_or(1.0, |d| d.sf(self.chi_squared));
        if p > SMALLEST {
            return libm::log(p);
        }
        // The leading terms of the incomplete gamma function for a large argument.
        let (shape, x) = (0.5 * self.freedom, 0.5 * self.chi_squared);
        -x + (shape - 1.0) * libm::log(x) - ln_gamma(shape) - libm::log(1.0 - ((shape - 1.0) / x).min(0.5))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tail_goes_on_where_the_distribution_function_ends() {
        let ln_p = |chi_squared: f64, freedom: f64| Statistic { chi_squared, freedom }.ln_p();
        // Two degrees of freedom: exp(−x/2).
        for x in [1.0, 100.0, 1000.0, 5000.0] {
            assert!((ln_p(x, 2.0) + 0.5 * x).abs() < 1e-9 * x, "{x}: {}", ln_p(x, 2.0));
        }
        // Four: (1 + x/2)·exp(−x/2).
        let exact = |x: f64| libm::log(1.0 + 0.5 * x) - 0.5 * x;
        for x in [100.0, 1500.0, 5000.0] {
            assert!((ln_p(x, 4.0) - exact(x)).abs() < 1e-4, "{x}: {}", ln_p(x, 4.0));
        }
        assert_eq!(ln_p(3.0, 0.0), 0.0);
    }
}
