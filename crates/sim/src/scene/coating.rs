//! Coatings of mirrors: how much they reflect depends on incidence and polarization.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What reflects the light of a mirror, instead of one number.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Coating {
    /// A metal or glass, bare or under thin films: Fresnel's equations.
    Stack(Stack),
    /// Measured or published shares over the incidence.
    Table(CoatingTable),
}

/// Thin films on a substrate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stack {
    /// Refractive index of the substrate (aluminum at 905 nm: 2.1, assumed).
    #[schemars(range(min = 0.01, max = 20.0))]
    pub n: f64,
    /// Extinction coefficient of the substrate (aluminum at 905 nm: 8.4, assumed); 0 for glass.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 50.0))]
    pub k: f64,
    /// The films, from the air down.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub film: Vec<Film>,
}

/// A thin film.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Film {
    /// Refractive index.
    #[schemars(range(min = 0.01, max = 20.0))]
    pub n: f64,
    /// Extinction coefficient.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 50.0))]
    pub k: f64,
    /// Thickness, in nanometers.
    #[schemars(range(min = 0.0, max = 10000.0))]
    pub thickness_nm: f64,
}

/// Shares of the light that are reflected, linear between the entries and constant beyond them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CoatingTable {
    /// Angles of incidence, strictly increasing, in degrees.
    #[schemars(inner(range(min = 0.0, max = 90.0)))]
    pub incidence_deg: Vec<f64>,
    /// Share at each of light polarized across the plane of incidence (s).
    #[schemars(inner(range(min = 0.0, max = 1.0)))]
    pub across: Vec<f64>,
    /// Share at each of light polarized within it (p).
    #[schemars(inner(range(min = 0.0, max = 1.0)))]
    pub within: Vec<f64>,
}

/// Dust and scratches on the mirrors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Dust {
    /// Share of a mirror's face that it covers; light crosses it before the mirror and after it.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub cover: f64,
    /// Share of the light on it that it scatters, as a Lambertian surface would (assumed).
    #[serde(default = "Dust::default_reflectivity")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub reflectivity: f64,
}

impl Dust {
    fn default_reflectivity() -> f64 {
        0.3
    }

    /// Share of the light that passes it twice.
    pub fn passed(&self) -> f64 {
        (1.0 - self.cover) * (1.0 - self.cover)
    }
}
