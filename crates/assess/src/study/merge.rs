//! Merging of the runs of several parts into those of one study: each exactly once and in order.

use super::{Job, Run, Study};

/// Sorts the runs of all parts of a study.
///
/// # Errors
/// As text, the first run that is missing, duplicate, or of an unknown contestant.
pub fn merge(study: &Study, runs: Vec<Run>) -> Result<Vec<Run>, String> {
    in_order(study, &study.jobs().collect::<Vec<_>>(), runs)
}

/// Sorts the runs of some experiments; `jobs` are in the order of the study.
///
/// # Errors
/// Same as [`merge`].
pub fn in_order(study: &Study, jobs: &[Job], mut runs: Vec<Run>) -> Result<Vec<Run>, String> {
    let names: Vec<String> = study.contestants.iter().map(super::Contestant::name).collect();
    let key = |r: &Run| (r.cell, r.seed, names.iter().position(|n| *n == r.method));
    runs.sort_by_key(key);
    let of = |cell: usize, seed: u64, name: &str| format!("{name} on seed {seed} of cell {cell}");
    let mut found = runs.iter();
    for job in jobs {
        for (place, name) in names.iter().enumerate() {
            let missing = || format!("there is no run of {}", of(job.cell, job.seed, name));
            let run = found.next().ok_or_else(missing)?;
            let wanted = (job.cell, job.seed, Some(place));
            if key(run) > wanted {
                return Err(missing());
            } else if key(run) < wanted {
                return Err(too_many(run));
            }
        }
    }
    found.next().map_or(Ok(()), |run| Err(too_many(run)))?;
    Ok(runs)
}

fn too_many(run: &Run) -> String {
    format!(
        "there is an extra run, of {} on seed {} of cell {}",
        run.method, run.seed, run.cell
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::table::HEADER;
    use crate::study::{Contestant, from_csv, to_csv};
    use catoptric_calib::Method;

    fn study() -> Study {
        let scene =
            toml::from_str(include_str!("../../../../scenes/reference-facet.toml")).expect("it is valid");
        Study::of_scene(
            scene,
            3,
            vec![Contestant::Oracle, Contestant::Method(Method::Beam)],
        )
    }

    fn runs(study: &Study) -> Vec<Run> {
        let rows: String = study
            .jobs()
            .flat_map(|j| {
                // Numbers and texts that are not needed are empty.
                let rest = ",".repeat(HEADER.len() - 12);
                ["oracle", "beam"].map(|m| format!("{},{},{m},1,0,0,0,,,,,0{rest}\n", j.cell, j.seed))
            })
            .collect();
        from_csv(&(to_csv(&[]) + &rows)).expect("they are runs")
    }

    #[test]
    fn parts_are_sorted_and_must_be_complete() {
        let study = study();
        let whole = runs(&study);
        let text = |runs: &[Run]| to_csv(runs);
        let mut mixed = whole.clone();
        mixed.reverse();
        let merged = merge(&study, mixed.clone()).expect("nothing is missing");
        assert_eq!(text(&merged), text(&whole));
        let without_one = mixed
            .iter()
            .filter(|r| (r.seed, r.method.as_str()) != (2, "beam"));
        assert_eq!(
            merge(&study, without_one.cloned().collect()),
            Err("there is no run of beam on seed 2 of cell 0".to_owned())
        );
        mixed.push(whole[5].clone());
        assert_eq!(
            merge(&study, mixed.clone()),
            Err("there is an extra run, of beam on seed 3 of cell 0".to_owned())
        );
        mixed[0].method = "other".to_owned();
        assert_eq!(
            merge(&study, mixed),
            Err("there is an extra run, of other on seed 3 of cell 0".to_owned())
        );
    }

    #[test]
    fn parts_divide_the_experiments() {
        let study = study();
        let mut all: Vec<Job> = [1, 2]
            .iter()
            .flat_map(|i| study.jobs_of_part([*i, 2].into()))
            .collect();
        assert_eq!(study.jobs_of_part([1, 2].into()).len(), 2);
        all.sort();
        assert_eq!(all, study.jobs().collect::<Vec<_>>());
    }
}
