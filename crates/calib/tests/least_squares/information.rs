//! Rank, open directions and covariance, against finite differences and known null spaces.

use super::duals::{ByDuals, Formula};
use catoptric_calib::lsq::{Point, ProblemError, Solution, SolverOptions, minimize};
use nalgebra::{DMatrix, DVector};
use num_dual::DualNumCopy;

/// An exponential fit, in units of the errors.
struct Decay {
    copies: usize,
}

impl Formula for Decay {
    fn residuals<D: DualNumCopy<Primitive = f64>>(&self, b: &[D]) -> Vec<D> {
        (0..8 * self.copies)
            .map(|i| {
                let t = 0.25 * (i % 8) as f64;
                let y = 2.0 * libm::exp(-0.7 * t) + 0.5;
                (b[0] * (-b[1] * t).exp() + b[2] - y) / 0.01
            })
            .collect()
    }
}

/// Two gains of one signal, of which only the product is observed, an offset, and a parameter that is not observed.
struct Gains;

impl Formula for Gains {
    fn residuals<D: DualNumCopy<Primitive = f64>>(&self, b: &[D]) -> Vec<D> {
        (0..6)
            .map(|i| b[0] * b[1] * f64::from(i) + b[2] - (6.0 * f64::from(i) + 1.0) + b[3] * 0.0)
            .collect()
    }
}

fn solve<F: Formula>(formula: F, start: &[f64]) -> Solution {
    minimize(&ByDuals(formula), Point::vector(start), &SolverOptions::default())
        .expect("the residuals are defined")
}

#[test]
fn covariance_is_the_inverse_of_half_the_hessian() {
    let found = solve(Decay { copies: 1 }, &[1.0, 1.0, 0.0]);
    let at = found.state.shared.numbers(0).expect("numbers").clone();
    let half_sum = |x: &DVector<f64>| {
        let f = Decay { copies: 1 }.residuals(x.as_slice());
        0.5 * f.iter().map(|f| f * f).sum::<f64>()
    };
    let h = 1e-4;
    let hessian = DMatrix::from_fn(3, 3, |i, j| {
        let shifted = |a: f64, b: f64| {
            let mut x = at.clone();
            x[i] += a * h;
            x[j] += b * h;
            half_sum(&x)
        };
        (shifted(1.0, 1.0) - shifted(1.0, -1.0) - shifted(-1.0, 1.0) + shifted(-1.0, -1.0)) / (4.0 * h * h)
    });
    let expected = hessian.try_inverse().expect("the matrix is regular");
    let covariance = found.information.covariance().expect("nothing is open");
    assert!((&covariance - &expected).norm() < 1e-4 * expected.norm());
    assert!((&covariance - covariance.transpose()).norm() == 0.0);
    assert!(covariance.symmetric_eigenvalues().min() > 0.0);
    let correlation = covariance[(0, 2)] / (covariance[(0, 0)] * covariance[(2, 2)]).sqrt();
    assert!(correlation < -0.5 && correlation > -1.0);
    let g = DVector::from_vec(vec![1.0, -2.0, 0.5]);
    let direct = (g.transpose() * found.information.covariance().expect("nothing is open") * &g)[0];
    let asked = found
        .information
        .covariance_of(&DMatrix::from_row_slice(1, 3, g.as_slice()))
        .expect("nothing is open");
    assert!((asked[(0, 0)] / direct - 1.0).abs() < 1e-12);
}

#[test]
fn twice_the_data_halve_the_covariance() {
    let covariance = |copies| {
        let found = solve(Decay { copies }, &[1.0, 1.0, 0.0]);
        found.information.covariance().expect("nothing is open")
    };
    let (once, twice) = (covariance(1), covariance(2));
    assert!((&once * 0.5 - twice).norm() < 1e-8 * once.norm());
}

#[test]
fn open_directions_are_named_and_get_no_number() {
    let found = solve(Gains, &[1.0, 1.0, 0.0, 5.0]);
    let information = &found.information;
    let b = found.state.shared.numbers(0).expect("numbers").clone();
    assert!((b[0] * b[1] - 6.0).abs() < 1e-10 && (b[2] - 1.0).abs() < 1e-10);
    assert_eq!(b[3], 5.0, "a parameter that is not observed keeps its value");
    assert_eq!((information.rank(), information.null_space().ncols()), (2, 2));
    let named = information.open_directions(&["sender gain", "receiver gain", "offset", "color"]);
    let names: Vec<Vec<&str>> = named
        .iter()
        .map(|terms| terms.iter().map(|(name, _)| *name).collect())
        .collect();
    assert!(names.contains(&vec!["color"]), "{named:?}");
    let gains = named.iter().find(|terms| terms.len() == 2).expect("the gains");
    // d(b₀b₁) = 0: the direction is (b₀, −b₁), of length 1.
    let expected = b.rows(0, 2).into_owned().normalize();
    for (name, value) in gains {
        let i = usize::from(*name == "receiver gain");
        assert!((value.abs() - expected[i].abs()).abs() < 1e-10, "{named:?}");
    }
    assert!(gains[0].1 > 0.0 && gains[1].1 < 0.0);
    let deviations = information.standard_deviations();
    assert!(deviations[0].is_none() && deviations[1].is_none() && deviations[3].is_none());
    assert!(information.covariance().is_none() && information.covariance_among(&[0, 2]).is_none());
    // The offset of a straight line over 0 … 5: s²(1/6 + 2.5²/17.5).
    let offset = deviations[2].expect("the offset is determined");
    assert!((offset.powi(2) - (1.0 / 6.0 + 6.25 / 17.5)).abs() < 1e-12);
    // The slope b₀b₁ is determined, though neither gain is.
    let slope = DMatrix::from_row_slice(1, 4, &[b[1], b[0], 0.0, 0.0]);
    let variance = information
        .covariance_of(&slope)
        .expect("the product is determined")[(0, 0)];
    assert!((variance - 1.0 / 17.5).abs() < 1e-12);
    let null = information.null_space();
    assert!((null.transpose() * null - DMatrix::identity(2, 2)).norm() < 1e-14);
}

#[test]
fn fewer_residuals_than_parameters_leave_directions_open() {
    struct OneLine;
    impl Formula for OneLine {
        fn residuals<D: DualNumCopy<Primitive = f64>>(&self, b: &[D]) -> Vec<D> {
            vec![b[0] + b[1] * 2.0 - b[2] - 3.0]
        }
    }
    let found = solve(OneLine, &[0.0; 3]);
    assert!(found.sum_of_squares < 1e-28);
    assert_eq!((found.information.rank(), found.degrees_of_freedom()), (1, 0));
    let normal = DVector::from_vec(vec![1.0, 2.0, -1.0]);
    assert!((found.information.null_space().transpose() * &normal).norm() < 1e-14);
    assert!(!found.information.is_open(&normal));
}

#[test]
fn unsolvable_problems_are_errors() {
    struct Undefined;
    impl Formula for Undefined {
        fn residuals<D: DualNumCopy<Primitive = f64>>(&self, b: &[D]) -> Vec<D> {
            vec![b[0].ln()]
        }
    }
    let start = Point::vector(&[-1.0]);
    let found = minimize(&ByDuals(Undefined), start, &SolverOptions::default());
    let undefined = ProblemError::Undefined {
        group: 0,
        place: "start",
    };
    assert_eq!(found, Err(undefined));
    // A step from inside into the undefined region is only shortened.
    let found = minimize(
        &ByDuals(Undefined),
        Point::vector(&[20.0]),
        &SolverOptions::default(),
    );
    let found = found.expect("the start is defined");
    assert!((found.state.shared.numbers(0).expect("numbers")[0] - 1.0).abs() < 1e-12);

    struct Narrow;
    impl catoptric_calib::lsq::Residuals for Narrow {
        fn residuals(&self, _: &Point) -> Option<DVector<f64>> {
            Some(DVector::zeros(2))
        }
        fn jacobian(&self, _: &Point) -> Option<DMatrix<f64>> {
            Some(DMatrix::zeros(2, 1))
        }
    }
    let error = minimize(&Narrow, Point::vector(&[0.0, 0.0]), &SolverOptions::default())
        .expect_err("a column is missing");
    assert_eq!(
        error.to_string(),
        "the Jacobian of group 0 is 2 × 1 for its shared parameters; needed are 2 × 2"
    );
}
