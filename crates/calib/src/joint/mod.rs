//! All elements at once: facets are planes that their beams share, and what all readings share is estimated once.
//!
//! Methods `facet` (one connected set of facets by itself, rigid planes, the mounting as already found) and `joint` (all
//! of them with the boards before undeflected beams, beams free to depart from their planes by an estimated τ). Both keep
//! the choice of boards and the verdict on an element's readings that calibrating it by itself has come to.

mod answer;
mod assess;
mod fit;
mod gate;
mod held;
mod limit;
mod linear;
mod problem;
mod reach;

use crate::common::CommonErrors;
use crate::element::Workspace;
use crate::least_squares::{self, ProblemError, State};
use crate::observability::WEAKEST_SD;
use crate::observations::azimuth;
use crate::options::Method;
use crate::pose::{self, Mount, Prior};
use crate::solve::libm_cos;
use crate::spread;
use answer::Answer;
use catoptric_model::calibration::{FacetEstimate, MountEstimate};
use catoptric_model::{Assessment, BeamEstimate, MirrorPlane, Pose, RangeBias, Status, beam};
use fit::Fit;
use nalgebra::{DVector, Dyn, Matrix2, OMatrix, RowDVector, U6, Vector2};
use problem::{BareFacet, Board, Element, Facet, Flatness, Group, Joint, Mounting, Sight};
use reach::STRAIGHT_SD;
use std::collections::BTreeMap;

pub use limit::{TrueDirection, limit};

/// Motions of the mounting, the first of the shared numbers.
const MOTIONS: usize = 6;

/// Error that stands for none, in metres, so that everything has a weight.
const LEAST_SD: f64 = 1e-6;

/// Rounds of leaving elements out.
const ROUNDS: usize = 3;

/// An element that takes part: its facet, and the stretches whose boards it hits.
pub(crate) struct Assigned {
    pub(crate) beam: usize,
    pub(crate) facet: usize,
    pub(crate) poses: Vec<usize>,
}

/// What came of it.
#[derive(Default)]
pub(crate) struct Outcome {
    /// Elements that took part.
    pub(crate) beams: BTreeMap<usize, BeamEstimate>,
    pub(crate) facets: Vec<FacetEstimate>,
    pub(crate) mount: Option<MountEstimate>,
    pub(crate) bias: Option<RangeBias>,
    pub(crate) assessment: Option<Assessment>,
}

/// Calibrates the assigned elements together.
pub(crate) fn calibrate(
    work: &Workspace,
    mount: &Mount,
    planes: &[MirrorPlane],
    assigned: Vec<Assigned>,
) -> Result<Outcome, ProblemError> {
    // Within the pool: groups are handed out over and over, and from outside each time would wake it.
    rayon::scope(|_| within_pool(work, mount, planes, &assigned))
}

fn within_pool(
    work: &Workspace,
    mount: &Mount,
    planes: &[MirrorPlane],
    assigned: &[Assigned],
) -> Result<Outcome, ProblemError> {
    let components = components(work.dataset.session.facets.len(), assigned);
    if work.method == Method::Facet {
        let mut outcome = Outcome::default();
        for facets in components {
            let some: Vec<&Assigned> = assigned.iter().filter(|a| facets.contains(&a.facet)).collect();
            let group = group(work, &facets, &some);
            let (mounting, mean) = mounting_as_found(work, mount);
            let part = solve(work, vec![group], mounting, &mean, planes, false)?;
            outcome.beams.extend(part.beams);
            outcome.facets.extend(part.facets);
        }
        return Ok(outcome);
    }
    let mut groups = Vec::new();
    for facets in components {
        let some: Vec<&Assigned> = assigned.iter().filter(|a| facets.contains(&a.facet)).collect();
        groups.push(group(work, &facets, &some));
    }
    groups.extend(
        mount
            .selection
            .iter()
            .filter_map(|board| direct_group(work, board)),
    );
    let (mounting, mean) = mounting_as_drawn(work, mount);
    solve(work, groups, mounting, &mean, planes, true)
}

/// Facets that share boards, each set by the indices of its facets; facets without elements are in none.
fn components(facets: usize, assigned: &[Assigned]) -> Vec<Vec<usize>> {
    let mut of: Vec<usize> = (0..facets).collect();
    let mut seen: BTreeMap<usize, usize> = BTreeMap::new();
    for element in assigned {
        for pose in &element.poses {
            let other = *seen.entry(*pose).or_insert(element.facet);
            let (from, to) = (of[element.facet], of[other]);
            if from != to {
                for label in &mut of {
                    if *label == from {
                        *label = to;
                    }
                }
            }
        }
    }
    let mut sets: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (facet, label) in of.iter().enumerate() {
        if assigned.iter().any(|a| a.facet == facet) {
            sets.entry(*label).or_default().push(facet);
        }
    }
    sets.into_values().collect()
}

fn board(work: &Workspace, pose: usize) -> Option<Board> {
    let (session, record) = (&work.dataset.session, &work.dataset.poses[pose]);
    let sheet = session.board(record.label.board.as_deref()?)?;
    Some(Board {
        pose,
        number: record.label.pose,
        rig_from_board: record.room_from_rig.inverse() * record.room_from_board?,
        color: record.label.color.clone().unwrap_or_else(|| sheet.color.clone()),
        markers: sheet.markers.iter().map(|m| m.position()).collect(),
    })
}

/// Some facets with their boards and elements.
fn group(work: &Workspace, facets: &[usize], assigned: &[&Assigned]) -> Group {
    let session = &work.dataset.session;
    let noise = session.believed.range_noise_sd_mm * 1e-3;
    let common = CommonErrors::of(session);
    let bare = |facet: usize| {
        let distances = assigned.iter().filter(|a| a.facet == facet).filter_map(|a| {
            let u = beam::direction(azimuth(session, a.beam));
            Some((
                u,
                work.bare.distance(session, &session.facets[facet].name, a.beam)?,
            ))
        });
        let distances: Vec<_> = distances.collect();
        let drawn = session.facets[facet].plane();
        let (mut row, mut variance) = (RowDVector::zeros(common.len()), 0.0);
        for (u, distance) in &distances {
            // By the drawing, as the distances were corrected.
            let cos = drawn.as_ref().map_or(1.0, |plane| plane.normal.dot(u).abs());
            row += common.bare_row(*distance, cos);
            variance += common.bare_sd(*distance, cos).powi(2);
        }
        let count = distances.len().max(1) as f64;
        BareFacet {
            distances,
            thickness: session.bare_structure.mirror_thickness_mm * 1e-3,
            common: row / count,
            sd: (variance / count).sqrt().max(LEAST_SD),
        }
    };
    let mut group = Group {
        facets: facets
            .iter()
            .map(|f| Facet {
                facet: *f,
                bare: bare(*f),
            })
            .collect(),
        ..Group::default()
    };
    for element in assigned {
        let mut sights = Vec::new();
        for pose in &element.poses {
            let place = group.boards.iter().position(|b| b.pose == *pose).or_else(|| {
                group.boards.push(board(work, *pose)?);
                Some(group.boards.len() - 1)
            });
            let summary = &work.summaries[*pose][element.beam];
            if let Some(place) = place {
                let of_mean = spread::noise_sd(summary, noise) / (summary.count.max(1) as f64).sqrt();
                let sd = libm::hypot(of_mean, session.believed.element_sd_mm * 1e-3);
                sights.push(Sight {
                    board: place,
                    mean: summary.mean,
                    sd: sd.max(LEAST_SD),
                    count: summary.count,
                });
            }
        }
        let azimuth = azimuth(session, element.beam);
        group.elements.push(Element {
            beam: element.beam,
            azimuth,
            u: beam::direction(azimuth),
            facet: facets.iter().position(|f| *f == element.facet),
            along: along(session.facets[element.facet].beams, element.beam),
            sights,
        });
    }
    group
}

/// Place of a beam in a fan, −1 at its first beam and 1 at its last.
fn along([first, last]: [usize; 2], beam: usize) -> f64 {
    let half = 0.5 * (last.saturating_sub(first)).max(1) as f64;
    ((beam as f64 - first as f64) / half - 1.0).clamp(-1.5, 1.5)
}

/// One board before undeflected beams.
fn direct_group(work: &Workspace, selected: &crate::mount_data::DirectBoard) -> Option<Group> {
    // Readings believed to have no noise are not rounded either.
    let exact = work.dataset.session.believed.range_noise_sd_mm == 0.0;
    let least = |sd: f64| if exact { LEAST_SD } else { sd.max(LEAST_SD) };
    let elements = selected.rays.iter().map(|ray| Element {
        beam: ray.beam,
        azimuth: ray.azimuth,
        u: beam::direction(ray.azimuth),
        facet: None,
        along: 0.0,
        sights: vec![Sight {
            board: 0,
            mean: ray.mean,
            sd: least(ray.variance.sqrt()),
            count: work.summaries[selected.pose][ray.beam].count,
        }],
    });
    Some(Group {
        facets: Vec::new(),
        boards: vec![board(work, selected.pose)?],
        elements: elements.collect(),
    })
}

/// The mounting as step 5 found it, with what is not known of it among the shared numbers.
fn mounting_as_found(work: &Workspace, mount: &Mount) -> (Mounting, DVector<f64>) {
    let count = CommonErrors::of(&work.dataset.session).len();
    let known = &mount.uncertainty;
    let mounting = Mounting {
        rig_from_sensor: mount.rig_from_sensor,
        motion: answer::motion_of(&known.independent, &known.common, count),
    };
    (mounting, DVector::zeros(6 + count))
}

/// The mounting as drawn, to be found anew from everything; motions are counted from where step 5 has put it.
fn mounting_as_drawn(work: &Workspace, mount: &Mount) -> (Mounting, DVector<f64>) {
    let session = &work.dataset.session;
    let count = CommonErrors::of(session).len();
    let drawn = Prior::of(
        &Pose::from(&session.nominal_rig_from_sensor),
        &session.mount_tolerance,
    );
    let mut motion = OMatrix::<f64, U6, Dyn>::zeros(6 + count);
    for axis in 0..6 {
        motion[(axis, axis)] = drawn.sd[axis];
    }
    let back = pose::motion_between(&mount.rig_from_sensor, &drawn.nominal);
    let mounting = Mounting {
        rig_from_sensor: mount.rig_from_sensor,
        motion,
    };
    (mounting, answer::prior_mean(&back, &drawn.sd, count))
}

/// The problem, and the state to begin with.
fn begin<'w>(
    work: &Workspace<'w>,
    groups: Vec<Group>,
    mounting: Mounting,
    mean: &DVector<f64>,
    planes: &[MirrorPlane],
) -> (Joint<'w>, State) {
    let session = &work.dataset.session;
    let joint = Joint {
        groups,
        mounting,
        bias: &session.believed.bias,
        common: CommonErrors::of(session),
        first_common: MOTIONS,
        drift_sd: session.believed.drift_sd_mm * 1e-3,
        marker_sd: session.believed.marker_sd_mm * 1e-3,
        flatness: Flatness::default(),
        prior_mean: mean.clone(),
    };
    let start = joint.state(planes);
    (joint, start)
}

fn solve(
    work: &Workspace,
    groups: Vec<Group>,
    mounting: Mounting,
    mean: &DVector<f64>,
    planes: &[MirrorPlane],
    departing: bool,
) -> Result<Outcome, ProblemError> {
    let session = &work.dataset.session;
    let (mut joint, start) = begin(work, groups, mounting, mean, planes);
    let exact = least_squares::Options::default();
    let rigid = |joint: &Joint, from: State| {
        joint.solve(from, &exact).map(|solution| Fit {
            solution,
            departure_statistic: 0.0,
        })
    };
    let mut fit = if departing {
        joint.fit(start)?
    } else {
        rigid(&joint, start)?
    };
    let mut left_out = false;
    for _ in 0..ROUNDS {
        let strange = joint.strange(&fit.solution.state);
        if strange.is_empty() {
            break;
        }
        for group in &mut joint.groups {
            group
                .elements
                .retain(|e| e.facet.is_none() || !strange.contains(&e.beam));
        }
        left_out = true;
        fit = rigid(&joint, fit.solution.state)?;
    }
    if departing && left_out {
        // They had their part in how plane the facets seemed.
        fit = joint.fit(fit.solution.state)?;
    }
    let answers = joint.answers(&fit.solution);
    let solution = &fit.solution;
    let bent = joint.bent(solution);
    let mut assessment = departing.then(|| joint.assess(session, &fit, &answers));
    if let Some(assessment) = &mut assessment
        && work.options.cross_validation
    {
        assessment.held_out = joint.cross_validated(&solution.state)?;
    }
    let names = |facet: usize| session.facets[facet].name.clone();
    Ok(Outcome {
        beams: answers
            .iter()
            .map(|a| {
                let estimate = a.estimate(names(a.facet), solution.iterations, bent.contains(&a.facet));
                (a.beam, estimate)
            })
            .collect(),
        facets: joint.facets(solution, &names, &bent),
        mount: if departing { joint.mount(solution) } else { None },
        bias: if departing {
            joint.corrected_bias(solution)
        } else {
            None
        },
        assessment,
    })
}

impl Answer {
    /// What is said of the element; where its facet is `bent`, not what is known too badly for its covariance to hold.
    fn estimate(&self, facet: String, iterations: usize, bent: bool) -> BeamEstimate {
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
                "the boards of its facet tell a direction only by how their ranges bend over it: two directions fit \
                 nearly alike"
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
