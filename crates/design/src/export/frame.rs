//! A printable frame: a plate behind every mirror, a bar from each to a hub above or below the scanner, on the side
//! that its back faces, and two columns that join the hubs behind the scanner, outside its scan.
//!
//! The bodies overlap where they join; a slicer merges them. Holes for screws are left to the user.

use super::Solid;
use crate::layout::{Detail, Drawing, analyze, center, plate_thickness};
use catoptric_sim::build::Bent;
use catoptric_sim::scene::{MeshShape, MeshUnits, Post, PostShape};
use catoptric_sim::{Mesh, Scene, SimError};
use nalgebra::{Point3, Unit, Vector3};
use std::sync::Arc;

/// Thickness of plates and hubs, in meters.
const PLATE: f64 = 3e-3;

/// Width of bars and columns, in meters.
const BAR: f64 = 5e-3;

/// Distance of a plate's edge inside its mirror's outline, in meters, so that it does not block beams that pass the
/// mirror.
const WITHIN: f64 = 0.5e-3;

/// Clearance between housing and hubs, in meters.
const CLEARANCE: f64 = 1e-3;

/// Housing assumed for a scanner without one.
const NO_HOUSING: Housing = Housing {
    radius: 30e-3,
    back: -25e-3,
    low: -30e-3,
    high: 30e-3,
};

/// Distance of the columns from the middle, over their distance behind the scanner (15°): the scan ends at 135°.
const COLUMNS_ASIDE: f64 = 0.268;

/// Extents of the scanner, in meters.
struct Housing {
    /// About the scanner's axis.
    radius: f64,
    /// Minimum x.
    back: f64,
    /// Minimum z.
    low: f64,
    /// Maximum z.
    high: f64,
}

/// Returns the bodies of the frame.
pub(super) fn frame(drawing: &Drawing, thickness: f64) -> Vec<Solid> {
    if drawing.facets.is_empty() {
        return Vec::new();
    }
    let housing = housing(drawing);
    let (below, above) = (housing.low - CLEARANCE, housing.high + CLEARANCE);
    let behind = housing.back - CLEARANCE - 0.5 * BAR;
    // The hubs support the columns over their full width.
    let radius = housing.radius.max(BAR - behind);
    let mut bodies = vec![
        Solid::disc("frame-base", radius, [below - PLATE, below]),
        Solid::disc("frame-top", radius, [above, above + PLATE]),
    ];
    for facet in &drawing.facets {
        let face = &facet.face;
        let m = face.normal.into_inner();
        let thickness = thickness + facet.bent.as_ref().map_or(0.0, Bent::behind);
        let middle = center(&face.corners);
        let outline = |depth: f64, within: f64| -> Vec<Point3<f64>> {
            let moved = |c: &Point3<f64>| {
                let from_middle = c - middle;
                // Each corner moves toward the middle by `within`, but never past it.
                let share = (1.0 - within / from_middle.norm()).max(0.1);
                middle + from_middle * share - m * depth
            };
            face.corners.iter().map(moved).collect()
        };
        let (front, back) = (
            outline(thickness, WITHIN),
            outline(thickness + PLATE, WITHIN + 0.5 * PLATE),
        );
        bodies.push(Solid::between(
            &format!("frame-plate-{}", facet.name),
            &back,
            &front,
        ));
        // A mirror whose back faces down is joined to the base.
        let hub_height = if m.z > 0.0 {
            below - 0.5 * PLATE
        } else {
            above + 0.5 * PLATE
        };
        let outwards = Vector3::new(middle.x, middle.y, 0.0);
        let rim = Unit::try_new(outwards, 1e-6).map_or(Vector3::zeros(), |v| v.into_inner() * (radius - BAR));
        let hub = Point3::from(rim + Vector3::z() * hub_height);
        let plate = middle - m * (thickness + PLATE);
        bodies.extend(Solid::bar(&format!("frame-bar-{}", facet.name), hub, plate, BAR));
    }
    for (number, side) in [-1.0, 1.0].into_iter().enumerate() {
        let at = |z: f64| Point3::new(behind, side * COLUMNS_ASIDE * behind, z);
        let name = format!("frame-column-{}", number + 1);
        bodies.extend(Solid::bar(&name, at(below - PLATE), at(above + PLATE), BAR));
    }
    bodies
}

fn housing(drawing: &Drawing) -> Housing {
    let points = || {
        let parts = drawing.parts.iter().filter(|p| p.housing);
        parts.flat_map(|p| p.skin.iter().flatten())
    };
    let min = |axis: usize| points().map(|p| p[axis]).reduce(f64::min);
    let (Some(back), Some(low), Some(high)) = (min(0), min(2), points().map(|p| p.z).reduce(f64::max)) else {
        return NO_HOUSING;
    };
    let radius = points().map(|p| libm::hypot(p.x, p.y)).fold(0.0, f64::max);
    Housing {
        radius,
        back,
        low,
        high,
    }
}

/// Returns the elements that the frame would block, found by analyzing the layout with the frame in it.
///
/// # Errors
/// As [`analyze`].
pub fn shaded_by_frame(scene: &Scene, seed: Option<u64>) -> Result<Vec<usize>, SimError> {
    /// A name that no mesh file can have.
    const FRAME: &str = "\0frame";
    let drawing = Drawing::new(scene, seed)?;
    let bodies = frame(&drawing, plate_thickness(scene));
    let triangles: Vec<_> = bodies.iter().flat_map(|b| b.triangles.iter().copied()).collect();
    let vertices: Vec<Point3<f64>> = triangles.iter().flatten().copied().collect();
    let count = u32::try_from(triangles.len()).unwrap_or(0);
    let Ok(mesh) = Mesh::new(
        vertices,
        (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
    ) else {
        return Ok(Vec::new());
    };
    let mut framed = scene.clone();
    framed.meshes.0.insert(FRAME.to_owned(), Arc::new(mesh));
    framed.superstructure.post.push(Post {
        name: "frame".to_owned(),
        center_mm: [0.0; 3],
        size_mm: None,
        shape: Some(PostShape::Mesh(MeshShape {
            file: FRAME.to_owned(),
            units: MeshUnits::M,
        })),
        yaw_deg: 0.0,
        pitch_deg: 0.0,
        roll_deg: 0.0,
        color: "structure".to_owned(),
    });
    let [before, after] = [
        analyze(scene, seed, Detail::Full)?,
        analyze(&framed, seed, Detail::Full)?,
    ];
    let pairs = before.elements.iter().zip(&after.elements);
    let shaded = pairs.filter(|(b, a)| b.class.sees() && !a.class.sees());
    Ok(shaded.map(|(b, _)| b.beam).collect())
}
