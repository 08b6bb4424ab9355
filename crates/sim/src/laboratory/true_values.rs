//! Collects the truth of an experiment.

use super::setup::Laboratory;
use crate::build::room::room_from_rig;
use crate::build::trajectory::Trajectory;
use crate::error::SimError;
use crate::laboratory::truth::{self, TrueBeam, TrueFacet, TruePose, Truth};
use crate::light::optics::{End, Mirrors, Setting};
use crate::scene::ErrorModel;
use catoptric_model::{Deflection, PoseData};
use rayon::prelude::*;

impl Laboratory {
    /// The truth of the experiment.
    ///
    /// # Errors
    /// An unknown color.
    pub fn truth(&self) -> Result<Truth, SimError> {
        let edge_rays = self.compiled(Mirrors::Attached)?.edge_rays.as_ref();
        let setting = Setting::new(&self.scene, &self.structure, Mirrors::Attached, Vec::new())?;
        let setting = setting.with_edge_rays(edge_rays);
        let facets = &self.structure.facets;
        let beams = (0..self.sensor.scan().beams())
            .into_par_iter()
            .map(|b| self.true_beam(&setting, b))
            .collect();
        Ok(Truth {
            schema_version: truth::SCHEMA_VERSION,
            name: self.scene.name.clone(),
            seed: self.seed,
            room_from_rig: PoseData::from(&room_from_rig(&self.scene.room)),
            rig_from_sensor: PoseData::from(&self.structure.rig_from_sensor),
            bias: self.sensor.bias().clone(),
            detector_errors: matches!(self.scene.errors.model, ErrorModel::Physical | ErrorModel::Both),
            facets: facets
                .iter()
                .map(|f| TrueFacet {
                    name: f.name.clone(),
                    normal: f.face.normal.into_inner().into(),
                    offset_m: f.face.normal.dot(&f.face.origin.coords),
                    corners_m: f.face.corners.iter().map(|c| c.coords.into()).collect(),
                    curve: f.bent.as_ref().map(|bent| bent.curve),
                })
                .collect(),
            beams,
            poses: (0..self.planned.len())
                .map(|number| TruePose {
                    pose: number,
                    kind: self.planned[number].kind,
                    room_from_board: self.boards[number].as_ref().map(PoseData::from),
                    room_from_board_after: self.movement(number).map(|m| PoseData::from(&m.room_from_board)),
                    mishap: self.mishap(number).cloned(),
                    room_from_sensor: self.flown(number),
                    drift_m: self.drift(number),
                    warm_up_m: self.scene.errors.warm_up.map(|_| {
                        let last = self.planned[number].scans.saturating_sub(1) as f64;
                        let begin = self.start_s(number);
                        let end = begin + last * self.sensor.scan().scan_period_s();
                        [self.warm_up(begin), self.warm_up(end)]
                    }),
                })
                .collect(),
        })
    }

    /// Pose of the sensor at the start of every scan of a flight.
    fn flown(&self, number: usize) -> Vec<PoseData> {
        let planned = &self.planned[number];
        let trajectory = planned.flight.map(|flight| &self.trajectories[flight]);
        let at = |trajectory: &Trajectory, scan| {
            let room_from_rig = trajectory.room_from_rig(self.elapsed_s(scan, 0));
            PoseData::from(&(room_from_rig * self.structure.rig_from_sensor))
        };
        trajectory.map_or_else(Vec::new, |t| (0..planned.scans).map(|scan| at(t, scan)).collect())
    }

    fn true_beam(&self, setting: &Setting<'_>, beam: usize) -> TrueBeam {
        let (status, chief_energy) = self.sensor.classify(setting, beam);
        let chief = self.sensor.chief_path(setting, beam);
        let leaves = matches!(chief.end, End::Escaped) && !chief.facets().is_empty();
        let distance = chief.points().first().map(|p| p.coords.norm());
        let deflection = leaves.then(|| {
            Deflection::from_exit(
                self.sensor.scan().azimuth(beam),
                &chief.last.direction,
                distance.unwrap_or(0.0),
            )
        });
        TrueBeam {
            beam,
            status,
            facets: chief
                .facets()
                .iter()
                .map(|&f| self.structure.facets[f].name.clone())
                .collect(),
            points_m: chief.points().iter().map(|p| p.coords.into()).collect(),
            azimuth_rad: deflection.map(|d| d.azimuth),
            elevation_rad: deflection.map(|d| d.elevation),
            distance_m: distance,
            chief_energy,
        }
    }
}
