//! The effect of manufacturing errors on a layout, before and after calibration.

use crate::{Control, Error, Scene};
use catoptric_design::layout::{self, Requirement};
use catoptric_design::tolerance::{self, Bounds, Calibrated, Tolerance, Workshop};
#[cfg(feature = "report")]
use catoptric_files::{Content, Output, folder::FolderKind};
use catoptric_sim::SimError;
use rayon::prelude::*;

/// Number of structures between two progress reports.
const CHUNK: usize = 16;

/// How many structures are built, and how they are analyzed.
#[derive(Debug, Clone, PartialEq)]
pub struct ToleranceOptions {
    /// Number of structures to build, with consecutive seeds from `seed` on.
    pub draws: u32,
    /// Seed of the first structure; the scene's own by default.
    pub seed: Option<u64>,
    /// Number of structures, from the first one on, whose attainable calibration accuracy is predicted.
    pub bounds: u32,
    /// Number of structures, from the first one on, whose experiment is simulated, calibrated by `joint` and scored.
    pub calibrate: u32,
    /// Limits to meet; an unknown figure is rejected before any work is done.
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

/// Builds many structures from one drawing; returns their statistics, and the requirements that are not met.
///
/// # Errors
/// [`Error::Setup`] if the scene cannot be set up, [`Error::Requirement`] if a requirement names no existing figure,
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

/// Returns the requirements that are not met, each with the value found.
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

/// Evaluates a function for every seed, a chunk at a time in parallel; the results are in order.
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

/// File name of the page about tolerances.
pub const TOLERANCE_PAGE: &str = "report.html";

/// The folder that [`write_tolerance`] writes.
#[cfg(feature = "report")]
pub const TOLERANCE_FOLDER: FolderKind = FolderKind {
    what: "an analysis of tolerances",
    result: ("tolerance.json", Content::Tolerance),
    owns: |name, content| match content {
        Content::Tolerance => name == "tolerance.json",
        Content::Page => name == TOLERANCE_PAGE,
        Content::Svg => name == "directions.svg",
        _ => false,
    },
};

/// Writes an analysis as a folder: `tolerance.json`, the plot and a page. An earlier one is replaced as a whole.
///
/// # Errors
/// [`Error::File`] if writing fails.
#[cfg(feature = "report")]
pub fn write_tolerance(found: &Tolerance, out: impl Into<Output>) -> Result<(), Error> {
    let json = serde_json::to_string(found).map_err(|e| Error::invalid(e.to_string(), None))? + "\n";
    let folder = TOLERANCE_FOLDER.create(&out.into())?;
    let plot = catoptric_report::tolerance_plot(found);
    folder.write("directions.svg", plot.as_bytes())?;
    folder.write(TOLERANCE_PAGE, catoptric_report::tolerance(found).as_bytes())?;
    folder.write("tolerance.json", json.as_bytes())?;
    Ok(folder.publish()?)
}
