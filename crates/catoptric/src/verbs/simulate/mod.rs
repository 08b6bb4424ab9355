//! Simulation of what a laboratory would have recorded, in memory or into a folder, along with the truth.

#[cfg(feature = "recording")]
mod folder;
#[cfg(feature = "recording")]
mod stream;
#[cfg(feature = "recording")]
mod sub_rays;
#[cfg(feature = "recording")]
mod tables;

#[cfg(feature = "recording")]
pub use folder::{Figures, Recording, simulate_into};

use crate::{Control, Error, Scene};
use catoptric_model::{Dataset, PoseRecord};
use catoptric_sim::{Laboratory, Truth};
use rayon::prelude::*;

/// Simulates the experiment of a scene: the recorded dataset, and the truth.
///
/// The dataset does not contain the truth. For experiments of many scans use [`simulate_into`], which keeps only a few of
/// them in memory.
///
/// # Errors
/// [`Error::Setup`] if the scene cannot be set up: a board that fits nowhere, no laboratory.
pub fn simulate(scene: &Scene) -> Result<(Dataset, Truth), Error> {
    simulate_with(scene, &Control::default())
}

/// Same as [`simulate`], with progress reported by stretches.
///
/// # Errors
/// Same as [`simulate`], and [`Error::Stopped`].
pub fn simulate_with(scene: &Scene, control: &Control) -> Result<(Dataset, Truth), Error> {
    control.run(|| {
        let scene = scene.resolved();
        let laboratory = Laboratory::new(scene, scene.seed)?;
        let truth = laboratory.truth()?;
        let all: Vec<usize> = (0..laboratory.stretches()).collect();
        let mut poses = Vec::with_capacity(all.len());
        control.report("simulating", 0, all.len());
        for window in all.chunks(rayon::current_num_threads()) {
            let recorded: Vec<PoseRecord> = window
                .par_iter()
                .map(|number| {
                    control.stop.check()?;
                    Ok(laboratory.pose_record(*number)?)
                })
                .collect::<Result<_, Error>>()?;
            poses.extend(recorded);
            control.report("simulating", window.len(), all.len());
        }
        control.check()?;
        let session = laboratory.session()?;
        let dataset = Dataset {
            session,
            poses,
            id: None,
            warnings: Vec::new(),
        };
        Ok((dataset, truth))
    })
}
