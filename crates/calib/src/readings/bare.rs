//! Checks step 3: the bare structure under a facet is a plane, and a distance off that plane is of another surface.
//!
//! ```text
//! 1/d(θ) = p·cos θ + q·sin θ          a plane's distances along beams from the origin
//! ```
//!
//! Where two facets meet, a beam may have ranged the neighbor's structure, or both at once.

use crate::readings::observations::azimuth;
use catoptric_model::Session;
use catoptric_model::session::NominalFacet;
use nalgebra::{Matrix2, Vector2};

/// Minimum number of beams for checking a facet's plane.
const MIN_BEAMS: usize = 8;

/// Gate on the deviation from the plane, in standard deviations estimated from the median deviation.
const GATE_SIGMAS: f64 = 6.0;

/// Median of |x| of a normal variable, in units of its standard deviation.
const MEDIAN_OF_NORMAL: f64 = 0.6745;

/// Deviation that is always allowed, in meters: rounding.
const ROUNDING: f64 = 1e-9;

/// Maximum number of rounds of fitting the plane to the distances that are on it.
const ROUNDS: usize = 5;

/// Distances to the bare structure, facet by facet.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Bare {
    facets: Vec<(String, Option<Line>)>,
}

/// A plane's distances, and the allowed deviation from it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Line {
    coefficients: Vector2<f64>,
    gate: f64,
}

impl Bare {
    /// Fits the planes of the measured distances.
    pub(crate) fn of(session: &Session) -> Self {
        // Behind a mirror that is not flat there is no plane.
        let line = |facet: &NominalFacet| match facet.curve {
            None => Line::through(&measured(session, facet)),
            Some(_) => None,
        };
        let of_facet = |facet: &NominalFacet| (facet.name.clone(), line(facet));
        Self {
            facets: session.facets.iter().map(of_facet).collect(),
        }
    }

    /// Bare distance of a beam that hits a facet, in meters: as measured, or from its facet's plane if the measured one
    /// is clearly of another surface; `None` if nothing was measured.
    pub(crate) fn distance(&self, session: &Session, facet: &str, beam: usize) -> Option<f64> {
        let measured = session.bare_structure.distance(beam)?;
        let line = self.facets.iter().find(|(name, _)| name == facet)?.1;
        let on_plane = line.and_then(|line| Some((line.distance(azimuth(session, beam))?, line.gate)));
        Some(match on_plane {
            Some((distance, gate)) if (measured - distance).abs() > gate => distance,
            _ => measured,
        })
    }
}

/// Azimuth and distance of every beam of a facet's fan that hit the structure.
fn measured(session: &Session, facet: &NominalFacet) -> Vec<(f64, f64)> {
    let beams = session.scanner.scan.run(facet.beams);
    beams
        .filter_map(|b| Some((azimuth(session, b), session.bare_structure.distance(b)?)))
        .collect()
}

impl Line {
    /// The plane of minimal median deviation among those through two beams half a fan apart, then fitted to all
    /// distances that are on it.
    fn through(measured: &[(f64, f64)]) -> Option<Self> {
        if measured.len() < MIN_BEAMS {
            return None;
        }
        let half = measured.len() / 2;
        let pairs = (0..measured.len() - half).filter_map(|i| fitted([measured[i], measured[i + half]]));
        let mut line = pairs
            .filter_map(|c| Self::judged(c, measured))
            .min_by(|a, b| a.gate.total_cmp(&b.gate))?;
        for _ in 0..ROUNDS {
            let on_it = measured.iter().copied().filter(|m| line.holds(m));
            line = fitted(on_it).and_then(|c| Self::judged(c, measured))?;
        }
        Some(line)
    }

    fn judged(coefficients: Vector2<f64>, measured: &[(f64, f64)]) -> Option<Self> {
        let mut line = Self {
            coefficients,
            gate: 0.0,
        };
        let mut deviations = measured
            .iter()
            .map(|(azimuth, d)| Some((line.distance(*azimuth)? - d).abs()))
            .collect::<Option<Vec<f64>>>()?;
        deviations.sort_by(f64::total_cmp);
        line.gate = ROUNDING + GATE_SIGMAS * deviations[deviations.len() / 2] / MEDIAN_OF_NORMAL;
        Some(line)
    }

    fn distance(&self, azimuth: f64) -> Option<f64> {
        let reciprocal = self.coefficients.dot(&along(azimuth));
        (reciprocal > 0.0).then(|| 1.0 / reciprocal)
    }

    fn holds(&self, (azimuth, measured): &(f64, f64)) -> bool {
        self.distance(*azimuth)
            .is_some_and(|d| (d - measured).abs() <= self.gate)
    }
}

fn along(azimuth: f64) -> Vector2<f64> {
    Vector2::new(libm::cos(azimuth), libm::sin(azimuth))
}

/// Least squares of the distances: an error of d is d² times one of 1/d.
fn fitted(measured: impl IntoIterator<Item = (f64, f64)>) -> Option<Vector2<f64>> {
    let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for (azimuth, distance) in measured {
        let row = along(azimuth) * (distance * distance);
        normal += row * row.transpose();
        right += row * distance;
    }
    Some(normal.try_inverse()? * right)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plane at 60 mm whose normal is at 0.3 rad, seen by 60 beams.
    fn plane() -> Vec<(f64, f64)> {
        (0..60)
            .map(|i| {
                let azimuth = 0.1 + 0.004_36 * f64::from(i);
                (azimuth, 0.06 / libm::cos(azimuth - 0.3))
            })
            .collect()
    }

    #[test]
    fn a_neighbors_structure_is_detected_and_replaced() {
        let good = plane();
        let mut measured = good.clone();
        for seam in &mut measured[..7] {
            seam.1 += 0.002;
        }
        measured[59].1 -= 0.0003;
        let line = Line::through(&measured).expect("most of them are on one plane");
        for (i, (m, g)) in measured.iter().zip(&good).enumerate() {
            assert_eq!(line.holds(m), (7..59).contains(&i), "beam {i}");
            let distance = line.distance(m.0).expect("the plane is ahead");
            assert!((distance - g.1).abs() < 1e-12, "beam {i}: {distance} for {}", g.1);
        }
    }

    #[test]
    fn noise_is_kept_and_few_beams_are_not_judged() {
        // ±0.3 mm alternately: a spread, not a neighbor.
        let mut measured = plane();
        for (i, m) in measured.iter_mut().enumerate() {
            m.1 += if i % 2 == 0 { 3e-4 } else { -3e-4 };
        }
        let line = Line::through(&measured).expect("the distances are on a plane");
        assert!(measured.iter().all(|m| line.holds(m)));
        assert_eq!(Line::through(&measured[..7]), None);
    }
}
