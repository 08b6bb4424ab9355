//! From f64 to f32: to the nearest, and outwards.

/// Half a unit in the last place of 1 in f32: the relative error of one operation.
pub(crate) const ROUNDING: f32 = f32::EPSILON / 2.0;

/// The nearest number in f32.
// Rounding is what it is for.
#[allow(clippy::cast_possible_truncation)]
pub(crate) fn rounded(x: f64) -> f32 {
    x as f32
}

/// The nearest number in f32 that is not less.
pub(crate) fn upwards(x: f64) -> f32 {
    let near = rounded(x);
    if f64::from(near) < x { near.next_up() } else { near }
}

/// The nearest number in f32 that is not greater.
pub(crate) fn downwards(x: f64) -> f32 {
    let near = rounded(x);
    if f64::from(near) > x {
        near.next_down()
    } else {
        near
    }
}

/// An interval of f32 around a number of f64.
pub(crate) fn around(x: f64) -> (f32, f32) {
    (downwards(x), upwards(x))
}
