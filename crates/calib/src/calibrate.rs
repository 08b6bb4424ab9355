//! The whole procedure on one dataset: mounting, screening, and every element in turn.

use crate::attempt::Workspace;
use crate::bare::Bare;
use crate::choose;
use crate::element;
use crate::error::CalibError;
use crate::facet_plane::plane_as_built;
use crate::joint::{self, Assigned};
use crate::observations::azimuth;
use crate::options::{Method, Options};
use crate::pose::Mount;
use crate::prepare::{believable, prepare};
use crate::screen::{Candidate, Screen};
use crate::solve::BareDistance;
use catoptric_model::{BeamEstimate, Calibration, Dataset, MirrorPlane, Session, Status, beam, calibration};
use rayon::prelude::*;

/// Calibrates a recorded experiment: one entry for every beam of the scanner, in order.
///
/// Every element that is not solved says why. The angles are those of the frame `sensor`; `rig_from_sensor` is the
/// mounting as estimated, with its covariance.
///
/// # Errors
/// [`CalibError`] if the dataset's parts do not fit together or its session holds impossible numbers.
///
/// ```
/// use catoptric_calib::{CalibError, Method, Options, calibrate};
/// use catoptric_model::{Dataset, Status};
///
/// fn solved(dataset: &Dataset) -> Result<usize, CalibError> {
///     let calibration = calibrate(dataset, Method::Beam, &Options::default())?;
///     Ok(calibration.beams.iter().filter(|b| b.status == Status::Solved).count())
/// }
/// ```
pub fn calibrate(dataset: &Dataset, method: Method, options: &Options) -> Result<Calibration, CalibError> {
    let (dataset, warnings) = believable(dataset)?;
    let dataset = dataset.as_ref();
    let session = &dataset.session;
    let prepared = prepare(dataset)?;
    let (mount, drawn) = (&prepared.mount, &prepared.drawn);
    let screen = Screen::new(dataset, &prepared.summaries, mount, &prepared.boards);
    let beams = (0..session.scanner.beams).into_par_iter();
    let candidates: Vec<Candidate> = beams.map(|b| screen.classify(b)).collect();
    let work = prepared.workspace(dataset, method, options);
    // The drawing decides which boards an element can hit only until its neighbors tell how the facet was built.
    let by_batch = Workspace {
        method: Method::Beam,
        ..work
    };
    let first = estimates(&by_batch, &candidates, drawn);
    let built: Vec<MirrorPlane> = session
        .facets
        .iter()
        .zip(drawn)
        .map(|(facet, drawn)| plane_as_built(session, facet, &first).unwrap_or(*drawn))
        .collect();
    let mut calibration = Calibration {
        schema_version: calibration::SCHEMA_VERSION,
        method: method.name().to_owned(),
        frame: "sensor".to_owned(),
        beams: Vec::new(),
        facets: Vec::new(),
        rig_from_sensor: Some(mount.to_file()),
        bias: None,
        warnings,
        assessment: None,
    };
    match method {
        Method::Prior => calibration.beams = as_drawn(session, &prepared.bare, &candidates, drawn),
        Method::Joint | Method::Facet => {
            // An element by itself decides whether its readings are of use, and which boards it hits.
            let alone = Workspace {
                method: Method::BeamGls,
                ..work
            };
            calibration.beams = estimates(&alone, &candidates, &built);
            let assigned = assigned(&alone, &candidates, &built, &calibration.beams);
            together(&work, mount, &built, assigned, &mut calibration);
        }
        Method::Beam | Method::Recursive | Method::BeamGls | Method::ClosedForm => {
            calibration.beams = estimates(&work, &candidates, &built);
        }
    }
    Ok(calibration)
}

/// Elements with boards to be solved together: those solved by themselves, and those that only lacked boards.
fn assigned(
    work: &Workspace,
    candidates: &[Candidate],
    mirrors: &[MirrorPlane],
    alone: &[BeamEstimate],
) -> Vec<Assigned> {
    let facets = &work.dataset.session.facets;
    let of_one = |(candidate, estimate): (&Candidate, &BeamEstimate)| {
        let Candidate::Deflected(near) = candidate else {
            return None;
        };
        let facet = match estimate.status {
            Status::Solved => facets
                .iter()
                .position(|f| Some(&f.name) == estimate.facet.as_ref()),
            Status::TooFewPoses | Status::Unobservable => near.first().copied(),
            Status::Direct | Status::NotConverged | Status::Rejected => None,
        }?;
        let poses = choose::boards_hit(work, estimate, &facets[facet], &mirrors[facet])?;
        (!poses.is_empty()).then_some(Assigned {
            beam: estimate.beam,
            facet,
            poses,
        })
    };
    candidates.par_iter().zip(alone).filter_map(of_one).collect()
}

/// Replaces what elements found by themselves with what they find together.
fn together(
    work: &Workspace,
    mount: &Mount,
    mirrors: &[MirrorPlane],
    assigned: Vec<Assigned>,
    calibration: &mut Calibration,
) {
    match joint::calibrate(work, mount, mirrors, assigned) {
        Ok(outcome) => {
            for (beam, estimate) in outcome.beams {
                calibration.beams[beam] = estimate;
            }
            calibration.facets = outcome.facets;
            calibration.rig_from_sensor = outcome.mount.or(calibration.rig_from_sensor);
            calibration.bias = outcome.bias;
            calibration.assessment = outcome.assessment;
        }
        Err(problem) => calibration.warnings.push(format!(
            "the elements could not be solved together ({problem}); each was solved by itself"
        )),
    }
}

/// What the drawing says of every element that a mirror may deflect; nobody knows how far it is off.
fn as_drawn(
    session: &Session,
    bare: &Bare,
    candidates: &[Candidate],
    drawn: &[MirrorPlane],
) -> Vec<BeamEstimate> {
    let of_one = |(beam, candidate): (usize, &Candidate)| match candidate {
        Candidate::Direct(reason) => BeamEstimate::without_angles(beam, Status::Direct, Some(reason.clone())),
        Candidate::Rejected(reason) => {
            BeamEstimate::without_angles(beam, Status::Rejected, Some(reason.clone()))
        }
        Candidate::Deflected(near) => {
            let found = near
                .iter()
                .find_map(|f| Some((f, drawn[*f].deflect(beam::direction(azimuth(session, beam)))?)));
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

/// The estimate of every element, with facets at the given planes.
fn estimates(work: &Workspace, candidates: &[Candidate], mirrors: &[MirrorPlane]) -> Vec<BeamEstimate> {
    let facets = &work.dataset.session.facets;
    let of_one = |(beam, candidate): (usize, &Candidate)| match candidate {
        Candidate::Direct(reason) => BeamEstimate::without_angles(beam, Status::Direct, Some(reason.clone())),
        Candidate::Rejected(reason) => {
            BeamEstimate::without_angles(beam, Status::Rejected, Some(reason.clone()))
        }
        Candidate::Deflected(near) => {
            let mut tried = near
                .iter()
                .map(|f| element::estimate(work, beam, &facets[*f], &mirrors[*f]));
            let nearest = tried.next();
            match nearest {
                Some(solved) if solved.status == Status::Solved => solved,
                // At the seam of two facets the neighbor may be the one that was met.
                other => tried
                    .find(|e| e.status == Status::Solved)
                    .or(other)
                    .unwrap_or_else(|| {
                        let reason = "no facet is near it".to_owned();
                        BeamEstimate::without_angles(beam, Status::Rejected, Some(reason))
                    }),
            }
        }
    };
    candidates.par_iter().enumerate().map(of_one).collect()
}
