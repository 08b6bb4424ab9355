//! Which facets a beam may belong to: as drawn, to within the errors of manufacturing.

use catoptric_model::ScanGeometry;
use catoptric_model::session::NominalFacet;

/// Number of beams beyond the drawn ones that a facet as built may serve.
///
/// At 65 mm a millimeter is 0.9°: an optical center a millimeter off in its housing, a facet half a millimeter and
/// 1° off in its frame, and posts that hide an edge on the drawing add up to several. Being generous costs nothing:
/// a beam that no mirror deflects is known by its readings, not by this.
const EDGE_DEG: f64 = 2.5;

/// The facets whose drawn range of beams is at most [`EDGE_DEG`] away, the nearest first.
pub(super) fn facets_near(scan: &ScanGeometry, facets: &[NominalFacet], beam: usize) -> Vec<usize> {
    let edge = scan.steps_in(EDGE_DEG);
    let mut near: Vec<(usize, usize)> = facets
        .iter()
        .enumerate()
        .map(|(i, f)| (scan.beside(f.beams, beam), i))
        .filter(|(away, _)| *away <= edge)
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
            curve: None,
            beams: [first, last],
        }
    }

    #[test]
    fn an_edge_beam_may_belong_to_either_neighbor() {
        const EDGE_BEAMS: usize = 10;
        let facets = [facet(100, 200), facet(204, 300)];
        let near = |beam| facets_near(&ScanGeometry::default(), &facets, beam);
        assert_eq!(near(150), [0]);
        assert_eq!(near(203), [1, 0]);
        assert_eq!(near(100 - EDGE_BEAMS), [0]);
        assert!(near(99 - EDGE_BEAMS).is_empty());
    }
}
