//! `catoptric export`: writes a layout as files for manufacturing and use, or a dataset's boards as a table.

use super::context::{Context, Reading};
use super::error::CliError;
use super::one_of::one_of;
use super::output::{counted, print, quoted};
use super::outputs::Replacing;
use catoptric::export::ExportPart;
use catoptric::{Error, ExportFormat, ExportOptions, Scene, export, export_boards, files};
use clap::Args;
use std::path::PathBuf;

/// Arguments of `export`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The scene, TOML or JSON; for csv also a dataset folder.
    #[arg(value_name = "SCENE|DATASET")]
    input: PathBuf,
    /// The format to write.
    #[arg(
        long,
        value_parser = one_of(&ExportFormat::ALL, ExportFormat::name, ExportFormat::about)
    )]
    format: ExportFormat,
    /// The file to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// The solids in an STL; all by default.
    #[arg(long, value_parser = one_of(&ExportPart::ALL, ExportPart::name, ExportPart::about))]
    part: Option<ExportPart>,
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
    #[command(flatten)]
    reading: Reading,
    #[command(flatten)]
    replacing: Replacing,
}

pub(crate) fn run(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    if arguments.input.is_dir() {
        return boards(arguments, context);
    }
    let default = ExportOptions::default();
    let reach_m = arguments.reach_m.unwrap_or(default.reach_m);
    if !(reach_m.is_finite() && reach_m > 0.0) {
        let message = format!("--reach-m must be a positive number, not {reach_m}");
        return Err(CliError::invalid(message, None));
    }
    let scene = Scene::load_with(&arguments.input, &arguments.set)?;
    let outputs = arguments.replacing.outputs(scene.files(&arguments.input));
    let out = outputs.place(&arguments.out)?;
    let options = ExportOptions {
        part: arguments.part.unwrap_or(default.part),
        reach_m,
        as_built: (arguments.as_built).then(|| arguments.seed.unwrap_or(scene.resolved().seed)),
    };
    let exported = export(&scene, arguments.format, &options)?;
    if !exported.shaded.is_empty() {
        let names: Vec<String> = exported.shaded.iter().map(usize::to_string).collect();
        context.say(&format!(
            "warning: the frame blocks {}: {}",
            counted(exported.shaded.len(), "element"),
            names.join(", ")
        ));
    }
    files::write_file(out, &exported.bytes)?;
    let parts = exported.parts;
    let what = match arguments.format {
        ExportFormat::Stl => format!("{}, millimeters", counted(parts, "solid")),
        ExportFormat::Glb => format!("{} and beams, meters", counted(parts, "mirror")),
        ExportFormat::Csv => counted(parts, "mirror"),
        ExportFormat::Urdf => format!("the laser and {}", counted(parts, "mirror")),
    };
    print(&format!("wrote {}: {what}\n", quoted(&arguments.out)))
}

/// Exports the boards of a dataset.
fn boards(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    let shown = quoted(&arguments.input);
    if arguments.format != ExportFormat::Csv {
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
    let dataset = context.read_dataset(&arguments.input, arguments.reading)?;
    let (table, boards) = export_boards(&dataset).map_err(|error| match error {
        Error::Invalid { message, help } => CliError::invalid(format!("{message} in {shown}"), help),
        other => other.into(),
    })?;
    let out = arguments
        .replacing
        .outputs([&arguments.input])
        .place(&arguments.out)?;
    files::write_file(out, &table)?;
    print(&format!(
        "wrote {}: {}\n",
        quoted(&arguments.out),
        counted(boards, "board")
    ))
}
