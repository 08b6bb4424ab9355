//! What noise, drift, markers, biases, distances, mounting and covariances allow a residual on a board or a wall to be.
//!
//! This is the paper's step 13 with numbers: the variance of the range that a calibrated element should read, from the
//! error budget of the estimator at the calibrated direction and from the stated covariance of that direction, taken as
//! independent of each other.

use catoptric_calib::covariance::{MountUncertainty, budget};
use catoptric_calib::observations::{self, BoardView};
use catoptric_model::{BeamEstimate, BoardPlane, Calibration, Dataset, Deflection, Pose, Session, beam};
use nalgebra::{Matrix2, Matrix6, Unit};

/// The errors that a calibration leaves.
pub(super) struct Allowance<'a> {
    session: &'a Session,
    mount: MountUncertainty,
}

impl<'a> Allowance<'a> {
    pub(super) fn of(dataset: &'a Dataset, calibration: &Calibration) -> Self {
        let session = &dataset.session;
        let stated = calibration.rig_from_sensor.as_ref().and_then(|m| m.covariance);
        let mount = match stated {
            Some(c) => Matrix6::from_fn(|i, j| c[i][j]),
            None => super::mounting::of_tolerance(&session.mount_tolerance),
        };
        Self {
            session,
            mount: mount.into(),
        }
    }

    /// Variance of the range that an element reads of a surface, without the noise of its readings, in square meters.
    pub(super) fn variance(
        &self,
        estimate: &BeamEstimate,
        deflection: &Deflection,
        on: &BoardView<'_>,
    ) -> Option<f64> {
        let azimuth = observations::azimuth(self.session, estimate.beam);
        let budget = budget(
            self.session,
            &self.mount,
            azimuth,
            deflection,
            std::slice::from_ref(on),
        )?;
        let direction = estimate.covariance_rad2.map_or(0.0, |c| {
            let c = Matrix2::new(c[0][0], c[0][1], c[1][0], c[1][1]);
            let row = budget.jacobian.fixed_view::<1, 2>(0, 0);
            (row * c * row.transpose())[0]
        });
        let glass = self.session.glass.map_or(0.0, |glass| {
            let (beam, exit) = (beam::direction(azimuth), deflection.exit_direction(azimuth));
            let by_thickness = glass
                .effect(&beam, &exit)
                .on_plane(&beam, &exit, &on.plane.normal);
            (1e-3 * glass.thickness_sd_mm * by_thickness).powi(2)
        });
        Some(budget.covariance[(0, 0)] + direction + glass)
    }

    /// A wall of the surveyed room as a board without markers.
    pub(super) fn of_wall<'b>(
        &self,
        wall: &BoardPlane,
        room_from_sensor: &Pose,
        color: &'b str,
    ) -> BoardView<'b> {
        let sensor_from_room = room_from_sensor.inverse();
        let normal = sensor_from_room.rotation * wall.normal.into_inner();
        BoardView {
            plane: BoardPlane::new(sensor_from_room * wall.point, Unit::new_unchecked(normal)),
            markers: &[],
            color,
            noise_sd: 0.0,
            count: 1,
        }
    }
}
