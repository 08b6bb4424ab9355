//! Checks of mirrors and surfaces fixed in the room, of the mirror material, and of whether the scene contains enough
//! to simulate.

use super::values::distinct;
use crate::build::stage;
use crate::findings::Findings;
use crate::scene::facet::outline::check_outline;
use crate::scene::{PlaneRectangle, PlaneShape, Scene, SurfaceShape};
use catoptric_model::place::KeyPath;
use nalgebra::{Point3, Vector3};

pub(super) fn check(scene: &Scene, found: &mut Findings) {
    let room = KeyPath::of("room");
    let (mirrors, surfaces) = (&scene.room.mirror, &scene.room.surface);
    if scene.has_no_laboratory() {
        if mirrors.is_empty() && surfaces.is_empty() {
            found.add(
                &room,
                "is empty, and there is no laboratory either",
                "add [[superstructure.facet]] to look at mirrors, [[room.mirror]] and [[room.surface]] to trace rays; \
                 recording needs a [superstructure] with markers, and either room.size_m and a board, or a [[flight]]"
                    .to_owned(),
            );
        }
    } else if !scene.room.has_walls() && !scene.only_flies() && !scene.only_shows_mirrors() {
        found.add(
            &room.key("size_m"),
            "is missing; boards need a room with walls",
            "add size_m = [x, y, z], in meters".to_owned(),
        );
    }
    distinct(
        &room.key("mirror"),
        mirrors.iter().map(|m| m.name.as_str()),
        found,
    );
    distinct(
        &room.key("surface"),
        surfaces.iter().map(|s| s.name.as_str()),
        found,
    );
    for (i, mirror) in mirrors.iter().enumerate() {
        let path = room.key("mirror").index(i);
        let shape = path.key("shape");
        match &mirror.shape {
            PlaneShape::Rectangle(rectangle) => check_normal(rectangle, &shape, found),
            PlaneShape::Polygon(polygon) => check_corners(&polygon.corners_m, &shape, found),
        }
        if let Some(glass) = &mirror.glass
            && mirror.thickness_mm > 0.0
        {
            check_glass(glass.thickness_mm, mirror.thickness_mm, &path.key("glass"), found);
        }
    }
    for (i, surface) in surfaces.iter().enumerate() {
        let shape = room.key("surface").index(i).key("shape");
        match &surface.shape {
            SurfaceShape::Rectangle(rectangle) => check_normal(rectangle, &shape, found),
            SurfaceShape::Polygon(polygon) => check_corners(&polygon.corners_m, &shape, found),
            SurfaceShape::Box(_) | SurfaceShape::Cylinder(_) | SurfaceShape::Mesh(_) => {}
        }
    }
    let material = &scene.superstructure.mirror;
    let path = KeyPath::of("superstructure").key("mirror");
    if let Some(glass) = &material.glass {
        check_glass(
            glass.thickness_mm,
            material.thickness_mm,
            &path.key("glass"),
            found,
        );
    }
}

/// Checks that the glass is no thicker than the mirror, of which it is a part.
fn check_glass(glass_mm: f64, body_mm: f64, path: &KeyPath, found: &mut Findings) {
    if glass_mm > body_mm {
        found.add(
            &path.key("thickness_mm"),
            format_args!("is {glass_mm} mm, more than the {body_mm} mm of the whole mirror"),
            "increase the mirror's own thickness_mm".to_owned(),
        );
    }
}

fn check_normal(rectangle: &PlaneRectangle, shape: &KeyPath, found: &mut Findings) {
    if stage::rectangle_corners(rectangle).is_none() {
        found.add(
            &shape.key("rectangle").key("normal"),
            "has length 0; a normal of any other length is allowed",
            None,
        );
    }
}

fn check_corners(corners_m: &[[f64; 3]], shape: &KeyPath, found: &mut Findings) {
    // The schema requires at least three.
    if corners_m.len() >= 3 {
        let corners: Vec<Point3<f64>> = corners_m.iter().map(|c| Vector3::from(*c).into()).collect();
        check_outline(&corners, &shape.key("polygon").key("corners_m"), found);
    }
}
