//! `catoptric trace`: traces arbitrary rays through a scene and writes their paths.

use super::context::Context;
use super::error::CliError;
use super::output::{counted, print, print_json};
use super::outputs::Replacing;
use catoptric::files::IoError;
use catoptric::{Error, MAX_BOUNCES, Scene, trace};
use clap::Args;
use std::io::ErrorKind;
use std::path::PathBuf;

/// Arguments of `trace`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The scene, TOML or JSON. It needs neither a scanner nor a laboratory.
    scene: PathBuf,
    /// The rays, in the room frame: CSV with the columns x_m,y_m,z_m,dx,dy,dz, or a NumPy array of N × 6.
    #[arg(long, value_name = "IN")]
    rays: PathBuf,
    /// The paths to write: CSV with one line per vertex, or a NumPy array of N × 3 (distance to the first vertex or inf,
    /// number of the surface at the end or -1, total length of the path or inf).
    #[arg(long, value_name = "OUT")]
    out: PathBuf,
    /// Change a value first: room.mirror.0.yaw_deg=30.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Maximum number of reflections of a ray.
    #[arg(long, value_name = "N", default_value_t = MAX_BOUNCES)]
    max_bounces: u16,
    /// Print the figures of the run as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    replacing: Replacing,
}

pub(crate) fn run(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    let scene = Scene::load_with(&arguments.scene, &arguments.set)?;
    let outputs = arguments.replacing.outputs(scene.files(&arguments.scene));
    let out = outputs.place(&arguments.out)?;
    let figures = trace(
        &scene,
        &arguments.rays,
        out,
        arguments.max_bounces,
        &context.control(),
    )
    .map_err(quiet)?;
    context.detail(&format!(
        "built in {:.2} s, traced in {:.2} s",
        figures.build_s, figures.trace_s
    ));
    if arguments.json {
        return print_json(&figures);
    }
    print(&format!(
        "wrote {}: {}, {} on a surface, {} trapped between mirrors\nnext: catoptric trace --help\n",
        arguments.out.display(),
        counted(figures.rays, "ray"),
        figures.hits,
        figures.trapped,
    ))
}

/// A pipe closed by its reader is not an error.
fn quiet(error: Error) -> CliError {
    match error {
        Error::File(IoError::Write { source, .. }) if source.kind() == ErrorKind::BrokenPipe => {
            CliError::ClosedPipe
        }
        other => other.into(),
    }
}
