//! Size, mirror area and mass of the structure. Mirrors use no power.

use catoptric_cast::area_vector;
use catoptric_cast::volume;
use catoptric_sim::Scene;
use catoptric_sim::build::Structure;
use nalgebra::{Point3, Vector3};
use serde::Serialize;

/// Density of the mirrors, in kg/m³: float glass (EN 572-1).
pub const MIRROR_DENSITY: f64 = 2500.0;

/// Density of posts and frame, in kg/m³: solid polylactide as printed (NatureWorks Ingeo 4043D, data sheet).
pub const POST_DENSITY: f64 = 1240.0;

/// Thickness assumed for mirrors drawn without one, in meters.
const MIN_THICKNESS: f64 = 1e-3;

/// Size, mirror area and mass.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Size {
    /// Extents of mirrors, posts and housing along the axes of the sensor frame, in millimeters.
    pub extent_mm: [f64; 3],
    /// Diameter about the scanner's axis, in millimeters.
    pub diameter_mm: f64,
    /// Extent along that axis, in millimeters.
    pub height_mm: f64,
    /// Area of all mirrors, in square millimeters.
    pub mirror_area_mm2: f64,
    /// Mass of the mirrors as glass of `superstructure.mirror.thickness_mm`, in grams.
    pub mirror_mass_g: f64,
    /// Mass of the posts as solid printed plastic, in grams.
    pub post_mass_g: f64,
    /// Mass of mirrors and posts, without the scanner, in grams.
    pub structure_mass_g: f64,
    /// Mass of the scanner without its cable by its data sheet, in grams; `None` for a custom one.
    pub scanner_mass_g: Option<f64>,
}

/// Computes size, area and mass of a structure.
pub(crate) fn size(scene: &Scene, structure: &Structure) -> Size {
    let mut points: Vec<Point3<f64>> = structure
        .facets
        .iter()
        .flat_map(|f| f.face.corners.iter().chain(&f.backing.corners).copied())
        .collect();
    let bent = structure.facets.iter().filter_map(|f| f.bent.as_ref());
    points.extend(bent.flat_map(|bent| bent.face.rim().into_iter().chain(bent.backing.rim())));
    let mut post_volume = 0.0;
    for part in &structure.parts {
        let skin = part.shape.triangles();
        if part.name != HOUSING {
            post_volume += volume(&skin).max(0.0);
        }
        points.extend(skin.iter().flatten());
    }
    let bound = |fold: fn(f64, f64) -> f64| {
        let all = points.iter().map(|p| p.coords);
        all.reduce(|a, b| a.zip_map(&b, fold))
            .unwrap_or_else(Vector3::zeros)
    };
    let extent = (bound(f64::max) - bound(f64::min)) * 1e3;
    let radius = points.iter().map(|p| libm::hypot(p.x, p.y)).fold(0.0, f64::max);
    let area: f64 = (structure.facets.iter())
        .map(|f| 0.5 * area_vector(&f.face.corners).norm())
        .fold(0.0, |sum, area| sum + area);
    let thickness = plate_thickness(scene);
    let (mirror_mass, post_mass) = (area * thickness * MIRROR_DENSITY, post_volume * POST_DENSITY);
    Size {
        extent_mm: extent.into(),
        diameter_mm: 2e3 * radius,
        height_mm: extent.z,
        mirror_area_mm2: 1e6 * area,
        mirror_mass_g: 1e3 * mirror_mass,
        post_mass_g: 1e3 * post_mass,
        structure_mass_g: 1e3 * (mirror_mass + post_mass),
        scanner_mass_g: scene.scanner.preset.mass_g(),
    }
}

/// Returns the thickness of a mirror as a plate, in meters: with its glass, if that is thicker.
pub(crate) fn plate_thickness(scene: &Scene) -> f64 {
    let mirror = &scene.superstructure.mirror;
    let glass = mirror.glass.map_or(0.0, |g| g.thickness_mm);
    let drawn = 1e-3 * mirror.thickness_mm.max(glass);
    if drawn > 0.0 { drawn } else { MIN_THICKNESS }
}

/// Name of the parts of the scanner's own housing.
pub(crate) const HOUSING: &str = "housing";
