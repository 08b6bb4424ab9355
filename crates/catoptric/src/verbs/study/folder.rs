//! A study in a folder, from which it resumes if it was stopped, and in shards that merge to the same bytes.

use super::stoppable;
use crate::{Control, Error};
use catoptric_assess::study::folder::{self, Found};
use catoptric_assess::study::{Part, Plan, Study, Summary, gather, summarize};
use catoptric_files::Output;
use std::path::{Path, PathBuf};

/// Name of the page of a study.
pub const STUDY_PAGE: &str = folder::PAGE;

/// Runs a part of a study in a folder; called again, it resumes where it was stopped.
///
/// A folder of another study is refused, or begun anew if its [`Output`] replaces. With `elements`, the angles of every element are listed as well. The folder contains the tables, `study.json` and a
/// page.
///
/// # Errors
/// [`Error::Study`] if the folder contains another study, [`Error::Setup`] if a scene cannot be set up, [`Error::File`]
/// if writing fails, [`Error::Stopped`]; finished experiments are kept.
pub fn study_into(
    study: &Study,
    part: Part,
    elements: bool,
    out: impl Into<Output>,
    control: &Control,
) -> Result<Summary, Error> {
    let (study, out) = (stoppable(study, control), out.into());
    control.run(|| {
        let done = |more, of| control.report("experiments", more, of);
        let (plan, found) = folder::run_in(&out, &study, part, elements, &done)?;
        finish(out.path(), &plan, &study, &found)
    })
}

/// Merges the shards of a study, to the same bytes as the study in one piece.
///
/// # Errors
/// [`Error::Study`] if the folders are not all the shards of one study, each finished; [`Error::File`] if reading or
/// writing fails.
pub fn merge_studies(shards: &[PathBuf], out: impl Into<Output>) -> Result<Summary, Error> {
    let out = out.into();
    let (plan, study, found) = gather(shards)?;
    plan.claim(&out)?;
    finish(out.path(), &plan, &study, &found)
}

fn finish(out: &Path, plan: &Plan, study: &Study, found: &Found) -> Result<Summary, Error> {
    let summary = summarize(study, &found.runs);
    #[cfg(feature = "report")]
    let page = {
        let elements = found.elements.as_deref().unwrap_or_default();
        let page = catoptric_report::study(&plan.name, study, &summary, elements);
        vec![(out.join(STUDY_PAGE).into(), page.into_bytes())]
    };
    #[cfg(not(feature = "report"))]
    let page = {
        let _ = plan;
        Vec::new()
    };
    Ok(folder::finish(out, study, found, summary, page)?)
}
