//! One element from its readings to its estimate: which boards it hits, its angles, and whether they can be believed.

use crate::ahead::{AGREEMENT_FLOOR, ahead};
use crate::covariance::{self, Budget, MountUncertainty};
use crate::initial;
use crate::observability::{self, Weakness};
use crate::observations::{BoardInSensor, BoardView, Observation, azimuth, cone_half_angle};
use crate::options::{Method, Options};
use crate::recursive::recursive;
use crate::solve::{self, BareDistance, Element, Solution};
use crate::spread;
use catoptric_model::session::NominalFacet;
use catoptric_model::{
    BeamEstimate, Dataset, Deflection, MirrorPlane, Pose, PoseKind, PoseRecord, Session, Status, Summary,
    beam,
};

/// Boards that one solution needs (steps 7–10).
pub const LEAST_BOARDS: usize = 3;

/// Direction errors allowed for while the boards of an element are chosen, in radians, from the drawing's to none.
const STAGES: [f64; 7] = [0.05, 0.02, 0.007, 0.0, 0.0, 0.0, 0.0];

/// Residual that is always taken as the board's own, in metres; a wall behind it differs by decimeters.
const GATE_FLOOR: f64 = 0.03;

/// Standard deviations within which a residual is taken as the board's own.
const GATE_SIGMAS: f64 = 6.0;

/// Board to spare around a spot once the direction is known, in metres.
const EDGE_MARGIN: f64 = 5e-3;

/// A start in closed form that is farther than this from the drawing is noise, in radians.
const FARTHEST_START: f64 = 0.25;

/// Largest ||v| − 1| of a start in closed form that is believed.
const LARGEST_EXCESS: f64 = 0.2;

/// How much larger than expected the residuals of a good element may be. A solution from three boards leaves one
/// Gaussian number: one in a million exceeds five standard deviations.
const RESIDUAL_FACTOR: f64 = 5.0;

/// Residual that no belief covers, in metres: whole millimetres, beam size, laws that miss their own tables.
const RESIDUAL_FLOOR: f64 = 4e-3;

/// What all elements share.
pub(crate) struct Workspace<'a> {
    pub(crate) dataset: &'a Dataset,
    pub(crate) summaries: &'a [Vec<Summary>],
    /// Each pose's board in the sensor frame.
    pub(crate) boards: &'a [Option<BoardInSensor>],
    pub(crate) rig_from_sensor: Pose,
    pub(crate) mount: &'a MountUncertainty,
    pub(crate) method: Method,
    pub(crate) options: &'a Options,
}

/// An element on its way.
struct Attempt<'a> {
    work: &'a Workspace<'a>,
    session: &'a Session,
    beam: usize,
    azimuth: f64,
    facet: &'a NominalFacet,
    distance: BareDistance,
    /// Believed noise of one reading, in metres.
    noise: f64,
    /// Poses recorded for its facet.
    recorded: usize,
    /// Those whose readings are ranges of ordinary spread.
    usable: Vec<usize>,
}

/// A solution and the boards it rests on.
struct Fit {
    poses: Vec<usize>,
    solution: Solution,
    start: Deflection,
}

/// Why there is no solution.
struct Failure {
    status: Status,
    reason: String,
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
        if !matches!(estimate.status, Status::Solved | Status::Unobservable) {
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

impl<'a> Attempt<'a> {
    fn new(
        work: &'a Workspace<'a>,
        session: &'a Session,
        beam: usize,
        facet: &'a NominalFacet,
        nominal: &Deflection,
    ) -> Self {
        let noise = session.believed.range_noise_sd_mm * 1e-3;
        let distance = session.bare_structure.distance(beam).map_or(
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
            distance,
            noise,
            recorded: recorded.len(),
            usable: recorded.into_iter().filter(usable).collect(),
        }
    }

    fn summary(&self, pose: usize) -> &'a Summary {
        &self.work.summaries[pose][self.beam]
    }

    fn observations(&self, poses: &[usize]) -> Vec<Observation<'a>> {
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

    fn element<'o>(&self, observations: &'o [Observation<'o>]) -> Element<'o>
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

    fn budget(&self, at: &Deflection, observations: &[Observation]) -> Option<Budget> {
        let views: Vec<BoardView> = observations.iter().map(|o| o.board).collect();
        covariance::budget(self.session, self.work.mount, self.azimuth, at, &views)
    }

    /// The poses whose board holds the beam and whose range agrees, for a direction known to `stage` radians.
    fn choose(&self, at: &Deflection, stage: f64) -> Vec<usize> {
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
                .ok_or_else(|| self.lost())?
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
            Method::Beam => solve::batch(&element, from, options),
            Method::Recursive => {
                let readings: Vec<Vec<f64>> = poses
                    .iter()
                    .map(|p| {
                        let all = self.work.dataset.poses[*p].readings(self.beam);
                        all.filter(|r| r.is_finite()).collect()
                    })
                    .collect();
                // Where the readings leave a direction open there is nothing to recurse on; the batch says which.
                recursive(&element, &readings, from, options)
                    .or_else(|| solve::batch(&element, from, options))
            }
        };
        let near = |s: &Solution| {
            let (a, b) = (
                s.deflection.exit_direction(self.azimuth),
                at.exit_direction(self.azimuth),
            );
            s.converged && beam::angle_between(&a, &b) < STAGES[2]
        };
        let solution = run(start)
            .filter(near)
            .or_else(|| run(at))
            .ok_or_else(|| self.lost())?;
        Ok(Fit {
            poses,
            solution,
            start: *start,
        })
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

    /// Largest credible rms residual of a fit, and the expected one, in metres.
    fn residual_limit(&self, fit: &Fit) -> Option<(f64, f64)> {
        let observations = self.observations(&fit.poses);
        let residuals = self
            .budget(&fit.solution.deflection, &observations)?
            .residual_covariance()?;
        let expected = (residuals.trace().max(0.0) / fit.poses.len() as f64).sqrt();
        Some((RESIDUAL_FACTOR * expected + RESIDUAL_FLOOR, expected))
    }

    fn residuals_agree(&self, fit: &Fit) -> bool {
        self.residual_limit(fit)
            .is_some_and(|(limit, _)| fit.rms() <= limit)
    }

    fn weakness(&self, at: &Deflection, poses: &[usize]) -> Option<Weakness> {
        let budget = self.budget(at, &self.observations(poses))?;
        observability::weakness(&budget, at.elevation)
    }

    /// The estimate, if nothing speaks against it.
    fn judge(&self, fit: &Fit) -> Result<BeamEstimate, Failure> {
        let solution = &fit.solution;
        let observations = self.observations(&fit.poses);
        let readings: usize = observations.iter().map(|o| o.board.count).sum();
        let found = BeamEstimate {
            facet: Some(self.facet.name.clone()),
            poses: Some(fit.poses.len()),
            readings: Some(readings),
            iterations: Some(solution.iterations),
            rms_residual_m: Some(fit.rms()),
            ..BeamEstimate::without_angles(self.beam, Status::Solved, None)
        };
        let budget = self
            .budget(&solution.deflection, &observations)
            .ok_or_else(|| self.lost())?;
        if let Some(weakness) = observability::weakness(&budget, solution.deflection.elevation) {
            return Ok(BeamEstimate {
                status: Status::Unobservable,
                reason: Some(weakness.reason),
                null_direction: Some(weakness.null_direction),
                ..found
            });
        }
        if !solution.converged {
            let reason = format!("no steady estimate after {} steps", solution.iterations);
            return Err(Failure {
                status: Status::NotConverged,
                reason,
            });
        }
        let (limit, expected) = self.residual_limit(fit).ok_or_else(|| self.lost())?;
        if fit.rms() > limit {
            return Err(rejected(format!(
                "inconsistent ranges: rms residual {:.1} mm over {} boards, {:.1} mm expected",
                1e3 * fit.rms(),
                fit.poses.len(),
                1e3 * expected
            )));
        }
        let covariance = budget.sandwich().ok_or_else(|| self.lost())?;
        self.check_room(&solution.deflection, &covariance)?;
        // One number for all readings, as the paper has it: their pooled noise.
        let pooled: f64 = observations
            .iter()
            .map(|o| o.board.count as f64 * o.board.noise_sd.powi(2))
            .sum();
        let noise = budget.noise_covariance((pooled / readings as f64).sqrt());
        let symmetric = |m: nalgebra::Matrix2<f64>| {
            let off = 0.5 * (m[(0, 1)] + m[(1, 0)]);
            [[m[(0, 0)], off], [off, m[(1, 1)]]]
        };
        Ok(BeamEstimate {
            azimuth_rad: Some(solution.deflection.azimuth),
            elevation_rad: Some(solution.deflection.elevation),
            distance_m: Some(solution.deflection.distance),
            covariance_rad2: Some(symmetric(covariance)),
            noise_covariance_rad2: noise.map(symmetric),
            ..found
        })
    }

    /// Step 13: the known room has to be where the estimate puts it.
    fn check_room(&self, found: &Deflection, covariance: &nalgebra::Matrix2<f64>) -> Result<(), Failure> {
        let (origin, v) = (
            found.deflection_point(self.azimuth),
            found.exit_direction(self.azimuth),
        );
        for (pose, record) in self.work.dataset.poses.iter().enumerate() {
            let summary = self.summary(pose);
            if record.label.kind != PoseKind::Room || summary.count <= summary.missing {
                continue;
            }
            let room_from_sensor = record.room_from_rig * self.work.rig_from_sensor;
            let Some((wall, color)) = ahead(self.session, &room_from_sensor, None, &origin, &v) else {
                continue;
            };
            let observation = [Observation {
                board: BoardView {
                    plane: wall.plane,
                    markers: &[],
                    color,
                    noise_sd: spread::noise_sd(summary, self.noise),
                    count: summary.count,
                },
                mean: catoptric_model::RawRange(summary.mean),
            }];
            let budget = self.budget(found, &observation).ok_or_else(|| self.lost())?;
            let residuals = self.element(&observation).residuals(found).unwrap_or_default();
            let variance = budget.covariance[(0, 0)]
                + (&budget.jacobian * covariance * budget.jacobian.transpose())[(0, 0)];
            let limit = AGREEMENT_FLOOR + GATE_FLOOR + wall.spread + GATE_SIGMAS * variance.sqrt();
            if let Some(residual) = residuals.first().filter(|r| r.abs() > limit) {
                return Err(rejected(format!(
                    "contradicts the known room: expected {:.3} m, found {:.3} m",
                    summary.mean - residual,
                    summary.mean
                )));
            }
        }
        Ok(())
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

    fn lost(&self) -> Failure {
        Failure {
            status: Status::NotConverged,
            reason: "the estimate left the boards".to_owned(),
        }
    }
}

impl Fit {
    /// Root mean square residual over the boards, in metres.
    fn rms(&self) -> f64 {
        let sum: f64 = self.solution.residuals.iter().map(|r| r * r).sum();
        (sum / self.solution.residuals.len() as f64).sqrt()
    }
}

fn rejected(reason: String) -> Failure {
    Failure {
        status: Status::Rejected,
        reason,
    }
}
