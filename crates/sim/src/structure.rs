//! The scanner with its mirrors, as drawn and as built.
//!
//! The drawing is made in the nominal sensor frame. As built, every facet is a little turned, shifted and uneven, and
//! the laser's own frame sits a little off in its housing: everything bolted to the housing then moves in the true
//! sensor frame.

use crate::cast::{Block, Polygon, Shape};
use crate::error::SimError;
use crate::layout;
use crate::noise::{Draws, Purpose};
use crate::scanner::HOUSING_MM;
use crate::scene::{Facet, Scene};
use catoptric_model::Pose;
use catoptric_model::frame::yaw_pitch_roll;
use nalgebra::{Point3, Translation3, Unit, UnitQuaternion, Vector3};

/// A mirror in the sensor frame.
#[derive(Debug, Clone)]
pub struct BuiltFacet {
    /// Name.
    pub name: String,
    /// The reflecting face.
    pub face: Polygon,
    /// The bare structure behind the mirror, by its thickness.
    pub backing: Polygon,
    slope: Slope,
}

/// An opaque part in the sensor frame.
#[derive(Debug, Clone)]
pub struct Part {
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
    /// Where the sensor sits in the rig.
    pub rig_from_sensor: Pose,
    /// The mirrors.
    pub facets: Vec<BuiltFacet>,
    /// Posts and housing.
    pub parts: Vec<Part>,
}

/// Slope of a facet's surface about its plane: the gradient of a cubic height field over the facet.
#[derive(Debug, Clone)]
struct Slope {
    center: Point3<f64>,
    /// Axes of the facet's plane, over the facet's half extent.
    axes: [Vector3<f64>; 2],
    /// Coefficients of x², xy, y², x³, x²y, xy², y³ in the height over the half extent.
    height: [f64; 7],
}

impl Slope {
    /// Steps of the grid over which the root mean square is taken.
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

    /// Slopes along the two axes at normalised coordinates.
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

impl BuiltFacet {
    /// Normal of the reflecting surface at one of its points.
    pub fn normal_at(&self, point: &Point3<f64>) -> Unit<Vector3<f64>> {
        if self.slope.height == [0.0; 7] {
            return self.face.normal;
        }
        let offset = point - self.slope.center;
        let [x, y] = self.slope.axes;
        let [a, b] = self.slope.gradient(x.dot(&offset), y.dot(&offset));
        // The axes carry the length scale of the coordinates; the slope itself has none.
        Unit::new_normalize(self.face.normal.into_inner() - x.normalize() * a - y.normalize() * b)
    }
}

/// Where the drawing puts the sensor in the rig.
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
    /// [`SimError::Facet`] for a facet that is no mirror.
    pub fn nominal(scene: &Scene) -> Result<Self, SimError> {
        Self::build(scene, None)
    }

    /// The structure as built under a seed.
    ///
    /// # Errors
    /// As [`Structure::nominal`].
    pub fn as_built(scene: &Scene, seed: u64) -> Result<Self, SimError> {
        Self::build(scene, Some(seed))
    }

    fn build(scene: &Scene, seed: Option<u64>) -> Result<Self, SimError> {
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
            parts: parts(scene, &sensor_from_drawing),
        })
    }
}

/// How the true sensor frame sits in the nominal one: the data sheet's tolerances, uniform.
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
    let drawn = layout::corners(&facet.shape).ok_or_else(|| fail("no plane mirror fits its description"))?;
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
    let face = Polygon::new(corners).ok_or_else(|| fail("its corners lie on a line"))?;
    let behind = face.normal.into_inner() * (scene.superstructure.mirror.thickness_mm * 1e-3);
    let backing = face.corners.iter().map(|c| c - behind).collect();
    let backing = Polygon::new(backing).ok_or_else(|| fail("its corners lie on a line"))?;
    let (rms, (seed, index)) = match seed_and_index {
        Some(key) => (as_built.slope_rms_mrad * 1e-3, key),
        None => (0.0, (0, 0)),
    };
    let slope = Slope::new(&face, rms, &mut Draws::new(seed, Purpose::FacetSlope, index));
    Ok(BuiltFacet {
        name: facet.name.clone(),
        face,
        backing,
        slope,
    })
}

fn parts(scene: &Scene, sensor_from_drawing: &Pose) -> Vec<Part> {
    let block = |name: String, center_mm: [f64; 3], size_mm: [f64; 3], yaw_deg: f64, color: String| {
        let place = Pose::from_parts(
            Translation3::from(Vector3::from(center_mm) * 1e-3),
            yaw_pitch_roll(yaw_deg.to_radians(), 0.0, 0.0),
        );
        let shape = Shape::Block(Block::new(
            sensor_from_drawing * place,
            Vector3::from(size_mm) * 1e-3,
        ));
        Part { name, shape, color }
    };
    let posts = scene.superstructure.post.iter();
    let mut parts: Vec<Part> = posts
        .map(|p| block(p.name.clone(), p.center_mm, p.size_mm, p.yaw_deg, p.color.clone()))
        .collect();
    if scene.scanner.housing {
        let housing = HOUSING_MM.iter();
        parts.extend(
            housing.map(|&(center, size)| {
                block("housing".to_owned(), center, size, 0.0, "structure".to_owned())
            }),
        );
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_surface_is_as_uneven_as_it_is_said_to_be() {
        let corners = [(-0.02, -0.01), (0.02, -0.01), (0.02, 0.01), (-0.02, 0.01)];
        let corners = corners.map(|(x, y)| Point3::new(x, y, 0.0)).to_vec();
        let face = Polygon::new(corners).expect("it has an area");
        let slope = Slope::new(&face, 0.5e-3, &mut Draws::new(3, Purpose::FacetSlope, 0));
        let facet = BuiltFacet {
            name: String::new(),
            backing: face.clone(),
            face,
            slope,
        };
        // Over the square around the facet's circle, on which the root mean square is defined.
        let extent = libm::hypot(0.02, 0.01);
        let n = 200;
        let at = |i: i32| extent * (2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0);
        let slopes = (0..n).flat_map(|i| (0..n).map(move |j| Point3::new(at(i), at(j), 0.0)));
        let square = slopes.map(|p| {
            let normal = facet.normal_at(&p);
            0.5 * (normal.x * normal.x + normal.y * normal.y)
        });
        let rms = (square.sum::<f64>() / f64::from(n * n)).sqrt();
        // The definition's own grid of 21 × 21 is coarser: 7 % at most for a cubic.
        assert!((rms / 0.5e-3 - 1.0).abs() < 0.07 && rms != 0.0, "{rms}");
        assert!((facet.normal_at(&Point3::origin()).z - 1.0).abs() < 1e-15);
    }
}
