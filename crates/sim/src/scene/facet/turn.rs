//! A turn about the scanner's axis, as shapes apply it to their numbers.

/// A turn about z, counter-clockwise.
pub(super) struct Turn {
    turn_deg: f64,
    sin: f64,
    cos: f64,
}

impl Turn {
    pub(super) fn new(turn_deg: f64) -> Self {
        let (sin, cos) = libm::sincos(turn_deg.to_radians());
        Self { turn_deg, sin, cos }
    }

    /// An azimuth, in degrees, turned and brought into ±180°.
    pub(super) fn azimuth(&self, azimuth_deg: f64) -> f64 {
        let azimuth = azimuth_deg + self.turn_deg;
        azimuth - 360.0 * (azimuth / 360.0).round()
    }

    /// A point or a vector, turned.
    pub(super) fn point(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        [self.cos * x - self.sin * y, self.sin * x + self.cos * y, z]
    }
}
