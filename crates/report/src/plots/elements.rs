//! The elements of a calibration as plots and tables show them: direction, mirror, color, azimuth.

use super::super::figure;
use catoptric_model::session::NominalFacet;
use catoptric_model::{BeamEstimate, Calibration, Dataset, Deflection};
use plotters::style::{BLACK, RGBColor};

/// An element with a direction.
pub(super) struct Solved<'a> {
    pub(super) estimate: &'a BeamEstimate,
    pub(super) deflection: Deflection,
    pub(super) facet: Option<usize>,
}

/// Returns the elements that have a direction.
pub(super) fn solved<'a>(dataset: &Dataset, calibration: &'a Calibration) -> Vec<Solved<'a>> {
    let with = |estimate: &'a BeamEstimate| {
        let deflection = estimate.deflection()?;
        Some(Solved {
            estimate,
            deflection,
            facet: facet_of(dataset, estimate),
        })
    };
    calibration.beams.iter().filter_map(with).collect()
}

/// Returns the color of an element by its facet; black without one.
pub(super) fn color_of(facet: Option<usize>) -> RGBColor {
    facet.map_or(BLACK, figure::color)
}

/// Returns the colors and names of the facets.
pub(super) fn legend(dataset: &Dataset) -> Vec<(String, String)> {
    let entry = |(i, f): (usize, &NominalFacet)| (figure::css(figure::color(i)), f.name.clone());
    dataset.session.facets.iter().enumerate().map(entry).collect()
}

/// Azimuth at which the scanner sends a beam out, in degrees.
pub(super) fn azimuth_deg(dataset: &Dataset, beam: usize) -> f64 {
    dataset.session.scanner.scan.azimuth(beam).to_degrees()
}

/// Returns the name of a facet by its number; a dash without one.
pub(super) fn facet_name(dataset: &Dataset, facet: Option<usize>) -> String {
    facet.map_or_else(|| "–".to_owned(), |i| dataset.session.facets[i].name.clone())
}

/// Returns the number of an element's facet in the session: as in the calibration, else as drawn.
pub(super) fn facet_of(dataset: &Dataset, estimate: &BeamEstimate) -> Option<usize> {
    let facets = &dataset.session.facets;
    match &estimate.facet {
        Some(name) => facets.iter().position(|f| &f.name == name),
        None => facets
            .iter()
            .position(|f| dataset.session.scanner.scan.holds(f.beams, estimate.beam)),
    }
}
