//! `catoptric plan`: which board poses to record next, from the drawing or for what a dataset lacks.

use super::Context;
use super::error::CliError;
use super::interrupt;
use super::output::{counted, print, quoted};
use super::progress::Progress;
use catoptric::calib::plan::{self, FacetPlan, Open, Plan, PlannedPose, Request, Situation, Standing};
use catoptric::files::{self, dataset, scene};
use catoptric::model::Dataset;
use catoptric::model::place::nearest;
use catoptric::plan::{PlanError, completed, situation, with_poses};
use catoptric::report;
use catoptric::sim::Scene;
use clap::{Args, ValueEnum};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Reasons printed for each facet before the rest is only counted.
const REASONS: usize = 4;

/// Arguments of `plan`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// A scene, before anything is recorded, or a dataset: what its boards tell is the start.
    #[arg(value_name = "SCENE|DATASET")]
    input: PathBuf,
    /// Board poses for each facet.
    #[arg(long, value_name = "K", default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..=100))]
    poses: u16,
    /// Plan for this facet alone; may be given more than once.
    #[arg(long, value_name = "NAME")]
    facet: Vec<String>,
    /// What is to be small over the elements of a facet.
    #[arg(long, value_enum, default_value_t = CriterionName::D)]
    criterion: CriterionName,
    /// Least and greatest way from mirror to board, in metres.
    #[arg(
        long,
        value_name = "LEAST,GREATEST",
        value_delimiter = ',',
        default_value = "0.5,4"
    )]
    range_m: Vec<f64>,
    /// Largest incidence of a beam on a board, in degrees.
    #[arg(long, value_name = "DEG", default_value_t = 60.0)]
    max_incidence_deg: f64,
    /// Where the sequence of possible poses begins.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Change a value of the scene first: experiment.scans_per_pose=20.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Write the scene with these poses in it, ready to be simulated.
    #[arg(long, value_name = "scene.toml")]
    out: Option<PathBuf>,
    /// Write a page with pictures of the room.
    #[arg(long, value_name = "plan.html")]
    report: Option<PathBuf>,
    /// Print the plan as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum CriterionName {
    /// The area of the error ellipse: mean log det of the covariance
    D,
    /// The mean square error: mean trace of the covariance
    A,
}

/// Where the plan starts from.
enum Start {
    Drawing(Box<Scene>),
    Recording(Box<Dataset>),
}

pub(crate) fn run(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    let begin = Instant::now();
    let (start, situation, readings) = start(arguments)?;
    interrupt::check()?;
    let facets = facets(arguments, &situation)?;
    let request = request(arguments, readings)?;
    let mut progress = Progress::new(context, "planning", facets.len());
    let mut planned: Vec<FacetPlan> = Vec::with_capacity(facets.len());
    for some in facets.chunks(rayon::current_num_threads()) {
        interrupt::check()?;
        let found: Result<Vec<FacetPlan>, _> = some
            .par_iter()
            .map(|facet| plan::plan_facet(&situation, facet, &request))
            .collect();
        planned.extend(found.map_err(impossible)?);
        progress.advance(some.len());
    }
    drop(progress);
    interrupt::check()?;
    let plan = Plan {
        schema_version: plan::SCHEMA_VERSION,
        criterion: request.criterion,
        facets: planned,
    };
    let written = write(arguments, &start, &situation, &plan)?;
    context.detail(&format!("planned in {:.2} s", begin.elapsed().as_secs_f64()));
    if arguments.json {
        let json = serde_json::to_string(&plan).map_err(|e| CliError::Output(e.into()))?;
        return print(&format!("{json}\n"));
    }
    let facets: String = plan.facets.iter().map(text).collect();
    print(&(facets + &written))
}

fn start(arguments: &Arguments) -> Result<(Start, Situation, usize), CliError> {
    if !arguments.input.is_dir() {
        let scene = scene::load(&arguments.input, &arguments.set)?;
        let situation = situation(&scene).map_err(|error| match error {
            PlanError::Scene(error) => error.into(),
            PlanError::Plan(error) => impossible(error),
        })?;
        let readings = scene.experiment.scans_per_pose as usize;
        return Ok((Start::Drawing(Box::new(scene)), situation, readings));
    }
    if !arguments.set.is_empty() {
        return Err(CliError::Invalid {
            message: "--set changes a scene; a dataset is what it is".to_owned(),
            help: None,
        });
    }
    let dataset = files::read_dataset(&arguments.input)?;
    let situation = Situation::recorded(&dataset)?;
    // What is recorded next is taken to be recorded as long as what there is: the median, for one odd stretch.
    let mut scans: Vec<usize> = dataset
        .poses
        .iter()
        .filter(|p| p.room_from_board.is_some())
        .map(|p| p.label.scans)
        .collect();
    scans.sort_unstable();
    let readings = scans
        .get(scans.len() / 2)
        .copied()
        .unwrap_or(Request::default().readings);
    Ok((Start::Recording(Box::new(dataset)), situation, readings))
}

fn request(arguments: &Arguments, readings: usize) -> Result<Request, CliError> {
    let &[least, greatest] = arguments.range_m.as_slice() else {
        return Err(CliError::Invalid {
            message: format!(
                "--range-m takes two numbers, it was given {}",
                arguments.range_m.len()
            ),
            help: Some("--range-m 0.5,4".to_owned()),
        });
    };
    Ok(Request {
        poses: arguments.poses.into(),
        criterion: match arguments.criterion {
            CriterionName::D => plan::Criterion::D,
            CriterionName::A => plan::Criterion::A,
        },
        seed: arguments.seed,
        range_m: [least, greatest],
        max_incidence_deg: arguments.max_incidence_deg,
        readings,
        ..Request::default()
    })
}

/// The facets asked for, in the order of the session; all without a question.
fn facets(arguments: &Arguments, situation: &Situation) -> Result<Vec<String>, CliError> {
    let names: Vec<&str> = situation
        .session()
        .facets
        .iter()
        .map(|f| f.name.as_str())
        .collect();
    if names.is_empty() {
        return Err(CliError::Invalid {
            message: "there is no facet that a beam meets".to_owned(),
            help: None,
        });
    }
    if let Some(unknown) = arguments.facet.iter().find(|f| !names.contains(&f.as_str())) {
        let near = nearest(unknown, names.iter().copied());
        return Err(CliError::Invalid {
            message: format!("no facet is called {unknown:?}; there are {}", names.join(", ")),
            help: near.map(|near| format!("did you mean --facet {near}?")),
        });
    }
    let asked = |name: &&str| arguments.facet.is_empty() || arguments.facet.iter().any(|f| f == name);
    Ok(names.into_iter().filter(asked).map(str::to_owned).collect())
}

fn impossible(error: catoptric::calib::CalibError) -> CliError {
    CliError::Invalid {
        message: error.to_string(),
        help: Some("see --range-m and --max-incidence-deg, or plan for one --facet at a time".to_owned()),
    }
}

/// Writes what was asked for, and says so.
fn write(
    arguments: &Arguments,
    start: &Start,
    situation: &Situation,
    plan: &Plan,
) -> Result<String, CliError> {
    let mut said = String::new();
    if let Some(path) = &arguments.report {
        files::write_file(path, report::plan(situation, plan).as_bytes())?;
        said += &format!("wrote {}\n", path.display());
    }
    let Some(out) = &arguments.out else {
        let blind = matches!(start, Start::Recording(_)) && !arguments.input.join(dataset::SCENE).exists();
        let next = if blind {
            "next: record these poses, and calibrate\n".to_owned()
        } else {
            // The same again, whatever was asked for.
            let given: Vec<String> = std::env::args_os().skip(1).map(|a| quoted(a.as_ref())).collect();
            format!("next: catoptric {} --out planned.toml\n", given.join(" "))
        };
        return Ok(said + &next);
    };
    let (mut planned, folder) = match start {
        Start::Drawing(scene) => (with_poses(scene, plan)?, folder_of(&arguments.input)),
        Start::Recording(dataset) => {
            let path = arguments.input.join(dataset::SCENE);
            if !path.exists() {
                return Err(CliError::Invalid {
                    message: format!(
                        "{} is blind: there is no scene to put the poses in",
                        arguments.input.display()
                    ),
                    help: Some("plan without --out".to_owned()),
                });
            }
            (
                completed(&scene::load(&path, &[])?, dataset, plan),
                folder_of(&path),
            )
        }
    };
    move_meshes(&mut planned, &folder, &folder_of(out))?;
    let text = scene::to_toml(&planned).map_err(|e| CliError::Invalid {
        message: format!("{}: {e}", out.display()),
        help: None,
    })?;
    files::write_file(out, text.as_bytes())?;
    let stem = out.file_stem().unwrap_or(out.as_os_str()).to_string_lossy();
    Ok(said
        + &format!(
            "wrote {}: {}\nnext: catoptric simulate {} --out {}\n",
            out.display(),
            counted(planned.experiment.pose.len(), "pose"),
            quoted(out),
            quoted(format!("{stem}-dataset").as_ref())
        ))
}

fn folder_of(path: &Path) -> PathBuf {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
    folder.unwrap_or(Path::new(".")).to_owned()
}

/// Meshes are named from the scene's folder; in another folder they get their whole path.
fn move_meshes(scene: &mut Scene, from: &Path, to: &Path) -> Result<(), CliError> {
    let whole = |path: &Path| {
        path.canonicalize().map_err(|source| CliError::Write {
            path: path.to_owned(),
            source,
        })
    };
    if scene.mesh_shapes().is_empty() || whole(from)? == whole(to)? {
        return Ok(());
    }
    for mesh in scene.mesh_shapes_mut() {
        mesh.file = whole(&from.join(&mesh.file))?.display().to_string();
    }
    Ok(())
}

fn text(facet: &FacetPlan) -> String {
    let mut text = format!("facet {}: {}\n", facet.facet, standing(&facet.before));
    for (number, pose) in facet.poses.iter().enumerate() {
        text += &line(number + 1, pose);
    }
    text += &format!("  after: {}\n", standing(&facet.after));
    if facet.before.open > 0 {
        text += &reasons("open before", &facet.lacking);
    }
    if facet.after.open > 0 {
        text += &reasons("still open", &facet.open);
    }
    text
}

fn standing(standing: &Standing) -> String {
    let bound = |deg: Option<f64>| deg.map_or("none".to_owned(), |deg| format!("{deg:.4}°"));
    if standing.determined == 0 {
        return format!("{} open", counted(standing.open, "beam"));
    }
    format!(
        "{} determined, {} open; bound {} per axis, {} with the mounting",
        counted(standing.determined, "beam"),
        standing.open,
        bound(standing.bound_deg),
        bound(standing.bound_with_mounting_deg)
    )
}

fn line(number: usize, pose: &PlannedPose) -> String {
    let [x, y, z] = pose.center_m;
    let [yaw, pitch, roll] = pose.yaw_pitch_roll_deg;
    let served: Vec<String> = pose.beams.iter().map(|b| beams(*b)).collect();
    // Beams that a pose opens up count from then on, so a bound without their number would not say which beams it is of.
    let bound = |s: &Standing| match s.bound_deg {
        None => "all open".to_owned(),
        Some(deg) if s.open > 0 => format!("{deg:.4}° with {} open", s.open),
        Some(deg) => format!("{deg:.4}°"),
    };
    format!(
        "  {number}. {}: {}\n     center ({x:.3}, {y:.3}, {z:.3}) m, yaw {yaw:.1}°, pitch {pitch:.1}°, roll {roll:.1}°; \
         beams {}; {} → {}\n",
        pose.board,
        pose.words,
        served.join(", "),
        bound(&pose.before),
        bound(&pose.after)
    )
}

fn beams([first, last]: [usize; 2]) -> String {
    if first == last {
        first.to_string()
    } else {
        format!("{first}–{last}")
    }
}

fn reasons(title: &str, open: &[Open]) -> String {
    let shown = open.iter().take(REASONS);
    let mut text: String = shown
        .map(|o| format!("  {title}: {}: {}\n", beams(o.beams), o.reason))
        .collect();
    if open.len() > REASONS {
        let rest = counted(open.len() - REASONS, "more run");
        text += &format!("  {title}: {rest} of beams, in --json\n");
    }
    text
}
