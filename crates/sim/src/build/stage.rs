//! Mirrors and surfaces fixed in the room: `[[room.mirror]]` and `[[room.surface]]`.
//!
//! They are exactly where the scene places them. Every ray cast into the room can hit them; the drawing of the
//! structure, its beams and the truth about them do not include them.

use crate::build::coating::Finish;
use crate::build::structure::{BuiltFacet, OpaquePart, mesh_shape};
use crate::error::SimError;
use crate::scene::facet::outline::rectangle;
use crate::scene::{PlaneRectangle, PlaneShape, RoomMirror, RoomSurface, Scene, SurfaceShape};
use catoptric_cast::{Block, Cylinder, Polygon, Shape};
use catoptric_model::Pose;
use catoptric_model::frame::yaw_pitch_roll;
use nalgebra::{Point3, Translation3, Vector3};

/// Mirrors and surfaces of the room, in the frame in which rays are cast.
#[derive(Debug, Clone)]
pub struct Stage {
    /// The mirrors.
    pub mirrors: Vec<BuiltFacet>,
    /// The surfaces.
    pub surfaces: Vec<OpaquePart>,
}

impl Stage {
    /// Everything fixed in a scene's room, transformed into another frame.
    ///
    /// # Errors
    /// A mirror or surface without a shape; a mesh that has not been read.
    pub fn new(scene: &Scene, frame_from_room: &Pose) -> Result<Self, SimError> {
        let mirrors = scene
            .room
            .mirror
            .iter()
            .map(|m| mirror(scene, m, frame_from_room));
        let surfaces = scene.room.surface.iter().map(|s| {
            let frame_from_surface =
                frame_from_room * pose(s.position_m, [s.yaw_deg, s.pitch_deg, s.roll_deg]);
            Ok(OpaquePart {
                name: s.name.clone(),
                shape: surface(scene, s, &frame_from_surface)?,
                color: s.color.clone(),
            })
        });
        Ok(Self {
            mirrors: mirrors.collect::<Result<_, _>>()?,
            surfaces: surfaces.collect::<Result<_, SimError>>()?,
        })
    }
}

fn pose(position_m: [f64; 3], yaw_pitch_roll_deg: [f64; 3]) -> Pose {
    let [yaw, pitch, roll] = yaw_pitch_roll_deg.map(f64::to_radians);
    Pose::from_parts(
        Translation3::from(Vector3::from(position_m)),
        yaw_pitch_roll(yaw, pitch, roll),
    )
}

fn mirror(scene: &Scene, mirror: &RoomMirror, frame_from_room: &Pose) -> Result<BuiltFacet, SimError> {
    let attitude = [mirror.yaw_deg, mirror.pitch_deg, mirror.roll_deg];
    let place = frame_from_room * pose(mirror.position_m, attitude);
    let fail = || SimError::Facet {
        name: mirror.name.clone(),
        reason: "no plane mirror fits its description".to_owned(),
    };
    let corners = plane_corners(&mirror.shape).ok_or_else(fail)?;
    let face = Polygon::new(corners.iter().map(|c| place * c).collect()).ok_or_else(fail)?;
    let thickness = mirror.thickness_mm * 1e-3;
    BuiltFacet::exact(
        mirror.name.clone(),
        face,
        thickness,
        mirror.two_sided,
        mirror.glass,
        Finish::of(&scene.superstructure.mirror, None),
    )
    .ok_or_else(fail)
}

fn surface(scene: &Scene, surface: &RoomSurface, place: &Pose) -> Result<Shape, SimError> {
    let polygon = |corners: Option<Vec<Point3<f64>>>| {
        corners
            .and_then(|corners| Polygon::new(corners.iter().map(|c| place * c).collect()))
            .map(Shape::Polygon)
            .ok_or_else(|| SimError::Surface {
                name: surface.name.clone(),
                reason: "no plane outline fits its description".to_owned(),
            })
    };
    match &surface.shape {
        SurfaceShape::Rectangle(shape) => polygon(rectangle_corners(shape)),
        SurfaceShape::Polygon(shape) => polygon(Some(points(&shape.corners_m))),
        SurfaceShape::Box(shape) => Ok(Shape::Block(Block::new(*place, Vector3::from(shape.size_m)))),
        SurfaceShape::Cylinder(shape) => Ok(Shape::Cylinder(Cylinder::new(
            *place,
            shape.diameter_m,
            shape.height_m,
        ))),
        SurfaceShape::Mesh(shape) => mesh_shape(scene, shape, place),
    }
}

/// Corners of an outline in its own frame, in meters; `None` for a zero-length normal.
pub(crate) fn plane_corners(shape: &PlaneShape) -> Option<Vec<Point3<f64>>> {
    match shape {
        PlaneShape::Rectangle(shape) => rectangle_corners(shape),
        PlaneShape::Polygon(shape) => Some(points(&shape.corners_m)),
    }
}

pub(crate) fn rectangle_corners(shape: &PlaneRectangle) -> Option<Vec<Point3<f64>>> {
    rectangle(
        Point3::from(shape.center_m),
        shape.normal.into(),
        [shape.width_m, shape.height_m],
    )
}

fn points(corners: &[[f64; 3]]) -> Vec<Point3<f64>> {
    corners.iter().copied().map(Point3::from).collect()
}
