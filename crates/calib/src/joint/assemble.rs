//! Builds the joint problem from a dataset: groups of facets, boards in front of undeflected beams, and the mounting.

use super::fan::Flatness;
use super::group::{BareFacet, Board, Facet, Group, JointElement, Sight};
use super::problem::{Joint, Mounting};
use crate::element::attempt::Workspace;
use crate::element::choose::boards_hit;
use crate::judge::common::CommonErrors;
use crate::lsq::State;
use crate::mount::mount_data::DirectBoard;
use crate::mount::pose::{self, Mount, MountPrior};
use crate::readings::observations::azimuth;
use crate::readings::spread;
use crate::screen::ScreenClass;
use catoptric_model::{BeamEstimate, MirrorPlane, Pose, ScanGeometry, Session, Status, beam};
use nalgebra::{DVector, Dyn, Matrix6, OMatrix, RowDVector, U6, Vector6};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Number of motions of the mounting, which come first among the shared parameters.
const MOTIONS: usize = 6;

/// Smallest standard deviation, in meters: keeps every weight finite where no error is believed in.
const MIN_SD: f64 = 1e-6;

/// An element that takes part: its facet, and the stretches whose boards it hits.
pub(crate) struct Assigned {
    pub(crate) beam: usize,
    pub(crate) facet: usize,
    pub(crate) poses: Vec<usize>,
}

/// Elements that hit boards and can be solved together: those solved individually, and those that only lacked boards.
pub(crate) fn assigned(
    work: &Workspace,
    candidates: &[ScreenClass],
    mirrors: &[MirrorPlane],
    alone: &[BeamEstimate],
) -> Vec<Assigned> {
    let facets = &work.dataset.session.facets;
    let of_one = |(candidate, estimate): (&ScreenClass, &BeamEstimate)| {
        let ScreenClass::Deflected(near) = candidate else {
            return None;
        };
        let facet = match estimate.status {
            Status::Solved => facets
                .iter()
                .position(|f| Some(&f.name) == estimate.facet.as_ref()),
            Status::TooFewPoses | Status::Unobservable => near.first().copied(),
            Status::Direct | Status::NotConverged | Status::Rejected => None,
        }?;
        let poses = boards_hit(work, estimate, &facets[facet], &mirrors[facet])?;
        (!poses.is_empty()).then_some(Assigned {
            beam: estimate.beam,
            facet,
            poses,
        })
    };
    candidates.par_iter().zip(alone).filter_map(of_one).collect()
}

/// Connected sets of facets that share boards, as facet indices. Facets without elements are in no set.
pub(super) fn components(facets: usize, assigned: &[Assigned]) -> Vec<Vec<usize>> {
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

/// A board as tracked in a stretch.
fn board(work: &Workspace, pose: usize) -> Option<Board> {
    let (session, record) = (&work.dataset.session, &work.dataset.poses[pose]);
    let sheet = session.board(record.label.board.as_deref()?)?;
    let rig_from_board = record.room_from_rig.inverse() * record.room_from_board?;
    Some(Board {
        pose,
        number: record.label.pose,
        rig_from_board,
        rig_from_face: sheet.face(&rig_from_board),
        color: record.label.color.clone().unwrap_or_else(|| sheet.color.clone()),
        markers: sheet.markers.iter().map(|m| m.position()).collect(),
    })
}

/// A group: the given facets with their boards and elements.
pub(super) fn group(work: &Workspace, facets: &[usize], assigned: &[&Assigned]) -> Group {
    let session = &work.dataset.session;
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
            // From the drawing, because the distances were corrected by it.
            let cos = drawn.as_ref().map_or(1.0, |plane| plane.normal.dot(u).abs());
            row += common.bare_row(*distance, cos);
            variance += common.bare_sd(*distance, cos).powi(2);
        }
        let count = distances.len().max(1) as f64;
        let own = session.bare_structure.noise_sd_mm * 1e-3;
        BareFacet {
            distances,
            thickness: session.bare_structure.mirror_thickness_mm * 1e-3,
            common: row / count,
            sd: libm::hypot((variance / count).sqrt(), own / count.sqrt()).max(MIN_SD),
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
                let noise = session
                    .believed
                    .noise_sd(summary.mean, &group.boards[place].color);
                let of_mean = spread::noise_sd(summary, noise) / (summary.count.max(1) as f64).sqrt();
                let sd = libm::hypot(of_mean, session.believed.element_sd_mm * 1e-3);
                sights.push(Sight {
                    board: place,
                    mean: summary.mean,
                    sd: sd.max(MIN_SD),
                    count: summary.count,
                });
            }
        }
        let azimuth = azimuth(session, element.beam);
        group.elements.push(JointElement {
            beam: element.beam,
            azimuth,
            u: beam::direction(azimuth),
            facet: facets.iter().position(|f| *f == element.facet),
            along: along(
                &session.scanner.scan,
                session.facets[element.facet].beams,
                element.beam,
            ),
            sights,
        });
    }
    group
}

/// Place of a beam in a fan, −1 at its first beam and 1 at its last.
pub(super) fn along(scan: &ScanGeometry, fan: [usize; 2], beam: usize) -> f64 {
    let half = 0.5 * scan.length(fan).max(1) as f64;
    (scan.along(fan, beam) / half - 1.0).clamp(-1.5, 1.5)
}

/// One board in front of undeflected beams.
pub(super) fn direct_group(work: &Workspace, selected: &DirectBoard) -> Option<Group> {
    // Readings believed to be noise-free are not rounded either.
    let exact = work.dataset.session.believed.range_noise_sd_mm == 0.0;
    let floored = |sd: f64| if exact { MIN_SD } else { sd.max(MIN_SD) };
    let elements = selected.rays.iter().map(|ray| JointElement {
        beam: ray.beam,
        azimuth: ray.azimuth,
        u: beam::direction(ray.azimuth),
        facet: None,
        along: 0.0,
        sights: vec![Sight {
            board: 0,
            mean: ray.mean,
            sd: floored(ray.variance.sqrt()),
            count: work.summaries[selected.pose][ray.beam].count,
        }],
    });
    Some(Group {
        facets: Vec::new(),
        boards: vec![board(work, selected.pose)?],
        elements: elements.collect(),
    })
}

/// The mounting as estimated in step 5, with its uncertainty among the shared parameters.
pub(super) fn mounting_as_found(work: &Workspace, mount: &Mount) -> (Mounting, DVector<f64>) {
    let count = shared_errors(&work.dataset.session);
    let known = &mount.uncertainty;
    let mounting = Mounting {
        rig_from_sensor: mount.rig_from_sensor,
        motion: motion_of(&known.independent, &known.common, count),
    };
    (mounting, DVector::zeros(6 + count))
}

/// The mounting as drawn, to be estimated from all data; motions are counted from the estimate of step 5.
pub(super) fn mounting_as_drawn(work: &Workspace, mount: &Mount) -> (Mounting, DVector<f64>) {
    let session = &work.dataset.session;
    let count = shared_errors(session);
    let drawn = MountPrior::of(
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
    (mounting, prior_mean(&back, &drawn.sd, count))
}

/// Number of shared errors besides the mounting: of the biases, and of the thickness of glass if it is uncertain.
fn shared_errors(session: &Session) -> usize {
    let glass = session
        .glass
        .as_ref()
        .is_some_and(|glass| glass.thickness_sd_mm > 0.0);
    CommonErrors::of(session).len() + usize::from(glass)
}

/// The problem and its initial state.
pub(super) fn begin<'w>(
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
        glass: session.glass.as_ref(),
        flatness: Flatness::default(),
        prior_mean: mean.clone(),
        stop: work.stop,
    };
    let start = joint.state(planes);
    (joint, start)
}

/// Motion matrix of a mounting with a known uncertainty: independent errors first, then the common ones.
fn motion_of(
    independent: &Matrix6<f64>,
    common: &OMatrix<f64, U6, Dyn>,
    count: usize,
) -> OMatrix<f64, U6, Dyn> {
    let eigen = independent.symmetric_eigen();
    let root = eigen.eigenvectors * Matrix6::from_diagonal(&eigen.eigenvalues.map(|v| v.max(0.0).sqrt()));
    let mut motion = OMatrix::<f64, U6, Dyn>::zeros(6 + count);
    motion.columns_mut(0, 6).copy_from(&root);
    motion.columns_mut(6, common.ncols()).copy_from(common);
    motion
}

/// Mean of w for a prior centered on another mounting: the motion over its standard deviation.
fn prior_mean(motion: &Vector6<f64>, sd: &Vector6<f64>, count: usize) -> DVector<f64> {
    let mut mean = DVector::zeros(6 + count);
    for i in 0..6 {
        mean[i] = motion[i] / sd[i];
    }
    mean
}
