//! All elements at once: facets are planes that their beams share, and what all readings share is estimated once.
//!
//! Methods `facet` (each connected set of facets separately, the mounting as already found) and `joint` (all of them with
//! the boards in front of undeflected beams). In both, beams may deviate from their planes by as much as all facets
//! together show. Both keep the boards and the verdict on an element's readings that its individual calibration arrived
//! at.

mod answer;
mod assemble;
mod assess;
mod bow;
mod doubt;
mod estimate;
mod fan;
mod fit;
mod gate;
mod group;
mod held;
mod limit;
mod linear;
mod placed;
mod problem;
mod reach;
mod rows;

use crate::element::attempt::Workspace;
use crate::lsq::{self, ProblemError, Solution, State};
use crate::mount::pose::Mount;
use assemble::{Assigned, begin, components, direct_group, group, mounting_as_drawn, mounting_as_found};
use catoptric_model::calibration::{FacetEstimate, MountEstimate};
use catoptric_model::{Assessment, BeamEstimate, Calibration, MirrorPlane, RangeBias};
use fan::Flatness;
use fit::JointFit;
use group::Group;
use nalgebra::DVector;
use problem::{Joint, Mounting};
use std::collections::BTreeMap;

pub(crate) use assemble::assigned;
pub use limit::{TrueDirection, limit};

/// Maximum number of rounds of leaving elements out.
const ROUNDS: usize = 3;

/// What is solved at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Extent {
    /// Each set of facets that share boards, with the mounting from step 5.
    EachFacet,
    /// All facets and the boards in front of undeflected beams.
    Everything,
}

/// The result.
#[derive(Default)]
struct Outcome {
    /// Elements that took part.
    beams: BTreeMap<usize, BeamEstimate>,
    facets: Vec<FacetEstimate>,
    mount: Option<MountEstimate>,
    bias: Option<RangeBias>,
    assessment: Option<Assessment>,
    /// What the reader must know.
    warnings: Vec<String>,
}

/// Calibrates the assigned elements together and replaces their individual results.
pub(crate) fn together(
    extent: Extent,
    work: &Workspace,
    mount: &Mount,
    planes: &[MirrorPlane],
    assigned: &[Assigned],
    calibration: &mut Calibration,
) {
    // Within the pool: groups are dispatched many times, and from outside each dispatch would wake the pool.
    match rayon::scope(|_| within_pool(extent, work, mount, planes, assigned)) {
        Ok(outcome) => {
            for (beam, estimate) in outcome.beams {
                calibration.beams[beam] = estimate;
            }
            calibration.facets = outcome.facets;
            calibration.rig_from_sensor = outcome.mount.or(calibration.rig_from_sensor);
            calibration.bias = outcome.bias;
            calibration.assessment = outcome.assessment;
            calibration.warnings.extend(outcome.warnings);
        }
        Err(problem) => calibration.warnings.push(format!(
            "the elements could not be solved together ({problem}); each was solved individually"
        )),
    }
}

fn within_pool(
    extent: Extent,
    work: &Workspace,
    mount: &Mount,
    planes: &[MirrorPlane],
    assigned: &[Assigned],
) -> Result<Outcome, ProblemError> {
    let groups = components(work.dataset.session.facets.len(), assigned)
        .into_iter()
        .map(|facets| {
            let some: Vec<&Assigned> = assigned.iter().filter(|a| facets.contains(&a.facet)).collect();
            group(work, &facets, &some)
        });
    match extent {
        Extent::EachFacet => {
            let mut outcome = Outcome::default();
            // One facet alone shows too little of how flat such mirrors are.
            let groups: Vec<Group> = groups.collect();
            let (mounting, mean) = mounting_as_found(work, mount);
            let (mut all, start) = begin(work, groups.clone(), mounting, &mean, planes);
            all.fit(start)?;
            for group in groups {
                let (mounting, mean) = mounting_as_found(work, mount);
                let part = solve(work, vec![group], mounting, &mean, planes, Some(all.flatness))?;
                outcome.beams.extend(part.beams);
                outcome.facets.extend(part.facets);
                outcome.warnings.extend(part.warnings);
            }
            Ok(outcome)
        }
        Extent::Everything => {
            let direct = mount
                .selection
                .iter()
                .filter_map(|board| direct_group(work, board));
            let groups = groups.chain(direct).collect();
            let (mounting, mean) = mounting_as_drawn(work, mount);
            solve(work, groups, mounting, &mean, planes, None)
        }
    }
}

/// Solves groups together. Without a given flatness it is estimated, and so are mounting and biases.
fn solve(
    work: &Workspace,
    groups: Vec<Group>,
    mounting: Mounting,
    mean: &DVector<f64>,
    planes: &[MirrorPlane],
    flatness: Option<Flatness>,
) -> Result<Outcome, ProblemError> {
    let session = &work.dataset.session;
    let (mut joint, start) = begin(work, groups, mounting, mean, planes);
    joint.flatness = flatness.unwrap_or_default();
    let deviating = flatness.is_none();
    let exact = lsq::SolverOptions::default();
    let rigid = |joint: &Joint, from: State| {
        joint.solve(from, &exact).map(|solution| JointFit {
            solution,
            deviation_statistic: 0.0,
        })
    };
    let mut fit = if deviating {
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
    if deviating && left_out {
        // The elements left out had a share in the estimated flatness.
        fit = joint.fit(fit.solution.state)?;
    }
    let answers = joint.answers(&fit.solution);
    let solution = &fit.solution;
    let bent = joint.bent(solution);
    let mut assessment = deviating.then(|| joint.assess(work.dataset, &fit, &answers));
    if let Some(assessment) = &mut assessment
        && work.options.cross_validation
    {
        assessment.held_out = joint.cross_validated(&solution.state)?;
    }
    let doubts = assessment.iter().flat_map(|a| &a.doubts);
    let doubts = doubts.map(|doubt| format!("the readings contradict the session: {}", doubt.message));
    let names = |facet: usize| session.facets[facet].name.clone();
    let warnings = unconverged(solution).into_iter().chain(doubts);
    let warnings = warnings.chain(joint.bows(solution, &names)).collect();
    Ok(Outcome {
        beams: answers
            .iter()
            .map(|a| {
                let estimate = a.estimate(names(a.facet), solution.iterations, bent.contains(&a.facet));
                (a.beam, estimate)
            })
            .collect(),
        facets: joint.facets(solution, &names, &bent),
        mount: if deviating { joint.mount(solution) } else { None },
        bias: if deviating {
            joint.corrected_bias(solution)
        } else {
            None
        },
        assessment,
        warnings,
    })
}

/// Slope along a parameter, in its standard deviations, that does no harm: the derivatives omit that weights change too.
const HARMLESS: f64 = 0.1;

/// A warning about a solution that is no minimum.
fn unconverged(solution: &Solution) -> Option<String> {
    let slope = solution.gradient_cosine * solution.sum_of_squares.sqrt();
    (!solution.stop.converged() && slope > HARMLESS).then(|| {
        format!(
            "the elements solved together have not converged after {} iterations: their directions and covariances may be \
             wrong",
            solution.iterations
        )
    })
}
