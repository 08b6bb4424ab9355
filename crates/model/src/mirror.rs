//! Plane mirrors: reflection, and the deflection of a beam in the scan plane.
//!
//! A facet {m·x = h} turns u into v = u − 2(m·u)m at distance d = h/(m·u): three numbers describe all its beams.
//! Tilting a facet by e turns the beam by 2e.

use crate::beam::Deflection;
use nalgebra::{Point3, Unit, Vector3};

/// The plane m·x = h of a facet's reflecting face; m points to the reflecting side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MirrorPlane {
    /// Unit normal m on the reflecting side.
    pub normal: Unit<Vector3<f64>>,
    /// Signed distance h of the plane from the origin along m, in meters.
    pub offset: f64,
}

/// Direction after reflection at a mirror with normal m: u − 2(m·u)m.
pub fn reflect(u: &Unit<Vector3<f64>>, m: &Unit<Vector3<f64>>) -> Unit<Vector3<f64>> {
    Unit::new_unchecked(u.into_inner() - m.into_inner() * (2.0 * m.dot(u)))
}

/// Normal of the mirror that reflects u into v, on its reflecting side; `None` if v = u.
pub fn normal_between(u: &Unit<Vector3<f64>>, v: &Unit<Vector3<f64>>) -> Option<Unit<Vector3<f64>>> {
    Unit::try_new(v.into_inner() - u.into_inner(), f64::EPSILON)
}

impl MirrorPlane {
    /// The plane through a point with a given normal.
    pub fn through(point: Point3<f64>, normal: Unit<Vector3<f64>>) -> Self {
        Self {
            normal,
            offset: normal.dot(&point.coords),
        }
    }

    /// The deflection of a beam that leaves the origin in direction `u` of the plane z = 0.
    ///
    /// `None` if the beam does not hit the reflecting face. The mirror is treated as unbounded; clipping to the polygon
    /// of a real facet is up to the tracer.
    pub fn deflect(&self, u: Unit<Vector3<f64>>) -> Option<Deflection> {
        let facing = self.normal.dot(&u);
        let distance = self.offset / facing;
        (facing < 0.0 && distance > 0.0)
            .then(|| Deflection::from_exit(libm::atan2(u.y, u.x), &reflect(&u, &self.normal), distance))
    }

    /// The mirror image of a point.
    pub fn mirror_point(&self, point: &Point3<f64>) -> Point3<f64> {
        point - self.normal.into_inner() * (2.0 * (self.normal.dot(&point.coords) - self.offset))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::beam;

    #[test]
    fn reflecting_twice_is_the_identity() {
        let m = Unit::new_normalize(Vector3::new(0.3, -0.5, 0.8));
        let u = Unit::new_normalize(Vector3::new(-0.2, 0.9, 0.1));
        assert!((reflect(&reflect(&u, &m), &m).into_inner() - u.into_inner()).norm() < 1e-15);
    }

    #[test]
    fn a_tilted_facet_turns_the_beam_twice_as_far() {
        let u = beam::direction(0.0);
        let at = |tilt: f64| {
            let m = Unit::new_normalize(Vector3::new(-libm::cos(0.7 + tilt), 0.0, libm::sin(0.7 + tilt)));
            MirrorPlane::through(Point3::new(0.07, 0.0, 0.0), m)
                .deflect(u)
                .expect("it faces the beam")
        };
        let turned = beam::angle_between(&at(0.0).exit_direction(0.0), &at(1e-3).exit_direction(0.0));
        assert!((turned - 2e-3).abs() < 1e-14);
    }

    #[test]
    fn normal_between_undoes_reflect() {
        let m = Unit::new_normalize(Vector3::new(-0.6, 0.1, 0.5));
        let u = beam::direction(0.2);
        let found = normal_between(&u, &reflect(&u, &m)).expect("it is deflected");
        assert!((found.into_inner() - m.into_inner()).norm() < 1e-15);
    }
}
