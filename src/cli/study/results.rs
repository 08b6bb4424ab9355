//! The files of a study: tables of its runs, of a chunk of them or of all, its result and its page.

use super::invalid;
use super::plan::Plan;
use crate::cli::error::CliError;
use crate::cli::output::{print, quoted};
use catoptric::study::{
    ElementAngles, Job, Run, Study, Summary, elements_from_csv, elements_to_csv, from_csv, in_order, merge,
    spread, spread_to_csv, summarize, to_csv,
};
use catoptric::{files, report};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const RESULT: &str = "study.json";
const PAGE: &str = "report.html";
const SPREAD: &str = "spread.csv";

/// What experiments gave.
#[derive(Debug, Default)]
pub(super) struct Found {
    pub(super) runs: Vec<Run>,
    /// Where they were asked for.
    pub(super) elements: Option<Vec<ElementAngles>>,
    pub(super) times: Vec<Time>,
}

/// How long a calibration took: beside what is compared, since no two runs take equally long.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Time {
    cell: usize,
    seed: u64,
    method: String,
    milliseconds: f64,
}

/// The tables of all runs, or of a chunk of them while a study is under way.
pub(super) struct Tables {
    pub(super) runs: PathBuf,
    pub(super) elements: PathBuf,
    times: PathBuf,
}

impl Found {
    /// Adds what other experiments gave.
    pub(super) fn extend(&mut self, other: Self) {
        self.runs.extend(other.runs);
        self.times.extend(other.times);
        if let Some(elements) = other.elements {
            self.elements.get_or_insert_default().extend(elements);
        }
    }

    /// Brings what shards gave into the study's order.
    pub(super) fn sort(&mut self, study: &Study) -> Result<(), CliError> {
        // Each shard was whole, and each was there once.
        self.runs = merge(study, std::mem::take(&mut self.runs))
            .map_err(|what| invalid(what, "give every shard once"))?;
        // Within an experiment they are in order, which sorting keeps.
        self.times.sort_by_key(|t| (t.cell, t.seed));
        if let Some(elements) = &mut self.elements {
            elements.sort_by_key(|e| (e.cell, e.seed));
        }
        Ok(())
    }
}

impl Tables {
    /// The tables of a study.
    pub(super) fn of(folder: &Path) -> Self {
        Self {
            runs: folder.join("runs.csv"),
            elements: folder.join("elements.csv"),
            times: folder.join("times.csv"),
        }
    }

    /// The tables of a chunk of it.
    pub(super) fn of_chunk(folder: &Path, number: usize) -> Self {
        let path = |kind: &str| folder.join(format!("{kind}-{number:06}.csv"));
        Self {
            runs: path("runs"),
            elements: path("elements"),
            times: path("times"),
        }
    }

    /// Writes them, the runs last: with them all is there.
    pub(super) fn write(&self, found: &Found) -> Result<(), CliError> {
        files::write_file(&self.times, times_to_csv(&found.times)?.as_bytes())?;
        if let Some(elements) = &found.elements {
            files::write_file(&self.elements, elements_to_csv(elements).as_bytes())?;
        }
        Ok(files::write_file(&self.runs, to_csv(&found.runs).as_bytes())?)
    }

    /// Reads them, the runs being those of some experiments: no fewer, no more.
    pub(super) fn read(&self, study: &Study, jobs: &[Job]) -> Result<Found, CliError> {
        let runs = parsed(&self.runs, |text| in_order(study, jobs, from_csv(text)?))?;
        let elements = if self.elements.exists() {
            Some(parsed(&self.elements, elements_from_csv)?)
        } else {
            None
        };
        let times = if self.times.exists() {
            parsed(&self.times, times_from_csv)?
        } else {
            Vec::new()
        };
        Ok(Found {
            runs,
            elements,
            times,
        })
    }

    /// Removes those that are there.
    pub(super) fn remove(&self) -> Result<(), CliError> {
        for path in [&self.runs, &self.elements, &self.times] {
            match std::fs::remove_file(path) {
                Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
                    let path = path.clone();
                    return Err(CliError::Write { path, source: e });
                }
                _ => {}
            }
        }
        Ok(())
    }
}

fn parsed<T>(path: &Path, parse: impl FnOnce(&str) -> Result<T, String>) -> Result<T, CliError> {
    let text = std::fs::read_to_string(path).map_err(|source| files::IoError::Read {
        path: path.to_owned(),
        source,
    })?;
    parse(&text).map_err(|what| {
        invalid(
            format!("{}: {what}", path.display()),
            "delete it, and the command that wrote it does its runs again",
        )
    })
}

/// The times of runs.
pub(super) fn times(runs: &[Run]) -> Vec<Time> {
    let time = |r: &Run| Time {
        cell: r.cell,
        seed: r.seed,
        method: r.method.clone(),
        milliseconds: r.milliseconds,
    };
    runs.iter().map(time).collect()
}

fn times_to_csv(times: &[Time]) -> Result<String, CliError> {
    let failed = |e: csv::Error| CliError::Output(std::io::Error::other(e));
    let mut writer = csv::Writer::from_writer(Vec::new());
    for time in times {
        writer.serialize(time).map_err(failed)?;
    }
    let bytes = writer.into_inner().unwrap_or_default();
    Ok(String::from_utf8(bytes).unwrap_or_default())
}

fn times_from_csv(text: &str) -> Result<Vec<Time>, String> {
    csv::Reader::from_reader(text.as_bytes())
        .deserialize()
        .collect::<Result<_, _>>()
        .map_err(|e| e.to_string())
}

/// Tables, result and page; the summary that is printed has the times too.
pub(super) fn write(study: &Study, found: &Found, plan: &Plan, out: &Path) -> Result<Summary, CliError> {
    let mut summary = summarize(study, &found.runs);
    let elements = found.elements.as_deref().unwrap_or_default();
    let spreads = spread(elements);
    if found.elements.is_some() {
        files::write_file(out.join(SPREAD), spread_to_csv(&spreads).as_bytes())?;
    }
    Tables::of(out).write(found)?;
    let page = report::study(&plan.name, study, &summary, elements);
    files::write_file(out.join(PAGE), page.as_bytes())?;
    files::write_json(out.join(RESULT), &summary)?;
    let mut sums: BTreeMap<(usize, &str), (f64, f64)> = BTreeMap::new();
    for time in &found.times {
        let (sum, count) = sums.entry((time.cell, &time.method)).or_default();
        *sum += time.milliseconds;
        *count += 1.0;
    }
    let contestants = study.contestants.len().max(1);
    for (i, method) in summary.methods.iter_mut().enumerate() {
        let found = sums.get(&(i / contestants, method.method.as_str()));
        method.ms_per_calibration = found.map(|(sum, count)| sum / count);
    }
    Ok(summary)
}

/// Prints the summary.
pub(super) fn tell(summary: &Summary, out: &Path, json: bool) -> Result<(), CliError> {
    if json {
        let text = serde_json::to_string(summary).map_err(|e| CliError::Output(e.into()))?;
        return print(&format!("{text}\n"));
    }
    let number = |v: f64, decimals: usize| {
        if v.is_finite() {
            format!("{v:.decimals$}")
        } else {
            "–".to_owned()
        }
    };
    let mut text = format!(
        "{:<20} {:>6} {:>10} {:>10} {:>11} {:>7} {:>9} {:>7}  {}\n",
        "method", "runs", "rms (°)", "limit (°)", "efficiency", "ANEES", "95 %", "ms", "verdict"
    );
    let mut axes = None;
    for m in &summary.methods {
        if !m.axes.is_empty() && axes != Some(&m.axes) {
            let values: Vec<String> = m.axes.iter().map(|(k, v)| format!("{k} = {v}")).collect();
            text += &format!("{}\n", values.join(", "));
            axes = Some(&m.axes);
        }
        let verdict = match &m.failure {
            Some(failure) if m.failed == m.runs => format!("{}: {failure}", m.verdict),
            Some(failure) => format!("{}; {} failed: {failure}", m.verdict, m.failed),
            None => m.verdict.clone(),
        };
        text += &format!(
            "{:<20} {:>6} {:>10} {:>10} {:>11} {:>7} {:>9} {:>7}  {verdict}\n",
            m.method,
            m.runs,
            number(m.per_axis_rms_deg, 4),
            number(m.crlb_per_axis_deg, 4),
            number(m.efficiency, 3),
            number(m.anees, 2),
            number(m.coverage_95, 3),
            m.ms_per_calibration.map_or("–".to_owned(), |ms| number(ms, 1)),
        );
    }
    print(&format!(
        "{text}wrote {} and, beside it, {PAGE} and the tables\n",
        quoted(&out.join(RESULT))
    ))
}
