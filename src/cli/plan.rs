//! `catoptric plan`: plans which board poses to record next, from the drawing or for what a dataset lacks.

use super::context::{Context, Reading};
use super::error::CliError;
use super::one_of::one_of;
use super::output::{counted, print, print_json, quoted};
use super::outputs::Replacing;
use catoptric::calib::plan::{Criterion, FacetPlan, Open, Plan, PlannedPose, Request, Standing};
use catoptric::files::names::printable_name;
use catoptric::files::{self, Content, dataset};
use catoptric::{
    Dataset, Output, PlanStart, Scene, completed_scene, plan, planned_scene, planned_text, report,
};
use clap::Args;
use std::path::PathBuf;
use std::time::Instant;

/// Number of reasons printed per facet; the rest is only counted.
const REASONS: usize = 4;

/// Arguments of `plan`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// A scene, before anything is recorded, or a dataset, whose boards are the starting point.
    #[arg(value_name = "SCENE|DATASET")]
    input: PathBuf,
    /// Number of board poses per facet.
    #[arg(long, value_name = "K", default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..=100))]
    poses: u16,
    /// Plan for this facet only; may be given more than once.
    #[arg(long, value_name = "NAME")]
    facet: Vec<String>,
    /// What to minimize over the elements of a facet.
    #[arg(
        long,
        value_parser = one_of(&Criterion::ALL, Criterion::name, Criterion::about),
        default_value = Criterion::default().name()
    )]
    criterion: Criterion,
    /// Minimum and maximum distance from mirror to board, in meters.
    #[arg(long, value_name = "MIN,MAX", value_delimiter = ',', default_value = "0.5,4")]
    range_m: Vec<f64>,
    /// Maximum incidence of a beam on a board, in degrees.
    #[arg(long, value_name = "DEG", default_value_t = 60.0)]
    max_incidence_deg: f64,
    /// Seed of the sequence of candidate poses.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Change a value of the scene first: experiment.scans_per_pose=20.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Write the scene with the planned poses, ready to simulate.
    #[arg(long, value_name = "scene.toml")]
    out: Option<PathBuf>,
    /// Write a page with pictures of the room.
    #[arg(long, value_name = "plan.html")]
    report: Option<PathBuf>,
    /// Print the plan as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    reading: Reading,
    #[command(flatten)]
    replacing: Replacing,
}

/// Where the plan is written.
struct Places {
    scene: Option<Output>,
    page: Option<Output>,
}

impl Places {
    fn of(arguments: &Arguments) -> Result<Self, CliError> {
        let outputs = arguments.replacing.outputs([&arguments.input]);
        let place = |path: &Option<PathBuf>, content| {
            path.as_ref().map(|path| outputs.file(path, content)).transpose()
        };
        Ok(Self {
            scene: place(&arguments.out, &Content::Scene)?,
            page: place(&arguments.report, &Content::Page)?,
        })
    }
}

/// Where the plan starts from.
enum Source {
    Drawing(Box<Scene>),
    Recording(Box<Dataset>),
}

pub(crate) fn run(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    let begin = Instant::now();
    let places = Places::of(arguments)?;
    let source = source(arguments, context)?;
    let start = match &source {
        Source::Drawing(scene) => PlanStart::of_scene(scene)?,
        Source::Recording(dataset) => PlanStart::of_dataset(dataset)?,
    };
    context.check()?;
    let facets = start.facets(&arguments.facet)?;
    let request = request(arguments, start.readings)?;
    let plan = plan(&start, &facets, &request, &context.control())?;
    let written = write(arguments, context, places, &source, &start, &plan)?;
    context.detail(&format!("planned in {:.2} s", begin.elapsed().as_secs_f64()));
    if arguments.json {
        return print_json(&plan);
    }
    let facets: String = plan.facets.iter().map(text).collect();
    print(&(facets + &written))
}

fn source(arguments: &Arguments, context: &Context) -> Result<Source, CliError> {
    if !arguments.input.is_dir() {
        let scene = Scene::load_with(&arguments.input, &arguments.set)?;
        return Ok(Source::Drawing(Box::new(scene)));
    }
    if !arguments.set.is_empty() {
        let message = "--set changes a scene; a dataset cannot be changed";
        return Err(CliError::invalid(message, None));
    }
    Ok(Source::Recording(Box::new(
        context.read_dataset(&arguments.input, arguments.reading)?,
    )))
}

fn request(arguments: &Arguments, readings: usize) -> Result<Request, CliError> {
    let &[least, greatest] = arguments.range_m.as_slice() else {
        let given = arguments.range_m.len();
        return Err(CliError::invalid(
            format!("--range-m takes two numbers, not {given}"),
            "--range-m 0.5,4".to_owned(),
        ));
    };
    Ok(Request {
        poses: arguments.poses.into(),
        criterion: arguments.criterion,
        seed: arguments.seed,
        range_m: [least, greatest],
        max_incidence_deg: arguments.max_incidence_deg,
        readings,
        ..Request::default()
    })
}

/// Writes the requested files and returns the lines that report them.
fn write(
    arguments: &Arguments,
    context: &Context,
    places: Places,
    source: &Source,
    start: &PlanStart,
    plan: &Plan,
) -> Result<String, CliError> {
    let mut said = String::new();
    let mut written = Vec::new();
    if let Some(page) = places.page {
        said += &format!("wrote {}\n", page.path().display());
        written.push((page, report::plan(&start.situation, plan).into_bytes()));
    }
    let Some(place) = places.scene else {
        files::write_files(&written)?;
        let blind = matches!(source, Source::Recording(_)) && !arguments.input.join(dataset::SCENE).exists();
        let next = if blind {
            "next: record these poses and calibrate\n".to_owned()
        } else {
            // Repeats the command with all its options.
            let given: Vec<String> = context.given.iter().map(|a| quoted(a.as_ref())).collect();
            format!("next: catoptric {} --out planned.toml\n", given.join(" "))
        };
        return Ok(said + &next);
    };
    let (planned, folder) = match source {
        Source::Drawing(scene) => (planned_scene(scene, plan)?, scene.folder().to_owned()),
        Source::Recording(dataset) => {
            let path = arguments.input.join(dataset::SCENE);
            if !path.exists() {
                let message = format!(
                    "{} is blind: there is no scene to add the poses to",
                    arguments.input.display()
                );
                return Err(CliError::invalid(message, "plan without --out".to_owned()));
            }
            let scene = Scene::load(&path)?;
            (completed_scene(&scene, dataset, plan), scene.folder().to_owned())
        }
    };
    let poses = planned.experiment.pose.len();
    let out = place.path().to_owned();
    let text = planned_text(planned, &folder, &out)?;
    written.push((place, text.into_bytes()));
    files::write_files(&written)?;
    let stem = out.file_stem().unwrap_or(out.as_os_str()).to_string_lossy();
    Ok(said
        + &format!(
            "wrote {}: {}\nnext: catoptric simulate {} --out {}\n",
            out.display(),
            counted(poses, "pose"),
            quoted(&out),
            quoted(format!("{stem}-dataset").as_ref())
        ))
}

fn text(facet: &FacetPlan) -> String {
    let mut text = format!(
        "facet {}: {}\n",
        printable_name(&facet.facet),
        standing(&facet.before)
    );
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
    // Beams that a pose determines are included from then on, so a bound is ambiguous without the number of open ones.
    let bound = |s: &Standing| match s.bound_deg {
        None => "all open".to_owned(),
        Some(deg) if s.open > 0 => format!("{deg:.4}° with {} open", s.open),
        Some(deg) => format!("{deg:.4}°"),
    };
    format!(
        "  {number}. {}: {}\n     center ({x:.3}, {y:.3}, {z:.3}) m, yaw {yaw:.1}°, pitch {pitch:.1}°, roll {roll:.1}°; \
         beams {}; {} → {}\n",
        printable_name(&pose.board),
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
