//! A mirror behind glass: the optical path in the glass, where light leaves it, and what its front reflects.
//!
//! Light enters a plane-parallel plate of thickness t and index n at incidence θ, is refracted to sin θ′ = sin θ / n,
//! reflected at the silver, and leaves the front parallel to the light that a front-surface mirror would reflect: the
//! direction is unchanged. In the glass it travels t/cos θ′ twice, n times slower.

use crate::scene::Glass;
use nalgebra::{Unit, Vector3};

/// What a plate of glass does to one ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passage {
    /// From the entry point to where the ray hits the silver, in meters.
    pub to_silver: Vector3<f64>,
    /// From the entry point to the exit point along the front, in meters: its length is 2·t·tan θ′.
    pub walk: Vector3<f64>,
    /// Optical path in the glass, 2·n·t/cos θ′, in meters.
    pub path: f64,
    /// Share of unpolarized light that the front reflects.
    pub fresnel: f64,
}

/// The path through the glass of a ray that hits a front with a given normal.
///
/// Snell: the direction in the glass is u/n − (cos θ′ − cos θ/n)·m, with the normal m on the ray's side.
pub fn pass(glass: &Glass, direction: &Unit<Vector3<f64>>, normal: &Unit<Vector3<f64>>) -> Passage {
    let (n, thickness) = (glass.index, glass.thickness_mm * 1e-3);
    let cos = -normal.dot(direction);
    let along = direction.into_inner() + normal.into_inner() * cos;
    let sin_inside = along.norm() / n;
    let cos_inside = (1.0 - sin_inside * sin_inside).sqrt();
    let half_walk = along * (thickness / (n * cos_inside));
    Passage {
        to_silver: half_walk - normal.into_inner() * thickness,
        walk: half_walk * 2.0,
        path: 2.0 * n * thickness / cos_inside,
        fresnel: fresnel(n, cos, cos_inside),
    }
}

/// Share of unpolarized light that is reflected on entering a medium of index n (Fresnel):
/// ½·[((cos θ − n cos θ′)/(cos θ + n cos θ′))² + ((n cos θ − cos θ′)/(n cos θ + cos θ′))²].
fn fresnel(n: f64, cos: f64, cos_inside: f64) -> f64 {
    let across = (cos - n * cos_inside) / (cos + n * cos_inside);
    let within = (n * cos - cos_inside) / (n * cos + cos_inside);
    0.5 * (across * across + within * within)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(angle: f64, index: f64, thickness_mm: f64) -> Passage {
        let direction = Unit::new_normalize(Vector3::new(libm::sin(angle), 0.0, -libm::cos(angle)));
        let glass = Glass {
            index,
            thickness_mm,
            ghost: false,
        };
        pass(&glass, &direction, &Vector3::z_axis())
    }

    #[test]
    fn the_numbers_of_a_plate_at_45_degrees() {
        for (thickness, path, walk) in [(1.0, 3.4, 1.1), (2.0, 6.8, 2.1), (3.0, 10.3, 3.2)] {
            let found = at(std::f64::consts::FRAC_PI_4, 1.51, thickness);
            assert!((found.path * 1e3 - path).abs() < 0.05, "{found:?}");
            assert!((found.walk.norm() * 1e3 - walk).abs() < 0.05, "{found:?}");
        }
    }

    #[test]
    fn fresnel_at_its_known_angles() {
        // Face on ((n − 1)/(n + 1))²; at Brewster's angle half of ((n² − 1)/(n² + 1))²; all of it at grazing incidence.
        let n = 1.51_f64;
        assert!((at(0.0, n, 1.0).fresnel - ((n - 1.0) / (n + 1.0)).powi(2)).abs() < 1e-15);
        let brewster = 0.5 * ((n * n - 1.0) / (n * n + 1.0)).powi(2);
        assert!((at(libm::atan(n), n, 1.0).fresnel - brewster).abs() < 1e-15);
        assert!((at(std::f64::consts::FRAC_PI_2, n, 1.0).fresnel - 1.0).abs() < 1e-12);
        assert!(at(0.7, 1.0, 1.0).fresnel < 1e-30);
    }
}
