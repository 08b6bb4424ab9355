//! Robust fits with and without outliers, on samples of a fixed generator.

use super::duals::{ByDuals, Formula};
use super::sample::Sample;
use catoptric_calib::lsq::{
    Block, Loss, Options, Point, Prior, RobustOptions, RobustSolution, Surrogate, WithPriors, gate, minimize,
    minimize_graduated, minimize_robust,
};
use nalgebra::DVector;
use num_dual::DualNumCopy;

const TRUTH: [f64; 3] = [2.0, 0.7, 0.5];
const NOISE_SD: f64 = 0.01;
const READINGS: usize = 400;

/// A decay read with noise, some readings grossly wrong; residuals in units of the noise.
struct Decay {
    t: Vec<f64>,
    y: Vec<f64>,
    wrong: Vec<bool>,
}

impl Decay {
    /// Errors of 20 to 200 standard deviations, all to one side, as of rays that meet something nearer.
    fn sampled(outliers: f64, sample: &mut Sample) -> Self {
        let (mut t, mut y, mut wrong) = (Vec::new(), Vec::new(), Vec::new());
        for i in 0..READINGS {
            t.push(3.0 * i as f64 / READINGS as f64);
            let good = TRUTH[0] * libm::exp(-TRUTH[1] * t[i]) + TRUTH[2] + NOISE_SD * sample.normal();
            // Drawn whether used or not, so that samples with and without outliers share their noise.
            let (chance, size) = (sample.uniform(), 20.0 + 180.0 * sample.uniform());
            wrong.push(chance < outliers);
            y.push(if wrong[i] { good - size * NOISE_SD } else { good });
        }
        Self { t, y, wrong }
    }
}

impl Formula for &Decay {
    fn residuals<D: DualNumCopy<Primitive = f64>>(&self, b: &[D]) -> Vec<D> {
        self.t
            .iter()
            .zip(&self.y)
            .map(|(t, y)| (b[0] * (-b[1] * *t).exp() + b[2] - *y) / NOISE_SD)
            .collect()
    }
}

fn start() -> Point {
    Point::vector(&[1.0, 1.0, 0.0])
}

/// Squared error of the curve's parameters in units of their standard deviations without outliers.
fn squared_error(found: &Point, reference: &[f64; 3]) -> f64 {
    let values = found.numbers(0).expect("numbers");
    (0..3)
        .map(|i| ((values[i] - TRUTH[i]) / reference[i]).powi(2))
        .sum()
}

type Fit = fn(&Decay) -> RobustSolution;

fn by_loss(decay: &Decay, loss: Loss) -> RobustSolution {
    minimize_robust(&ByDuals(decay), start(), loss, &RobustOptions::default()).expect("it is defined")
}

fn graduated(decay: &Decay, surrogate: Surrogate) -> RobustSolution {
    let options = RobustOptions::default();
    minimize_graduated(&ByDuals(decay), start(), surrogate, gate(0.999), &options).expect("it is defined")
}

const TUKEY: Fit = |d| by_loss(d, Loss::tukey());
const CAUCHY: Fit = |d| by_loss(d, Loss::cauchy());
const HUBER: Fit = |d| by_loss(d, Loss::huber());
const TRUNCATED: Fit = |d| graduated(d, Surrogate::TruncatedSquares);
const GEMAN_MC_CLURE: Fit = |d| graduated(d, Surrogate::GemanMcClure);

#[test]
fn fifteen_in_a_hundred_outliers_cost_less_than_a_tenth() {
    // Root-mean-square over samples against the plain fit of the good readings of the same samples.
    let reference = {
        let clean = Decay::sampled(0.0, &mut Sample::new(0));
        let found = minimize(&ByDuals(&clean), start(), &Options::default()).expect("it is defined");
        let sd = found.information.standard_deviations();
        [0, 1, 2].map(|i| sd[i].expect("nothing is open"))
    };
    let samples = 60;
    for (name, fit) in [
        ("Tukey", TUKEY),
        ("truncated", TRUNCATED),
        ("Geman–McClure", GEMAN_MC_CLURE),
        ("Cauchy", CAUCHY),
    ] {
        let (mut robust, mut ideal, mut spoiled) = (0.0, 0.0, 0.0);
        for seed in 0..samples {
            let decay = Decay::sampled(0.15, &mut Sample::new(1000 + seed));
            let found = fit(&decay);
            assert!(found.settled, "{name} {seed}: {} rounds", found.rounds);
            robust += squared_error(&found.solution.state.shared, &reference);
            let good: Vec<usize> = (0..READINGS).filter(|i| !decay.wrong[*i]).collect();
            let only_good = Decay {
                t: good.iter().map(|i| decay.t[*i]).collect(),
                y: good.iter().map(|i| decay.y[*i]).collect(),
                wrong: vec![false; good.len()],
            };
            for (problem, sum) in [(&only_good, &mut ideal), (&decay, &mut spoiled)] {
                let plain = minimize(&ByDuals(problem), start(), &Options::default()).expect("it is defined");
                *sum += squared_error(&plain.state.shared, &reference);
            }
        }
        let (cost, damage) = ((robust / ideal).sqrt(), (spoiled / ideal).sqrt());
        assert!(cost < 1.1, "{name}: {cost}");
        assert!(damage > 20.0, "the outliers must be gross: {damage}");
    }
}

#[test]
fn without_outliers_robust_fits_are_nearly_the_plain_one() {
    let decay = Decay::sampled(0.0, &mut Sample::new(3));
    let plain = minimize(&ByDuals(&decay), start(), &Options::default()).expect("it is defined");
    let sd = plain.information.standard_deviations();
    let plain = plain.state.shared.numbers(0).expect("numbers").clone();
    for (name, fit) in [
        ("Huber", HUBER),
        ("Tukey", TUKEY),
        ("Cauchy", CAUCHY),
        ("truncated", TRUNCATED),
    ] {
        let found = fit(&decay);
        assert!(found.settled);
        let values = found.solution.state.shared.numbers(0).expect("numbers");
        for i in 0..3 {
            let apart = ((values[i] - plain[i]) / sd[i].expect("nothing is open")).abs();
            // 95 % efficiency means a difference of √(1/0.95 − 1) = 0.23 standard deviations.
            assert!(apart < 0.7, "{name} {i}: {apart}");
            // Truncated squares differ only if a residual lies beyond the gate.
            assert!(apart > 1e-6 || name == "truncated", "{name} {i}: {apart}");
        }
    }
    // With a gate that no residual reaches the graduated fit is the plain one.
    let options = RobustOptions::default();
    let found = minimize_graduated(
        &ByDuals(&decay),
        start(),
        Surrogate::TruncatedSquares,
        10.0,
        &options,
    )
    .expect("it is defined");
    assert_eq!(found.rounds, 1);
    assert!((found.solution.state.shared.numbers(0).expect("numbers") - plain).norm() < 1e-9);
}

#[test]
fn truncated_squares_name_the_outliers() {
    let decay = Decay::sampled(0.15, &mut Sample::new(4));
    let found = TRUNCATED(&decay);
    let weights = &found.weights[0];
    let mut rejected = 0;
    for (i, wrong) in decay.wrong.iter().enumerate() {
        assert!(weights[i] == 0.0 || weights[i] == 1.0);
        assert!(!wrong || weights[i] == 0.0, "reading {i} is wrong");
        rejected += usize::from(!wrong && weights[i] == 0.0);
    }
    // One in a thousand good readings lies beyond the gate.
    assert!(rejected <= 3, "{rejected}");
    let inside: Vec<f64> = found.residuals[0].iter().map(|r| r.abs()).collect();
    assert!(
        inside
            .iter()
            .zip(weights.iter())
            .all(|(r, w)| (*r < found.scale) == (*w == 1.0))
    );
}

#[test]
fn priors_are_never_doubted() {
    // A belief far from the data: a robust loss may not discard it.
    let decay = Decay::sampled(0.0, &mut Sample::new(5));
    let problem = ByDuals(&decay);
    let belief = DVector::from_vec(vec![2.0, 0.7, 5.0]);
    let with_prior = WithPriors {
        problem: &problem,
        shared: vec![Prior::independent(0, Block::Vector(belief), &[1.0, 1.0, 1e-9])],
        own: Vec::new(),
    };
    let found = minimize_robust(&with_prior, start(), Loss::tukey(), &RobustOptions::default())
        .expect("it is defined");
    assert!((found.solution.state.shared.numbers(0).expect("numbers")[2] - 5.0).abs() < 1e-6);
    assert!(found.weights[1].iter().all(|w| *w == 1.0));
}

#[test]
fn the_scale_is_found_where_the_noise_is_not_known() {
    // Residuals in units that are a hundred times too small.
    let decay = Decay::sampled(0.15, &mut Sample::new(6));
    let options = RobustOptions {
        least_scale: 1e-6,
        ..RobustOptions::default()
    };
    let found = minimize_robust(&ByDuals(&decay), start(), Loss::tukey(), &options).expect("it is defined");
    // The median of all readings, 15 % of which are far: Φ⁻¹((1 + 0.5/0.85)/2)/0.6745 = 1.21 standard deviations.
    assert!((found.scale - 1.21).abs() < 0.15, "{}", found.scale);
}
