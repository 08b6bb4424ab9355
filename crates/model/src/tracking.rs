//! What motion capture says of a body: its track frame by frame, the pose that its markers solve to, and whether they
//! stayed where they were.

use crate::frame::Pose;
use nalgebra::{Matrix3, Point3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};

/// Parts of a stretch in which markers are averaged, at most.
const MOST_PARTS: usize = 8;

/// Frames of a part, at least.
const LEAST_FRAMES: usize = 2;

/// Median of χ² with three degrees of freedom.
const MEDIAN_SQUARE: f64 = 2.365_973_884_375_338;

/// One motion-capture frame of one body, in the room frame.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackedFrame {
    /// Time since the recording began, in seconds.
    pub time_s: f64,
    /// `room_from_body` as solved from the markers; `None` where too few were seen.
    pub pose: Option<Pose>,
    /// The markers in the order of the body's template, in metres; `None` where one was not seen.
    pub markers: Vec<Option<Point3<f64>>>,
}

/// What motion capture recorded of one body.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// Name of the body: the rig's or a board's.
    pub subject: String,
    /// Its frames, in order of time.
    pub frames: Vec<TrackedFrame>,
}

/// A marker averaged over some frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeanMarker {
    /// Its mean place in the room frame, in metres; the origin if it was never seen.
    pub place: Point3<f64>,
    /// Frames in which it was seen.
    pub count: usize,
}

/// The markers of one body over a stretch.
#[derive(Debug, Clone, PartialEq)]
pub struct Watched {
    /// Name of the body.
    pub subject: String,
    /// Equal parts of the stretch in order of time, and in each the markers in the order of the body's template.
    pub parts: Vec<Vec<MeanMarker>>,
    /// How far a marker jumps about from frame to frame along one axis, 1σ, in metres; one movement does not count.
    pub jitter: f64,
}

impl Track {
    /// Mean of the solved poses; `None` if the body was never seen.
    ///
    /// Positions are averaged, and quaternions after bringing them to one sign: exact to second order in the spread,
    /// which is far below a milliradian here.
    pub fn mean_pose(&self) -> Option<Pose> {
        let mut poses = self.frames.iter().filter_map(|f| f.pose);
        let first = poses.next()?;
        let (mut translation, mut rotation) = (first.translation.vector, first.rotation.into_inner());
        let mut count = 1.0;
        for pose in poses {
            translation += pose.translation.vector;
            let q = pose.rotation.into_inner();
            rotation += if q.dot(&first.rotation) < 0.0 { -q } else { q };
            count += 1.0;
        }
        let rotation: Quaternion<f64> = rotation / count;
        Some(Pose::from_parts(
            Translation3::from(Vector3::from(translation / count)),
            UnitQuaternion::new_normalize(rotation),
        ))
    }
}

/// The pose that takes a template to the points seen, in the sense of least squares (Kabsch); `None` for points seen
/// too few or on a line.
pub fn solve_pose(template: &[Point3<f64>], seen: &[Option<Point3<f64>>]) -> Option<Pose> {
    let pairs: Vec<_> = template
        .iter()
        .zip(seen)
        .filter_map(|(t, s)| Some((t, (*s)?)))
        .collect();
    if pairs.len() < 3 {
        return None;
    }
    let n = pairs.len() as f64;
    let from = pairs.iter().map(|(t, _)| t.coords).sum::<Vector3<f64>>() / n;
    let to = pairs.iter().map(|(_, s)| s.coords).sum::<Vector3<f64>>() / n;
    let covariance: Matrix3<f64> = pairs
        .iter()
        .map(|(t, s)| (s.coords - to) * (t.coords - from).transpose())
        .sum();
    let svd = covariance.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    // Points on a line leave the turn about it open.
    if svd.singular_values[1] <= 1e-9 * svd.singular_values[0] {
        return None;
    }
    // The rotation, not the reflection that may fit a plane template as well.
    let sign = (u.determinant() * v_t.determinant()).signum();
    let rotation = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t;
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    Some(Pose::from_parts(
        Translation3::from(to - rotation * from),
        rotation,
    ))
}

impl Watched {
    /// A body over the frames of its track; `None` where no marker was recorded.
    pub fn of(track: &Track) -> Option<Self> {
        let markers = track.frames.iter().map(|f| f.markers.len()).max()?;
        if markers == 0 {
            return None;
        }
        let frames = track.frames.len();
        let parts = (frames / LEAST_FRAMES).clamp(1, MOST_PARTS);
        let part = |k: usize| {
            let frames = &track.frames[k * frames / parts..(k + 1) * frames / parts];
            let mean = |marker: usize| {
                let seen = frames.iter().filter_map(|f| *f.markers.get(marker)?);
                let start = (Vector3::zeros(), 0_usize);
                let (sum, count) = seen.fold(start, |(sum, n), p| (sum + p.coords, n + 1));
                MeanMarker {
                    place: Point3::from(sum / count.max(1) as f64),
                    count,
                }
            };
            (0..markers).map(mean).collect()
        };
        Some(Self {
            subject: track.subject.clone(),
            parts: (0..parts).map(part).collect(),
            jitter: jitter(track, markers),
        })
    }

    /// The markers averaged over the parts `first` to `last − 1`.
    pub fn mean(&self, first: usize, last: usize) -> Vec<MeanMarker> {
        let parts = &self.parts[first..last];
        let markers = self.parts.first().map_or(0, Vec::len);
        let mean = |marker: usize| {
            let of = parts.iter().map(|p| p[marker]);
            let count: usize = of.clone().map(|m| m.count).sum();
            let sum: Vector3<f64> = of.map(|m| m.place.coords * m.count as f64).sum();
            MeanMarker {
                place: Point3::from(sum / count.max(1) as f64),
                count,
            }
        };
        (0..markers).map(mean).collect()
    }

    /// The markers averaged over the whole stretch.
    pub fn whole(&self) -> Vec<MeanMarker> {
        self.mean(0, self.parts.len())
    }
}

/// Jumps between successive frames have twice the variance of a frame; their median does not see a few large ones.
fn jitter(track: &Track, markers: usize) -> f64 {
    let pairs = track.frames.iter().zip(track.frames.iter().skip(1));
    let mut squares: Vec<f64> = pairs
        .flat_map(|(a, b)| {
            (0..markers).filter_map(move |m| {
                let (from, to) = ((*a.markers.get(m)?)?, (*b.markers.get(m)?)?);
                Some((to - from).norm_squared())
            })
        })
        .collect();
    if squares.is_empty() {
        return 0.0;
    }
    let middle = squares.len() / 2;
    let (_, median, _) = squares.select_nth_unstable_by(middle, f64::total_cmp);
    (0.5 * *median / MEDIAN_SQUARE).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::yaw_pitch_roll;

    fn template() -> Vec<Point3<f64>> {
        vec![
            Point3::new(0.3, 0.0, 0.0),
            Point3::new(-0.2, 0.25, 0.0),
            Point3::new(-0.1, -0.3, 0.0),
            Point3::new(0.05, 0.1, 0.0),
        ]
    }

    #[test]
    fn exact_markers_give_the_exact_pose() {
        let truth = Pose::from_parts(Translation3::new(1.0, -2.0, 0.5), yaw_pitch_roll(2.0, -0.7, 3.0));
        let seen: Vec<_> = template().iter().map(|p| Some(truth * p)).collect();
        let found = solve_pose(&template(), &seen).expect("four markers are seen");
        for p in template() {
            assert!((found * p - truth * p).norm() < 1e-14);
        }
    }

    #[test]
    fn too_few_or_collinear_markers_give_none() {
        let two = [
            Some(Point3::origin()),
            None,
            None,
            Some(Point3::new(1.0, 0.0, 0.0)),
        ];
        assert!(solve_pose(&template(), &two).is_none());
        let line: Vec<_> = (0..4).map(|i| Point3::new(f64::from(i), 0.0, 0.0)).collect();
        let seen: Vec<_> = line.iter().copied().map(Some).collect();
        assert!(solve_pose(&line, &seen).is_none());
    }
}
