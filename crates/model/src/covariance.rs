//! Whether a matrix can be a covariance.

use nalgebra::DMatrix;

/// Negative eigenvalue, relative to the largest one, that rounding can explain; and so with differences across the diagonal.
const TOLERANCE: f64 = 1e-9;

/// Checks that N × N numbers are finite, symmetric and positive semidefinite; the error continues from "the covariance".
///
/// # Errors
/// What is wrong with them.
pub fn check(size: usize, entry: impl Fn(usize, usize) -> f64) -> Result<(), String> {
    let c = DMatrix::from_fn(size, size, entry);
    if !c.iter().all(|x| x.is_finite()) {
        return Err("contains a value that is not a number".to_owned());
    }
    if size == 0 {
        return Ok(());
    }
    if (&c - c.transpose()).amax() > TOLERANCE * c.amax() {
        return Err("is not symmetric".to_owned());
    }
    if let Some(negative) = c.diagonal().iter().find(|&&x| x < 0.0) {
        return Err(format!("has the negative variance {negative:e}"));
    }
    // Angles and shifts have different magnitudes: scaled to correlations, one tolerance suits both.
    let scale = c.diagonal().map(|x| if x > 0.0 { x.sqrt().recip() } else { 1.0 });
    let correlation = DMatrix::from_fn(size, size, |i, j| c[(i, j)] * scale[i] * scale[j]);
    if correlation.symmetric_eigenvalues().min() < -TOLERANCE {
        return Err("is not positive semi-definite".to_owned());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::check;

    #[test]
    fn only_symmetric_semidefinite_matrices_are_covariances() {
        let of = |c: [[f64; 2]; 2]| check(2, move |i, j| c[i][j]);
        assert_eq!(of([[4.0, 1.0], [1.0, 1.0]]), Ok(()));
        assert_eq!(of([[1e-20, 1e-10], [1e-10, 1.0]]), Ok(()));
        assert_eq!(of([[0.0; 2]; 2]), Ok(()));
        for (c, word) in [
            ([[1.0, 0.5], [0.4, 1.0]], "symmetric"),
            ([[-1.0, 0.0], [0.0, 1.0]], "negative variance"),
            ([[1.0, 2.0], [2.0, 1.0]], "semi-definite"),
            ([[f64::NAN, 0.0], [0.0, 1.0]], "not a number"),
        ] {
            assert!(of(c).expect_err(word).contains(word));
        }
        assert_eq!(check(0, |_, _| 0.0), Ok(()));
    }
}
