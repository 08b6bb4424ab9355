//! Surface colors: their reflectivity, and the noise of readings from them.

use crate::error::SimError;
use crate::scene::{Color, NoiseTable, Scene};
use catoptric_model::paper;

/// A color as the simulation uses it.
#[derive(Debug, Clone, PartialEq)]
pub struct Paint {
    /// Name.
    pub name: String,
    /// Share of the light that is scattered back, ρ_t.
    pub reflectivity: f64,
    /// Noise of readings from this color.
    pub noise: NoiseTable,
}

/// Names of the built-in colors.
pub const BUILT_IN: [&str; 6] = [
    "white",
    "pure_white",
    "antique_white",
    "pencil_grey",
    "jet_black",
    "structure",
];

/// Reflectivity (assumed) and Table 4's noise of a built-in color, in the order of [`BUILT_IN`].
///
/// `white` and `structure` have no table of their own and take `errors.noise`, by default Table 2; the other four are
/// the columns of Table 4.
fn built_in(name: &str) -> Option<Color> {
    let reflectivity = match name {
        "white" | "pure_white" => 0.9,
        "antique_white" => 0.8,
        "pencil_grey" => 0.4,
        "jet_black" => 0.05,
        "structure" => 0.3,
        _ => return None,
    };
    let column = paper::TABLE_4.iter().find(|(color, _)| *color == name);
    Some(Color {
        reflectivity,
        noise: column.map(|(_, sd_mm)| NoiseTable {
            range_m: paper::TABLE_4_RANGE_M.to_vec(),
            sd_mm: sd_mm.to_vec(),
        }),
    })
}

/// Whether readings from a color have Table 4's noise, whatever `errors.noise` says: a built-in color, unless the scene
/// defines it.
pub(crate) fn has_own_noise(scene: &Scene, name: &str) -> bool {
    !scene.color.contains_key(name) && built_in(name).is_some_and(|color| color.noise.is_some())
}

/// Looks up a color among the scene's own and the built-in ones.
///
/// # Errors
/// [`SimError::UnknownColor`] lists the known names.
pub fn paint(scene: &Scene, name: &str) -> Result<Paint, SimError> {
    let color = scene
        .color
        .get(name)
        .cloned()
        .or_else(|| built_in(name))
        .ok_or_else(|| {
            let own = scene.color.keys().map(String::as_str);
            SimError::UnknownColor {
                name: name.to_owned(),
                known: BUILT_IN.into_iter().chain(own).collect::<Vec<_>>().join(", "),
            }
        })?;
    let noise = color.noise.unwrap_or_else(|| scene.errors.noise.clone());
    Ok(Paint {
        name: name.to_owned(),
        reflectivity: color.reflectivity,
        noise,
    })
}
