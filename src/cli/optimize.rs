//! `catoptric optimize`: a search of a scene's parameters for better layouts.

use super::Context;
use super::error::CliError;
use super::interrupt;
use super::output::{counted, grouped, print, quoted};
use super::progress::Progress;
use catoptric::files::template::Template;
use catoptric::files::{self, IoError, scene};
use catoptric::layout::{Detail, Requirement, RequirementError};
use catoptric::optimize::{
    Better, Candidate, Goal, GoalError, OptimizeError, Optimum, Options, Wanted, optimize,
};
use catoptric::report;
use clap::Args;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Arguments of `optimize`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The scene, TOML or JSON, with parameters that have `low` and `high`.
    scene: PathBuf,
    /// What to improve: field_of_regard, split_beams, lost_beams, predicted_accuracy, size, directions, or a figure of
    /// `layout --json` and its way: share_within_5_deg:up. May be given more than once.
    #[arg(long, required = true, value_name = "GOAL")]
    goal: Vec<String>,
    /// A direction for the goal `directions`, in degrees, and how many elements should look there: 90,-60,4. May be given
    /// more than once.
    #[arg(long, value_name = "AZIMUTH,ELEVATION[,ELEMENTS]", allow_hyphen_values = true)]
    direction: Vec<String>,
    /// A limit that every layout has to keep: "facets.*.margin_mm>=0.3", "stopped_by_facets<=0". May be given more than
    /// once.
    #[arg(long, value_name = "FIGURE>=NUMBER")]
    require: Vec<String>,
    /// How many layouts to look at.
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(20..=10_000_000))]
    evaluations: u32,
    /// Seed of the search.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// One ray per beam: many times faster, and blind to beams that an edge cuts.
    #[arg(long)]
    coarse: bool,
    /// Change a value first: superstructure.mirror.reflectivity=0.95, parameters.reach_mm=70.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Write optimum.json, front.csv, front.svg, a page, report.html, and the best layouts as scenes into this folder.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print what was found as JSON.
    #[arg(long)]
    json: bool,
}

/// Layouts of the front that are shown and written, at most.
const SHOWN: usize = 12;

pub(crate) fn run(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    let options = options(arguments)?;
    let template = Template::load(&arguments.scene, &arguments.set)?;
    let begin = Instant::now();
    let mut progress = Progress::new(context, "searching", options.evaluations);
    let found = optimize(&template, &options, &mut |p| {
        progress.advance(p.more);
        interrupt::check().is_ok()
    });
    drop(progress);
    let found = found.map_err(refused)?;
    context.say(&format!(
        "looked at {} in {:.1} s",
        counted(found.evaluations, "layout"),
        begin.elapsed().as_secs_f64()
    ));
    let json = serde_json::to_string(&found).map_err(|e| CliError::Output(e.into()))? + "\n";
    let mut next = String::new();
    if let Some(out) = &arguments.out {
        write(out, &json, &template, &found)?;
        next = format!("wrote {}\n", quoted(&out.join(PAGE)));
        if found.best.is_some() {
            next += &format!(
                "next: catoptric layout {} {} --out side-by-side\n",
                quoted(&arguments.scene),
                quoted(&out.join(BEST))
            );
        }
    }
    if arguments.json {
        print(&json)?;
    } else {
        print(&(text(&found) + &next))?;
    }
    interrupt::check()?;
    if found.best.is_none() {
        let nearest = found.start.unmet.join("\n");
        return Err(CliError::Verdict(format!(
            "no layout that was looked at keeps every requirement; as drawn:\n{nearest}"
        )));
    }
    Ok(())
}

fn options(arguments: &Arguments) -> Result<Options, CliError> {
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
            return Err(CliError::Invalid {
                message: format!("--goal {} is given twice", goal.name()),
                help: None,
            });
        }
    }
    let requirements: Result<Vec<Requirement>, RequirementError> = arguments
        .require
        .iter()
        .map(|text| Requirement::parse(text))
        .collect();
    Ok(Options {
        goals,
        requirements: requirements.map_err(|e| refused(e.into()))?,
        evaluations: arguments.evaluations as usize,
        seed: arguments.seed,
        detail: if arguments.coarse {
            Detail::Coarse
        } else {
            Detail::Full
        },
    })
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
        OptimizeError::Goal(GoalError::Direction { .. }) | OptimizeError::NoGoal => None,
        OptimizeError::Requirement(RequirementError::Form { .. }) => {
            Some("--require 'facets.*.margin_mm>=0.3'".to_owned())
        }
        OptimizeError::Requirement(RequirementError::Unknown { help, .. }) => Some(help.clone()),
        OptimizeError::Search(_) => return CliError::Output(std::io::Error::other(error)),
        OptimizeError::Setup(_) => None,
    };
    CliError::Invalid {
        message: error.to_string(),
        help,
    }
}

/// Names of what is written.
const JSON: &str = "optimum.json";
const PAGE: &str = "report.html";
const PICTURE: &str = "front.svg";
const TABLE: &str = "front.csv";
const BEST: &str = "best.toml";

fn write(out: &Path, json: &str, template: &Template, found: &Optimum) -> Result<(), CliError> {
    std::fs::create_dir_all(out).map_err(|e| IoError::write(out, e))?;
    if let Some(best) = &found.best {
        write_scene(&out.join(BEST), template, best)?;
    }
    for (number, candidate) in shown(found).into_iter().enumerate() {
        write_scene(
            &out.join(format!("front-{:02}.toml", number + 1)),
            template,
            candidate,
        )?;
    }
    files::write_file(out.join(TABLE), table(found)?.as_slice())?;
    if let Some(picture) = report::front_picture(found) {
        files::write_file(out.join(PICTURE), picture.as_bytes())?;
    }
    files::write_file(out.join(PAGE), report::optimum(found).as_bytes())?;
    files::write_file(out.join(JSON), json.as_bytes())?;
    Ok(())
}

/// A layout as a scene, with the meshes that it names beside it.
fn write_scene(path: &Path, template: &Template, candidate: &Candidate) -> Result<(), CliError> {
    let choice = candidate.choice();
    let refused = |problems: Vec<String>| CliError::Output(std::io::Error::other(problems.join("; ")));
    let found = template.with(&choice).map_err(refused)?;
    let (kept, meshes) = scene::kept(&found);
    let folder = path.parent().unwrap_or(Path::new("."));
    for (name, bytes) in meshes {
        let mesh = folder.join(name);
        if let Some(parent) = mesh.parent() {
            std::fs::create_dir_all(parent).map_err(|e| IoError::write(parent, e))?;
        }
        files::write_file(mesh, &bytes)?;
    }
    let text = template
        .text_with(&choice, &kept)
        .ok_or_else(|| refused(vec!["a number that TOML cannot hold".to_owned()]))?;
    let goals: Vec<String> = candidate
        .goals
        .iter()
        .map(|(name, value)| format!("{name} {value:.6}"))
        .collect();
    let text = format!(
        "# Found by catoptric optimize in {}: {}.\n{text}",
        template.name(),
        goals.join(", ")
    );
    files::write_file(path, text.as_bytes())?;
    Ok(())
}

/// The front, or some of it from one end to the other.
fn shown(found: &Optimum) -> Vec<&Candidate> {
    let count = found.front.len();
    if count <= SHOWN {
        return found.front.iter().collect();
    }
    (0..SHOWN)
        .map(|k| &found.front[k * (count - 1) / (SHOWN - 1)])
        .collect()
}

/// The whole front as CSV.
fn table(found: &Optimum) -> Result<Vec<u8>, CliError> {
    let failed = |e: csv::Error| CliError::Output(std::io::Error::other(e));
    let mut writer = csv::Writer::from_writer(Vec::new());
    let goals = || found.goals.iter().map(|g| g.name.clone());
    let parameters = || found.parameters.iter().map(|p| p.name.clone());
    let heading: Vec<String> = std::iter::once("number".to_owned())
        .chain(goals())
        .chain(parameters())
        .collect();
    writer.write_record(heading).map_err(failed)?;
    for candidate in &found.front {
        let values = goals().map(|g| candidate.goals.get(&g).copied());
        let values = values.chain(parameters().map(|p| candidate.parameters.get(&p).copied()));
        let values = values.map(|v| v.map_or_else(String::new, |v| v.to_string()));
        let row: Vec<String> = std::iter::once(candidate.number.to_string())
            .chain(values)
            .collect();
        writer.write_record(row).map_err(failed)?;
    }
    writer.into_inner().map_err(|e| CliError::Output(e.into_error()))
}

/// What was found, for people.
fn text(found: &Optimum) -> String {
    let way = |better: Better| match better {
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
                way(g.better)
            )
        })
        .collect();
    let mut text = format!(
        "{}: {} on the front of {} that keep the requirements; goals: {}{}\n",
        found.name,
        counted(found.front.len(), "layout"),
        grouped(found.tried.len()),
        goals.join(", "),
        if found.interrupted { "; interrupted" } else { "" },
    );
    let mut rows: Vec<(String, &Candidate)> = vec![("as drawn".to_owned(), &found.start)];
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
            "  the best is better than the drawing in every goal\n"
        } else {
            "  nothing is better than the drawing in every goal\n"
        };
        for open in &found.parameters {
            let value = best.parameters.get(&open.name).copied().unwrap_or(open.start);
            if value != open.start {
                text += &format!("  {:16} {} → {value}\n", open.name, open.start);
            }
        }
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
