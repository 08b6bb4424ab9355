//! Motion capture during a stretch: messages assembled into frames, in order of time.

use super::bodies::Bodies;
use super::messages::{LabeledMarker, NS_PER_S};
use catoptric_model::TrackedFrame;
use catoptric_model::frame::Pose;
use catoptric_model::limits::FAR_M;
use nalgebra::Point3;
use std::collections::BTreeMap;

/// Maximum number of motion-capture messages waiting to form frames; stretches with fewer may have them in any order.
///
/// Tests use lower limits.
pub(super) const MOST_WAITING: usize = 1 << if cfg!(test) { 10 } else { 15 };

/// Messages received so far, by time in nanoseconds, and the frames they form.
#[derive(Default)]
pub(super) struct Capture {
    poses: BTreeMap<(u64, usize), Pose>,
    /// Body, index in its template, and position in the room of every marker that was seen.
    markers: BTreeMap<u64, Vec<(usize, usize, Point3<f64>)>>,
    /// All frames before this time have been taken out.
    begin: u64,
    /// By body: the number of its frames in which the tracker reported no pose.
    pub(super) lost: BTreeMap<usize, usize>,
    /// By body: the number of its frames in which it was beyond the largest coordinate.
    pub(super) far: BTreeMap<usize, usize>,
}

/// Whether a coordinate is one that a laboratory has; false for NaN.
fn is_near(coordinate: &f64) -> bool {
    coordinate.abs() <= FAR_M
}

impl Capture {
    /// Adds the pose of a body in a frame; `None` if the tracker had lost it.
    pub(super) fn pose(&mut self, time: u64, body: usize, pose: Option<Pose>) -> Result<(), String> {
        self.check(time)?;
        match pose {
            Some(pose) if !pose.translation.vector.iter().all(is_near) => {
                *self.far.entry(body).or_default() += 1;
            }
            Some(pose) => {
                self.poses.insert((time, body), pose);
            }
            None => *self.lost.entry(body).or_default() += 1,
        }
        Ok(())
    }

    /// Adds the markers of a frame. Those of unknown bodies are ignored, and so are those that the tracker had lost:
    /// their coordinates are zero, not finite or farther away than anything is.
    pub(super) fn markers(
        &mut self,
        time: u64,
        markers: &[LabeledMarker],
        bodies: &Bodies,
    ) -> Result<(), String> {
        self.check(time)?;
        let known = markers.iter().filter_map(|marker| {
            let (body, place) = bodies.find(&marker.name)?;
            let point = &marker.point;
            let seen = point.iter().all(is_near) && *point != Point3::origin();
            seen.then_some((body, place, marker.point))
        });
        self.markers.entry(time).or_default().extend(known);
        Ok(())
    }

    fn check(&self, time: u64) -> Result<(), String> {
        if time >= self.begin {
            return Ok(());
        }
        let late = seconds_between(time, self.begin);
        Err(format!("a frame of motion capture comes {late} s late"))
    }

    /// Number of messages waiting to form frames.
    pub(super) fn waiting(&self) -> usize {
        self.poses.len() + self.markers.len()
    }

    /// The bodies seen in waiting messages.
    pub(super) fn seen(&self) -> impl Iterator<Item = usize> + '_ {
        let solved = self.poses.keys().map(|(_, body)| *body);
        solved.chain(self.markers.values().flatten().map(|(body, _, _)| *body))
    }

    /// Takes out the frames of the given bodies in order of time until the given number of messages is left; times
    /// count from the epoch.
    ///
    /// A body has a frame whenever any markers were recorded, even if none of its own was seen, and whenever it was
    /// solved.
    pub(super) fn take(
        &mut self,
        left: usize,
        bodies: &Bodies,
        of: &[usize],
        epoch: u64,
        mut each: impl FnMut(usize, TrackedFrame),
    ) {
        while self.waiting() > left {
            let times = [
                self.poses.keys().next().map(|(time, _)| *time),
                self.markers.keys().next().copied(),
            ];
            let Some(time) = times.into_iter().flatten().min() else {
                return;
            };
            self.begin = time + 1;
            let markers = self.markers.remove(&time);
            for body in 0..bodies.all.len() {
                let pose = self.poses.remove(&(time, body));
                if !of.contains(&body) || pose.is_none() && markers.is_none() {
                    continue;
                }
                let mut seen = Vec::new();
                if let Some(markers) = &markers {
                    seen = vec![None; bodies.all[body].labels.len()];
                    for (_, place, point) in markers.iter().filter(|(of, _, _)| *of == body) {
                        seen[*place] = Some(*point);
                    }
                }
                let time_s = seconds_between(epoch, time);
                each(
                    body,
                    TrackedFrame {
                        time_s,
                        pose,
                        markers: seen,
                    },
                );
            }
        }
    }
}

/// Seconds between two times in nanoseconds.
pub(super) fn seconds_between(from: u64, to: u64) -> f64 {
    let ns = i128::from(to) - i128::from(from);
    ns as f64 / NS_PER_S as f64
}
