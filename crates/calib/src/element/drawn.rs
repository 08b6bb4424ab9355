//! The baseline that a calibration has to improve on: the drawing, with nothing measured but d.

use crate::element::facet_plane::plane_at;
use crate::element::solve::BareDistance;
use crate::readings::bare::Bare;
use crate::readings::observations::azimuth;
use crate::screen::ScreenClass;
use catoptric_model::{BeamEstimate, MirrorPlane, Session, Status, beam};

/// The drawing's angles of every element that a mirror may deflect, without a covariance, because their error is
/// unknown.
pub(crate) fn as_drawn(
    session: &Session,
    bare: &Bare,
    candidates: &[ScreenClass],
    drawn: &[MirrorPlane],
) -> Vec<BeamEstimate> {
    let of_one = |(beam, candidate): (usize, &ScreenClass)| match candidate {
        ScreenClass::Direct(reason) => {
            BeamEstimate::without_angles(beam, Status::Direct, Some(reason.clone()))
        }
        ScreenClass::Rejected(reason) => {
            BeamEstimate::without_angles(beam, Status::Rejected, Some(reason.clone()))
        }
        ScreenClass::Deflected(near) => {
            let found = near.iter().find_map(|f| {
                let u = beam::direction(azimuth(session, beam));
                Some((f, plane_at(&session.facets[*f], &drawn[*f], &u).deflect(u)?))
            });
            let Some((facet, deflection)) = found else {
                let reason = Some("the drawing has no mirror that faces it".to_owned());
                return BeamEstimate::without_angles(beam, Status::Rejected, reason);
            };
            BeamEstimate {
                facet: Some(session.facets[*facet].name.clone()),
                azimuth_rad: Some(deflection.azimuth),
                elevation_rad: Some(deflection.elevation),
                distance_m: Some(bare.distance(session, &session.facets[*facet].name, beam).map_or(
                    deflection.distance,
                    |bare| {
                        let thickness = session.bare_structure.mirror_thickness_mm * 1e-3;
                        let exit = deflection.exit_direction(azimuth(session, beam));
                        BareDistance {
                            distance: bare,
                            thickness,
                        }
                        .to_mirror(azimuth(session, beam), &exit)
                    },
                )),
                ..BeamEstimate::without_angles(beam, Status::Solved, None)
            }
        }
    };
    candidates.iter().enumerate().map(of_one).collect()
}
