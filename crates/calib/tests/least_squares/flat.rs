//! A grouped problem as a plain one: the result that elimination has to reproduce.

use catoptric_calib::lsq::{GroupedResiduals, Point, Residuals, State};
use nalgebra::{DMatrix, DVector};

/// A grouped problem as a plain one: all parameters in one point, one dense Jacobian.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Flat<'a, P> {
    problem: &'a P,
    shared_blocks: usize,
    own_blocks: Vec<usize>,
}

impl<'a, P: GroupedResiduals> Flat<'a, P> {
    /// The problem, and the state as one point: blocks of `shared`, then of each group.
    pub(crate) fn new(problem: &'a P, state: &State) -> (Self, Point) {
        let blocks = state
            .own
            .iter()
            .fold(state.shared.blocks.clone(), |mut all, own| {
                all.extend_from_slice(&own.blocks);
                all
            });
        let flat = Self {
            problem,
            shared_blocks: state.shared.blocks.len(),
            own_blocks: state.own.iter().map(|p| p.blocks.len()).collect(),
        };
        (flat, Point { blocks })
    }

    /// A point of the plain problem as a state of the grouped one.
    pub(crate) fn state(&self, at: &Point) -> State {
        let mut rest = &at.blocks[self.shared_blocks..];
        let own = self
            .own_blocks
            .iter()
            .map(|count| {
                let (head, tail) = rest.split_at(*count);
                rest = tail;
                Point {
                    blocks: head.to_vec(),
                }
            })
            .collect();
        let shared = Point {
            blocks: at.blocks[..self.shared_blocks].to_vec(),
        };
        State { shared, own }
    }
}

impl<P: GroupedResiduals> Residuals for Flat<'_, P> {
    fn residuals(&self, at: &Point) -> Option<DVector<f64>> {
        let state = self.state(at);
        let mut all = Vec::new();
        for group in 0..self.problem.groups() {
            let rows = self.problem.residuals(group, &state.shared, state.own(group))?;
            all.extend_from_slice(rows.as_slice());
        }
        Some(DVector::from_vec(all))
    }

    fn jacobian(&self, at: &Point) -> Option<DMatrix<f64>> {
        let state = self.state(at);
        let shared_width = state.shared.dimension();
        let mut from = shared_width;
        let mut placed = Vec::new();
        for group in 0..self.problem.groups() {
            let part = self.problem.jacobian(group, &state.shared, state.own(group))?;
            let width = part.own.ncols();
            placed.push((from, part));
            from += width;
        }
        let rows = placed.iter().map(|(_, part)| part.shared.nrows()).sum();
        let mut all = DMatrix::zeros(rows, state.dimension());
        let mut row = 0;
        for (column, part) in &placed {
            let height = part.shared.nrows();
            all.view_mut((row, 0), (height, shared_width))
                .copy_from(&part.shared);
            all.view_mut((row, *column), (height, part.own.ncols()))
                .copy_from(&part.own);
            row += height;
        }
        Some(all)
    }
}
