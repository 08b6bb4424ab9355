//! The way of a ray: from the scanner over mirrors to whatever stops it.

use crate::cast::{Hit, Polygon, Shape, World};
use crate::color::{self, Paint};
use crate::error::SimError;
use crate::footprint::Ray;
use crate::scene::Scene;
use crate::structure::Structure;
use catoptric_model::mirror;
use nalgebra::Point3;

/// Most mirrors a ray can meet; `max_bounces` may be less.
pub const MAX_BOUNCES: usize = 8;

/// What a surface is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Role {
    /// A mirror, by its index.
    Facet(usize),
    /// A post, the housing or a bare backing.
    Structure,
    /// The target board.
    Board,
    /// A wall, floor or ceiling.
    Wall,
}

/// Everything in the sensor frame that light can meet during one stretch.
pub struct Setting<'a> {
    world: World,
    surfaces: Vec<Surface>,
    structure: &'a Structure,
    max_bounces: usize,
}

#[derive(Debug, Clone)]
struct Surface {
    role: Role,
    paint: Paint,
}

/// Whether the mirrors are in place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mirrors {
    /// They are.
    Attached,
    /// Step 3: the bare structure behind them is seen.
    Removed,
}

/// A painted polygon in the sensor frame: a board or a wall.
pub struct Target {
    /// Its outline.
    pub polygon: Polygon,
    /// What it is.
    pub role: Role,
    /// Its color.
    pub paint: Paint,
}

/// How a ray's way ends.
#[derive(Debug, Clone, Copy)]
pub enum End {
    /// On a surface that scatters.
    Hit(Hit),
    /// In the open.
    Escaped,
    /// Between mirrors, after the last bounce allowed.
    Trapped,
}

/// The way of a ray.
#[derive(Debug, Clone, Copy)]
pub struct Path {
    count: usize,
    facets: [usize; MAX_BOUNCES],
    points: [Point3<f64>; MAX_BOUNCES],
    /// Length from the scanner to the end, in metres; to the last mirror if there is no end.
    pub length: f64,
    /// The last leg.
    pub last: Ray,
    /// How it ends.
    pub end: End,
}

impl Path {
    /// The facets met, in order.
    pub fn facets(&self) -> &[usize] {
        &self.facets[..self.count]
    }

    /// Where they were met, in the sensor frame.
    pub fn points(&self) -> &[Point3<f64>] {
        &self.points[..self.count]
    }
}

impl<'a> Setting<'a> {
    /// The structure, with or without its mirrors, and the targets around it.
    ///
    /// # Errors
    /// [`SimError::UnknownColor`] for a part whose color nobody defined.
    pub fn new(
        scene: &Scene,
        structure: &'a Structure,
        mirrors: Mirrors,
        targets: Vec<Target>,
    ) -> Result<Self, SimError> {
        let dull = color::paint(scene, "structure")?;
        let mut shapes = Vec::new();
        let mut surfaces = Vec::new();
        for (index, facet) in structure.facets.iter().enumerate() {
            let (polygon, role) = match mirrors {
                Mirrors::Attached => (&facet.face, Role::Facet(index)),
                Mirrors::Removed => (&facet.backing, Role::Structure),
            };
            shapes.push(Shape::Polygon(polygon.clone()));
            surfaces.push(Surface {
                role,
                paint: dull.clone(),
            });
        }
        for part in &structure.parts {
            shapes.push(part.shape.clone());
            surfaces.push(Surface {
                role: Role::Structure,
                paint: color::paint(scene, &part.color)?,
            });
        }
        for target in targets {
            shapes.push(Shape::Polygon(target.polygon));
            surfaces.push(Surface {
                role: target.role,
                paint: target.paint,
            });
        }
        let max_bounces = (scene.superstructure.max_bounces as usize).min(MAX_BOUNCES);
        Ok(Self {
            world: World::new(shapes),
            surfaces,
            structure,
            max_bounces,
        })
    }

    /// What a surface is.
    pub fn role(&self, surface: usize) -> Role {
        self.surfaces[surface].role
    }

    /// How a surface scatters.
    pub fn paint(&self, surface: usize) -> &Paint {
        &self.surfaces[surface].paint
    }

    /// Follows a ray from mirror to mirror, always to the nearest surface.
    ///
    /// A mirror reflects with its face; its back is opaque.
    pub fn trace(&self, ray: &Ray) -> Path {
        let mut path = Path {
            count: 0,
            facets: [0; MAX_BOUNCES],
            points: [Point3::origin(); MAX_BOUNCES],
            length: 0.0,
            last: *ray,
            end: End::Escaped,
        };
        let mut left = None;
        while let Some(hit) = self.world.cast(&path.last, left) {
            let facet = match self.surfaces[hit.surface].role {
                Role::Facet(facet) if hit.front => facet,
                _ => {
                    path.length += hit.distance;
                    path.end = End::Hit(hit);
                    break;
                }
            };
            if path.count == self.max_bounces {
                path.end = End::Trapped;
                break;
            }
            path.length += hit.distance;
            path.facets[path.count] = facet;
            path.points[path.count] = hit.point;
            path.count += 1;
            let normal = self.structure.facets[facet].normal_at(&hit.point);
            path.last = Ray {
                origin: hit.point,
                direction: mirror::reflect(&path.last.direction, &normal),
            };
            left = Some(hit.surface);
        }
        path
    }
}
