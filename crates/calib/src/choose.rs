//! Which boards an element hits: those that hold its spot where the estimate puts it, and whose range agrees.

use crate::covariance::{self, Budget, MountUncertainty};
use crate::element::{LEAST_BOARDS, Workspace};
use crate::observations::{BoardView, Observation, azimuth, cone_half_angle};
use crate::solve::{BareDistance, Element};
use crate::spread;
use catoptric_model::session::NominalFacet;
use catoptric_model::{Deflection, PoseKind, PoseRecord, Session, Summary};

/// Residual that is always taken as the board's own, in metres; a wall behind it differs by decimeters.
pub(crate) const GATE_FLOOR: f64 = 0.03;

/// Standard deviations within which a residual is taken as the board's own.
pub(crate) const GATE_SIGMAS: f64 = 6.0;

/// Board to spare around a spot once the direction is known, in metres.
const EDGE_MARGIN: f64 = 5e-3;

/// An element on its way.
pub(crate) struct Attempt<'a> {
    pub(crate) work: &'a Workspace<'a>,
    pub(crate) session: &'a Session,
    pub(crate) beam: usize,
    pub(crate) azimuth: f64,
    pub(crate) facet: &'a NominalFacet,
    /// What the facet's plane is believed to make of it.
    pub(crate) nominal: Deflection,
    pub(crate) distance: BareDistance,
    /// Believed noise of one reading, in metres.
    pub(crate) noise: f64,
    /// Poses recorded for its facet.
    pub(crate) recorded: usize,
    /// Those whose readings are ranges of ordinary spread.
    pub(crate) usable: Vec<usize>,
}

impl<'a> Attempt<'a> {
    pub(crate) fn new(
        work: &'a Workspace<'a>,
        session: &'a Session,
        beam: usize,
        facet: &'a NominalFacet,
        nominal: &Deflection,
    ) -> Self {
        let noise = session.believed.range_noise_sd_mm * 1e-3;
        let distance = work.bare.distance(session, &facet.name, beam).map_or(
            // Nobody measured it: the drawing's mirror, whose face is its own.
            BareDistance {
                distance: nominal.distance,
                thickness: 0.0,
            },
            |distance| BareDistance {
                distance,
                thickness: session.bare_structure.mirror_thickness_mm * 1e-3,
            },
        );
        let of_facet = |record: &PoseRecord| {
            record.label.kind == PoseKind::Facet
                && record.label.facet.as_ref().is_none_or(|name| *name == facet.name)
        };
        let recorded: Vec<usize> = (0..work.dataset.poses.len())
            .filter(|p| of_facet(&work.dataset.poses[*p]) && work.boards[*p].is_some())
            .collect();
        let usable = |p: &usize| {
            let summary = &work.summaries[*p][beam];
            summary.count > summary.missing && !spread::is_abnormal(summary, noise)
        };
        Self {
            work,
            session,
            beam,
            azimuth: azimuth(session, beam),
            facet,
            nominal: *nominal,
            distance,
            noise,
            recorded: recorded.len(),
            usable: recorded.into_iter().filter(usable).collect(),
        }
    }

    pub(crate) fn summary(&self, pose: usize) -> &'a Summary {
        &self.work.summaries[pose][self.beam]
    }

    pub(crate) fn observations(&self, poses: &[usize]) -> Vec<Observation<'a>> {
        let boards = self.work.boards;
        poses
            .iter()
            .filter_map(|p| {
                let summary = self.summary(*p);
                Some(
                    boards[*p]
                        .as_ref()?
                        .observation(spread::noise_sd(summary, self.noise), summary),
                )
            })
            .collect()
    }

    pub(crate) fn element<'o>(&self, observations: &'o [Observation<'o>]) -> Element<'o>
    where
        'a: 'o,
    {
        Element {
            azimuth: self.azimuth,
            observations,
            distance: self.distance,
            bias: &self.session.believed.bias,
        }
    }

    /// The budget as if the mounting were known: what the boards themselves determine.
    pub(crate) fn boards_alone(&self, at: &Deflection, observations: &[Observation]) -> Option<Budget> {
        let views: Vec<BoardView> = observations.iter().map(|o| o.board).collect();
        covariance::budget(self.session, &MountUncertainty::none(), self.azimuth, at, &views)
    }

    pub(crate) fn budget(&self, at: &Deflection, observations: &[Observation]) -> Option<Budget> {
        let views: Vec<BoardView> = observations.iter().map(|o| o.board).collect();
        covariance::budget(self.session, self.work.mount, self.azimuth, at, &views)
    }

    /// The poses whose board holds the beam and whose range agrees, for a direction known to `stage` radians.
    pub(crate) fn choose(&self, at: &Deflection, stage: f64) -> Vec<usize> {
        let strict = self.choose_within(at, stage, 0.0);
        if strict.len() < LEAST_BOARDS && stage > 0.0 {
            self.choose_within(at, stage, stage)
        } else {
            strict
        }
    }

    /// `overhang` lets the predicted hit lie that far, in radians of direction, outside the board.
    fn choose_within(&self, at: &Deflection, stage: f64, overhang: f64) -> Vec<usize> {
        let (origin, v) = (at.deflection_point(self.azimuth), at.exit_direction(self.azimuth));
        let cone = cone_half_angle(self.session);
        let agrees = |pose: &usize| {
            let board = self.work.boards[*pose].as_ref()?;
            let hit = board.hit(&origin, &v)?;
            let cos_incidence = board.plane.cos_incidence(&v);
            let tan = (1.0 / (cos_incidence * cos_incidence) - 1.0).max(0.0).sqrt();
            // While the direction is a guess, the chief ray on the board is enough; later the whole spot has to be.
            let (radius, margin) = if stage > 0.0 {
                (0.0, -overhang * hit.distance / cos_incidence)
            } else {
                (cone * (at.distance + hit.distance), EDGE_MARGIN)
            };
            if !board.holds(&hit, radius, margin) {
                return None;
            }
            let observation = self.observations(&[*pose]);
            let residual = self.element(&observation).residuals(at)?.first()?.abs();
            let gate = GATE_FLOOR + stage * hit.distance * tan;
            let inside = residual <= gate
                || residual
                    <= stage * hit.distance * tan
                        + GATE_SIGMAS * self.budget(at, &observation)?.covariance[(0, 0)].sqrt();
            inside.then_some(())
        };
        self.usable
            .iter()
            .copied()
            .filter(|p| agrees(p).is_some())
            .collect()
    }
}
