//! The structure with its beams in perspective: triangles and lines with a depth buffer, shaded, as PNG.

use super::canvas::{Canvas, SIZE, mixed};
use super::drawn::{Drawn, radius, rim};
use super::views::{DIRECT, is_drawn, ray_color};
use crate::figure::{color, css};
use crate::page::escape;
use catoptric_design::layout::center;
use catoptric_model::beam;
use nalgebra::{Matrix3, Point3, Unit, Vector3};
use plotters::style::RGBColor;

/// Direction to the eye: azimuth and elevation, in degrees.
const FROM_DEG: [f64; 2] = [28.0, 32.0];

/// Distance of the eye, in radii of the structure.
const FAR: f64 = 6.0;

/// Length of the axes drawn at the scanner, in meters.
const AXIS_M: f64 = 0.05;

/// The picture, and the labels to put on it.
pub(super) struct Perspective {
    /// A PNG file.
    pub(super) png: Vec<u8>,
    labels: Labels,
}

impl Perspective {
    /// Returns an SVG of the picture with its labels.
    pub(super) fn svg(&self) -> String {
        let [width, height] = SIZE;
        let mut svg = format!(
            "<svg viewBox=\"0 0 {width} {height}\" style=\"max-width:{width}px\" role=\"img\"><title>The structure in \
             perspective</title><image width=\"{width}\" height=\"{height}\" href=\"data:image/png;base64,{}\"/>",
            base64(&self.png)
        );
        for ([x, y], text) in &self.labels {
            svg += &format!(
                "<text x=\"{x:.0}\" y=\"{y:.0}\" text-anchor=\"middle\" font-family=\"sans-serif\" font-size=\"14\" \
                 fill=\"#000000\">{}</text>",
                escape(text)
            );
        }
        svg + "</svg>\n"
    }
}

/// Projects points to the picture.
struct Camera {
    turn: Matrix3<f64>,
    distance: f64,
    scale: f64,
}

impl Camera {
    fn new(radius: f64) -> Self {
        let [azimuth, elevation] = FROM_DEG.map(f64::to_radians);
        let towards = beam::spherical(azimuth, elevation).into_inner();
        let right = Vector3::z().cross(&towards).normalize();
        let up = towards.cross(&right);
        Self {
            turn: Matrix3::from_rows(&[right.transpose(), up.transpose(), towards.transpose()]),
            distance: FAR * radius,
            // Half the height is 1.55 radii: the structure with a margin.
            scale: 0.5 * f64::from(SIZE[1]) * FAR / 1.55,
        }
    }

    /// Returns the position on the picture in pixels, and the nearness: larger is nearer.
    fn place(&self, p: &Point3<f64>) -> [f64; 3] {
        let v = self.turn * p.coords;
        let depth = (self.distance - v.z).max(1e-3 * self.distance);
        [
            0.5 * f64::from(SIZE[0]) + self.scale * v.x / depth,
            0.5 * f64::from(SIZE[1]) - self.scale * v.y / depth,
            1.0 / depth,
        ]
    }
}

/// Draws the structure with its beams.
pub(super) fn perspective(drawn: &Drawn) -> Perspective {
    let drawing = &drawn.drawing;
    let radius = radius(drawing);
    let camera = Camera::new(radius);
    let mut canvas = Canvas::new();
    for part in &drawing.parts {
        let fill = if part.housing {
            RGBColor(0x5C, 0x60, 0x68)
        } else {
            DIRECT
        };
        for triangle in &part.skin {
            canvas.triangle(
                triangle.map(|p| camera.place(&p)),
                shaded(fill, triangle, &camera),
            );
        }
    }
    for (number, facet) in drawing.facets.iter().enumerate() {
        for triangle in facet.face_shape().triangles() {
            let normal = (triangle[1] - triangle[0]).cross(&(triangle[2] - triangle[0]));
            let facing = (camera.turn * normal).z;
            let fill = shaded(color(number), &triangle, &camera);
            // The back of a mirror does not reflect.
            let fill = if facing > 0.0 {
                fill
            } else {
                mixed(fill, DIRECT, 0.45)
            };
            canvas.triangle(triangle.map(|p| camera.place(&p)), fill);
        }
        let corners = rim(facet);
        for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            let dark = mixed(color(number), RGBColor(0, 0, 0), 0.5);
            canvas.line(camera.place(a), camera.place(b), 1.5, dark);
        }
    }
    for ray in drawing.rays.iter().filter(|r| is_drawn(r)) {
        let mut points = ray.points.clone();
        if let (Some(last), Some(exit)) = (points.last().copied(), ray.exit) {
            let reach = if ray.facets.is_empty() {
                1.7 * radius
            } else {
                radius
            };
            points.push(last + exit.into_inner() * reach);
        }
        for pair in points.windows(2) {
            canvas.line(
                camera.place(&pair[0]),
                camera.place(&pair[1]),
                1.2,
                ray_color(ray),
            );
        }
    }
    let mut labels = axes(&camera, &mut canvas);
    add_names(drawn, &camera, radius, &mut labels);
    let png = canvas.picture().encoded();
    Perspective { png, labels }
}

/// Centers and texts of labels.
type Labels = Vec<([f64; 2], String)>;

/// Draws the axes of the sensor frame at the scanner, on top of everything; returns their names and length.
fn axes(camera: &Camera, canvas: &mut Canvas) -> Labels {
    // Visible on white and on black.
    let ink = RGBColor(0x70, 0x70, 0x70);
    let over = |p: [f64; 3]| [p[0], p[1], 2.0 * p[2]];
    let origin = over(camera.place(&Point3::origin()));
    let mut labels = Vec::new();
    for (axis, name) in ["x, forward", "y, left", "z, up"].into_iter().enumerate() {
        let end = Point3::from(Vector3::ith(axis, AXIS_M));
        let tip = over(camera.place(&end));
        canvas.line(origin, tip, 2.5, ink);
        let along = Unit::new_normalize(Vector3::new(tip[0] - origin[0], tip[1] - origin[1], 0.0));
        for side in [0.5, -0.5] {
            let barb = [
                tip[0] - 10.0 * along.x - 10.0 * side * along.y,
                tip[1] - 10.0 * along.y + 10.0 * side * along.x,
                tip[2],
            ];
            canvas.line(tip, barb, 2.5, ink);
        }
        // Where the axis points sideways, beside the tip by half the label's width.
        let aside = if along.x.abs() > 0.3 {
            66.0 * along.x.signum()
        } else {
            0.0
        };
        let at = [tip[0] + aside, tip[1] + 16.0 * along.y + 4.0];
        labels.push((at, format!("{name} ({:.0} mm)", 1e3 * AXIS_M)));
    }
    labels
}

/// Adds the names of the facets at the ends of their fans; a name that would overlap another moves down by one line.
fn add_names(drawn: &Drawn, camera: &Camera, radius: f64, labels: &mut Labels) {
    for (number, facet) in drawn.drawing.facets.iter().enumerate() {
        let own: Vec<_> = drawn
            .drawing
            .rays
            .iter()
            .filter(|r| r.class.sees() && r.facets.last() == Some(&number))
            .collect();
        let end = own.get(own.len() / 2).and_then(|ray| {
            let exit = ray.exit?.into_inner();
            Some(ray.points.last()? + exit * (1.08 * radius))
        });
        let [x, y, _] = camera.place(&end.unwrap_or_else(|| center(&facet.face.corners)));
        let mut at = [
            x.clamp(40.0, f64::from(SIZE[0]) - 40.0),
            y.clamp(16.0, f64::from(SIZE[1]) - 6.0),
        ];
        while labels
            .iter()
            .any(|(w, _)| (w[0] - at[0]).abs() < 90.0 && (w[1] - at[1]).abs() < 15.0)
        {
            at[1] += 15.0;
        }
        labels.push((at, facet.name.clone()));
    }
}

/// Shades a triangle's color as lit from behind the eye, from the upper left.
fn shaded(color: RGBColor, [a, b, c]: &[Point3<f64>; 3], camera: &Camera) -> RGBColor {
    let light = Vector3::new(-0.4, 0.6, 0.7).normalize();
    let normal = camera.turn * (b - a).cross(&(c - a));
    let lit = normal.try_normalize(0.0).map_or(1.0, |n| n.dot(&light).abs());
    mixed(color, RGBColor(0, 0, 0), 0.45 * (1.0 - lit))
}

/// Encodes bytes in base64 (RFC 4648).
pub(super) fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let byte = |i: usize| u32::from(three.get(i).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for place in 0..4 {
            if place > three.len() {
                text.push('=');
            } else {
                text.push(char::from(LETTERS[(bits >> (18 - 6 * place) & 63) as usize]));
            }
        }
    }
    text
}

/// Returns the colors and names of the facets for a legend.
pub(super) fn legend(drawn: &Drawn) -> Vec<(String, String)> {
    let facets = drawn.analysis.facets.iter().enumerate();
    let mut legend: Vec<(String, String)> = facets.map(|(i, f)| (css(color(i)), f.name.clone())).collect();
    legend.push((css(DIRECT), "undeflected".to_owned()));
    legend
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_agrees_with_rfc_4648() {
        // The test vectors of section 10.
        let texts = ["", "f", "fo", "foo", "foob", "fooba", "foobar"];
        let encoded = ["", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"];
        for (text, expected) in texts.into_iter().zip(encoded) {
            assert_eq!(base64(text.as_bytes()), expected);
        }
    }
}
