//! Computes the corners of a facet, in the nominal sensor frame, from its description in the scene.

use crate::scene::{FacetShape, Plate, RectangleShape, Wedge};
use catoptric_cast::area_vector;
use catoptric_model::{ScanGeometry, beam, mirror};
use nalgebra::{Point3, Unit, Vector3};

/// Corners of a facet as drawn, in meters, counter-clockwise seen from the reflecting side.
///
/// `None` if the description spans no mirror: a beam that is not deflected, a plane that one of the two azimuths
/// does not meet, a normal of zero length.
pub fn corners(shape: &FacetShape, scan: &ScanGeometry) -> Option<Vec<Point3<f64>>> {
    match shape {
        FacetShape::Wedge(wedge) => wedge_corners(wedge),
        FacetShape::Plate(plate) => plate_corners(plate, scan),
        FacetShape::Rectangle(rectangle) => rectangle_corners(rectangle),
        FacetShape::Polygon(polygon) => Some(
            polygon
                .corners_mm
                .iter()
                .map(|c| Point3::from(Vector3::from(*c) * 1e-3))
                .collect(),
        ),
    }
}

/// The plane mirror that sends the middle beam in the requested direction, cut at the two azimuths and heights.
fn wedge_corners(wedge: &Wedge) -> Option<Vec<Point3<f64>>> {
    let [first, last] = wedge.azimuth_deg.map(f64::to_radians);
    let u = beam::direction(0.5 * (first + last));
    let v = beam::spherical(
        wedge.exit_azimuth_deg.to_radians(),
        wedge.exit_elevation_deg.to_radians(),
    );
    let m = mirror::normal_between(&u, &v)?;
    let offset = m.dot(&u) * wedge.distance_mm * 1e-3;
    let corner = |azimuth: f64, z: f64| {
        let u = beam::direction(azimuth);
        let radius = (offset - m.z * z) / m.dot(&u);
        (radius.is_finite() && radius > 0.0).then(|| Point3::from(u.into_inner() * radius + Vector3::z() * z))
    };
    let z = 0.5e-3 * wedge.height_mm;
    let mut corners = vec![
        corner(first, -z)?,
        corner(last, -z)?,
        corner(last, z)?,
        corner(first, z)?,
    ];
    if area_vector(&corners).dot(&m) < 0.0 {
        corners.reverse();
    }
    Some(corners)
}

/// Azimuth of the beam that a plate is drawn about, in degrees.
pub(crate) fn plate_azimuth_deg(plate: &Plate, scan: &ScanGeometry) -> Option<f64> {
    let of_beam = |b: u32| scan.azimuth(b as usize).to_degrees();
    plate.azimuth_deg.or(plate.beam.map(of_beam))
}

/// The rectangle about the point where the beam meets it.
fn plate_corners(plate: &Plate, scan: &ScanGeometry) -> Option<Vec<Point3<f64>>> {
    let u = beam::direction(plate_azimuth_deg(plate, scan)?.to_radians());
    let toward = |azimuth: f64, elevation: f64| beam::spherical(azimuth.to_radians(), elevation.to_radians());
    let exit = plate.exit_azimuth_deg.zip(plate.exit_elevation_deg);
    let normal = plate.normal_azimuth_deg.zip(plate.normal_elevation_deg);
    let m = match (exit, normal) {
        (Some((azimuth, elevation)), None) => mirror::normal_between(&u, &toward(azimuth, elevation))?,
        (None, Some((azimuth, elevation))) => toward(azimuth, elevation),
        _ => return None,
    };
    let center = Point3::from(u.into_inner() * (1e-3 * plate.distance_mm));
    rectangle(
        center,
        m.into_inner(),
        [1e-3 * plate.width_mm, 1e-3 * plate.height_mm],
    )
}

fn rectangle_corners(shape: &RectangleShape) -> Option<Vec<Point3<f64>>> {
    rectangle(
        Point3::from(Vector3::from(shape.center_mm) * 1e-3),
        shape.normal.into(),
        [1e-3 * shape.width_mm, 1e-3 * shape.height_mm],
    )
}

/// Corners of a rectangle whose width is horizontal, in meters; `None` for a zero-length normal.
pub(crate) fn rectangle(
    center: Point3<f64>,
    normal: Vector3<f64>,
    [width, height]: [f64; 2],
) -> Option<Vec<Point3<f64>>> {
    let m = Unit::try_new(normal, f64::MIN_POSITIVE)?;
    // A mirror parallel to the scan plane has no distinguished horizontal side; use x.
    let across = Unit::try_new(Vector3::z().cross(&m), 1e-9).unwrap_or(Vector3::x_axis());
    let along = m.cross(&across);
    let (x, y) = (across.into_inner() * (0.5 * width), along * (0.5 * height));
    Some(vec![
        center - x - y,
        center + x - y,
        center + x + y,
        center - x + y,
    ])
}

#[cfg(test)]
mod tests {
    use super::*;
    use catoptric_model::MirrorPlane;

    #[test]
    fn a_wedge_sends_its_middle_beam_in_the_requested_direction() {
        let wedge = Wedge {
            azimuth_deg: [62.0, 77.0],
            distance_mm: 70.0,
            exit_azimuth_deg: 60.0,
            exit_elevation_deg: -50.0,
            height_mm: 12.0,
        };
        let corners = wedge_corners(&wedge).expect("it is a mirror");
        let plane = MirrorPlane::through(corners[0], Unit::new_normalize(area_vector(&corners)));
        let middle = 69.5_f64.to_radians();
        let deflection = plane
            .deflect(beam::direction(middle))
            .expect("it faces the scanner");
        let wanted = beam::spherical(60.0_f64.to_radians(), -50.0_f64.to_radians());
        assert!(beam::angle_between(&deflection.exit_direction(middle), &wanted) < 1e-14);
        assert!((deflection.distance - 0.07).abs() < 1e-15);
        for c in &corners {
            assert!((plane.normal.dot(&c.coords) - plane.offset).abs() < 1e-15);
        }
    }

    #[test]
    fn a_rectangle_faces_along_its_normal() {
        let shape = RectangleShape {
            center_mm: [0.0, 94.0, 0.0],
            normal: [0.45, -0.33, -0.4036],
            width_mm: 68.0,
            height_mm: 20.0,
        };
        let corners = rectangle_corners(&shape).expect("it is a mirror");
        let m = Unit::new_normalize(Vector3::from(shape.normal));
        let area = area_vector(&corners);
        assert!((area.norm() * 0.5 - 0.068 * 0.02).abs() < 1e-12);
        assert!(beam::angle_between(&Unit::new_normalize(area), &m) < 1e-12);
        assert!((corners[0].z - corners[1].z).abs() < 1e-15);
    }
}
