//! The oracle: the truth as a calibration, which must score zero error.

use catoptric_calib::{CalibError, Calibrator};
use catoptric_model::calibration::MountEstimate;
use catoptric_model::{BeamEstimate, Calibration, Dataset, Status, calibration};
use catoptric_sim::Truth;
use catoptric_sim::truth::BeamClass;

/// Variance that represents certainty, in square radians: a standard deviation of one microradian.
const CERTAIN: f64 = 1e-12;

/// A calibrator that knows the truth. It is not an estimator but a check of the score.
#[derive(Debug, Clone)]
pub struct Oracle {
    /// The truth.
    pub truth: Truth,
}

impl Calibrator for Oracle {
    fn name(&self) -> &str {
        "oracle"
    }

    fn calibrate(&self, dataset: &Dataset) -> Result<Calibration, CalibError> {
        let estimate = |beam: usize| {
            let Some(known) = self.truth.beams.iter().find(|b| b.beam == beam) else {
                let reason = Some("the truth has no such beam".to_owned());
                return BeamEstimate::without_angles(beam, Status::Rejected, reason);
            };
            match (known.status, known.deflection()) {
                (BeamClass::Deflected, Some(deflection)) => BeamEstimate {
                    facet: known.facets.first().cloned(),
                    azimuth_rad: Some(deflection.azimuth),
                    elevation_rad: Some(deflection.elevation),
                    distance_m: Some(deflection.distance),
                    covariance_rad2: Some([[CERTAIN, 0.0], [0.0, CERTAIN]]),
                    ..BeamEstimate::without_angles(beam, Status::Solved, None)
                },
                (BeamClass::Direct, _) => {
                    BeamEstimate::without_angles(beam, Status::Direct, Some("the truth says so".to_owned()))
                }
                _ => BeamEstimate::without_angles(
                    beam,
                    Status::Rejected,
                    Some("it is not deflected once and unsplit".to_owned()),
                ),
            }
        };
        let mount = &self.truth.rig_from_sensor;
        Ok(Calibration {
            schema_version: calibration::SCHEMA_VERSION,
            method: "oracle".to_owned(),
            frame: "sensor".to_owned(),
            scanner: Some(*dataset.session.scanner.scan.angles()),
            dataset: dataset.id.clone(),
            beams: (0..dataset.session.scanner.scan.beams()).map(estimate).collect(),
            facets: Vec::new(),
            rig_from_sensor: Some(MountEstimate {
                translation_m: mount.translation_m,
                rotation_xyzw: mount.rotation_xyzw,
                covariance: None,
            }),
            bias: None,
            warnings: Vec::new(),
            assessment: None,
        })
    }
}
