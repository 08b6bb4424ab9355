//! What a set of boards can determine at all: rank, and the directions that change no range, named in plain language.
//!
//! No beliefs and no measurements enter, only the geometry. The columns of the Jacobian are the unknowns requested
//! ([`Unknowns`]): the angles of an element or the planes of facets, the pose of the sensor, and range errors
//!
//! ```text
//! δz = B + A_c·r + A_a·cos θ_N          B_a and B_c are one column: only their sum B exists
//! ```

use crate::judge::levers::libm_cos;
use crate::lsq::{Information, Point, Residuals, linearize};
use crate::readings::jacobian;
use catoptric_model::{BoardPlane, Deflection, MirrorPlane, beam, frame, range};
use nalgebra::{DMatrix, DVector, Point3, Unit, Vector3};

/// Component of a null vector, relative to the largest, below which it is not named.
const NAMED: f64 = 0.02;

/// A derivative below this, in meters per unit of its unknown, is rounding.
const ROUNDING: f64 = 1e-12;

/// The unknowns besides directions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Unknowns {
    /// The pose of the sensor relative to the boards: six motions.
    pub mounting: bool,
    /// A constant range error B.
    pub constant: bool,
    /// A range error that grows with the range, A_c.
    pub per_meter: bool,
    /// A range error that grows with the cosine of the incidence, A_a.
    pub incidence: bool,
    /// The distance d of each element to its mirror; for a facet it is part of the plane.
    pub distance: bool,
}

/// A beam and what deflects it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ray {
    /// No mirror.
    Direct {
        /// Base azimuth, in radians.
        azimuth: f64,
    },
    /// A mirror that the beam shares with no other: θ_a and φ are unknown.
    Alone {
        /// Base azimuth, in radians.
        azimuth: f64,
        /// The beam's deflection.
        deflection: Deflection,
    },
    /// A facet whose plane is unknown, by its index.
    OfFacet {
        /// Base azimuth, in radians.
        azimuth: f64,
        /// Index of the facet.
        facet: usize,
    },
}

/// Rays, facets and boards in the sensor frame, and which ray reads which board.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Layout {
    /// Planes of the facets.
    pub facets: Vec<MirrorPlane>,
    /// The rays.
    pub rays: Vec<Ray>,
    /// The boards.
    pub boards: Vec<BoardPlane>,
    /// (ray, board) of every range.
    pub sights: Vec<(usize, usize)>,
}

/// What a layout determines.
#[derive(Debug, Clone, PartialEq)]
pub struct Determined {
    /// Names of the unknowns.
    pub unknowns: Vec<String>,
    /// Number of independent combinations of them that the ranges determine.
    pub rank: usize,
    /// The combinations that change no range, each with its terms, the largest first.
    pub open: Vec<Open>,
    information: Information,
}

/// A combination of unknowns that changes no range.
#[derive(Debug, Clone, PartialEq)]
pub struct Open {
    /// Name and share of each unknown, the largest first.
    pub terms: Vec<(String, f64)>,
    /// Description of the combination, and what would determine it.
    pub words: String,
}

impl Determined {
    /// Standard deviation of an unknown for ranges of 1 m standard deviation; `None` if it is open.
    pub fn per_meter(&self, unknown: &str) -> Option<f64> {
        let index = self.unknowns.iter().position(|n| n == unknown)?;
        Some(self.information.covariance_among(&[index])?[(0, 0)].sqrt())
    }
}

/// What the ranges of a layout determine about the unknowns.
///
/// `None` if a ray misses a board that it reads by `sights`, or a facet does not face its beam.
///
/// ```
/// use catoptric_calib::gauge::{self, Layout, Ray, Unknowns};
/// use catoptric_model::{BoardPlane, Deflection};
/// use nalgebra::{Point3, Unit, Vector3};
///
/// // A hinge: boards that turn about one axis.
/// let up = Deflection { azimuth: 0.0, elevation: 0.5, distance: 0.07 };
/// let board = |tilt: f64| BoardPlane::new(
///     Point3::new(2.0, 0.0, 1.1),
///     Unit::new_normalize(Vector3::y() * tilt - up.exit_direction(0.0).into_inner()),
/// );
/// let hinge = Layout {
///     rays: vec![Ray::Alone { azimuth: 0.0, deflection: up }],
///     boards: vec![board(-0.6), board(0.2), board(0.7)],
///     sights: vec![(0, 0), (0, 1), (0, 2)],
///     ..Layout::default()
/// };
/// let found = gauge::determine(&hinge, &Unknowns::default()).expect("the ray meets the boards");
/// assert_eq!((found.rank, found.unknowns.len()), (1, 2));
/// assert!(found.open[0].words.contains("tilt"));
/// ```
pub fn determine(layout: &Layout, unknowns: &Unknowns) -> Option<Determined> {
    let columns = Columns::of(layout, unknowns);
    let mut jacobian = DMatrix::zeros(layout.sights.len(), columns.names.len());
    for (row, (ray, board)) in layout.sights.iter().enumerate() {
        for (column, value) in columns.derivatives(layout, *ray, &layout.boards[*board])? {
            // A column of rounding errors must not count as a lever.
            if value.abs() > ROUNDING {
                jacobian[(row, column)] = value;
            }
        }
    }
    let names = columns.names;
    let geometry = Geometry { jacobian };
    let start = Point::vector(&vec![0.0; names.len()]);
    let information = linearize(&geometry, &start.into()).ok()?.information;
    let borrowed: Vec<&str> = names.iter().map(String::as_str).collect();
    let open = information.open_directions(&borrowed).into_iter().map(|terms| {
        let largest = terms.first().map_or(0.0, |t| t.1.abs());
        let terms: Vec<(String, f64)> = terms
            .into_iter()
            .filter(|t| t.1.abs() > NAMED * largest)
            .map(|(name, share)| (name.to_owned(), share))
            .collect();
        let words = description(&terms, layout);
        Open { terms, words }
    });
    Some(Determined {
        rank: information.rank(),
        open: open.collect(),
        unknowns: names,
        information,
    })
}

/// The linear problem: only its Jacobian matters.
struct Geometry {
    jacobian: DMatrix<f64>,
}

impl Residuals for Geometry {
    fn residuals(&self, at: &Point) -> Option<DVector<f64>> {
        Some(&self.jacobian * at.numbers(0)?)
    }

    fn jacobian(&self, _: &Point) -> Option<DMatrix<f64>> {
        Some(self.jacobian.clone())
    }
}

/// The column of each unknown.
struct Columns {
    names: Vec<String>,
    rays: Vec<Option<usize>>,
    distances: Vec<Option<usize>>,
    facets: Vec<usize>,
    mounting: Option<usize>,
    constant: Option<usize>,
    per_meter: Option<usize>,
    incidence: Option<usize>,
}

impl Columns {
    fn of(layout: &Layout, unknowns: &Unknowns) -> Self {
        let mut names: Vec<String> = Vec::new();
        let mut add = |new: &[String]| {
            let first = names.len();
            names.extend_from_slice(new);
            first
        };
        let alone = layout
            .rays
            .iter()
            .filter(|r| matches!(r, Ray::Alone { .. }))
            .count();
        let of_ray = |ray: usize| {
            if alone > 1 {
                format!(" of ray {ray}")
            } else {
                String::new()
            }
        };
        let mut rays = Vec::new();
        let mut distances = Vec::new();
        for (i, ray) in layout.rays.iter().enumerate() {
            let is_alone = matches!(ray, Ray::Alone { .. });
            rays.push(is_alone.then(|| add(&[format!("θ{}", of_ray(i)), format!("φ{}", of_ray(i))])));
            distances.push((is_alone && unknowns.distance).then(|| add(&[format!("d{}", of_ray(i))])));
        }
        let facets = (0..layout.facets.len())
            .map(|f| {
                add(&[
                    format!("tilt of facet {f} about one axis"),
                    format!("tilt of facet {f} about the other"),
                    format!("offset of facet {f}"),
                ])
            })
            .collect();
        let mounting = unknowns.mounting.then(|| {
            add(&["x", "y", "z", "roll", "pitch", "yaw"].map(|motion| format!("{motion} of the sensor")))
        });
        let mut one = |wanted: bool, name: &str| wanted.then(|| add(&[name.to_owned()]));
        Self {
            constant: one(unknowns.constant, "B"),
            per_meter: one(unknowns.per_meter, "A_c"),
            incidence: one(unknowns.incidence, "A_a"),
            rays,
            distances,
            facets,
            mounting,
            names,
        }
    }

    /// Derivatives of a range, each with its column.
    fn derivatives(&self, layout: &Layout, ray: usize, board: &BoardPlane) -> Option<Vec<(usize, f64)>> {
        let (azimuth, deflection) = match layout.rays[ray] {
            Ray::Direct { azimuth } => (azimuth, Deflection::NONE),
            Ray::Alone { azimuth, deflection } => (azimuth, deflection),
            Ray::OfFacet { azimuth, facet } => {
                let plane = layout.facets.get(facet)?;
                (azimuth, plane.deflect(beam::direction(azimuth))?)
            }
        };
        let v = deflection.exit_direction(azimuth);
        let r = range::predict(&deflection, azimuth, board)?;
        let gradient = jacobian::analytic(&deflection, azimuth, board)?;
        let mut all = Vec::new();
        if let Some(first) = self.rays[ray] {
            // Both as angles on the sphere.
            let cos_elevation = libm_cos(deflection.elevation);
            all.push((first, gradient.azimuth / cos_elevation));
            all.push((first + 1, gradient.elevation));
        }
        all.extend(self.distances[ray].map(|column| (column, gradient.distance)));
        if let Ray::OfFacet { facet, .. } = layout.rays[ray] {
            let of_plane = of_plane(&layout.facets[facet], azimuth, board)?;
            all.extend((self.facets[facet]..).zip(of_plane));
        }
        if let Some(first) = self.mounting {
            let along = v.into_inner() * (r - deflection.distance);
            let hit: Point3<f64> = deflection.deflection_point(azimuth) + along;
            let motion = jacobian::of_mount(&hit, &board.normal, &v);
            all.extend((first..).zip(motion.iter().copied()));
        }
        let errors = [
            (self.constant, 1.0),
            (self.per_meter, r),
            (self.incidence, board.cos_incidence(&v)),
        ];
        all.extend(
            errors
                .into_iter()
                .filter_map(|(column, value)| Some((column?, value))),
        );
        Some(all)
    }
}

/// ∂r/∂(two tilts, offset) of a facet's plane.
fn of_plane(plane: &MirrorPlane, azimuth: f64, board: &BoardPlane) -> Option<[f64; 3]> {
    let u: Unit<Vector3<f64>> = beam::direction(azimuth);
    let m = plane.normal;
    let deflection = plane.deflect(u)?;
    let v = deflection.exit_direction(azimuth);
    let s = board.distance_along(&deflection.deflection_point(azimuth), &v)?;
    let (closing, facing) = (board.normal.dot(&v), m.dot(&u));
    let by_distance = 1.0 - board.normal.dot(&u) / closing;
    let (a, b) = frame::tangent_basis(&m);
    let tilted = |e: &Unit<Vector3<f64>>| {
        let dv = -2.0 * (e.dot(&u) * m.into_inner() + facing * e.into_inner());
        -s * board.normal.dot(&dv) / closing - by_distance * deflection.distance * e.dot(&u) / facing
    };
    Some([tilted(&a), tilted(&b), by_distance / facing])
}

/// Describes an open combination, and what would determine it.
fn description(terms: &[(String, f64)], layout: &Layout) -> String {
    let has = |start: &str| terms.iter().any(|(name, _)| name.starts_with(start));
    let angles = has("θ") || has("φ");
    let planes = has("tilt of facet") || has("offset of facet");
    let names: Vec<&str> = terms.iter().map(|(name, _)| name.as_str()).collect();
    let list = match names.as_slice() {
        [] => return "nothing".to_owned(),
        [one] => format!("{one} changes no range"),
        [one, other] => format!("{one} and {other} cannot be distinguished"),
        [first @ .., last] => format!("{} and {last} cannot be distinguished", first.join(", ")),
    };
    let advice = if has("A_c") && angles {
        "boards share one tilt axis: an angle across it is a scale of the range; add a board pitched the other way"
    } else if (has("B") || has("d") || has("A_a")) && angles {
        "the boards' tilts do not surround the beam: add boards tilted to the other side, and at another range"
    } else if has("A_a") && has("B") {
        "the incidence is the same on all boards: add a board with another tilt"
    } else if has("A_c") && has("B") {
        "all boards are at the same range: add one at another range"
    } else if has("d") && has("B") {
        "a distance to the mirror and a constant of the range add up: measure d on the bare structure"
    } else if has("x of the sensor")
        || has("y of the sensor")
        || has("z of the sensor")
        || has("roll")
        || has("pitch")
        || has("yaw")
    {
        match layout.facets.len() {
            0 => "the boards leave a motion of the sensor open: add boards with other tilts",
            1 => {
                "the sensor and its mirror move together: only the mirrored sensor is seen; add boards in \
                 front of undeflected beams, or facets that face elsewhere"
            }
            2 => {
                "both mirrors turn about the line in which their planes meet, and the sensor with them; add boards \
                 in front of undeflected beams, or a third facet"
            }
            _ => "the sensor and its mirrors move together; add boards in front of undeflected beams",
        }
    } else if angles || planes {
        "boards share one tilt axis, or are face-on: add a board tilted across the others"
    } else {
        "more boards are needed"
    };
    format!("{list}: {advice}")
}
