//! Did a body stay in place while it was scanned?

use super::body::{limit, solved};
use catoptric_model::tracking::MeanMarker;
use catoptric_model::{Moments, PoseRecord, Session, Watched};
use nalgebra::{Point3, Vector3};

/// Drift of a marker's mean position along one axis that does not count as a motion of the body, in meters.
const WANDER: f64 = 3e-4;

/// Change of level that is always attributed to a sensor that is not quite steady, in meters.
const LEVEL_FLOOR: f64 = 3e-3;

/// Allowed change of a level, in standard errors and in drifts.
const LEVEL_SIGMAS: f64 = 5.0;

/// Minimum number of readings of a beam in each half of a stretch for comparing its levels.
const MIN_READINGS: usize = 5;

/// Minimum number of beams whose levels are evidence about a pose.
const MIN_BEAMS: usize = 5;

/// How a body moved.
pub(super) struct Movement {
    /// Shift of the centroid of its markers, in meters.
    shift: f64,
    /// Rotation angle, in radians.
    turn: f64,
}

impl Movement {
    pub(super) fn words(&self, name: &str) -> String {
        let turned = match self.turn.to_degrees() {
            turn if turn >= 0.05 => format!(" and turned by {turn:.1}°"),
            _ => String::new(),
        };
        format!(
            "{name} moved by {:.1} mm{turned} during the stretch",
            1e3 * self.shift
        )
    }
}

/// How the markers of a body moved, if they did: between the two parts of the stretch that differ most.
pub(super) fn of_markers(watched: &Watched) -> Option<Movement> {
    let parts = watched.parts.len();
    let split = |at: usize| (watched.mean(0, at), watched.mean(at, parts));
    let (excess, at) = (1..parts)
        .map(|at| {
            let (before, after) = split(at);
            (excess(&before, &after, watched.jitter), at)
        })
        .max_by(|a, b| a.0.total_cmp(&b.0))?;
    if excess <= 1.0 {
        return None;
    }
    let (before, after) = split(at);
    let both: Vec<(Point3<f64>, Point3<f64>)> = before
        .iter()
        .zip(&after)
        .filter(|(b, a)| b.count > 0 && a.count > 0)
        .map(|(b, a)| (b.place, a.place))
        .collect();
    let shift: Vector3<f64> = both.iter().map(|(b, a)| a - b).sum();
    let (from, to): (Vec<_>, Vec<_>) = both.iter().map(|(b, a)| (*b, Some(*a))).unzip();
    Some(Movement {
        shift: (shift / both.len() as f64).norm(),
        turn: solved(&from, &to).map_or(0.0, |(pose, _)| pose.rotation.angle()),
    })
}

/// χ² of markers that stayed, over its limit.
fn excess(before: &[MeanMarker], after: &[MeanMarker], jitter: f64) -> f64 {
    let (mut sum, mut dimensions) = (0.0, 0);
    for (b, a) in before.iter().zip(after) {
        if b.count > 0 && a.count > 0 {
            let of_means = jitter * jitter * (1.0 / b.count as f64 + 1.0 / a.count as f64);
            sum += (a.place - b.place).norm_squared() / (of_means + WANDER * WANDER);
            dimensions += 3;
        }
    }
    if dimensions == 0 {
        0.0
    } else {
        sum / limit(dimensions)
    }
}

/// Describes a change of level between the halves of the stretch that most beams on the board show.
pub(super) fn of_readings(record: &PoseRecord, session: &Session) -> Option<String> {
    let label = &record.label;
    let facet = label.facet.as_deref();
    let drawn = facet.and_then(|name| session.facets.iter().find(|f| f.name == name));
    let run = label.beams.or(drawn.map(|f| f.beams))?;
    label.board.as_ref()?;
    let unsteady = LEVEL_FLOOR + LEVEL_SIGMAS * session.believed.drift_sd_mm * 1e-3;
    let (mut beams, mut changes) = (0, Vec::new());
    let statistics = record.readings.statistics();
    for beam in session.scanner.scan.run(run).filter_map(|b| statistics.get(b)) {
        let [Some((m1, v1)), Some((m2, v2))] = beam.halves.map(level) else {
            continue;
        };
        beams += 1;
        let change = (m2 - m1).abs();
        if change > unsteady + LEVEL_SIGMAS * (v1 + v2).sqrt() {
            changes.push(change);
        }
    }
    if beams < MIN_BEAMS || 2 * changes.len() <= beams {
        return None;
    }
    let count = changes.len();
    let (_, middle, _) = changes.select_nth_unstable_by(count / 2, f64::total_cmp);
    Some(format!(
        "the readings of {count} of {beams} beams changed by {:.1} mm (median) during the stretch, and no marker moved",
        1e3 * *middle
    ))
}

/// Mean of readings, and its variance.
fn level(of: Moments) -> Option<(f64, f64)> {
    let count = of.count;
    (count >= MIN_READINGS).then(|| (of.mean, of.squares / ((count - 1) * count) as f64))
}
