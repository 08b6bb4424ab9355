//! The way of a ray: from the scanner over mirrors to whatever stops it.
//!
//! Rays are cast in the sensor frame. While nothing moves, all surfaces are in it. In a flight the structure is, which
//! moves with the sensor, and the room is in the sensor frame of the flight's start: every leg is cast into both, each
//! time from where the sensor is then, and the nearer surface counts.

use crate::cast::{Hit, Shape, World};
use crate::color::{self, Paint};
use crate::error::SimError;
use crate::footprint::Ray;
use crate::glass::{self, Passage};
use crate::scene::Scene;
use crate::stage::Stage;
use crate::structure::{Back, BuiltFacet, Part, Structure};
use catoptric_model::{Pose, mirror};
use nalgebra::{Point3, Unit, Vector3};
use std::borrow::Cow;
use std::sync::Arc;

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

/// Everything that light can meet during one stretch, as the sensor sees it from where it is.
pub struct Setting<'a> {
    contents: Arc<Contents<'a>>,
    /// Where the sensor is in the frame that the room is kept in; `None` where it started.
    start_from_sensor: Option<Pose>,
}

/// What a setting holds, wherever the sensor is.
struct Contents<'a> {
    /// What moves with the sensor, in its frame; all there is while nothing moves.
    world: World,
    /// What the sensor moves past.
    room: Option<World>,
    surfaces: Vec<Surface>,
    /// Index of the first surface of the room.
    first_of_room: usize,
    facets: Vec<Cow<'a, BuiltFacet>>,
    max_bounces: usize,
    diffuse_reflectivity: f64,
}

/// Where a leg of a ray ends, in the frame that the surface is kept in.
struct Leg<'p> {
    hit: Hit,
    /// Direction of the ray.
    incoming: Unit<Vector3<f64>>,
    /// From the sensor frame to that frame, unless it is the same.
    kept_from_sensor: Option<&'p Pose>,
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
        let (mut list, mut facets) = structure_list(scene, structure, mirrors)?;
        let first_of_room = list.shapes.len();
        let mirrors = stage.map_or([].as_slice(), |s| s.mirrors.as_slice());
        let parts = stage.map_or([].as_slice(), |s| s.surfaces.as_slice());
        list.room(
            scene,
            &mut facets,
            targets,
            mirrors.iter().map(Cow::Borrowed),
            parts,
        )?;
        Ok(Self::of(
            scene,
            (list.shapes, None),
            list.surfaces,
            first_of_room,
            facets,
        ))
    }

    /// The structure with its mirrors, flying past the targets and what stands in the room, all of it in the sensor
    /// frame of the flight's start; seen from there.
    ///
    /// # Errors
    /// As [`Setting::new`].
    pub fn in_flight(
        scene: &Scene,
        structure: &'a Structure,
        stage: Stage,
        targets: Vec<Target>,
    ) -> Result<Self, SimError> {
        let (mut list, mut facets) = structure_list(scene, structure, Mirrors::Attached)?;
        let first_of_room = list.shapes.len();
        let mirrors = stage.mirrors.into_iter().map(Cow::Owned);
        list.room(scene, &mut facets, targets, mirrors, &stage.surfaces)?;
        let room = list.shapes.split_off(first_of_room);
        Ok(Self::of(
            scene,
            (list.shapes, Some(room)),
            list.surfaces,
            first_of_room,
            facets,
        ))
    }

    fn of(
        scene: &Scene,
        (shapes, room): (Vec<Shape>, Option<Vec<Shape>>),
        surfaces: Vec<Surface>,
        first_of_room: usize,
        facets: Vec<Cow<'a, BuiltFacet>>,
    ) -> Self {
        let contents = Contents {
            world: World::new(shapes),
            room: room.map(World::new),
            surfaces,
            first_of_room,
            facets,
            max_bounces: (scene.superstructure.max_bounces as usize).min(MAX_BOUNCES),
            diffuse_reflectivity: scene.superstructure.mirror.diffuse_reflectivity,
        };
        Self {
            contents: Arc::new(contents),
            start_from_sensor: None,
        }
    }

    /// The same from another place of the sensor; exactly the same where it has not moved, and where nothing can.
    #[must_use]
    pub fn seen_from(&self, start_from_sensor: &Pose) -> Self {
        let moved = self.contents.room.is_some() && *start_from_sensor != Pose::identity();
        Self {
            contents: Arc::clone(&self.contents),
            start_from_sensor: moved.then_some(*start_from_sensor),
        }
    }

    /// What a surface is.
    pub fn role(&self, surface: usize) -> Role {
        self.contents.surfaces[surface].role
    }

    /// How a surface scatters.
    pub fn paint(&self, surface: usize) -> &Paint {
        &self.contents.surfaces[surface].paint
    }

    /// Names of all surfaces, by their index.
    pub fn names(&self) -> Vec<&str> {
        self.contents.surfaces.iter().map(|s| s.name.as_str()).collect()
    }

    /// Share of the light that the mirrors themselves scatter.
    pub fn diffuse_reflectivity(&self) -> f64 {
        self.contents.diffuse_reflectivity
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
        let fronts = fronts.filter(|(_, f)| self.contents.facets[**f].glass.is_some_and(|g| g.ghost));
        fronts.map(|(bounce, _)| self.path(ray, Some(bounce)))
    }

    fn path(&self, ray: &Ray, ghost: Option<usize>) -> Path {
        let mut facets = [0; MAX_BOUNCES];
        let mut points = [Point3::origin(); MAX_BOUNCES];
        let mut meetings = [None; MAX_BOUNCES];
        let mut count = 0;
        let course = self.follow(ray, self.contents.max_bounces, ghost, |bounce| {
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
        let surface = &self.contents.surfaces[hit.surface];
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
        while let Some(leg) = self.cast(&course.last, left) {
            let Some((facet, back)) = self.reflecting(&leg.hit) else {
                course.length += leg.hit.distance;
                course.end = End::Hit(leg.in_sensor_frame());
                break;
            };
            if course.count == limit {
                course.end = End::Trapped;
                break;
            }
            let Some(bounce) = self.bounce(&course, &leg, facet, back, ghost == Some(course.count)) else {
                course.end = End::Trapped;
                break;
            };
            tell(&bounce);
            let meeting = bounce.meeting;
            let glass = self.contents.facets[facet].glass.filter(|g| g.ghost);
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

    /// The nearest surface along a ray of the sensor frame, `left` (the one it just left) aside.
    fn cast(&self, ray: &Ray, left: Option<usize>) -> Option<Leg<'_>> {
        let contents = &*self.contents;
        let unmoved = |hit| Leg {
            hit,
            incoming: ray.direction,
            kept_from_sensor: None,
        };
        let Some(room) = &contents.room else {
            return contents.world.cast(ray, left).map(unmoved);
        };
        let first = contents.first_of_room;
        let own = contents.world.cast(ray, left.filter(|l| *l < first));
        let moved = self.start_from_sensor.as_ref();
        let ray_in_room = moved.map_or(*ray, |pose| placed(ray, pose));
        let past = room.cast(&ray_in_room, left.and_then(|l| l.checked_sub(first)));
        match (own, past) {
            (Some(own), Some(past)) if own.distance <= past.distance => Some(unmoved(own)),
            (own, None) => own.map(unmoved),
            (_, Some(past)) => Some(Leg {
                hit: Hit {
                    surface: past.surface + first,
                    ..past
                },
                incoming: ray_in_room.direction,
                kept_from_sensor: moved,
            }),
        }
    }

    /// A reflection; `None` if the light comes to the rim of the glass.
    fn bounce(
        &self,
        course: &Course,
        leg: &Leg<'_>,
        facet: usize,
        back: bool,
        ghost: bool,
    ) -> Option<Bounce> {
        let mirror = &self.contents.facets[facet];
        let (hit, incoming) = (&leg.hit, leg.incoming);
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
        Some(leg.kept_from_sensor.map_or(bounce, |pose| bounce.seen_from(pose)))
    }
}

impl Leg<'_> {
    /// Where the leg ends, in the sensor frame.
    fn in_sensor_frame(&self) -> Hit {
        self.kept_from_sensor.map_or(self.hit, |pose| Hit {
            point: pose.inverse_transform_point(&self.hit.point),
            normal: pose.inverse_transform_unit_vector(&self.hit.normal),
            ..self.hit
        })
    }
}

impl Bounce {
    /// The same in the frame of a sensor in another place.
    fn seen_from(self, kept_from_sensor: &Pose) -> Self {
        let turned = |v: &Vector3<f64>| kept_from_sensor.inverse_transform_vector(v);
        Self {
            point: kept_from_sensor.inverse_transform_point(&self.point),
            passage: self.passage.map(|p| Passage {
                to_silver: turned(&p.to_silver),
                walk: turned(&p.walk),
                ..p
            }),
            after: placed(&self.after, &kept_from_sensor.inverse()),
            ..self
        }
    }
}

/// A ray moved into another frame.
fn placed(ray: &Ray, other_from_ray: &Pose) -> Ray {
    Ray {
        origin: other_from_ray * ray.origin,
        direction: other_from_ray * ray.direction,
    }
}

/// The structure, with or without its mirrors, and the mirrors themselves.
fn structure_list<'a>(
    scene: &Scene,
    structure: &'a Structure,
    mirrors: Mirrors,
) -> Result<(List, Vec<Cow<'a, BuiltFacet>>), SimError> {
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
    Ok((list, structure.facets.iter().map(Cow::Borrowed).collect()))
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

    /// What is in the room: targets, then mirrors and surfaces.
    fn room<'a>(
        &mut self,
        scene: &Scene,
        facets: &mut Vec<Cow<'a, BuiltFacet>>,
        targets: Vec<Target>,
        mirrors: impl Iterator<Item = Cow<'a, BuiltFacet>>,
        parts: &[Part],
    ) -> Result<(), SimError> {
        let dull = color::paint(scene, "structure")?;
        for target in targets {
            self.add(&target.name, target.shape, target.role, Side::None, target.paint);
        }
        for mirror in mirrors {
            self.mirror(&mirror, facets.len(), &dull);
            facets.push(mirror);
        }
        for part in parts {
            let paint = color::paint(scene, &part.color)?;
            self.add(&part.name, part.shape.clone(), Role::Object, Side::None, paint);
        }
        Ok(())
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
