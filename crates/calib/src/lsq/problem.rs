//! The problem to be minimized: residuals and their Jacobian, supplied by the caller.
//!
//! [`Residuals`] have no structure. [`GroupedResiduals`] have an arrow-shaped Jacobian: each group of residuals depends
//! on the shared parameters and on its own, which no other group depends on, so that they can be eliminated group by
//! group.

use super::manifold::Point;
use nalgebra::{DMatrix, DVector};
use thiserror::Error;

/// Residuals at a point, with derivatives from the caller.
///
/// Residuals are best given in units of their standard deviations: then covariances need no further factor. A residual
/// function that is undefined at a point (a ray that misses its board) returns `None`; the solver then tries a shorter
/// step.
pub trait Residuals: Sync {
    /// f(x), m numbers; the same m at every point.
    fn residuals(&self, at: &Point) -> Option<DVector<f64>>;
    /// ∂f(x ⊞ δ)/∂δ at δ = 0, m × n, with n the dimension of the point's tangent space.
    fn jacobian(&self, at: &Point) -> Option<DMatrix<f64>>;
}

/// Derivatives of one group of residuals.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupJacobian {
    /// With respect to the shared parameters, m × n.
    pub shared: DMatrix<f64>,
    /// With respect to the group's own parameters, m × k.
    pub own: DMatrix<f64>,
}

/// One group of residuals linearized.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupRows {
    /// f, m numbers.
    pub residuals: DVector<f64>,
    /// Its derivatives.
    pub jacobian: GroupJacobian,
    /// ln det of the covariance by whose square root the residuals were divided; 0 if it is never compared with
    /// another.
    pub log_covariance: f64,
}

/// Residuals in groups, each depending on the shared parameters and on the group's own.
///
/// [`Residuals`] are a single group without own parameters. Groups are evaluated in parallel, in any order.
pub trait GroupedResiduals: Sync {
    /// Whether the caller no longer wants a solution; looked at before every evaluation.
    fn is_stopped(&self) -> bool {
        false
    }
    /// Number of groups.
    fn groups(&self) -> usize;
    /// Residuals of one group; see [`Residuals::residuals`].
    fn residuals(&self, group: usize, shared: &Point, own: &Point) -> Option<DVector<f64>>;
    /// Derivatives of one group; see [`Residuals::jacobian`].
    fn jacobian(&self, group: usize, shared: &Point, own: &Point) -> Option<GroupJacobian>;
    /// Both at a point.
    fn linearized(&self, group: usize, shared: &Point, own: &Point) -> Option<GroupRows> {
        Some(GroupRows {
            residuals: self.residuals(group, shared, own)?,
            jacobian: self.jacobian(group, shared, own)?,
            log_covariance: 0.0,
        })
    }
}

impl<P: Residuals> GroupedResiduals for P {
    fn groups(&self) -> usize {
        1
    }

    fn residuals(&self, _group: usize, shared: &Point, _own: &Point) -> Option<DVector<f64>> {
        Residuals::residuals(self, shared)
    }

    fn jacobian(&self, _group: usize, shared: &Point, _own: &Point) -> Option<GroupJacobian> {
        let shared = Residuals::jacobian(self, shared)?;
        let own = DMatrix::zeros(shared.nrows(), 0);
        Some(GroupJacobian { shared, own })
    }
}

/// Values of all parameters: the shared ones, then each group's own.
///
/// Its tangent space has the coordinates of `shared` first, then those of `own[0]`, `own[1]`, …
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// The parameters that all groups share.
    pub shared: Point,
    /// The own parameters of each group; groups beyond the last one have none.
    pub own: Vec<Point>,
}

impl From<Point> for State {
    fn from(shared: Point) -> Self {
        Self {
            shared,
            own: Vec::new(),
        }
    }
}

const NOTHING: &Point = &Point { blocks: Vec::new() };

impl State {
    /// Own parameters of a group.
    pub fn own(&self, group: usize) -> &Point {
        self.own.get(group).unwrap_or(NOTHING)
    }

    /// Dimension of the tangent space.
    pub fn dimension(&self) -> usize {
        self.shared.dimension() + self.own.iter().map(Point::dimension).sum::<usize>()
    }

    /// x ⊞ δ.
    pub fn retract(&self, step: &DVector<f64>) -> Self {
        let mut from = self.shared.dimension();
        let shared = self.shared.retract(&step.as_slice()[..from]);
        let own = self
            .own
            .iter()
            .map(|point| {
                let to = from + point.dimension();
                let moved = point.retract(&step.as_slice()[from..to]);
                from = to;
                moved
            })
            .collect();
        Self { shared, own }
    }

    /// Scale of each coordinate, to judge whether a step is small; see [`Point::extent`].
    pub fn extent(&self) -> DVector<f64> {
        let own = self.own.iter().flat_map(Point::extent);
        DVector::from_vec(self.shared.extent().into_iter().chain(own).collect())
    }
}

/// The errors that keep a problem from being solved at all.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum ProblemError {
    /// The residuals or their derivatives are undefined or not finite at a point where the solver needs them.
    #[error("the residuals of group {group} are undefined or not finite at the {place}")]
    Undefined {
        /// Group of residuals.
        group: usize,
        /// Which point.
        place: &'static str,
    },
    /// A Jacobian does not fit its residuals or its parameters.
    #[error(
        "the Jacobian of group {group} is {found_rows} × {found_columns} for its {parameters} parameters; \
         needed are {rows} × {columns}"
    )]
    Shape {
        /// Group of residuals.
        group: usize,
        /// Whose derivatives: "shared" or "own".
        parameters: &'static str,
        /// Rows needed: the number of residuals.
        rows: usize,
        /// Columns needed: the dimension of the parameters.
        columns: usize,
        /// Rows found.
        found_rows: usize,
        /// Columns found.
        found_columns: usize,
    },
    /// The caller stopped the search.
    #[error("stopped on request")]
    Stopped,
}
