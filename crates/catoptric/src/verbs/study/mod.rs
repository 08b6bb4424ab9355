//! Studies of many experiments and the statistics of their errors: in memory, in a folder from which an interrupted study
//! resumes, or in shards that merge to the same bytes.

use crate::{Control, Error};
use catoptric_assess::study::folder::{self, Found};
use catoptric_assess::study::{Part, Plan, Run, Study, Summary, gather, run, summarize};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// File name of the page about a study.
pub const STUDY_PAGE: &str = "report.html";

/// Runs a study in memory; returns its statistics and the runs themselves.
///
/// ```
/// use catoptric::study::{Contestant, Study};
/// use catoptric::{Control, Scene, study};
///
/// # fn main() -> Result<(), catoptric::Error> {
/// let scene = Scene::load("../../scenes/reference-facet.toml")?;
/// let four_seeds = Study::of_scene(scene.resolved().clone(), 4, vec![Contestant::named("joint")?]);
/// let (summary, runs) = study(&four_seeds, &Control::default())?;
/// assert_eq!((summary.methods.len(), runs.len()), (1, 4));
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// [`Error::Setup`] if a scene cannot be set up, [`Error::Stopped`].
pub fn study(study: &Study, control: &Control) -> Result<(Summary, Vec<Run>), Error> {
    let study = stoppable(study, control);
    control.run(|| {
        let jobs: Vec<_> = study.jobs().collect();
        let mut runs = Vec::with_capacity(jobs.len() * study.contestants.len());
        control.report("experiments", 0, jobs.len());
        for chunk in jobs.chunks(2 * rayon::current_num_threads()) {
            let found: Vec<Vec<Run>> = chunk
                .par_iter()
                .map(|job| {
                    study.stop.check()?;
                    Ok(run(&study, *job)?)
                })
                .collect::<Result<_, Error>>()?;
            runs.extend(found.into_iter().flatten());
            control.report("experiments", chunk.len(), jobs.len());
        }
        // A calibrator that was stopped counts as failed, which is no result.
        study.stop.check()?;
        Ok((summarize(&study, &runs), runs))
    })
}

/// Runs a part of a study in a folder; called again, it resumes where it was stopped.
///
/// With `elements`, the angles of every element are listed as well. The folder contains the tables, `study.json` and a
/// page.
///
/// # Errors
/// [`Error::Study`] if the folder contains another study, [`Error::Setup`] if a scene cannot be set up, [`Error::File`]
/// if writing fails, [`Error::Stopped`]; finished experiments are kept.
pub fn study_into(
    study: &Study,
    part: Part,
    elements: bool,
    out: impl AsRef<Path>,
    control: &Control,
) -> Result<Summary, Error> {
    let (study, out) = (stoppable(study, control), out.as_ref());
    control.run(|| {
        let done = |more, of| control.report("experiments", more, of);
        let (plan, found) = folder::run_in(out, &study, part, elements, &done)?;
        finish(out, &plan, &study, &found)
    })
}

/// Merges the shards of a study, to the same bytes as the study in one piece.
///
/// # Errors
/// [`Error::Study`] unless the folders are all the shards of one study, each finished; [`Error::File`] if reading or
/// writing fails.
pub fn merge_studies(shards: &[PathBuf], out: impl AsRef<Path>) -> Result<Summary, Error> {
    let (plan, study, found) = gather(shards)?;
    plan.claim(out.as_ref())?;
    finish(out.as_ref(), &plan, &study, &found)
}

fn finish(out: &Path, plan: &Plan, study: &Study, found: &Found) -> Result<Summary, Error> {
    #[cfg(feature = "report")]
    {
        let elements = found.elements.as_deref().unwrap_or_default();
        let summary = summarize(study, &found.runs);
        let page = catoptric_report::study(&plan.name, study, &summary, elements);
        catoptric_files::write_file(out.join(STUDY_PAGE), page.as_bytes())?;
    }
    #[cfg(not(feature = "report"))]
    let _ = plan;
    Ok(folder::finish(out, study, found)?)
}

/// Returns the study with the stop request of the verb that runs it.
fn stoppable(study: &Study, control: &Control) -> Study {
    Study {
        stop: control.stop.clone(),
        ..study.clone()
    }
}
