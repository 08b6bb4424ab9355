//! The trajectory of the rig through waypoints: cubic in position, slerp or squad in attitude.
//!
//! Everything is computed relative to the first waypoint, so that a rig that stays there rests exactly.
//!
//! **Position.** On the interval from tᵢ to tᵢ₊₁ = tᵢ + h, with u = (t − tᵢ)/h and chord d = (pᵢ₊₁ − pᵢ)/h, Hermite's
//! cubic is p = pᵢ + h·u·(mᵢ + u·(3d − 2mᵢ − mᵢ₊₁ + u·(mᵢ + mᵢ₊₁ − 2d))). The velocity mᵢ at a waypoint is that of the
//! parabola through it and its two neighbors; at either end it is that of the adjacent parabola. The velocity is
//! continuous, and uniform acceleration is reproduced exactly.
//!
//! **Attitude.** Slerp turns at a constant rate from one waypoint to the next. Squad is Shoemake's spherical cubic,
//! slerp(slerp(qᵢ, qᵢ₊₁, u), slerp(aᵢ, bᵢ₊₁, u), 2u(1 − u)). With the mean rate ωᵢ at a waypoint, from the same
//! parabola, aᵢ = qᵢ·exp(½(hᵢωᵢ − log(qᵢ⁻¹qᵢ₊₁))) and bᵢ = qᵢ·exp(−½(hᵢ₋₁ωᵢ + log(qᵢ⁻¹qᵢ₋₁))). For equal intervals both
//! equal Shoemake's intermediate quaternion; for unequal ones the rate is still continuous. Both take the shorter arc.

use crate::scene::{Attitude, Flight, Waypoint};
use catoptric_model::Pose;
use catoptric_model::frame::{Arc, slerp, yaw_pitch_roll};
use nalgebra::{Translation3, UnitQuaternion, Vector3};

/// A trajectory through waypoints.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    room_from_first: Pose,
    /// Times of the waypoints since the first, in seconds.
    times: Vec<f64>,
    positions: Vec<Vector3<f64>>,
    velocities: Vec<Vector3<f64>>,
    /// Arc from each attitude to the next.
    chords: Vec<Arc>,
    /// Arc from squad's aᵢ to bᵢ₊₁ for every interval; empty for slerp.
    controls: Vec<Arc>,
}

impl Trajectory {
    /// The trajectory of a flight; `None` for fewer than two waypoints or times that do not increase.
    pub fn of(flight: &Flight) -> Option<Self> {
        let waypoints: Vec<(f64, Pose)> = flight.waypoint.iter().map(|w| (w.time_s, pose(w))).collect();
        Self::through(&waypoints, flight.attitude)
    }

    /// The trajectory through poses of the rig in the room at given times, in seconds; `None` as for
    /// [`Trajectory::of`].
    pub fn through(waypoints: &[(f64, Pose)], attitude: Attitude) -> Option<Self> {
        let (start_s, room_from_first) = *waypoints.first()?;
        let increasing = waypoints.windows(2).all(|w| w[0].0 < w[1].0);
        if waypoints.len() < 2 || !increasing {
            return None;
        }
        let times: Vec<f64> = waypoints.iter().map(|(t, _)| t - start_s).collect();
        let first = &room_from_first;
        let positions: Vec<Vector3<f64>> = waypoints
            .iter()
            .map(|(_, pose)| {
                let step = pose.translation.vector - first.translation.vector;
                first.rotation.inverse_transform_vector(&step)
            })
            .collect();
        let attitudes: Vec<UnitQuaternion<f64>> = waypoints
            .iter()
            .map(|(_, pose)| between(&first.rotation, &pose.rotation))
            .collect();
        let controls = match attitude {
            Attitude::Slerp => Vec::new(),
            Attitude::Squad => controls(&times, &attitudes),
        };
        Some(Self {
            room_from_first,
            velocities: velocities(&times, &positions),
            times,
            positions,
            chords: attitudes.windows(2).map(|q| Arc::new(&q[0], &q[1])).collect(),
            controls,
        })
    }

    /// Time from the first waypoint to the last, in seconds.
    pub fn duration_s(&self) -> f64 {
        self.times.last().copied().unwrap_or(0.0)
    }

    /// Pose of the rig in the room at the first waypoint.
    pub fn room_from_first(&self) -> Pose {
        self.room_from_first
    }

    /// Pose of the rig at a time after the first waypoint, relative to its pose there. It rests at the last waypoint.
    pub fn first_from_rig(&self, elapsed_s: f64) -> Pose {
        let elapsed = elapsed_s.clamp(0.0, self.duration_s());
        let after = self.times.partition_point(|t| *t <= elapsed);
        let i = after.clamp(1, self.times.len() - 1) - 1;
        let h = self.times[i + 1] - self.times[i];
        let u = (elapsed - self.times[i]) / h;
        Pose::from_parts(Translation3::from(self.position(i, h, u)), self.attitude(i, u))
    }

    /// Pose of the rig in the room at a time after the first waypoint.
    pub fn room_from_rig(&self, elapsed_s: f64) -> Pose {
        self.room_from_first * self.first_from_rig(elapsed_s)
    }

    fn position(&self, i: usize, h: f64, u: f64) -> Vector3<f64> {
        let (p, m, n) = (self.positions[i], self.velocities[i], self.velocities[i + 1]);
        let chord = (self.positions[i + 1] - p) / h;
        let cubic = m + n - chord * 2.0;
        let square = chord * 3.0 - m * 2.0 - n;
        p + (m + (square + cubic * u) * u) * (h * u)
    }

    fn attitude(&self, i: usize, u: f64) -> UnitQuaternion<f64> {
        let chord = self.chords[i].at(u);
        match self.controls.get(i) {
            None => chord,
            Some(control) => slerp(&chord, &control.at(u), 2.0 * u * (1.0 - u)),
        }
    }
}

/// Pose of the rig in the room at a waypoint.
pub(crate) fn pose(waypoint: &Waypoint) -> Pose {
    let turn = [waypoint.yaw_deg, waypoint.pitch_deg, waypoint.roll_deg];
    let [yaw, pitch, roll] = turn.map(f64::to_radians);
    Pose::from_parts(
        Translation3::from(Vector3::from(waypoint.position_m)),
        yaw_pitch_roll(yaw, pitch, roll),
    )
}

/// The rotation from one attitude to another; exactly the identity for equal ones.
fn between(from: &UnitQuaternion<f64>, to: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    if from == to {
        return UnitQuaternion::identity();
    }
    from.inverse() * to
}

/// Derivatives at every node of the parabolas through neighboring nodes, given the intervals and the slopes of the
/// chords.
fn slopes(intervals: &[f64], chords: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let inner = |i: usize| {
        let (before, after) = (intervals[i - 1], intervals[i]);
        (chords[i - 1] * after + chords[i] * before) / (before + after)
    };
    let last = chords.len();
    if last == 1 {
        return vec![chords[0]; 2];
    }
    // On a parabola, the slope of a chord is the mean of the slopes at its ends.
    let mut slopes = vec![chords[0] * 2.0 - inner(1)];
    slopes.extend((1..last).map(inner));
    slopes.push(chords[last - 1] * 2.0 - inner(last - 1));
    slopes
}

fn intervals(times: &[f64]) -> Vec<f64> {
    times.windows(2).map(|t| t[1] - t[0]).collect()
}

fn velocities(times: &[f64], positions: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let intervals = intervals(times);
    let pairs = positions.windows(2).zip(&intervals);
    let chords: Vec<Vector3<f64>> = pairs.map(|(p, h)| (p[1] - p[0]) / *h).collect();
    slopes(&intervals, &chords)
}

/// Arc from squad's aᵢ to bᵢ₊₁ for every interval.
fn controls(times: &[f64], attitudes: &[UnitQuaternion<f64>]) -> Vec<Arc> {
    let intervals = intervals(times);
    let turns: Vec<Vector3<f64>> = attitudes
        .windows(2)
        .map(|q| between(&q[0], &q[1]).scaled_axis())
        .collect();
    let rates: Vec<Vector3<f64>> = turns.iter().zip(&intervals).map(|(turn, h)| turn / *h).collect();
    let rates = slopes(&intervals, &rates);
    let beside = |q: &UnitQuaternion<f64>, turn: Vector3<f64>| q * UnitQuaternion::from_scaled_axis(turn);
    intervals
        .iter()
        .zip(&turns)
        .enumerate()
        .map(|(i, (h, turn))| {
            Arc::new(
                &beside(&attitudes[i], (rates[i] * *h - turn) * 0.5),
                &beside(&attitudes[i + 1], (turn - rates[i + 1] * *h) * 0.5),
            )
        })
        .collect()
}
