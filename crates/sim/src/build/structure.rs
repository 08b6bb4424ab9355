//! The scanner with its mirrors, as drawn and as built.
//!
//! The drawing is made in the nominal sensor frame. As built, every facet is slightly turned, shifted and irregular,
//! and the laser's own frame is slightly off in its housing: in the true sensor frame, everything bolted to the housing
//! moves accordingly.

use crate::build::coating::Finish;
use crate::error::SimError;
use crate::noise::{Draws, Purpose};
use crate::scene::{Facet, Glass, MeshShape, Post, PostShape, Scene};
use catoptric_cast::{Block, Curved, Cylinder, Polygon, Shape, Triangles, area_vector};
use catoptric_model::frame::yaw_pitch_roll;
use catoptric_model::{Curve, Pose};
use nalgebra::{Point3, Translation3, Unit, UnitQuaternion, Vector3};
use std::sync::Arc;

/// A mirror in the sensor frame.
#[derive(Debug, Clone)]
pub struct BuiltFacet {
    /// Name.
    pub name: String,
    /// The reflecting face; of a mirror that is not flat, the outline in the plane that it touches.
    pub face: Polygon,
    /// The surface of the bare structure behind the mirror, likewise.
    pub backing: Polygon,
    /// Face and bare structure of a mirror that is not flat.
    pub bent: Option<Bent>,
    /// Distance from the bare structure to the reflecting face, in meters.
    pub thickness: f64,
    /// Glass in front of the reflecting surface.
    pub glass: Option<Glass>,
    /// How it reflects.
    pub(crate) finish: Finish,
    /// The second reflecting side of a two-sided mirror.
    pub back: Option<Back>,
    slope: Slope,
}

/// A mirror that is not flat.
#[derive(Debug, Clone)]
pub struct Bent {
    /// How it bends.
    pub curve: Curve,
    /// The reflecting face.
    pub face: Arc<Curved>,
    /// The surface of the bare structure, parallel to the face.
    pub backing: Arc<Curved>,
}

impl Bent {
    /// How far its face reaches behind the plane that it touches, in meters; 0 for a concave mirror.
    pub fn behind(&self) -> f64 {
        let outline = &self.face.outline;
        let depth = |p: &Point3<f64>| outline.normal.dot(&(outline.origin - p));
        self.face.rim().iter().map(depth).fold(0.0, f64::max)
    }
}

/// The second reflecting side of a mirror.
#[derive(Debug, Clone)]
pub enum Back {
    /// The face itself: the mirror has no thickness.
    Face,
    /// A reflecting outline behind the face, and the opaque rim between the two.
    Body {
        /// The outline, facing away from the face.
        face: Polygon,
        /// One strip per edge.
        rim: Vec<Polygon>,
    },
}

/// An opaque part in the sensor frame.
#[derive(Debug, Clone)]
pub struct OpaquePart {
    /// Name.
    pub name: String,
    /// Its shape.
    pub shape: Shape,
    /// Its color.
    pub color: String,
}

/// The scanner's surroundings in the sensor frame.
#[derive(Debug, Clone)]
pub struct Structure {
    /// Pose of the sensor in the rig.
    pub rig_from_sensor: Pose,
    /// The mirrors.
    pub facets: Vec<BuiltFacet>,
    /// Posts and housing.
    pub parts: Vec<OpaquePart>,
}

/// Slope of a facet's surface relative to its plane: the gradient of a cubic height field over the facet.
#[derive(Debug, Clone, PartialEq)]
struct Slope {
    center: Point3<f64>,
    /// Axes of the facet's plane, divided by the facet's half extent.
    axes: [Vector3<f64>; 2],
    /// Coefficients of x², xy, y², x³, x²y, xy², y³ in the height divided by the half extent.
    height: [f64; 7],
}

impl Slope {
    /// Number of steps per axis of the grid over which the root mean square is taken.
    const GRID: i32 = 20;

    fn new(face: &Polygon, rms: f64, draws: &mut Draws) -> Self {
        let center = centroid(&face.corners);
        let x = (face.corners[1] - face.corners[0]).normalize();
        let y = face.normal.cross(&x);
        let extent = face
            .corners
            .iter()
            .map(|c| (c - center).norm())
            .fold(0.0, f64::max);
        let mut slope = Self {
            center,
            axes: [x / extent, y / extent],
            height: [0.0; 7],
        };
        slope.height = std::array::from_fn(|_| draws.normal());
        let step = |i: i32| 2.0 * f64::from(i) / f64::from(Self::GRID) - 1.0;
        let grid = (0..=Self::GRID).flat_map(|i| (0..=Self::GRID).map(move |j| (step(i), step(j))));
        let (sum, count) = grid.fold((0.0, 0.0), |(sum, count), (x, y)| {
            let [a, b] = slope.gradient(x, y);
            (sum + 0.5 * (a * a + b * b), count + 1.0)
        });
        let scale: f64 = rms / f64::sqrt(sum / count);
        slope.height = slope.height.map(|c| c * scale);
        slope
    }

    /// Slopes along the two axes at normalized coordinates.
    fn gradient(&self, x: f64, y: f64) -> [f64; 2] {
        let [xx, xy, yy, xxx, xxy, xyy, yyy] = self.height;
        [
            2.0 * xx * x + xy * y + 3.0 * xxx * x * x + 2.0 * xxy * x * y + xyy * y * y,
            xy * x + 2.0 * yy * y + xxy * x * x + 2.0 * xyy * x * y + 3.0 * yyy * y * y,
        ]
    }
}

fn centroid(corners: &[Point3<f64>]) -> Point3<f64> {
    Point3::from(corners.iter().map(|c| c.coords).sum::<Vector3<f64>>() / corners.len() as f64)
}

impl Back {
    /// The back of a mirror of a given thickness, in meters. `None` for an outline without area.
    pub(crate) fn of(face: &Polygon, thickness: f64) -> Option<Self> {
        if thickness == 0.0 {
            return Some(Self::Face);
        }
        let behind = face.normal.into_inner() * thickness;
        let back: Vec<_> = face.corners.iter().map(|c| c - behind).collect();
        let next = |i: usize| (i + 1) % back.len();
        let rim = (0..back.len()).filter_map(|i| {
            Polygon::new(vec![
                back[i],
                back[next(i)],
                face.corners[next(i)],
                face.corners[i],
            ])
        });
        Some(Self::Body {
            rim: rim.collect(),
            face: Polygon::new(back.clone())?.turned()?,
        })
    }
}

impl BuiltFacet {
    /// A flat mirror at its nominal pose. `None` for an outline without area.
    pub(crate) fn exact(
        name: String,
        face: Polygon,
        thickness: f64,
        two_sided: bool,
        glass: Option<Glass>,
        finish: Finish,
    ) -> Option<Self> {
        let behind = face.normal.into_inner() * thickness;
        let backing = Polygon::new(face.corners.iter().map(|c| c - behind).collect())?;
        let back = two_sided.then(|| Back::of(&face, thickness));
        Some(Self {
            slope: Slope {
                center: face.origin,
                axes: [Vector3::zeros(); 2],
                height: [0.0; 7],
            },
            name,
            backing,
            bent: None,
            thickness,
            glass,
            finish,
            back: match back {
                Some(back) => Some(back?),
                None => None,
            },
            face,
        })
    }

    /// Share of unpolarized light that it reflects, at a cosine of the incidence.
    pub fn reflectivity(&self, cos_incidence: f64, wavelength_nm: f64) -> f64 {
        let [s, p] = self.finish.amplitudes(cos_incidence, wavelength_nm);
        0.5 * (s.norm_sqr() + p.norm_sqr())
    }

    /// Whether both reflect identically.
    pub(crate) fn reflects_like(&self, other: &Self) -> bool {
        self.slope == other.slope
            && self.glass == other.glass
            && self.finish == other.finish
            && self.face.corners == other.face.corners
            && self.bent.as_ref().map(|b| b.face.surface) == other.bent.as_ref().map(|b| b.face.surface)
    }

    /// The reflecting face as light meets it.
    pub fn face_shape(&self) -> Shape {
        match &self.bent {
            None => Shape::Polygon(self.face.clone()),
            Some(bent) => Shape::Curved(Arc::clone(&bent.face)),
        }
    }

    /// The bare structure as light meets it once the mirror is removed.
    pub fn backing_shape(&self) -> Shape {
        match &self.bent {
            None => Shape::Polygon(self.backing.clone()),
            Some(bent) => Shape::Curved(Arc::clone(&bent.backing)),
        }
    }

    /// Normal of the reflecting surface at a point on it.
    pub fn normal_at(&self, point: &Point3<f64>) -> Unit<Vector3<f64>> {
        let normal = match &self.bent {
            None => self.face.normal,
            Some(bent) => bent.face.surface.normal_at(point),
        };
        if self.slope.height == [0.0; 7] {
            return normal;
        }
        let offset = point - self.slope.center;
        let [x, y] = self.slope.axes;
        let [a, b] = self.slope.gradient(x.dot(&offset), y.dot(&offset));
        // The axes carry the length scale of the coordinates; the slope is dimensionless.
        Unit::new_normalize(normal.into_inner() - x.normalize() * a - y.normalize() * b)
    }
}

/// Pose of the sensor in the rig, as drawn.
pub fn nominal_mount(scene: &Scene) -> Pose {
    let mount = &scene.scanner.mount;
    Pose::from_parts(
        Translation3::from(Vector3::from(mount.position_mm) * 1e-3),
        yaw_pitch_roll(mount.yaw_deg.to_radians(), 0.0, 0.0),
    )
}

impl Structure {
    /// The structure as drawn.
    ///
    /// # Errors
    /// [`SimError::Facet`] for a facet that spans no mirror, [`SimError::Patterns`] if the patterns have not been
    /// expanded by [`crate::build::pattern::expand`].
    pub fn nominal(scene: &Scene) -> Result<Self, SimError> {
        Self::build(scene, None)
    }

    /// The structure as built, with the manufacturing errors of a seed.
    ///
    /// # Errors
    /// As for [`Structure::nominal`].
    pub fn as_built(scene: &Scene, seed: u64) -> Result<Self, SimError> {
        Self::build(scene, Some(seed))
    }

    fn build(scene: &Scene, seed: Option<u64>) -> Result<Self, SimError> {
        if !scene.superstructure.pattern.is_empty() {
            return Err(SimError::Patterns);
        }
        let nominal = nominal_mount(scene);
        let mount_error = seed.map_or_else(Pose::identity, |seed| mount_error(scene, seed));
        let sensor_from_drawing = mount_error.inverse();
        let facets = scene.superstructure.facet.iter().enumerate();
        let facets = facets
            .map(|(index, facet)| {
                build_facet(
                    scene,
                    facet,
                    seed.map(|s| (s, index as u64)),
                    &sensor_from_drawing,
                )
            })
            .collect::<Result<_, _>>()?;
        Ok(Self {
            rig_from_sensor: nominal * mount_error,
            facets,
            parts: parts(scene, &sensor_from_drawing)?,
        })
    }

    /// An empty structure, for scenes of which only the room is used.
    pub fn empty() -> Self {
        Self {
            rig_from_sensor: Pose::identity(),
            facets: Vec::new(),
            parts: Vec::new(),
        }
    }
}

/// Pose of the true sensor frame in the nominal one, drawn uniformly within the data sheet's tolerances.
fn mount_error(scene: &Scene, seed: u64) -> Pose {
    let mount = &scene.scanner.mount;
    let mut draws = Draws::new(seed, Purpose::Mount, 0);
    let tilt = mount.tilt_tolerance_deg.to_radians();
    let (yaw, pitch, roll) = (
        draws.within(mount.yaw_tolerance_deg.to_radians()),
        draws.within(tilt),
        draws.within(tilt),
    );
    let shift = Vector3::from_fn(|_, _| draws.within(mount.shift_tolerance_mm * 1e-3));
    Pose::from_parts(Translation3::from(shift), yaw_pitch_roll(yaw, pitch, roll))
}

fn build_facet(
    scene: &Scene,
    facet: &Facet,
    seed_and_index: Option<(u64, u64)>,
    sensor_from_drawing: &Pose,
) -> Result<BuiltFacet, SimError> {
    let fail = |reason: &str| SimError::Facet {
        name: facet.name.clone(),
        reason: reason.to_owned(),
    };
    let scan = scene.scanner.scan()?;
    let drawn = facet
        .shape
        .corners(&scan)
        .ok_or_else(|| fail("no plane mirror fits its description"))?;
    let as_built = &scene.superstructure.as_built;
    let error = seed_and_index.map_or_else(Pose::identity, |(seed, index)| {
        let mut draws = Draws::new(seed, Purpose::FacetPose, index);
        let turn = UnitQuaternion::from_scaled_axis(draws.normal3() * as_built.tilt_sd_deg.to_radians());
        let center = centroid(&drawn).coords;
        let shift = draws.normal3() * (as_built.shift_sd_mm * 1e-3);
        Pose::from_parts(Translation3::from(center + shift - turn * center), turn)
    });
    let place = sensor_from_drawing * error;
    let corners: Vec<_> = drawn.iter().map(|c| place * c).collect();
    let flat = |corners| Polygon::new(corners).ok_or_else(|| fail("its corners lie on a line"));
    let mut face = flat(corners)?;
    let mut thickness = scene.superstructure.mirror.thickness_mm * 1e-3;
    let behind = face.normal.into_inner() * thickness;
    let backing = flat(face.corners.iter().map(|c| c - behind).collect())?;
    if let Some((seed, index)) = seed_and_index
        && as_built.thickness_sd_mm > 0.0
    {
        // The bare structure stays in place; a thickness cannot be negative.
        let draw = Draws::new(seed, Purpose::MirrorThickness, index).normal();
        let thicker = (draw * as_built.thickness_sd_mm * 1e-3).max(-thickness);
        let ahead = face.normal.into_inner() * thicker;
        face = flat(face.corners.iter().map(|c| c + ahead).collect())?;
        thickness += thicker;
    }
    let (rms, (seed, index)) = match seed_and_index {
        Some(key) => (as_built.slope_rms_mrad * 1e-3, key),
        None => (0.0, (0, 0)),
    };
    let slope = Slope::new(&face, rms, &mut Draws::new(seed, Purpose::FacetSlope, index));
    let back = match facet.two_sided {
        true => Some(Back::of(&face, thickness).ok_or_else(|| fail("its corners lie on a line"))?),
        false => None,
    };
    let bent = match facet.bent(&drawn) {
        None => None,
        Some(curve) => {
            let steep = || fail("its curve does not reach over its outline");
            let place = BentPlace {
                curve,
                drawn: &drawn,
                place: &place,
            };
            Some(place.bent(&face, &backing, thickness).ok_or_else(steep)?)
        }
    };
    Ok(BuiltFacet {
        name: facet.name.clone(),
        face,
        backing,
        bent,
        thickness,
        glass: scene.superstructure.mirror.glass,
        finish: Finish::of(&scene.superstructure.mirror, Some(facet)),
        back,
        slope,
    })
}

/// A curve over a drawn outline, and where the outline was built.
struct BentPlace<'a> {
    curve: Curve,
    drawn: &'a [Point3<f64>],
    place: &'a Pose,
}

impl BentPlace<'_> {
    /// The face as built and the bare structure behind it; `None` if the curve does not reach over the outline.
    fn bent(&self, face: &Polygon, backing: &Polygon, thickness: f64) -> Option<Bent> {
        let normal = Unit::try_new(area_vector(self.drawn), f64::MIN_POSITIVE)?;
        let over = |outline: &Polygon, ahead: f64| {
            let surface = self.curve.over(self.drawn, &normal, ahead)?.moved(self.place);
            Some(Arc::new(Curved::new(outline.clone(), surface)?))
        };
        // The bare structure stays in place, and a thicker mirror is ahead of it.
        let drawn = (self.place * self.drawn.first()? - backing.corners.first()?).dot(&backing.normal);
        Some(Bent {
            curve: self.curve,
            face: over(face, thickness - drawn)?,
            backing: over(backing, -drawn)?,
        })
    }
}

/// The shape of a post: placed by the drawing, then transformed by `frame_from_drawing`.
///
/// # Errors
/// [`SimError::Mesh`] for a mesh that has not been read.
pub(crate) fn post_shape(scene: &Scene, post: &Post, frame_from_drawing: &Pose) -> Result<Shape, SimError> {
    let turn = yaw_pitch_roll(
        post.yaw_deg.to_radians(),
        post.pitch_deg.to_radians(),
        post.roll_deg.to_radians(),
    );
    let place = Pose::from_parts(Translation3::from(Vector3::from(post.center_mm) * 1e-3), turn);
    let frame_from_post = frame_from_drawing * place;
    Ok(match &post.shape {
        // Without a size the block is empty; the checks of the scene report it.
        None => Shape::Block(Block::new(
            frame_from_post,
            Vector3::from(post.size_mm.unwrap_or_default()) * 1e-3,
        )),
        Some(PostShape::Cylinder(c)) => Shape::Cylinder(Cylinder::new(
            frame_from_post,
            c.diameter_mm * 1e-3,
            c.height_mm * 1e-3,
        )),
        Some(PostShape::Mesh(mesh)) => mesh_shape(scene, mesh, &frame_from_post)?,
    })
}

/// A placed mesh.
///
/// # Errors
/// [`SimError::Mesh`] for a mesh that has not been read.
pub(crate) fn mesh_shape(
    scene: &Scene,
    shape: &MeshShape,
    frame_from_mesh: &Pose,
) -> Result<Shape, SimError> {
    let mesh = scene.meshes.get(&shape.file)?;
    let triangles = Triangles::new(mesh, shape.units.in_meters(), frame_from_mesh);
    Ok(Shape::Mesh(Arc::new(triangles)))
}

fn parts(scene: &Scene, sensor_from_drawing: &Pose) -> Result<Vec<OpaquePart>, SimError> {
    let posts = scene.superstructure.post.iter();
    let mut parts: Vec<OpaquePart> = posts
        .map(|p| {
            Ok(OpaquePart {
                name: p.name.clone(),
                shape: post_shape(scene, p, sensor_from_drawing)?,
                color: p.color.clone(),
            })
        })
        .collect::<Result<_, SimError>>()?;
    parts.extend(scene.scanner.housing_boxes().iter().map(|part| {
        let place = Pose::from_parts(
            Translation3::from(Vector3::from(part.center_mm) * 1e-3),
            UnitQuaternion::identity(),
        );
        OpaquePart {
            name: "housing".to_owned(),
            shape: Shape::Block(Block::new(
                sensor_from_drawing * place,
                Vector3::from(part.size_mm) * 1e-3,
            )),
            color: "structure".to_owned(),
        }
    }));
    Ok(parts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_error_of_a_surface_is_as_specified() {
        let corners = [(-0.02, -0.01), (0.02, -0.01), (0.02, 0.01), (-0.02, 0.01)];
        let corners = corners.map(|(x, y)| Point3::new(x, y, 0.0)).to_vec();
        let face = Polygon::new(corners).expect("it has an area");
        let slope = Slope::new(&face, 0.5e-3, &mut Draws::new(3, Purpose::FacetSlope, 0));
        let facet = BuiltFacet {
            name: String::new(),
            backing: face.clone(),
            bent: None,
            thickness: 0.0,
            face,
            glass: None,
            finish: Finish::Plain(1.0),
            back: None,
            slope,
        };
        // Over the square around the facet's circumscribed circle, where the root mean square is defined.
        let extent = libm::hypot(0.02, 0.01);
        let n = 200;
        let at = |i: i32| extent * (2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0);
        let slopes = (0..n).flat_map(|i| (0..n).map(move |j| Point3::new(at(i), at(j), 0.0)));
        let square = slopes.map(|p| {
            let normal = facet.normal_at(&p);
            0.5 * (normal.x * normal.x + normal.y * normal.y)
        });
        let rms = (square.sum::<f64>() / f64::from(n * n)).sqrt();
        // The definition uses a coarser grid of 21 × 21 points: at most 7 % off for a cubic.
        assert!((rms / 0.5e-3 - 1.0).abs() < 0.07 && rms != 0.0, "{rms}");
        assert!((facet.normal_at(&Point3::origin()).z - 1.0).abs() < 1e-15);
    }
}
