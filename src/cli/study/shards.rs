//! `catoptric study merge`: the shards of a study, put together.

use super::plan::Plan;
use super::results::{self, Found, Tables};
use super::{MergeArguments, invalid};
use crate::cli::error::CliError;
use crate::cli::output::counted;
use std::path::Path;

pub(super) fn merge(arguments: &MergeArguments) -> Result<(), CliError> {
    let plans = arguments
        .shards
        .iter()
        .map(|folder| Ok((folder.as_path(), Plan::read(folder)?)))
        .collect::<Result<Vec<_>, CliError>>()?;
    let whole = one_study(&plans)?;
    let study = whole.study()?;
    let mut found = Found::default();
    let with_elements = plans
        .iter()
        .any(|(folder, _)| Tables::of(folder).elements.exists());
    for (folder, plan) in &plans {
        let tables = Tables::of(folder);
        if !tables.runs.exists() {
            return Err(invalid(
                format!("{} is not finished", folder.display()),
                "the command that began it goes on with it",
            ));
        }
        if with_elements && !tables.elements.exists() {
            return Err(invalid(
                format!(
                    "{} has no list of elements, and other shards have",
                    folder.display()
                ),
                "give its command again with --elements",
            ));
        }
        found.extend(tables.read(&study, &study.jobs_of_part(plan.shard))?);
    }
    found.sort(&study)?;
    whole.claim(&arguments.out)?;
    let summary = results::write(&study, &found, &whole, &arguments.out)?;
    results::tell(&summary, &arguments.out, arguments.json)
}

/// The plan of the whole, if these are all its parts.
fn one_study(plans: &[(&Path, Plan)]) -> Result<Plan, CliError> {
    let Some((first, plan)) = plans.first() else {
        return Err(invalid(
            "no shard is given".to_owned(),
            "catoptric study merge part-1 part-2 --out whole",
        ));
    };
    let mut whole = plan.clone();
    whole.shard = [1, 1];
    let mut seen: Vec<usize> = Vec::new();
    for (folder, plan) in plans {
        let [part, parts] = plan.shard;
        let mut alike = plan.clone();
        alike.shard = [1, 1];
        if alike != whole {
            return Err(invalid(
                format!(
                    "{} is a part of another study than {}: {}",
                    folder.display(),
                    first.display(),
                    alike.difference(&whole).replace("asked for", "there")
                ),
                "give the shards of one study: same scene, seeds, methods and axes",
            ));
        }
        if seen.contains(&part) {
            return Err(invalid(
                format!(
                    "shard {part}/{parts} is given twice, the second time as {}",
                    folder.display()
                ),
                "give every shard once",
            ));
        }
        if parts != plans.len() {
            return Err(invalid(
                format!(
                    "{} is one of {}, and {} given",
                    folder.display(),
                    counted(parts, "shard"),
                    counted(plans.len(), "folder")
                ),
                "give every shard once",
            ));
        }
        seen.push(part);
    }
    Ok(whole)
}
