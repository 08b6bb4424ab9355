//! The minimum covariance of any estimate under the given beliefs: the limit of one experiment.
//!
//! The joint problem is linearized at the true directions, with facets as far from flat as they truly are. Its
//! parameters have priors, so this is the Bayesian (van Trees) form of the Cramér–Rao bound. For one element alone see
//! [`crate::covariance::Budget::bound`].

use super::assemble::{Assigned, along, begin, components, direct_group, group, mounting_as_drawn};
use super::fan::{FIGURE_RMS, Flatness, orders};
use super::group::{FIGURE, FIGURE_ORDERS};
use crate::element::choose;
use crate::element::facet_plane::plane_between;
use crate::error::CalibError;
use crate::judge::levers::libm_cos;
use crate::lsq;
use crate::options::Options;
use crate::prepare::{believable, prepare};
use crate::readings::observations::azimuth;
use catoptric_model::{Dataset, Deflection, MirrorPlane, Stop, frame};
use nalgebra::{DMatrix, DVector, Matrix2, Unit, Vector3};
use std::collections::BTreeMap;

/// A beam's true direction and the name of its facet.
#[derive(Debug, Clone, PartialEq)]
pub struct TrueDirection {
    /// The beam.
    pub beam: usize,
    /// Its facet.
    pub facet: String,
    /// θ_a, φ and d.
    pub deflection: Deflection,
}

/// Lower bound of the covariance of (θ_a, φ) of each of these beams, in rad², for any estimate from this dataset's
/// boards; `None` if the boards leave a direction open.
///
/// Of the readings only their number and spread are used.
///
/// # Errors
/// As [`crate::calibrate`].
pub fn limit(
    dataset: &Dataset,
    truth: &[TrueDirection],
) -> Result<BTreeMap<usize, Option<Matrix2<f64>>>, CalibError> {
    let (dataset, _) = believable(dataset)?;
    let dataset = dataset.as_ref();
    let prepared = prepare(dataset)?;
    let (options, stop) = (Options::default(), Stop::default());
    let work = prepared.workspace(dataset, &options, &stop);
    let session = &dataset.session;
    let mut planes = prepared.drawn.clone();
    let mut flat = Vec::new();
    let mut assigned = Vec::new();
    for (index, facet) in session.facets.iter().enumerate() {
        let of_facet: Vec<&TrueDirection> = truth.iter().filter(|t| t.facet == facet.name).collect();
        let built: Vec<MirrorPlane> = of_facet
            .iter()
            .filter_map(|t| plane_between(azimuth(session, t.beam), &t.deflection))
            .collect();
        let Some(mean) = mean(&built) else { continue };
        planes[index] = mean;
        let places = of_facet
            .iter()
            .map(|t| along(&session.scanner.scan, facet.beams, t.beam))
            .collect::<Vec<_>>();
        flat.push(flatness(&mean, &built, &places));
        for t in of_facet {
            if let Some(poses) = choose::boards_at(&work, t.beam, facet, &mean, &t.deflection)
                && !poses.is_empty()
            {
                assigned.push(Assigned {
                    beam: t.beam,
                    facet: index,
                    poses,
                });
            }
        }
    }
    let mut groups = Vec::new();
    for facets in components(session.facets.len(), &assigned) {
        let some: Vec<&Assigned> = assigned.iter().filter(|a| facets.contains(&a.facet)).collect();
        groups.push(group(&work, &facets, &some));
    }
    groups.extend(
        prepared
            .mount
            .selection
            .iter()
            .filter_map(|b| direct_group(&work, b)),
    );
    let (mounting, prior) = mounting_as_drawn(&work, &prepared.mount);
    let (mut joint, state) = begin(&work, groups, mounting, &prior, &planes);
    let of_all = |part: fn(&Flatness) -> f64| {
        (flat.iter().map(|f| part(f).powi(2)).sum::<f64>() / flat.len().max(1) as f64).sqrt()
    };
    joint.flatness = Flatness {
        figure: of_all(|f| f.figure),
        tau: of_all(|f| f.tau),
    };
    let linear =
        lsq::linearize(&joint.with_priors(&joint), &state).map_err(|problem| CalibError::Foreign {
            name: "limit".to_owned(),
            what: problem.to_string(),
        })?;
    Ok(joint
        .covariances(&state, &linear.information)
        .into_iter()
        .map(|(beam, elevation, tangent)| {
            let cos = libm_cos(elevation);
            let scale = Matrix2::new(1.0 / cos, 0.0, 0.0, 1.0);
            (beam, tangent.map(|c| scale * c * scale))
        })
        .collect())
}

/// Mean plane of several.
fn mean(planes: &[MirrorPlane]) -> Option<MirrorPlane> {
    let normal: Vector3<f64> = planes.iter().map(|p| p.normal.into_inner()).sum();
    Some(MirrorPlane {
        normal: Unit::try_new(normal, f64::MIN_POSITIVE)?,
        offset: planes.iter().map(|p| p.offset).sum::<f64>() / planes.len() as f64,
    })
}

/// Deviation of normals from their mean: along a polynomial, and from that polynomial.
fn flatness(mean: &MirrorPlane, planes: &[MirrorPlane], places: &[f64]) -> Flatness {
    let (a, b) = frame::tangent_basis(&mean.normal);
    let tilts = |axis: &Unit<Vector3<f64>>| {
        DVector::from_iterator(planes.len(), planes.iter().map(|p| axis.dot(&p.normal)))
    };
    let count = planes.len().max(1) as f64;
    let mut figure = 0.0;
    let mut rest = 0.0;
    let base = DMatrix::from_fn(places.len(), FIGURE_ORDERS + 1, |i, j| {
        if j == 0 { 1.0 } else { orders(places[i])[j - 1] }
    });
    for tilt in [tilts(&a), tilts(&b)] {
        let fitted = if planes.len() > 2 * FIGURE {
            base.clone()
                .svd(true, true)
                .solve(&tilt, 1e-9)
                .map_or_else(|_| DVector::zeros(planes.len()), |c| &base * c)
        } else {
            DVector::zeros(planes.len())
        };
        figure += fitted.norm_squared() / count;
        rest += (tilt - fitted).norm_squared() / count;
    }
    // Along each of two axes; a mirror turns a beam by twice its own tilt.
    Flatness {
        figure: (0.5 * figure).sqrt() / FIGURE_RMS,
        tau: 2.0 * (0.5 * rest).sqrt(),
    }
}
