//! NIST's certified problems: 27, each from two starts, parameters and standard deviations to six digits.
//!
//! The only errors of Lanczos1 are those of its printed digits: ‖f‖² = 1.4e-25 is below what parameters in double
//! precision can reach, so its standard deviations are compared with the certified ‖f‖².

use super::duals::{ByDuals, Formula};
use catoptric_calib::lsq::{Point, SolverOptions, minimize};
use num_dual::DualNumCopy;
use std::fs;
use std::path::Path;

/// Digits that must agree: −log₁₀ of the relative error.
const MIN_DIGITS: f64 = 6.0;

const NAMES: [&str; 27] = [
    "Bennett5", "BoxBOD", "Chwirut1", "Chwirut2", "DanWood", "ENSO", "Eckerle4", "Gauss1", "Gauss2",
    "Gauss3", "Hahn1", "Kirby2", "Lanczos1", "Lanczos2", "Lanczos3", "MGH09", "MGH10", "MGH17", "Misra1a",
    "Misra1b", "Misra1c", "Misra1d", "Nelson", "Rat42", "Rat43", "Roszman1", "Thurber",
];

struct Certified {
    name: &'static str,
    starts: [Vec<f64>; 2],
    parameters: Vec<f64>,
    standard_deviations: Vec<f64>,
    sum_of_squares: f64,
    /// y, then the predictors.
    data: Vec<Vec<f64>>,
}

impl Certified {
    fn read(name: &'static str) -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/nist/{name}.dat"));
        let text = fs::read_to_string(path).expect("the problem's file exists");
        let numbers = |line: &str| -> Vec<f64> {
            line.split_whitespace()
                .map(|w| w.parse().expect("a number"))
                .collect()
        };
        let (mut starts, mut parameters, mut standard_deviations) = ([vec![], vec![]], vec![], vec![]);
        let mut sum_of_squares = f64::NAN;
        for line in text.lines() {
            let trimmed = line.trim();
            if let Some((left, right)) = trimmed.split_once('=')
                && left.trim() == format!("b{}", parameters.len() + 1)
            {
                let values = numbers(right);
                starts[0].push(values[0]);
                starts[1].push(values[1]);
                parameters.push(values[2]);
                standard_deviations.push(values[3]);
            }
            if let Some(value) = trimmed.strip_prefix("Residual Sum of Squares:") {
                sum_of_squares = numbers(value)[0];
            }
        }
        let from = text.rfind("\nData:").expect("a table of data");
        let data: Vec<_> = text[from + 1..]
            .lines()
            .skip(1)
            .filter(|l| !l.trim().is_empty())
            .map(numbers)
            .collect();
        let stated = text
            .lines()
            .find_map(|l| l.strip_prefix("Number of Observations:"))
            .expect("the file states the number of observations");
        assert_eq!(
            data.len(),
            stated.trim().parse::<usize>().expect("a number"),
            "{name}"
        );
        Self {
            name,
            starts,
            parameters,
            standard_deviations,
            sum_of_squares,
            data,
        }
    }
}

impl Formula for &Certified {
    fn residuals<D: DualNumCopy<Primitive = f64>>(&self, b: &[D]) -> Vec<D> {
        self.data
            .iter()
            .map(|row| {
                let y = if self.name == "Nelson" {
                    libm::log(row[0])
                } else {
                    row[0]
                };
                model(self.name, b, &row[1..]) - y
            })
            .collect()
    }
}

/// The model as stated in the problem's file.
fn model<D: DualNumCopy<Primitive = f64>>(name: &str, b: &[D], x: &[f64]) -> D {
    let one = D::from(1.0);
    let bell = |height: D, center: D, width: D| {
        let u = (-center + x[0]) / width;
        height * (-(u * u)).exp()
    };
    let wave = |period: D, cosine: D, sine: D| {
        let (s, c) = (period.recip() * (std::f64::consts::TAU * x[0])).sin_cos();
        cosine * c + sine * s
    };
    let cubic = |c: &[D]| c.iter().rev().fold(D::from(0.0), |sum, c| sum * x[0] + *c);
    match name {
        "Bennett5" => b[0] * ((b[1] + x[0]).ln() * (-b[2].recip())).exp(),
        "BoxBOD" | "Misra1a" => b[0] * (one - (-b[1] * x[0]).exp()),
        "Chwirut1" | "Chwirut2" => (-b[0] * x[0]).exp() / (b[1] + b[2] * x[0]),
        "DanWood" => b[0] * (b[1] * libm::log(x[0])).exp(),
        "ENSO" => b[0] + wave(D::from(12.0), b[1], b[2]) + wave(b[3], b[4], b[5]) + wave(b[6], b[7], b[8]),
        "Eckerle4" => {
            let u = (-b[2] + x[0]) / b[1];
            b[0] / b[1] * (u * u * -0.5).exp()
        }
        "Gauss1" | "Gauss2" | "Gauss3" => {
            b[0] * (-b[1] * x[0]).exp() + bell(b[2], b[3], b[4]) + bell(b[5], b[6], b[7])
        }
        "Hahn1" | "Thurber" => cubic(&b[..4]) / cubic(&[one, b[4], b[5], b[6]]),
        "Kirby2" => cubic(&b[..3]) / cubic(&[one, b[3], b[4]]),
        "Lanczos1" | "Lanczos2" | "Lanczos3" => (0..3)
            .map(|i| b[2 * i] * (-b[2 * i + 1] * x[0]).exp())
            .fold(D::from(0.0), |sum, term| sum + term),
        "MGH09" => b[0] * (b[1] * x[0] + x[0] * x[0]) / (b[2] * x[0] + b[3] + x[0] * x[0]),
        "MGH10" => b[0] * (b[1] / (b[2] + x[0])).exp(),
        "MGH17" => b[0] + b[1] * (-b[3] * x[0]).exp() + b[2] * (-b[4] * x[0]).exp(),
        "Misra1b" => b[0] * (one - (b[1] * (0.5 * x[0]) + 1.0).powi(-2)),
        "Misra1c" => b[0] * (one - (b[1] * (2.0 * x[0]) + 1.0).sqrt().recip()),
        "Misra1d" => b[0] * b[1] * x[0] / (b[1] * x[0] + 1.0),
        "Nelson" => b[0] - b[1] * x[0] * (-b[2] * x[1]).exp(),
        "Rat42" => b[0] / ((b[1] - b[2] * x[0]).exp() + 1.0),
        "Rat43" => b[0] / (((b[1] - b[2] * x[0]).exp() + 1.0).ln() / b[3]).exp(),
        "Roszman1" => b[0] - b[1] * x[0] - (b[2] / (-b[3] + x[0])).atan() / std::f64::consts::PI,
        other => panic!("{other} has no model"),
    }
}

/// Number of correct digits of the worst of several numbers; capped at the eleven that are certified.
fn digits(found: &[f64], certified: &[f64]) -> f64 {
    assert_eq!(found.len(), certified.len());
    found
        .iter()
        .zip(certified)
        .map(|(f, c)| -libm::log10(((f - c) / c).abs().max(1e-11)))
        .fold(f64::INFINITY, |least, d| {
            if d.is_nan() {
                f64::NEG_INFINITY
            } else {
                least.min(d)
            }
        })
}

#[test]
fn all_from_both_starts() {
    let mut failures = Vec::new();
    let mut solved = 0;
    for problem in NAMES.map(Certified::read) {
        for (number, start) in problem.starts.iter().enumerate() {
            let found = minimize(
                &ByDuals(&problem),
                Point::vector(start),
                &SolverOptions::default(),
            )
            .expect("the residuals are defined");
            let values = found
                .state
                .shared
                .numbers(0)
                .expect("numbers")
                .as_slice()
                .to_vec();
            let variance = if problem.name == "Lanczos1" {
                assert!(found.sum_of_squares < 1.01 * problem.sum_of_squares);
                problem.sum_of_squares / found.degrees_of_freedom() as f64
            } else {
                found.sum_of_squares / found.degrees_of_freedom() as f64
            };
            let deviations: Vec<f64> = found
                .information
                .standard_deviations()
                .iter()
                .map(|sd| sd.map_or(f64::NAN, |sd| sd * variance.sqrt()))
                .collect();
            let right = digits(&values, &problem.parameters);
            let right_deviations = digits(&deviations, &problem.standard_deviations);
            // ‖f‖² of Lanczos1 is rounding; every other one is as certified.
            let right_sum = digits(&[found.sum_of_squares], &[problem.sum_of_squares]);
            assert!(
                right_sum >= 9.0 || problem.name == "Lanczos1",
                "{}: {right_sum}",
                problem.name
            );
            let enough = right >= MIN_DIGITS && right_deviations >= MIN_DIGITS;
            if enough && found.stop.converged() {
                solved += 1;
            } else {
                failures.push(format!(
                    "{} from start {}: {right:.1} and {right_deviations:.1} digits, {:?} after {} evaluations",
                    problem.name,
                    number + 1,
                    found.stop,
                    found.evaluations
                ));
            }
        }
    }
    assert!(failures.is_empty(), "{solved} of 54 solved, not {failures:?}");
    assert_eq!(solved, 54);
}
