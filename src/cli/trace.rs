//! `catoptric trace`: any rays through a scene, and the ways they go.

use super::Context;
use super::error::CliError;
use super::interrupt;
use super::output::{counted, print};
use catoptric::cast::Ray;
use catoptric::io::rays::{PathWriter, RayReader, field, rows};
use catoptric::io::{IoError, scene};
use catoptric::sim::trace::{Fate, Scenery};
use clap::Args;
use rayon::prelude::*;
use serde::Serialize;
use std::io::ErrorKind;
use std::path::PathBuf;
use std::time::Instant;

/// Rays in memory at a time: enough that no thread waits, few enough that millions need no more memory.
const WINDOW: usize = 1 << 16;

/// Rays that one thread takes at a time.
const BATCH: usize = 1 << 10;

/// Arguments of `trace`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The scene, TOML or JSON. It needs neither scanner nor laboratory.
    scene: PathBuf,
    /// The rays, in the room frame: CSV with the columns x_m,y_m,z_m,dx,dy,dz, or a NumPy array of N × 6.
    #[arg(long, value_name = "IN")]
    rays: PathBuf,
    /// Where to write the paths: CSV, a line for every vertex, or a NumPy array of N × 3 (distance to the first vertex
    /// or inf, number of the surface at the end or -1, length of the whole path or inf).
    #[arg(long, value_name = "OUT")]
    out: PathBuf,
    /// Change a value first: room.mirror.0.yaw_deg=30.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Mirrors that a ray may meet.
    #[arg(long, value_name = "N", default_value_t = 64)]
    max_bounces: u16,
    /// Print figures of the run as JSON.
    #[arg(long)]
    json: bool,
}

/// Figures of a run: what `trace --json` prints.
#[derive(Debug, Default, Serialize)]
struct Figures {
    rays: usize,
    /// Rays that end on a surface.
    hits: usize,
    /// Rays that end between mirrors, after the last bounce allowed or in the rim of a glass.
    trapped: usize,
    build_s: f64,
    trace_s: f64,
    threads: usize,
    /// Names of the surfaces by their number.
    surfaces: Vec<String>,
}

/// What a thread made of some rays.
struct Traced {
    rows: Vec<u8>,
    hits: usize,
    trapped: usize,
}

pub(crate) fn run(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    let begin = Instant::now();
    let scene = scene::load(&arguments.scene, &arguments.set)?;
    let scenery = Scenery::new(&scene)?;
    let tracer = scenery.tracer(arguments.max_bounces.into())?;
    let mut figures = Figures {
        threads: rayon::current_num_threads(),
        surfaces: tracer.surfaces().into_iter().map(str::to_owned).collect(),
        ..Figures::default()
    };
    figures.build_s = begin.elapsed().as_secs_f64();
    let fields: Vec<String> = figures.surfaces.iter().map(|name| field(name)).collect();
    let begin = Instant::now();
    let mut reader = RayReader::open(&arguments.rays)?;
    let mut writer = PathWriter::create(&arguments.out).map_err(quiet)?;
    let format = writer.format();
    loop {
        interrupt::check()?;
        let window: Vec<Ray> = reader.next_rays(WINDOW)?;
        if window.is_empty() {
            break;
        }
        let first = figures.rays;
        let batches: Vec<Traced> = window
            .par_chunks(BATCH)
            .enumerate()
            .map(|(batch, rays)| {
                let mut traced = Traced {
                    rows: Vec::new(),
                    hits: 0,
                    trapped: 0,
                };
                let mut vertices = Vec::new();
                for (i, ray) in rays.iter().enumerate() {
                    vertices.clear();
                    let fate = tracer.follow(ray, &mut vertices);
                    traced.hits += usize::from(fate == Fate::Hit);
                    traced.trapped += usize::from(fate == Fate::Trapped);
                    let number = first + batch * BATCH + i;
                    rows(format, number, &vertices, fate, &fields, &mut traced.rows);
                }
                traced
            })
            .collect();
        figures.rays += window.len();
        for (rays, traced) in window.chunks(BATCH).zip(&batches) {
            figures.hits += traced.hits;
            figures.trapped += traced.trapped;
            writer.write(rays.len(), &traced.rows).map_err(quiet)?;
        }
    }
    writer.finish().map_err(quiet)?;
    figures.trace_s = begin.elapsed().as_secs_f64();
    context.detail(&format!(
        "built in {:.2} s, traced in {:.2} s",
        figures.build_s, figures.trace_s
    ));
    if arguments.json {
        let json = serde_json::to_string(&figures).map_err(|e| CliError::Output(e.into()))?;
        return print(&format!("{json}\n"));
    }
    print(&format!(
        "wrote {}: {}, {} on a surface, {} trapped between mirrors\nnext: catoptric trace --help\n",
        arguments.out.display(),
        counted(figures.rays, "ray"),
        figures.hits,
        figures.trapped,
    ))
}

/// A pipe that nobody reads any more is no error.
fn quiet(error: IoError) -> CliError {
    match error {
        IoError::Write { source, .. } if source.kind() == ErrorKind::BrokenPipe => CliError::ClosedPipe,
        other => other.into(),
    }
}
