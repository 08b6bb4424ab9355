//! Merging of the shards of a study.

use super::folder::{Found, Tables};
use super::plan::Plan;
use super::{Part, Study, StudyError};
use std::path::{Path, PathBuf};

/// Reads the plan, the study and all runs from the folders of its shards.
///
/// # Errors
/// [`StudyError`] unless they are all the shards of one study, each finished.
pub fn gather(folders: &[PathBuf]) -> Result<(Plan, Study, Found), StudyError> {
    let plans = folders
        .iter()
        .map(|folder| Ok((folder.as_path(), Plan::read(folder)?)))
        .collect::<Result<Vec<_>, StudyError>>()?;
    let whole = one_study(&plans)?;
    let study = whole.study()?;
    let mut found = Found::default();
    let with_elements = plans
        .iter()
        .any(|(folder, _)| Tables::of(folder).elements.exists());
    for (folder, plan) in &plans {
        let tables = Tables::of(folder);
        if !tables.runs.exists() {
            return Err(StudyError::invalid(
                format!("{} is not finished", folder.display()),
                "run its command again to resume it",
            ));
        }
        if with_elements && !tables.elements.exists() {
            return Err(StudyError::invalid(
                format!(
                    "{} has no list of elements, but other shards have one",
                    folder.display()
                ),
                "run its command again with --elements",
            ));
        }
        found.extend(tables.read(&study, &study.jobs_of_part(plan.shard))?);
    }
    found.sort(&study)?;
    Ok((whole, study, found))
}

/// Returns the plan of the whole study, if these are all its parts.
fn one_study(plans: &[(&Path, Plan)]) -> Result<Plan, StudyError> {
    let Some((first, plan)) = plans.first() else {
        return Err(StudyError::invalid(
            "no shard is given".to_owned(),
            "catoptric study merge part-1 part-2 --out whole",
        ));
    };
    let mut whole = plan.clone();
    whole.shard = Part::WHOLE;
    let mut seen: Vec<usize> = Vec::new();
    for (folder, plan) in plans {
        let Part { part, parts } = plan.shard;
        let mut of_whole = plan.clone();
        of_whole.shard = Part::WHOLE;
        if of_whole != whole {
            return Err(StudyError::invalid(
                format!(
                    "{} and {} are not parts of the same study: {}",
                    folder.display(),
                    first.display(),
                    of_whole.difference(&whole).replace("requested", "there")
                ),
                "give the shards of one study: same scene, seeds, methods and axes",
            ));
        }
        if seen.contains(&part) {
            return Err(StudyError::invalid(
                format!(
                    "shard {part}/{parts} is given twice, the second time as {}",
                    folder.display()
                ),
                "give every shard once",
            ));
        }
        if parts != plans.len() {
            return Err(StudyError::invalid(
                format!(
                    "{} is one of {parts} shards, and {} folders are given",
                    folder.display(),
                    plans.len()
                ),
                "give every shard once",
            ));
        }
        seen.push(part);
    }
    Ok(whole)
}
