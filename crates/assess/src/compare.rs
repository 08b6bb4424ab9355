//! Comparison of several calibrations of one dataset, side by side and in pairs.
//!
//! A pair is compared over the elements that both solved, with δ the difference of their (θ_a, φ) and P₁, P₂ the stated
//! covariances:
//!
//! ```text
//! direction difference   atan2(‖v̂₁×v̂₂‖, v̂₁·v̂₂): rms and maximum
//! normalized square      mean(δᵀ(P₁ + P₂)⁻¹δ) / 2      1 for independent errors as large as stated
//! ```
//!
//! Two calibrations of one dataset share its errors, so the value of honest ones is below 1; if it is above 1, at least
//! one of them is over-confident. This needs no truth.

use crate::requirement::{Requirement, RequirementError};
use crate::score::{Gate, Honesty, Knowable, Mistake, Score, Verdict, knowable, score_by};
use catoptric_calib::observations;
use catoptric_model::{BeamEstimate, Calibration, Dataset, Unreadable, beam};
use catoptric_sim::Truth;
use nalgebra::{Matrix2, Vector2};
use serde::Serialize;

/// Version of what `compare --json` prints.
pub const SCHEMA_VERSION: u32 = 1;

/// Mean normalized square of the differences above which one of two calibrations is over-confident beyond statistical
/// fluctuation: if all elements share one error, honest and independent calibrations exceed it with probability e⁻⁶.
pub const CONTRADICTION: f64 = 6.0;

/// A calibration with a name, usually that of its file.
#[derive(Debug, Clone, PartialEq)]
pub struct Contestant {
    /// Its name.
    pub name: String,
    /// The calibration.
    pub calibration: Calibration,
}

/// A comparison of several calibrations of one dataset. A figure that does not exist is NaN here and `null` in JSON.
#[derive(Debug, Clone, Serialize)]
pub struct Comparison {
    /// Version of this format.
    pub schema_version: u32,
    /// Whether there is no truth, so that only boards and walls are available.
    pub blind: bool,
    /// The worst of the rows' verdicts.
    pub verdict: Verdict,
    /// One row per calibration, sorted by point error at 4 m or, on blind data, by the residual on the walls.
    pub rows: Vec<Row>,
    /// All pairs, in the order of the rows.
    pub pairs: Vec<Pair>,
    /// What keeps calibrations from passing, one sentence for each gate that is not met, beginning with the name of the
    /// calibration.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub failures: Vec<String>,
}

/// The figures of one calibration.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    /// Its name.
    pub name: String,
    /// Name of its method.
    pub method: String,
    /// Verdict of its score.
    pub verdict: Verdict,
    /// What decides it.
    pub gates: Vec<Gate>,
    /// The usual mistakes that would explain the errors.
    pub mistakes: Vec<Mistake>,
    /// Whether its errors are as large as it states.
    pub honesty: Option<Honesty>,
    /// Elements with a direction; deflected and unsplit ones, unless the data are blind.
    pub solved: usize,
    /// Elements without a direction but with a reason.
    pub abstained: usize,
    /// Elements with neither. `None` on blind data.
    pub missed: Option<usize>,
    /// Solved elements that no mirror deflects. `None` on blind data.
    #[serde(rename = "false")]
    pub wrong: Option<usize>,
    /// Per-axis error in the sensor frame.
    pub per_axis_rms_deg: f64,
    /// Per-axis error in the room frame.
    pub per_axis_rms_room_deg: f64,
    /// 95th percentile of the direction error in the sensor frame.
    pub direction_p95_deg: f64,
    /// Error of a point 4 m behind the mirror, in the sensor frame.
    pub point_4m_mm: f64,
    /// Mean normalized squared error.
    pub nees_mean: f64,
    /// Share of errors inside their 95 % ellipses.
    pub coverage_95: f64,
    /// Bound over error, as mean squares.
    pub efficiency: f64,
    /// Root mean square distance of lifted points from the boards.
    pub boards_rms_mm: f64,
    /// Root mean square distance of lifted points from the walls.
    pub walls_rms_mm: f64,
}

/// The differences of two calibrations.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Pair {
    /// Name of the first one.
    pub first: String,
    /// Name of the second one.
    pub second: String,
    /// Elements that both solved.
    pub beams: usize,
    /// Root mean square angle between their directions.
    pub direction_rms_deg: f64,
    /// Largest angle between their directions.
    pub direction_max_deg: f64,
    /// Mean square of the differences, normalized by the sum of both covariances.
    pub normalized_square: f64,
}

/// What every calibration of a comparison has to meet in addition to the gates of its score.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Rules {
    /// Share of the knowable elements that must be solved, [`MIN_SOLVED`](crate::score::MIN_SOLVED) unless given. On
    /// blind data, where nobody knows what is knowable, it is the share of the deflected elements of the calibration, if it
    /// is given.
    pub min_solved: Option<f64>,
    /// Limits on the figures of a score.
    pub requirements: Vec<Requirement>,
}

/// Why there is no comparison.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// The recording of the dataset can no longer be read.
    #[error(transparent)]
    Unreadable(#[from] Unreadable),
    /// A requirement names no figure of a score.
    #[error(transparent)]
    Requirement(#[from] RequirementError),
}

/// Compares calibrations of one dataset, with its truth or without.
///
/// # Errors
/// [`Unreadable`] if the recording of the dataset can no longer be read.
pub fn compare(
    dataset: &Dataset,
    contestants: &[Contestant],
    truth: Option<&Truth>,
) -> Result<Comparison, Unreadable> {
    compared(dataset, contestants, truth, Ok)
}

/// Compares calibrations of one dataset under rules of your own.
///
/// # Errors
/// [`CompareError`] if the recording can no longer be read, or a requirement names no figure.
pub fn compare_by(
    dataset: &Dataset,
    contestants: &[Contestant],
    truth: Option<&Truth>,
    rules: &Rules,
) -> Result<Comparison, CompareError> {
    compared(dataset, contestants, truth, |score| Ok(rules.applied(score)?))
}

impl Rules {
    /// Returns a score under these rules.
    ///
    /// # Errors
    /// [`RequirementError::Unknown`] if a requirement names no figure.
    pub fn applied(&self, score: Score) -> Result<Score, RequirementError> {
        let score = match self.min_solved {
            Some(share) => score.with_min_solved(share),
            None => score,
        };
        self.requirements.iter().try_fold(score, Score::with_requirement)
    }
}

/// Compares calibrations by their scores, each of them changed by `rules`.
fn compared<E: From<Unreadable>>(
    dataset: &Dataset,
    contestants: &[Contestant],
    truth: Option<&Truth>,
    rules: impl Fn(Score) -> Result<Score, E>,
) -> Result<Comparison, E> {
    let known: Option<Knowable> = truth.map(|truth| knowable(dataset, truth)).transpose()?;
    let scored_of = |c: &Contestant| rules(score_by(dataset, &c.calibration, truth.zip(known.as_ref()))?);
    let mut scored: Vec<(&Contestant, Score)> = contestants
        .iter()
        .map(|c| Ok((c, scored_of(c)?)))
        .collect::<Result<_, E>>()?;
    let key = |s: &Score| {
        if truth.is_some() {
            s.point_mm.at_4m
        } else {
            s.walls_mm.rms
        }
    };
    // NaN, a figure that does not exist, sorts last; ties keep their order.
    scored.sort_by(|(_, a), (_, b)| key(a).abs().total_cmp(&key(b).abs()));
    let pairs = scored
        .iter()
        .enumerate()
        .flat_map(|(i, (first, _))| scored[i + 1..].iter().map(move |(second, _)| (*first, *second)))
        .map(|(first, second)| pair(dataset, first, second))
        .collect();
    let passes = if truth.is_some() {
        Verdict::Pass
    } else {
        Verdict::Blind
    };
    let verdicts = scored.iter().map(|(_, s)| s.verdict);
    Ok(Comparison {
        schema_version: SCHEMA_VERSION,
        blind: truth.is_none(),
        verdict: verdicts.fold(passes, Verdict::worse),
        rows: scored.iter().map(|(c, s)| row(&c.name, s)).collect(),
        pairs,
        failures: scored
            .iter()
            .flat_map(|(c, s)| s.reasons().into_iter().map(|why| format!("{}: {why}", c.name)))
            .collect(),
    })
}

fn row(name: &str, score: &Score) -> Row {
    Row {
        name: name.to_owned(),
        method: score.method.clone(),
        verdict: score.verdict,
        gates: score.gates.clone(),
        mistakes: score.mistakes.clone(),
        honesty: score.honesty,
        solved: score.beams.solved,
        abstained: score.beams.abstained,
        missed: score.beams.missed,
        wrong: score.beams.wrong,
        per_axis_rms_deg: score.per_axis_rms_deg,
        per_axis_rms_room_deg: score.per_axis_rms_room_deg,
        direction_p95_deg: score.direction_deg.p95,
        point_4m_mm: score.point_mm.at_4m,
        nees_mean: score.nees_mean,
        coverage_95: score.coverage_95,
        efficiency: score.efficiency,
        boards_rms_mm: score.boards_mm.rms,
        walls_rms_mm: score.walls_mm.rms,
    }
}

fn pair(dataset: &Dataset, first: &Contestant, second: &Contestant) -> Pair {
    let (mut beams, mut largest, mut squares) = (0_usize, f64::NAN, 0.0);
    let (mut stated, mut normalized) = (0_usize, 0.0);
    for a in &first.calibration.beams {
        let Some(b) = second.calibration.beam(a.beam) else {
            continue;
        };
        let (Some(at_a), Some(at_b)) = (a.deflection(), b.deflection()) else {
            continue;
        };
        let azimuth = observations::azimuth(&dataset.session, a.beam);
        let angle = beam::angle_between(&at_a.exit_direction(azimuth), &at_b.exit_direction(azimuth));
        if !angle.is_finite() {
            continue;
        }
        beams += 1;
        largest = angle.max(largest);
        squares += angle * angle;
        let turn = (at_a.azimuth - at_b.azimuth).rem_euclid(std::f64::consts::TAU);
        let turn = if turn > std::f64::consts::PI {
            turn - std::f64::consts::TAU
        } else {
            turn
        };
        let difference = Vector2::new(turn, at_a.elevation - at_b.elevation);
        if let Some(square) = normalized_square(&difference, a, b) {
            stated += 1;
            normalized += square;
        }
    }
    Pair {
        first: first.name.clone(),
        second: second.name.clone(),
        beams,
        direction_rms_deg: (squares / beams as f64).sqrt().to_degrees(),
        direction_max_deg: largest.to_degrees(),
        normalized_square: normalized / (2.0 * stated as f64),
    }
}

/// δᵀ(P₁ + P₂)⁻¹δ; `None` unless both state a covariance and their sum has an inverse.
fn normalized_square(difference: &Vector2<f64>, a: &BeamEstimate, b: &BeamEstimate) -> Option<f64> {
    let of = |e: &BeamEstimate| e.covariance_rad2.map(|[[a, b], [c, d]]| Matrix2::new(a, b, c, d));
    let factor = (of(a)? + of(b)?).cholesky()?;
    Some(difference.dot(&factor.solve(difference)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use catoptric_fixtures::{noisy, perfect, sample, turned};
    use catoptric_model::Status;

    fn named(name: &str, calibration: Calibration) -> Contestant {
        Contestant {
            name: name.to_owned(),
            calibration,
        }
    }

    #[test]
    fn the_best_point_comes_first_and_a_figure_that_does_not_exist_last() {
        let s = sample();
        let mut nothing = perfect(&s.truth);
        for b in &mut nothing.beams {
            *b = BeamEstimate::without_angles(b.beam, Status::Rejected, Some("no time".to_owned()));
        }
        let given = [
            named("nothing", nothing),
            named("coarse", noisy(&s.truth, 2e-3, 1)),
            named("truth", perfect(&s.truth)),
            named("fine", noisy(&s.truth, 1e-3, 2)),
        ];
        let found = compare(&s.dataset, &given, Some(&s.truth)).expect("in memory");
        let names: Vec<&str> = found.rows.iter().map(|r| r.name.as_str()).collect();
        assert_eq!(names, ["truth", "fine", "coarse", "nothing"]);
        assert_eq!(found.rows[0].point_4m_mm, 0.0);
        assert!(found.rows[3].point_4m_mm.is_nan());
        assert_eq!(found.pairs.len(), 6);
        let json = serde_json::to_value(&found).expect("it is JSON");
        assert!(json["rows"][3]["point_4m_mm"].is_null() && json["rows"][0]["false"] == 0);
        let blind = compare(&s.dataset, &given, None).expect("in memory");
        assert!(blind.blind && blind.rows[0].name == "truth");
        assert!(blind.rows[0].walls_rms_mm < blind.rows[1].walls_rms_mm);
    }

    #[test]
    fn pairs_differ_by_the_injected_rotation() {
        let s = sample();
        let angle = 0.3_f64.to_radians();
        let found = compare(
            &s.dataset,
            &[
                named("truth", perfect(&s.truth)),
                named("turned", turned(perfect(&s.truth), angle)),
            ],
            Some(&s.truth),
        )
        .expect("in memory");
        let pair = &found.pairs[0];
        assert_eq!(pair.beams, found.rows[0].solved);
        assert!(pair.direction_max_deg <= 0.3 + 1e-12 && pair.direction_max_deg > 0.25);
        assert!(pair.direction_rms_deg < pair.direction_max_deg);
        // Independent errors as stated by both: 1, within six standard deviations of χ²/2n with 2n = 2·beams.
        let of = |seed| noisy(&s.truth, 1e-3, seed);
        let found = compare(&s.dataset, &[named("a", of(1)), named("b", of(2))], None).expect("in memory");
        let pair = &found.pairs[0];
        let six = 6.0 / (pair.beams as f64).sqrt();
        assert!((pair.normalized_square - 1.0).abs() < six, "{pair:?}");
        assert!(six < 0.4);
    }

    #[test]
    fn azimuths_that_differ_by_a_full_turn_are_equal() {
        let s = sample();
        let mut around = perfect(&s.truth);
        for b in &mut around.beams {
            b.azimuth_rad = b.azimuth_rad.map(|a| a - std::f64::consts::TAU);
        }
        let found = compare(
            &s.dataset,
            &[named("truth", perfect(&s.truth)), named("around", around)],
            Some(&s.truth),
        )
        .expect("in memory");
        assert!(found.pairs[0].normalized_square < 1e-12, "{:?}", found.pairs[0]);
    }
}
