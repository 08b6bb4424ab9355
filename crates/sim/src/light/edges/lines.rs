//! Lines across the spot of a beam, cut where its light takes another path.

use super::gauss::{REACH, density, within};
use std::rc::Rc;

/// Panels of lines to begin with, and points of a line where its path is looked up.
const PANELS: usize = 9;
const SAMPLES: usize = 13;

/// A piece of a line that other lines may have where no point of theirs shows it.
const SHORT: f64 = 0.5;

/// Rounds in which an edge between two points of a line is sought, each at this many points between them: in the end it is
/// known to 1e-3 of the half-axes.
const ROUNDS: usize = 4;
const BETWEEN: usize = 3;

/// Panels that hold less of the energy are not divided further.
const LEAST_PANEL: f64 = 1e-3;

/// How far the middle line of a panel may be cut from where its neighbors let expect it: more, and an edge bends there.
const BEND: f64 = 0.005;

/// A line across the spot.
pub(super) struct Line<K> {
    pub(super) offset: f64,
    pub(super) pieces: Vec<Piece<K>>,
}

/// A part of a line whose light takes one path.
pub(super) struct Piece<K> {
    pub(super) path: K,
    pub(super) from: f64,
    pub(super) to: f64,
}

/// A range of lines, integrated with those at its ends and in its middle.
pub(super) struct Panel<K> {
    lines: [Rc<Line<K>>; 3],
}

/// Lines over the whole spot, closer together where edges end or bend.
pub(super) fn panels<K: Clone + PartialEq>(paths: &mut impl FnMut(&[(f64, f64)]) -> Vec<K>) -> Vec<Panel<K>> {
    let offset = |k: usize| REACH * (k as f64 / PANELS as f64 - 1.0);
    let regular = (0..=2 * PANELS).map(|k| (offset(k), Vec::new())).collect();
    let regular = cut(regular, paths);
    let mut open: Vec<Panel<K>> = (0..PANELS)
        .map(|k| Panel {
            lines: [0, 1, 2].map(|n| Rc::clone(&regular[2 * k + n])),
        })
        .collect();
    let mut done = Vec::new();
    while !open.is_empty() {
        let (fine, divided): (Vec<_>, Vec<_>) = open
            .into_iter()
            .partition(|panel| panel.energy() < LEAST_PANEL || panel.is_smooth());
        done.extend(fine);
        let between = cut(divided.iter().flat_map(Panel::quarters).collect(), paths);
        let halves = divided.iter().zip(between.chunks_exact(2));
        open = halves
            .flat_map(|(panel, quarters)| panel.halves(quarters))
            .collect();
    }
    done
}

impl<K: PartialEq> Panel<K> {
    /// Its lines with what each contributes to the integral over all lines, by Simpson's rule.
    pub(super) fn weighted(&self) -> impl Iterator<Item = (&Line<K>, f64)> {
        let [from, _, to] = self.lines.each_ref().map(|line| line.offset);
        let lines = self.lines.iter().zip([1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0]);
        lines.map(move |(line, share)| (&**line, share * (to - from) * density(line.offset)))
    }

    fn energy(&self) -> f64 {
        within(self.lines[0].offset, self.lines[2].offset)
    }

    /// Whether its lines are cut into the same paths, with edges that run straight from one to the next.
    fn is_smooth(&self) -> bool {
        let [a, b, c] = &self.lines;
        let same = |x: &Line<K>, y: &Line<K>| x.paths().eq(y.paths());
        let straight = |k: usize| {
            let expected = 0.5 * (a.pieces[k].to + c.pieces[k].to);
            (b.pieces[k].to - expected).abs() < BEND
        };
        same(a, b) && same(b, c) && (1..a.pieces.len()).all(|k| straight(k - 1))
    }

    /// The offsets of the lines between its own, and where these may be cut twice between two of the regular points: in
    /// the middle of the short pieces of its own.
    fn quarters(&self) -> [(f64, Vec<f64>); 2] {
        let short = |line: &Line<K>| {
            let pieces: Vec<_> = line.pieces.iter().filter(|p| p.to - p.from < SHORT).collect();
            pieces
                .into_iter()
                .map(|p| 0.5 * (p.from + p.to))
                .collect::<Vec<_>>()
        };
        let hints: Vec<f64> = self.lines.iter().flat_map(|line| short(line)).collect();
        [0, 1].map(|k| {
            let ends = [&self.lines[k], &self.lines[k + 1]];
            (0.5 * (ends[0].offset + ends[1].offset), hints.clone())
        })
    }

    /// Its two halves, given the lines between its own.
    fn halves(&self, quarters: &[Rc<Line<K>>]) -> Vec<Self> {
        let half = |(k, quarter): (usize, &Rc<Line<K>>)| Self {
            lines: [&self.lines[k], quarter, &self.lines[k + 1]].map(Rc::clone),
        };
        quarters.iter().enumerate().map(half).collect()
    }
}

impl<K> Line<K> {
    fn paths(&self) -> impl Iterator<Item = &K> {
        self.pieces.iter().map(|piece| &piece.path)
    }
}

/// Two points of a line, with the paths of their light, which differ.
struct Gap<K> {
    line: usize,
    ends: [(f64, K); 2],
}

/// Where a line is and where it is examined besides the regular points.
type Request = (f64, Vec<f64>);

/// Lines at some offsets, each cut where its light takes another path.
fn cut<K: Clone + PartialEq>(
    requests: Vec<Request>,
    paths: &mut impl FnMut(&[(f64, f64)]) -> Vec<K>,
) -> Vec<Rc<Line<K>>> {
    let points = |(offset, more): &Request| {
        let end = (REACH * REACH - offset * offset).max(0.0).sqrt();
        let regular = (0..SAMPLES).map(|k| end * (2.0 * k as f64 / (SAMPLES - 1) as f64 - 1.0));
        let more = more.iter().copied().filter(|at| at.abs() < end);
        let mut points: Vec<(f64, f64)> = regular.chain(more).map(|at| (at, *offset)).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        points
    };
    let of_lines: Vec<Vec<(f64, f64)>> = requests.iter().map(points).collect();
    let mut found = paths(&of_lines.concat()).into_iter();
    let (mut gaps, mut starts) = (Vec::new(), Vec::with_capacity(requests.len()));
    for (line, points) in of_lines.iter().enumerate() {
        let points: Vec<(f64, K)> = points.iter().map(|(at, _)| *at).zip(found.by_ref()).collect();
        let pairs = points.windows(2).filter(|pair| pair[0].1 != pair[1].1);
        gaps.extend(pairs.map(|pair| Gap {
            line,
            ends: [pair[0].clone(), pair[1].clone()],
        }));
        starts.extend(points.into_iter().next());
    }
    for _ in 0..ROUNDS {
        gaps = closer(gaps, &requests, paths);
    }
    let mut gaps = gaps.into_iter().peekable();
    let mut lines = Vec::with_capacity(requests.len());
    for ((number, (offset, _)), (start, first)) in requests.into_iter().enumerate().zip(starts) {
        let mut pieces = Vec::new();
        let (mut from, mut path) = (start, first);
        while let Some(gap) = gaps.next_if(|gap| gap.line == number) {
            let [below, above] = gap.ends;
            let to = 0.5 * (below.0 + above.0);
            pieces.push(Piece { path, from, to });
            (from, path) = (to, above.1);
        }
        let to = -start;
        pieces.push(Piece { path, from, to });
        lines.push(Rc::new(Line { offset, pieces }));
    }
    lines
}

/// The same gaps, each as wide as the distance between the points that are sought in it.
fn closer<K: Clone + PartialEq>(
    gaps: Vec<Gap<K>>,
    requests: &[Request],
    paths: &mut impl FnMut(&[(f64, f64)]) -> Vec<K>,
) -> Vec<Gap<K>> {
    let between = |gap: &Gap<K>| {
        let [below, above] = [gap.ends[0].0, gap.ends[1].0];
        let offset = requests[gap.line].0;
        (1..=BETWEEN).map(move |k| (below + (above - below) * k as f64 / (BETWEEN + 1) as f64, offset))
    };
    let points: Vec<(f64, f64)> = gaps.iter().flat_map(between).collect();
    let mut found = points.iter().map(|(at, _)| *at).zip(paths(&points));
    let mut closer = Vec::with_capacity(gaps.len());
    for gap in gaps {
        let line = gap.line;
        let [mut below, above] = gap.ends;
        // More than one pair of neighbors differs if there is a third path between the two.
        for end in found.by_ref().take(BETWEEN).chain([above]) {
            if below.1 != end.1 {
                let ends = [below, end.clone()];
                closer.push(Gap { line, ends });
            }
            below = end;
        }
    }
    closer
}
