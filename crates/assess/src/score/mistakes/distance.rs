//! Distances read in another way: another unit, reference or path, or a constant that all of them share.

use crate::score::mistake::{LEFT, Mistake};
use crate::score::{ElementError, Score};
use catoptric_model::{Dataset, beam, mirror};
use nalgebra::Vector3;

/// Error of d below which no mistake is sought, in millimeters.
const LARGE_MM: f64 = 1.0;

pub(super) fn recognize(score: &Score, scored: &[&ElementError], dataset: &Dataset) -> Option<Mistake> {
    let found = score.distance_mm.rms;
    let with: Vec<&&ElementError> = scored.iter().filter(|e| e.has_distance).collect();
    if !found.is_finite() || found <= LARGE_MM || with.is_empty() {
        return None;
    }
    let scan = &dataset.session.scanner.scan;
    let thickness = dataset.session.bare_structure.mirror_thickness_mm * 1e-3;
    // |m·u|, by which a length along the beam exceeds one along the mirror's normal.
    let facing = |e: &ElementError| {
        let base = scan.azimuth(e.beam);
        let u = beam::direction(base);
        let m = mirror::normal_between(&u, &e.truth.exit_direction(base));
        m.map_or(1.0, |m| m.dot(&u).abs())
    };
    let level = |e: &ElementError| -> f64 {
        let v: Vector3<f64> = e.truth.exit_direction(scan.azimuth(e.beam)).into_inner();
        v.x.hypot(v.y)
    };
    type Correction<'c> = (&'c str, Box<dyn Fn(&ElementError) -> f64 + 'c>);
    let corrections: [Correction<'_>; 11] = [
        ("d in millimeters", Box::new(|e| e.estimate.distance * 1e-3)),
        ("d in centimeters", Box::new(|e| e.estimate.distance * 1e-2)),
        ("d in inches", Box::new(|e| e.estimate.distance * 0.0254)),
        ("d in kilometers", Box::new(|e| e.estimate.distance * 1e3)),
        (
            "d halved, as of a round trip",
            Box::new(|e| e.estimate.distance * 0.5),
        ),
        ("d doubled", Box::new(|e| e.estimate.distance * 2.0)),
        ("d negated", Box::new(|e| -e.estimate.distance)),
        (
            "d taken as the distance to the mirror's plane instead of along the beam",
            Box::new(move |e| e.estimate.distance / facing(e)),
        ),
        (
            "the mirror's thickness along the beam subtracted",
            Box::new(move |e| e.estimate.distance - thickness / facing(e)),
        ),
        (
            "the mirror's thickness along the beam added",
            Box::new(move |e| e.estimate.distance + thickness / facing(e)),
        ),
        (
            "d divided by cos φ",
            Box::new(move |e| e.estimate.distance / level(e).max(f64::EPSILON)),
        ),
    ];
    let rms = |of: &dyn Fn(&ElementError) -> f64| {
        let sum: f64 = with.iter().map(|e| (of(e) - e.truth.distance).powi(2)).sum();
        1e3 * (sum / with.len() as f64).sqrt()
    };
    let mistake = |correction: String, would_be: f64| Mistake {
        correction,
        figure: "distance_mm.rms",
        found,
        would_be,
    };
    let known = corrections
        .iter()
        .map(|(words, of)| mistake((*words).to_owned(), rms(of.as_ref())))
        .filter(|m| m.would_be <= LEFT * found)
        .min_by(|a, b| a.would_be.total_cmp(&b.would_be));
    let sum: f64 = with.iter().map(|e| e.estimate.distance - e.truth.distance).sum();
    let mean = sum / with.len() as f64;
    let constant = mistake(
        format!(
            "{:.1} mm {} all d",
            mean.abs() * 1e3,
            if mean > 0.0 { "subtracted from" } else { "added to" }
        ),
        rms(&|e| e.estimate.distance - mean),
    );
    // A constant fits at least as well as a correction that nearly is one.
    match known {
        Some(known) if known.would_be <= 2.0 * constant.would_be => Some(known),
        Some(known) if constant.would_be > LEFT * found => Some(known),
        Some(_) | None => (constant.would_be <= LEFT * found).then_some(constant),
    }
}
