//! Export to URDF: the scanner and its mirrors as links, lengths in meters, rotations in radians about fixed x, y and
//! z.

use crate::layout::{Drawing, center};
use catoptric_model::Pose;
use catoptric_model::frame::tangent_basis;
use catoptric_sim::Scene;
use catoptric_sim::build::nominal_mount;
use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion};

/// Returns the frames of a layout: the rig, the laser as drawn, and one per mirror, its z axis along the normal.
pub fn urdf(scene: &Scene, drawing: &Drawing) -> String {
    let mut xml = format!(
        "<?xml version=\"1.0\"?>\n<!-- Frames of a layout of mirrors around a 2D laser scanner: meters, radians. -->\n<robot \
         name=\"{}\">\n  <link name=\"rig\"/>\n  <link name=\"laser\">\n",
        escape(&scene.name)
    );
    for part in scene.scanner.housing_boxes() {
        let place = numbers(part.center_mm.map(|mm| 1e-3 * mm));
        let size = numbers(part.size_mm.map(|mm| 1e-3 * mm));
        for kind in ["visual", "collision"] {
            xml += &format!(
                "    <{kind}>\n      <origin xyz=\"{place}\" rpy=\"0 0 0\"/>\n      <geometry><box size=\"{size}\"/></geometry>\n    \
                 </{kind}>\n"
            );
        }
    }
    xml += "  </link>\n";
    xml += &joint("rig", "laser", &nominal_mount(scene));
    for facet in &drawing.facets {
        let link = format!("mirror_{}", facet.name);
        let normal = facet.face.normal;
        let (a, b) = tangent_basis(&normal);
        // A right-handed frame: the tangent basis is right-handed with the opposite direction.
        let columns = [a.into_inner(), b.into_inner(), a.cross(&b)];
        let mut turn = Matrix3::from_columns(&columns);
        if turn.column(2).dot(&normal) < 0.0 {
            turn = Matrix3::from_columns(&[columns[1], columns[0], -columns[2]]);
        }
        let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn));
        let middle = center(&facet.face.corners);
        xml += &format!("  <link name=\"{}\"/>\n", escape(&link));
        xml += &joint(
            "laser",
            &link,
            &Pose::from_parts(Translation3::from(middle), turn),
        );
    }
    xml + "</robot>\n"
}

fn joint(parent: &str, child: &str, parent_from_child: &Pose) -> String {
    let (roll, pitch, yaw) = parent_from_child.rotation.euler_angles();
    let place: [f64; 3] = parent_from_child.translation.vector.into();
    let (parent, child) = (escape(parent), escape(child));
    format!(
        "  <joint name=\"{parent}_to_{child}\" type=\"fixed\">\n    <parent link=\"{parent}\"/>\n    <child link=\"{child}\"/>\n    \
         <origin xyz=\"{}\" rpy=\"{}\"/>\n  </joint>\n",
        numbers(place),
        numbers([roll, pitch, yaw])
    )
}

/// Formats three numbers to the nearest 10⁻⁹.
fn numbers(values: [f64; 3]) -> String {
    values
        .map(|v| ((v * 1e9).round() / 1e9 + 0.0).to_string())
        .join(" ")
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_end_an_attribute() {
        assert_eq!(escape("\"/><a b='&amp;'"), "&quot;/&gt;&lt;a b='&amp;amp;'");
        assert_eq!(escape("plain-1"), "plain-1");
    }
}
