//! Doubts as sentences.

use super::evidence::{Evidence, Statistic};
use super::halves::Halves;
use super::hypothesis::{Hypothesis, Kind};
use catoptric_model::Session;
use catoptric_model::assessment::{Cause, Doubt};

/// A doubt about the first of some hypotheses, which the others would explain as well.
pub(super) fn doubt(
    session: &Session,
    named: &[&Hypothesis],
    evidence: &Evidence,
    statistic: &Statistic,
) -> Doubt {
    let mut causes: Vec<Cause> = named.iter().map(|h| h.cause).collect();
    causes.dedup();
    let mut phrases: Vec<String> = Vec::new();
    for hypothesis in named {
        let words = phrase(session, hypothesis, evidence);
        if !phrases.contains(&words) {
            phrases.push(words);
        }
    }
    let cannot = if phrases.len() > 1 {
        "; the readings do not determine which"
    } else {
        ""
    };
    Doubt {
        causes,
        poses: named.iter().filter_map(|h| h.pose).collect(),
        statistic: statistic.chi_squared,
        degrees_of_freedom: statistic.freedom,
        message: format!("{}{cannot}", phrases.join(", or ")),
    }
}

/// What is wrong if a hypothesis holds.
fn phrase(session: &Session, hypothesis: &Hypothesis, evidence: &Evidence) -> String {
    let believed = &session.believed;
    let sizes = || evidence.sizes(&hypothesis.columns);
    let largest = || hypothesis.unit_mm * sizes().amax();
    let ratio = match hypothesis.kind {
        Kind::Spread => evidence.spread(&hypothesis.columns).1.sqrt(),
        Kind::Shift => 1.0,
    };
    match hypothesis.cause {
        Cause::Drift => format!(
            "the drift from pose to pose is about {:.2} mm, where the session states {:.2} mm",
            ratio * believed.drift_sd_mm,
            believed.drift_sd_mm
        ),
        Cause::Markers => format!(
            "the boards' markers are off by about {:.2} mm, where the session states {:.2} mm",
            ratio * believed.marker_sd_mm,
            believed.marker_sd_mm
        ),
        Cause::WarmUp => format!(
            "the ranges drift in the course of the recording by about {:.1} mm, as those of a scanner that warms up",
            sizes().sum().abs()
        ),
        Cause::BoardThickness => format!(
            "the boards' faces are about {:.1} mm {} the session says: thickness_mm, or the template of their markers",
            sizes()[0].abs(),
            if sizes()[0] > 0.0 {
                "nearer than"
            } else {
                "behind where"
            }
        ),
        Cause::Glass => format!(
            "the path in the mirrors is longer or shorter than stated, by that in about {:.1} mm of glass",
            largest()
        ),
        Cause::BareDistances => format!(
            "the distances to the bare structure, or mirror_thickness_mm, are off by about {:.1} mm",
            largest()
        ),
        Cause::DistanceBias => {
            "the error over distance, E_r, is not that of step 1: it has another shape".to_owned()
        }
        Cause::AngleBias => {
            "the error over incidence, E_a, is not that of step 1: it has another shape".to_owned()
        }
        Cause::Characterization => {
            "the range errors are farther from those of step 1 than their stated uncertainty".to_owned()
        }
        Cause::Mounting => {
            "the sensor is mounted farther from its drawn pose than the mount tolerance".to_owned()
        }
        Cause::Board => format!(
            "the board of pose {} was not where it was tracked: moved, or its markers are mislabeled",
            hypothesis.pose.unwrap_or_default()
        ),
        Cause::CorrelatedNoise | Cause::NeighborNoise | Cause::Noise => "noise".to_owned(),
    }
}

/// The doubt about noise that is not white.
pub(super) fn correlated(halves: &Halves) -> Doubt {
    Doubt {
        causes: vec![Cause::CorrelatedNoise],
        poses: Vec::new(),
        statistic: halves.statistic.chi_squared,
        degrees_of_freedom: halves.statistic.freedom,
        message: format!(
            "noise is correlated from scan to scan: means of half a stretch differ by {:.1} times what the scatter of \
             readings explains",
            halves.inflation.sqrt()
        ),
    }
}

/// The doubt about noise that neighboring beams share.
pub(super) fn smoothed(halves: &Halves) -> Doubt {
    let statistic = halves.of_neighbors();
    Doubt {
        causes: vec![Cause::NeighborNoise],
        poses: Vec::new(),
        statistic: statistic.chi_squared,
        degrees_of_freedom: statistic.freedom,
        message: format!(
            "noise is correlated from beam to beam ({:.2} between neighbors), as that of a scanner that smooths its \
             readings: what is stated of the means over neighboring beams is too certain",
            halves.neighbors
        ),
    }
}

/// The doubt about residuals that nothing else explains.
pub(super) fn noise(session: &Session, statistic: &Statistic) -> Doubt {
    Doubt {
        causes: vec![Cause::Noise],
        poses: Vec::new(),
        statistic: statistic.chi_squared,
        degrees_of_freedom: statistic.freedom,
        message: format!(
            "single beams are off from pose to pose by {:.2} times what their noise and element_sd_mm = {} explain",
            (statistic.chi_squared / statistic.freedom).sqrt(),
            session.believed.element_sd_mm
        ),
    }
}

/// The doubts, with those about single boards in one.
pub(super) fn merged(doubts: Vec<Doubt>) -> Vec<Doubt> {
    let mut merged: Vec<Doubt> = Vec::new();
    for doubt in doubts {
        let about_board = |d: &Doubt| d.causes == [Cause::Board];
        match merged.iter_mut().find(|d| about_board(d) && about_board(&doubt)) {
            Some(first) => {
                first.poses.extend(&doubt.poses);
                first.poses.sort_unstable();
                let poses: Vec<String> = first.poses.iter().map(usize::to_string).collect();
                first.message = format!(
                    "the boards of poses {} were not where they were tracked: moved, or their markers are mislabeled",
                    poses.join(", ")
                );
            }
            None => merged.push(doubt),
        }
    }
    merged
}
