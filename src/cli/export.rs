//! `catoptric export`: a layout as files for making and using it, a dataset's boards as a table.

use super::Context;
use super::error::CliError;
use super::output::{counted, print, quoted};
use catoptric::export::{self, Part};
use catoptric::files::{self, scene};
use catoptric::layout::Drawing;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// Arguments of `export`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The scene, TOML or JSON; for csv a dataset's folder too.
    #[arg(value_name = "SCENE|DATASET")]
    input: PathBuf,
    /// What to write.
    #[arg(long, value_enum)]
    format: Format,
    /// The file.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Which solids an STL holds; all by default.
    #[arg(long, value_enum)]
    part: Option<Solids>,
    /// How far beams of a GLB go after their last mirror, in metres; 1 by default.
    #[arg(long, value_name = "M")]
    reach_m: Option<f64>,
    /// Export the structure as built under the seed instead of the drawing.
    #[arg(long)]
    as_built: bool,
    /// Seed of the structure as built; the scene's own by default.
    #[arg(long, value_name = "N", requires = "as_built")]
    seed: Option<u64>,
    /// Change a value first: superstructure.mirror.thickness_mm=2.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// Mirrors and a printable frame as closed solids, in millimetres
    Stl,
    /// Mirrors, housing and beams to look at (binary glTF), in metres
    Glb,
    /// Of a scene: corners, angles and tolerances of every mirror; of a dataset: what every beam read of every board
    Csv,
    /// The laser's and the mirrors' frames in the rig
    Urdf,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Solids {
    /// The mirrors as plates
    Mirrors,
    /// The posts, and a frame that holds the mirrors
    Frame,
    /// Both
    All,
}

pub(crate) fn run(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    if arguments.input.is_dir() {
        return boards(arguments);
    }
    let reach_m = arguments.reach_m.unwrap_or(1.0);
    if !(reach_m.is_finite() && reach_m > 0.0) {
        return Err(CliError::Invalid {
            message: format!("--reach-m takes a positive number, it was given {reach_m}"),
            help: None,
        });
    }
    let scene = scene::load(&arguments.input, &arguments.set)?;
    let seed = arguments.as_built.then(|| arguments.seed.unwrap_or(scene.seed));
    let drawing = Drawing::new(&scene, seed)?;
    let (bytes, what) = match arguments.format {
        Format::Stl => {
            let part = match arguments.part.unwrap_or(Solids::All) {
                Solids::Mirrors => Part::Mirrors,
                Solids::Frame => Part::Frame,
                Solids::All => Part::All,
            };
            let solids = export::solids(&scene, &drawing, part);
            if solids.is_empty() {
                return Err(CliError::Invalid {
                    message: "the scene has nothing of that kind to make".to_owned(),
                    help: Some("see --part".to_owned()),
                });
            }
            if part != Part::Mirrors {
                let shaded = export::shaded_by_frame(&scene, seed)?;
                if !shaded.is_empty() {
                    let names: Vec<String> = shaded.iter().map(usize::to_string).collect();
                    context.say(&format!(
                        "warning: the frame takes the sight of {}: {}",
                        counted(shaded.len(), "element"),
                        names.join(", ")
                    ));
                }
            }
            (
                export::stl(&solids),
                format!("{}, millimetres", counted(solids.len(), "solid")),
            )
        }
        Format::Glb => (
            export::glb(&scene, &drawing, reach_m),
            format!("{} and beams, metres", counted(drawing.facets.len(), "mirror")),
        ),
        Format::Csv => {
            let table = export::drawing_table(&scene, &drawing);
            let table = table.map_err(|e| CliError::Output(std::io::Error::other(e)))?;
            (table, counted(drawing.facets.len(), "mirror"))
        }
        Format::Urdf => (
            export::urdf(&scene, &drawing).into_bytes(),
            format!("the laser and {}", counted(drawing.facets.len(), "mirror")),
        ),
    };
    files::write_file(&arguments.out, &bytes)?;
    print(&format!("wrote {}: {what}\n", quoted(&arguments.out)))
}

/// The boards of a dataset.
fn boards(arguments: &Arguments) -> Result<(), CliError> {
    let shown = quoted(&arguments.input);
    if arguments.format != Format::Csv {
        return Err(CliError::Invalid {
            message: format!(
                "{shown} is a folder; of a dataset there is csv, the other formats are made from a scene"
            ),
            help: Some("a dataset keeps its scene in truth/scene.toml".to_owned()),
        });
    }
    let of_scenes = [
        ("--part", arguments.part.is_some()),
        ("--reach-m", arguments.reach_m.is_some()),
        ("--as-built", arguments.as_built),
        ("--set", !arguments.set.is_empty()),
    ];
    if let Some((option, _)) = of_scenes.iter().find(|(_, given)| *given) {
        return Err(CliError::Invalid {
            message: format!("{option} is for scenes, and {shown} is a folder"),
            help: Some("a dataset is exported as it was recorded".to_owned()),
        });
    }
    let dataset = files::read_dataset(&arguments.input)?;
    let boards = dataset.poses.iter().filter(|p| export::has_rows(p)).count();
    if boards == 0 {
        return Err(CliError::Invalid {
            message: format!("no board was recorded in {shown}"),
            help: Some("a flight and an empty room have no rows in this table".to_owned()),
        });
    }
    let table = export::board_table(&dataset).map_err(|e| CliError::Output(std::io::Error::other(e)))?;
    files::write_file(&arguments.out, &table)?;
    print(&format!(
        "wrote {}: {}\n",
        quoted(&arguments.out),
        counted(boards, "board")
    ))
}
