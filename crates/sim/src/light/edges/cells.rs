//! The light on one path, gathered into a few cells of about equal energy.

use super::gauss::{Place, REACH, density, within};
use super::lines::Piece;

/// Longest part of a line that becomes one node if there is one ray, in units of the 1/e² half-axes; with more of them it
/// is shorter, so that a ray stands for several nodes.
pub(super) const LONGEST_NODE: f64 = 0.8;

/// A part of the light on one path.
#[derive(Clone, Copy)]
pub(super) struct Node {
    pub(super) at: Place,
    pub(super) energy: f64,
    /// Mean square distance of its light from `at`.
    square: f64,
}

/// Adds the nodes of a piece of a line: short parts of it, each with the moments of the Gaussian.
pub(super) fn add_nodes<K>(
    piece: &Piece<K>,
    (weight, longest): (f64, f64),
    place: impl Fn(f64) -> Place,
    nodes: &mut Vec<Node>,
) {
    let length = piece.to - piece.from;
    // At most the length of the longest line divided by a part's.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let parts = (length / longest).ceil().max(1.0) as usize;
    for part in 0..parts {
        let at = |k: usize| piece.from + length * k as f64 / parts as f64;
        let (from, to) = (at(part), at(part + 1));
        let energy = within(from, to);
        if energy <= 0.0 {
            continue;
        }
        let mean = 0.25 * (density(from) - density(to)) / energy;
        let square = 0.25 + 0.25 * (from * density(from) - to * density(to)) / energy;
        nodes.push(Node {
            at: place(mean),
            energy: weight * energy,
            square: (square - mean * mean).max(0.0),
        });
    }
}

/// Gathers the light on one path into at most `count` cells.
pub(super) fn gather<K: PartialEq>(
    nodes: &mut [Node],
    count: usize,
    path: &K,
    paths: &mut impl FnMut(&[Place]) -> Vec<K>,
) -> Vec<Node> {
    let whole = center(nodes);
    let mut cells = Vec::with_capacity(count);
    let mut nearest = Vec::with_capacity(count);
    divide(nodes, count, &mut |own| {
        let cell = center(own);
        let away = |n: &Node| distance_2(&n.at, &cell.at);
        let closest = own.iter().min_by(|a, b| away(a).total_cmp(&away(b)));
        nearest.push(closest.map_or(cell.at, |n| n.at));
        cells.push(cell);
    });
    let places: Vec<Place> = cells.iter().map(|c| c.at).collect();
    for ((cell, found), nearest) in cells.iter_mut().zip(paths(&places)).zip(nearest) {
        // The center of a crooked cell may lie on another path.
        if found != *path {
            cell.at = nearest;
        }
    }
    // The cells are moved apart, so that their spread includes that within them, unless one ends up on another path.
    let have: f64 = cells
        .iter()
        .map(|c| c.energy * distance_2(&c.at, &whole.at))
        .sum();
    let scale = (whole.square * whole.energy / have).sqrt();
    if scale.is_finite() && cells.len() > 3 {
        let apart = |c: &Node| [0, 1].map(|k| whole.at[k] + scale * (c.at[k] - whole.at[k]));
        let places: Vec<Place> = cells.iter().map(apart).collect();
        let inside = places.iter().all(|p| distance_2(p, &[0.0; 2]) <= REACH * REACH);
        if inside && paths(&places).iter().all(|p| p == path) {
            for (cell, at) in cells.iter_mut().zip(places) {
                cell.at = at;
            }
        }
    }
    cells
}

fn distance_2(a: &Place, b: &Place) -> f64 {
    let [x, y] = [a[0] - b[0], a[1] - b[1]];
    x * x + y * y
}

/// All light of some nodes as one.
fn center(nodes: &[Node]) -> Node {
    let energy: f64 = nodes.iter().map(|n| n.energy).sum();
    let at = [0, 1].map(|k| nodes.iter().map(|n| n.energy * n.at[k]).sum::<f64>() / energy);
    let square = |n: &Node| n.energy * (n.square + distance_2(&n.at, &at));
    Node {
        at,
        energy,
        square: nodes.iter().map(square).sum::<f64>() / energy,
    }
}

/// Divides nodes into `count` cells of about equal energy, across the longer side each time.
fn divide(nodes: &mut [Node], count: usize, cell: &mut impl FnMut(&[Node])) {
    if count < 2 || nodes.len() < 2 {
        cell(nodes);
        return;
    }
    let whole = center(nodes);
    let spread = |k: usize| -> f64 {
        let square = |n: &Node| n.energy * (n.at[k] - whole.at[k]) * (n.at[k] - whole.at[k]);
        nodes.iter().map(square).sum()
    };
    let axis = usize::from(spread(1) > spread(0));
    nodes.sort_by(|a, b| {
        a.at[axis]
            .total_cmp(&b.at[axis])
            .then(a.at[1 - axis].total_cmp(&b.at[1 - axis]))
    });
    let first = count / 2;
    let wanted = whole.energy * first as f64 / count as f64;
    let mut sum = 0.0;
    let before = |n: &Node| {
        sum += n.energy;
        sum - 0.5 * n.energy < wanted
    };
    let middle = nodes
        .iter()
        .map(before)
        .take_while(|b| *b)
        .count()
        .clamp(1, nodes.len() - 1);
    let (low, high) = nodes.split_at_mut(middle);
    divide(low, first, cell);
    divide(high, count - first, cell);
}
