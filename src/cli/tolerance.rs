//! `catoptric tolerance`: analyzes the effect of manufacturing errors on a layout, before and after calibration.

use super::context::Context;
use super::error::CliError;
use super::judging::{Limits, require_help};
use super::layout::refused;
use super::output::{print, print_json, quoted};
use super::outputs::Replacing;
use catoptric::files::names::printable_name;
use catoptric::tolerance::{Distribution, Tolerance};
use catoptric::{
    Error, Scene, TOLERANCE_FOLDER, TOLERANCE_PAGE, ToleranceOptions, tolerance, write_tolerance,
};
use clap::Args;
use std::path::PathBuf;

/// Arguments of `tolerance`.
#[derive(Debug, Args)]
#[command(mut_arg("require", |option| option.help(require_help(EXAMPLE))))]
pub(crate) struct Arguments {
    /// The scene, TOML or JSON; its `superstructure.as_built` and `scanner.mount` specify the errors.
    scene: PathBuf,
    /// Number of structures to build, with consecutive seeds from --seed on.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    draws: u32,
    /// Seed of the first structure; the scene's own by default.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Predict the attainable calibration accuracy of the first N structures; 0 for none.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(0..=10_000))]
    bounds: u32,
    /// Simulate the experiment of the first N structures, calibrate it by `joint` and score it; 3 if no number is given.
    #[arg(long, value_name = "N", num_args = 0..=1, default_value_t = 0, default_missing_value = "3",
        value_parser = clap::value_parser!(u32).range(0..=10_000))]
    calibrate: u32,
    /// Change a value of the scene first: superstructure.as_built.tilt_sd_deg=0.1.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    #[command(flatten)]
    limits: Limits,
    /// Write tolerance.json, the plot and a page, report.html, to this folder.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    replacing: Replacing,
    /// Print all figures as JSON.
    #[arg(long)]
    json: bool,
}

/// An example of a requirement.
const EXAMPLE: &str = "direction_deg.p95<=2";

pub(crate) fn run(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    let options = ToleranceOptions {
        draws: arguments.draws,
        seed: arguments.seed,
        bounds: arguments.bounds,
        calibrate: arguments.calibrate,
        requirements: arguments.limits.requirements(EXAMPLE)?,
    };
    let outputs = arguments.replacing.outputs([&arguments.scene]);
    let place = |out: &PathBuf| outputs.folder(out, &TOLERANCE_FOLDER);
    let out = arguments.out.as_ref().map(place).transpose()?;
    let scene = Scene::load_with(&arguments.scene, &arguments.set)?;
    let (found, unmet) = tolerance(&scene, &options, &context.control()).map_err(|error| match error {
        Error::Requirement(error) => refused(error, EXAMPLE),
        other => other.into(),
    })?;
    let mut said = String::new();
    if let Some(out) = out {
        said = format!("wrote {}\n", quoted(&out.path().join(TOLERANCE_PAGE)));
        write_tolerance(&found, out)?;
    }
    if arguments.json {
        print_json(&found)?;
    } else {
        print(&(text(&found) + &said + &next(arguments, &found)))?;
    }
    if unmet.is_empty() {
        Ok(())
    } else {
        let unmet: Vec<String> = unmet.iter().map(|u| format!("not met: {u}")).collect();
        Err(CliError::Verdict(unmet.join("\n")))
    }
}

fn next(arguments: &Arguments, found: &Tolerance) -> String {
    let scene = quoted(&arguments.scene);
    match &arguments.out {
        None => format!("next: catoptric tolerance {scene} --out tolerance\n"),
        Some(_) => format!(
            "next: catoptric layout {scene} --as-built --seed {} --out worst\n",
            found.worst_seed
        ),
    }
}

fn number(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |v| format!("{v:.decimals$}"))
}

fn distribution(of: &Distribution, unit: &str, decimals: usize) -> String {
    format!(
        "{}{unit} rms, half within {}{unit}, 95 % within {}{unit}, all within {}{unit}",
        number(of.rms, decimals),
        number(of.median, decimals),
        number(of.p95, decimals),
        number(of.max, decimals),
    )
}

/// An analysis as text.
fn text(found: &Tolerance) -> String {
    let errors = &found.errors;
    let last = found.seed.wrapping_add(found.draws.saturating_sub(1) as u64);
    let mut text = format!(
        "{}: {} structures as built, seeds {} to {last}\n  facets turned by {}°, shifted by {} mm, thicker by {} mm (1σ), slope error \
         {} mrad; scanner within {}° of yaw, {}° of tilt, {} mm\n  before calibration:\n  directions {}\n  points at 4 m {}\n",
        printable_name(&found.name),
        found.draws,
        found.seed,
        errors.tilt_sd_deg,
        errors.shift_sd_mm,
        errors.thickness_sd_mm,
        errors.slope_rms_mrad,
        errors.mount_yaw_tolerance_deg,
        errors.mount_tilt_tolerance_deg,
        errors.mount_shift_tolerance_mm,
        distribution(&found.direction_deg, "°", 3),
        distribution(&found.point_at_4m_mm, " mm", 1),
    );
    let lengths = found.facets.iter().map(|f| f.name.chars().count());
    let width = lengths.max().unwrap_or(0);
    for facet in &found.facets {
        text += &format!(
            "  {:width$}  {:3} elements, {}\n",
            printable_name(&facet.name),
            facet.elements,
            distribution(&facet.direction_deg, "°", 3)
        );
    }
    let alone = found.sources.iter().map(|s| {
        format!(
            "{} {}° and {} mm",
            s.name,
            number(s.direction_rms_deg, 3),
            number(s.point_at_4m_rms_mm, 1)
        )
    });
    text += &format!("  each alone, rms: {}\n", alone.collect::<Vec<_>>().join(", "));
    text += &format!(
        "  split {} as drawn, {:.1} on average, {} at worst; without a direction {}, {:.1}, {} (seed {}); {:.1} of {} are no \
         longer their facet's, {} at worst\n",
        found.drawn.split,
        found.split_mean,
        found.split_worst,
        found.drawn.lost,
        found.lost_mean,
        found.lost_worst,
        found.worst_seed,
        found.changed_mean,
        found.drawn.deflected,
        found.changed_worst,
    );
    if let Some(bound) = &found.bound {
        text += &format!(
            "  after calibration, at best: {}° rms ({}° per axis) over {} structures; {} without a bound\n",
            number(bound.direction_rms_deg, 4),
            number(bound.per_axis_deg, 4),
            bound.structures,
            bound.without,
        );
    }
    if let Some(found) = &found.calibrated {
        text += &format!(
            "  after calibration, simulated: {}° rms ({}° per axis, bound {}°) over {} structures; {} not calibrated\n",
            number(found.direction_rms_deg, 4),
            number(found.per_axis_deg, 4),
            number(found.bound_per_axis_deg, 4),
            found.structures,
            found.failed,
        );
    }
    text
}
