//! Wedge: a facet between two azimuths and two heights.

use super::outline::{covers, reach, rounded};
use super::turn::Turn;
use crate::findings::Findings;
use catoptric_cast::area_vector;
use catoptric_model::place::KeyPath;
use catoptric_model::{ScanGeometry, beam, mirror};
use nalgebra::{Point3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A facet between two azimuths.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Wedge {
    /// First and last azimuth, in degrees, the smaller first.
    #[schemars(inner(range(min = -360.0, max = 360.0)))]
    pub azimuth_deg: [f64; 2],
    /// Distance from the sensor origin along the middle azimuth, in millimeters.
    #[schemars(range(min = 1.0, max = 10000.0))]
    pub distance_mm: f64,
    /// Azimuth in which the middle beam leaves, in degrees.
    #[schemars(range(min = -360.0, max = 360.0))]
    pub exit_azimuth_deg: f64,
    /// Elevation in which the middle beam leaves, in degrees.
    #[schemars(range(min = -90.0, max = 90.0))]
    pub exit_elevation_deg: f64,
    /// Height of the facet, centered on the scan plane, in millimeters.
    #[schemars(range(min = 0.1, max = 10000.0))]
    pub height_mm: f64,
}

impl Wedge {
    /// The plane mirror that sends the middle beam in the requested direction, cut at the two azimuths and heights.
    pub(super) fn corners(&self) -> Option<Vec<Point3<f64>>> {
        let [first, last] = self.azimuth_deg.map(f64::to_radians);
        let u = beam::direction(0.5 * (first + last));
        let v = beam::spherical(
            self.exit_azimuth_deg.to_radians(),
            self.exit_elevation_deg.to_radians(),
        );
        let m = mirror::normal_between(&u, &v)?;
        let offset = m.dot(&u) * self.distance_mm * 1e-3;
        let corner = |azimuth: f64, z: f64| {
            let u = beam::direction(azimuth);
            let radius = (offset - m.z * z) / m.dot(&u);
            (radius.is_finite() && radius > 0.0)
                .then(|| Point3::from(u.into_inner() * radius + Vector3::z() * z))
        };
        let z = 0.5e-3 * self.height_mm;
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

    pub(super) fn turn(&mut self, turn: &Turn) {
        let middle = 0.5 * (self.azimuth_deg[0] + self.azimuth_deg[1]);
        // Both by the same amount, which keeps the width of the wedge.
        let by = turn.azimuth(middle) - middle;
        self.azimuth_deg = self.azimuth_deg.map(|a| a + by);
        self.exit_azimuth_deg = turn.azimuth(self.exit_azimuth_deg);
    }

    pub(super) fn left_right(&mut self) {
        let [first, last] = self.azimuth_deg;
        self.azimuth_deg = [-last, -first];
        self.exit_azimuth_deg = -self.exit_azimuth_deg;
    }

    pub(super) fn up_down(&mut self) {
        self.exit_elevation_deg = -self.exit_elevation_deg;
    }

    /// Checks it; `path` leads to it.
    pub(super) fn check(&self, scan: &ScanGeometry, path: &KeyPath, found: &mut Findings) {
        let [first, last] = self.azimuth_deg;
        let azimuths = path.key("azimuth_deg");
        if first >= last {
            found.add(
                &azimuths,
                format_args!("runs from {first}° to {last}°; the smaller azimuth comes first"),
                (first > last).then(|| format!("write [{last}, {first}]")),
            );
            return;
        }
        if !covers(scan, first, last) {
            found.add(
                &azimuths,
                format_args!("is [{}, {}]°; {}", rounded(first), rounded(last), reach(scan)),
                "a mirror behind the scanner would get no light".to_owned(),
            );
            return;
        }
        let step_deg = scan.angles().step_deg;
        if last - first < step_deg {
            let radians = last.abs().max(first.abs()) <= std::f64::consts::PI;
            let in_degrees = || {
                let [a, b] = [first, last].map(|v| rounded(v.to_degrees()));
                format!("angles are in degrees; if these were radians, write [{a}, {b}]")
            };
            found.add(
                &azimuths,
                format_args!(
                    "spans {}°; a mirror needs at least the {}° between two beams",
                    rounded(last - first),
                    rounded(step_deg)
                ),
                radians.then(in_degrees),
            );
            return;
        }
        if self.corners().is_none() {
            let middle = 0.5 * (first + last);
            let u = beam::direction(middle.to_radians());
            let v = beam::spherical(
                self.exit_azimuth_deg.to_radians(),
                self.exit_elevation_deg.to_radians(),
            );
            let turn = beam::angle_between(&u, &v).to_degrees();
            found.add(
                path,
                format_args!(
                    "describes no mirror: turning the beam at {middle}° by {}° needs a plane that not all beams \
                     from {first}° to {last}° hit",
                    rounded(turn)
                ),
                "turn the beam farther, narrow azimuth_deg or lower height_mm".to_owned(),
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use catoptric_model::MirrorPlane;
    use nalgebra::Unit;

    #[test]
    fn a_wedge_sends_its_middle_beam_in_the_requested_direction() {
        let wedge = Wedge {
            azimuth_deg: [62.0, 77.0],
            distance_mm: 70.0,
            exit_azimuth_deg: 60.0,
            exit_elevation_deg: -50.0,
            height_mm: 12.0,
        };
        let corners = wedge.corners().expect("it is a mirror");
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
}
