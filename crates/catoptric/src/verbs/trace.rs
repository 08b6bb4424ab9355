//! Tracing of arbitrary rays through a scene, from a file of rays to a file of paths.

use crate::{Control, Error, Scene};
use catoptric_files::Output;
use catoptric_files::rays::{PathWriter, RayReader, field, rows};
use catoptric_sim::trace::{Fate, Scenery};
use rayon::prelude::*;
use serde::Serialize;
use std::path::Path;
use std::time::Instant;

/// Number of rays in memory at a time: enough to keep all threads busy, and independent of the number of rays.
const WINDOW: usize = 1 << 16;

/// Number of rays that one thread takes at a time.
const BATCH: usize = 1 << 10;

/// Default maximum number of reflections of a ray.
pub const MAX_BOUNCES: u16 = 64;

/// Statistics of the traced rays: `trace --json`.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct TraceFigures {
    /// Rays read.
    pub rays: usize,
    /// Rays that end on a surface.
    pub hits: usize,
    /// Rays that end between mirrors, after the last bounce allowed, or in the rim of a glass plate.
    pub trapped: usize,
    /// Time to set up the scene, in seconds.
    pub build_s: f64,
    /// Time to read, trace and write, in seconds.
    pub trace_s: f64,
    /// Number of threads used.
    pub threads: usize,
    /// Names of the surfaces, by number.
    pub surfaces: Vec<String>,
}

/// Results of one thread for some rays.
struct Traced {
    rows: Vec<u8>,
    hits: usize,
    trapped: usize,
}

/// Traces the rays of a file through a scene and writes their paths; the file extensions select the formats.
///
/// For rays in memory use [`sim::trace::Tracer`](catoptric_sim::trace::Tracer).
///
/// # Errors
/// [`Error::Setup`] if the scene cannot be set up, [`Error::File`] with the line of an invalid ray or if writing fails,
/// [`Error::Stopped`].
pub fn trace(
    scene: &Scene,
    rays: impl AsRef<Path>,
    out: impl Into<Output>,
    max_bounces: u16,
    control: &Control,
) -> Result<TraceFigures, Error> {
    let (rays, out) = (rays.as_ref(), out.into().sparing([rays.as_ref()]));
    control.run(|| trace_files(scene, rays, out, max_bounces, control))
}

fn trace_files(
    scene: &Scene,
    rays: &Path,
    out: catoptric_files::Output,
    max_bounces: u16,
    control: &Control,
) -> Result<TraceFigures, Error> {
    let begin = Instant::now();
    let scenery = Scenery::new(scene.resolved())?;
    let tracer = scenery.tracer(max_bounces.into())?;
    let mut figures = TraceFigures {
        threads: rayon::current_num_threads(),
        surfaces: tracer.surfaces().into_iter().map(str::to_owned).collect(),
        ..TraceFigures::default()
    };
    figures.build_s = begin.elapsed().as_secs_f64();
    let fields: Vec<String> = figures.surfaces.iter().map(|name| field(name)).collect();
    let begin = Instant::now();
    let mut reader = RayReader::open(rays)?;
    let mut writer = PathWriter::create(out)?;
    let format = writer.format();
    loop {
        control.check()?;
        let window = reader.next_rays(WINDOW)?;
        if window.is_empty() {
            break;
        }
        let first = figures.rays;
        let batches: Vec<Traced> = window
            .par_chunks(BATCH)
            .enumerate()
            .map(|(batch, rays)| {
                control.stop.check()?;
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
                Ok(traced)
            })
            .collect::<Result<_, Error>>()?;
        figures.rays += window.len();
        for (rays, traced) in window.chunks(BATCH).zip(&batches) {
            figures.hits += traced.hits;
            figures.trapped += traced.trapped;
            writer.write(rays.len(), &traced.rows)?;
        }
    }
    writer.finish()?;
    figures.trace_s = begin.elapsed().as_secs_f64();
    Ok(figures)
}
