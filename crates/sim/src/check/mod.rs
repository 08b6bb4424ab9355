//! Checks of scenes: everything that needs more than one value, or some geometry.
//!
//! The format itself (types, ranges of single values, unknown keys) is up to the schema. All problems are found in one
//! pass, each with the path of the key it concerns. A scene of nothing but a scanner and its mirrors is complete for whoever
//! looks at them: it needs no markers, no room and no boards. Geometry is that of the drawing: errors of the structure as built
//! are small compared with everything that is rejected here.

mod experiment;
mod flight;
mod mirror;
mod mishap;
mod outline;
mod overlap;
mod session;
mod spot;
mod stage;
mod structure;
mod values;

pub use outline::{Outline, ServedFacet, outline};

use crate::findings::Findings;
use crate::scene::Scene;
use catoptric_model::place::{KeyPath, Problem};

/// What is probably not meant, and hinders nothing: mirrors that no beam reaches or none as a whole, and noise that holds
/// for nothing.
pub fn warnings(scene: &Scene) -> Vec<Problem> {
    let mut found = Findings(Vec::new());
    values::warn(scene, &mut found);
    if let Ok(scan) = scene.scanner.scan() {
        structure::warn(scene, &scan, &mut found);
    }
    found.0
}

/// All problems of a scene.
pub fn problems(scene: &Scene) -> Vec<Problem> {
    let mut found = Findings(Vec::new());
    values::check(scene, &mut found);
    stage::check(scene, &mut found);
    mirror::check(scene, &mut found);
    let scan = match scene.scanner.scan() {
        Ok(scan) => scan,
        Err(error) => {
            let path = KeyPath::of("scanner").key("custom").key(error.key);
            found.add(&path, error.problem, None);
            // Nothing can be said of beams that there are not.
            return found.0;
        }
    };
    session::check(scene, &scan, &mut found);
    // Where there is no laboratory, structure and procedure have nothing to be checked against.
    if !scene.has_no_laboratory() {
        structure::check(scene, &scan, &mut found);
        if scene.room.has_walls() && !scene.only_shows_mirrors() {
            experiment::check(scene, &scan, &mut found);
            mishap::check(scene, &mut found);
        }
        flight::check(scene, &scan, &mut found);
    }
    found.0
}
