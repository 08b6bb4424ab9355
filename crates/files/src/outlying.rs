//! Frames in which motion capture put a body at rest somewhere else for a moment: flipped, exchanged with another body, a
//! ghost.
//!
//! A frame is outlying if it is further from the median pose of its stretch than [`MOST_DISTANCES`] times the distance within
//! which a quarter of the frames are, and further than any noise of tracking ([`FLOOR`]). Outlying frames are not used. A body that stays elsewhere to the end, or
//! comes from there, was moved, which its markers show; without markers its stretch cannot be used, nor can one in which too few
//! frames agree.

use catoptric_model::{Pose, TrackedFrame};
use nalgebra::Vector3;

/// Distances from the median pose, in those within which a quarter of the frames are, beyond which a frame is outlying: of
/// Gaussian noise, 16 standard deviations.
const MOST_DISTANCES: f64 = 15.0;

/// The same in meters and radians, for what is hardly noisy: 10 mm and 2°.
const FLOOR: [f64; 2] = [0.01, 2.0 * std::f64::consts::PI / 180.0];

/// Frames of a row at the beginning or the end of a stretch that can be outlying though the body rests.
const MOMENT: usize = 3;

/// Share of the frames that may be outlying; of two places that are as frequent nobody knows which one is right.
const MOST_ELSEWHERE: f64 = 0.4;

/// Poses of a stretch from which the median is taken.
const MOST_SAMPLES: usize = 256;

/// A few poses of a body over a stretch, evenly spaced, and how far its poses are from the first one.
#[derive(Debug, Clone)]
pub(super) struct Sample {
    poses: Vec<Pose>,
    frames: usize,
    stride: usize,
    spread: [f64; 2],
}

/// The median pose of a body, and the distances in meters and radians beyond which frames are outlying.
#[derive(Debug, Clone, Copy)]
pub(super) struct Center {
    pose: Pose,
    limits: [f64; 2],
}

/// The frames of a body over a stretch, counted.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Outlying {
    pub(super) frames: usize,
    pub(super) count: usize,
    has_markers: bool,
    /// Length of the outlying row in progress, and of the one at the beginning.
    row: usize,
    first_row: usize,
}

/// What outlying frames mean.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Found {
    /// They are not used.
    Moments,
    /// The body was moved, as its markers show.
    Moved,
    /// Nobody knows where the body was; why.
    Unknown(&'static str),
}

impl Default for Sample {
    fn default() -> Self {
        Self {
            poses: Vec::new(),
            frames: 0,
            stride: 1,
            spread: [0.0; 2],
        }
    }
}

/// Distance between two poses, in meters and radians.
fn apart(a: &Pose, b: &Pose) -> [f64; 2] {
    let shift = (a.translation.vector - b.translation.vector).norm();
    [shift, a.rotation.angle_to(&b.rotation)]
}

fn median(values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    ranked(values, middle)
}

/// The value that has a given number of others below it.
fn ranked(mut values: Vec<f64>, rank: usize) -> f64 {
    *values.select_nth_unstable_by(rank, f64::total_cmp).1
}

impl Sample {
    /// Adds the pose of a frame.
    pub(super) fn add(&mut self, pose: &Pose) {
        if let Some(first) = self.poses.first() {
            let [shift, turn] = apart(pose, first);
            self.spread = [self.spread[0].max(shift), self.spread[1].max(turn)];
        }
        if self.poses.len() == MOST_SAMPLES {
            let mut number = 0;
            self.poses.retain(|_| {
                number += 1;
                number % 2 == 1
            });
            self.stride *= 2;
        }
        if self.frames.is_multiple_of(self.stride) {
            self.poses.push(*pose);
        }
        self.frames += 1;
    }

    /// The median pose, if any frame can be outlying.
    pub(super) fn center(&self) -> Option<Center> {
        // All frames are closer to each other than a limit can be.
        if (0..2).all(|i| 2.0 * self.spread[i] <= FLOOR[i]) {
            return None;
        }
        let along = |axis: usize| median(self.poses.iter().map(|p| p.translation.vector[axis]).collect());
        let place = Vector3::new(along(0), along(1), along(2));
        // The rotation whose median distance from the others is smallest.
        let turns = |from: &Pose| {
            median(
                self.poses
                    .iter()
                    .map(|p| p.rotation.angle_to(&from.rotation))
                    .collect(),
            )
        };
        let central = self.poses.iter().min_by(|a, b| turns(a).total_cmp(&turns(b)))?;
        let pose = Pose::from_parts(place.into(), central.rotation);
        let distances: Vec<[f64; 2]> = self.poses.iter().map(|p| apart(p, &pose)).collect();
        // Were it the median, half of the frames could be anywhere.
        let quarter = |i: usize| ranked(distances.iter().map(|d| d[i]).collect(), distances.len() / 4);
        let limit = |i: usize| (MOST_DISTANCES * quarter(i)).max(FLOOR[i]);
        let limits = [limit(0), limit(1)];
        Some(Center { pose, limits })
    }
}

impl Center {
    /// Whether a pose is outlying.
    pub(super) fn is_far(&self, pose: &Pose) -> bool {
        let distance = apart(pose, &self.pose);
        (0..2).any(|i| distance[i] > self.limits[i])
    }
}

impl Outlying {
    /// Counts a frame, in order of time.
    pub(super) fn add(&mut self, frame: &TrackedFrame, center: &Center) {
        let Some(pose) = &frame.pose else {
            return;
        };
        self.has_markers |= frame.markers.iter().flatten().count() > 2;
        self.frames += 1;
        if center.is_far(pose) {
            self.count += 1;
            self.row += 1;
            if self.row == self.frames {
                self.first_row = self.row;
            }
        } else {
            self.row = 0;
        }
    }

    /// What the frames mean.
    pub(super) fn found(&self) -> Found {
        let stays = self.row.max(self.first_row);
        let was_moved = stays > MOMENT && 2 * stays >= self.count;
        match (was_moved, self.has_markers) {
            (true, true) => Found::Moved,
            (true, false) => Found::Unknown("it was moved, or taken for another body, while it was scanned"),
            (false, _) if self.count as f64 > MOST_ELSEWHERE * self.frames as f64 => {
                Found::Unknown("too few of its frames agree on where it is")
            }
            (false, _) => Found::Moments,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(poses: &[Pose], markers: usize) -> (usize, Found) {
        let mut sample = Sample::default();
        poses.iter().for_each(|pose| sample.add(pose));
        let center = sample.center().expect("some are far");
        let mut outlying = Outlying::default();
        for pose in poses {
            let frame = TrackedFrame {
                time_s: 0.0,
                pose: Some(*pose),
                markers: vec![Some(nalgebra::Point3::new(1.0, 0.0, 0.0)); markers],
            };
            outlying.add(&frame, &center);
        }
        (outlying.count, outlying.found())
    }

    /// A body at rest with a tenth of a millimeter of noise.
    fn resting(frames: u32) -> Vec<Pose> {
        let noise = |k: u32| 1e-4 * f64::from(k * 37 % 11) / 11.0;
        (0..frames)
            .map(|k| Pose::translation(1.0 + noise(k), 2.0, 0.0))
            .collect()
    }

    #[test]
    fn what_rests_has_no_outlying_frames() {
        for frames in [1, 2, 1000] {
            let mut sample = Sample::default();
            resting(frames).iter().for_each(|pose| sample.add(pose));
            assert!(sample.center().is_none());
            assert!(sample.poses.len() <= MOST_SAMPLES);
        }
        assert!(Sample::default().center().is_none());
    }

    #[test]
    fn flips_and_jumps_are_found_wherever_they_are() {
        let flip = Pose::rotation(Vector3::z() * std::f64::consts::PI);
        for frames in [30, 3000] {
            for (first, step) in [(0, 10), (5, 7), (1, 3)] {
                let mut poses = resting(frames);
                let mut spoiled = 0;
                for pose in poses.iter_mut().skip(first).step_by(step) {
                    spoiled += 1;
                    *pose = match spoiled % 3 {
                        0 => Pose::translation(0.02, 0.0, 0.0) * *pose,
                        1 => *pose * flip,
                        _ => Pose::translation(1e4, 0.0, 0.0) * *pose,
                    };
                }
                assert_eq!(found(&poses, 0), (spoiled, Found::Moments));
            }
        }
    }

    #[test]
    fn what_stays_elsewhere_was_moved() {
        let mut poses = resting(100);
        poses[60..]
            .iter_mut()
            .for_each(|p| p.translation.vector.y += 0.05);
        assert_eq!(found(&poses, 4), (40, Found::Moved));
        assert!(matches!(found(&poses, 0), (40, Found::Unknown(_))));
        poses.reverse();
        assert!(matches!(found(&poses, 0), (40, Found::Unknown(_))));
        let mut two = resting(100);
        two.iter_mut()
            .step_by(2)
            .for_each(|p| p.translation.vector.z += 0.5);
        let (count, two) = found(&two, 4);
        assert!(count == 50 && matches!(two, Found::Unknown(_)));
    }
}
