//! What the sensor sees during a stretch, scan by scan, before random effects.
//!
//! In a flight, beam i of scan k is cast from where the sensor is at k·T + i·step after the first waypoint; everything
//! else is as at rest. Every scan is a function of the scene, the seed and its number alone.

use super::setup::{Compiled, Laboratory};
use super::targets::wall_targets;
use crate::build::color;
use crate::build::stage::Stage;
use crate::build::trajectory::Trajectory;
use crate::error::SimError;
use crate::light::optics::{Mirrors, Rig, Setting};
use crate::receive::reading::{Parts, Return, SubRayEnd};
use catoptric_cast::PACKET;
use catoptric_model::{Pose, PoseKind};
use rayon::prelude::*;

/// What every beam receives during a scan, before random effects; `None` without an echo.
pub type Returns = Vec<Option<Return>>;

/// A stretch with an index over everything that light can hit in it.
pub struct Sight<'a> {
    laboratory: &'a Laboratory,
    setting: Setting<'a>,
    /// After the board has moved: the first such scan, and the setting from then on.
    after: Option<(usize, Setting<'a>)>,
    trajectory: Option<&'a Trajectory>,
    /// The compiled paths via the structure.
    rig: &'a Rig,
}

/// Smallest number of beams of a scan that is worth another thread.
const BEAMS_OF_A_THREAD: usize = 64;

/// Maximum number of packets in which neighboring beams are cast together.
const PACKETS: usize = 4;

/// Number of beams that are cast together: the one that leaves the smallest share of padding in the packets of their
/// rays.
fn together(sub_rays: usize) -> usize {
    let filled = |beams: usize| {
        let rays = beams * sub_rays;
        rays as f64 / rays.next_multiple_of(PACKET) as f64
    };
    let most = (PACKETS * PACKET / sub_rays.max(1)).clamp(1, BEAMS_OF_A_THREAD);
    (1..=most).fold(
        1,
        |best, beams| if filled(beams) > filled(best) { beams } else { best },
    )
}

impl Laboratory {
    /// What the sensor sees during a stretch.
    ///
    /// # Errors
    /// An unknown color.
    pub fn sight(&self, number: usize) -> Result<Sight<'_>, SimError> {
        let planned = &self.planned[number];
        let trajectory = planned.flight.map(|flight| &self.trajectories[flight]);
        let setting = match trajectory {
            Some(trajectory) => {
                let start = trajectory.room_from_first() * self.structure.rig_from_sensor;
                let start_from_room = start.inverse();
                let wall_paint = color::paint(&self.scene, &self.scene.room.color)?;
                let walls = wall_targets(&self.scene, &start_from_room, &wall_paint);
                let stage = Stage::new(&self.scene, &start_from_room)?;
                Setting::in_flight(&self.scene, &self.structure, stage, walls)?
            }
            None => {
                let mirrors = match planned.kind {
                    PoseKind::Bare => Mirrors::Removed,
                    _ => Mirrors::Attached,
                };
                self.setting_with(number, mirrors, self.boards[number].as_ref())?
            }
        };
        let after = match self.movement(number) {
            Some(m) => {
                let there = Some(&m.room_from_board);
                Some((m.scan, self.setting_with(number, Mirrors::Attached, there)?))
            }
            None => None,
        };
        let mirrors = match planned.kind {
            PoseKind::Bare => Mirrors::Removed,
            _ => Mirrors::Attached,
        };
        let compiled = self.compiled(mirrors)?;
        let edge_rays = compiled.edge_rays.as_ref();
        Ok(Sight {
            rig: &compiled.rig,
            after: after.map(|(scan, setting)| (scan, setting.with_edge_rays(edge_rays))),
            laboratory: self,
            setting: setting.with_edge_rays(edge_rays),
            trajectory,
        })
    }

    fn setting_with(
        &self,
        number: usize,
        mirrors: Mirrors,
        room_from_board: Option<&Pose>,
    ) -> Result<Setting<'_>, SimError> {
        let targets = self.targets(number, room_from_board)?;
        Setting::in_room(
            &self.scene,
            &self.structure,
            mirrors,
            self.stage.as_ref(),
            targets,
        )
    }

    /// What is compiled of the structure, with or without its mirrors; on first use.
    pub(super) fn compiled(&self, mirrors: Mirrors) -> Result<&Compiled, SimError> {
        let kept = match mirrors {
            Mirrors::Attached => &self.compiled[0],
            Mirrors::Removed => &self.compiled[1],
        };
        if let Some(compiled) = kept.get() {
            return Ok(compiled);
        }
        let bare = Setting::new(&self.scene, &self.structure, mirrors, Vec::new())?;
        // Outside the lock: a thread that waits for others to compile may take up another stretch and get here again.
        let edge_rays = self.sensor.edge_rays(&bare);
        let rig = self.sensor.compile(&bare.with_edge_rays(edge_rays.as_ref()));
        Ok(kept.get_or_init(|| Compiled { rig, edge_rays }))
    }

    /// Time at which a beam of a scan is read, in seconds since its stretch began.
    pub(super) fn elapsed_s(&self, scan: usize, beam: usize) -> f64 {
        let geometry = self.sensor.scan();
        scan as f64 * geometry.scan_period_s() + geometry.time_of(beam)
    }
}

impl Sight<'_> {
    /// Whether anything moves, so that scans differ.
    pub fn moves(&self) -> bool {
        self.trajectory.is_some() || self.after.is_some()
    }

    /// Whether the sensor itself moves, so that no two scans are the same.
    pub fn flies(&self) -> bool {
        self.trajectory.is_some()
    }

    /// Whether a scan may see something other than the one before it; false for the first.
    pub fn changes_at(&self, scan: usize) -> bool {
        scan > 0 && (self.trajectory.is_some() || self.after.as_ref().is_some_and(|(from, _)| *from == scan))
    }

    /// Everything that light can hit, as it is around the sensor at the start.
    pub fn setting(&self) -> &Setting<'_> {
        &self.setting
    }

    /// What every beam of a scan receives; the same as for the scan before unless [`Sight::changes_at`].
    pub fn returns(&self, scan: usize) -> Returns {
        let mut returns = Vec::new();
        self.look(scan, &mut returns);
        returns
    }

    /// As [`Sight::returns`], overwriting the returns of another scan.
    pub fn look(&self, scan: usize, returns: &mut Returns) {
        let sensor = &self.laboratory.sensor;
        let together = together(sensor.sub_rays());
        let observe = |parts: &mut Parts, first: usize, returns: &mut [Option<Return>]| {
            let beams = first..first + returns.len();
            let settings: Vec<_> = beams.clone().map(|beam| self.around(scan, beam)).collect();
            if self.rig.holds_in(&settings) {
                sensor.observe_over(self.rig, &settings, first, parts, returns);
            } else {
                for ((setting, beam), place) in settings.iter().zip(beams).zip(returns) {
                    *place = sensor.observe(setting, beam);
                }
            }
        };
        returns.resize_with(sensor.scan().beams(), || None);
        returns
            .par_chunks_mut(together)
            .enumerate()
            .with_min_len(BEAMS_OF_A_THREAD / together)
            .for_each_init(Parts::default, |parts, (group, returns)| {
                observe(parts, group * together, returns);
            });
    }

    /// Paths of a beam's sub-rays in a scan, in the sensor frame at the time of the beam.
    pub fn sub_ray_ends(&self, scan: usize, beam: usize) -> Vec<SubRayEnd> {
        let around = self.around(scan, beam);
        self.laboratory.sensor.sub_ray_ends(&around, beam)
    }

    /// What is around the sensor when it reads a beam of a scan.
    fn around(&self, scan: usize, beam: usize) -> Setting<'_> {
        let moved = self.trajectory.map_or_else(Pose::identity, |trajectory| {
            self.start_from_sensor(trajectory, self.laboratory.elapsed_s(scan, beam))
        });
        match &self.after {
            Some((from, setting)) if scan >= *from => setting,
            _ => &self.setting,
        }
        .seen_from(&moved)
    }

    /// Pose of the sensor relative to its pose at the start; exactly the identity while the rig has not moved.
    fn start_from_sensor(&self, trajectory: &Trajectory, elapsed_s: f64) -> Pose {
        let first_from_rig = trajectory.first_from_rig(elapsed_s);
        if first_from_rig == Pose::identity() {
            return first_from_rig;
        }
        let rig_from_sensor = self.laboratory.structure.rig_from_sensor;
        rig_from_sensor.inverse() * first_from_rig * rig_from_sensor
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beams_cast_together_fill_packets() {
        for sub_rays in 1..=200 {
            let beams = together(sub_rays);
            assert!((1..=BEAMS_OF_A_THREAD).contains(&beams), "{beams} of {sub_rays}");
            let rays = beams * sub_rays;
            assert!(beams == 1 || rays <= PACKETS * PACKET, "{rays} rays");
        }
        // Eight of 16 fill one packet; six of 19 would leave 14 lanes of one empty, twenty leave 4 of three.
        assert_eq!((together(16), together(19)), (8, 20));
    }
}
