//! Mirrors that are not flat: how a surface bends away from the plane that touches it.
//!
//! In the frame of the touching plane, with z on the reflecting side, a along and v across a direction of the plane, all
//! of them are one quadric:
//!
//! ```text
//! F = c·(k_a·a² + v² + k_z·z²) − 2z − 2e·a·z = 0        c = 1/R, positive for a concave mirror
//!
//! cylinder    k_a = 0, k_z = 1, e = 0                   its axis is along a
//! cone        k_a = 0, k_z = 1 − tan²γ, e = |c|·tan γ   opening toward positive a at half angle γ
//! sphere      k_a = 1, k_z = 1, e = 0
//! paraboloid  k_a = 1, k_z = 0, e = 0                   its axis is the normal
//! ```
//!
//! The sheet that touches the plane is the one on which 1 + e·a − c·k_z·z is positive.

use crate::frame::Pose;
use crate::limits;
use crate::mirror::MirrorPlane;
use nalgebra::{Matrix3, Point3, Unit, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Shape of a mirror that touches its plane in the middle of its outline and bends away from it.
///
/// A positive radius is that of a concave mirror, a negative one that of a convex mirror.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Curve {
    /// Part of a circular cylinder.
    Cylinder(CylinderCurve),
    /// Part of a circular cone.
    Cone(ConeCurve),
    /// Part of a sphere.
    Sphere(RoundCurve),
    /// Part of a paraboloid of revolution whose vertex is where it touches the plane.
    Paraboloid(RoundCurve),
}

/// A cylinder.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CylinderCurve {
    /// Radius, in millimeters; negative for a convex mirror.
    #[schemars(range(min = -limits::FAR_MM, max = limits::FAR_MM))]
    pub radius_mm: f64,
    /// Angle of its axis in the plane from the horizontal, in degrees, counter-clockwise seen from the reflecting side.
    #[serde(default)]
    #[schemars(range(min = -limits::TURN_DEG, max = limits::TURN_DEG))]
    pub axis_deg: f64,
    /// Where it touches the plane, from the middle of the outline: horizontal, then across that, in millimeters.
    #[serde(default, skip_serializing_if = "is_middle")]
    #[schemars(inner(range(min = -limits::FAR_MM, max = limits::FAR_MM)))]
    pub touches_mm: [f64; 2],
}

/// A cone.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ConeCurve {
    /// Radius of curvature where it touches the plane, in millimeters; negative for a convex mirror.
    #[schemars(range(min = -limits::FAR_MM, max = limits::FAR_MM))]
    pub radius_mm: f64,
    /// Angle between its axis and its surface, in degrees.
    #[schemars(range(min = 0.1, max = 80.0))]
    pub half_angle_deg: f64,
    /// Angle of the line along which it touches the plane, toward the wide end, in degrees from the horizontal,
    /// counter-clockwise seen from the reflecting side.
    #[serde(default)]
    #[schemars(range(min = -limits::TURN_DEG, max = limits::TURN_DEG))]
    pub axis_deg: f64,
    /// Where that radius is, from the middle of the outline: horizontal, then across that, in millimeters.
    #[serde(default, skip_serializing_if = "is_middle")]
    #[schemars(inner(range(min = -limits::FAR_MM, max = limits::FAR_MM)))]
    pub touches_mm: [f64; 2],
}

/// A surface that looks the same all around its normal.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RoundCurve {
    /// Radius of curvature where it touches the plane, in millimeters; negative for a convex mirror.
    #[schemars(range(min = -limits::FAR_MM, max = limits::FAR_MM))]
    pub radius_mm: f64,
    /// Where it touches the plane, from the middle of the outline: horizontal, then across that, in millimeters.
    #[serde(default, skip_serializing_if = "is_middle")]
    #[schemars(inner(range(min = -limits::FAR_MM, max = limits::FAR_MM)))]
    pub touches_mm: [f64; 2],
}

// Serde passes a reference.
#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_middle(touches_mm: &[f64; 2]) -> bool {
    *touches_mm == [0.0; 2]
}

/// Axes of a facet's plane: horizontal, and across that, for its normal on the reflecting side. A plane parallel to the
/// scan plane has no distinguished horizontal; x stands for it.
pub fn axes(normal: &Unit<Vector3<f64>>) -> [Vector3<f64>; 2] {
    let across = Unit::try_new(Vector3::z().cross(normal), 1e-9).unwrap_or(Vector3::x_axis());
    [across.into_inner(), normal.cross(&across)]
}

/// A curved surface in space, unbounded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvedSurface {
    touches: Point3<f64>,
    /// Along a and v of the equation, and the normal of the touching plane.
    axes: [Vector3<f64>; 3],
    curvature: f64,
    along: f64,
    depth: f64,
    opening: f64,
}

impl Curve {
    /// Radius, in millimeters, and the name of the shape.
    pub fn radius_mm(&self) -> (f64, &'static str) {
        match self {
            Self::Cylinder(c) => (c.radius_mm, "cylinder"),
            Self::Cone(c) => (c.radius_mm, "cone"),
            Self::Sphere(c) => (c.radius_mm, "sphere"),
            Self::Paraboloid(c) => (c.radius_mm, "paraboloid"),
        }
    }

    /// Where it touches the plane from the middle of the outline, in millimeters.
    pub fn touches_mm(&self) -> [f64; 2] {
        match self {
            Self::Cylinder(c) => c.touches_mm,
            Self::Cone(c) => c.touches_mm,
            Self::Sphere(c) | Self::Paraboloid(c) => c.touches_mm,
        }
    }

    /// The same, mutable, with the angle of the axis, if there is one.
    pub fn place_mut(&mut self) -> (&mut [f64; 2], Option<&mut f64>) {
        match self {
            Self::Cylinder(c) => (&mut c.touches_mm, Some(&mut c.axis_deg)),
            Self::Cone(c) => (&mut c.touches_mm, Some(&mut c.axis_deg)),
            Self::Sphere(c) | Self::Paraboloid(c) => (&mut c.touches_mm, None),
        }
    }

    /// The surface over a plane outline with a given normal, of a mirror whose surface is `ahead` of the outline, in
    /// meters; behind it if negative. Surfaces of different depths are parallel, those of a paraboloid nearly so.
    ///
    /// `None` for a radius of zero, or for a surface on the other side of its own axis.
    pub fn over(
        &self,
        corners: &[Point3<f64>],
        normal: &Unit<Vector3<f64>>,
        ahead: f64,
    ) -> Option<CurvedSurface> {
        let [across, up] = axes(normal);
        let [x, y] = self.touches_mm().map(|mm| 1e-3 * mm);
        let touches = middle(corners, normal)? + across * x + up * y + normal.into_inner() * ahead;
        let drawn = 1e-3 * self.radius_mm().0;
        let radius = drawn - ahead;
        if drawn == 0.0 || radius * drawn <= 0.0 {
            return None;
        }
        let (axis_deg, half_angle_deg) = match self {
            Self::Cylinder(c) => (c.axis_deg, 0.0),
            Self::Cone(c) => (c.axis_deg, c.half_angle_deg),
            Self::Sphere(_) | Self::Paraboloid(_) => (0.0, 0.0),
        };
        let (sin, cos) = libm::sincos(axis_deg.to_radians());
        let tan = libm::tan(half_angle_deg.to_radians());
        let (along, depth) = match self {
            Self::Cylinder(_) | Self::Cone(_) => (0.0, 1.0 - tan * tan),
            Self::Sphere(_) => (1.0, 1.0),
            Self::Paraboloid(_) => (1.0, 0.0),
        };
        Some(CurvedSurface {
            touches,
            axes: [
                across * cos + up * sin,
                up * cos - across * sin,
                normal.into_inner(),
            ],
            curvature: 1.0 / radius,
            along,
            depth,
            opening: tan / radius.abs(),
        })
    }
}

/// Middle of an outline along both axes of its plane.
fn middle(corners: &[Point3<f64>], normal: &Unit<Vector3<f64>>) -> Option<Point3<f64>> {
    let first = corners.first()?;
    let half = axes(normal).map(|axis| {
        let places = corners.iter().map(|c| axis.dot(&(c - first)));
        let (low, high) = places.fold((0.0_f64, 0.0_f64), |(low, high), p| (low.min(p), high.max(p)));
        axis * (0.5 * (low + high))
    });
    Some(first + half[0] + half[1])
}

/// The cylinder into which a flat mirror with an outline bends, along its longer side, if its middle is `bow_um` deep: `None`
/// if it is flat, or bent beyond a quarter of a circle.
pub fn bow(bow_um: f64, corners: &[Point3<f64>], normal: &Unit<Vector3<f64>>) -> Option<Curve> {
    let [width, height] = axes(normal).map(|axis| {
        let places = corners.iter().map(|c| axis.dot(&c.coords));
        let (low, high) = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| {
            (low.min(p), high.max(p))
        });
        high - low
    });
    let (length, axis_deg) = if width >= height {
        (width, 90.0)
    } else {
        (height, 0.0)
    };
    let depth = 1e-6 * bow_um;
    // R = L²/(8s) + s/2 for the circle through the ends and the middle of a chord L with sagitta s.
    let radius = length * length / (8.0 * depth) + 0.5 * depth;
    (depth != 0.0 && depth.abs() < 0.25 * length).then_some(Curve::Cylinder(CylinderCurve {
        radius_mm: 1e3 * radius,
        axis_deg,
        touches_mm: [0.0; 2],
    }))
}

impl CurvedSurface {
    /// The same surface in another frame.
    #[must_use]
    pub fn moved(&self, other_from_this: &Pose) -> Self {
        Self {
            touches: other_from_this * self.touches,
            axes: self.axes.map(|axis| other_from_this * axis),
            ..*self
        }
    }

    /// Coordinates along the axes of the surface.
    fn local(&self, v: &Vector3<f64>) -> Vector3<f64> {
        Vector3::new(self.axes[0].dot(v), self.axes[1].dot(v), self.axes[2].dot(v))
    }

    /// 1 + e·a − c·k_z·z: positive on the sheet that touches the plane.
    fn facing(&self, p: &Vector3<f64>) -> f64 {
        1.0 + self.opening * p.x - self.curvature * self.depth * p.z
    }

    /// The bilinear form of F: its second-order terms for p = q.
    fn squares(&self, p: &Vector3<f64>, q: &Vector3<f64>) -> f64 {
        self.curvature * (self.along * p.x * q.x + p.y * q.y + self.depth * p.z * q.z)
            - self.opening * (p.x * q.z + p.z * q.x)
    }

    /// Distances at which a line meets the sheet that touches the plane, the smaller first.
    pub fn roots(&self, origin: &Point3<f64>, direction: &Unit<Vector3<f64>>) -> [Option<f64>; 2] {
        let d = self.local(direction);
        let from = self.local(&(origin - self.touches));
        // Solved from the point nearest to where the surface touches the plane, where its numbers are small.
        let ahead = -from.dot(&d);
        let o = from + d * ahead;
        let square = self.squares(&d, &d);
        let half = self.squares(&o, &d) - d.z;
        let rest = self.squares(&o, &o) - 2.0 * o.z;
        let discriminant = half * half - square * rest;
        if discriminant < 0.0 {
            return [None; 2];
        }
        // The root without cancellation, and the other by Vieta's formula.
        let sum = -(half + f64::copysign(discriminant.sqrt(), half));
        let on_sheet = |t: f64| {
            let finite = t.is_finite() && self.facing(&(o + d * t)) > 0.0;
            finite.then_some(ahead + t)
        };
        match (on_sheet(sum / square), on_sheet(rest / sum)) {
            (Some(a), Some(b)) => [Some(a.min(b)), Some(a.max(b))],
            (a, b) => [a.or(b), None],
        }
    }

    /// Distance at which a line from a point of the surface meets it again.
    pub fn other_root(&self, on_it: &Point3<f64>, direction: &Unit<Vector3<f64>>) -> Option<f64> {
        let d = self.local(direction);
        let o = self.local(&(on_it - self.touches));
        let t = -2.0 * (self.squares(&o, &d) - d.z) / self.squares(&d, &d);
        (t.is_finite() && self.facing(&(o + d * t)) > 0.0).then_some(t)
    }

    /// Normal on the reflecting side at a point of the surface.
    pub fn normal_at(&self, point: &Point3<f64>) -> Unit<Vector3<f64>> {
        let p = self.local(&(point - self.touches));
        let [a, v, z] = self.axes;
        Unit::new_normalize(
            a * (self.opening * p.z - self.curvature * self.along * p.x) - v * (self.curvature * p.y)
                + z * self.facing(&p),
        )
    }

    /// The point of the surface over a point of the touching plane, along its normal; `None` where there is none.
    pub fn over(&self, in_plane: &Point3<f64>) -> Option<Point3<f64>> {
        let p = self.local(&(in_plane - self.touches));
        let facing = 1.0 + self.opening * p.x;
        let square = self.along * p.x * p.x + p.y * p.y;
        let left = facing * facing - self.curvature * self.curvature * self.depth * square;
        (facing > 0.0 && left > 0.0).then(|| {
            let height = self.curvature * square / (facing + left.sqrt());
            in_plane + self.axes[2] * (height - p.z)
        })
    }

    /// Curvature of the surface at one of its points, as the linear map by which its normal turns along it: the change of
    /// the normal is −S·(displacement).
    pub fn shape_at(&self, point: &Point3<f64>) -> Matrix3<f64> {
        let p = self.local(&(point - self.touches));
        let axes = Matrix3::from_columns(&self.axes);
        let (c, e) = (self.curvature, self.opening);
        // Half the second derivatives of F.
        let second = Matrix3::new(c * self.along, 0.0, -e, 0.0, c, 0.0, -e, 0.0, c * self.depth);
        let half_gradient = Vector3::new(c * self.along * p.x - e * p.z, c * p.y, -self.facing(&p));
        let size = half_gradient.norm();
        let normal = half_gradient / size;
        let onto = Matrix3::identity() - normal * normal.transpose();
        axes * (onto * second * onto / size) * axes.transpose()
    }

    /// The plane that touches it where a ray from the origin first meets its reflecting side.
    pub fn plane_along(&self, u: &Unit<Vector3<f64>>) -> Option<MirrorPlane> {
        let at = self.roots(&Point3::origin(), u).into_iter().flatten();
        at.filter(|t| *t > 0.0).find_map(|t| {
            let point = Point3::from(u.into_inner() * t);
            let normal = self.normal_at(&point);
            (normal.dot(u) < 0.0).then(|| MirrorPlane::through(point, normal))
        })
    }
}

#[cfg(test)]
mod tests;
