//! The gates of a score: completeness, honesty, distances, range biases, mounting, and boards that were held out.

use super::bound::largest_sd;
use super::element::USEFUL_SD;
use super::gate::{Gate, MIN_SOLVED, Outcome, SIGNIFICANCE, elements, mean_limit, shares, worst_limit};
use super::range_bias::{self, WorstBias};
use super::residual::ROUNDING_MM;
use super::statistics::percentile;
use super::{ElementError, Score, blind, honesty, mounting};
use crate::validate::{Problem, Severity};
use catoptric_model::{Calibration, Dataset};
use catoptric_sim::Truth;

/// Problems that are listed one by one.
const LISTED: usize = 3;

/// The respects in which a calibration states that it belongs to another dataset.
fn foreign(dataset: &Dataset, calibration: &Calibration) -> Option<String> {
    calibration.other_dataset(dataset).map(|[its, this]| {
        format!("the calibration was made from another dataset (SHA-256 {its}); this one is {this}")
    })
}

/// The gate on the file itself.
pub(super) fn valid(problems: &[Problem]) -> Gate {
    let errors: Vec<&Problem> = problems
        .iter()
        .filter(|p| p.severity == Severity::Error)
        .collect();
    if errors.is_empty() {
        return Gate::at_most("valid", 0.0, 0.0, "the calibration is valid".to_owned());
    }
    let mut words: Vec<String> = errors
        .iter()
        .take(LISTED)
        .map(|p| format!("{} {}", place(p), p.message))
        .collect();
    if errors.len() > LISTED {
        words.push(format!(
            "{} more; `catoptric validate` lists all",
            errors.len() - LISTED
        ));
    }
    Gate {
        outcome: Outcome::Invalid,
        ..Gate::at_most("valid", errors.len() as f64, 0.0, words.join("; "))
    }
}

fn place(problem: &Problem) -> String {
    match problem.beam {
        Some(beam) => format!("{} (beam {beam})", problem.key),
        None => problem.key.clone(),
    }
}

/// All gates of a score with a truth or without, in the order in which they are reported.
pub(super) fn gates(
    score: &Score,
    dataset: &Dataset,
    calibration: &Calibration,
    truth: Option<&Truth>,
) -> Vec<Gate> {
    let mut gates = vec![valid(&[])];
    gates.push(match foreign(dataset, calibration) {
        Some(why) => Gate::of("dataset", false, f64::NAN, why),
        None if calibration.dataset.is_none() => Gate::without(
            "dataset",
            Outcome::NotTested,
            "the calibration does not state its dataset",
        ),
        None => Gate::of(
            "dataset",
            true,
            f64::NAN,
            "it was made from this dataset".to_owned(),
        ),
    });
    if truth.is_none() {
        gates.push(blind::omitted(dataset, calibration));
        gates.extend(blind::blind(score));
        gates.extend(mounting_claim(dataset, calibration));
        gates.extend(held_out(calibration));
        return gates;
    }
    if score.beams.deflected == Some(0) {
        gates.extend(of_false(score));
        gates.push(Gate::without(
            "solved",
            Outcome::NotJudged,
            "no element is deflected by a mirror and unsplit: there is nothing to judge",
        ));
        return gates;
    }
    gates.extend(missed(score));
    gates.extend(of_false(score));
    gates.push(solved(score, MIN_SOLVED));
    gates.push(covariance(score));
    gates.extend(unstated(score));
    gates.extend(directions(score));
    gates.extend(open(score));
    gates.extend(distances(score));
    gates.push(biases(dataset, calibration, truth));
    gates.push(of_mounting(score));
    gates.extend(mounting_claim(dataset, calibration));
    gates.extend(held_out(calibration));
    gates
}

fn missed(score: &Score) -> Option<Gate> {
    let missed = score.beams.missed?;
    let words = format!(
        "{} deflected by a mirror, with neither a direction nor a reason",
        elements(missed, "is", "are")
    );
    Some(Gate::at_most("missed", missed as f64, 0.0, words))
}

fn of_false(score: &Score) -> Option<Gate> {
    let wrong = score.beams.wrong?;
    let words = format!(
        "{} called solved although no mirror sends {} anywhere",
        elements(wrong, "is", "are"),
        if wrong == 1 { "it" } else { "them" }
    );
    Some(Gate::at_most("false", wrong as f64, 0.0, words))
}

/// The gate on completeness: the share of what the boards make knowable that is solved.
pub(super) fn solved(score: &Score, min_solved: f64) -> Gate {
    let (solved, all, which) = if score.has_truth {
        let Some((knowable @ 1.., solved)) = score.knowable.zip(score.knowable_solved) else {
            return Gate::without("solved", Outcome::NotTested, "the boards determine no element");
        };
        (solved, knowable, "the boards determine")
    } else {
        let deflected = score.beams.solved + score.beams.abstained;
        let solved = score.beams.solved - score.useless;
        (solved, deflected, "the calibration calls deflected")
    };
    let share = solved as f64 / all.max(1) as f64;
    let words = format!(
        "{solved} of {all} elements that {which} are solved, {:.0} %; at least {:.0} % are required",
        100.0 * share,
        100.0 * min_solved
    );
    Gate::at_least("solved", share, min_solved, words)
}

/// The gate on how much is stated.
fn covariance(score: &Score) -> Gate {
    let scored = score.scored().count();
    let stated = score.scored().filter(|e| e.mahalanobis_squared.is_some()).count();
    shares("covariance", "a covariance", stated, scored)
}

/// The gate on single elements that state no covariance while others do: they are taken to be known as well as the median of
/// those, or as well as their own boards alone determine them.
fn unstated(score: &Score) -> Option<Gate> {
    let stated: Vec<f64> = score.scored().filter_map(|e| e.stated_sd).collect();
    let median = percentile(&stated, 0.5);
    if median.is_nan() {
        return None;
    }
    let without = || score.scored().filter(|e| e.stated_sd.is_none());
    let alone = |e: &ElementError| e.alone_bound.map_or(f64::INFINITY, |bound| largest_sd(&bound));
    let sd = |e: &ElementError| alone(e).min(USEFUL_SD).max(median);
    let square = |e: &ElementError| (e.across * e.across + e.up * e.up) / sd(e).powi(2);
    let worst = without().max_by(|a, b| square(a).total_cmp(&square(b)))?;
    let limit = worst_limit(2.0, without().count());
    let words = format!(
        "beam {} states no covariance and is {:.3}° off; {:.3}° is the limit for the worst of {}",
        worst.beam,
        libm::hypot(worst.across, worst.up).to_degrees(),
        (limit.sqrt() * sd(worst)).to_degrees(),
        counted(without().count())
    );
    Some(Gate::at_most("unstated", square(worst), limit, words).with_rate(SIGNIFICANCE))
}

/// The gates on the honesty of the covariance.
fn directions(score: &Score) -> Vec<Gate> {
    let mut gates = Vec::new();
    if score.nees_mean.is_nan() {
        return gates;
    }
    let limit = mean_limit(2.0);
    let words = format!(
        "{}; {limit:.2} is the limit for a mean normalized squared error",
        honesty::over_confident(score)
    );
    let met = score.nees_mean <= limit;
    let words = if met {
        format!(
            "the mean normalized squared error is {:.2}, the limit {limit:.2}",
            score.nees_mean
        )
    } else {
        words
    };
    gates.push(Gate::at_most("directions", score.nees_mean, limit, words).with_rate(SIGNIFICANCE));
    if let Some((square, limit, element)) = honesty::worst(score) {
        let words = format!(
            "the direction of beam {} is {:.1} standard deviations off; {:.1} is the limit for the worst of {}",
            element.beam,
            square.sqrt(),
            limit.sqrt(),
            counted(score.scored().count())
        );
        gates.push(Gate::at_most("worst_direction", square, limit, words).with_rate(SIGNIFICANCE));
    }
    let claim = honesty::claim(score);
    if claim.is_finite() {
        let words = format!(
            "it states {claim:.2} times the smallest uncertainty that this dataset allows, and the errors are {:.1} times what it states",
            score.nees_mean.sqrt()
        );
        gates.push(Gate {
            at_least: Some(honesty::LEAST_CLAIM),
            ..Gate::of("claim", !honesty::claims_too_much(score), claim, words)
        });
    }
    gates
}

/// The gate on elements that their own boards leave open.
///
/// If all of them share one error, an honest covariance rules out the truth once in a thousand runs, and that of half of
/// them at most twice, whatever their dependence.
fn open(score: &Score) -> Option<Gate> {
    let open = score.open.filter(|o| o.solved > 0)?;
    let words = format!(
        "{} left open by the boards and given a direction with a covariance that rules out the truth; abstaining would be correct, and at most half of the {} solved ones are allowed",
        elements(open.wrong, "is", "are"),
        open.solved
    );
    let share = open.wrong as f64 / open.solved as f64;
    Some(Gate::at_most("open", share, 0.5, words).with_rate(2e-3))
}

/// Standard deviation up to which a distance counts as stated, in meters: as far as mirrors are from a scanner.
const USEFUL_DISTANCE_SD_M: f64 = 0.05;

/// The gates on d.
fn distances(score: &Score) -> Vec<Gate> {
    let scored = score.scored().count();
    let with: Vec<_> = score.scored().filter(|e| e.has_distance).collect();
    let known = with
        .iter()
        .filter(|e| e.distance_sd <= USEFUL_DISTANCE_SD_M)
        .count();
    let mut gates = vec![shares("distances", "d", known, scored)];
    let deviation = |e: &&ElementError| (e.estimate.distance - e.truth.distance) / e.distance_sd;
    let worst = with
        .iter()
        .max_by(|a, b| deviation(a).abs().total_cmp(&deviation(b).abs()));
    let Some(worst) = worst else { return gates };
    let (limit, rms_sd) = (mean_limit(1.0), sd_of(&with));
    let words = format!(
        "the distances are {:.2} mm off (rms), {:.1} times their standard deviation of {rms_sd:.2} mm; {:.1} times is the limit",
        score.distance_mm.rms,
        score.distance_nees.sqrt(),
        limit.sqrt()
    );
    gates.push(Gate::at_most("distance", score.distance_nees, limit, words).with_rate(SIGNIFICANCE));
    let (square, limit) = (deviation(worst).powi(2), worst_limit(1.0, with.len()));
    let words = format!(
        "the distance of beam {} is {:+.2} mm off, {:.1} standard deviations; {:.1} is the limit for the worst of {}",
        worst.beam,
        1e3 * (worst.estimate.distance - worst.truth.distance),
        square.sqrt(),
        limit.sqrt(),
        counted(with.len())
    );
    gates.push(Gate::at_most("worst_distance", square, limit, words).with_rate(SIGNIFICANCE));
    gates
}

fn counted(elements: usize) -> String {
    format!("{elements} element{}", if elements == 1 { "" } else { "s" })
}

/// Root mean square standard deviation of d, in millimeters.
fn sd_of(with: &[&ElementError]) -> f64 {
    let sum: f64 = with.iter().map(|e| e.distance_sd * e.distance_sd).sum();
    1e3 * (sum / with.len() as f64).sqrt()
}

/// The gate on the mounting.
fn of_mounting(score: &Score) -> Gate {
    let Some(found) = score.mounting else {
        return Gate::without(
            "mounting",
            Outcome::NotTested,
            "the calibration has no mounting, or the rig was never tracked",
        );
    };
    let limit = mean_limit(6.0);
    let words = format!(
        "the mounting is {:.3}° and {:.2} mm off, a mean normalized squared error of {:.2} under {}; {limit:.2} is the limit",
        found.attitude_deg,
        found.position_mm,
        found.nees,
        if found.states_covariance {
            "its covariance"
        } else {
            "the drawing's tolerance"
        },
    );
    Gate::at_most("mounting", found.nees, limit, words).with_rate(SIGNIFICANCE)
}

/// The gate on the range biases.
fn biases(dataset: &Dataset, calibration: &Calibration, truth: Option<&Truth>) -> Gate {
    const NAME: &str = "range_bias";
    let worst = range_bias::worst(&dataset.session, calibration, truth);
    let Some(found) = worst else {
        let why = range_bias::incomparable(calibration, truth);
        return Gate::without(NAME, Outcome::NotTested, why.unwrap_or("no board has a color"));
    };
    let (square, limit) = (found.square(), worst_limit(1.0, found.references));
    let WorstBias {
        range_m,
        color,
        incidence_deg,
        error_mm,
        sd_mm,
        references,
    } = found;
    let words = format!(
        "on a board of color {color:?} at {range_m} m and {incidence_deg:.0}°, the range biases are {error_mm:+.2} mm off, {:.1} times their standard deviation of {sd_mm:.2} mm; {:.1} times is the limit for the worst of {references} references",
        square.sqrt(),
        limit.sqrt(),
    );
    Gate::at_most(NAME, square, limit, words).with_rate(SIGNIFICANCE)
}

/// The gate on what the calibration claims to know of the mounting: no more than a few times less than the drawing.
fn mounting_claim(dataset: &Dataset, calibration: &Calibration) -> Option<Gate> {
    let estimate = calibration.rig_from_sensor.as_ref()?;
    let over = mounting::over_drawing(estimate, &dataset.session.mount_tolerance)?;
    let limit = mounting::MOST_OVER_DRAWING;
    let words = format!(
        "the mounting's stated standard deviations are up to {over:.1} times the drawing's tolerance; {limit} times is the limit of what is of use"
    );
    Some(Gate::at_most("mounting_claim", over, limit, words))
}

/// The gate on boards that the calibration was not fitted to, if it was cross-validated.
///
/// If all differences are one and the same, their mean square over the expected one is χ² with one degree of freedom.
fn held_out(calibration: &Calibration) -> Option<Gate> {
    let found = calibration.assessment.as_ref()?.held_out?;
    let expected = libm::hypot(found.expected_mm, ROUNDING_MM);
    let (square, limit) = ((found.rms_mm / expected).powi(2), mean_limit(1.0));
    let words = format!(
        "the {} boards that were held out are {:.2} mm (rms) off their prediction, {:.1} times the {expected:.2} mm expected; {:.1} times is the limit",
        found.boards,
        found.rms_mm,
        square.sqrt(),
        limit.sqrt()
    );
    Some(Gate::at_most("held_out", square, limit, words).with_rate(SIGNIFICANCE))
}
