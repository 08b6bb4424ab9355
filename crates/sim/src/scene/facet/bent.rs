//! Mirrors that are not flat: a drawn curve, or a bow; their copies and the checks of their numbers.

use super::Facet;
use super::outline::rounded;
use crate::findings::Findings;
use crate::scene::{Exchange, Mirror};
use catoptric_cast::area_vector;
use catoptric_model::ScanGeometry;
use catoptric_model::curve::{self, Curve, CurvedSurface};
use catoptric_model::place::KeyPath;
use nalgebra::{Matrix3, Point3, Rotation3, Unit, Vector3};

/// Steepest slope of a mirror against the plane of its outline, in degrees: a steeper one is drawn as several facets.
const STEEPEST_DEG: f64 = 60.0;

/// Points of an edge at which a slope is evaluated: it is the largest at a corner, except on a cone.
const STEPS: u32 = 16;

/// Digits to which the angles and places of copies are rounded, in degrees and millimeters.
const DIGITS: f64 = 1e9;

impl Facet {
    /// How it bends, as drawn or by its bow; `None` if it is flat.
    pub(crate) fn bent(&self, corners: &[Point3<f64>]) -> Option<Curve> {
        let normal = Unit::try_new(area_vector(corners), f64::MIN_POSITIVE)?;
        self.curve.or_else(|| curve::bow(self.bow_um, corners, &normal))
    }

    /// Moves its curve with its outline, whose plane had these corners, by a rotation or a reflection.
    pub(crate) fn carry_curve(&mut self, was: &Self, scan: &ScanGeometry, by: &Matrix3<f64>) {
        let normal = |facet: &Self| {
            let corners = facet.shape.corners(scan)?;
            Unit::try_new(area_vector(&corners), f64::MIN_POSITIVE)
        };
        if self.curve.is_none() {
            return;
        }
        let (Some(old), Some(new)) = (normal(was), normal(self)) else {
            return;
        };
        let [from, to] = [old, new].map(|normal| curve::axes(&normal));
        let moved = |[x, y]: [f64; 2]| {
            let v = by * (from[0] * x + from[1] * y);
            [to[0].dot(&v), to[1].dot(&v)]
        };
        let round = |value: f64| (value * DIGITS).round() / DIGITS + 0.0;
        let Some(curve) = &mut self.curve else { return };
        let (touches_mm, axis_deg) = curve.place_mut();
        *touches_mm = moved(*touches_mm).map(round);
        if let Some(axis_deg) = axis_deg {
            let (sin, cos) = libm::sincos(axis_deg.to_radians());
            let [x, y] = moved([cos, sin]);
            *axis_deg = round(libm::atan2(y, x).to_degrees());
        }
    }

    /// Reports what is wrong with its curve or bow; `path` leads to the facet.
    pub(crate) fn check_bend(
        &self,
        mirror: &Mirror,
        scan: &ScanGeometry,
        path: &KeyPath,
        found: &mut Findings,
    ) {
        let key = match (&self.curve, self.bow_um != 0.0) {
            (None, false) => return,
            (Some(_), true) => {
                found.add(
                    &path.key("bow_um"),
                    "is given, but the mirror has a `curve`; a bow is that of a mirror that is meant to be flat",
                    "delete one of the two".to_owned(),
                );
                return;
            }
            (Some(curve), false) => path.key("curve").key(curve.radius_mm().1).key("radius_mm"),
            (None, true) => path.key("bow_um"),
        };
        if self.two_sided {
            found.add(
                &path.key("two_sided"),
                "is set, but the mirror is not flat; only the face of such a mirror reflects",
                "draw the back as a facet of its own".to_owned(),
            );
        }
        if mirror.glass.is_some_and(|glass| glass.thickness_mm > 0.0) {
            found.add(
                &key,
                "bends a mirror behind glass; `superstructure.mirror.glass` is allowed in front of flat mirrors",
                "omit the glass: a mirror that is not flat reflects at its front".to_owned(),
            );
        }
        let Some(corners) = self.shape.corners(scan) else {
            return;
        };
        self.check_slope(mirror, &corners, &key, found);
    }

    /// Checks that the surface reaches over the outline, is nowhere too steep, and is parallel to that of its body.
    fn check_slope(&self, mirror: &Mirror, corners: &[Point3<f64>], key: &KeyPath, found: &mut Findings) {
        let Some(normal) = Unit::try_new(area_vector(corners), f64::MIN_POSITIVE) else {
            return;
        };
        let Some(curve) = self.bent(corners) else {
            found.add(
                key,
                format_args!(
                    "is {}; a quarter of the mirror's longer side is the most that is allowed",
                    self.bow_um
                ),
                None,
            );
            return;
        };
        let radius = curve.radius_mm().0;
        if radius == 0.0 {
            found.add(
                key,
                "is 0; a positive radius is that of a concave mirror, a negative one that of a convex mirror",
                "for a flat mirror, omit `curve`".to_owned(),
            );
            return;
        }
        let depths = [0.0, -1e-3 * mirror.thickness_mm];
        let steep = |curve: &Curve| {
            depths
                .iter()
                .any(|ahead| steepest(curve, corners, &normal, *ahead).is_none())
        };
        if !steep(&curve) {
            return;
        }
        // The smallest radius that would do, by doubling and halving.
        let scaled = |radius_mm: f64| with_radius(&curve, radius_mm.copysign(radius));
        let mut enough = radius.abs();
        while steep(&scaled(enough)) && enough < MOST_MM {
            enough *= 2.0;
        }
        let mut low = 0.5 * enough;
        for _ in 0..40 {
            let middle = 0.5 * (low + enough);
            if steep(&scaled(middle)) {
                low = middle;
            } else {
                enough = middle;
            }
        }
        let least = (enough * 1e3).ceil() * 1e-3;
        found.add(
            key,
            format_args!(
                "is {}: within its outline the mirror would turn by more than {STEEPEST_DEG}° from its plane; {} is allowed",
                if self.curve.is_some() { rounded(radius) } else { self.bow_um },
                if self.curve.is_none() {
                    "a smaller bow".to_owned()
                } else if radius > 0.0 {
                    format!("{} or more", rounded(least))
                } else {
                    format!("{} or less", rounded(-least))
                }
            ),
            "make the outline smaller, or draw several facets".to_owned(),
        );
    }
}

/// Largest radius, in millimeters.
const MOST_MM: f64 = catoptric_model::limits::FAR_MM;

/// The same curve with another radius.
fn with_radius(curve: &Curve, radius_mm: f64) -> Curve {
    let mut other = *curve;
    match &mut other {
        Curve::Cylinder(c) => c.radius_mm = radius_mm,
        Curve::Cone(c) => c.radius_mm = radius_mm,
        Curve::Sphere(c) | Curve::Paraboloid(c) => c.radius_mm = radius_mm,
    }
    other
}

/// Largest slope of a surface over an outline, in radians; `None` if it does not reach over it or is too steep.
fn steepest(curve: &Curve, corners: &[Point3<f64>], normal: &Unit<Vector3<f64>>, ahead: f64) -> Option<f64> {
    let surface: CurvedSurface = curve.over(corners, normal, ahead)?;
    let mut most = 0.0_f64;
    for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        for step in 0..STEPS {
            let place = a + (b - a) * (f64::from(step) / f64::from(STEPS));
            most = most.max(surface.normal_at(&surface.over(&place)?).angle(normal));
        }
    }
    (most <= STEEPEST_DEG.to_radians()).then_some(most)
}

/// A turn about the scanner's axis, by an angle in degrees.
pub(crate) fn turn(turn_deg: f64) -> Matrix3<f64> {
    Rotation3::from_axis_angle(&Vector3::z_axis(), turn_deg.to_radians()).into_inner()
}

/// A mirror image.
pub(crate) fn image(exchange: Exchange) -> Matrix3<f64> {
    Matrix3::from_diagonal(&match exchange {
        Exchange::LeftRight => Vector3::new(1.0, -1.0, 1.0),
        Exchange::UpDown => Vector3::new(1.0, 1.0, -1.0),
    })
}

#[cfg(test)]
mod tests;
