//! Plate: a rectangle around one beam.

use super::outline::{check_side, rectangle};
use super::turn::Turn;
use crate::findings::Findings;
use catoptric_model::place::Path;
use catoptric_model::{ScanGeometry, beam, mirror};
use nalgebra::Point3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Part of a step within which a beam is another one's mirror image: what rounding leaves.
const SAME_PART_OF_STEP: f64 = 1e-6;

/// A rectangle around one beam: `azimuth_deg` or `beam`, and either both `exit_` or both `normal_` angles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Plate {
    /// Azimuth of the beam that hits its center, in degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -180.0, max = 180.0))]
    pub azimuth_deg: Option<f64>,
    /// The same beam by its index.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 35999))]
    pub beam: Option<u32>,
    /// Distance from the sensor origin to its center, in millimeters.
    #[schemars(range(min = 1.0, max = 10000.0))]
    pub distance_mm: f64,
    /// Azimuth in which that beam leaves, in degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub exit_azimuth_deg: Option<f64>,
    /// Elevation in which that beam leaves, in degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -90.0, max = 90.0))]
    pub exit_elevation_deg: Option<f64>,
    /// Yaw: azimuth of the normal of the reflecting side, in degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub normal_azimuth_deg: Option<f64>,
    /// Pitch: elevation of that normal, in degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -90.0, max = 90.0))]
    pub normal_elevation_deg: Option<f64>,
    /// Extent parallel to the scan plane, in millimeters.
    #[schemars(range(min = 0.1, max = 10000.0))]
    pub width_mm: f64,
    /// Extent along the other side, in millimeters.
    #[schemars(range(min = 0.1, max = 10000.0))]
    pub height_mm: f64,
}

impl Plate {
    /// Azimuth of the beam that a plate is drawn about, in degrees.
    fn own_azimuth_deg(&self, scan: &ScanGeometry) -> Option<f64> {
        let of_beam = |b: u32| scan.azimuth(b as usize).to_degrees();
        self.azimuth_deg.or(self.beam.map(of_beam))
    }

    /// The rectangle about the point where the beam meets it.
    pub(super) fn corners(&self, scan: &ScanGeometry) -> Option<Vec<Point3<f64>>> {
        let u = beam::direction(self.own_azimuth_deg(scan)?.to_radians());
        let toward =
            |azimuth: f64, elevation: f64| beam::spherical(azimuth.to_radians(), elevation.to_radians());
        let exit = self.exit_azimuth_deg.zip(self.exit_elevation_deg);
        let normal = self.normal_azimuth_deg.zip(self.normal_elevation_deg);
        let m = match (exit, normal) {
            (Some((azimuth, elevation)), None) => mirror::normal_between(&u, &toward(azimuth, elevation))?,
            (None, Some((azimuth, elevation))) => toward(azimuth, elevation),
            _ => return None,
        };
        let center = Point3::from(u.into_inner() * (1e-3 * self.distance_mm));
        rectangle(
            center,
            m.into_inner(),
            [1e-3 * self.width_mm, 1e-3 * self.height_mm],
        )
    }

    pub(super) fn turn(&mut self, turn: &Turn, scan: &ScanGeometry) {
        if let Some(azimuth) = self.own_azimuth_deg(scan) {
            self.azimuth_deg = Some(turn.azimuth(azimuth));
            self.beam = None;
        }
        self.exit_azimuth_deg = self.exit_azimuth_deg.map(|a| turn.azimuth(a));
        self.normal_azimuth_deg = self.normal_azimuth_deg.map(|a| turn.azimuth(a));
    }

    pub(super) fn left_right(&mut self, scan: &ScanGeometry) {
        self.azimuth_deg = self.azimuth_deg.map(|a| -a);
        if let Some(beam) = self.beam {
            self.beam = opposite(beam, scan);
            if self.beam.is_none() {
                self.azimuth_deg = Some(-scan.azimuth_deg(beam as usize));
            }
        }
        self.exit_azimuth_deg = self.exit_azimuth_deg.map(|a| -a);
        self.normal_azimuth_deg = self.normal_azimuth_deg.map(|a| -a);
    }

    pub(super) fn up_down(&mut self) {
        self.exit_elevation_deg = self.exit_elevation_deg.map(|e| -e);
        self.normal_elevation_deg = self.normal_elevation_deg.map(|e| -e);
    }

    /// Checks it; `path` leads to it.
    pub(super) fn check(&self, scan: &ScanGeometry, path: &Path, found: &mut Findings) {
        match (self.azimuth_deg, self.beam) {
            (Some(_), Some(_)) => found.add(
                &path.key("beam"),
                "names a beam, and `azimuth_deg` names another",
                "delete one of the two".to_owned(),
            ),
            (None, Some(beam)) if beam as usize >= scan.beams() => {
                found.add(
                    &path.key("beam"),
                    format_args!("is {beam}; 0 to {} is allowed", scan.beams() - 1),
                    None,
                );
                return;
            }
            (None, None) => found.add(
                path,
                "does not name the beam that hits its center",
                "set azimuth_deg or beam".to_owned(),
            ),
            _ => {}
        }
        let exit = [self.exit_azimuth_deg, self.exit_elevation_deg];
        let normal = [self.normal_azimuth_deg, self.normal_elevation_deg];
        let given = |angles: &[Option<f64>; 2]| angles.iter().flatten().count();
        if !matches!((given(&exit), given(&normal)), (2, 0) | (0, 2)) {
            found.add(
                path,
                "needs exactly one direction, but has none, half of one, or two",
                "set exit_azimuth_deg and exit_elevation_deg, or normal_azimuth_deg and normal_elevation_deg"
                    .to_owned(),
            );
            return;
        }
        let one_beam = self.azimuth_deg.is_some() != self.beam.is_some();
        match self.corners(scan) {
            Some(corners) => {
                let help = "reverse the normal: it points from the mirror toward the scanner's side";
                check_side(&corners, path, help, found);
            }
            None if one_beam => found.add(
                path,
                "describes no mirror: its beam leaves undeflected",
                "turn exit_azimuth_deg or exit_elevation_deg away from the beam".to_owned(),
            ),
            None => {}
        }
    }
}

/// The beam whose azimuth is the opposite of another one's, if the scan has it.
fn opposite(beam: u32, scan: &ScanGeometry) -> Option<u32> {
    let azimuth = -scan.azimuth(beam as usize);
    let found = scan.nearest(azimuth)?;
    let off = (scan.place(azimuth) - found as f64).abs();
    u32::try_from(found).ok().filter(|_| off < SAME_PART_OF_STEP)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use catoptric_cast::area_vector;
    use nalgebra::Vector3;

    pub(crate) fn by_exit() -> Plate {
        Plate {
            azimuth_deg: None,
            beam: Some(800),
            distance_mm: 64.0,
            exit_azimuth_deg: Some(48.0),
            exit_elevation_deg: Some(35.0),
            normal_azimuth_deg: None,
            normal_elevation_deg: None,
            width_mm: 17.0,
            height_mm: 12.0,
        }
    }

    #[test]
    fn a_plate_sends_its_beam_in_the_requested_direction() {
        let corners = by_exit()
            .corners(&ScanGeometry::default())
            .expect("it is a mirror");
        let normal = nalgebra::Unit::new_normalize(area_vector(&corners));
        let plane = catoptric_model::MirrorPlane::through(corners[0], normal);
        let azimuth = ScanGeometry::default().azimuth(800);
        let deflection = plane
            .deflect(beam::direction(azimuth))
            .expect("it faces the scanner");
        let wanted = beam::spherical(48.0_f64.to_radians(), 35.0_f64.to_radians());
        assert!(beam::angle_between(&deflection.exit_direction(azimuth), &wanted) < 1e-14);
        assert!((deflection.distance - 0.064).abs() < 1e-15);
        let center = corners.iter().map(|c| c.coords).sum::<Vector3<f64>>() / 4.0;
        assert!((center - beam::direction(azimuth).into_inner() * 0.064).norm() < 1e-15);
        assert!(((corners[1] - corners[0]).norm() - 0.017).abs() < 1e-15);
    }
}
