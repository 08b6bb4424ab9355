//! `catoptric simulate`: simulates the experiment of a scene and writes it as a dataset.

use super::context::Context;
use super::error::CliError;
use super::output::{counted, print, print_json, quoted};
use super::outputs::Replacing;
use catoptric::{Recording, Scene, simulate_into};
use clap::Args;
use std::path::PathBuf;

/// Arguments of `simulate`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The scene, TOML or JSON.
    scene: PathBuf,
    /// The folder to write.
    #[arg(long, value_name = "DATASET")]
    out: PathBuf,
    /// Seed of all random effects, instead of the scene's.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Change a value first: experiment.scans_per_pose=20, superstructure.facet.0.name=left.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Print the figures of the run as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    replacing: Replacing,
    /// Write no truth/, and neither seed nor command into the manifest: the dataset is blind. A run of the same scene and seed without this option has the truth.
    #[arg(long, conflicts_with_all = ["returns", "readings", "sub_rays"])]
    blind: bool,
    /// Also write what every beam hits, truth/returns.csv.
    #[arg(long)]
    returns: bool,
    /// Also write every error of every reading, truth/readings.csv; large.
    #[arg(long)]
    readings: bool,
    /// Also write the path of every sub-ray, truth/sub_rays.csv; large.
    #[arg(long)]
    sub_rays: bool,
}

pub(crate) fn run(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    let mut scene = Scene::load_with(&arguments.scene, &arguments.set)?;
    if let Some(seed) = arguments.seed {
        scene = scene.with_seed(seed);
    }
    let recording = Recording {
        replace: arguments.replacing.replace,
        blind: arguments.blind,
        returns: arguments.returns,
        readings: arguments.readings,
        sub_rays: arguments.sub_rays,
        command_line: None,
    };
    let figures = simulate_into(&scene, &arguments.out, &recording, &context.control())?;
    context.detail(&format!(
        "built in {:.2} s, traced in {:.2} s, sampled in {:.2} s, written in {:.2} s",
        figures.build_s, figures.trace_s, figures.sample_s, figures.write_s
    ));
    if arguments.json {
        return print_json(&figures);
    }
    let scene = scene.resolved();
    let out = quoted(&arguments.out);
    let next = if scene.superstructure.facet.is_empty() && !scene.experiment.test.is_empty() {
        format!("catoptric characterize {out} --out characterization.json")
    } else {
        format!("catoptric calibrate {out} --out calibration.json")
    };
    print(&format!(
        "wrote {}: {} of {}, seed {}\nnext: {next}\n",
        arguments.out.display(),
        counted(figures.scans, "scan"),
        counted(figures.beams, "beam"),
        scene.seed,
    ))
}
