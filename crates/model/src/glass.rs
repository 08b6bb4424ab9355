//! Glass in front of mirrors: how far it sets a mirror back, and how much it delays the light.

use crate::beam::{self, Deflection};
use crate::limits;
use nalgebra::{Unit, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Glass in front of a mirror's reflecting face, as its data sheet states. The drawing shows the front of the glass.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GlassSheet {
    /// Thickness, in millimeters.
    #[schemars(range(min = 0.0, max = limits::THICKNESS_MM))]
    pub thickness_mm: f64,
    /// Uncertainty of the thickness, 1σ, in millimeters; the same glass is in front of all mirrors.
    #[serde(default, skip_serializing_if = "is_exact")]
    #[schemars(range(min = 0.0, max = limits::THICKNESS_MM))]
    pub thickness_sd_mm: f64,
    /// Refractive index.
    #[serde(default = "float_glass")]
    #[schemars(range(min = 1.0, max = limits::INDEX))]
    pub index: f64,
}

/// What a plate of glass does to a range, per meter of its thickness. See [`GlassSheet::effect`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct GlassEffect {
    /// How much farther along the beam a front-surface mirror would have to be that sends it off along the same line.
    pub setback: f64,
    /// How much longer the range is than that mirror's.
    pub delay: f64,
}

impl GlassEffect {
    /// Change of the range to a plane with this normal, for a beam that is deflected into a direction.
    pub fn on_plane(
        &self,
        beam: &Unit<Vector3<f64>>,
        exit: &Unit<Vector3<f64>>,
        normal: &Unit<Vector3<f64>>,
    ) -> f64 {
        self.delay + self.setback * (1.0 - normal.dot(beam) / normal.dot(exit))
    }
}

impl GlassSheet {
    /// The front-surface mirror that sends a beam off as one behind this glass does, whose front the beam meets at the
    /// deflection's distance; and how much longer, in meters, the range is than that mirror's.
    pub fn as_bare(&self, beam_azimuth: f64, deflection: &Deflection) -> (Deflection, f64) {
        let effect = self.stated(
            &beam::direction(beam_azimuth),
            &deflection.exit_direction(beam_azimuth),
        );
        let set_back = Deflection {
            distance: deflection.distance + effect.setback,
            ..*deflection
        };
        (set_back, effect.delay)
    }

    /// The effect of one meter of this glass on a beam that is deflected into a direction.
    ///
    /// Light enters at incidence α, travels t/cos α′ twice, n times slower, with sin α′ = sin α/n, and leaves t·2·tan α′
    /// aside in the direction of an ordinary reflection. A front-surface mirror t/(n·cos α′) farther along the beam sends
    /// it off along the same line; the range is longer by 2·t·(n − 1/n)/cos α′ than with that mirror.
    pub fn effect(&self, beam: &Unit<Vector3<f64>>, exit: &Unit<Vector3<f64>>) -> GlassEffect {
        let n = self.index;
        let sin_squared = 0.5 * (1.0 + beam.dot(exit));
        let cos_inside = (1.0 - sin_squared / (n * n)).sqrt();
        GlassEffect {
            setback: 1.0 / (n * cos_inside),
            delay: 2.0 * (n - 1.0 / n) / cos_inside,
        }
    }

    /// How far aside, per meter of this glass, a beam leaves from where it enters. Nearer to the edge its light is lost in
    /// the rim.
    pub fn walk(&self, beam: &Unit<Vector3<f64>>, exit: &Unit<Vector3<f64>>) -> f64 {
        let sin_inside = (0.5 * (1.0 + beam.dot(exit))).sqrt() / self.index;
        2.0 * sin_inside / (1.0 - sin_inside * sin_inside).sqrt()
    }

    /// Relative change of both effects per change of the cosine between beam and exit direction.
    pub fn change(&self, beam: &Unit<Vector3<f64>>, exit: &Unit<Vector3<f64>>) -> f64 {
        let n_squared = self.index * self.index;
        let sin_squared = 0.5 * (1.0 + beam.dot(exit));
        0.25 / (n_squared - sin_squared)
    }

    /// The effect of the glass at its stated thickness, in meters.
    pub fn stated(&self, beam: &Unit<Vector3<f64>>, exit: &Unit<Vector3<f64>>) -> GlassEffect {
        let one = self.effect(beam, exit);
        let thickness = 1e-3 * self.thickness_mm;
        GlassEffect {
            setback: thickness * one.setback,
            delay: thickness * one.delay,
        }
    }
}

/// Float glass at 905 nm.
fn float_glass() -> f64 {
    1.51
}

impl Default for GlassSheet {
    fn default() -> Self {
        Self {
            thickness_mm: 0.0,
            thickness_sd_mm: 0.0,
            index: float_glass(),
        }
    }
}

/// An exact thickness has no uncertainty in files.
fn is_exact(sd: &f64) -> bool {
    *sd == 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mirror;

    /// Against the path itself: refracted, reflected by the silver, refracted again.
    #[test]
    fn a_plate_is_a_mirror_set_back_and_delayed() {
        let glass = GlassSheet {
            thickness_mm: 3.0,
            ..GlassSheet::default()
        };
        let front = Unit::new_normalize(Vector3::new(-0.6, 0.2, 0.7));
        let beam = Vector3::x_axis();
        let exit = mirror::reflect(&beam, &front);
        let cos = -front.dot(&beam);
        let along = beam.into_inner() + front.into_inner() * cos;
        let sin_inside = along.norm() / glass.index;
        let cos_inside = (1.0 - sin_inside * sin_inside).sqrt();
        let walk = along.normalize() * (2.0 * 3e-3 * sin_inside / cos_inside);
        assert!((3e-3 * glass.walk(&beam, &exit) - walk.norm()).abs() < 1e-15);
        let path = 2.0 * glass.index * 3e-3 / cos_inside;
        let found = glass.stated(&beam, &exit);
        // From where the light enters: along the beam to the mirror set back, then along the exit direction.
        let to_line = beam.into_inner() * found.setback - walk;
        let beyond = -to_line.dot(&exit);
        assert!(
            (to_line + exit.into_inner() * beyond).norm() < 1e-15,
            "on one line"
        );
        // Both end where that line meets the plane of the exit point: the plate's path and the mirror's.
        assert!((found.setback + found.delay + beyond - path).abs() < 1e-15);
        // At 45°, n = 1.51: 3.4 mm of path for each millimeter.
        let diagonal = Unit::new_normalize(Vector3::new(-1.0, 1.0, 0.0));
        let one = glass.effect(&beam, &mirror::reflect(&beam, &diagonal));
        assert!((2.0 * one.setback + one.delay - 3.42).abs() < 5e-3, "{one:?}");
        let turned = Unit::new_normalize(exit.into_inner() + Vector3::new(1e-6, 2e-6, -1e-6));
        let (before, after) = (glass.effect(&beam, &exit), glass.effect(&beam, &turned));
        let change = glass.change(&beam, &exit) * beam.dot(&(turned.into_inner() - exit.into_inner()));
        assert!((after.setback / before.setback - 1.0 - change).abs() < 1e-4 * change.abs());
        assert!((after.delay / before.delay - 1.0 - change).abs() < 1e-4 * change.abs());
    }
}
