//! Frames in which motion capture had lost a body and reported a pose nevertheless: the identity, or the last one again.
//!
//! A tracker that measures never reports the same numbers twice, so a pose that is repeated bit for bit is frozen; a recording
//! without noise repeats all of them, and is left alone. The identity is a pose like any other if the body has no other.

use super::outlying::{Center, Sample};
use catoptric_model::{Pose, TrackedFrame};
use std::collections::BTreeMap;

/// Number of equal poses in a row from which on they are frozen: fewer can be rounding.
const FROZEN: usize = 3;

/// What a body's poses over a stretch look like.
#[derive(Debug, Clone, Default)]
pub(super) struct Seen {
    /// Frames in which it has a pose.
    pub(super) frames: usize,
    /// Frames in which that is the identity.
    identities: usize,
    /// Frames whose pose is that of the frame before, and the longest row of equal poses.
    repeats: usize,
    longest: usize,
    row: usize,
    first: Option<Pose>,
    last: Option<Pose>,
    /// What outlying poses are compared with.
    pub(super) sample: Sample,
}

/// The frames of a body that are not used.
#[derive(Debug, Clone, Copy, Default)]
struct Unused {
    identities: bool,
    repeats: bool,
    /// The pose before the next frame.
    before: Option<Pose>,
    /// The pose from which no frame may be far.
    center: Option<Center>,
}

/// Passes over frames that are not used, by body.
#[derive(Debug, Clone, Default)]
pub(super) struct Sieve(BTreeMap<usize, Unused>);

/// All stretches of one body.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Habit {
    /// Pairs of successive frames at rest, and those of them that differ.
    pairs: usize,
    changes: usize,
    /// Whether any pose is not the identity.
    is_elsewhere: bool,
}

impl Seen {
    /// Adds the pose of a frame.
    pub(super) fn add(&mut self, pose: &Pose) {
        self.frames += 1;
        self.identities += usize::from(*pose == Pose::identity());
        let repeats = self.last == Some(*pose);
        self.repeats += usize::from(repeats);
        self.row = if repeats { self.row + 1 } else { 1 };
        self.longest = self.longest.max(self.row);
        self.first.get_or_insert(*pose);
        self.sample.add(pose);
        self.last = Some(*pose);
    }

    /// The last pose.
    pub(super) fn last(&self) -> Option<Pose> {
        self.last
    }
}

impl Habit {
    /// Adds a stretch; in a flight, poses differ because the body moves.
    pub(super) fn add(&mut self, seen: &Seen, is_flight: bool) {
        self.is_elsewhere |= seen.identities < seen.frames;
        if !is_flight && seen.frames > 0 {
            self.pairs += seen.frames - 1;
            self.changes += seen.frames - 1 - seen.repeats;
        }
    }

    /// Whether its poses are measured anew in each frame.
    fn is_measured(&self) -> bool {
        2 * self.changes > self.pairs
    }
}

impl Sieve {
    /// Marks the frames of a body in a stretch that are not used, given its pose at the end of the stretch before; returns
    /// how many they are.
    pub(super) fn mark(&mut self, body: usize, seen: &Seen, habit: &Habit, before: Option<Pose>) -> usize {
        let stays = before.is_some() && seen.first == before;
        let is_frozen = seen.longest >= FROZEN || stays && seen.repeats + 1 == seen.frames;
        let unused = Unused {
            identities: seen.identities > 0 && habit.is_elsewhere,
            repeats: habit.is_measured() && is_frozen,
            before,
            center: None,
        };
        if !unused.identities && !unused.repeats {
            return 0;
        }
        self.0.insert(body, unused);
        let mut count = 0;
        if unused.identities {
            count += seen.identities;
        }
        if unused.repeats {
            // Repeated identities are counted above.
            count += seen.repeats + usize::from(stays);
            if unused.identities {
                count -= seen.identities.saturating_sub(1).min(seen.repeats);
            }
        }
        count
    }

    /// Marks the frames of a body that are far from a pose as unused.
    pub(super) fn mark_far(&mut self, body: usize, center: Center) {
        self.0.entry(body).or_default().center = Some(center);
    }

    /// Whether any frame is not used.
    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Whether a frame is used; frames are passed in order of time.
    pub(super) fn passes(&mut self, body: usize, frame: &TrackedFrame) -> bool {
        let (Some(unused), Some(pose)) = (self.0.get_mut(&body), frame.pose) else {
            return true;
        };
        if unused.identities && pose == Pose::identity() {
            return false;
        }
        let repeats = unused.repeats && unused.before == Some(pose);
        unused.before = Some(pose);
        !repeats && unused.center.is_none_or(|center| !center.is_far(&pose))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(places: &[f64]) -> Seen {
        let mut seen = Seen::default();
        places
            .iter()
            .for_each(|x| seen.add(&Pose::translation(*x, 0.0, 0.0)));
        seen
    }

    fn passed(sieve: &mut Sieve, places: &[f64]) -> Vec<f64> {
        let frame = |x: f64| TrackedFrame {
            time_s: 0.0,
            pose: Some(Pose::translation(x, 0.0, 0.0)),
            markers: Vec::new(),
        };
        places
            .iter()
            .copied()
            .filter(|x| sieve.passes(0, &frame(*x)))
            .collect()
    }

    #[test]
    fn identities_and_frozen_poses_are_passed_over() {
        let places = [1.0, 1.1, 0.0, 1.2, 1.2, 1.2, 1.3, 1.4, 1.5, 1.6];
        let mut habit = Habit::default();
        habit.add(&seen(&places), false);
        let mut sieve = Sieve::default();
        assert_eq!(sieve.mark(0, &seen(&places), &habit, None), 3);
        assert_eq!(passed(&mut sieve, &places), [1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6]);
    }

    #[test]
    fn a_body_frozen_from_the_stretch_before_is_never_seen() {
        let mut habit = Habit::default();
        habit.add(&seen(&[1.0, 1.1, 1.2, 1.3, 1.4, 1.5]), false);
        habit.add(&seen(&[1.5, 1.5]), false);
        let mut sieve = Sieve::default();
        let before = Some(Pose::translation(1.5, 0.0, 0.0));
        assert_eq!(sieve.mark(0, &seen(&[1.5, 1.5]), &habit, before), 2);
        assert!(passed(&mut sieve, &[1.5, 1.5]).is_empty());
    }

    #[test]
    fn a_recording_without_noise_is_left_alone() {
        for places in [[2.0; 6], [0.0; 6]] {
            let mut habit = Habit::default();
            habit.add(&seen(&places), false);
            let mut sieve = Sieve::default();
            assert_eq!(sieve.mark(0, &seen(&places), &habit, None), 0);
            assert_eq!(passed(&mut sieve, &places).len(), 6);
        }
    }
}
