//! `catoptric check`: checks that a scene can be simulated, and reports the size of the experiment.

use super::context::Context;
use super::error::CliError;
use super::output::{counted, print, quoted};
use catoptric::sim::Laboratory;
use catoptric::sim::check::{Outline, outline};
use catoptric::sim::trace::Scenery;
use catoptric::{Scene, sim};
use clap::Args;
use std::path::PathBuf;

/// Arguments of `check`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The scene, TOML or JSON.
    scene: PathBuf,
    /// Change a value first: experiment.scans_per_pose=20, superstructure.facet.0.name=left.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

pub(crate) fn run(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    let scene = Scene::load_with(&arguments.scene, &arguments.set)?;
    context.warn_of(&scene);
    let scene = scene.resolved();
    if scene.has_no_laboratory() {
        return open_stage(arguments, scene);
    }
    let outline = outline(scene);
    if scene.only_shows_mirrors() {
        return print(&format!(
            "ok: {}: {}{}, no laboratory\nnext: catoptric layout {} --out layout\n",
            scene.name,
            counted(outline.facets.len(), "facet"),
            served(&outline),
            quoted(&arguments.scene),
        ));
    }
    // Setting up the experiment finds problems that no single value shows, such as a board that fits nowhere.
    let laboratory = Laboratory::new(scene, scene.seed)?;
    let flights = match scene.flight.len() {
        0 => String::new(),
        flights => format!(", {}", counted(flights, "flight")),
    };
    let mut text = format!(
        "ok: {}: {}{}, {}, {}{flights}, {}, {}\n",
        scene.name,
        counted(outline.facets.len(), "facet"),
        served(&outline),
        counted(scene.board.len(), "board"),
        counted(laboratory.board_poses(), "pose"),
        counted(laboratory.scans(), "scan"),
        counted(laboratory.scans() * laboratory.sensor().scan().beams(), "reading"),
    );
    if context.global.verbose > 0 {
        for facet in &outline.facets {
            text.push_str(&format!("  {}: {}\n", facet.name, counted(facet.beams, "beam")));
        }
        text.push_str(&format!(
            "  undeflected: {}\n",
            counted(outline.direct_beams, "beam")
        ));
        text.push_str(&format!(
            "  blocked: {}\n",
            counted(outline.blocked_beams, "beam")
        ));
    }
    let sets: String = arguments
        .set
        .iter()
        .map(|s| format!(" --set {}", quoted(s.as_ref())))
        .collect();
    let stem = arguments.scene.file_stem().unwrap_or(arguments.scene.as_os_str());
    let dataset = format!("{}-dataset", stem.to_string_lossy());
    text.push_str(&format!(
        "next: catoptric simulate {} --out {}{sets}\n",
        quoted(&arguments.scene),
        quoted(dataset.as_ref()),
    ));
    print(&text)
}

/// Checks a scene that is only for tracing rays.
fn open_stage(arguments: &Arguments, scene: &sim::Scene) -> Result<(), CliError> {
    Scenery::new(scene)?.tracer(1)?;
    print(&format!(
        "ok: {}: {}, {}, no laboratory\nnext: catoptric trace {} --rays RAYS.csv --out PATHS.csv\n",
        scene.name,
        counted(scene.room.mirror.len(), "mirror"),
        counted(scene.room.surface.len(), "surface"),
        quoted(&arguments.scene),
    ))
}

/// The number of beams that each facet deflects according to the drawing.
fn served(outline: &Outline) -> String {
    let beams = || outline.facets.iter().map(|f| f.beams);
    match (beams().min(), beams().max()) {
        (Some(least), Some(most)) if least == most => format!(" of {}", counted(least, "beam")),
        (Some(least), Some(most)) => format!(" of {least} to {}", counted(most, "beam")),
        _ => String::new(),
    }
}
