//! Everything that light can hit, and how it is listed.
//!
//! Rays are cast in the sensor frame. The structure is in it, and so is the room while nothing moves. In a flight the
//! room is kept in the sensor frame of the flight's start. Every leg is cast into both, from the current pose of the
//! sensor, and the nearer surface counts.

use super::clearance::Extent;
use super::path::MAX_BOUNCES;
use crate::build::coating::{Finish, Finishes};
use crate::build::color::{self, Paint};
use crate::build::stage::Stage;
use crate::build::structure::{Back, BuiltFacet, OpaquePart, Structure};
use crate::error::SimError;
use crate::light::edges::EdgeRays;
use crate::light::view::Lens;
use crate::scene::Scene;
use catoptric_cast::Ray;
use catoptric_cast::{Hit, Rays, Shape, SurfacePoint, World, placed};
use catoptric_model::Pose;
use nalgebra::{Point3, Unit, Vector3};
use std::borrow::Cow;
use std::ops::{Deref, Range};

/// The role of a surface.
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
    /// Another surface of the room.
    Object,
}

/// Everything that light can hit during one stretch, as seen from the current pose of the sensor.
pub struct Setting<'a> {
    pub(super) contents: Held<'a>,
    /// Pose of the sensor in the frame in which the room is kept; `None` at the start.
    start_from_sensor: Option<Pose>,
    /// The sub-rays of beams that edges of the structure divide, if they are treated differently.
    edge_rays: Option<&'a EdgeRays>,
}

/// The contents of a setting, or those of another one that is seen from elsewhere.
pub(super) enum Held<'a> {
    Own(Box<Contents<'a>>),
    Lent(&'a Contents<'a>),
}

impl<'a> Deref for Held<'a> {
    type Target = Contents<'a>;

    fn deref(&self) -> &Contents<'a> {
        match self {
            Self::Own(contents) => contents,
            Self::Lent(contents) => contents,
        }
    }
}

/// What a setting contains, wherever the sensor is.
pub(super) struct Contents<'a> {
    /// The structure, which moves with the sensor, in its frame.
    world: World,
    /// What the sensor rests in or moves past, if anything.
    room: Option<World>,
    /// Bounds on where its surfaces are.
    extents: Vec<Extent>,
    /// Radius of a ball around the sensor that contains the structure, in meters.
    pub(super) span: f64,
    /// Whether the sensor can move.
    flies: bool,
    surfaces: Vec<Surface>,
    /// Index of the first surface of the room.
    first_of_room: usize,
    pub(super) facets: Vec<Cow<'a, BuiltFacet>>,
    /// Those that are there, and how many of them the structure has: these come first.
    mirrors: Vec<usize>,
    of_structure: usize,
    pub(super) max_bounces: usize,
    diffuse_reflectivity: f64,
    finishes: Option<Finishes>,
    /// Whether any mirror is not flat.
    pub(super) bends: bool,
}

/// The end of a leg of a ray, in the frame in which the surface is kept.
pub(super) struct Leg<'p> {
    pub(super) hit: SurfacePoint,
    /// Direction of the ray.
    pub(super) incoming: Unit<Vector3<f64>>,
    /// From the sensor frame to that frame, unless they are the same.
    pub(super) kept_from_sensor: Option<&'p Pose>,
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

/// Whether the mirrors are attached.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mirrors {
    /// They are.
    Attached,
    /// Step 3: they are removed, and the bare structure behind them is visible.
    Removed,
}

/// Buffers for the legs of some beams in the frame of the room, and for what they hit.
#[derive(Debug, Default)]
pub(crate) struct Beyond {
    rays: Rays,
    pub(crate) hits: Vec<Option<Hit>>,
}

impl Beyond {
    pub(crate) fn clear(&mut self) {
        self.rays.clear();
    }
}

/// A painted surface in the sensor frame: a board or a wall.
pub struct Target {
    /// Its name.
    pub name: String,
    /// Its shape.
    pub shape: Shape,
    /// Its role.
    pub role: Role,
    /// Its color.
    pub paint: Paint,
}

impl<'a> Setting<'a> {
    /// The structure, with or without its mirrors, and the targets around it.
    ///
    /// # Errors
    /// [`SimError::UnknownColor`] for a part whose color is not defined.
    pub fn new(
        scene: &Scene,
        structure: &'a Structure,
        mirrors: Mirrors,
        targets: Vec<Target>,
    ) -> Result<Self, SimError> {
        Self::in_room(scene, structure, mirrors, None, targets)
    }

    /// The same with everything that is fixed in the room.
    ///
    /// # Errors
    /// As for [`Setting::new`].
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
        Ok(Self::of(scene, list, first_of_room, facets, false))
    }

    /// The structure with its mirrors, flying past the targets and everything that is fixed in the room, all of it in
    /// the sensor frame of the flight's start; seen from there.
    ///
    /// # Errors
    /// As for [`Setting::new`].
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
        Ok(Self::of(scene, list, first_of_room, facets, true))
    }

    fn of(
        scene: &Scene,
        mut list: List,
        first_of_room: usize,
        facets: Vec<Cow<'a, BuiltFacet>>,
        flies: bool,
    ) -> Self {
        let room = list.shapes.split_off(first_of_room);
        let faces = |surface: &Surface| match (surface.role, surface.side) {
            (Role::Facet(facet), Side::Face | Side::Both) => Some(facet),
            _ => None,
        };
        let mirrors: Vec<usize> = list.surfaces.iter().filter_map(faces).collect();
        let of_structure = list.surfaces[..first_of_room].iter().filter_map(faces).count();
        let corners = list.shapes.iter().flat_map(|shape| match shape {
            Shape::Mesh(mesh) => mesh.vertices().to_vec(),
            _ => shape.triangles().into_iter().flatten().collect(),
        });
        let plain = Finish::of(&scene.superstructure.mirror, None);
        let is_plain = matches!(plain, Finish::Plain(_)) && facets.iter().all(|f| f.finish == plain);
        let finishes = (!is_plain).then(|| Finishes {
            of_facets: facets.iter().map(|f| f.finish.clone()).collect(),
            wavelength_nm: scene.light.wavelength_nm,
            polarization: scene.light.polarization_deg.map(f64::to_radians),
        });
        let contents = Contents {
            // The triangles of a cylinder are flat.
            span: 1.01 * corners.map(|c| c.coords.norm()).fold(0.0, f64::max),
            world: World::new(list.shapes),
            extents: room.iter().map(|shape| Extent::of(shape, flies)).collect(),
            room: (!room.is_empty()).then(|| World::new(room)),
            surfaces: list.surfaces,
            first_of_room,
            flies,
            mirrors,
            of_structure,
            bends: facets.iter().any(|f| f.bent.is_some()),
            facets,
            max_bounces: (scene.superstructure.max_bounces as usize).min(MAX_BOUNCES),
            diffuse_reflectivity: scene.superstructure.mirror.scattered(),
            finishes,
        };
        Self {
            contents: Held::Own(Box::new(contents)),
            start_from_sensor: None,
            edge_rays: None,
        }
    }

    /// The same seen from another pose of the sensor; exactly the same if it has not moved or if nothing can.
    #[must_use]
    pub fn seen_from(&self, start_from_sensor: &Pose) -> Setting<'_> {
        let moved = self.contents.flies && *start_from_sensor != Pose::identity();
        Setting {
            contents: Held::Lent(&self.contents),
            start_from_sensor: moved.then_some(*start_from_sensor),
            edge_rays: self.edge_rays,
        }
    }

    /// The same with the sub-rays of beams that edges of its structure divide.
    #[must_use]
    pub fn with_edge_rays(self, edge_rays: Option<&'a EdgeRays>) -> Self {
        Self { edge_rays, ..self }
    }

    /// The sub-rays of beams that edges of the structure divide, if they are treated differently.
    pub(crate) fn edge_rays(&self) -> Option<&'a EdgeRays> {
        self.edge_rays
    }

    /// Whether no part of the room is within a distance of the sensor, in meters.
    pub(super) fn is_clear(&self, distance: f64) -> bool {
        let sensor = self.sensor();
        self.contents
            .extents
            .iter()
            .all(|e| e.is_beyond(&sensor, distance))
    }

    /// Distance of the sensor from its position in another setting, in meters.
    pub(super) fn distance_from(&self, other: &Self) -> f64 {
        (self.sensor() - other.sensor()).norm()
    }

    /// Position of the sensor in the frame in which the room is kept.
    fn sensor(&self) -> Point3<f64> {
        self.start_from_sensor
            .map_or_else(Point3::origin, |pose| Point3::from(pose.translation.vector))
    }

    /// Adds some legs, given in the sensor frame, to those that are to be cast into the room.
    pub(crate) fn leave(&self, rays: &Rays, which: Range<usize>, beyond: &mut Beyond) {
        self.place_in_room(rays, which, &mut beyond.rays);
    }

    /// Appends rays of the sensor frame, transformed into the frame in which the room is kept.
    fn place_in_room(&self, rays: &Rays, which: Range<usize>, in_room: &mut Rays) {
        match &self.start_from_sensor {
            None => in_room.extend_from(rays, which),
            Some(pose) => in_room.extend_placed(rays, which, pose),
        }
    }

    /// Casts all legs into the room, those of neighboring beams together.
    pub(crate) fn cast_into_room(&self, beyond: &mut Beyond) {
        beyond.hits.clear();
        beyond.hits.resize(beyond.rays.len(), None);
        if let Some(room) = &self.contents.room {
            room.cast_packets(&beyond.rays, None, &mut beyond.hits);
        }
    }

    /// Index among all surfaces of one that a leg hit in the room.
    pub(crate) fn surface_in_room(&self, hit: &Hit) -> usize {
        hit.surface as usize + self.contents.first_of_room
    }

    /// Whether a surface belongs to a mirror, on a reflecting side or not.
    pub(crate) fn is_mirror(&self, surface: usize) -> bool {
        matches!(self.role(surface), Role::Facet(_))
    }

    /// The role of a surface.
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

    /// Share of the receiver's lens from which the mirrors show the spot of a part of a beam's light: `facets` are those
    /// on the path to the surface, if there is one, `beam` is its chief ray's direction and `range` the length of the path.
    pub(crate) fn shown(
        &self,
        lens: &Lens,
        beam: &Unit<Vector3<f64>>,
        facets: &[usize],
        (surface, range): (Option<usize>, f64),
    ) -> f64 {
        let outline = |facet: usize| self.outline(facet);
        let via: Vec<Vec<Point3<f64>>> = facets.iter().map(|f| outline(*f)).collect();
        let via: Vec<&[Point3<f64>]> = via.iter().map(Vec::as_slice).collect();
        let own = match surface.map(|surface| self.role(surface)) {
            Some(Role::Facet(facet)) => Some(facet),
            _ => None,
        };
        let past: Vec<Vec<Point3<f64>>> = if facets.is_empty() {
            let others = self.contents.mirrors.iter().filter(|f| Some(**f) != own);
            others.map(|f| outline(*f)).collect()
        } else {
            Vec::new()
        };
        lens.seen(beam, range, &via, past.iter().map(Vec::as_slice))
    }

    /// Corners of a mirror in the sensor frame.
    fn outline(&self, facet: usize) -> Vec<Point3<f64>> {
        let corners = &self.contents.facets[facet].face.corners;
        match &self.start_from_sensor {
            Some(pose) if !self.contents.mirrors[..self.contents.of_structure].contains(&facet) => {
                corners.iter().map(|c| pose.inverse_transform_point(c)).collect()
            }
            _ => corners.clone(),
        }
    }

    /// How the mirrors reflect, if that is not one number.
    pub(crate) fn finishes(&self) -> Option<&Finishes> {
        self.contents.finishes.as_ref()
    }

    /// The mirror that a surface belongs to, if its given side reflects, and whether that side is the back of the
    /// mirror's body.
    pub(crate) fn reflecting(&self, surface: usize, front: bool) -> Option<(usize, bool)> {
        let surface = &self.contents.surfaces[surface];
        let Role::Facet(facet) = surface.role else {
            return None;
        };
        match (surface.side, front) {
            (Side::Face | Side::Both, true) => Some((facet, false)),
            (Side::Both, false) | (Side::Back, true) => Some((facet, true)),
            _ => None,
        }
    }

    /// The structure, if the setting contains nothing else.
    pub(super) fn structure_alone(&self) -> Option<&World> {
        self.contents.room.is_none().then_some(&self.contents.world)
    }

    /// Whether a surface is of the same kind in another setting, on the same side of the same facet.
    pub(super) fn is_same_kind(&self, other: &Setting<'_>, surface: usize) -> bool {
        let (a, b) = (
            &self.contents.surfaces[surface],
            &other.contents.surfaces[surface],
        );
        a.role == b.role && a.side == b.side
    }

    /// Whether the mirror that a surface belongs to, if any, reflects identically in another setting.
    pub(super) fn reflects_identically(&self, other: &Setting<'_>, surface: usize) -> bool {
        match self.contents.surfaces[surface].role {
            Role::Facet(facet) => self.contents.facets[facet].reflects_like(&other.contents.facets[facet]),
            _ => true,
        }
    }

    /// A leg whose end is kept in the sensor frame.
    pub(super) fn unmoved(&self, hit: SurfacePoint, incoming: Unit<Vector3<f64>>) -> Leg<'_> {
        Leg {
            hit,
            incoming,
            kept_from_sensor: None,
        }
    }

    /// The nearest surface along a ray of the sensor frame, except `left`, the one it has just left.
    pub(super) fn cast(&self, ray: &Ray, left: Option<usize>) -> Option<Leg<'_>> {
        let contents = &*self.contents;
        let first = contents.first_of_room;
        let own = contents.world.cast(ray, left.filter(|l| *l < first));
        let Some(room) = &contents.room else {
            return Some(self.end_on_structure(&own?, ray));
        };
        let in_room = self
            .start_from_sensor
            .as_ref()
            .map_or(*ray, |pose| placed(ray, pose));
        let past = room.cast(&in_room, left.and_then(|l| l.checked_sub(first)));
        self.nearer(room, (own, ray), (past, &in_room))
    }

    /// The same along every ray of a beam.
    pub(super) fn cast_packets<'s>(
        &'s self,
        rays: &Rays,
        left: Option<usize>,
        legs: &mut Vec<Option<Leg<'s>>>,
    ) {
        legs.clear();
        let contents = &*self.contents;
        let first = contents.first_of_room;
        let cast = |world: &World, rays: &Rays, left: Option<usize>| {
            let mut hits = vec![None; rays.len()];
            world.cast_packets(rays, left, &mut hits);
            hits
        };
        let own = cast(&contents.world, rays, left.filter(|l| *l < first));
        let own = own.into_iter().zip(rays.iter());
        let Some(room) = &contents.room else {
            legs.extend(own.map(|(hit, ray)| Some(self.end_on_structure(&hit?, &ray))));
            return;
        };
        let mut in_room = Rays::default();
        self.place_in_room(rays, 0..rays.len(), &mut in_room);
        let past = cast(room, &in_room, left.and_then(|l| l.checked_sub(first)));
        let past = past.into_iter().zip(in_room.iter());
        legs.extend(
            own.zip(past)
                .map(|((own, ray), (past, in_room))| self.nearer(room, (own, &ray), (past, &in_room))),
        );
    }

    /// The leg that ends on the nearer of what a ray hits of the structure and, in the frame of the room, of the room.
    fn nearer(
        &self,
        room: &World,
        (own, ray): (Option<Hit>, &Ray),
        (past, in_room): (Option<Hit>, &Ray),
    ) -> Option<Leg<'_>> {
        match (own, past) {
            (Some(own), Some(past)) if own.distance <= past.distance => {
                Some(self.end_on_structure(&own, ray))
            }
            (own, None) => Some(self.end_on_structure(&own?, ray)),
            (_, Some(past)) => {
                let mut hit = room.surface_point(&past, in_room);
                hit.surface += self.contents.first_of_room;
                Some(Leg {
                    hit,
                    incoming: in_room.direction,
                    kept_from_sensor: self.start_from_sensor.as_ref(),
                })
            }
        }
    }

    fn end_on_structure(&self, hit: &Hit, ray: &Ray) -> Leg<'_> {
        self.unmoved(self.contents.world.surface_point(hit, ray), ray.direction)
    }
}

impl Leg<'_> {
    /// The end of the leg in the sensor frame.
    pub(super) fn in_sensor_frame(&self) -> SurfacePoint {
        self.kept_from_sensor.map_or(self.hit, |pose| SurfacePoint {
            point: pose.inverse_transform_point(&self.hit.point),
            normal: pose.inverse_transform_unit_vector(&self.hit.normal),
            ..self.hit
        })
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
                let bare = facet.backing_shape();
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

/// The surfaces of a setting in the order of their indices.
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

    /// Adds what is in the room: targets, then mirrors and surfaces.
    fn room<'a>(
        &mut self,
        scene: &Scene,
        facets: &mut Vec<Cow<'a, BuiltFacet>>,
        targets: Vec<Target>,
        mirrors: impl Iterator<Item = Cow<'a, BuiltFacet>>,
        parts: &[OpaquePart],
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

    /// Adds a mirror's face, and its back and rim if it is two-sided.
    fn mirror(&mut self, mirror: &BuiltFacet, index: usize, dull: &Paint) {
        let role = Role::Facet(index);
        let side = match mirror.back {
            Some(Back::Face) => Side::Both,
            _ => Side::Face,
        };
        self.add(&mirror.name, mirror.face_shape(), role, side, dull.clone());
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
