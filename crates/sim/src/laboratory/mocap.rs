//! Motion capture: labeled markers, their errors, and poses solved from them.

use crate::noise::{Draws, Purpose};
use crate::scene::{Mocap, MocapProfile};
use catoptric_model::dataset::RIG_SUBJECT;
use catoptric_model::tracking::solve_pose;
use catoptric_model::{Pose, Track, TrackedFrame};
use nalgebra::{Point3, Vector3};
use std::ops::Range;

/// Errors of a marker, 1σ along the room's x, y and z, in meters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MarkerErrors {
    /// Constant while the body does not move.
    pub constant: Vector3<f64>,
    /// Drawn anew in every frame.
    pub jitter: Vector3<f64>,
}

impl Mocap {
    /// Errors of a marker.
    pub fn errors(&self) -> MarkerErrors {
        let mm = |x: f64, y: f64, z: f64| Vector3::new(x, y, z) * 1e-3;
        let exact = MarkerErrors {
            constant: Vector3::zeros(),
            jitter: Vector3::zeros(),
        };
        match self.profile {
            // Merriaux et al., Sensors 17(7) 1591 (2017): 0.15 mm mean error, variability below 0.025 mm.
            MocapProfile::Modern => MarkerErrors {
                constant: mm(0.15, 0.15, 0.15),
                jitter: mm(0.025, 0.025, 0.025),
            },
            MocapProfile::Cooper => MarkerErrors {
                constant: mm(3.4, 1.6, 6.0),
                jitter: mm(0.025, 0.025, 0.025),
            },
            MocapProfile::Ideal => exact,
            MocapProfile::Custom => self.marker.map_or(exact, |own| MarkerErrors {
                constant: Vector3::repeat(own.constant_sd_mm * 1e-3),
                jitter: Vector3::repeat(own.jitter_sd_mm * 1e-3),
            }),
        }
    }
}

/// A body to be tracked.
pub struct Body<'a> {
    /// Name.
    pub subject: &'a str,
    /// Its index among the scene's bodies, the rig first; keys its draws.
    pub index: usize,
    /// Its markers in its own frame, in meters.
    pub template: &'a [Point3<f64>],
    /// Its true pose at a time in seconds since its first frame.
    pub room_from_body: &'a (dyn Fn(f64) -> Pose + Sync),
    /// Number of the placement: a body at rest keeps its constant errors, and so does one in flight.
    pub placement: usize,
}

/// Maximum number of markers of one body.
pub const MAX_MARKERS: usize = 64;

/// Tracks a body for some of its frames. Frame 0 is at `start_s` and has number `first_frame` in the whole recording.
pub fn track(
    mocap: &Mocap,
    seed: u64,
    body: &Body<'_>,
    start_s: f64,
    first_frame: u64,
    frames: Range<u64>,
) -> Track {
    let errors = if mocap.rig_exact && body.subject == RIG_SUBJECT {
        MarkerErrors {
            constant: Vector3::zeros(),
            jitter: Vector3::zeros(),
        }
    } else {
        mocap.errors()
    };
    let column = |marker: usize| (body.index * MAX_MARKERS + marker) as u64;
    let mut constant = Draws::new(seed, Purpose::MarkerConstant, body.placement as u64);
    let offsets: Vec<Vector3<f64>> = (0..body.template.len())
        .map(|marker| {
            constant.seek(column(marker));
            constant.normal3().component_mul(&errors.constant)
        })
        .collect();
    let frames = frames
        .map(|frame| {
            let mut jitter = Draws::new(seed, Purpose::MarkerJitter, first_frame + frame);
            let elapsed_s = frame as f64 / mocap.frame_rate_hz;
            let room_from_body = (body.room_from_body)(elapsed_s);
            let markers: Vec<Option<Point3<f64>>> = body
                .template
                .iter()
                .zip(&offsets)
                .enumerate()
                .map(|(marker, (place, offset))| {
                    jitter.seek(column(marker));
                    let seen = jitter.uniform() >= mocap.dropout;
                    let place = room_from_body * place + offset;
                    seen.then(|| place + jitter.normal3().component_mul(&errors.jitter))
                })
                .collect();
            TrackedFrame {
                time_s: start_s + elapsed_s,
                pose: solve_pose(body.template, &markers),
                markers,
            }
        })
        .collect();
    Track {
        subject: body.subject.to_owned(),
        frames,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn template() -> Vec<Point3<f64>> {
        vec![
            Point3::new(0.3, 0.0, 0.0),
            Point3::new(-0.2, 0.25, 0.0),
            Point3::new(-0.1, -0.3, 0.0),
            Point3::new(0.05, 0.1, 0.0),
        ]
    }

    #[test]
    fn a_body_at_rest_keeps_its_constant_error() {
        let mocap = Mocap {
            dropout: 0.0,
            ..Mocap::default()
        };
        let template = template();
        let body = |placement| Body {
            subject: "rig",
            index: 0,
            template: &template,
            room_from_body: &|_| Pose::identity(),
            placement,
        };
        let first_marker = |placement, frame| {
            let track = track(&mocap, 1, &body(placement), 0.0, frame, 0..1);
            track.frames[0].markers[0].expect("nothing drops out")
        };
        assert!((first_marker(0, 0) - first_marker(0, 1)).norm() < 3e-4 * 0.5);
        assert_ne!(first_marker(0, 0), first_marker(0, 1));
        assert!((first_marker(0, 0) - first_marker(1, 0)).norm() > 3e-5);
    }
}
