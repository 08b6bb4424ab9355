//! Facets: mirrors, each with one of several outlines in a plane, and flat or bent away from that plane.
//!
//! A shape is one file: its keys, its corners, its copies and the checks of its numbers. To add one, write its file, and
//! its variant and its arms here; no other code knows about shapes.
//!
//! A copy has the same kind of shape as its original, with other numbers, so that the mirror image of a wedge is a
//! readable wedge:
//!
//! ```text
//! left and right:  y → −y      azimuths α → −α, in reverse order
//! up and down:     z → −z      elevations ε → −ε
//! rotation by τ:               azimuths α → α + τ
//! ```

pub(crate) mod bent;
pub(crate) mod outline;
mod plate;
mod polygon;
mod rectangle;
mod turn;
mod wedge;

pub use plate::Plate;
pub use polygon::PolygonShape;
pub use rectangle::RectangleShape;
pub use wedge::Wedge;

use super::coating::Coating;
use super::omit::{is_false, is_zero};
use super::pattern::Exchange;
use crate::findings::Findings;
use catoptric_model::place::KeyPath;
use catoptric_model::{Curve, ScanGeometry};
use nalgebra::Point3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use turn::Turn;

/// A mirror.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Facet {
    /// Name.
    pub name: String,
    /// Its outline, in a plane.
    pub shape: FacetShape,
    /// What it is instead of flat: a surface that touches the plane of its outline.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curve: Option<Curve>,
    /// How far a mirror that is meant to be flat has bent along its longer side: depth of its middle below its ends, in
    /// micrometers, negative if its middle is raised. The session does not have it.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[schemars(range(min = -10000.0, max = 10000.0))]
    pub bow_um: f64,
    /// Whether the back of its body, `mirror.thickness_mm` behind the face, reflects too.
    #[serde(default, skip_serializing_if = "is_false")]
    pub two_sided: bool,
    /// Share of the light that it reflects, instead of `superstructure.mirror.reflectivity`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub reflectivity: Option<f64>,
    /// What reflects on it, instead of `superstructure.mirror.coating`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coating: Option<Coating>,
}

/// Outline of a facet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum FacetShape {
    /// Bounded by two azimuths and two heights, and oriented so that its middle beam leaves in a given direction.
    Wedge(Wedge),
    /// A rectangle around one beam, oriented so that the beam leaves in a given direction, or with a given normal.
    Plate(Plate),
    /// A rectangle with a given center and normal.
    Rectangle(RectangleShape),
    /// Given corners.
    Polygon(PolygonShape),
}

impl FacetShape {
    /// Corners as drawn, in the nominal sensor frame and in meters, counter-clockwise seen from the reflecting side.
    ///
    /// `None` if the description spans no mirror: a beam that is not deflected, a plane that one of the two azimuths
    /// does not meet, a normal of zero length.
    pub fn corners(&self, scan: &ScanGeometry) -> Option<Vec<Point3<f64>>> {
        match self {
            Self::Wedge(wedge) => wedge.corners(),
            Self::Plate(plate) => plate.corners(scan),
            Self::Rectangle(rectangle) => rectangle.corners(),
            Self::Polygon(polygon) => Some(polygon.corners()),
        }
    }

    /// Turns it about the scanner's axis, counter-clockwise, by an angle in degrees.
    pub(crate) fn turn(&mut self, turn_deg: f64, scan: &ScanGeometry) {
        let turn = Turn::new(turn_deg);
        match self {
            Self::Wedge(wedge) => wedge.turn(&turn),
            Self::Plate(plate) => plate.turn(&turn, scan),
            Self::Rectangle(rectangle) => rectangle.turn(&turn),
            Self::Polygon(polygon) => polygon.turn(&turn),
        }
    }

    /// Makes it its own mirror image.
    pub(crate) fn exchange(&mut self, exchange: Exchange, scan: &ScanGeometry) {
        match (exchange, self) {
            (Exchange::LeftRight, Self::Wedge(wedge)) => wedge.left_right(),
            (Exchange::LeftRight, Self::Plate(plate)) => plate.left_right(scan),
            (Exchange::LeftRight, Self::Rectangle(rectangle)) => rectangle.reflect(1),
            (Exchange::LeftRight, Self::Polygon(polygon)) => polygon.reflect(1),
            (Exchange::UpDown, Self::Wedge(wedge)) => wedge.up_down(),
            (Exchange::UpDown, Self::Plate(plate)) => plate.up_down(),
            (Exchange::UpDown, Self::Rectangle(rectangle)) => rectangle.reflect(2),
            (Exchange::UpDown, Self::Polygon(polygon)) => polygon.reflect(2),
        }
    }

    /// Reports what is wrong with its numbers; `path` leads to the shape.
    pub(crate) fn check(&self, scan: &ScanGeometry, path: &KeyPath, found: &mut Findings) {
        match self {
            Self::Wedge(wedge) => wedge.check(scan, &path.key("wedge"), found),
            Self::Plate(plate) => plate.check(scan, &path.key("plate"), found),
            Self::Rectangle(rectangle) => rectangle.check(&path.key("rectangle"), found),
            Self::Polygon(polygon) => polygon.check(&path.key("polygon"), found),
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use nalgebra::{Rotation3, Vector3};
    use std::collections::BTreeSet;

    /// One shape of each kind, without symmetry.
    pub(crate) fn samples() -> Vec<FacetShape> {
        let wedge = FacetShape::Wedge(Wedge {
            azimuth_deg: [62.0, 77.0],
            distance_mm: 64.0,
            exit_azimuth_deg: 60.0,
            exit_elevation_deg: 50.0,
            height_mm: 12.0,
        });
        let by_normal = FacetShape::Plate(Plate {
            azimuth_deg: Some(70.0),
            beam: None,
            exit_azimuth_deg: None,
            exit_elevation_deg: None,
            normal_azimuth_deg: Some(-121.0),
            normal_elevation_deg: Some(-37.0),
            ..plate::tests::by_exit()
        });
        let rectangle = FacetShape::Rectangle(RectangleShape {
            center_mm: [-19.89, 66.89, 1.5],
            normal: [0.45, -0.33, -0.4036],
            width_mm: 70.2,
            height_mm: 30.0,
        });
        let polygon = FacetShape::Polygon(PolygonShape {
            corners_mm: vec![[30.0, 60.0, -6.0], [40.0, 50.0, -6.0], [35.0, 55.0, 9.0]],
        });
        vec![
            wedge,
            FacetShape::Plate(plate::tests::by_exit()),
            by_normal,
            rectangle,
            polygon,
        ]
    }

    fn corners(shape: &FacetShape) -> Option<Vec<Point3<f64>>> {
        shape.corners(&ScanGeometry::default())
    }

    /// Whether two outlines have the same corners in the same cyclic order, wherever the lists begin.
    fn same_outline(found: &[Point3<f64>], wanted: &[Point3<f64>]) -> bool {
        let near = |start: usize| {
            (0..wanted.len()).all(|i| (found[(start + i) % found.len()] - wanted[i]).norm() < 1e-15)
        };
        found.len() == wanted.len() && (0..found.len()).any(near)
    }

    #[test]
    fn every_shape_has_a_sample() {
        let schema = schemars::schema_for!(FacetShape);
        let variants = schema.get("oneOf").and_then(|v| v.as_array());
        let known = variants.into_iter().flatten();
        let known: BTreeSet<String> = known
            .filter_map(|v| Some(v["required"][0].as_str()?.to_owned()))
            .collect();
        let sampled = samples().into_iter().flat_map(|s| {
            let table = toml::Table::try_from(s).expect("a table");
            table.into_iter().map(|(key, _)| key)
        });
        assert_eq!(sampled.collect::<BTreeSet<String>>(), known);
    }

    #[test]
    fn a_mirror_image_has_the_reflected_corners() {
        for (exchange, sign) in [
            (Exchange::LeftRight, Vector3::new(1.0, -1.0, 1.0)),
            (Exchange::UpDown, Vector3::new(1.0, 1.0, -1.0)),
        ] {
            for shape in samples() {
                let own = corners(&shape).expect("it is a mirror");
                let mut image = shape.clone();
                image.exchange(exchange, &ScanGeometry::default());
                let found = corners(&image).expect("so is its image");
                // A reflection turns counter-clockwise order into clockwise order.
                let reflected = own
                    .iter()
                    .rev()
                    .map(|c| Point3::from(c.coords.component_mul(&sign)));
                let wanted: Vec<Point3<f64>> = reflected.collect();
                assert!(
                    same_outline(&found, &wanted),
                    "{exchange:?} {shape:?}: {found:?} {wanted:?}"
                );
            }
        }
    }

    #[test]
    fn a_turned_facet_has_the_turned_corners() {
        for turn in [-97.0_f64, 30.0, 145.0, 300.0] {
            let rotation = Rotation3::from_axis_angle(&Vector3::z_axis(), turn.to_radians());
            for shape in samples() {
                let own = corners(&shape).expect("it is a mirror");
                let mut copy = shape;
                copy.turn(turn, &ScanGeometry::default());
                let found = corners(&copy).expect("so is its copy");
                for (found, own) in found.iter().zip(&own) {
                    assert!((found - rotation * own).norm() < 1e-14, "{turn} {found} {own}");
                }
            }
        }
    }
}
