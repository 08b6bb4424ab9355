//! General statistics used by scores: moments, percentiles, Mahalanobis length, best rotation.

use nalgebra::{Matrix2, Matrix3, Rotation3, Unit, Vector2, Vector3};

type Direction = Unit<Vector3<f64>>;

/// 95 % quantile of χ² with two degrees of freedom: −2·ln 0.05.
pub const CHI_SQUARED_95: f64 = 5.991_464_547_107_979;

/// 99.9 % quantile of the same: −2·ln 0.001.
pub const CHI_SQUARED_999: f64 = 13.815_510_557_964_274;

/// Root mean square; NaN if there are no values.
pub(super) fn rms(values: impl IntoIterator<Item = f64>) -> f64 {
    mean(values.into_iter().map(|v| v * v)).sqrt()
}

/// Arithmetic mean; NaN if there are no values.
pub(super) fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, count) = values.into_iter().fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
    sum / count
}

/// Maximum; NaN if there are no values.
pub(super) fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(f64::NAN, f64::max)
}

/// Percentile of some values, interpolated linearly between order statistics.
///
/// Of n sorted values, the share p is at index p·(n − 1), counted from 0: p = 0 is the minimum, p = 1 the maximum, p = ½
/// the usual median. NaN if there are no values.
///
/// ```
/// use catoptric_assess::score::percentile;
/// assert_eq!(percentile(&[4.0, 1.0, 3.0, 2.0], 0.5), 2.5);
/// ```
pub fn percentile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let Some(last) = sorted.len().checked_sub(1) else {
        return f64::NAN;
    };
    let place = share.clamp(0.0, 1.0) * last as f64;
    // Between 0 and `last` because of the clamp, so the cast truncates only the fraction.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let below = place.floor() as usize;
    let above = (below + 1).min(last);
    sorted[below] + (place - below as f64) * (sorted[above] - sorted[below])
}

/// Squared Mahalanobis length eᵀP⁻¹e of an error under a covariance.
///
/// Zero for an error of exactly zero; infinite for any other error under a covariance that is not positive definite,
/// since such a covariance rules out errors in some direction.
pub(crate) fn mahalanobis_squared(error: &Vector2<f64>, covariance: &Matrix2<f64>) -> f64 {
    if error.norm_squared() == 0.0 {
        return 0.0;
    }
    match covariance.cholesky() {
        Some(factor) => error.dot(&factor.solve(error)),
        None => f64::INFINITY,
    }
}

/// The rotation R that best maps `from` to `to` in the sense of Wahba: it minimizes Σ‖to − R·from‖² (Kabsch).
///
/// `None` unless the directions span at least a plane: a single direction leaves the rotation about itself undetermined.
#[doc(alias = "Kabsch")]
pub(super) fn best_rotation(pairs: &[(Direction, Direction)]) -> Option<Rotation3<f64>> {
    // Directions closer together than a microradian do not determine a plane.
    const MIN_SPAN: f64 = 1e-12;
    let spread: Matrix3<f64> = pairs
        .iter()
        .map(|(from, to)| to.into_inner() * from.transpose())
        .sum();
    let svd = spread.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    if svd.singular_values[1] <= MIN_SPAN * svd.singular_values[0] {
        return None;
    }
    // Without the sign, the best orthogonal matrix may be a reflection.
    let sign = (u.determinant() * v_t.determinant()).signum();
    let rotation = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t;
    Some(Rotation3::from_matrix_unchecked(rotation))
}

/// Angle of a rotation, in radians; accurate for small angles, unlike the arc cosine of the trace.
pub(super) fn rotation_angle(rotation: &Rotation3<f64>) -> f64 {
    let m = rotation.matrix();
    let twice_sine_axis = Vector3::new(
        m[(2, 1)] - m[(1, 2)],
        m[(0, 2)] - m[(2, 0)],
        m[(1, 0)] - m[(0, 1)],
    );
    twice_sine_axis.norm().atan2(m.trace() - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_interpolate_between_order_statistics() {
        let values: Vec<f64> = (0..=20).rev().map(f64::from).collect();
        assert_eq!(percentile(&values, 0.0), 0.0);
        assert_eq!(percentile(&values, 0.5), 10.0);
        assert_eq!(percentile(&values, 0.95), 19.0);
        assert_eq!(percentile(&values, 1.0), 20.0);
        assert!((percentile(&[1.0, 2.0], 0.95) - 1.95).abs() < 1e-15);
        assert_eq!(percentile(&[7.0], 0.95), 7.0);
        assert!(percentile(&[], 0.5).is_nan());
    }

    #[test]
    fn mahalanobis_of_a_known_ellipse() {
        let p = Matrix2::new(4.0, 0.0, 0.0, 9.0);
        assert!((mahalanobis_squared(&Vector2::new(2.0, 3.0), &p) - 2.0).abs() < 1e-15);
        // Correlated: P⁻¹ of [[2,1],[1,2]] is [[2,−1],[−1,2]]/3.
        let p = Matrix2::new(2.0, 1.0, 1.0, 2.0);
        assert!((mahalanobis_squared(&Vector2::new(1.0, -1.0), &p) - 2.0).abs() < 1e-15);
        assert_eq!(mahalanobis_squared(&Vector2::zeros(), &Matrix2::zeros()), 0.0);
        assert_eq!(
            mahalanobis_squared(&Vector2::new(1e-9, 0.0), &Matrix2::zeros()),
            f64::INFINITY
        );
    }

    #[test]
    fn best_rotation_is_recovered_however_small() {
        for angle in [1e-9, 1e-3, 1.0, 3.0] {
            let axis = Unit::new_normalize(Vector3::new(0.3, -0.5, 0.8));
            let given = Rotation3::from_axis_angle(&axis, angle);
            let pairs: Vec<_> = [
                Vector3::new(1.0, 0.2, 0.1),
                Vector3::new(-0.3, 1.0, 0.5),
                Vector3::new(0.0, 0.3, -1.0),
            ]
            .map(Unit::new_normalize)
            .iter()
            .map(|v| (*v, Unit::new_unchecked(given * v.into_inner())))
            .collect();
            let found = best_rotation(&pairs).expect("three directions span space");
            assert!((rotation_angle(&found) - angle).abs() < 1e-14, "{angle}");
            assert!((found.matrix() - given.matrix()).norm() < 1e-14);
        }
    }

    #[test]
    fn one_direction_does_not_determine_a_rotation() {
        let v = Unit::new_normalize(Vector3::new(0.1, 0.2, 0.3));
        assert!(best_rotation(&[(v, v), (v, v)]).is_none());
        assert!(best_rotation(&[]).is_none());
    }
}
