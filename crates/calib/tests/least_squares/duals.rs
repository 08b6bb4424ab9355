//! Problems written once for numbers and dual numbers, so that the Jacobian is exact.

use catoptric_calib::lsq::{Point, Residuals};
use nalgebra::{DMatrix, DVector};
use num_dual::{Dual64, DualNumCopy};

/// Residuals as a function that is generic over the type of number.
pub(crate) trait Formula: Sync {
    fn residuals<D: DualNumCopy<Primitive = f64>>(&self, b: &[D]) -> Vec<D>;
}

/// A formula of the numbers in block 0.
pub(crate) struct ByDuals<F>(pub(crate) F);

impl<F: Formula> Residuals for ByDuals<F> {
    fn residuals(&self, at: &Point) -> Option<DVector<f64>> {
        Some(DVector::from_vec(self.0.residuals(at.numbers(0)?.as_slice())))
    }

    fn jacobian(&self, at: &Point) -> Option<DMatrix<f64>> {
        let b = at.numbers(0)?;
        let columns: Vec<DVector<f64>> = (0..b.len())
            .map(|varied| {
                let dual: Vec<Dual64> = (0..b.len())
                    .map(|i| Dual64::new(b[i], if i == varied { 1.0 } else { 0.0 }))
                    .collect();
                let f = self.0.residuals(&dual);
                DVector::from_iterator(f.len(), f.iter().map(|d| d.eps))
            })
            .collect();
        Some(DMatrix::from_columns(&columns))
    }
}
