//! What manufacturing errors do to a layout, and what a calibration leaves of them.

use crate::{Control, Error, Scene};
use catoptric_design::layout::{self, Requirement};
use catoptric_design::tolerance::{self, Bounds, Calibrated, Tolerance, Workshop};
use catoptric_sim::SimError;
use rayon::prelude::*;
use std::path::Path;

/// Structures between two reports of progress.
const CHUNK: usize = 16;

/// How many structures are built, and what is done with them.
#[derive(Debug, Clone, PartialEq)]
pub struct ToleranceOptions {
    /// Structures to build, one for each seed from `seed` on.
    pub draws: u32,
    /// Seed of the first structure; the scene's own by default.
    pub seed: Option<u64>,
    /// Structures, the first of them, for which the accuracy that a calibration can reach is predicted.
    pub bounds: u32,
    /// Structures, the first of them, whose experiment is simulated, calibrated by `joint` and scored.
    pub calibrate: u32,
    /// Limits to keep; a name that is no figure's is refused before the work is done.
    pub requirements: Vec<Requirement>,
}

impl Default for ToleranceOptions {
    fn default() -> Self {
        Self {
            draws: 200,
            seed: None,
            bounds: 5,
            calibrate: 0,
            requirements: Vec::new(),
        }
    }
}

/// Builds many structures from one drawing and says what they have in common, and which requirements they do not meet.
///
/// # Errors
/// [`Error::Setup`] if the scene cannot be set up, [`Error::Requirement`] if no figure answers to a requirement,
/// [`Error::Stopped`].
pub fn tolerance(
    scene: &Scene,
    options: &ToleranceOptions,
    control: &Control,
) -> Result<(Tolerance, Vec<String>), Error> {
    control.run(|| {
        let scene = scene.resolved();
        let first = options.seed.unwrap_or(scene.seed);
        let seeds = |count: u32| -> Vec<u64> { (0..count).map(|k| first.wrapping_add(k.into())).collect() };
        let workshop = Workshop::new(scene)?;
        let mut empty = workshop.summarize(&[]);
        empty.bound = (options.bounds > 0).then(|| Bounds::of(&[]));
        empty.calibrated = (options.calibrate > 0).then(|| Calibrated::of(&[]));
        unmet(&options.requirements, &empty)?;
        let built = each(control, "building", &seeds(options.draws), |seed| {
            workshop.build(seed)
        })?;
        let mut found = workshop.summarize(&built);
        if options.bounds > 0 {
            let predicted = each(control, "predicting", &seeds(options.bounds), |seed| {
                Ok(layout::predict(scene, seed))
            })?;
            found.bound = Some(Bounds::of(&predicted));
        }
        if options.calibrate > 0 {
            let runs = each(control, "calibrating", &seeds(options.calibrate), |seed| {
                tolerance::calibrate(scene, seed)
            })?;
            found.calibrated = Some(Calibrated::of(&runs));
        }
        let unmet = unmet(&options.requirements, &found)?;
        Ok((found, unmet))
    })
}

/// The requirements that are not met, each with the figure found.
fn unmet(requirements: &[Requirement], found: &Tolerance) -> Result<Vec<String>, Error> {
    let mut unmet = Vec::new();
    for requirement in requirements {
        unmet.extend(
            tolerance::judge(requirement, found)?
                .iter()
                .map(ToString::to_string),
        );
    }
    Ok(unmet)
}

/// Does the same for every seed, some at a time, in order.
fn each<T: Send>(
    control: &Control,
    doing: &'static str,
    seeds: &[u64],
    one: impl Fn(u64) -> Result<T, SimError> + Sync,
) -> Result<Vec<T>, Error> {
    let mut found = Vec::with_capacity(seeds.len());
    control.report(doing, 0, seeds.len());
    for chunk in seeds.chunks(CHUNK) {
        let of_one = |&seed: &u64| {
            control.stop.check()?;
            Ok(one(seed)?)
        };
        found.extend(chunk.par_iter().map(of_one).collect::<Result<Vec<T>, Error>>()?);
        control.report(doing, chunk.len(), seeds.len());
    }
    Ok(found)
}

/// Name of the page about tolerances.
pub const TOLERANCE_PAGE: &str = "report.html";

/// Writes an analysis into a folder: `tolerance.json`, the plot and a page.
///
/// # Errors
/// [`Error::File`] if writing fails.
#[cfg(feature = "report")]
pub fn write_tolerance(found: &Tolerance, out: impl AsRef<Path>) -> Result<(), Error> {
    use catoptric_files::{IoError, write_file};
    let out = out.as_ref();
    let json = serde_json::to_string(found).map_err(|e| Error::invalid(e.to_string(), None))? + "\n";
    std::fs::create_dir_all(out).map_err(|e| IoError::write(out, e))?;
    let plot = catoptric_report::tolerance_plot(found);
    write_file(out.join("directions.svg"), plot.as_bytes())?;
    write_file(
        out.join(TOLERANCE_PAGE),
        catoptric_report::tolerance(found).as_bytes(),
    )?;
    write_file(out.join("tolerance.json"), json.as_bytes())?;
    Ok(())
}
