//! Whether facets are large enough for the spot of a beam.

use super::outline::{Meets, Obstacles};
use crate::findings::Findings;
use crate::light::footprint::{self, SubRay};
use crate::scene::Scene;
use catoptric_model::place::KeyPath;
use catoptric_model::{ScanGeometry, beam};

/// Three standard deviations, in units of the 1/e² half-axes: what lies beyond is negligible.
const REACH: f64 = 1.5;

/// Points of that contour that have to be on a facet.
const AROUND: usize = 24;

/// Warns of facets on which no beam is whole, of those that some beam reaches.
pub(super) fn warn(
    scene: &Scene,
    scan: &ScanGeometry,
    obstacles: &Obstacles,
    met: &[Option<Meets>],
    found: &mut Findings,
) {
    let shape = scene.scanner.beam_shape();
    let contour: Vec<SubRay> = (0..AROUND)
        .map(|k| {
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * k as f64 / AROUND as f64);
            SubRay {
                wide: REACH * cos,
                narrow: REACH * sin,
                weight: 0.0,
            }
        })
        .collect();
    for (i, face) in obstacles.facets.iter().enumerate() {
        let Some(face) = face else { continue };
        let on_it: Vec<usize> = (0..met.len())
            .filter(|b| met[*b] == Some(Meets::Facet(i)))
            .collect();
        let holds = |b: &usize| {
            let azimuth = scan.azimuth(*b);
            contour
                .iter()
                .all(|s| face.holds(&footprint::ray(&shape, azimuth, s)))
        };
        if on_it.is_empty() || on_it.iter().any(holds) {
            continue;
        }
        let middle = on_it[on_it.len() / 2];
        let distance = face
            .distance(&beam::direction(scan.azimuth(middle)))
            .unwrap_or_default();
        let size = |aperture_mm: f64, full_mrad: f64| REACH * (aperture_mm + full_mrad * distance);
        found.add(
            &KeyPath::of("superstructure").key("facet").index(i),
            format_args!(
                "has no whole beam: out to three standard deviations, the spot is {:.1} × {:.1} mm there, before it \
                 falls on the mirror at a slope",
                size(shape.wide_aperture_mm, shape.wide_full_mrad),
                size(shape.narrow_aperture_mm, shape.narrow_full_mrad),
            ),
            "enlarge the facet, or move it to where the spot lies along it: the ellipse turns with the azimuth".to_owned(),
        );
    }
}
