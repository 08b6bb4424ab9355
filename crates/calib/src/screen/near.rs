//! Which facets a beam may belong to: as drawn, to within the errors of manufacturing.

use catoptric_model::session::NominalFacet;

/// Number of beams beyond the drawn ones that a facet as built may serve.
///
/// At 65 mm a millimeter is 3.5 beams: an optical center a millimeter off in its housing, a facet half a millimeter and
/// 1° off in its frame, and posts that hide an edge on the drawing add up to several. A generous number costs nothing,
/// because undeflected beams are recognized by their readings, not by this.
const EDGE_BEAMS: usize = 10;

/// The facets whose drawn range of beams is at most [`EDGE_BEAMS`] away, the nearest first.
pub(super) fn facets_near(facets: &[NominalFacet], beam: usize) -> Vec<usize> {
    let mut near: Vec<(usize, usize)> = facets
        .iter()
        .enumerate()
        .map(|(i, f)| {
            let below = f.beams[0].saturating_sub(beam);
            let above = beam.saturating_sub(f.beams[1]);
            (below.max(above), i)
        })
        .filter(|(away, _)| *away <= EDGE_BEAMS)
        .collect();
    near.sort_unstable();
    near.into_iter().map(|(_, i)| i).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn facet(first: usize, last: usize) -> NominalFacet {
        NominalFacet {
            name: String::new(),
            corners_mm: Vec::new(),
            beams: [first, last],
        }
    }

    #[test]
    fn an_edge_beam_may_belong_to_either_neighbor() {
        let facets = [facet(100, 200), facet(204, 300)];
        assert_eq!(facets_near(&facets, 150), [0]);
        assert_eq!(facets_near(&facets, 203), [1, 0]);
        assert_eq!(facets_near(&facets, 100 - EDGE_BEAMS), [0]);
        assert!(facets_near(&facets, 99 - EDGE_BEAMS).is_empty());
    }
}
