//! `catoptric export`: a layout as files for making and using it.

use super::Context;
use super::error::CliError;
use super::output::{counted, print, quoted};
use catoptric::export::{self, Part};
use catoptric::io::{self, scene};
use catoptric::layout::Drawing;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// Arguments of `export`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The scene, TOML or JSON.
    scene: PathBuf,
    /// What to write.
    #[arg(long, value_enum)]
    format: Format,
    /// The file.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Which solids an STL holds.
    #[arg(long, value_enum, default_value_t = Solids::All)]
    part: Solids,
    /// How far beams of a GLB go after their last mirror, in metres.
    #[arg(long, value_name = "M", default_value_t = 1.0)]
    reach_m: f64,
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
    /// Corners, angles and tolerances of every mirror
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
    if arguments.scene.is_dir() {
        return Err(CliError::Invalid {
            message: format!(
                "{} is a folder; these formats are made from a scene",
                arguments.scene.display()
            ),
            help: Some("a dataset keeps its scene in truth/scene.toml".to_owned()),
        });
    }
    if !(arguments.reach_m.is_finite() && arguments.reach_m > 0.0) {
        return Err(CliError::Invalid {
            message: format!(
                "--reach-m takes a positive number, it was given {}",
                arguments.reach_m
            ),
            help: None,
        });
    }
    let scene = scene::load(&arguments.scene, &arguments.set)?;
    let seed = arguments.as_built.then(|| arguments.seed.unwrap_or(scene.seed));
    let drawing = Drawing::new(&scene, seed)?;
    let (bytes, what) = match arguments.format {
        Format::Stl => {
            let part = match arguments.part {
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
            export::glb(&scene, &drawing, arguments.reach_m),
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
    io::write_file(&arguments.out, &bytes)?;
    print(&format!("wrote {}: {what}\n", quoted(&arguments.out)))
}
