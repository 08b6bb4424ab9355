//! Export of the drawing as a table: one row for every corner of every mirror, with the mirror's angles and tolerances.

use crate::layout::{Drawing, plate_thickness};
use catoptric_cast::area_vector;
use catoptric_files::names::defused;
use catoptric_model::Curve;
use catoptric_sim::Scene;
use nalgebra::Vector3;

/// Columns of the table; tolerances are 1σ.
const HEADER: [&str; 20] = [
    "facet",
    "corner",
    "x_mm",
    "y_mm",
    "z_mm",
    "edge_to_next_mm",
    "corner_angle_deg",
    "normal_x",
    "normal_y",
    "normal_z",
    "normal_azimuth_deg",
    "normal_elevation_deg",
    "plane_offset_mm",
    "area_mm2",
    "thickness_mm",
    "tilt_tolerance_sd_deg",
    "shift_tolerance_sd_mm",
    "thickness_tolerance_sd_mm",
    "slope_tolerance_rms_mrad",
    "reflectivity",
];

/// More columns, of a drawing with mirrors that are not flat: the surface that touches the plane, negative radii of convex
/// ones, its axis and where it touches the plane from the middle of the outline.
const CURVED: [&str; 6] = [
    "curve",
    "radius_mm",
    "half_angle_deg",
    "axis_deg",
    "touches_x_mm",
    "touches_y_mm",
];

/// Returns the drawing table as CSV, in the sensor frame; corners are counterclockwise seen from the reflecting side.
///
/// # Errors
/// An error of the CSV writer; writing to memory causes none.
pub fn drawing_table(scene: &Scene, drawing: &Drawing) -> Result<Vec<u8>, csv::Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let bends = drawing.facets.iter().any(|f| f.bent.is_some());
    let curved: &[&str] = if bends { &CURVED } else { &[] };
    writer.write_record(HEADER.iter().chain(curved))?;
    let superstructure = &scene.superstructure;
    let as_built = &superstructure.as_built;
    for facet in &drawing.facets {
        let corners = &facet.face.corners;
        let m = facet.face.normal;
        let count = corners.len();
        let middle = corners.iter().map(|c| c.coords).sum::<Vector3<f64>>();
        let incidence = m.dot(&middle.normalize()).abs();
        for (number, corner) in corners.iter().enumerate() {
            let (next, before) = (
                corners[(number + 1) % count],
                corners[(number + count - 1) % count],
            );
            let (ahead, behind) = (next - corner, before - corner);
            let angle = libm::atan2(ahead.cross(&behind).norm(), ahead.dot(&behind));
            let numbers = [
                1e3 * corner.x,
                1e3 * corner.y,
                1e3 * corner.z,
                1e3 * ahead.norm(),
                angle.to_degrees(),
                m.x,
                m.y,
                m.z,
                libm::atan2(m.y, m.x).to_degrees(),
                libm::atan2(m.z, libm::hypot(m.x, m.y)).to_degrees(),
                1e3 * m.dot(&facet.face.origin.coords),
                0.5e6 * area_vector(corners).norm(),
                1e3 * plate_thickness(scene),
                as_built.tilt_sd_deg,
                as_built.shift_sd_mm,
                as_built.thickness_sd_mm,
                as_built.slope_rms_mrad,
                facet.reflectivity(incidence, scene.light.wavelength_nm),
            ];
            let mut row = vec![defused(&facet.name).into_owned(), (number + 1).to_string()];
            row.extend(numbers.map(|n| rounded(n).to_string()));
            if bends {
                row.extend(curve(facet.bent.as_ref().map(|bent| &bent.curve)));
            }
            writer.write_record(&row)?;
        }
    }
    writer.into_inner().map_err(|e| e.into_error().into())
}

/// The entries of [`CURVED`]; empty where a mirror has no such number.
fn curve(curve: Option<&Curve>) -> [String; 6] {
    let Some(curve) = curve else {
        return ["flat", "", "", "", "", ""].map(str::to_owned);
    };
    let (radius_mm, name) = curve.radius_mm();
    let [x, y] = curve.touches_mm();
    let (half_angle_deg, axis_deg) = match curve {
        Curve::Cylinder(c) => (None, Some(c.axis_deg)),
        Curve::Cone(c) => (Some(c.half_angle_deg), Some(c.axis_deg)),
        Curve::Sphere(_) | Curve::Paraboloid(_) => (None, None),
    };
    let text = |number: Option<f64>| number.map_or_else(String::new, |n| rounded(n).to_string());
    [
        name.to_owned(),
        text(Some(radius_mm)),
        text(half_angle_deg),
        text(axis_deg),
        text(Some(x)),
        text(Some(y)),
    ]
}

/// Rounds to the nearest 10⁻⁶, a nanometer or a microdegree, without a negative zero.
fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6 + 0.0
}
