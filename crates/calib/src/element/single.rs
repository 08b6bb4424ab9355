//! Single readings for the recursion: blocks of elements whose readings fit in memory together.

use crate::element::attempt::Workspace;
use crate::element::solver::Solver;
use crate::readings::columns::{self, Wanted};
use crate::screen::ScreenClass;
use catoptric_model::{PoseKind, PoseRecord};
use std::ops::Range;

/// Elements that are estimated side by side, and the readings that they need to be at hand.
pub(super) struct Block {
    pub(super) beams: Range<usize>,
    pub(super) wanted: Vec<Wanted>,
}

/// All elements, in blocks of at most `most_bytes` of readings, and of at least one element.
pub(super) fn blocks(
    work: &Workspace,
    solver: &Solver,
    candidates: &[ScreenClass],
    most_bytes: usize,
) -> Vec<Block> {
    if !solver.single_readings {
        return vec![Block {
            beams: 0..candidates.len(),
            wanted: Vec::new(),
        }];
    }
    let bytes = |candidate: &ScreenClass| -> usize {
        let wanted = wanted_poses(work, candidate);
        wanted.map(|pose| columns::bytes(&work.dataset.poses[pose])).sum()
    };
    let (mut blocks, mut first, mut held) = (Vec::new(), 0, 0);
    for (beam, candidate) in candidates.iter().enumerate() {
        let more = bytes(candidate);
        if held + more > most_bytes && beam > first {
            blocks.push(block(work, candidates, first..beam));
            (first, held) = (beam, 0);
        }
        held += more;
    }
    blocks.push(block(work, candidates, first..candidates.len()));
    blocks
}

fn block(work: &Workspace, candidates: &[ScreenClass], beams: Range<usize>) -> Block {
    let mut wanted = vec![Vec::new(); work.dataset.poses.len()];
    for beam in beams.clone() {
        for pose in wanted_poses(work, &candidates[beam]) {
            wanted[pose].push(beam);
        }
    }
    let of_pose = |(pose, beams): (usize, Vec<usize>)| (!beams.is_empty()).then_some(Wanted { pose, beams });
    Block {
        beams,
        wanted: wanted.into_iter().enumerate().filter_map(of_pose).collect(),
    }
}

/// The stretches whose readings may take part in an estimate: those with boards in front of its facets.
fn wanted_poses<'a>(work: &'a Workspace, candidate: &'a ScreenClass) -> impl Iterator<Item = usize> + 'a {
    let near: &[usize] = match candidate {
        ScreenClass::Deflected(near) => near,
        ScreenClass::Direct(_) | ScreenClass::Rejected(_) => &[],
    };
    let facets = &work.dataset.session.facets;
    let is_near = move |name: &String| near.iter().any(|f| facets[*f].name == *name);
    let is_wanted = move |record: &PoseRecord| {
        !near.is_empty()
            && record.label.kind == PoseKind::Facet
            && record.label.facet.as_ref().is_none_or(is_near)
    };
    let poses = work.dataset.poses.iter().enumerate();
    poses
        .filter(move |(_, record)| is_wanted(record))
        .map(|(pose, _)| pose)
}
