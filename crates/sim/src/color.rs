//! Surface colors: how much light they return, and how noisy their readings are.

use crate::error::SimError;
use crate::scene::{Color, NoiseTable, Scene};

/// A color with everything the simulation needs of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Paint {
    /// Name.
    pub name: String,
    /// Share of the light that is scattered back, ρ_t.
    pub reflectivity: f64,
    /// Noise of readings from it.
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

/// Distances of Table 4, in metres.
const TABLE_4_RANGE_M: [f64; 4] = [0.493, 1.011, 1.600, 2.007];

/// Reflectivity (assumed) and Table 4's noise of a built-in color, in the order of [`BUILT_IN`].
///
/// `white` and `structure` have no table of their own and take `errors.noise`, by default Table 2; the other four are
/// the columns of Table 4.
fn built_in(name: &str) -> Option<Color> {
    let (reflectivity, sd_mm) = match name {
        "white" => (0.9, None),
        "pure_white" => (0.9, Some([4.39, 4.64, 3.52, 3.71])),
        "antique_white" => (0.8, Some([3.96, 4.69, 3.43, 3.55])),
        "pencil_grey" => (0.4, Some([3.85, 4.71, 3.96, 4.18])),
        "jet_black" => (0.05, Some([5.37, 6.06, 5.29, 5.00])),
        "structure" => (0.3, None),
        _ => return None,
    };
    let table = |sd: [f64; 4]| NoiseTable {
        range_m: TABLE_4_RANGE_M.to_vec(),
        sd_mm: sd.to_vec(),
    };
    Some(Color {
        reflectivity,
        noise: sd_mm.map(table),
    })
}

/// Looks a color up among the scene's own and the built-in ones.
///
/// # Errors
/// [`SimError::UnknownColor`] lists the names there are.
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
