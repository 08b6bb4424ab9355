//! Do the markers of a body agree with its template?

use super::body::{Body, limit, solved};
use catoptric_model::{Pose, Watched};
use nalgebra::{Point3, Vector3};

/// Accuracy of a template, in meters: rulers, glue.
const TEMPLATE_SD: f64 = 1e-4;

/// The belief about marker errors is one number for three axes; all of the variance may be along one of them.
const ONE_AXIS: f64 = 3.0;

/// Cosine between a board's normal and the direction to the rig below which the board shows its back.
const BACK: f64 = -0.25;

/// Largest angle between normals that count as one plane, in radians.
const SAME_NORMAL: f64 = 0.02;

/// Markers that disagree with the template.
pub(super) struct Misfit {
    cause: Cause,
    /// Root-mean-square residual per marker, in meters.
    rms: f64,
}

enum Cause {
    /// Exchanged labels, as every pair that explains the misfit, and the pose with them corrected.
    Exchange(Vec<[String; 2]>, Pose),
    /// One misplaced label, and its distance from its marker, in meters.
    Stray(String, f64),
    Unknown,
}

impl Misfit {
    /// Describes what happened to a body of that name.
    pub(super) fn words(&self, name: &str) -> String {
        match &self.cause {
            Cause::Exchange(pairs, _) => {
                let pairs: Vec<String> = pairs.iter().map(|[a, b]| format!("{a:?} and {b:?}")).collect();
                format!(
                    "the labels of markers {} of {name} are exchanged",
                    pairs.join(", or ")
                )
            }
            Cause::Stray(marker, off) => format!(
                "the label of marker {marker:?} of {name} is {:.1} mm from where the other markers put it",
                1e3 * off
            ),
            Cause::Unknown => format!(
                "the markers of {name} do not fit its template ({:.1} mm root mean square)",
                1e3 * self.rms
            ),
        }
    }

    /// The body's pose, if it is certain.
    pub(super) fn corrected(&self) -> Option<Pose> {
        match &self.cause {
            Cause::Exchange(_, pose) => Some(*pose),
            Cause::Stray(..) | Cause::Unknown => None,
        }
    }
}

/// The markers of one body in one pose.
struct Constellation<'a> {
    body: &'a Body<'a>,
    seen: Vec<Option<Point3<f64>>>,
    /// Variance of each marker's position along one axis, in m².
    variance: Vec<f64>,
    faces: Option<&'a Point3<f64>>,
}

/// What is wrong with the markers; `faces` is the point that a board's face is turned to.
pub(super) fn misfit(
    body: &Body<'_>,
    watched: &Watched,
    marker_sd: f64,
    faces: Option<&Point3<f64>>,
) -> Option<Misfit> {
    let whole = watched.whole();
    let constellation = Constellation {
        body,
        seen: whole.iter().map(|m| (m.count > 0).then_some(m.place)).collect(),
        variance: whole
            .iter()
            .map(|m| marker_sd.powi(2) + TEMPLATE_SD.powi(2) + watched.jitter.powi(2) / m.count.max(1) as f64)
            .collect(),
        faces,
    };
    let (pose, squares) = solved(&body.template, &constellation.seen)?;
    let count = constellation.seen.iter().flatten().count();
    if constellation.fits(&constellation.seen, &squares) && !constellation.shows_its_back(&pose) {
        return None;
    }
    Some(Misfit {
        cause: constellation
            .exchange()
            .or_else(|| constellation.stray())
            .unwrap_or(Cause::Unknown),
        rms: (squares.iter().sum::<f64>() / count as f64).sqrt(),
    })
}

impl Constellation<'_> {
    fn fits(&self, seen: &[Option<Point3<f64>>], squares: &[f64]) -> bool {
        let count = seen.iter().flatten().count();
        let sum: f64 = squares.iter().zip(&self.variance).map(|(s, v)| s / v).sum();
        sum <= ONE_AXIS * limit(count)
    }

    fn shows_its_back(&self, pose: &Pose) -> bool {
        self.faces.is_some_and(|to| {
            let toward = to.coords - pose.translation.vector;
            (pose.rotation * Vector3::z()).dot(&toward) < BACK * toward.norm()
        })
    }

    /// The pose from other points, if they fit and the board then shows its face.
    fn as_well(&self, seen: &[Option<Point3<f64>>]) -> Option<Pose> {
        let (pose, squares) = solved(&self.body.template, seen)?;
        (self.fits(seen, &squares) && !self.shows_its_back(&pose)).then_some(pose)
    }

    /// Two labels whose exchange explains everything. If several pairs do, the board is symmetric and the pair is
    /// ambiguous; that does not matter if the plane is the same for all.
    fn exchange(&self) -> Option<Cause> {
        let mut found: Vec<([String; 2], Pose)> = Vec::new();
        for a in 0..self.seen.len() {
            for b in a + 1..self.seen.len() {
                let mut seen = self.seen.clone();
                seen.swap(a, b);
                let name = |m: usize| self.body.markers[m].name.clone();
                found.extend(self.as_well(&seen).map(|pose| ([name(a), name(b)], pose)));
            }
        }
        let (_, first) = found.first()?;
        let pose = *first;
        let normal = |p: &Pose| p.rotation * Vector3::z();
        let same = |p: &Pose| normal(p).cross(&normal(&pose)).norm() < SAME_NORMAL;
        let all_alike = found.iter().all(|(_, p)| same(p));
        all_alike.then(|| Cause::Exchange(found.into_iter().map(|(names, _)| names).collect(), pose))
    }

    /// One label without which the others fit; of three markers, two always would.
    fn stray(&self) -> Option<Cause> {
        if self.seen.iter().flatten().count() < 4 {
            return None;
        }
        let without = |m: usize| {
            let place = self.seen[m]?;
            let mut seen = self.seen.clone();
            seen[m] = None;
            let pose = self.as_well(&seen)?;
            Some((m, (place - pose * self.body.template[m]).norm()))
        };
        let found: Vec<(usize, f64)> = (0..self.seen.len()).filter_map(without).collect();
        match found[..] {
            [(marker, off)] => Some(Cause::Stray(self.body.markers[marker].name.clone(), off)),
            _ => None,
        }
    }
}
