//! The state of an element while it is being estimated: its readings, its boards and its error budgets.

use crate::element::solve::{BareDistance, SoleElement, Solution};
use crate::judge::covariance::{self, Budget, MountUncertainty};
use crate::judge::observability::{self, Weakness};
use crate::options::Options;
use crate::readings::bare::Bare;
use crate::readings::columns::Columns;
use crate::readings::locate;
use crate::readings::observations::{BoardInSensor, BoardView, Observation, azimuth};
use crate::readings::spread;
use catoptric_model::glass::GlassEffect;
use catoptric_model::session::NominalFacet;
use catoptric_model::{
    Dataset, Deflection, Pose, PoseKind, PoseRecord, Session, Status, Stop, Summary, beam,
};

/// Number of boards that a solution needs (steps 7–10).
pub const MIN_BOARDS: usize = 3;

/// Inputs shared by all elements.
pub(crate) struct Workspace<'a> {
    pub(crate) dataset: &'a Dataset,
    pub(crate) summaries: &'a [Vec<Summary>],
    pub(crate) bare: &'a Bare,
    /// Each pose's board in the sensor frame.
    pub(crate) boards: &'a [Option<BoardInSensor>],
    pub(crate) rig_from_sensor: Pose,
    pub(crate) mount: &'a MountUncertainty,
    pub(crate) options: &'a Options,
    /// Looked at per element, and in every step of the least squares.
    pub(crate) stop: &'a Stop,
    /// Single readings, for the method that goes through them one by one.
    pub(crate) columns: Option<&'a Columns>,
}

/// An element being estimated.
pub(crate) struct Attempt<'a> {
    pub(crate) work: &'a Workspace<'a>,
    pub(crate) session: &'a Session,
    pub(crate) beam: usize,
    pub(crate) azimuth: f64,
    pub(crate) facet: &'a NominalFacet,
    /// The deflection by the believed plane of its facet.
    pub(crate) nominal: Deflection,
    /// With what glass adds to it.
    pub(crate) distance: BareDistance,
    /// What glass in front of the mirror does to the ranges.
    pub(crate) glass: GlassEffect,
    /// Believed noise of a typical reading, in meters.
    pub(crate) noise: f64,
    /// Number of poses recorded for its facet.
    pub(crate) recorded: usize,
    /// Poses whose readings are ranges with an ordinary spread.
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
        let azimuth = azimuth(session, beam);
        let glass = session.glass.map_or_else(GlassEffect::default, |glass| {
            glass.stated(&beam::direction(azimuth), &nominal.exit_direction(azimuth))
        });
        let distance = work.bare.distance(session, &facet.name, beam).map_or(
            // Not measured: the mirror as drawn, whose face is the distance itself.
            BareDistance {
                distance: nominal.distance + glass.setback,
                thickness: 0.0,
            },
            |distance| BareDistance {
                distance: distance + glass.setback,
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
            azimuth,
            facet,
            nominal: *nominal,
            distance,
            glass,
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
                let (board, summary) = (boards[*p].as_ref()?, self.summary(*p));
                let undelayed = Summary {
                    mean: summary.mean - self.glass.delay,
                    ..*summary
                };
                Some(board.observation(self.noise_sd(summary, &board.color), &undelayed))
            })
            .collect()
    }

    /// Noise of one reading of a surface, in meters.
    pub(crate) fn noise_sd(&self, summary: &Summary, color: &str) -> f64 {
        spread::noise_sd(summary, self.session.believed.noise_sd(summary.mean, color))
    }

    /// The readings of a stretch without outliers, one by one.
    pub(crate) fn single_readings(&self, pose: usize) -> Vec<f64> {
        let columns = self.work.columns.map(|c| c.of(pose, self.beam));
        let mut kept = locate::kept(columns.unwrap_or_default(), self.summary(pose), self.noise);
        kept.iter_mut().for_each(|range| *range -= self.glass.delay);
        kept
    }

    pub(crate) fn element<'o>(&self, observations: &'o [Observation<'o>]) -> SoleElement<'o>
    where
        'a: 'o,
    {
        SoleElement {
            azimuth: self.azimuth,
            observations,
            distance: self.distance,
            bias: &self.session.believed.bias,
        }
    }

    /// The budget as if the mounting were known: what the boards alone determine.
    pub(crate) fn boards_alone(&self, at: &Deflection, observations: &[Observation]) -> Option<Budget> {
        let views: Vec<BoardView> = observations.iter().map(|o| o.board).collect();
        covariance::budget(self.session, &MountUncertainty::none(), self.azimuth, at, &views)
    }

    pub(crate) fn budget(&self, at: &Deflection, observations: &[Observation]) -> Option<Budget> {
        let views: Vec<BoardView> = observations.iter().map(|o| o.board).collect();
        covariance::budget(self.session, self.work.mount, self.azimuth, at, &views)
    }

    /// The direction that boards leave open, if any.
    pub(crate) fn weakness(&self, at: &Deflection, poses: &[usize]) -> Option<Weakness> {
        let budget = self.boards_alone(at, &self.observations(poses))?;
        observability::weakness(&budget, at.elevation)
    }
}

/// A solution and the boards used for it.
pub(crate) struct ElementFit {
    pub(crate) poses: Vec<usize>,
    pub(crate) solution: Solution,
    pub(crate) start: Deflection,
}

/// Why there is no solution.
pub(crate) struct Failure {
    pub(crate) status: Status,
    pub(crate) reason: String,
}

impl ElementFit {
    /// Root-mean-square residual over the boards, in meters.
    pub(crate) fn rms(&self) -> f64 {
        let sum: f64 = self.solution.residuals.iter().map(|r| r * r).sum();
        (sum / self.solution.residuals.len() as f64).sqrt()
    }
}

/// The iteration reached a direction in which some board is no longer ahead.
pub(crate) fn lost() -> Failure {
    Failure {
        status: Status::NotConverged,
        reason: "the estimate left the boards".to_owned(),
    }
}

/// The readings cannot be those of one beam on the boards.
pub(crate) fn rejected(reason: String) -> Failure {
    Failure {
        status: Status::Rejected,
        reason,
    }
}
