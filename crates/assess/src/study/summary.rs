//! Statistics over the runs of each contestant in each cell.

use super::statistics::{bias_p_value, clopper_pearson, mean_bounds};
use super::{Run, SCHEMA_VERSION, Study};
use crate::requirement::{Requirement, RequirementError, numbers};
use serde::Serialize;
use std::collections::BTreeMap;

/// Probability of the bounds on ANEES.
const PROBABILITY: f64 = 0.999;

/// Result of a study: `study.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Version of this format.
    pub schema_version: u32,
    /// Number of seeds per cell.
    pub seeds: u64,
    /// One entry per contestant and cell.
    pub methods: Vec<MethodSummary>,
}

/// Statistics of a contestant in a cell. A figure that does not exist is NaN here and `null` in JSON.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MethodSummary {
    /// Name of the contestant.
    pub method: String,
    /// Values of the axes.
    pub axes: BTreeMap<String, String>,
    /// Number of experiments.
    pub runs: usize,
    /// Number of experiments without a calibration.
    pub failed: usize,
    /// Number of experiments whose calibration warns of something.
    pub warned: usize,
    /// Why the first of them has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
    /// Deflected elements that were solved, mean over the runs.
    pub solved: f64,
    /// Deflected elements that abstained, mean over the runs.
    pub abstained: f64,
    /// Deflected elements that were missed, mean over the runs.
    pub missed: f64,
    /// Other elements that were solved by mistake, mean over the runs.
    #[serde(rename = "false")]
    pub wrong: f64,
    /// Root mean square per-axis error, in degrees.
    pub per_axis_rms_deg: f64,
    /// Median of the per-axis error over the runs, in degrees.
    pub per_axis_median_deg: f64,
    /// Same as `per_axis_rms_deg`, in the room frame.
    pub per_axis_rms_room_deg: f64,
    /// Limit on `per_axis_rms_deg`, in degrees.
    pub crlb_per_axis_deg: f64,
    /// 1 / mean(error²/limit²) over the runs: 1 is optimal.
    pub efficiency: f64,
    /// Its standard error.
    pub efficiency_se: f64,
    /// Mean eᵀP⁻¹e/2 of one element per run: 1 if the covariance is honest.
    pub anees: f64,
    /// 99.9 % bounds of `anees` for an honest covariance.
    pub anees_bounds: [f64; 2],
    /// Share of the same elements inside their 68 % ellipses.
    pub coverage_68: f64,
    /// Its 95 % interval of Clopper and Pearson.
    pub coverage_68_interval: [f64; 2],
    /// Share of the same elements inside their 95 % ellipses.
    pub coverage_95: f64,
    /// Its 95 % interval of Clopper and Pearson.
    pub coverage_95_interval: [f64; 2],
    /// Share of the same elements inside their 99 % ellipses.
    pub coverage_99: f64,
    /// Its 95 % interval of Clopper and Pearson.
    pub coverage_99_interval: [f64; 2],
    /// Probability of a mean error at least as large without bias.
    pub bias_p_value: f64,
    /// Mean duration of a calibration, in milliseconds, if measured; never in `study.json`, whose bytes are reproducible.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ms_per_calibration: Option<f64>,
    /// Verdict on the honesty of its covariance.
    pub verdict: String,
    /// Figures that do not exist, and why.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub nulls: BTreeMap<&'static str, &'static str>,
}

impl MethodSummary {
    /// Its name, with the values of the axes.
    pub fn label(&self) -> String {
        let values = self.axes.iter().map(|(key, value)| format!("{key} = {value}"));
        let values: Vec<String> = values.collect();
        if values.is_empty() {
            self.method.clone()
        } else {
            format!("{} ({})", self.method, values.join(", "))
        }
    }
}

impl Summary {
    /// Why a study is not good enough: the contestants that have no calibration in any run or solved nothing, and the
    /// requirements that are not met, each with the [label](MethodSummary::label) of its contestant.
    ///
    /// # Errors
    /// [`RequirementError::Unknown`] if a requirement names no figure of a contestant.
    pub fn reasons(&self, requirements: &[Requirement]) -> Result<Vec<(String, String)>, RequirementError> {
        let mut reasons = Vec::new();
        for m in &self.methods {
            let label = m.label();
            if m.runs > 0 && m.failed == m.runs {
                let why = m.failure.as_deref().unwrap_or("no run has a calibration");
                reasons.push((
                    label.clone(),
                    format!("{label} failed in all {} runs: {why}", m.runs),
                ));
            } else if m.runs > 0 && m.solved == 0.0 {
                reasons.push((label.clone(), format!("{label} solved nothing in any run")));
            }
            let value = serde_json::to_value(m).unwrap_or_default();
            let figures = numbers(&value, &["axes", "nulls"]);
            for requirement in requirements {
                let unmet = requirement.judge_figures(
                    &label,
                    &figures,
                    "per_axis_rms_deg, anees, coverage_95, failed, warned",
                )?;
                reasons.extend(unmet.into_iter().map(|u| (label.clone(), u.to_string())));
            }
        }
        Ok(reasons)
    }
}

/// Summarizes runs, which must be in the order of the study's jobs and contestants.
pub fn summarize(study: &Study, runs: &[Run]) -> Summary {
    let mut methods = Vec::new();
    for (index, cell) in study.cells.iter().enumerate() {
        for contestant in &study.contestants {
            let name = contestant.name();
            let of_one: Vec<&Run> = runs
                .iter()
                .filter(|r| r.cell == index && r.method == name)
                .collect();
            let axes = cell.values.iter().cloned().collect();
            methods.push(summary(name, axes, &of_one));
        }
    }
    Summary {
        schema_version: SCHEMA_VERSION,
        seeds: study.seeds,
        methods,
    }
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), v| (sum + v, count + 1.0));
    sum / count
}

fn summary(method: String, axes: BTreeMap<String, String>, runs: &[&Run]) -> MethodSummary {
    let count = |of: fn(&Run) -> usize| mean(runs.iter().map(|r| of(r) as f64));
    let solved: Vec<&&Run> = runs.iter().filter(|r| r.square.is_finite()).collect();
    let root = |of: fn(&Run) -> f64| {
        mean(solved.iter().map(|r| of(r)).filter(|v| v.is_finite()))
            .sqrt()
            .to_degrees()
    };
    let ratios: Vec<f64> = solved
        .iter()
        .map(|r| r.square / r.bound_square)
        .filter(|v| v.is_finite())
        .collect();
    let ratio = mean(ratios.iter().copied());
    let scatter = mean(ratios.iter().map(|r| (r - ratio).powi(2)));
    let mut errors: Vec<f64> = solved.iter().map(|r| r.square.sqrt().to_degrees()).collect();
    errors.sort_by(f64::total_cmp);
    // An infinite value counts: its covariance rules out the actual error.
    let squares: Vec<f64> = solved
        .iter()
        .map(|r| r.mahalanobis_squared)
        .filter(|v| !v.is_nan())
        .collect();
    let anees = mean(squares.iter().map(|m| 0.5 * m));
    let anees_bounds = mean_bounds(squares.len(), PROBABILITY);
    let coverage = |share: f64| {
        // The quantile of χ² with two degrees of freedom is −2·ln(1 − p).
        let limit = -2.0 * libm::log(1.0 - share);
        let hits = squares.iter().filter(|m| **m <= limit).count();
        let interval = if squares.is_empty() {
            [f64::NAN; 2]
        } else {
            clopper_pearson(hits, squares.len())
        };
        (hits as f64 / squares.len() as f64, interval)
    };
    let (coverage_68, coverage_68_interval) = coverage(0.68);
    let (coverage_95, coverage_95_interval) = coverage(0.95);
    let (coverage_99, coverage_99_interval) = coverage(0.99);
    let single: Vec<[f64; 2]> = solved
        .iter()
        .filter(|r| r.across.is_finite())
        .map(|r| [r.across, r.up])
        .collect();
    let failures: Vec<&&Run> = runs.iter().filter(|r| !r.failure.is_empty()).collect();
    let mut found = MethodSummary {
        method,
        axes,
        runs: runs.len(),
        failed: failures.len(),
        warned: runs.iter().filter(|r| !r.warnings.is_empty()).count(),
        failure: failures.first().map(|r| r.failure.clone()),
        solved: count(|r| r.solved),
        abstained: count(|r| r.abstained),
        missed: count(|r| r.missed),
        wrong: count(|r| r.wrong),
        per_axis_rms_deg: root(|r| r.square),
        per_axis_median_deg: errors.get(errors.len() / 2).copied().unwrap_or(f64::NAN),
        per_axis_rms_room_deg: root(|r| r.room_square),
        crlb_per_axis_deg: root(|r| r.bound_square),
        efficiency: 1.0 / ratio,
        efficiency_se: (scatter / ratios.len() as f64).sqrt() / (ratio * ratio),
        anees,
        anees_bounds,
        coverage_68,
        coverage_68_interval,
        coverage_95,
        coverage_95_interval,
        coverage_99,
        coverage_99_interval,
        bias_p_value: bias_p_value(&single),
        ms_per_calibration: None,
        verdict: String::new(),
        nulls: BTreeMap::new(),
    };
    found.verdict = verdict(&found, squares.len(), solved.len());
    found.nulls = nulls(&found, squares.len(), single.len());
    found
}

fn verdict(m: &MethodSummary, judged: usize, solved: usize) -> String {
    let (anees, [low, high]) = (m.anees, m.anees_bounds);
    if m.failed == m.runs {
        "failed".to_owned()
    } else if solved == 0 {
        "solves nothing".to_owned()
    } else if m.per_axis_rms_deg == 0.0 {
        "exact".to_owned()
    } else if judged == 0 {
        "states no covariance".to_owned()
    } else if anees.is_infinite() {
        "over-confident: it rules out an error that it made".to_owned()
    } else if anees > high {
        format!(
            "over-confident: errors are {:.1} times what it states",
            anees.sqrt()
        )
    } else if anees < low {
        let ratio = anees.sqrt();
        if ratio < 0.01 {
            "under-confident: errors are less than a hundredth of what it states".to_owned()
        } else {
            format!("under-confident: errors are {ratio:.2} times what it states")
        }
    } else {
        "consistent".to_owned()
    }
}

/// Returns the keys of figures that are not finite, with the reasons.
fn nulls(m: &MethodSummary, judged: usize, drawn: usize) -> BTreeMap<&'static str, &'static str> {
    let nothing = "nothing was solved";
    let because = |reason: &'static str| {
        if m.per_axis_rms_deg.is_nan() {
            nothing
        } else {
            reason
        }
    };
    let bound =
        because("there is no limit: the believed errors are zero, or the boards leave the angles open");
    let efficiency = if m.crlb_per_axis_deg.is_nan() {
        bound
    } else {
        because("infinite: the error is exactly zero")
    };
    let covariance = because(if judged == 0 {
        "no element that was drawn has a covariance"
    } else {
        "infinite: a covariance rules out the error that was made"
    });
    let bias = because(if drawn < 4 {
        "it takes four runs"
    } else {
        "the errors do not scatter in two directions"
    });
    [
        ("per_axis_rms_deg", m.per_axis_rms_deg, nothing),
        ("per_axis_median_deg", m.per_axis_median_deg, nothing),
        (
            "per_axis_rms_room_deg",
            m.per_axis_rms_room_deg,
            because("the calibrations have no rig_from_sensor"),
        ),
        ("crlb_per_axis_deg", m.crlb_per_axis_deg, bound),
        ("efficiency", m.efficiency, efficiency),
        ("efficiency_se", m.efficiency_se, efficiency),
        ("anees", m.anees, covariance),
        ("anees_bounds", m.anees_bounds[0], covariance),
        ("coverage_68", m.coverage_68, covariance),
        ("coverage_95", m.coverage_95, covariance),
        ("coverage_99", m.coverage_99, covariance),
        ("bias_p_value", m.bias_p_value, bias),
    ]
    .into_iter()
    .filter(|(_, value, _)| !value.is_finite())
    .map(|(key, _, why)| (key, why))
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::{Contestant, from_csv, to_csv};

    /// Summarizes runs with the given eᵀP⁻¹e of their element, as written in a table.
    fn of(squares: &[&str]) -> MethodSummary {
        let scene =
            toml::from_str(include_str!("../../../../scenes/reference-facet.toml")).expect("it is valid");
        let study = Study::of_scene(scene, squares.len() as u64, vec![Contestant::Oracle]);
        let rows: String = (1..)
            .zip(squares)
            .map(|(seed, square)| format!("0,{seed},oracle,1,0,0,0,1e-8,,1e-8,,700,1e-4,1e-4,{square},,,\n"))
            .collect();
        let runs = from_csv(&(to_csv(&[]) + &rows)).expect("they are runs");
        summarize(&study, &runs).methods.remove(0)
    }

    #[test]
    fn verdicts_follow_the_stated_covariance() {
        let honest = of(&["2"; 8]);
        assert_eq!((honest.anees, honest.verdict.as_str()), (1.0, "consistent"));
        assert_eq!(
            of(&["32"; 8]).verdict,
            "over-confident: errors are 4.0 times what it states"
        );
        assert_eq!(
            of(&["0.02"; 8]).verdict,
            "under-confident: errors are 0.10 times what it states"
        );
        assert_eq!(
            of(&["1e-9"; 8]).verdict,
            "under-confident: errors are less than a hundredth of what it states"
        );
        assert_eq!(of(&[""; 8]).verdict, "states no covariance");
    }

    #[test]
    fn an_error_that_is_ruled_out_counts() {
        // One covariance of zero among honest ones; elements without a covariance are not judged.
        let found = of(&["2", "2", "inf", "", ""]);
        assert_eq!(
            found.verdict,
            "over-confident: it rules out an error that it made"
        );
        assert!(found.anees.is_infinite());
        assert!((found.coverage_95 - 2.0 / 3.0).abs() < 1e-15);
        assert_eq!(
            found.nulls["anees"],
            "infinite: a covariance rules out the error that was made"
        );
        let json = serde_json::to_value(&found).expect("it is data");
        assert!(json["anees"].is_null() && json["nulls"]["anees"].is_string());
    }
}
