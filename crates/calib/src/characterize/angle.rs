//! Does the cosine law of Eq. (4) describe the angle test? Answered by a table of incidences added to the law.
//!
//! With the law held fixed, E_a gets a free value at every incidence that was tested. If the law is right, the decrease
//! of χ² is distributed as χ² with (incidences − 2) degrees of freedom.

use super::adjust::Adjustment;
use super::design::{Design, Term, grouped, mean};
use crate::error::CalibError;
use catoptric_model::TestKind;
use catoptric_model::characterization::{Fit, MisfitRow, StretchRow};

/// Incidences closer to each other than this are one node of the table, in degrees.
const SAME_INCIDENCE: f64 = 4.0;

/// Misfit of the law.
pub(super) struct Misfit {
    pub(super) rows: Vec<MisfitRow>,
    pub(super) fit: Fit,
}

/// The misfits of the law; empty without three incidences and a law.
pub(super) fn tabulate(
    design: &Design,
    law: &Adjustment,
    stretches: &[StretchRow],
    adjust: impl Fn(&Design) -> Result<Adjustment, CalibError>,
) -> Result<Option<Misfit>, CalibError> {
    let mut nodes = incidences(stretches);
    if design.is_normal_in_distance() && nodes.first().is_none_or(|(at, _)| *at > 0.0) {
        nodes.insert(0, (0.0, 0));
    }
    if nodes.len() < 3 || !design.terms.contains(&Term::AngleGain) {
        return Ok(None);
    }
    let mut tabulated = Design {
        incidences: nodes.iter().map(|(at, _)| *at).collect(),
        held: design.bias(&law.values).angle,
        ..design.clone()
    };
    tabulated
        .terms
        .retain(|t| !matches!(t, Term::AngleGain | Term::AngleOffset));
    let first = tabulated.terms.len();
    // E_r holds the error at normal incidence: there the table is 0.
    let tied = usize::from(design.is_normal_in_distance());
    tabulated.terms.extend((tied..nodes.len()).map(Term::AngleNode));
    let free = adjust(&tabulated)?;
    let row = |(node, (at, stretches)): (usize, &(f64, usize))| {
        let term = node.checked_sub(tied).map(|k| first + k);
        MisfitRow {
            incidence_deg: *at,
            stretches: *stretches,
            law_mm: tabulated.held.error(libm::cos(at.to_radians())) * 1e3,
            misfit_mm: term.map_or(0.0, |t| free.values[t]),
            sd_mm: term.map_or(0.0, |t| free.covariance[(t, t)].sqrt()),
        }
    };
    Ok(Some(Misfit {
        rows: nodes.iter().enumerate().map(row).collect(),
        fit: Fit {
            chi_squared: (law.fit.chi_squared - free.fit.chi_squared).max(0.0),
            degrees_of_freedom: law.fit.degrees_of_freedom - free.fit.degrees_of_freedom,
        },
    }))
}

/// Incidences of the angle test, whatever the direction of the tilt, each with its number of stretches; those that are
/// nearly face-on count as 0.
fn incidences(stretches: &[StretchRow]) -> Vec<(f64, usize)> {
    let tested = stretches.iter().filter(|s| s.test == Some(TestKind::Angle));
    let all = tested.map(|s| s.incidence_deg.abs()).collect();
    let groups = grouped(all, |_| SAME_INCIDENCE);
    let node = |group: Vec<f64>| {
        let at = mean(&group);
        (if at < SAME_INCIDENCE { 0.0 } else { at }, group.len())
    };
    groups.into_iter().map(node).collect()
}
