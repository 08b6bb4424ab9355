//! Conversion from f64 to f32: to nearest, and rounded outward.

/// Half a unit in the last place of 1 in f32: the relative error of one operation.
pub(crate) const ROUNDING: f32 = f32::EPSILON / 2.0;

/// Rounds to the nearest f32.
// Rounding is the purpose.
#[allow(clippy::cast_possible_truncation)]
pub(crate) fn rounded(x: f64) -> f32 {
    x as f32
}

/// Rounds up to an f32.
pub(crate) fn upwards(x: f64) -> f32 {
    let near = rounded(x);
    if f64::from(near) < x { near.next_up() } else { near }
}

/// Rounds down to an f32.
pub(crate) fn downwards(x: f64) -> f32 {
    let near = rounded(x);
    if f64::from(near) > x {
        near.next_down()
    } else {
        near
    }
}

/// Returns the tightest f32 interval around an f64.
pub(crate) fn around(x: f64) -> (f32, f32) {
    (downwards(x), upwards(x))
}
