//! What every beam hits in the drawing.

use crate::build::room::room_from_rig;
use crate::build::structure;
use crate::scene::{Facet, Scene};
use catoptric_cast::Ray;
use catoptric_cast::{Curved, Polygon, Shape};
use catoptric_model::beam;
use catoptric_model::frame::yaw_pitch_roll;
use catoptric_model::{Deflection, MirrorPlane, Pose, ScanGeometry};
use nalgebra::{Point3, Translation3, Unit, Vector3};

/// How the beams of a scan are used, by the drawing alone.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Outline {
    /// The facets, with the beams that the drawing sends to them.
    pub facets: Vec<ServedFacet>,
    /// Beams that hit neither facet nor post.
    pub direct_beams: usize,
    /// Beams that end on a post or on the back of a facet.
    pub blocked_beams: usize,
}

/// A facet and its beams.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ServedFacet {
    /// Name.
    pub name: String,
    /// Number of beams whose chief ray the drawing sends to it.
    pub beams: usize,
}

/// Determines from the drawing alone how the beams of a scan are used.
pub fn outline(scene: &Scene) -> Outline {
    // Of a scanner that cannot be, the checks have said so.
    let scan = scene.scanner.scan().unwrap_or_default();
    let met = Obstacles::of(scene, &scan).met_by_beams();
    let facets: Vec<ServedFacet> = scene
        .superstructure
        .facet
        .iter()
        .enumerate()
        .map(|(i, facet)| ServedFacet {
            name: facet.name.clone(),
            beams: met.iter().filter(|m| **m == Some(Meets::Facet(i))).count(),
        })
        .collect();
    let direct_beams = met.iter().filter(|m| m.is_none()).count();
    let served: usize = facets.iter().map(|f| f.beams).sum();
    Outline {
        facets,
        direct_beams,
        blocked_beams: scan.beams() - direct_beams - served,
    }
}

/// What a beam hits first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Meets {
    /// The reflecting side of a facet.
    Facet(usize),
    /// The back of a facet.
    Back(usize),
    /// A post.
    Post(usize),
}

/// A facet as drawn.
pub(super) struct Face {
    pub(super) corners: Vec<Point3<f64>>,
    pub(super) plane: MirrorPlane,
    /// Its surface, if it is not flat; that of the triangles stands for it where bodies meet.
    curved: Option<Curved>,
    pub(super) triangles: Vec<Self>,
}

/// An opaque box: its frame and half extents.
struct Block {
    post_from_sensor: Pose,
    half: Vector3<f64>,
}

/// Everything around the scanner, in the sensor frame of the drawing.
pub(super) struct Obstacles {
    pub(super) facets: Vec<Option<Face>>,
    posts: Vec<Solid>,
    scan: ScanGeometry,
}

/// An opaque body.
enum Solid {
    Block(Block),
    /// A cylinder or a mesh; `None` for a mesh that has not been read.
    Other(Option<Shape>),
}

fn from_origin(u: &Unit<Vector3<f64>>) -> Ray {
    Ray {
        origin: Point3::origin(),
        direction: *u,
    }
}

impl Solid {
    /// Distance at which a beam hits it from outside.
    fn distance(&self, u: &Unit<Vector3<f64>>) -> Option<f64> {
        match self {
            Self::Block(block) => block.distance(u),
            Self::Other(shape) => shape.as_ref()?.distance(&from_origin(u)),
        }
    }
}

impl Face {
    /// `None` if the corners span no plane.
    pub(super) fn new(corners: Vec<Point3<f64>>) -> Option<Self> {
        let normal = Unit::try_new(catoptric_cast::area_vector(&corners), f64::MIN_POSITIVE)?;
        let plane = MirrorPlane::through(*corners.first()?, normal);
        Some(Self {
            corners,
            plane,
            curved: None,
            triangles: Vec::new(),
        })
    }

    /// A facet with its curve or bow.
    fn of(facet: &Facet, scan: &ScanGeometry) -> Option<Self> {
        let mut face = facet.shape.corners(scan).and_then(Self::new)?;
        if let Some(curve) = facet.bent(&face.corners) {
            let surface = curve.over(&face.corners, &face.plane.normal, 0.0)?;
            let curved = Curved::new(Polygon::new(face.corners.clone())?, surface)?;
            let triangles = curved.triangles().into_iter();
            face.triangles = triangles.filter_map(|t| Self::new(t.to_vec())).collect();
            face.curved = Some(curved);
        }
        Some(face)
    }

    /// Whether a point of the plane is inside the convex outline.
    fn contains(&self, point: &Point3<f64>) -> bool {
        let edges = self.corners.iter().zip(self.corners.iter().cycle().skip(1));
        edges
            .into_iter()
            .all(|(a, b)| (b - a).cross(&(point - a)).dot(&self.plane.normal) >= 0.0)
    }

    /// Distance at which a beam hits the outline, from either side.
    pub(super) fn distance(&self, u: &Unit<Vector3<f64>>) -> Option<f64> {
        if let Some(curved) = &self.curved {
            return curved.cast(&from_origin(u));
        }
        let d = self.plane.offset / self.plane.normal.dot(u);
        (d.is_finite() && d > 0.0 && self.contains(&Point3::from(u.into_inner() * d))).then_some(d)
    }

    /// Whether a ray hits the outline, from either side; of a curved facet, that in its plane.
    pub(super) fn holds(&self, ray: &Ray) -> bool {
        let normal = &self.plane.normal;
        let d = (self.plane.offset - normal.dot(&ray.origin.coords)) / normal.dot(&ray.direction);
        d.is_finite() && d > 0.0 && self.contains(&(ray.origin + ray.direction.into_inner() * d))
    }

    /// How the facet deflects a beam that hits its reflecting side.
    pub(super) fn deflect(&self, u: &Unit<Vector3<f64>>) -> Option<Deflection> {
        self.met_at(u)?.deflect(*u)
    }

    /// The plane that it has where a beam hits it, from either side.
    pub(super) fn met_at(&self, u: &Unit<Vector3<f64>>) -> Option<MirrorPlane> {
        let distance = self.distance(u)?;
        Some(self.curved.as_ref().map_or(self.plane, |curved| {
            let point = Point3::from(u.into_inner() * distance);
            MirrorPlane::through(point, curved.surface.normal_at(&point))
        }))
    }
}

impl Block {
    /// Distance at which a beam hits the box (slab method). `None` from inside: that post is reported separately, and
    /// what it would hide does not matter.
    fn distance(&self, u: &Unit<Vector3<f64>>) -> Option<f64> {
        let origin = self.post_from_sensor * Point3::origin();
        let v = self.post_from_sensor * u.into_inner();
        let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
        for axis in 0..3 {
            if v[axis] == 0.0 {
                if origin[axis].abs() > self.half[axis] {
                    return None;
                }
                continue;
            }
            let a = (-self.half[axis] - origin[axis]) / v[axis];
            let b = (self.half[axis] - origin[axis]) / v[axis];
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        (enter > 0.0 && enter <= leave).then_some(enter)
    }
}

impl Obstacles {
    pub(super) fn of(scene: &Scene, scan: &ScanGeometry) -> Self {
        let drawn = &scene.superstructure;
        let facets = drawn.facet.iter().map(|f| Face::of(f, scan)).collect();
        let posts = drawn.post.iter().map(|post| match (post.size_mm, &post.shape) {
            (Some(size), None) => {
                let center = Vector3::from(post.center_mm) * 1e-3;
                let turn = yaw_pitch_roll(
                    post.yaw_deg.to_radians(),
                    post.pitch_deg.to_radians(),
                    post.roll_deg.to_radians(),
                );
                Solid::Block(Block {
                    post_from_sensor: Pose::from_parts(Translation3::from(center), turn).inverse(),
                    half: Vector3::from(size) * 0.5e-3,
                })
            }
            (_, None) => Solid::Other(None),
            _ => Solid::Other(structure::post_shape(scene, post, &Pose::identity()).ok()),
        });
        Self {
            facets,
            posts: posts.collect(),
            scan: *scan,
        }
    }

    /// What one beam hits first.
    pub(super) fn met_by(&self, u: &Unit<Vector3<f64>>) -> Option<Meets> {
        let facets = self.facets.iter().enumerate().filter_map(|(i, face)| {
            let face = face.as_ref()?;
            let distance = face.distance(u)?;
            let side = if face.met_at(u)?.normal.dot(u) < 0.0 {
                Meets::Facet(i)
            } else {
                Meets::Back(i)
            };
            Some((distance, side))
        });
        let posts = self.posts.iter().enumerate();
        let posts = posts.filter_map(|(i, post)| Some((post.distance(u)?, Meets::Post(i))));
        facets
            .chain(posts)
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, what)| what)
    }

    /// What every beam of a scan hits first.
    pub(super) fn met_by_beams(&self) -> Vec<Option<Meets>> {
        (0..self.scan.beams())
            .map(|i| self.met_by(&beam::direction(self.scan.azimuth(i))))
            .collect()
    }

    /// Whether the scanner's origin is inside a post.
    pub(super) fn post_holds_origin(&self, post: usize) -> bool {
        match &self.posts[post] {
            Solid::Block(block) => {
                let origin = block.post_from_sensor * Point3::origin();
                (0..3).all(|axis| origin[axis].abs() <= block.half[axis])
            }
            Solid::Other(shape) => shape.as_ref().is_some_and(|s| s.holds(&Point3::origin())),
        }
    }
}

/// Pose of the sensor in the room, as drawn.
pub(super) fn nominal_room_from_sensor(scene: &Scene) -> Pose {
    room_from_rig(&scene.room) * structure::nominal_mount(scene)
}
