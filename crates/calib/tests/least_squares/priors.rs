//! Priors against closed forms.

use super::sample::Sample;
use catoptric_calib::lsq::{
    ParameterBlock, Point, Prior, Residuals, SolverOptions, State, WithPriors, minimize,
};
use catoptric_model::Pose;
use nalgebra::{DMatrix, DVector, Translation3, Unit, UnitQuaternion, Vector3};

/// Ax − b of the numbers in block 0; other blocks are ignored.
struct Linear {
    a: DMatrix<f64>,
    b: DVector<f64>,
}

impl Residuals for Linear {
    fn residuals(&self, at: &Point) -> Option<DVector<f64>> {
        Some(&self.a * at.numbers(0)? - &self.b)
    }

    fn jacobian(&self, at: &Point) -> Option<DMatrix<f64>> {
        let mut all = DMatrix::zeros(self.a.nrows(), at.dimension());
        all.columns_mut(0, self.a.ncols()).copy_from(&self.a);
        Some(all)
    }
}

#[test]
fn measurements_and_belief_are_weighted_by_their_inverse_covariances() {
    let mut sample = Sample::new(6);
    let a = DMatrix::from_fn(7, 3, |_, _| sample.normal());
    let b = DVector::from_fn(7, |_, _| sample.normal());
    let mean = DVector::from_vec(vec![0.5, -1.0, 2.0]);
    let deviations = [0.7, 0.5, 0.4];
    let inverse = DMatrix::from_diagonal(&DVector::from_fn(3, |i, _| f64::powi(deviations[i], -2)));
    let information = a.transpose() * &a + &inverse;
    let expected = information
        .clone()
        .cholesky()
        .expect("a covariance is positive definite")
        .solve(&(a.transpose() * &b + &inverse * &mean));
    let prior = Prior::independent(0, ParameterBlock::Vector(mean), &deviations);
    let linear = Linear { a, b };
    let problem = WithPriors {
        problem: &linear,
        shared: vec![prior],
        own: Vec::new(),
    };
    let found = minimize(&problem, Point::vector(&[0.0; 3]), &SolverOptions::default())
        .expect("the residuals are defined");
    assert!((found.state.shared.numbers(0).expect("numbers") - expected).norm() < 1e-13);
    let covariance = found.information.covariance().expect("nothing is open");
    assert!((covariance * information - DMatrix::identity(3, 3)).norm() < 1e-13);
}

#[test]
fn blocks_with_only_a_prior_take_its_mean_and_covariance() {
    let mut sample = Sample::new(7);
    let mut vector = || Vector3::new(sample.normal(), sample.normal(), sample.normal());
    let direction = ParameterBlock::Direction(Unit::new_normalize(vector()));
    let turn = UnitQuaternion::from_scaled_axis(vector() * 0.7);
    let pose = ParameterBlock::Pose(Pose::from_parts(Translation3::from(vector()), turn));
    let linear = Linear {
        a: DMatrix::identity(1, 1),
        b: DVector::from_vec(vec![3.0]),
    };
    let deviations = [0.1, 0.2, 0.3, 0.01, 0.02, 0.03];
    let problem = WithPriors {
        problem: &linear,
        shared: vec![
            Prior::independent(1, direction.clone(), &deviations[..2]),
            Prior::independent(2, pose.clone(), &deviations),
        ],
        own: Vec::new(),
    };
    let start = Point {
        blocks: vec![
            ParameterBlock::Vector(DVector::zeros(1)),
            direction.retract(&[0.9, -1.4]),
            pose.retract(&[1.0, 2.0, 3.0, 0.5, -1.0, 1.0]),
        ],
    };
    let found =
        minimize(&problem, State::from(start), &SolverOptions::default()).expect("the residuals are defined");
    let blocks = &found.state.shared.blocks;
    assert!(direction.difference(&blocks[1]).norm() < 1e-12);
    assert!(pose.difference(&blocks[2]).norm() < 1e-12);
    let expected = [1.0].iter().chain(&deviations[..2]).chain(&deviations);
    for (sd, expected) in found.information.standard_deviations().iter().zip(expected) {
        assert!((sd.expect("the prior determines the parameter") / expected - 1.0).abs() < 1e-11);
    }
}
