//! Studies of many experiments and the statistics of their errors: in memory, in a folder from which an interrupted study
//! resumes, or in shards that merge to the same bytes.

#[cfg(feature = "recording")]
mod folder;

#[cfg(feature = "recording")]
pub use folder::{STUDY_PAGE, merge_studies, study_into};

use crate::{Control, Error};
use catoptric_assess::study::{Run, Study, Summary, run, summarize};
use rayon::prelude::*;

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

/// Returns the study with the stop request of the verb that runs it.
fn stoppable(study: &Study, control: &Control) -> Study {
    Study {
        stop: control.stop.clone(),
        ..study.clone()
    }
}
