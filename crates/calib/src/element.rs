//! One element from its readings to its estimate: boards and angles chosen in turn until both stand.

use crate::bare::Bare;
use crate::choose::Attempt;
use crate::covariance::MountUncertainty;
use crate::initial;
use crate::locate;
use crate::observability::{self, Weakness};
use crate::observations::{BoardInSensor, azimuth};
use crate::options::{Method, Options};
use crate::recursive::recursive;
use crate::solve::{self, Element, Solution};
use catoptric_model::session::NominalFacet;
use catoptric_model::{BeamEstimate, Dataset, Deflection, MirrorPlane, Pose, Status, Summary, beam};

/// Boards that one solution needs (steps 7–10).
pub const LEAST_BOARDS: usize = 3;

/// Direction errors allowed for while the boards of an element are chosen, in radians, from the drawing's to none.
///
/// A mirror doubles its tilt: 1° (1σ) of the facet and up to 1° of the scanner in its housing turn a beam by 8° now
/// and then.
const STAGES: [f64; 8] = [0.15, 0.05, 0.02, 0.007, 0.0, 0.0, 0.0, 0.0];

/// How far a solution may end from the estimate that its boards were chosen with, in radians.
const FARTHEST_END: f64 = 0.007;

/// A start in closed form that is farther than this from the drawing is noise, in radians.
pub(crate) const FARTHEST_START: f64 = 0.35;

/// Largest ||v| − 1| of a start in closed form that is believed.
const LARGEST_EXCESS: f64 = 0.2;

/// What all elements share.
pub(crate) struct Workspace<'a> {
    pub(crate) dataset: &'a Dataset,
    pub(crate) summaries: &'a [Vec<Summary>],
    pub(crate) bare: &'a Bare,
    /// Each pose's board in the sensor frame.
    pub(crate) boards: &'a [Option<BoardInSensor>],
    pub(crate) rig_from_sensor: Pose,
    pub(crate) mount: &'a MountUncertainty,
    pub(crate) method: Method,
    pub(crate) options: &'a Options,
}

/// A solution and the boards it rests on.
pub(crate) struct Fit {
    pub(crate) poses: Vec<usize>,
    pub(crate) solution: Solution,
    pub(crate) start: Deflection,
}

/// Why there is no solution.
pub(crate) struct Failure {
    pub(crate) status: Status,
    pub(crate) reason: String,
}

impl Workspace<'_> {
    /// The estimate of one element on a facet whose plane is believed to be `mirror`.
    pub(crate) fn estimate(&self, beam: usize, facet: &NominalFacet, mirror: &MirrorPlane) -> BeamEstimate {
        let session = &self.dataset.session;
        let azimuth = azimuth(session, beam);
        let without = |status, reason| BeamEstimate {
            facet: Some(facet.name.clone()),
            ..BeamEstimate::without_angles(beam, status, Some(reason))
        };
        let Some(nominal) = mirror.deflect(beam::direction(azimuth)) else {
            let reason = format!("the plane of facet {:?} does not face it", facet.name);
            return without(Status::Rejected, reason);
        };
        let attempt = Attempt::new(self, session, beam, facet, &nominal);
        let mut estimate = match attempt.fit(&nominal) {
            Ok(fit) => attempt
                .judge(&fit)
                .unwrap_or_else(|f| without(f.status, f.reason)),
            Err(failure) => without(failure.status, failure.reason),
        };
        if matches!(estimate.status, Status::TooFewPoses | Status::NotConverged) {
            // A solver that wandered off may only have had nothing to hold on to.
            let chosen = attempt.choose(&nominal, STAGES[0]);
            if chosen.len() >= LEAST_BOARDS
                && let Some(weakness) = attempt.weakness(&nominal, &chosen)
            {
                estimate = without(Status::Unobservable, weakness.reason.clone());
                estimate.null_direction = Some(weakness.null_direction);
                estimate.poses = Some(chosen.len());
            }
        }
        estimate
    }
}

impl Workspace<'_> {
    /// The stretches whose boards an element hits, where its estimate or else its facet's plane puts it.
    pub(crate) fn boards_hit(
        &self,
        estimate: &BeamEstimate,
        facet: &NominalFacet,
        mirror: &MirrorPlane,
    ) -> Option<Vec<usize>> {
        let session = &self.dataset.session;
        let by_plane = mirror.deflect(beam::direction(azimuth(session, estimate.beam)))?;
        self.boards_at(
            estimate.beam,
            facet,
            mirror,
            &estimate.deflection().unwrap_or(by_plane),
        )
    }

    /// The stretches whose boards an element of a facet hits with a known deflection.
    pub(crate) fn boards_at(
        &self,
        beam: usize,
        facet: &NominalFacet,
        mirror: &MirrorPlane,
        at: &Deflection,
    ) -> Option<Vec<usize>> {
        let session = &self.dataset.session;
        let by_plane = mirror.deflect(beam::direction(azimuth(session, beam)))?;
        Some(Attempt::new(self, session, beam, facet, &by_plane).choose(at, 0.0))
    }
}

impl Attempt<'_> {
    /// Chooses boards and solves, ever more strictly, until the choice no longer changes.
    fn fit(&self, nominal: &Deflection) -> Result<Fit, Failure> {
        let mut at = Element::place(&self.element(&[]), nominal.azimuth, nominal.elevation);
        let mut poses = Vec::new();
        let mut start = at;
        for (round, stage) in STAGES.iter().enumerate() {
            let chosen = self.choose(&at, *stage);
            if chosen.len() < LEAST_BOARDS {
                return Err(self.too_few(chosen.len()));
            }
            if *stage == 0.0 && chosen == poses {
                break;
            }
            poses = chosen;
            let observations = self.observations(&poses);
            let element = self.element(&observations);
            if round == 0 {
                start = self.start(&element, nominal);
                at = start;
            }
            at = solve::batch(&element, &at, self.work.options)
                .ok_or_else(lost)?
                .deflection;
        }
        let fit = self.solve(poses, &start, &at)?;
        if fit.poses.len() > LEAST_BOARDS && !self.residuals_agree(&fit) {
            // One foreign surface among the boards pulls the rest along; without it, it stands out.
            if let Some(better) = self.without_one(&fit) {
                return Ok(better);
            }
        }
        Ok(fit)
    }

    /// The solution by the method asked for, from the start; from the present estimate if that does not settle.
    fn solve(&self, poses: Vec<usize>, start: &Deflection, at: &Deflection) -> Result<Fit, Failure> {
        let observations = self.observations(&poses);
        let element = self.element(&observations);
        let options = self.work.options;
        let run = |from: &Deflection| match self.work.method {
            Method::BeamGls => self.generalized(&element, from),
            Method::ClosedForm => self.without_iteration(&element, at),
            Method::Recursive => {
                let readings: Vec<Vec<f64>> = poses
                    .iter()
                    .map(|p| {
                        let record = &self.work.dataset.poses[*p];
                        locate::kept(record, self.beam, self.summary(*p), self.noise)
                    })
                    .collect();
                // Where the readings leave a direction open there is nothing to recurse on; the batch says which.
                recursive(&element, &readings, from, options)
                    .or_else(|| solve::batch(&element, from, options))
            }
            Method::Beam | Method::Facet | Method::Joint | Method::Prior => {
                solve::batch(&element, from, options)
            }
        };
        let near = |s: &Solution| {
            let (a, b) = (
                s.deflection.exit_direction(self.azimuth),
                at.exit_direction(self.azimuth),
            );
            s.converged && beam::angle_between(&a, &b) < FARTHEST_END
        };
        let solution = run(start).filter(near).or_else(|| run(at)).ok_or_else(lost)?;
        Ok(Fit {
            poses,
            solution,
            start: *start,
        })
    }

    /// The closed form as the answer, its mirror and biases placed by the estimate that the boards were chosen with.
    fn without_iteration(&self, element: &Element, at: &Deflection) -> Option<Solution> {
        let found = initial::closed_form(at, self.azimuth, element.observations, element.bias)?;
        let at = Deflection::from_exit(self.azimuth, &found.direction, at.distance);
        element.finish(&element.place(at.azimuth, at.elevation), 0, true)
    }

    fn start(&self, element: &Element, nominal: &Deflection) -> Deflection {
        let found = initial::closed_form(nominal, self.azimuth, element.observations, element.bias);
        let v = nominal.exit_direction(self.azimuth);
        found
            .filter(|f| {
                f.excess.abs() < LARGEST_EXCESS && beam::angle_between(&f.direction, &v) < FARTHEST_START
            })
            .map_or(*nominal, |f| {
                Deflection::from_exit(self.azimuth, &f.direction, nominal.distance)
            })
    }

    /// A consistent solution without one of the boards, if that board is then plainly not what the element read.
    fn without_one(&self, fit: &Fit) -> Option<Fit> {
        let fits = fit.poses.iter().filter_map(|omitted| {
            let rest: Vec<usize> = fit.poses.iter().copied().filter(|p| p != omitted).collect();
            let observations = self.observations(&rest);
            let at = solve::batch(&self.element(&observations), &fit.start, self.work.options)?.deflection;
            if self.choose(&at, 0.0) != rest {
                return None;
            }
            let fit = self.solve(rest, &fit.start, &at).ok()?;
            self.residuals_agree(&fit).then_some(fit)
        });
        fits.min_by(|a, b| a.rms().total_cmp(&b.rms()))
    }

    pub(crate) fn weakness(&self, at: &Deflection, poses: &[usize]) -> Option<Weakness> {
        let budget = self.boards_alone(at, &self.observations(poses))?;
        observability::weakness(&budget, at.elevation)
    }

    fn too_few(&self, chosen: usize) -> Failure {
        Failure {
            status: Status::TooFewPoses,
            reason: format!(
                "{LEAST_BOARDS} boards are needed; of {} set up for facet {:?} it read {} in order and hit {chosen}",
                self.recorded,
                self.facet.name,
                self.usable.len()
            ),
        }
    }
}

impl Fit {
    /// Root mean square residual over the boards, in metres.
    pub(crate) fn rms(&self) -> f64 {
        let sum: f64 = self.solution.residuals.iter().map(|r| r * r).sum();
        (sum / self.solution.residuals.len() as f64).sqrt()
    }
}

/// The iteration ran to where a board is no longer ahead.
pub(crate) fn lost() -> Failure {
    Failure {
        status: Status::NotConverged,
        reason: "the estimate left the boards".to_owned(),
    }
}

/// Readings that cannot be those of one beam on the boards.
pub(crate) fn rejected(reason: String) -> Failure {
    Failure {
        status: Status::Rejected,
        reason,
    }
}
