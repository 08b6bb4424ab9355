//! A study in a folder: tables of its runs, by chunks during the study, of all runs at the end. Existing results are not
//! computed again, so an interrupted study resumes.

pub use super::names::{PAGE, PLAN, RESULT, SPREAD};
use super::plan::Plan;
use super::{
    ElementAngles, Job, Part, Run, Study, StudyError, Summary, elements_from_csv, elements_to_csv, from_csv,
    in_order, merge, run_with_elements, spread, spread_to_csv, to_csv,
};
use catoptric_files::json::to_json;
use catoptric_files::names::{defused, original};
use catoptric_files::{IoError, Output, write_files};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Number of experiments between two files on disk: the most that an interruption can cost.
const CHUNK: usize = 32;

/// Results of experiments.
#[derive(Debug, Default)]
pub struct Found {
    /// Result of every contestant in every experiment.
    pub runs: Vec<Run>,
    /// Angles of every element, if requested.
    pub elements: Option<Vec<ElementAngles>>,
    /// Duration of each calibration.
    pub times: Vec<Time>,
}

/// Duration of a calibration: kept apart from the results, since it differs every time.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Time {
    cell: usize,
    seed: u64,
    method: String,
    milliseconds: f64,
}

/// Paths of the tables of all runs, or of a chunk of them during a study.
pub struct Tables {
    /// The runs; written last, so their existence shows that the other tables are complete.
    pub runs: PathBuf,
    /// The angles of every element, if requested.
    pub elements: PathBuf,
    times: PathBuf,
}

impl Found {
    /// Appends the results of other experiments.
    pub fn extend(&mut self, other: Self) {
        self.runs.extend(other.runs);
        self.times.extend(other.times);
        if let Some(elements) = other.elements {
            self.elements.get_or_insert_default().extend(elements);
        }
    }

    /// Sorts the results of shards into the order of the study.
    ///
    /// # Errors
    /// [`StudyError::Invalid`] if a run is missing or present twice.
    pub fn sort(&mut self, study: &Study) -> Result<(), StudyError> {
        // Each shard was complete and given once.
        self.runs = merge(study, std::mem::take(&mut self.runs))
            .map_err(|what| StudyError::invalid(what, "give every shard once"))?;
        // Within an experiment they are in order, which a stable sort keeps.
        self.times.sort_by_key(|t| (t.cell, t.seed));
        if let Some(elements) = &mut self.elements {
            elements.sort_by_key(|e| (e.cell, e.seed));
        }
        Ok(())
    }
}

impl Tables {
    /// Paths of the tables of a study.
    pub fn of(folder: &Path) -> Self {
        Self {
            runs: folder.join("runs.csv"),
            elements: folder.join("elements.csv"),
            times: folder.join("times.csv"),
        }
    }

    /// Paths of the tables of a chunk of a study.
    pub fn of_chunk(folder: &Path, number: usize) -> Self {
        let path = |kind: &str| folder.join(format!("{kind}-{number:06}.csv"));
        Self {
            runs: path("runs"),
            elements: path("elements"),
            times: path("times"),
        }
    }

    /// Writes the tables, all or none, the runs last.
    ///
    /// # Errors
    /// [`StudyError::File`] if writing fails.
    pub fn write(&self, found: &Found) -> Result<(), StudyError> {
        Ok(write_files(&self.files(found)?)?)
    }

    fn files(&self, found: &Found) -> Result<Vec<(Output, Vec<u8>)>, StudyError> {
        let mut files = vec![((&self.times).into(), times_to_csv(&found.times)?.into_bytes())];
        if let Some(elements) = &found.elements {
            files.push(((&self.elements).into(), elements_to_csv(elements).into_bytes()));
        }
        files.push(((&self.runs).into(), to_csv(&found.runs).into_bytes()));
        Ok(files)
    }

    /// Reads the tables and checks that the runs are exactly those of the given experiments.
    ///
    /// # Errors
    /// [`StudyError`] if a table is missing, damaged or of other experiments.
    pub fn read(&self, study: &Study, jobs: &[Job]) -> Result<Found, StudyError> {
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

    /// Removes those that exist.
    ///
    /// # Errors
    /// [`StudyError::File`] if a file cannot be removed.
    pub fn remove(&self) -> Result<(), StudyError> {
        for path in [&self.runs, &self.elements, &self.times] {
            match std::fs::remove_file(path) {
                Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
                    return Err(IoError::write(path, e).into());
                }
                _ => {}
            }
        }
        Ok(())
    }
}

fn parsed<T>(path: &Path, parse: impl FnOnce(&str) -> Result<T, String>) -> Result<T, StudyError> {
    let text = catoptric_files::waiting::read_text(path).map_err(|source| IoError::Read {
        path: path.to_owned(),
        source,
    })?;
    parse(&text).map_err(|what| {
        StudyError::invalid(
            format!("{}: {what}", path.display()),
            "delete it; the command that wrote it then repeats these runs",
        )
    })
}

/// Returns the durations of runs.
pub fn times(runs: &[Run]) -> Vec<Time> {
    let time = |r: &Run| Time {
        cell: r.cell,
        seed: r.seed,
        method: r.method.clone(),
        milliseconds: r.milliseconds,
    };
    runs.iter().map(time).collect()
}

fn times_to_csv(times: &[Time]) -> Result<String, StudyError> {
    let failed = |e: csv::Error| {
        StudyError::invalid(format!("the times cannot be written: {e}"), "run the study again")
    };
    let mut writer = csv::Writer::from_writer(Vec::new());
    for time in times {
        let time = Time {
            method: defused(&time.method).into_owned(),
            ..time.clone()
        };
        writer.serialize(time).map_err(failed)?;
    }
    let bytes = writer.into_inner().unwrap_or_default();
    Ok(String::from_utf8(bytes).unwrap_or_default())
}

fn times_from_csv(text: &str) -> Result<Vec<Time>, String> {
    let read = |time: Result<Time, csv::Error>| {
        let time = time.map_err(|e| e.to_string())?;
        Ok(Time {
            method: original(&time.method).to_owned(),
            ..time
        })
    };
    csv::Reader::from_reader(text.as_bytes())
        .deserialize()
        .map(read)
        .collect()
}

/// Runs a part of a study in a folder that is new or contains the same part; existing runs are not repeated.
///
/// `done` is called with the number of experiments newly finished and their total number. With `with_elements`, or if
/// they were listed before, the angles of every element are listed as well.
///
/// # Errors
/// [`StudyError`]; after [`Stopped`](StudyError::Stopped) the folder keeps the finished experiments.
pub fn run_in(
    out: &Output,
    study: &Study,
    part: Part,
    with_elements: bool,
    done: &dyn Fn(usize, usize),
) -> Result<(Plan, Found), StudyError> {
    let plan = Plan::of(study, part)?;
    plan.claim(out)?;
    let folder = out.path();
    let jobs = study.jobs_of_part(part);
    let tables = Tables::of(folder);
    // Once requested, they belong to the study.
    let with_elements = with_elements || tables.elements.exists();
    if tables.runs.exists() && tables.elements.exists() >= with_elements {
        return Ok((plan, tables.read(study, &jobs)?));
    }
    let mut found = Found::default();
    done(0, jobs.len());
    for (number, chunk) in jobs.chunks(CHUNK).enumerate() {
        let tables = Tables::of_chunk(folder, number);
        let of_chunk = if tables.runs.exists() && tables.elements.exists() >= with_elements {
            tables.read(study, chunk)?
        } else {
            let of_chunk = experiments(study, chunk, with_elements)?;
            tables.write(&of_chunk)?;
            of_chunk
        };
        found.extend(of_chunk);
        done(chunk.len(), jobs.len());
    }
    Ok((plan, found))
}

/// Runs a chunk of experiments. None of its results are kept if the study is stopped meanwhile: programs are terminated
/// then, which must not count as their failure. An experiment that fails stops the others.
fn experiments(study: &Study, chunk: &[Job], with_elements: bool) -> Result<Found, StudyError> {
    let part = Study {
        stop: study.stop.part(),
        ..study.clone()
    };
    let one = |job: &Job| {
        let ended = part
            .stop
            .check()
            .map_err(StudyError::from)
            .and_then(|()| Ok(run_with_elements(&part, *job)?));
        if ended.is_err() {
            part.stop.request();
        }
        ended
    };
    let ended: Vec<Result<_, StudyError>> = chunk.par_iter().map(one).collect();
    study.stop.check()?;
    let stopped = |ended: &Result<_, StudyError>| matches!(ended, Err(StudyError::Stopped(_)));
    // What was stopped was stopped by the failure of another.
    let (stopped, ended): (Vec<_>, Vec<_>) = ended.into_iter().partition(stopped);
    let (runs, elements): (Vec<_>, Vec<_>) = ended
        .into_iter()
        .chain(stopped)
        .collect::<Result<Vec<_>, StudyError>>()?
        .into_iter()
        .unzip();
    let runs = runs.concat();
    Ok(Found {
        times: times(&runs),
        runs,
        elements: with_elements.then(|| elements.concat()),
    })
}

/// Writes the tables and the result, the summary of the runs found, together with some other files, all or none, and
/// removes the tables of chunks; the returned summary includes the durations.
///
/// # Errors
/// [`StudyError::File`] if writing fails.
pub fn finish(
    folder: &Path,
    study: &Study,
    found: &Found,
    mut summary: Summary,
    mut files: Vec<(Output, Vec<u8>)>,
) -> Result<Summary, StudyError> {
    if let Some(elements) = &found.elements {
        let table = spread_to_csv(&spread(elements)).into_bytes();
        files.push((folder.join(SPREAD).into(), table));
    }
    files.extend(Tables::of(folder).files(found)?);
    let result = folder.join(RESULT);
    let bytes = to_json(&result, &summary)?;
    files.push((result.into(), bytes));
    write_files(&files)?;
    let chunks = found.runs.len().div_ceil(CHUNK);
    for number in 0..chunks {
        Tables::of_chunk(folder, number).remove()?;
    }
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
