//! Dense nonlinear least squares on manifolds: min ‖f(x)‖², its rank, its open directions and its covariance.
//!
//! The caller supplies residuals and Jacobian ([`Residuals`]; [`GroupedResiduals`] for parameters that only one group of
//! residuals depends on, which are eliminated). Parameters are blocks of Rⁿ, S², SO(3), SE(3) ([`ParameterBlock`]).
//! [`minimize`] is MINPACK's trust region over QR with column pivoting; [`Prior`]s are rows. [`Information`] holds the
//! covariance of the solution and the directions that are open.
//!
//! ```
//! use catoptric_calib::lsq::{Point, Residuals, SolverOptions, minimize};
//! use nalgebra::{DMatrix, DVector};
//!
//! /// y = a·x² + b, in units of the error of y.
//! struct Parabola { x: Vec<f64>, y: Vec<f64> }
//!
//! impl Residuals for Parabola {
//!     fn residuals(&self, at: &Point) -> Option<DVector<f64>> {
//!         let p = at.numbers(0)?;
//!         let f = self.x.iter().zip(&self.y).map(|(x, y)| p[0] * x * x + p[1] - y);
//!         Some(DVector::from_iterator(self.x.len(), f))
//!     }
//!     fn jacobian(&self, _: &Point) -> Option<DMatrix<f64>> {
//!         let column = |j| move |x: &f64| if j == 0 { x * x } else { 1.0 };
//!         Some(DMatrix::from_fn(self.x.len(), 2, |i, j| column(j)(&self.x[i])))
//!     }
//! }
//!
//! let two_sides = Parabola { x: vec![0.0, 1.0, 2.0], y: vec![1.0, 3.0, 9.0] };
//! let found = minimize(&two_sides, Point::vector(&[0.0, 0.0]), &SolverOptions::default())?;
//! assert!((found.state.shared.numbers(0).expect("a vector")[0] - 2.0).abs() < 1e-12);
//!
//! // x and −x give the same measurement: a and b cannot be separated, and neither gets a number.
//! let one_side = Parabola { x: vec![-1.0, 1.0], y: vec![3.0, 3.0] };
//! let found = minimize(&one_side, Point::vector(&[0.0, 0.0]), &SolverOptions::default())?;
//! assert_eq!(found.information.rank(), 1);
//! assert_eq!(found.information.standard_deviations(), [None, None]);
//! # Ok::<(), catoptric_calib::lsq::ProblemError>(())
//! ```

mod elimination;
mod information;
mod linearized;
mod manifold;
mod minimize;
mod prior;
mod problem;
mod qr;
mod trust_region;

pub use information::Information;
pub use linearized::{Linearized, Reduced, linearize};
pub use manifold::{ParameterBlock, Point};
pub use minimize::{Solution, SolverOptions, Termination, minimize};
pub use prior::{Prior, WithPriors};
pub use problem::{GroupJacobian, GroupRows, GroupedResiduals, ProblemError, Residuals, State};
pub use qr::PivotedQr;
