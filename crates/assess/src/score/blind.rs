//! The gates of a score without a truth: what the drawing has deflected, how much is stated, and the residuals on boards and
//! walls, of all mirrors and of each.

use super::gate::{Gate, Outcome, SIGNIFICANCE, elements, median_limit, shares, worst_median_limit};
use super::residual::Normalized;
use super::{Score, wrap};
use catoptric_model::{Calibration, Dataset, Status};

/// Beams inside the fan of a facet as drawn that are not judged, in degrees of the scan: mirrors are off their drawing.
const DRAWN_WITHIN_DEG: f64 = 3.0;

/// The gate on elements that the drawing has deflected, without a truth: each needs a direction or a reason.
pub(super) fn omitted(dataset: &Dataset, calibration: &Calibration) -> Gate {
    let scan = &dataset.session.scanner.scan;
    let step = scan.angles().step_deg.abs();
    let inside = |beam: usize| {
        let azimuth = scan.azimuth(beam);
        dataset
            .session
            .facets
            .iter()
            .filter(|f| scan.holds(f.beams, beam))
            .any(|f| {
                let edges = f
                    .beams
                    .map(|edge| wrap(scan.azimuth(edge) - azimuth).abs().to_degrees());
                edges.iter().all(|apart| *apart >= DRAWN_WITHIN_DEG.max(step))
            })
    };
    let missed = (0..scan.beams())
        .filter(|&beam| inside(beam))
        .filter(|&beam| match calibration.beam(beam).map(|b| b.status) {
            None | Some(Status::Direct) => true,
            Some(
                Status::Solved
                | Status::TooFewPoses
                | Status::Unobservable
                | Status::NotConverged
                | Status::Rejected,
            ) => false,
        })
        .count();
    let words = format!(
        "{} deflected by a mirror as drawn, with neither a direction nor a reason",
        elements(missed, "is", "are")
    );
    Gate::at_most("missed", missed as f64, 0.0, words)
}

/// The gates of a score without a truth: how much is stated, and the residuals on boards and walls.
pub(super) fn blind(score: &Score) -> Vec<Gate> {
    let mut gates = vec![shares(
        "covariance",
        "a covariance",
        score.blind_stated,
        score.beams.solved,
    )];
    if score.beams.solved == 0 {
        gates.push(Gate::without("solved", Outcome::Fail, "no element is solved"));
        return gates;
    }
    let limit = median_limit();
    let mut judged = false;
    for (name, residual, normalized, by_mirror) in [
        (
            "boards",
            &score.boards_mm,
            score.boards_normalized,
            &score.boards_by_mirror,
        ),
        (
            "walls",
            &score.walls_mm,
            score.walls_normalized,
            &score.walls_by_mirror,
        ),
    ] {
        if normalized.is_nan() {
            gates.push(Gate::without(
                name,
                Outcome::NotTested,
                format!("no solved element reads {name}"),
            ));
            continue;
        }
        judged = true;
        let words = format!(
            "the points are {:.2} mm (rms) off the {name}, and the median element {:.1} times what noise, drift, markers, biases and covariances allow; {:.1} times is the limit",
            residual.rms,
            normalized.sqrt(),
            limit.sqrt()
        );
        gates.push(Gate::at_most(name, normalized, limit, words).with_rate(SIGNIFICANCE));
        gates.extend(worst_mirror(name, by_mirror));
    }
    if !judged {
        let words = "no solved element reads a board or a wall: there is nothing to judge by";
        gates.push(Gate::without("residuals", Outcome::NotJudged, words));
    }
    gates
}

/// The gate on the mirror with the largest median; one alone is what the gate on all elements judges.
fn worst_mirror(name: &str, mirrors: &[Normalized]) -> Option<Gate> {
    let worst = mirrors
        .iter()
        .max_by(|a, b| a.median.total_cmp(&b.median))
        .filter(|_| mirrors.len() > 1)?;
    let limit = worst_median_limit(mirrors.len());
    let words = format!(
        "on the {name}, the median element of mirror {:?} is {:.1} times off what noise, drift, markers, biases and covariances allow; {:.1} times is the limit for the worst of {} mirrors",
        worst.facet,
        worst.median.sqrt(),
        limit.sqrt(),
        mirrors.len()
    );
    Some(Gate::at_most(&format!("{name}_by_mirror"), worst.median, limit, words).with_rate(SIGNIFICANCE))
}
