//! The spot of neighboring beams on a board: Cooper, Figures 2 and 3.
//!
//! A beam's extent is four standard deviations of the distribution of its light (D4σ, ISO 11146): for a Gaussian beam
//! this is the full width of its 1/e² contour, which five or more sub-rays reproduce exactly. The spot of several beams
//! extends from the first edge to the last.

use crate::light::footprint;
use crate::receive::reading::Sensor;
use catoptric_model::{BoardPlane, Pose};
use nalgebra::Vector2;

impl Sensor {
    /// Extents along a board's x and y, in meters, of the spot of the beams nearest to its center.
    ///
    /// `None` if part of the light misses the board's plane, or if the scan does not have that many beams there.
    pub fn spot(&self, sensor_from_board: &Pose, beams: usize) -> Option<[f64; 2]> {
        let plane = BoardPlane::of_pose(sensor_from_board);
        let scan = self.scan();
        let middle = scan.nearest(libm::atan2(plane.point.y, plane.point.x))?;
        let first = (0..beams / 2).try_fold(middle, |beam, _| scan.neighbors(beam)[0])?;
        let next = |beam: &usize| scan.neighbors(*beam)[1];
        let of_spot: Vec<usize> = std::iter::successors(Some(first), next).take(beams).collect();
        if of_spot.len() < beams {
            return None;
        }
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for beam in of_spot {
            let azimuth = scan.azimuth(beam);
            let (mut mean, mut square) = (Vector2::zeros(), Vector2::zeros());
            for sub_ray in self.sub_ray_list() {
                let ray = footprint::ray(self.shape(), azimuth, sub_ray);
                let distance = plane.distance_along(&ray.origin, &ray.direction)?;
                let point = sensor_from_board
                    .inverse_transform_point(&(ray.origin + ray.direction.into_inner() * distance));
                let at = Vector2::new(point.x, point.y);
                mean += at * sub_ray.weight;
                square += at.component_mul(&at) * sub_ray.weight;
            }
            for axis in 0..2 {
                let half = 2.0 * (square[axis] - mean[axis] * mean[axis]).max(0.0).sqrt();
                low[axis] = f64::min(low[axis], mean[axis] - half);
                high[axis] = f64::max(high[axis], mean[axis] + half);
            }
        }
        Some([high[0] - low[0], high[1] - low[1]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Preset, Scene};
    use nalgebra::{Translation3, UnitQuaternion, Vector3};

    fn sensor(preset: &str, sub_rays: usize) -> Sensor {
        let text = format!(
            "schema_version = 1\nname = \"spot\"\nscanner = {{ preset = \"{preset}\", sub_rays = {sub_rays} }}"
        );
        let scene: Scene = toml::from_str(&text).expect("it is a scene");
        Sensor::new(&scene).expect("white is a color")
    }

    /// A board straight ahead whose x axis is along the scan.
    fn ahead(range: f64, tilt: f64) -> Pose {
        let facing = UnitQuaternion::from_basis_unchecked(&[-Vector3::y(), Vector3::z(), -Vector3::x()]);
        let turned = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), tilt);
        Pose::from_parts(Translation3::new(range, 0.0, 0.0), turned * facing)
    }

    #[test]
    fn a_face_on_spot_is_the_beams_own_contour_and_two_steps() {
        for preset in Preset::ALL.into_iter().filter(|p| *p != Preset::Custom) {
            let (shape, step_deg, preset) = (preset.beam_shape(), preset.limits().step_deg, preset.name());
            for range in [0.5, 4.0] {
                let [width, height] = sensor(preset, 61).spot(&ahead(range, 0.0), 3).expect("it is met");
                let half = |full_mrad: f64| libm::tan(0.5e-3 * full_mrad);
                let wide = 1e-3 * shape.wide_aperture_mm
                    + 2.0 * range * half(shape.wide_full_mrad)
                    + 2.0 * range * libm::tan(step_deg.to_radians());
                let high = 1e-3 * shape.narrow_aperture_mm + 2.0 * range * half(shape.narrow_full_mrad);
                // The outer two beams hit the board 0.25° off its normal, and the spot rotates by as much.
                assert!(
                    (width / wide - 1.0).abs() < 1e-3,
                    "{preset}: {width} against {wide}"
                );
                assert!(
                    (height / high - 1.0).abs() < 2e-2,
                    "{preset}: {height} against {high}"
                );
            }
        }
    }

    #[test]
    fn a_turned_board_stretches_the_spot() {
        let sensor = sensor("ust-20lx", 61);
        let face_on = sensor.spot(&ahead(2.0, 0.0), 1).expect("it is met");
        let turned = sensor.spot(&ahead(2.0, 1.0), 1).expect("it is met");
        // To second order in the beam's half angle, here 8 mrad times tan 1.
        assert!((turned[0] * libm::cos(1.0) / face_on[0] - 1.0).abs() < 2e-3);
    }
}
