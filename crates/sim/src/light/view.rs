//! What the receiver sees of the light that comes back: the overlap of its view with the spot, and how much of its
//! aperture a facet shows the spot.
//!
//! Eq. (1) has neither: it holds for a target far away, seen by the whole aperture. The receiver is a lens of diameter
//! D_R beside the laser, focused at infinity, with a detector that takes what arrives within its field of view θ_V. A
//! spot at range R, at x beside the lens's axis, is seen by the points p of the lens with |x − p| ≤ R·tan(θ_V/2): by the
//! area that two circles share. Far away that is all of the lens, and close by (R·tan(θ_V/2)/(D_R/2))² of it, which makes
//! up for the 1/R² of Eq. (1): the light of near targets does not grow without limit. This is the overlap function of
//! lidars (Measures 1984, *Laser Remote Sensing*, section 7.4).

use crate::light::footprint::{self, SubRay};
use crate::scene::{BeamShape, Light};
use nalgebra::{Point2, Point3, Unit, Vector2, Vector3};
use std::f64::consts::PI;

/// The receiver's lens and what its detector takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Lens {
    /// Radius of the lens, in meters.
    aperture: f64,
    /// Tangent of half the field of view; infinite if it is not limited.
    view: f64,
    /// Center of the lens from the laser, horizontal and vertical, in meters.
    offset: Vector2<f64>,
    /// Whether the part of the lens is counted from which mirrors show a spot.
    vignetting: bool,
}

/// The receiver as one beam sees it, whose ellipse is turned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BeamView {
    aperture: f64,
    view: f64,
    /// Center of the lens along the long and the short axis of the beam's ellipse.
    offset: Vector2<f64>,
    /// Half extents of the beam where it leaves, and their growth per meter, along the same axes.
    half: Vector2<f64>,
    slope: Vector2<f64>,
}

impl Lens {
    pub(crate) fn of(light: &Light) -> Self {
        Self {
            aperture: 0.5e-3 * light.receiver_diameter_mm,
            view: light
                .receiver_field_of_view_mrad
                .map_or(f64::INFINITY, |full| libm::tan(0.5e-3 * full)),
            offset: Vector2::from(light.receiver_offset_mm) * 1e-3,
            vignetting: light.vignetting,
        }
    }

    /// Area of the lens, in square meters.
    pub(crate) fn area(&self) -> f64 {
        PI * self.aperture * self.aperture
    }

    /// Whether the part of the lens is counted from which mirrors show a spot.
    pub(crate) fn vignettes(&self) -> bool {
        self.vignetting
    }

    /// As a beam at an azimuth sees it; `None` if the detector takes everything.
    pub(crate) fn seen_by(&self, shape: &BeamShape, azimuth: f64) -> Option<BeamView> {
        if self.view.is_infinite() {
            return None;
        }
        let half = |full: f64| 0.5e-3 * full;
        let (sin, cos) = footprint::turn(shape, azimuth);
        Some(BeamView {
            aperture: self.aperture,
            view: self.view,
            offset: Vector2::new(
                self.offset.x * cos + self.offset.y * sin,
                self.offset.y * cos - self.offset.x * sin,
            ),
            half: Vector2::new(half(shape.wide_aperture_mm), half(shape.narrow_aperture_mm)),
            slope: Vector2::new(
                libm::tan(half(shape.wide_full_mrad)),
                libm::tan(half(shape.narrow_full_mrad)),
            ),
        })
    }

    /// Share of the lens from which a spot is seen via a chain of facets, or past facets that stand in between.
    ///
    /// `beam` is the direction of the chief ray, `range` the length of its path, `via` the outlines of the facets on it in
    /// order, and `past` those that may hide the spot from a part of the lens. Facets on the path are unfolded: each is
    /// replaced by its image in those before it, so that the path is straight, and projected from the spot onto the lens.
    /// Their figure and glass are neglected, and so is what else stands in the way behind the first mirror.
    pub(crate) fn seen<'c>(
        &self,
        beam: &Unit<Vector3<f64>>,
        range: f64,
        via: &[&[Point3<f64>]],
        past: impl Iterator<Item = &'c [Point3<f64>]>,
    ) -> f64 {
        let plane = LensPlane::new(beam, range, self.offset);
        let all = PI * self.aperture * self.aperture;
        let Some(shown) = plane.shown(via) else {
            let hidden: f64 = past
                .map(|corners| area_in_circle(&plane.projected(corners), self.aperture))
                .sum();
            return (1.0 - hidden / all).max(0.0);
        };
        area_in_circle(&shown, self.aperture) / all
    }
}

impl BeamView {
    /// Share of the lens from which the detector takes the light of a sub-ray's spot at a range.
    #[inline]
    pub(crate) fn overlap(&self, sub_ray: &SubRay, range: f64) -> f64 {
        let spot = Vector2::new(
            sub_ray.wide * (self.half.x + range * self.slope.x),
            sub_ray.narrow * (self.half.y + range * self.slope.y),
        );
        let apart = (spot - self.offset).norm();
        let seen_by = range * self.view;
        if seen_by >= self.aperture + apart {
            return 1.0;
        }
        common_area(self.aperture, seen_by, apart) / (PI * self.aperture * self.aperture)
    }
}

/// Area that two circles share, given their radii and the distance of their centers.
pub(crate) fn common_area(a: f64, b: f64, apart: f64) -> f64 {
    if apart >= a + b {
        return 0.0;
    }
    let smaller = a.min(b);
    if apart <= (a - b).abs() {
        return PI * smaller * smaller;
    }
    // The chord is at this distance from the center of each.
    let (of_a, of_b) = (
        0.5 * (apart + (a * a - b * b) / apart),
        0.5 * (apart + (b * b - a * a) / apart),
    );
    let segment = |radius: f64, at: f64| {
        let at = at.clamp(-radius, radius);
        radius * radius * libm::acos(at / radius) - at * (radius * radius - at * at).sqrt()
    };
    segment(a, of_a) + segment(b, of_b)
}

/// The plane of the lens, across the beam, with the lens's center as its origin, and the spot in front of it.
struct LensPlane {
    /// Along the beam, then horizontal and vertical across it.
    axes: [Vector3<f64>; 3],
    range: f64,
    offset: Vector2<f64>,
}

/// Smallest distance from the plane of the lens, in meters, at which something can hide a part of it.
const BEHIND: f64 = 1e-6;

impl LensPlane {
    fn new(beam: &Unit<Vector3<f64>>, range: f64, offset: Vector2<f64>) -> Self {
        let horizontal = Vector3::z().cross(beam).normalize();
        Self {
            axes: [beam.into_inner(), horizontal, beam.cross(&horizontal)],
            range,
            offset,
        }
    }

    /// An outline, projected from the spot: the part of it between lens and spot.
    fn projected(&self, corners: &[Point3<f64>]) -> Vec<Point2<f64>> {
        let [along, right, up] = self.axes;
        let in_plane: Vec<Vector3<f64>> = corners
            .iter()
            .map(|c| Vector3::new(right.dot(&c.coords), up.dot(&c.coords), along.dot(&c.coords)))
            .collect();
        let between = clipped(&in_plane, |c| c.z - BEHIND);
        let between = clipped(&between, |c| self.range - BEHIND - c.z);
        // The line from the spot (0, 0, R) through (x, y, z) meets the plane z = 0 at (x, y)·R/(R − z).
        let place = |c: &Vector3<f64>| Point2::from(c.xy() * (self.range / (self.range - c.z)) - self.offset);
        between.iter().map(place).collect()
    }

    /// The part of the plane from which a chain of facets shows the spot; `None` without a chain.
    fn shown(&self, via: &[&[Point3<f64>]]) -> Option<Vec<Point2<f64>>> {
        let mut shown: Option<Vec<Point2<f64>>> = None;
        for (place, corners) in via.iter().enumerate() {
            let mut image = corners.to_vec();
            for before in via[..place].iter().rev() {
                reflect(&mut image, before);
            }
            let window = self.projected(&image);
            shown = Some(match shown {
                None => window,
                Some(shown) => common(&shown, &window),
            });
        }
        shown
    }
}

/// Replaces points by their images in the plane of an outline.
fn reflect(points: &mut [Point3<f64>], mirror: &[Point3<f64>]) {
    let normal = (mirror[1] - mirror[0])
        .cross(&(mirror[2] - mirror[0]))
        .normalize();
    for point in points {
        *point -= normal * (2.0 * normal.dot(&(*point - mirror[0])));
    }
}

/// The part of a polygon where a linear function is positive (Sutherland and Hodgman 1974).
fn clipped<const D: usize>(
    corners: &[nalgebra::SVector<f64, D>],
    side: impl Fn(&nalgebra::SVector<f64, D>) -> f64,
) -> Vec<nalgebra::SVector<f64, D>> {
    let mut kept = Vec::with_capacity(corners.len() + 2);
    for (i, b) in corners.iter().enumerate() {
        let a = &corners[(i + corners.len() - 1) % corners.len()];
        let (at_a, at_b) = (side(a), side(b));
        if (at_a >= 0.0) != (at_b >= 0.0) {
            kept.push(a + (b - a) * (at_a / (at_a - at_b)));
        }
        if at_b >= 0.0 {
            kept.push(*b);
        }
    }
    kept
}

/// The part that a polygon shares with a convex one.
fn common(polygon: &[Point2<f64>], convex: &[Point2<f64>]) -> Vec<Point2<f64>> {
    let sense = twice_area(convex).signum();
    let mut left: Vec<Vector2<f64>> = polygon.iter().map(|p| p.coords).collect();
    for (i, a) in convex.iter().enumerate() {
        let b = convex[(i + 1) % convex.len()];
        let edge = (b - a) * sense;
        left = clipped(&left, |p| edge.perp(&(p - a.coords)));
    }
    left.into_iter().map(Point2::from).collect()
}

fn twice_area(corners: &[Point2<f64>]) -> f64 {
    let edges = corners
        .iter()
        .enumerate()
        .map(|(i, p)| p.coords.perp(&corners[(i + 1) % corners.len()].coords));
    edges.sum()
}

/// Area that a simple polygon shares with a circle about the origin: the sum over its edges of what the triangle from the
/// origin to the edge shares with it, with its sign.
pub(crate) fn area_in_circle(corners: &[Point2<f64>], radius: f64) -> f64 {
    let edges = corners.iter().enumerate().map(|(i, p)| {
        let q = corners[(i + 1) % corners.len()];
        edge_in_circle(p.coords, q.coords, radius)
    });
    edges.sum::<f64>().abs()
}

fn edge_in_circle(p: Vector2<f64>, q: Vector2<f64>, radius: f64) -> f64 {
    let sector =
        |a: &Vector2<f64>, b: &Vector2<f64>| 0.5 * radius * radius * libm::atan2(a.perp(b), a.dot(b));
    let edge = q - p;
    let (square, half) = (edge.norm_squared(), p.dot(&edge));
    if square == 0.0 {
        return 0.0;
    }
    let left = half * half - square * (p.norm_squared() - radius * radius);
    if left <= 0.0 {
        return sector(&p, &q);
    }
    let (enter, leave) = ((-half - left.sqrt()) / square, (-half + left.sqrt()) / square);
    if enter >= 1.0 || leave <= 0.0 {
        return sector(&p, &q);
    }
    let (from, to) = (p + edge * enter.max(0.0), p + edge * leave.min(1.0));
    let mut area = 0.5 * from.perp(&to);
    if enter > 0.0 {
        area += sector(&p, &from);
    }
    if leave < 1.0 {
        area += sector(&to, &q);
    }
    area
}

#[cfg(test)]
mod tests {
    use super::*;

    fn receiver(diameter_mm: f64, view_mrad: f64, offset_mm: [f64; 2]) -> Lens {
        Lens::of(&Light {
            receiver_diameter_mm: diameter_mm,
            receiver_field_of_view_mrad: Some(view_mrad),
            receiver_offset_mm: offset_mm,
            vignetting: true,
            ..Light::default()
        })
    }

    const CHIEF: SubRay = SubRay {
        wide: 0.0,
        narrow: 0.0,
        weight: 1.0,
    };

    #[test]
    fn nothing_is_seen_at_contact_and_everything_far_away() {
        let shape = crate::scene::Preset::Ust20lx.beam_shape();
        for offset in [[0.0, 0.0], [0.0, 15.0], [-8.0, 3.0]] {
            let view = receiver(20.0, 20.0, offset)
                .seen_by(&shape, 0.7)
                .expect("it is limited");
            assert!(view.overlap(&CHIEF, 1e-9) < 1e-12);
            assert_eq!(view.overlap(&CHIEF, 20.0), 1.0);
            let all: Vec<f64> = (1..400)
                .map(|i| view.overlap(&CHIEF, 0.01 * f64::from(i)))
                .collect();
            assert!(all.windows(2).all(|w| w[1] >= w[0] - 1e-15), "it grows");
        }
        // In front of the lens, as the square of the range: 1/R² of Eq. (1) is made up for.
        let view = receiver(20.0, 20.0, [0.0, 0.0])
            .seen_by(&shape, 0.0)
            .expect("it is limited");
        for range in [0.03, 0.065, 0.5] {
            let exact = (range * libm::tan(0.010) / 0.010).powi(2);
            assert!(
                (view.overlap(&CHIEF, range) / exact - 1.0).abs() < 1e-13,
                "{range}"
            );
        }
        assert!(receiver(20.0, 20.0, [0.0, 0.0]).view.is_finite());
        assert!(Lens::of(&Light::default()).seen_by(&shape, 0.0).is_none());
    }

    /// What is outside the view of a small lens far away is not seen: the third area of dA.
    #[test]
    fn sub_rays_beyond_the_view_are_lost() {
        let shape = crate::scene::Preset::Ust20lx.beam_shape();
        let view = receiver(0.01, 12.0, [0.0, 0.0])
            .seen_by(&shape, 0.0)
            .expect("it is limited");
        let at = |wide| SubRay { wide, ..CHIEF };
        assert_eq!(view.overlap(&at(0.7), 5.0), 1.0);
        assert_eq!(view.overlap(&at(0.8), 5.0), 0.0);
    }

    /// By counting the points of a fine grid.
    fn counted(radius: f64, inside: impl Fn(Point2<f64>) -> bool) -> f64 {
        const STEPS: i32 = 1500;
        let step = 2.0 * radius / f64::from(STEPS);
        let at = |i: i32| -radius + (f64::from(i) + 0.5) * step;
        let points = (0..STEPS).flat_map(|i| (0..STEPS).map(move |j| Point2::new(at(i), at(j))));
        let count = points.filter(|p| p.coords.norm() <= radius && inside(*p)).count();
        count as f64 * step * step
    }

    #[test]
    fn common_areas_agree_with_counting() {
        for (a, b, apart) in [
            (1.0, 0.7, 0.9),
            (0.4, 1.0, 0.8),
            (1.0, 1.0, 0.3),
            (0.5, 2.0, 1.0),
            (1.0, 0.2, 1.3),
        ] {
            let counted = counted(a, |p| (p - Point2::new(apart, 0.0)).norm() <= b);
            assert!(
                (common_area(a, b, apart) - counted).abs() < 2e-4,
                "{a} {b} {apart}"
            );
        }
        let polygons: [&[[f64; 2]]; 4] = [
            &[[-0.5, -0.4], [0.7, -0.3], [0.2, 0.9]],
            &[[-3.0, -3.0], [3.0, -3.0], [3.0, 3.0], [-3.0, 3.0]],
            &[[0.2, -2.0], [0.5, -2.0], [0.5, 2.0], [0.2, 2.0]],
            &[[1.2, 0.0], [2.0, 1.0], [2.0, -1.0]],
        ];
        for polygon in polygons {
            let corners: Vec<Point2<f64>> = polygon.iter().map(|p| Point2::from(*p)).collect();
            let edges = |p: Point2<f64>| {
                (0..corners.len()).map(move |i| (p, i)).map(|(p, i)| {
                    let (a, b) = (corners[i], corners[(i + 1) % corners.len()]);
                    (b - a).perp(&(p - a))
                })
            };
            let inside = |p| edges(p).all(|e| e >= 0.0) || edges(p).all(|e| e <= 0.0);
            let counted = counted(1.0, inside);
            let area = area_in_circle(&corners, 1.0);
            assert!(
                (area - counted).abs() < 3e-4,
                "{polygon:?}: {area} against {counted}"
            );
        }
        assert!((area_in_circle(&[], 1.0)).abs() < 1e-15);
    }

    /// A plane mirror at 45°, 12 mm wide and long enough: a strip of the lens, exactly.
    #[test]
    fn a_narrow_facet_shows_the_spot_to_a_strip_of_the_lens() {
        let receiver = receiver(20.0, 20.0, [0.0, 0.0]);
        let (distance, range) = (0.065, 2.0);
        // Around the beam along x, 12 mm wide in y.
        let facet = |shift: f64| -> Vec<Point3<f64>> {
            [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
                .map(|[along, across]| {
                    let (along, across) = (0.05 * along, 0.006 * across + shift);
                    Point3::new(distance + along, across, along)
                })
                .to_vec()
        };
        for shift in [0.0, 0.004, 0.006] {
            let corners = facet(shift);
            let share = receiver.seen(&Vector3::x_axis(), range, &[&corners], std::iter::empty());
            // Ray by ray: from points of the lens to the image of the spot, whether within the facet's width where they
            // meet its plane x = z + d.
            let counted = counted(0.010, |p| {
                let (lens, spot) = (Vector3::new(0.0, p.x, p.y), Vector3::new(range, 0.0, 0.0));
                let line = spot - lens;
                let t = (distance + lens.z - lens.x) / (line.x - line.z);
                let hit = lens + line * t;
                (hit.y - shift).abs() <= 0.006 && hit.z.abs() <= 0.05
            }) / (PI * 1e-4);
            assert!(
                (share - counted).abs() < 2e-3,
                "{shift}: {share} against {counted}"
            );
        }
        let (middle, edge) = (facet(0.0), facet(0.006));
        let share = |c: &Vec<Point3<f64>>| receiver.seen(&Vector3::x_axis(), range, &[c], std::iter::empty());
        // As long as the facet is: three quarters at its middle; half of the lens where its side edge cuts the beam.
        assert!((0.70..0.80).contains(&share(&middle)), "{}", share(&middle));
        assert!((share(&edge) - 0.5).abs() < 1e-12, "{}", share(&edge));
        // A beam that passes the facet's side edge by 2 mm loses what the facet hides.
        let beside = facet(0.008);
        let past = receiver.seen(&Vector3::x_axis(), range, &[], std::iter::once(beside.as_slice()));
        let hidden = receiver.seen(&Vector3::x_axis(), range, &[&beside], std::iter::empty());
        assert!(
            (past + hidden - 1.0).abs() < 1e-12 && hidden > 0.2,
            "{past} {hidden}"
        );
    }

    /// Two facets in a row show what both show: unfolded by hand.
    #[test]
    fn a_second_facet_is_unfolded_through_the_first() {
        let receiver = receiver(20.0, 20.0, [0.0, 0.0]);
        // A periscope: up at x = 0.065, forward again 50 mm higher.
        let square = |x: f64, z: f64, half: f64, across: f64| -> Vec<Point3<f64>> {
            [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
                .map(|[along, side]| Point3::new(x + half * along, across + half * side, z + half * along))
                .to_vec()
        };
        let (first, second) = (square(0.065, 0.0, 0.05, 0.0), square(0.065, 0.05, 0.05, 0.049));
        let both = receiver.seen(&Vector3::x_axis(), 2.0, &[&first, &second], std::iter::empty());
        // The second one is seen straight ahead at 0.115 m; its edge cuts at y = −1 mm there.
        let cut = -0.001 * 2.0 / (2.0 - 0.115);
        let exact = counted(0.010, |p| p.x >= cut) / (PI * 1e-4);
        assert!((both - exact).abs() < 5e-3, "{both} against {exact}");
    }
}
