//! Problems of Moré, Garbow, Hillstrom (1981), from their starts and from starts 10 and 100 times as far.

use super::duals::{ByDuals, Formula};
use catoptric_calib::lsq::{Point, Solution, SolverOptions, Termination, minimize};
use num_dual::DualNumCopy;

pub(super) struct Rosenbrock;
pub(super) struct PowellSingular;
pub(super) struct HelicalValley;
pub(super) struct KowalikOsborne;
pub(super) struct Meyer;
pub(super) struct FreudensteinRoth;
pub(super) struct Bard;
pub(super) struct BrownDennis;
pub(super) struct Jennrich;
pub(super) struct BrownBadlyScaled;

impl Formula for Rosenbrock {
    fn residuals<D: DualNumCopy<Primitive = f64>>(&self, x: &[D]) -> Vec<D> {
        vec![(x[1] - x[0] * x[0]) * 10.0, -x[0] + 1.0]
    }
}

impl Formula for PowellSingular {
    fn residuals<D: DualNumCopy<Primitive = f64>>(&self, x: &[D]) -> Vec<D> {
        let (a, b) = (x[1] - x[2] * 2.0, x[0] - x[3]);
        vec![
            x[0] + x[1] * 10.0,
            (x[2] - x[3]) * 5.0_f64.sqrt(),
            a * a,
            b * b * 10.0_f64.sqrt(),
        ]
    }
}

impl Formula for HelicalValley {
    fn residuals<D: DualNumCopy<Primitive = f64>>(&self, x: &[D]) -> Vec<D> {
        let turn = x[1].atan2(x[0]) / std::f64::consts::TAU;
        let turn = if turn.re() < -0.25 { turn + 1.0 } else { turn };
        let radius = (x[0] * x[0] + x[1] * x[1]).sqrt();
        vec![(x[2] - turn * 10.0) * 10.0, (radius - 1.0) * 10.0, x[2]]
    }
}

impl Formula for KowalikOsborne {
    fn residuals<D: DualNumCopy<Primitive = f64>>(&self, x: &[D]) -> Vec<D> {
        const Y: [f64; 11] = [
            0.1957, 0.1947, 0.1735, 0.1600, 0.0844, 0.0627, 0.0456, 0.0342, 0.0323, 0.0235, 0.0246,
        ];
        const U: [f64; 11] = [
            4.0, 2.0, 1.0, 0.5, 0.25, 0.167, 0.125, 0.1, 0.0833, 0.0714, 0.0625,
        ];
        Y.iter()
            .zip(U)
            .map(|(y, u)| -x[0] * (x[1] * u + u * u) / (x[2] * u + x[3] + u * u) + *y)
            .collect()
    }
}

impl Formula for Meyer {
    fn residuals<D: DualNumCopy<Primitive = f64>>(&self, x: &[D]) -> Vec<D> {
        const Y: [f64; 16] = [
            34780.0, 28610.0, 23650.0, 19630.0, 16370.0, 13720.0, 11540.0, 9744.0, 8261.0, 7030.0, 6005.0,
            5147.0, 4427.0, 3820.0, 3307.0, 2872.0,
        ];
        (1..=16)
            .zip(Y)
            .map(|(i, y)| x[0] * (x[1] / (x[2] + (45.0 + 5.0 * f64::from(i)))).exp() - y)
            .collect()
    }
}

impl Formula for FreudensteinRoth {
    fn residuals<D: DualNumCopy<Primitive = f64>>(&self, x: &[D]) -> Vec<D> {
        let y = x[1];
        vec![
            x[0] + ((-y + 5.0) * y - 2.0) * y - 13.0,
            x[0] + ((y + 1.0) * y - 14.0) * y - 29.0,
        ]
    }
}

impl Formula for Bard {
    fn residuals<D: DualNumCopy<Primitive = f64>>(&self, x: &[D]) -> Vec<D> {
        const Y: [f64; 15] = [
            0.14, 0.18, 0.22, 0.25, 0.29, 0.32, 0.35, 0.39, 0.37, 0.58, 0.73, 0.96, 1.34, 2.10, 4.39,
        ];
        (1..=15)
            .zip(Y)
            .map(|(i, y)| {
                let (u, v) = (f64::from(i), f64::from(16 - i));
                -(x[0] + (x[1] * v + x[2] * u.min(v)).recip() * u) + y
            })
            .collect()
    }
}

impl Formula for BrownDennis {
    fn residuals<D: DualNumCopy<Primitive = f64>>(&self, x: &[D]) -> Vec<D> {
        (1..=20)
            .map(|i| {
                let t = f64::from(i) / 5.0;
                let a = x[0] + x[1] * t - libm::exp(t);
                let b = x[2] + x[3] * libm::sin(t) - libm::cos(t);
                a * a + b * b
            })
            .collect()
    }
}

impl Formula for Jennrich {
    fn residuals<D: DualNumCopy<Primitive = f64>>(&self, x: &[D]) -> Vec<D> {
        (1..=10)
            .map(|i| {
                let i = f64::from(i);
                -((x[0] * i).exp() + (x[1] * i).exp()) + (2.0 + 2.0 * i)
            })
            .collect()
    }
}

impl Formula for BrownBadlyScaled {
    fn residuals<D: DualNumCopy<Primitive = f64>>(&self, x: &[D]) -> Vec<D> {
        vec![x[0] - 1e6, x[1] - 2e-6, x[0] * x[1] - 2.0]
    }
}

pub(super) fn solve<F: Formula>(formula: F, start: &[f64]) -> Solution {
    minimize(&ByDuals(formula), Point::vector(start), &SolverOptions::default())
        .expect("the residuals are defined")
}

fn values(solution: &Solution) -> &[f64] {
    solution.state.shared.numbers(0).expect("numbers").as_slice()
}

fn close(found: &[f64], expected: &[f64], tolerance: f64) -> bool {
    found
        .iter()
        .zip(expected)
        .all(|(f, e)| (f - e).abs() <= tolerance)
}

pub(super) fn far(start: &[f64]) -> impl Iterator<Item = Vec<f64>> {
    [1.0, 10.0, 100.0]
        .into_iter()
        .map(|factor| start.iter().map(|x| x * factor).collect())
}

#[test]
fn zero_residuals_are_reached_from_far_away() {
    for start in far(&[-1.2, 1.0]) {
        let found = solve(Rosenbrock, &start);
        assert!(close(values(&found), &[1.0, 1.0], 1e-12), "{start:?}: {found:?}");
    }
    for start in far(&[-1.0, 0.0, 0.0]) {
        let found = solve(HelicalValley, &start);
        assert!(
            close(values(&found), &[1.0, 0.0, 0.0], 1e-12),
            "{start:?}: {found:?}"
        );
    }
    let found = solve(BrownBadlyScaled, &[1.0, 1.0]);
    assert!((values(&found)[0] / 1e6 - 1.0).abs() < 1e-12 && (values(&found)[1] / 2e-6 - 1.0).abs() < 1e-9);
}

#[test]
fn a_singular_minimum_is_reached_and_reported_as_singular() {
    for start in far(&[3.0, -1.0, 0.0, 1.0]) {
        let found = solve(PowellSingular, &start);
        assert!(
            found.stop.converged() && close(values(&found), &[0.0; 4], 1e-4),
            "{start:?}: {found:?}"
        );
        assert!(found.sum_of_squares < 1e-15);
    }
    // At the minimum itself the two squares have no slope.
    let found = solve(PowellSingular, &[0.0; 4]);
    assert_eq!((found.stop, found.information.rank()), (Termination::Gradient, 2));
    assert_eq!(found.information.standard_deviations(), [None; 4]);
}

#[test]
fn residual_sums_are_the_published_ones() {
    // Problems 15, 10, 8, 16 and 6 of Moré, Garbow, Hillstrom.
    let near = |found: &Solution, sum: f64| (found.sum_of_squares / sum - 1.0).abs() < 5e-6;
    assert!(near(
        &solve(KowalikOsborne, &[0.25, 0.39, 0.415, 0.39]),
        3.07505e-4
    ));
    assert!(near(&solve(Meyer, &[0.02, 4000.0, 250.0]), 87.9458));
    assert!(near(&solve(Bard, &[1.0, 1.0, 1.0]), 8.21487e-3));
    for start in far(&[25.0, 5.0, -5.0, -1.0]) {
        assert!(near(&solve(BrownDennis, &start), 85822.2));
    }
    let found = solve(Jennrich, &[0.3, 0.4]);
    assert!(near(&found, 124.362) && close(values(&found), &[0.257825, 0.257825], 1e-6));
}

#[test]
fn a_local_minimum_has_a_perpendicular_residual() {
    // Problem 2: from (0.5, −2) the minimum is 48.9842 at (11.4127…, −0.8968…), not 0 at (5, 4).
    let found = solve(FreudensteinRoth, &[0.5, -2.0]);
    assert!((found.sum_of_squares / 48.9842 - 1.0).abs() < 1e-5, "{found:?}");
    assert!(found.gradient_cosine < 1e-6);
    let found = solve(FreudensteinRoth, &[6.0, 5.0]);
    assert!(close(values(&found), &[5.0, 4.0], 1e-10));
}

#[test]
fn the_limit_is_reported() {
    let options = SolverOptions {
        max_evaluations: 3,
        ..SolverOptions::default()
    };
    let found = minimize(&ByDuals(Rosenbrock), Point::vector(&[-1.2, 1.0]), &options)
        .expect("the residuals are defined");
    assert_eq!((found.stop, found.evaluations), (Termination::Limit, 3));
    assert!(!found.stop.converged() && found.gradient_cosine > 1e-3);
}

#[test]
fn units_change_nothing() {
    struct Rescaled;
    impl Formula for Rescaled {
        fn residuals<D: DualNumCopy<Primitive = f64>>(&self, x: &[D]) -> Vec<D> {
            // Powers of two, so that rounding is the same.
            KowalikOsborne.residuals(&[x[0] * 1024.0, x[1] * 0.125, x[2], x[3] * 4096.0])
        }
    }
    let found = solve(KowalikOsborne, &[0.25, 0.39, 0.415, 0.39]);
    let scaled = solve(Rescaled, &[0.25 / 1024.0, 0.39 * 8.0, 0.415, 0.39 / 4096.0]);
    assert_eq!(found.evaluations, scaled.evaluations);
    let back = [1024.0, 0.125, 1.0, 4096.0];
    for ((f, s), factor) in values(&found).iter().zip(values(&scaled)).zip(back) {
        assert!((f - s * factor).abs() < 1e-13);
    }
}
