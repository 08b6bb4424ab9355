//! A random scene, and the few lines in which a failed property shows it.

use catoptric_sim::Scene;
use std::fmt;
use std::ops::{Deref, DerefMut};

/// A scene that a strategy made. It is used as the [`Scene`] it holds; only its `Debug` form differs: proptest prints it with
/// every failure, and a whole scene takes hundreds of lines.
///
/// ```
/// use catoptric_assess::testing::RandomScene;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let scene = RandomScene(toml::from_str(include_str!("../../../../scenes/two-mirror.toml"))?);
/// assert_eq!(scene.superstructure.facet.len(), 2);
/// assert!(format!("{scene:#?}").lines().count() < 6);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, PartialEq)]
pub struct RandomScene(pub Scene);

impl Deref for RandomScene {
    type Target = Scene;

    fn deref(&self) -> &Scene {
        &self.0
    }
}

impl DerefMut for RandomScene {
    fn deref_mut(&mut self) -> &mut Scene {
        &mut self.0
    }
}

impl From<RandomScene> for Scene {
    fn from(scene: RandomScene) -> Self {
        scene.0
    }
}

impl fmt::Debug for RandomScene {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let scene = &self.0;
        let [x, y, z] = scene.room.size_m;
        write!(
            f,
            "{} with seed {}: {}, {} boards, a room of {x} m by {y} m by {z} m",
            scene.name,
            scene.seed,
            scene.scanner.preset.name(),
            scene.board.len(),
        )?;
        for facet in &scene.superstructure.facet {
            // Never over several lines, whatever the formatter asks for.
            write!(f, "\n    {}: {:?}", facet.name, facet.shape)?;
        }
        Ok(())
    }
}
