//! The plane of a facet, as drawn and as estimated from its elements.

use crate::error::CalibError;
use crate::readings::observations::azimuth;
use catoptric_model::session::{NominalFacet, Session};
use catoptric_model::{BeamEstimate, Deflection, MirrorPlane, beam, mirror};
use nalgebra::{Unit, Vector3};

/// Minimum number of solved elements for estimating a facet's plane as built.
const MIN_ELEMENTS: usize = 5;

/// The facet's plane as drawn, in the sensor frame.
pub(crate) fn plane_as_drawn(facet: &NominalFacet) -> Result<MirrorPlane, CalibError> {
    let plane = facet.plane().ok_or_else(|| CalibError::Facet {
        name: facet.name.clone(),
        corners: facet.corners_mm.len(),
    })?;
    Ok(MirrorPlane::through(plane.point, plane.normal))
}

/// The plane of a facet where a beam meets it: that which its drawn curve touches there, or the facet's own.
pub(crate) fn plane_at(facet: &NominalFacet, plane: &MirrorPlane, u: &Unit<Vector3<f64>>) -> MirrorPlane {
    facet.touched(u).unwrap_or(*plane)
}

/// The planes of all facets as estimated from their solved elements, or as drawn if there are too few.
pub(crate) fn as_built(
    session: &Session,
    drawn: &[MirrorPlane],
    solved: &[BeamEstimate],
) -> Vec<MirrorPlane> {
    let facets = session.facets.iter().zip(drawn);
    facets
        .map(|(facet, drawn)| plane_as_built(session, facet, solved).unwrap_or(*drawn))
        .collect()
}

/// The plane that most of a facet's solved elements agree on: medians, which are robust to a few outliers. A mirror that is
/// drawn as not flat has none.
pub(crate) fn plane_as_built(
    session: &Session,
    facet: &NominalFacet,
    solved: &[BeamEstimate],
) -> Option<MirrorPlane> {
    if facet.curve.is_some() {
        return None;
    }
    let mut planes: Vec<MirrorPlane> = Vec::new();
    for estimate in solved.iter().filter(|e| e.facet.as_ref() == Some(&facet.name)) {
        let Some(deflection) = estimate.deflection() else {
            continue;
        };
        planes.extend(plane_between(azimuth(session, estimate.beam), &deflection));
    }
    let median = |value: &dyn Fn(&MirrorPlane) -> f64| {
        let mut values: Vec<f64> = planes.iter().map(value).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied()
    };
    let normal = Vector3::new(
        median(&|p| p.normal.x)?,
        median(&|p| p.normal.y)?,
        median(&|p| p.normal.z)?,
    );
    let plane = MirrorPlane {
        normal: Unit::try_new(normal, f64::MIN_POSITIVE)?,
        offset: median(&|p| p.offset)?,
    };
    (planes.len() >= MIN_ELEMENTS).then_some(plane)
}

/// The plane of a mirror that causes a given deflection.
pub(crate) fn plane_between(azimuth: f64, deflection: &Deflection) -> Option<MirrorPlane> {
    let exit = deflection.exit_direction(azimuth);
    let normal = mirror::normal_between(&beam::direction(azimuth), &exit)?;
    Some(MirrorPlane::through(deflection.deflection_point(azimuth), normal))
}
