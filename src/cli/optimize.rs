//! `catoptric optimize`: searches the parameters of a scene for better layouts.

use super::context::Context;
use super::error::CliError;
use super::judging::{Limits, require_help};
use super::output::{counted, grouped, print, print_json, quoted};
use super::outputs::Replacing;
use catoptric::files::names::printable_name;
use catoptric::layout::{Detail, RequirementError};
use catoptric::optimize::{
    Better, Goal, GoalError, LayoutCandidate, OptimizeError, Optimum, SearchOptions, Wanted,
};
use catoptric::{
    BEST_SCENE, Error, OPTIMUM_FOLDER, OPTIMUM_PAGE, Scene, optimize, report, shown_of_front as shown,
    write_optimum,
};
use clap::Args;
use std::path::PathBuf;
use std::time::Instant;

/// Arguments of `optimize`.
#[derive(Debug, Args)]
#[command(mut_arg("require", |option| option.help(require_help(EXAMPLE))))]
pub(crate) struct Arguments {
    /// The scene, TOML or JSON, with parameters that have `low` and `high`.
    scene: PathBuf,
    /// What to improve: field_of_regard, split_beams, lost_beams, predicted_accuracy, size, directions, or a figure of
    /// `layout --json` with up or down: share_within_5_deg:up. May be given more than once.
    #[arg(long, required = true, value_name = "GOAL")]
    goal: Vec<String>,
    /// A direction for the goal `directions`, in degrees, and the number of elements wanted there: 90,-60,4. May be given
    /// more than once.
    #[arg(long, value_name = "AZIMUTH,ELEVATION[,ELEMENTS]", allow_hyphen_values = true)]
    direction: Vec<String>,
    #[command(flatten)]
    limits: Limits,
    /// Number of layouts to evaluate.
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(20..=10_000_000))]
    evaluations: u32,
    /// Seed of the search.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Use one ray per beam: many times faster, but split beams go unnoticed.
    #[arg(long)]
    coarse: bool,
    /// Change a value of the scene first: superstructure.mirror.reflectivity=0.95, parameters.reach_mm=70.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Write optimum.json, front.csv, front.svg, a page, report.html, and the best layouts as scenes to this folder.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    replacing: Replacing,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    let options = options(arguments)?;
    let outputs = arguments.replacing.outputs([&arguments.scene]);
    let place = |out: &PathBuf| outputs.folder(out, &OPTIMUM_FOLDER);
    let place = arguments.out.as_ref().map(place).transpose()?;
    let scene = Scene::load_with(&arguments.scene, &arguments.set)?;
    let begin = Instant::now();
    let found = optimize(&scene, &options, &context.control()).map_err(|error| match error {
        Error::Optimize(error) => refused(error),
        other => other.into(),
    })?;
    context.reporter.finish();
    context.say(&format!(
        "evaluated {} in {:.1} s",
        counted(found.evaluations, "layout"),
        begin.elapsed().as_secs_f64()
    ));
    let mut next = String::new();
    if let Some(place) = place {
        let out = place.path().to_owned();
        write_optimum(&scene, &found, place)?;
        next = format!("wrote {}\n", quoted(&out.join(OPTIMUM_PAGE)));
        if found.best.is_some() {
            next += &format!(
                "next: catoptric layout {} {} --out side-by-side\n",
                quoted(&arguments.scene),
                quoted(&out.join(BEST_SCENE))
            );
        }
    }
    if arguments.json {
        print_json(&found)?;
    } else {
        print(&(text(&found) + &next))?;
    }
    context.check()?;
    if found.best.is_none() {
        return Err(CliError::Verdict(why_none(&found, arguments.coarse)));
    }
    Ok(())
}

fn options(arguments: &Arguments) -> Result<SearchOptions, CliError> {
    let wanted: Result<Vec<Wanted>, GoalError> =
        arguments.direction.iter().map(|t| Wanted::parse(t)).collect();
    let wanted = wanted.map_err(|e| refused(e.into()))?;
    let goals: Result<Vec<Goal>, GoalError> = arguments
        .goal
        .iter()
        .map(|text| Goal::parse(text, &wanted))
        .collect();
    let goals = goals.map_err(|e| refused(e.into()))?;
    let about_directions = goals.iter().any(|g| g.name() == "directions");
    if about_directions == wanted.is_empty() {
        return Err(refused(GoalError::Directions.into()));
    }
    for (number, goal) in goals.iter().enumerate() {
        if goals[..number].iter().any(|g| g.name() == goal.name()) {
            let message = format!("--goal {} is given twice", goal.name());
            return Err(CliError::invalid(message, None));
        }
    }
    Ok(SearchOptions {
        goals,
        requirements: arguments.limits.requirements(EXAMPLE)?,
        evaluations: arguments.evaluations as usize,
        seed: arguments.seed,
        detail: if arguments.coarse {
            Detail::Coarse
        } else {
            Detail::Full
        },
    })
}

/// An example of a requirement.
const EXAMPLE: &str = "field_of_regard>=0.004";

/// Why no layout is left: what keeps each requirement from being met, and why scenes were refused.
fn why_none(found: &Optimum, coarse: bool) -> String {
    let valid = found.evaluations
        - found
            .refused
            .iter()
            .map(|r| r.layouts)
            .sum::<usize>()
            .min(found.evaluations);
    let mut text = format!(
        "none of {} meets every requirement",
        counted(found.evaluations, "layout")
    );
    for hold in found.holds.iter().filter(|hold| hold.unmet > 0) {
        let reached = hold
            .reached
            .map_or_else(|| "no value".to_owned(), report::goal_value);
        text += &format!(
            "\n  {}: not met by {} of {valid}; best value reached: {reached}",
            hold.requirement, hold.unmet
        );
    }
    for refusal in &found.refused {
        text += &format!(
            "\n  {} refused, for example: {}",
            if refusal.layouts == 1 {
                "1 is".to_owned()
            } else {
                format!("{} are", refusal.layouts)
            },
            refusal.reason
        );
    }
    if coarse
        && found
            .holds
            .iter()
            .any(|h| h.unmet > 0 && h.requirement.contains("margin_mm"))
    {
        text += "\n  with --coarse no beam counts as split, and margins are those of beams that an edge may cut: leave it out";
    }
    text
}

fn refused(error: OptimizeError) -> CliError {
    let help = match &error {
        OptimizeError::NothingOpen => {
            Some("[parameters]\nreach_mm = { value = 64, low = 55, high = 85 }".to_owned())
        }
        OptimizeError::Goal(GoalError::Unknown { help, .. } | GoalError::Figure { help, .. }) => {
            Some(help.clone())
        }
        OptimizeError::Goal(GoalError::Directions) => {
            Some("--goal directions --direction 90,-60,4 --direction -90,60,4".to_owned())
        }
        OptimizeError::Goal(GoalError::Direction { .. })
        | OptimizeError::NoGoal
        | OptimizeError::NothingChanges => None,
        OptimizeError::Requirement(RequirementError::Form { .. } | RequirementError::Limit { .. }) => {
            Some(format!("--require '{EXAMPLE}'"))
        }
        OptimizeError::Requirement(RequirementError::Unknown { help, .. }) => Some(help.clone()),
        OptimizeError::Search(_) => return Error::from(error).into(),
        OptimizeError::Setup(_) => None,
    };
    CliError::invalid(error.to_string(), help)
}

/// The result as text.
fn text(found: &Optimum) -> String {
    let arrow = |better: Better| match better {
        Better::Up => "up",
        Better::Down => "down",
    };
    let goals: Vec<String> = found
        .goals
        .iter()
        .map(|g| {
            format!(
                "{}{} {}",
                g.name,
                g.unit.map_or_else(String::new, |u| format!(" ({u})")),
                arrow(g.better)
            )
        })
        .collect();
    let mut text = format!(
        "{}: {} on the front of {} that meet the requirements; goals: {}{}\n",
        printable_name(&found.name),
        counted(found.front.len(), "layout"),
        grouped(found.tried.len()),
        goals.join(", "),
        if found.interrupted { "; interrupted" } else { "" },
    );
    let mut rows: Vec<(String, &LayoutCandidate)> = vec![("as drawn".to_owned(), &found.start)];
    rows.extend(found.best.iter().map(|best| ("best".to_owned(), best)));
    rows.extend(
        shown(found)
            .into_iter()
            .enumerate()
            .map(|(i, c)| (format!("front-{:02}", i + 1), c)),
    );
    text += &format!("  {:10}", "");
    for goal in &found.goals {
        text += &format!("  {:>14}", goal.name);
    }
    text.push('\n');
    for (name, candidate) in rows {
        text += &format!("  {name:10}");
        for goal in &found.goals {
            let value = candidate.goals.get(&goal.name);
            text += &format!(
                "  {:>14}",
                value.map_or_else(|| "–".to_owned(), |v| report::goal_value(*v))
            );
        }
        if !candidate.is_kept() {
            text += "  (breaks a requirement)";
        }
        text.push('\n');
    }
    if let Some(best) = &found.best {
        text += if found.beats_start_in_every_goal {
            "  the best layout beats the drawing in every goal\n"
        } else {
            "  no layout beats the drawing in every goal\n"
        };
        for open in &found.parameters {
            let value = best.parameters.get(&open.name).copied().unwrap_or(open.start);
            if value != open.start {
                text += &format!("  {:16} {} → {value}\n", open.name, open.start);
            }
        }
    }
    if !found.without_effect.is_empty() {
        text += &format!(
            "  left as drawn, since they change nothing that is asked for: {}\n",
            found.without_effect.join(", ")
        );
    }
    let binding = found.holds.iter().filter(|hold| hold.binding);
    let binding: Vec<&str> = binding.map(|hold| hold.requirement.as_str()).collect();
    if !binding.is_empty() {
        text += &format!("  held back by: {}\n", binding.join(", "));
    }
    if let Some(why) = &found.why {
        let classes = why.elements.iter().filter(|(_, [a, b])| a != b);
        let classes: Vec<String> = classes
            .map(|(class, [a, b])| format!("{a} → {b} {}", class.words()))
            .collect();
        if !classes.is_empty() {
            text += &format!("  elements: {}\n", classes.join(", "));
        }
        for left in why.left_as_it_was.iter().take(3) {
            let goals = left
                .goals
                .iter()
                .map(|(name, value)| format!("{name} {}", report::goal_value(*value)));
            let goals: Vec<String> = goals.collect();
            let broken = if left.unmet.is_empty() {
                ""
            } else {
                "; breaks a requirement"
            };
            text += &format!(
                "  with {} left at {}: {}{broken}\n",
                left.parameter,
                left.start,
                goals.join(", ")
            );
        }
    }
    text
}
