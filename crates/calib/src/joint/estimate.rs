//! The calibration's entry for an element with a direction from the joint solution.

use super::answer::Answer;
use super::reach::STRAIGHT_SD;
use crate::judge::levers::libm_cos;
use crate::judge::observability::WEAKEST_SD;
use catoptric_model::{BeamEstimate, Status};
use nalgebra::{Matrix2, Vector2};

impl Answer {
    /// Entry for the element. If its facet is `bent`, a direction that is too uncertain for its covariance to hold is
    /// reported as open.
    pub(super) fn estimate(&self, facet: String, iterations: usize, bent: bool) -> BeamEstimate {
        let found = BeamEstimate {
            facet: Some(facet),
            poses: Some(self.seen.len()),
            readings: Some(self.readings),
            iterations: Some(iterations),
            rms_residual_m: Some(self.rms),
            ..BeamEstimate::without_angles(self.beam, Status::Solved, None)
        };
        let open = |direction: Vector2<f64>, reason: String| BeamEstimate {
            status: Status::Unobservable,
            reason: Some(reason),
            null_direction: Some(direction.into()),
            ..found.clone()
        };
        let cos = libm_cos(self.deflection.elevation);
        let Some(tangent) = self.covariance else {
            return open(
                Vector2::new(0.0, 1.0),
                "its facet's plane is not determined by the boards".to_owned(),
            );
        };
        let eigen = tangent.symmetric_eigen();
        let weakest = eigen.eigenvalues.imax();
        let sd = eigen.eigenvalues[weakest].max(0.0).sqrt();
        if sd > WEAKEST_SD || (bent && sd > STRAIGHT_SD) {
            let along = eigen.eigenvectors.column(weakest);
            let direction = Vector2::new(along[0] / cos, along[1]).normalize();
            let direction = if direction[direction.iamax()] < 0.0 {
                -direction
            } else {
                direction
            };
            let reason = if sd > WEAKEST_SD {
                format!(
                    "the boards of its facet leave a direction open, known to {:.1}° at best",
                    sd.to_degrees()
                )
            } else {
                "the boards of its facet determine a direction only by the curvature of their ranges: two directions fit \
                 almost equally well"
                    .to_owned()
            };
            return open(direction, reason);
        }
        let scale = Matrix2::from_diagonal(&Vector2::new(1.0 / cos, 1.0));
        let c = scale * tangent * scale;
        BeamEstimate {
            azimuth_rad: Some(self.deflection.azimuth),
            elevation_rad: Some(self.deflection.elevation),
            distance_m: Some(self.deflection.distance),
            covariance_rad2: Some([[c[(0, 0)], c[(0, 1)]], [c[(1, 0)], c[(1, 1)]]]),
            ..found
        }
    }
}
