//! Robust losses by their weights w(u) = ρ'(u)/u, u a residual in units of its scale, and the gate of an outlier.
//!
//! ```text
//! Huber   w = min(1, k/|u|)         Cauchy  w = 1/(1 + (u/k)²)      Tukey  w = (1 − (u/k)²)² for |u| < k, else 0
//! ```
//!
//! The default k keep 95 % of the efficiency if all errors are normal (Holland, Welsch 1977).

/// A loss that grows more slowly than the square.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Loss {
    /// Convex; an outlier pulls no harder than k.
    Huber {
        /// Where the square ends, in scales.
        k: f64,
    },
    /// An outlier pulls less the farther it lies.
    Cauchy {
        /// Where the pull is greatest, in scales.
        k: f64,
    },
    /// Beyond k an outlier does not pull at all.
    Tukey {
        /// Where the pull ends, in scales.
        k: f64,
    },
}

impl Loss {
    /// Huber's with k = 1.345.
    pub fn huber() -> Self {
        Self::Huber { k: 1.345 }
    }

    /// Cauchy's with k = 2.385.
    pub fn cauchy() -> Self {
        Self::Cauchy { k: 2.385 }
    }

    /// Tukey's with k = 4.685.
    pub fn tukey() -> Self {
        Self::Tukey { k: 4.685 }
    }

    /// w(u).
    pub fn weight(self, u: f64) -> f64 {
        match self {
            Self::Huber { k } => {
                if u.abs() > k {
                    k / u.abs()
                } else {
                    1.0
                }
            }
            Self::Cauchy { k } => 1.0 / (1.0 + (u / k).powi(2)),
            Self::Tukey { k } => (1.0 - (u / k).powi(2)).max(0.0).powi(2),
        }
    }
}

/// The size that a normal residual of standard deviation 1 exceeds with probability 1 − p: √χ²₁(p).
///
/// ```
/// let gate = catoptric_calib::lsq::gate(0.99);
/// assert!((gate - 2.575829).abs() < 1e-6);
/// ```
///
/// # Panics
///
/// If p is not between 0 and 1.
pub fn gate(probability: f64) -> f64 {
    assert!(
        probability > 0.0 && probability < 1.0,
        "a probability between 0 and 1"
    );
    // P(|u| > x) = erfc(x/√2) falls from 1 to 0; bisected, since it has no closed inverse.
    let (mut low, mut high) = (0.0, 40.0);
    while high - low > 1e-14 * high {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if libm::erfc(middle * std::f64::consts::FRAC_1_SQRT_2) > 1.0 - probability {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_one_inside_and_fall_outside() {
        for loss in [Loss::huber(), Loss::cauchy(), Loss::tukey()] {
            assert_eq!(loss.weight(0.0), 1.0);
            let weights: Vec<f64> = (0..200).map(|i| loss.weight(0.1 * f64::from(i))).collect();
            assert!(weights.is_sorted_by(|a, b| a >= b) && weights[199] < 0.1);
            assert_eq!(loss.weight(-3.0), loss.weight(3.0));
        }
    }

    #[test]
    fn gates_are_those_of_the_tables() {
        for (probability, squared) in [
            (0.5, 0.454936),
            (0.9, 2.705543),
            (0.95, 3.841459),
            (0.999, 10.827566),
        ] {
            assert!((gate(probability).powi(2) - squared).abs() < 1e-6);
        }
    }
}
