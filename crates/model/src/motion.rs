//! The trajectory of the rig during a flight: motion-capture frames, and interpolation between them.

use crate::frame::{self, Pose};
use nalgebra::Translation3;

/// Longest time from the nearest frame at which a pose is interpolated or extrapolated, in seconds: farther from it, the
/// pose would be a guess.
pub const LONGEST_GAP_S: f64 = 0.5;

/// The rig as tracked during a stretch of scans in which it moved.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// Time at which the first scan began, in seconds since the recording began.
    pub start_s: f64,
    /// Time from the start of one scan to the start of the next, in seconds.
    pub scan_period_s: f64,
    /// Time at which each scan began, in seconds since the recording began; empty if they are evenly spaced.
    pub scan_starts_s: Vec<f64>,
    /// Times of the frames in which the rig was solved, in seconds since the recording began, ascending, with
    /// `room_from_rig` in each.
    pub frames: Vec<(f64, Pose)>,
}

impl Motion {
    /// Time at which a beam of a scan is read, in seconds since the recording began: the scan's start, or start + k·T if
    /// scans are evenly spaced, + i·beam time.
    ///
    /// ```
    /// use catoptric_model::Motion;
    /// let motion = Motion { start_s: 2.0, scan_period_s: 0.025, scan_starts_s: Vec::new(), frames: Vec::new() };
    /// assert!((motion.time_s(4, 72, 0.025 / 1440.0) - 2.10125).abs() < 1e-15 * 4.0);
    /// ```
    pub fn time_s(&self, scan: usize, beam: usize, beam_time_s: f64) -> f64 {
        match self.scan_starts_s.get(scan) {
            Some(start) => start + beam as f64 * beam_time_s,
            None => self.start_s + (scan as f64 * self.scan_period_s + beam as f64 * beam_time_s),
        }
    }

    /// Time from a given time to the nearest frame, in seconds; infinite without any.
    pub fn gap_s(&self, time_s: f64) -> f64 {
        let after = self.frames.partition_point(|(t, _)| *t <= time_s);
        let near = self.frames[after.saturating_sub(1)..self.frames.len().min(after + 1)].iter();
        near.fold(f64::INFINITY, |gap, (t, _)| gap.min((time_s - t).abs()))
    }

    /// `room_from_rig` at a given time; `None` if the rig was never solved, or not within [`LONGEST_GAP_S`].
    ///
    /// Between two frames the position is linear in time and the attitude turns at a constant rate along the shorter
    /// arc. Before the first frame and after the last, the motion between the two nearest frames is extrapolated: a
    /// scan ends up to one frame after the last frame of its stretch. A single frame holds for all times near it.
    pub fn room_from_rig(&self, time_s: f64) -> Option<Pose> {
        let (last, before) = self.frames.split_last()?;
        if self.gap_s(time_s) > LONGEST_GAP_S {
            return None;
        }
        if before.is_empty() {
            return Some(last.1);
        }
        let after = self.frames.partition_point(|(t, _)| *t <= time_s);
        let after = after.clamp(1, self.frames.len() - 1);
        let [(t0, a), (t1, b)] = [self.frames[after - 1], self.frames[after]];
        if t1 <= t0 {
            return Some(a);
        }
        let share = (time_s - t0) / (t1 - t0);
        let step = b.translation.vector - a.translation.vector;
        Some(Pose::from_parts(
            Translation3::from(a.translation.vector + step * share),
            frame::slerp(&a.rotation, &b.rotation, share),
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::yaw_pitch_roll;
    use nalgebra::Point3;

    /// 2 m/s along x and 1.5 rad/s about z, which the interpolation reproduces exactly.
    fn truth(time_s: f64) -> Pose {
        Pose::from_parts(
            Translation3::new(2.0 * time_s - 1.0, 0.5, 1.8),
            yaw_pitch_roll(1.5 * time_s, 0.0, 0.0),
        )
    }

    fn motion(times: &[f64]) -> Motion {
        Motion {
            start_s: 0.0,
            scan_period_s: 0.025,
            scan_starts_s: Vec::new(),
            frames: times.iter().map(|t| (*t, truth(*t))).collect(),
        }
    }

    #[test]
    fn uniform_motion_is_exact_between_frames_and_beyond_them() {
        // A frame is missing at 0.02 s.
        let motion = motion(&[0.0, 0.01, 0.03, 0.04]);
        for time in [-0.005, 0.0, 0.003, 0.01, 0.0211, 0.04, 0.0437] {
            let (found, expected) = (motion.room_from_rig(time).expect("it was seen"), truth(time));
            for p in [Point3::origin(), Point3::new(1.0, -2.0, 3.0)] {
                assert!((found * p - expected * p).norm() < 1e-14, "{time}");
            }
        }
    }

    #[test]
    fn one_frame_holds_for_a_while_and_no_frame_gives_no_pose() {
        assert_eq!(motion(&[0.01]).room_from_rig(0.4), Some(truth(0.01)));
        assert_eq!(motion(&[0.01]).room_from_rig(7.0), None);
        assert_eq!(motion(&[]).room_from_rig(0.0), None);
    }
}
