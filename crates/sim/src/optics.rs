//! The way of a ray: from the scanner over mirrors to whatever stops it.

use crate::cast::{Hit, Shape, World};
use crate::color::{self, Paint};
use crate::error::SimError;
use crate::footprint::Ray;
use crate::glass::{self, Passage};
use crate::scene::Scene;
use crate::stage::Stage;
use crate::structure::{Back, BuiltFacet, Structure};
use catoptric_model::mirror;
use nalgebra::Point3;

/// Most mirrors a ray can meet; `max_bounces` may be less.
pub const MAX_BOUNCES: usize = 8;

/// What a surface is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Role {
    /// A mirror, by its index: first those of the structure, then those of the room.
    Facet(usize),
    /// A post, the housing or a bare backing.
    Structure,
    /// The target board.
    Board,
    /// A wall, floor or ceiling.
    Wall,
    /// Another surface in the room.
    Object,
}

/// Everything in the sensor frame that light can meet during one stretch.
pub struct Setting<'a> {
    world: World,
    surfaces: Vec<Surface>,
    facets: Vec<&'a BuiltFacet>,
    max_bounces: usize,
    diffuse_reflectivity: f64,
}

#[derive(Debug, Clone)]
struct Surface {
    name: String,
    role: Role,
    side: Side,
    paint: Paint,
}

/// Which side of a surface reflects.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    /// Neither.
    None,
    /// The front, a mirror's face.
    Face,
    /// Both: a two-sided mirror without thickness.
    Both,
    /// The front, which is the back of a mirror's body.
    Back,
}

/// Whether the mirrors are in place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mirrors {
    /// They are.
    Attached,
    /// Step 3: the bare structure behind them is seen.
    Removed,
}

/// A painted surface in the sensor frame: a board or a wall.
pub struct Target {
    /// Its name.
    pub name: String,
    /// Its shape.
    pub shape: Shape,
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
    /// Between mirrors, after the last bounce allowed, or in the rim of a mirror's glass.
    Trapped,
}

/// What a ray brought to a mirror that it met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Meeting {
    /// Index of the surface.
    pub surface: usize,
    /// Length up to there, in metres.
    pub length: f64,
    /// Cosine of the incidence.
    pub cos_incidence: f64,
    /// Reflections by silver before.
    pub silvered: usize,
    /// Share of the light that glass before has let pass.
    pub gain: f64,
}

/// A reflection.
#[derive(Debug, Clone, Copy)]
pub struct Bounce {
    /// The mirror, by its index.
    pub facet: usize,
    /// Where it was met.
    pub point: Point3<f64>,
    /// Index of the surface.
    pub surface: usize,
    /// Length up to `point`, in metres.
    pub length: f64,
    /// What the glass did, if the light went through any.
    pub passage: Option<Passage>,
    /// The ray that leaves.
    pub after: Ray,
    /// Length up to where it leaves, in metres.
    pub length_after: f64,
    meeting: Meeting,
}

/// What becomes of a ray as a whole.
#[derive(Debug, Clone, Copy)]
pub struct Course {
    /// Mirrors met.
    pub count: usize,
    /// Length to the end, in metres; to the last mirror if there is no end.
    pub length: f64,
    /// Reflections by silver.
    pub silvered: usize,
    /// Share of the light that glass has let pass, or turned back for a ghost.
    pub gain: f64,
    /// The last leg.
    pub last: Ray,
    /// How it ends.
    pub end: End,
}

/// The way of a ray.
#[derive(Debug, Clone, Copy)]
pub struct Path {
    count: usize,
    facets: [usize; MAX_BOUNCES],
    points: [Point3<f64>; MAX_BOUNCES],
    meetings: [Option<Meeting>; MAX_BOUNCES],
    /// Reflections by silver; a ghost has one less than it met mirrors.
    pub silvered: usize,
    /// Share of the light that glass has let pass, or turned back for a ghost: 1 without ghosts.
    pub gain: f64,
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

    /// What the ray brought to each of them.
    pub fn meetings(&self) -> impl Iterator<Item = Meeting> {
        self.meetings.into_iter().flatten()
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
        Self::in_room(scene, structure, mirrors, None, targets)
    }

    /// The same, and what stands in the room.
    ///
    /// # Errors
    /// As [`Setting::new`].
    pub fn in_room(
        scene: &Scene,
        structure: &'a Structure,
        mirrors: Mirrors,
        stage: Option<&'a Stage>,
        targets: Vec<Target>,
    ) -> Result<Self, SimError> {
        let dull = color::paint(scene, "structure")?;
        let mut list = List::default();
        for (index, facet) in structure.facets.iter().enumerate() {
            match mirrors {
                Mirrors::Attached => list.mirror(facet, index, &dull),
                Mirrors::Removed => {
                    let bare = Shape::Polygon(facet.backing.clone());
                    list.add(&facet.name, bare, Role::Structure, Side::None, dull.clone());
                }
            }
        }
        for part in &structure.parts {
            let paint = color::paint(scene, &part.color)?;
            list.add(&part.name, part.shape.clone(), Role::Structure, Side::None, paint);
        }
        for target in targets {
            list.add(&target.name, target.shape, target.role, Side::None, target.paint);
        }
        let mut facets: Vec<&BuiltFacet> = structure.facets.iter().collect();
        if let Some(stage) = stage {
            for mirror in &stage.mirrors {
                list.mirror(mirror, facets.len(), &dull);
                facets.push(mirror);
            }
            for part in &stage.surfaces {
                let paint = color::paint(scene, &part.color)?;
                list.add(&part.name, part.shape.clone(), Role::Object, Side::None, paint);
            }
        }
        Ok(Self {
            world: World::new(list.shapes),
            surfaces: list.surfaces,
            facets,
            max_bounces: (scene.superstructure.max_bounces as usize).min(MAX_BOUNCES),
            diffuse_reflectivity: scene.superstructure.mirror.diffuse_reflectivity,
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

    /// Names of all surfaces, by their index.
    pub fn names(&self) -> Vec<&str> {
        self.surfaces.iter().map(|s| s.name.as_str()).collect()
    }

    /// Share of the light that the mirrors themselves scatter.
    pub fn diffuse_reflectivity(&self) -> f64 {
        self.diffuse_reflectivity
    }

    /// Follows a ray from mirror to mirror, always to the nearest surface.
    ///
    /// A mirror reflects with its face; its back is opaque, unless the mirror has two sides.
    pub fn trace(&self, ray: &Ray) -> Path {
        self.path(ray, None)
    }

    /// The ghosts of a ray: for every glass on its way that has one, the way of the light that its front turned back.
    ///
    /// Light that is turned back twice or goes to and fro within a glass is left out, and so is what goes out by one
    /// way and comes home by the other: the energy of all ways together is less than what was sent.
    pub fn ghosts(&self, ray: &Ray, path: &Path) -> impl Iterator<Item = Path> {
        let fronts = path.facets().iter().enumerate();
        let fronts = fronts.filter(|(_, f)| self.facets[**f].glass.is_some_and(|g| g.ghost));
        fronts.map(|(bounce, _)| self.path(ray, Some(bounce)))
    }

    fn path(&self, ray: &Ray, ghost: Option<usize>) -> Path {
        let mut facets = [0; MAX_BOUNCES];
        let mut points = [Point3::origin(); MAX_BOUNCES];
        let mut meetings = [None; MAX_BOUNCES];
        let mut count = 0;
        let course = self.follow(ray, self.max_bounces, ghost, |bounce| {
            facets[count] = bounce.facet;
            points[count] = bounce.point;
            meetings[count] = Some(bounce.meeting);
            count += 1;
        });
        Path {
            count,
            facets,
            points,
            meetings,
            silvered: course.silvered,
            gain: course.gain,
            length: course.length,
            last: course.last,
            end: course.end,
        }
    }

    /// The mirror that a hit is on, and whether it is the body's back.
    fn reflecting(&self, hit: &Hit) -> Option<(usize, bool)> {
        let surface = &self.surfaces[hit.surface];
        let Role::Facet(facet) = surface.role else {
            return None;
        };
        match (surface.side, hit.front) {
            (Side::Face | Side::Both, true) => Some((facet, false)),
            (Side::Both, false) | (Side::Back, true) => Some((facet, true)),
            _ => None,
        }
    }

    /// Follows a ray over at most `limit` mirrors and tells of every bounce; at bounce number `ghost` the light is
    /// turned back by the front of the glass.
    pub(crate) fn follow(
        &self,
        ray: &Ray,
        limit: usize,
        ghost: Option<usize>,
        mut tell: impl FnMut(&Bounce),
    ) -> Course {
        let mut course = Course {
            count: 0,
            length: 0.0,
            silvered: 0,
            gain: 1.0,
            last: *ray,
            end: End::Escaped,
        };
        let mut left = None;
        while let Some(hit) = self.world.cast(&course.last, left) {
            let Some((facet, back)) = self.reflecting(&hit) else {
                course.length += hit.distance;
                course.end = End::Hit(hit);
                break;
            };
            if course.count == limit {
                course.end = End::Trapped;
                break;
            }
            let Some(bounce) = self.bounce(&course, &hit, facet, back, ghost == Some(course.count)) else {
                course.end = End::Trapped;
                break;
            };
            tell(&bounce);
            let meeting = bounce.meeting;
            let glass = self.facets[facet].glass.filter(|g| g.ghost);
            if ghost == Some(course.count) {
                // No glass in the way turns nothing back.
                course.gain *= bounce.passage.map_or(0.0, |p| p.fresnel);
            } else {
                course.silvered += 1;
                if let (Some(_), Some(passage)) = (glass, &bounce.passage) {
                    // In and out through the front.
                    let through = 1.0 - passage.fresnel;
                    course.gain *= through * through;
                }
            }
            course.count += 1;
            course.length = bounce.length_after;
            course.last = bounce.after;
            left = Some(meeting.surface);
        }
        course
    }

    /// A reflection; `None` if the light comes to the rim of the glass.
    fn bounce(&self, course: &Course, hit: &Hit, facet: usize, back: bool, ghost: bool) -> Option<Bounce> {
        let mirror = self.facets[facet];
        let incoming = course.last.direction;
        let normal = match (back, hit.front) {
            (false, _) => mirror.normal_at(&hit.point),
            (true, true) => hit.normal,
            (true, false) => -hit.normal,
        };
        let length = course.length + hit.distance;
        let cos_incidence = -normal.dot(&incoming);
        let mut bounce = Bounce {
            facet,
            point: hit.point,
            surface: hit.surface,
            length,
            passage: None,
            after: Ray {
                origin: hit.point,
                direction: mirror::reflect(&incoming, &normal),
            },
            length_after: length,
            meeting: Meeting {
                surface: hit.surface,
                length,
                cos_incidence,
                silvered: course.silvered,
                gain: course.gain,
            },
        };
        let glass = mirror.glass.filter(|_| !back && cos_incidence > 0.0);
        if let Some(glass) = glass {
            let passage = glass::pass(&glass, &incoming, &normal);
            bounce.passage = Some(passage);
            if !ghost {
                bounce.after.origin = hit.point + passage.walk;
                bounce.length_after = length + passage.path;
                let inside = |p: &Point3<f64>| mirror.face.contains(p);
                if !inside(&(hit.point + passage.to_silver)) || !inside(&bounce.after.origin) {
                    return None;
                }
            }
        }
        Some(bounce)
    }
}

/// Surfaces as they are listed.
#[derive(Default)]
struct List {
    shapes: Vec<Shape>,
    surfaces: Vec<Surface>,
}

impl List {
    fn add(&mut self, name: &str, shape: Shape, role: Role, side: Side, paint: Paint) {
        self.shapes.push(shape);
        self.surfaces.push(Surface {
            name: name.to_owned(),
            role,
            side,
            paint,
        });
    }

    /// A mirror's face, and its back and rim if it has two sides.
    fn mirror(&mut self, mirror: &BuiltFacet, index: usize, dull: &Paint) {
        let role = Role::Facet(index);
        let side = match mirror.back {
            Some(Back::Face) => Side::Both,
            _ => Side::Face,
        };
        let face = Shape::Polygon(mirror.face.clone());
        self.add(&mirror.name, face, role, side, dull.clone());
        if let Some(Back::Body { face, rim }) = &mirror.back {
            let back = Shape::Polygon(face.clone());
            self.add(&mirror.name, back, role, Side::Back, dull.clone());
            for strip in rim {
                let strip = Shape::Polygon(strip.clone());
                self.add(&mirror.name, strip, Role::Structure, Side::None, dull.clone());
            }
        }
    }
}
