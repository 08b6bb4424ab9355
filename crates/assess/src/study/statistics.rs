//! Exact intervals and tests: χ², Clopper–Pearson, Hotelling.

use statrs::distribution::{Beta, ChiSquared, ContinuousCDF, FisherSnedecor};

/// Bounds that contain the mean of n squared errors in two dimensions, divided by 2, with the given probability if their
/// covariance is honest: χ² quantiles with 2n degrees of freedom, divided by 2n.
pub(crate) fn mean_bounds(n: usize, probability: f64) -> [f64; 2] {
    let freedom = 2.0 * n as f64;
    let outside = 0.5 * (1.0 - probability);
    ChiSquared::new(freedom).map_or([f64::NAN; 2], |d| {
        [
            d.inverse_cdf(outside) / freedom,
            d.inverse_cdf(1.0 - outside) / freedom,
        ]
    })
}

/// The 95 % interval of Clopper and Pearson for a share, given `hits` out of n.
pub(super) fn clopper_pearson(hits: usize, n: usize) -> [f64; 2] {
    share_bounds(hits, n, 0.95)
}

/// The same interval at another probability.
pub(crate) fn share_bounds(hits: usize, n: usize, probability: f64) -> [f64; 2] {
    let outside = 0.5 * (1.0 - probability);
    let (k, n) = (hits as f64, n as f64);
    let quantile = |a: f64, b: f64, p: f64| Beta::new(a, b).map_or(f64::NAN, |d| d.inverse_cdf(p));
    let low = if hits == 0 {
        0.0
    } else {
        quantile(k, n - k + 1.0, outside)
    };
    let high = if k >= n {
        1.0
    } else {
        quantile(k + 1.0, n - k, 1.0 - outside)
    };
    [low, high]
}

/// Probability of a mean error at least as large if there is no bias: Hotelling's T² = n·x̄ᵀS⁻¹x̄ in two dimensions; T²
/// times (n − 2)/(2(n − 1)) follows Fisher's F with 2 and n − 2 degrees of freedom. NaN for fewer than four errors.
pub(super) fn bias_p_value(errors: &[[f64; 2]]) -> f64 {
    let n = errors.len() as f64;
    if errors.len() < 4 {
        return f64::NAN;
    }
    let mean = [0, 1].map(|i| errors.iter().map(|e| e[i]).sum::<f64>() / n);
    let moment = |i: usize, j: usize| {
        errors
            .iter()
            .map(|e| (e[i] - mean[i]) * (e[j] - mean[j]))
            .sum::<f64>()
            / (n - 1.0)
    };
    let (a, b, d) = (moment(0, 0), moment(0, 1), moment(1, 1));
    let determinant = a * d - b * b;
    if determinant <= 0.0 {
        return f64::NAN;
    }
    let squared =
        n * (d * mean[0] * mean[0] - 2.0 * b * mean[0] * mean[1] + a * mean[1] * mean[1]) / determinant;
    let f = squared * (n - 2.0) / (2.0 * (n - 1.0));
    FisherSnedecor::new(2.0, n - 2.0).map_or(f64::NAN, |d| d.sf(f))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        // χ² with 200 degrees of freedom: 152.241 and 255.264 at 0.5 and 99.5 %, of 100 errors in two dimensions.
        let [low, high] = mean_bounds(100, 0.99);
        assert!((200.0 * low - 152.241).abs() < 1e-3 && (200.0 * high - 255.264).abs() < 1e-3);
        // Clopper–Pearson intervals for 0 of 10 and 8 of 10 (Newcombe 1998).
        let [low, high] = clopper_pearson(0, 10);
        assert!(low == 0.0 && (high - 0.308_497).abs() < 1e-5);
        let [low, high] = clopper_pearson(8, 10);
        assert!((low - 0.443_904).abs() < 1e-5 && (high - 0.974_789).abs() < 1e-5);
    }

    #[test]
    fn a_bias_is_detected_and_its_absence_too() {
        let around = |x: f64| {
            let errors = [
                [1.0, 0.3],
                [-1.0, 0.2],
                [0.2, -1.0],
                [-0.2, 1.1],
                [0.5, -0.4],
                [-0.5, -0.2],
            ];
            bias_p_value(&errors.map(|e| [e[0] + x, e[1]]))
        };
        assert!(around(0.0) > 0.9 && around(5.0) < 1e-3);
        assert!(bias_p_value(&[[1.0, 0.0]; 3]).is_nan());
    }
}
