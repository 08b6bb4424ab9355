//! Checks of scenes: everything that needs more than one value, or some geometry.
//!
//! The format itself (types, ranges of single values, unknown keys) is up to the schema. All problems are found in one
//! pass, each with the path of the key it concerns. Geometry is that of the drawing: errors of the structure as built
//! are small compared with everything that is rejected here.

mod experiment;
mod findings;
mod flight;
mod mishap;
mod outline;
mod stage;
mod structure;
mod values;

pub use outline::{Outline, ServedFacet, outline};

use crate::scene::Scene;
use catoptric_model::place::Problem;
use findings::Findings;

/// All problems of a scene.
pub fn problems(scene: &Scene) -> Vec<Problem> {
    let mut found = Findings(Vec::new());
    values::check(scene, &mut found);
    stage::check(scene, &mut found);
    // Structure and procedure can only be checked if there is a laboratory.
    if !scene.has_no_laboratory() {
        structure::check(scene, &mut found);
        if scene.room.has_walls() {
            experiment::check(scene, &mut found);
            mishap::check(scene, &mut found);
        }
        flight::check(scene, &mut found);
    }
    found.0
}
