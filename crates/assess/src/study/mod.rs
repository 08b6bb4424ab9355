//! Monte Carlo studies: the statistics of errors over many seeds, scene values and calibrators.
//!
//! A run is one experiment of one cell of the grid of scene values, simulated, calibrated by a contestant and scored in
//! memory. Runs are independent, so statistics over them have exact bounds; the elements of one run are not, since they
//! share mounting, boards and biases. Statistics that need independence therefore use one element of each run:
//!
//! ```text
//! per-axis error  √(mean of squares over elements and runs)      efficiency  1 / mean(error²/bound²) over runs
//! ANEES           mean(eᵀP⁻¹e)/2 of one element per run, 1 if P is honest, within χ²_{2n}/2n bounds of 99.9 %
//! coverage        share of those inside their 68, 95, 99 % ellipses, Clopper–Pearson intervals of 95 %
//! bias            Hotelling's T² of the same elements' mean error: p-value under the hypothesis of no bias
//! ```
//!
//! ```
//! use catoptric_calib::Method;
//! use catoptric_assess::study::{Contestant, Study, run, summarize};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let scene = toml::from_str(include_str!("../../../../scenes/reference-facet.toml"))?;
//! let study = Study::of_scene(scene, 4, vec![Contestant::Method(Method::Joint), Contestant::Oracle]);
//! let runs: Vec<_> = study.jobs().map(|job| run(&study, job)).collect::<Result<Vec<_>, _>>()?.concat();
//! let summary = summarize(&study, &runs);
//! assert!(summary.methods[0].per_axis_rms_deg < 0.1);
//! assert_eq!(summary.methods[1].per_axis_rms_deg, 0.0);
//! # Ok(())
//! # }
//! ```

mod elements;
mod error;
#[cfg(feature = "recording")]
pub mod folder;
mod grid;
mod merge;
#[cfg(feature = "recording")]
mod names;
mod oracle;
mod part;
#[cfg(feature = "recording")]
mod plan;
#[cfg(feature = "recording")]
mod process;
#[cfg(feature = "recording")]
mod program;
mod run;
#[cfg(feature = "recording")]
mod shards;
mod spread;
mod statistics;
mod summary;
mod table;

pub use elements::{ELEMENTS_HEADER, ElementAngles, elements_from_csv, elements_to_csv};
pub use error::StudyError;
pub use grid::{Axis, grid};
pub use merge::{in_order, merge};
pub use oracle::Oracle;
pub use part::Part;
#[cfg(feature = "recording")]
pub use plan::Plan;
#[cfg(feature = "recording")]
pub use process::end_programs;
#[cfg(feature = "recording")]
pub use program::Program;
#[cfg(feature = "testing")]
pub(crate) use run::drawn;
pub use run::{Run, run, run_with_elements};
#[cfg(feature = "recording")]
pub use shards::gather;
pub use spread::{Spread, spread, spread_to_csv};
#[cfg(feature = "testing")]
pub(crate) use statistics::{mean_bounds, share_bounds};
pub use summary::{MethodSummary, Summary, summarize};
pub use table::{HEADER, from_csv, to_csv};

use catoptric_calib::{CalibError, Calibrator, Method};
use catoptric_model::Stop;
use catoptric_sim::Scene;
use std::fmt;
use std::sync::Arc;

/// Version of `study.json`.
pub const SCHEMA_VERSION: u32 = 1;

/// A calibrator in a study.
#[derive(Clone)]
pub enum Contestant {
    /// One of our methods.
    Method(Method),
    /// One of our methods without bias corrections: those of the session are removed first.
    Uncorrected(Method),
    /// The truth itself, which must score zero error.
    Oracle,
    /// A program that is given a blind dataset.
    #[cfg(feature = "recording")]
    Program(Program),
    /// A calibrator of your own.
    Own(Arc<dyn Calibrator + Send + Sync>),
}

impl fmt::Debug for Contestant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Contestant").field(&self.name()).finish()
    }
}

/// One point of the grid of scene values.
#[derive(Debug, Clone)]
pub struct Cell {
    /// Keys and values, in the order of the axes.
    pub values: Vec<(String, String)>,
    /// The scene with them.
    pub scene: Scene,
}

/// A study: the grid, the number of seeds and the contestants.
#[derive(Debug, Clone)]
pub struct Study {
    /// The grid.
    pub cells: Vec<Cell>,
    /// Number of seeds: 1 to this one.
    pub seeds: u64,
    /// The calibrators of each experiment.
    pub contestants: Vec<Contestant>,
    /// Once a stop is requested, running programs are terminated, and their experiments yield no result.
    pub stop: Stop,
}

/// One experiment: a cell and a seed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Job {
    /// Index of the cell.
    pub cell: usize,
    /// Seed.
    pub seed: u64,
}

impl Contestant {
    /// Returns one of our methods, or "oracle", by its name.
    ///
    /// # Errors
    /// [`CalibError::UnknownMethod`] lists the names.
    pub fn named(name: &str) -> Result<Self, CalibError> {
        match name {
            "oracle" => Ok(Self::Oracle),
            method => Ok(Self::Method(method.parse()?)),
        }
    }

    /// Its name in tables.
    pub fn name(&self) -> String {
        match self {
            Self::Method(method) => method.name().to_owned(),
            Self::Uncorrected(method) => format!("{} uncorrected", method.name()),
            Self::Oracle => "oracle".to_owned(),
            #[cfg(feature = "recording")]
            Self::Program(program) => program.name.clone(),
            Self::Own(calibrator) => calibrator.name().to_owned(),
        }
    }
}

impl Study {
    /// Creates a study of a single scene.
    pub fn of_scene(scene: Scene, seeds: u64, contestants: Vec<Contestant>) -> Self {
        Self {
            cells: vec![Cell {
                values: Vec::new(),
                scene,
            }],
            seeds,
            contestants,
            stop: Stop::default(),
        }
    }

    /// All experiments, in order.
    pub fn jobs(&self) -> impl Iterator<Item = Job> + use<> {
        let seeds = self.seeds;
        (0..self.cells.len()).flat_map(move |cell| (1..=seeds).map(move |seed| Job { cell, seed }))
    }

    /// The experiments of a part: every `parts`-th one, so that all parts take about the same time.
    pub fn jobs_of_part(&self, Part { part, parts }: Part) -> Vec<Job> {
        self.jobs()
            .skip(part.saturating_sub(1))
            .step_by(parts.max(1))
            .collect()
    }
}
