//! Traces any rays through a scene: their paths, vertex by vertex, in the room frame.
//!
//! The structure around the scanner, if there is one, is as built with the scene's own seed; boards, which have another
//! pose in every stretch, are left out.

use crate::build::color;
use crate::build::room::room_from_rig;
use crate::build::stage::Stage;
use crate::build::structure::Structure;
use crate::error::SimError;
use crate::laboratory::wall_targets;
use crate::light::optics::{Bounce, Course, End, Mirrors, Setting};
use crate::scene::Scene;
use catoptric_cast::Ray;
use catoptric_model::Pose;
use nalgebra::{Point3, Unit, Vector3};

/// What a scene contains for rays to hit.
pub struct Scenery {
    scene: Scene,
    /// Rays are cast in the sensor frame, or in the room's own if there is no sensor.
    room_from_frame: Option<Pose>,
    structure: Structure,
    stage: Stage,
}

/// A scenery with an index over it.
pub struct Tracer<'a> {
    setting: Setting<'a>,
    room_from_frame: Option<Pose>,
    max_bounces: usize,
}

/// Where a ray hits a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vertex {
    /// Index of the surface in [`Tracer::surfaces`].
    pub surface: usize,
    /// The point, in the room frame.
    pub point: Point3<f64>,
    /// Direction in which the ray continues; `None` where it ends.
    pub direction: Option<Unit<Vector3<f64>>>,
    /// Optical path length from the ray's origin to here, in meters.
    pub path: f64,
}

/// How a ray ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fate {
    /// On a surface that scatters: the last vertex.
    Hit,
    /// In the open, after its last vertex.
    Escaped,
    /// Between mirrors after the last bounce that is allowed, or in the rim of a mirror's glass.
    Trapped,
}

impl Scenery {
    /// The scenery of a scene.
    ///
    /// # Errors
    /// A mirror or surface without a shape; a mesh that has not been read.
    pub fn new(scene: &Scene) -> Result<Self, SimError> {
        let (structure, room_from_frame) = if scene.has_no_laboratory() {
            (Structure::empty(), None)
        } else {
            let structure = Structure::as_built(scene, scene.seed)?;
            let pose = room_from_rig(&scene.room) * structure.rig_from_sensor;
            (structure, Some(pose))
        };
        let frame_from_room = room_from_frame.map_or_else(Pose::identity, |p| p.inverse());
        Ok(Self {
            stage: Stage::new(scene, &frame_from_room)?,
            scene: scene.clone(),
            room_from_frame,
            structure,
        })
    }

    /// The room and everything fixed in it, without the rig.
    ///
    /// # Errors
    /// As for [`new`](Self::new).
    pub fn room(scene: &Scene) -> Result<Self, SimError> {
        Ok(Self {
            stage: Stage::new(scene, &Pose::identity())?,
            scene: scene.clone(),
            room_from_frame: None,
            structure: Structure::empty(),
        })
    }

    /// Builds the index; a ray may hit at most `max_bounces` mirrors in succession.
    ///
    /// # Errors
    /// An unknown color.
    pub fn tracer(&self, max_bounces: usize) -> Result<Tracer<'_>, SimError> {
        let frame_from_room = self.room_from_frame.map_or_else(Pose::identity, |p| p.inverse());
        let targets = if self.scene.room.has_walls() {
            let paint = color::paint(&self.scene, &self.scene.room.color)?;
            wall_targets(&self.scene, &frame_from_room, &paint)
        } else {
            Vec::new()
        };
        let setting = Setting::in_room(
            &self.scene,
            &self.structure,
            Mirrors::Attached,
            Some(&self.stage),
            targets,
        )?;
        Ok(Tracer {
            setting,
            room_from_frame: self.room_from_frame,
            max_bounces,
        })
    }
}

impl Tracer<'_> {
    /// Names of the surfaces, by the index that a vertex gives.
    pub fn surfaces(&self) -> Vec<&str> {
        self.setting.names()
    }

    /// Follows a ray given in the room frame and appends the vertices of its path.
    ///
    /// A mirror behind glass has three: where the ray enters, the silver, and where it leaves.
    pub fn follow(&self, ray: &Ray, vertices: &mut Vec<Vertex>) -> Fate {
        let local = match &self.room_from_frame {
            None => *ray,
            Some(pose) => Ray {
                origin: pose.inverse_transform_point(&ray.origin),
                direction: Unit::new_unchecked(pose.inverse_transform_vector(&ray.direction)),
            },
        };
        let to_room = |surface, point: Point3<f64>, direction: Option<Unit<Vector3<f64>>>, path| {
            let pose = self.room_from_frame.as_ref();
            Vertex {
                surface,
                point: pose.map_or(point, |p| p * point),
                direction: direction.map(|d| pose.map_or(d, |p| Unit::new_unchecked(p * d.into_inner()))),
                path,
            }
        };
        let course: Course = self.setting.follow(&local, self.max_bounces, None, |b: &Bounce| {
            if let Some(passage) = &b.passage {
                let silver = b.point + passage.to_silver;
                let inwards = Unit::new_normalize(passage.to_silver);
                let outwards = Unit::new_normalize(passage.walk - passage.to_silver);
                vertices.push(to_room(b.surface, b.point, Some(inwards), b.length));
                vertices.push(to_room(
                    b.surface,
                    silver,
                    Some(outwards),
                    b.length + 0.5 * passage.path,
                ));
            }
            vertices.push(to_room(
                b.surface,
                b.after.origin,
                Some(b.after.direction),
                b.length_after,
            ));
        });
        match course.end {
            End::Hit(hit) => {
                vertices.push(to_room(hit.surface, hit.point, None, course.length));
                Fate::Hit
            }
            End::Escaped => Fate::Escaped,
            End::Trapped => Fate::Trapped,
        }
    }
}
