//! Tests the beliefs by the residuals: global test, variance components, correlations, flatness of the facets.
//!
//! A kind of error with prior u ~ N(0, 1) and posterior covariance C has, by restricted maximum likelihood, (σ̂/σ)² =
//! Σû²/Σ(1 − C_uu): a parameter that the readings determine counts fully, one that they do not determine counts zero.
//! The standard deviation of σ̂ is σ̂/√(2Σ(1 − C_uu)).

use super::answer::Answer;
use super::fit::JointFit;
use super::group::{BOARD_ERRORS, FACET_PARAMETERS};
use super::problem::Joint;
use crate::lsq::Solution;
use catoptric_model::assessment::{
    ChiSquaredTest, LargestResidual, Planeness, SharedParameter, VarianceComponent,
};
use catoptric_model::{Assessment, Dataset, Session};
use nalgebra::DMatrix;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Significance level below which beliefs are called wrong.
const DOUBTFUL: f64 = 1e-4;

/// Effective number of parameters of one kind that the readings must determine before a size is reported.
const MIN_DETERMINED: f64 = 0.5;

/// Probability of a χ² at least as large.
pub(super) fn upper_tail(chi_squared: f64, freedom: f64) -> f64 {
    ChiSquared::new(freedom).map_or(1.0, |d| d.sf(chi_squared.max(0.0)))
}

impl Joint<'_> {
    /// The assessment of a solution.
    pub(super) fn assess(&self, dataset: &Dataset, fit: &JointFit, answers: &[Answer]) -> Assessment {
        let (session, solution) = (&dataset.session, &fit.solution);
        let (tests, doubts) = self.doubts(dataset, solution, answers);
        let freedom = solution.degrees_of_freedom();
        let global_test = ChiSquaredTest {
            chi_squared: solution.sum_of_squares,
            degrees_of_freedom: freedom,
            p_value: upper_tail(solution.sum_of_squares, freedom as f64),
        };
        let planeness = Planeness {
            figure_deg: self.flatness.figure.to_degrees(),
            departure_deg: self.flatness.tau.to_degrees(),
            statistic: fit.deviation_statistic,
            // Both sizes are at the boundary of their domain under the hypothesis: each is estimated as 0 half of the
            // time.
            p_value: if fit.deviation_statistic > 0.0 {
                0.5 * upper_tail(fit.deviation_statistic, 1.0)
                    + 0.25 * upper_tail(fit.deviation_statistic, 2.0)
            } else {
                1.0
            },
        };
        let (parameters, correlations) = self.shared_parameters(solution);
        let mut assessment = Assessment {
            verdict: String::new(),
            global_test,
            planeness,
            variance_components: self.components(session, solution, answers),
            parameters,
            correlations,
            open: self.open(session, solution),
            largest_residual: largest(answers),
            held_out: None,
            tests,
            doubts,
        };
        assessment.verdict = verdict(&assessment);
        assessment
    }

    fn component(
        &self,
        solution: &Solution,
        name: &str,
        believed: f64,
        parameters: &[(usize, f64)],
    ) -> VarianceComponent {
        let (mut squares, mut determined) = (0.0, 0.0);
        for (index, value) in parameters {
            if let Some(c) = solution.information.covariance_among(&[*index]) {
                squares += value * value;
                determined += 1.0 - c[(0, 0)].min(1.0);
            }
        }
        let found =
            (determined > MIN_DETERMINED && believed > 0.0).then(|| believed * (squares / determined).sqrt());
        VarianceComponent {
            name: name.to_owned(),
            believed_mm: believed,
            found_mm: found,
            found_sd_mm: found.map(|f| f / (2.0 * determined).sqrt()),
        }
    }

    fn components(
        &self,
        session: &Session,
        solution: &Solution,
        answers: &[Answer],
    ) -> Vec<VarianceComponent> {
        let (mut drifts, mut markers) = (Vec::new(), Vec::new());
        for (number, group) in self.groups.iter().enumerate() {
            let first = self.offset(number) + group.board_column(0);
            let Some(errors) = self.board_errors(group, solution.state.own(number)) else {
                continue;
            };
            for (i, value) in errors.iter().enumerate() {
                let of = if i % BOARD_ERRORS == 0 {
                    &mut drifts
                } else {
                    &mut markers
                };
                of.push((first + i, *value));
            }
        }
        let believed = &session.believed;
        // Noise: residual sum of squares of the means, over their number minus what the estimate has absorbed of them.
        let seen = || answers.iter().flat_map(|a| &a.seen);
        let squares: f64 = seen().map(|s| s.residual * s.residual).sum();
        let means = seen().count();
        let taken: f64 = seen().filter_map(|s| s.fitted).sum();
        let left = means as f64 - taken;
        let noise = (left > MIN_DETERMINED).then(|| believed.range_noise_sd_mm * (squares / left).sqrt());
        vec![
            VarianceComponent {
                name: "noise of a reading".to_owned(),
                believed_mm: believed.range_noise_sd_mm,
                found_mm: noise,
                found_sd_mm: noise.map(|n| n / (2.0 * left).sqrt()),
            },
            self.component(solution, "drift of a pose", believed.drift_sd_mm, &drifts),
            self.component(solution, "marker of a board", believed.marker_sd_mm, &markers),
        ]
    }

    fn shared_parameters(&self, solution: &Solution) -> (Vec<SharedParameter>, Vec<Vec<f64>>) {
        let Some(w) = solution.state.shared.numbers(0) else {
            return (Vec::new(), Vec::new());
        };
        // Motions of the mounting about the drawn one, in millimeters and degrees, then the biases.
        let axes = ["x", "y", "z"];
        let mut names: Vec<(String, f64)> = Vec::new();
        for (axis, name) in axes.iter().enumerate() {
            let unit = 1e3 * self.mounting.motion[(axis, axis)];
            names.push((format!("sensor shifted along {name} (mm)"), unit));
        }
        for (axis, name) in axes.iter().enumerate() {
            let unit = self.mounting.motion[(3 + axis, 3 + axis)].to_degrees();
            names.push((format!("sensor turned about {name} (deg)"), unit));
        }
        names.extend(self.common.named());
        if let (Some(_), Some(glass)) = (self.glass_column(), self.glass) {
            names.push(("thickness of the glass (mm)".to_owned(), glass.thickness_sd_mm));
        }
        debug_assert_eq!(names.len(), w.len());
        // A parameter believed to be known exactly is not estimated.
        let estimated: Vec<usize> = (0..w.len()).filter(|i| names[*i].1 > 1e-6).collect();
        let Some(c) = solution.information.covariance_among(&estimated) else {
            return (Vec::new(), Vec::new());
        };
        let parameters = estimated
            .iter()
            .enumerate()
            .map(|(place, i)| SharedParameter {
                name: names[*i].0.clone(),
                change: (w[*i] - self.prior_mean[*i]) * names[*i].1,
                believed_sd: names[*i].1,
                sd: c[(place, place)].max(0.0).sqrt() * names[*i].1,
            })
            .collect();
        (parameters, correlation(&c))
    }

    /// Facets whose planes the boards do not determine.
    fn open(&self, session: &Session, solution: &Solution) -> Vec<String> {
        let mut all = Vec::new();
        for (number, group) in self.groups.iter().enumerate() {
            for (i, facet) in group.facets.iter().enumerate() {
                let first = self.offset(number) + i * FACET_PARAMETERS;
                if solution
                    .information
                    .covariance_among(&[first, first + 1])
                    .is_none()
                {
                    let name = &session.facets[facet.facet].name;
                    let boards = group.boards.len();
                    all.push(format!(
                        "facet {name:?}: its {boards} boards leave a tilt of its plane open; add a board that is tilted \
                         across the others"
                    ));
                }
            }
        }
        all
    }
}

fn correlation(c: &DMatrix<f64>) -> Vec<Vec<f64>> {
    (0..c.nrows())
        .map(|i| {
            (0..c.ncols())
                .map(|j| {
                    if i == j {
                        1.0
                    } else {
                        c[(i, j)] / (c[(i, i)] * c[(j, j)]).sqrt()
                    }
                })
                .collect()
        })
        .collect()
}

fn largest(answers: &[Answer]) -> LargestResidual {
    let mut worst = LargestResidual::default();
    for answer in answers {
        for seen in &answer.seen {
            let studentized = seen.studentized();
            if studentized.abs() > worst.studentized.abs() {
                worst = LargestResidual {
                    studentized,
                    beam: answer.beam,
                    pose: seen.number,
                };
            }
        }
    }
    worst
}

fn verdict(a: &Assessment) -> String {
    let test = &a.global_test;
    let ratio = if test.degrees_of_freedom > 0 {
        (test.chi_squared / test.degrees_of_freedom as f64).sqrt()
    } else {
        1.0
    };
    let mut words = if test.degrees_of_freedom == 0 {
        "no degrees of freedom are left to test the beliefs".to_owned()
    } else if test.p_value < DOUBTFUL {
        format!(
            "residuals are {ratio:.2} times what the believed errors explain: there is an error that the beliefs omit, and \
             the covariances are too small"
        )
    } else if test.p_value > 1.0 - DOUBTFUL {
        format!(
            "residuals are {ratio:.2} times what the believed errors predict: the beliefs are too pessimistic"
        )
    } else {
        "residuals are as large as the believed errors predict".to_owned()
    };
    if a.planeness.p_value < DOUBTFUL {
        words += &format!(
            "; the mirrors are not flat: their normals vary by {:.3}° along the fan, single beams by another {:.3}°",
            a.planeness.figure_deg, a.planeness.departure_deg
        );
    }
    for doubt in &a.doubts {
        words += &format!("; {}", doubt.message);
    }
    words
}
