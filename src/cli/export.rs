//! `catoptric export`: writes a layout as files for manufacturing and use, or a dataset's boards as a table.

use super::Context;
use super::error::CliError;
use super::output::{counted, print, quoted};
use catoptric::export::Part;
use catoptric::{Error, ExportFormat, Scene, export, export_boards, files};
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// Default length of the beams of a GLB after their last mirror, in meters.
const REACH_M: f64 = 1.0;

/// Arguments of `export`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The scene, TOML or JSON; for csv also a dataset folder.
    #[arg(value_name = "SCENE|DATASET")]
    input: PathBuf,
    /// The format to write.
    #[arg(long, value_enum)]
    format: FormatName,
    /// The file to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// The solids in an STL; all by default.
    #[arg(long, value_enum)]
    part: Option<Solids>,
    /// Length of the beams of a GLB after their last mirror, in meters; 1 by default.
    #[arg(long, value_name = "M")]
    reach_m: Option<f64>,
    /// Export the structure as built under the seed instead of the drawing.
    #[arg(long)]
    as_built: bool,
    /// Seed of the structure as built; the scene's own by default.
    #[arg(long, value_name = "N", requires = "as_built")]
    seed: Option<u64>,
    /// Change a value of the scene first: superstructure.mirror.thickness_mm=2.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum FormatName {
    /// Mirrors and a printable frame as closed solids, in millimeters
    Stl,
    /// Mirrors, housing and beams for viewing (binary glTF), in meters
    Glb,
    /// Of a scene: corners, angles and tolerances of every mirror; of a dataset: the readings of every beam on every
    /// board
    Csv,
    /// Frames of the laser and the mirrors in the rig
    Urdf,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Solids {
    /// The mirrors as plates
    Mirrors,
    /// The posts and a frame that holds the mirrors
    Frame,
    /// Both
    All,
}

pub(crate) fn run(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    if arguments.input.is_dir() {
        return boards(arguments, context);
    }
    let reach_m = arguments.reach_m.unwrap_or(REACH_M);
    if !(reach_m.is_finite() && reach_m > 0.0) {
        let message = format!("--reach-m must be a positive number, not {reach_m}");
        return Err(CliError::invalid(message, None));
    }
    let scene = Scene::load_with(&arguments.input, &arguments.set)?;
    let seed = arguments
        .as_built
        .then(|| arguments.seed.unwrap_or(scene.resolved().seed));
    let format = match arguments.format {
        FormatName::Stl => ExportFormat::Stl(match arguments.part.unwrap_or(Solids::All) {
            Solids::Mirrors => Part::Mirrors,
            Solids::Frame => Part::Frame,
            Solids::All => Part::All,
        }),
        FormatName::Glb => ExportFormat::Glb { reach_m },
        FormatName::Csv => ExportFormat::Csv,
        FormatName::Urdf => ExportFormat::Urdf,
    };
    let exported = export(&scene, format, seed)?;
    if !exported.shaded.is_empty() {
        let names: Vec<String> = exported.shaded.iter().map(usize::to_string).collect();
        context.say(&format!(
            "warning: the frame blocks {}: {}",
            counted(exported.shaded.len(), "element"),
            names.join(", ")
        ));
    }
    files::write_file(&arguments.out, &exported.bytes)?;
    let parts = exported.parts;
    let what = match arguments.format {
        FormatName::Stl => format!("{}, millimeters", counted(parts, "solid")),
        FormatName::Glb => format!("{} and beams, meters", counted(parts, "mirror")),
        FormatName::Csv => counted(parts, "mirror"),
        FormatName::Urdf => format!("the laser and {}", counted(parts, "mirror")),
    };
    print(&format!("wrote {}: {what}\n", quoted(&arguments.out)))
}

/// Exports the boards of a dataset.
fn boards(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    let shown = quoted(&arguments.input);
    if arguments.format != FormatName::Csv {
        return Err(CliError::invalid(
            format!(
                "{shown} is a folder; a dataset can be exported as csv only, the other formats need a scene"
            ),
            "the scene of a dataset is in its truth/scene.toml".to_owned(),
        ));
    }
    let of_scenes = [
        ("--part", arguments.part.is_some()),
        ("--reach-m", arguments.reach_m.is_some()),
        ("--as-built", arguments.as_built),
        ("--set", !arguments.set.is_empty()),
    ];
    if let Some((option, _)) = of_scenes.iter().find(|(_, given)| *given) {
        return Err(CliError::invalid(
            format!("{option} is for scenes, and {shown} is a folder"),
            "a dataset is exported as recorded".to_owned(),
        ));
    }
    let dataset = context.read_dataset(&arguments.input)?;
    let (table, boards) = export_boards(&dataset).map_err(|error| match error {
        Error::Invalid { message, help } => CliError::invalid(format!("{message} in {shown}"), help),
        other => other.into(),
    })?;
    files::write_file(&arguments.out, &table)?;
    print(&format!(
        "wrote {}: {}\n",
        quoted(&arguments.out),
        counted(boards, "board")
    ))
}
