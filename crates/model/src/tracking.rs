//! Motion-capture data of a body: its track frame by frame, the pose solved from its markers, and the check that they
//! stayed in place.

use crate::frame::Pose;
use nalgebra::{Matrix3, Point3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};

/// Maximum number of parts of a stretch over which markers are averaged.
const MOST_PARTS: usize = 8;

/// Minimum number of frames in a part.
const LEAST_FRAMES: usize = 2;

/// Median of χ² with three degrees of freedom.
const MEDIAN_SQUARE: f64 = 2.365_973_884_375_338;

/// One motion-capture frame of one body, in the room frame.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackedFrame {
    /// Time since the recording began, in seconds.
    pub time_s: f64,
    /// `room_from_body` as solved from the markers; `None` if too few were seen.
    pub pose: Option<Pose>,
    /// The markers in the order of the body's template, in meters; `None` for one that was not seen.
    pub markers: Vec<Option<Point3<f64>>>,
}

/// The motion-capture recording of one body.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// Name of the body: the rig's or a board's.
    pub subject: String,
    /// Its frames, in order of time.
    pub frames: Vec<TrackedFrame>,
}

/// A marker averaged over several frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeanMarker {
    /// Its mean position in the room frame, in meters; the origin if it was never seen.
    pub place: Point3<f64>,
    /// Number of frames in which it was seen.
    pub count: usize,
}

/// The markers of one body over a stretch.
#[derive(Debug, Clone, PartialEq)]
pub struct Watched {
    /// Name of the body.
    pub subject: String,
    /// Equal parts of the stretch in order of time; in each, the markers in the order of the body's template.
    pub parts: Vec<Vec<MeanMarker>>,
    /// Jitter of a marker from frame to frame along one axis, 1σ, in meters; insensitive to a single displacement.
    pub jitter: f64,
}

impl Track {
    /// Mean of the solved poses; `None` if the body was never seen.
    ///
    /// Positions are averaged, as are quaternions after aligning their signs: exact to second order in the spread,
    /// which is far below a milliradian here.
    pub fn mean_pose(&self) -> Option<Pose> {
        let mut mean = MeanPose::default();
        self.frames
            .iter()
            .filter_map(|f| f.pose)
            .for_each(|pose| mean.add(&pose));
        mean.finish()
    }
}

/// The mean of poses that are added one at a time, as in [`Track::mean_pose`].
#[derive(Debug, Clone, Copy, Default)]
pub struct MeanPose {
    /// The first pose's rotation, and the sums.
    sums: Option<(UnitQuaternion<f64>, Vector3<f64>, Quaternion<f64>)>,
    count: f64,
}

impl MeanPose {
    /// Adds a pose.
    pub fn add(&mut self, pose: &Pose) {
        self.count += 1.0;
        let q = pose.rotation.into_inner();
        match &mut self.sums {
            None => self.sums = Some((pose.rotation, pose.translation.vector, q)),
            Some((first, translation, rotation)) => {
                *translation += pose.translation.vector;
                *rotation += if q.dot(first) < 0.0 { -q } else { q };
            }
        }
    }

    /// The mean; `None` if there was no pose.
    pub fn finish(self) -> Option<Pose> {
        let (_, translation, rotation) = self.sums?;
        Some(Pose::from_parts(
            Translation3::from(translation / self.count),
            UnitQuaternion::new_normalize(rotation / self.count),
        ))
    }
}

/// The least-squares pose that maps a template to the observed points (Kabsch); `None` if the points are too few or
/// collinear.
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
    // Collinear points leave the rotation about their line undetermined.
    if svd.singular_values[1] <= 1e-9 * svd.singular_values[0] {
        return None;
    }
    // A rotation, not the reflection that may fit a plane template equally well.
    let sign = (u.determinant() * v_t.determinant()).signum();
    let rotation = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t;
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    Some(Pose::from_parts(
        Translation3::from(to - rotation * from),
        rotation,
    ))
}

impl Watched {
    /// A body over the frames of its track; `None` if no marker was recorded.
    pub fn of(track: &Track) -> Option<Self> {
        let markers = track.frames.iter().map(|f| f.markers.len()).max()?;
        if markers == 0 {
            return None;
        }
        let (mut watching, mut jumping) = (Watching::new(track.frames.len(), markers), Jumping::default());
        let mut jumps = Vec::new();
        for frame in &track.frames {
            watching.add(&frame.markers);
            jumping.add(&frame.markers, |square| jumps.push(square));
        }
        Some(watching.finish(track.subject.clone(), median_jump(&mut jumps)))
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

/// The markers of a body, averaged frame by frame over parts of a stretch.
#[derive(Debug, Clone)]
pub struct Watching {
    /// Number of frames in the stretch, and number added so far.
    frames: usize,
    passed: usize,
    /// For every part and marker: the sum of its positions, and the number of frames in which it was seen.
    parts: Vec<Vec<(Vector3<f64>, usize)>>,
}

/// The displacements of the markers from one frame to the next.
#[derive(Debug, Clone, Default)]
pub struct Jumping {
    before: Vec<Option<Point3<f64>>>,
}

/// The median of squared jumps; `None` without any.
pub fn median_jump(squares: &mut [f64]) -> Option<f64> {
    let middle = squares.len() / 2;
    (!squares.is_empty()).then(|| *squares.select_nth_unstable_by(middle, f64::total_cmp).1)
}

impl Jumping {
    /// Adds the markers of a frame; `jump` receives each squared displacement since the frame before, in m².
    pub fn add(&mut self, markers: &[Option<Point3<f64>>], mut jump: impl FnMut(f64)) {
        for (from, to) in self.before.iter().zip(markers) {
            if let (Some(from), Some(to)) = (from, to) {
                jump((to - from).norm_squared());
            }
        }
        self.before.clear();
        self.before.extend_from_slice(markers);
    }
}

impl Watching {
    /// Begins a stretch with a given number of frames and markers.
    pub fn new(frames: usize, markers: usize) -> Self {
        let parts = (frames / LEAST_FRAMES).clamp(1, MOST_PARTS);
        Self {
            frames,
            passed: 0,
            parts: vec![vec![(Vector3::zeros(), 0); markers]; parts],
        }
    }

    /// Adds the markers of a frame.
    pub fn add(&mut self, markers: &[Option<Point3<f64>>]) {
        let parts = self.parts.len();
        let ends = |part: usize| (part + 1) * self.frames / parts;
        let part = (0..parts).find(|part| self.passed < ends(*part));
        self.passed += 1;
        for ((sum, count), place) in self.parts[part.unwrap_or(parts - 1)].iter_mut().zip(markers) {
            if let Some(place) = place {
                *sum += place.coords;
                *count += 1;
            }
        }
    }

    /// Returns the averages. Jumps between successive frames have twice the variance of a frame, and the median of
    /// their squares, `None` without any, is insensitive to a few large ones.
    pub fn finish(self, subject: String, median_jump: Option<f64>) -> Watched {
        let mean = |(sum, count): (Vector3<f64>, usize)| MeanMarker {
            place: Point3::from(sum / count.max(1) as f64),
            count,
        };
        let parts = self.parts.into_iter();
        Watched {
            subject,
            parts: parts.map(|p| p.into_iter().map(mean).collect()).collect(),
            jitter: median_jump.map_or(0.0, |square| (0.5 * square / MEDIAN_SQUARE).sqrt()),
        }
    }
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
    fn too_few_or_collinear_markers_give_no_pose() {
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
