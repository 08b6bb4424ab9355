//! The whole procedure on one dataset: mounting, screening, and every element in turn.

use crate::bare::Bare;
use crate::element::Workspace;
use crate::error::CalibError;
use crate::joint::{self, Assigned};
use crate::locate;
use crate::observations::{BoardInSensor, azimuth};
use crate::options::{Method, Options};
use crate::pose::{self, Mount};
use crate::screen::{Candidate, Screen};
use crate::solve::BareDistance;
use crate::tracking;
use catoptric_model::session::{NominalFacet, Session};
use catoptric_model::{
    BeamEstimate, Calibration, Dataset, Deflection, MirrorPlane, Status, Stop, Summary, beam, calibration,
    mirror,
};
use nalgebra::{Unit, Vector3};
use rayon::prelude::*;
use std::borrow::Cow;

/// Solved elements from which a facet's plane as built is taken.
const LEAST_ELEMENTS: usize = 5;

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
    calibrate_until(dataset, method, options, &Stop::default())
}

/// As [`calibrate`], unless it is stopped on the way.
///
/// # Errors
/// As [`calibrate`], and [`CalibError::Stopped`].
pub fn calibrate_until(
    dataset: &Dataset,
    method: Method,
    options: &Options,
    stop: &Stop,
) -> Result<Calibration, CalibError> {
    let (dataset, warnings) = believable(dataset)?;
    stop.check()?;
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
    stop.check()?;
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
            stop.check()?;
            let assigned = assigned(&alone, &candidates, &built, &calibration.beams);
            together(&work, mount, &built, assigned, &mut calibration);
        }
        Method::Beam | Method::Recursive | Method::BeamGls | Method::ClosedForm => {
            calibration.beams = estimates(&work, &candidates, &built);
        }
    }
    stop.check()?;
    Ok(calibration)
}

/// What everything else rests on: mounting and boards in the sensor frame.
pub(crate) struct Prepared {
    pub(crate) drawn: Vec<MirrorPlane>,
    summaries: Vec<Vec<Summary>>,
    pub(crate) bare: Bare,
    pub(crate) mount: Mount,
    boards: Vec<Option<BoardInSensor>>,
}

/// Checks a dataset, and puts right or leaves out what cannot be believed of it, with a sentence for each.
pub(crate) fn believable(dataset: &Dataset) -> Result<(Cow<'_, Dataset>, Vec<String>), CalibError> {
    dataset.check()?;
    check_session(&dataset.session)?;
    Ok(tracking::put_right(dataset))
}

/// Places the sensor in the rig (steps 5 and 6) from a [`believable`] dataset.
pub(crate) fn prepare(dataset: &Dataset) -> Result<Prepared, CalibError> {
    let session = &dataset.session;
    let drawn = session
        .facets
        .iter()
        .map(plane_as_drawn)
        .collect::<Result<_, _>>()?;
    let summaries = locate::summaries(dataset);
    let mount = pose::estimate(dataset, &summaries);
    let boards = dataset
        .poses
        .iter()
        .map(|p| BoardInSensor::of(p, session, &mount.rig_from_sensor))
        .collect();
    Ok(Prepared {
        drawn,
        summaries,
        bare: Bare::of(session),
        mount,
        boards,
    })
}

impl Prepared {
    pub(crate) fn workspace<'a>(
        &'a self,
        dataset: &'a Dataset,
        method: Method,
        options: &'a Options,
    ) -> Workspace<'a> {
        Workspace {
            dataset,
            summaries: &self.summaries,
            bare: &self.bare,
            boards: &self.boards,
            rig_from_sensor: self.mount.rig_from_sensor,
            mount: &self.mount.uncertainty,
            method,
            options,
        }
    }
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
        let poses = work.boards_hit(estimate, &facets[facet], &mirrors[facet])?;
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

pub(crate) fn check_session(session: &Session) -> Result<(), CalibError> {
    let believed = &session.believed;
    let positive = [
        ("scanner.beams", session.scanner.beams as f64),
        ("scanner.step_deg", session.scanner.step_deg),
        ("scanner.range_max_m", session.scanner.range_max_m),
    ];
    let not_negative = [
        (
            "scanner.divergence_full_mrad",
            session.scanner.divergence_full_mrad,
        ),
        ("believed.range_noise_sd_mm", believed.range_noise_sd_mm),
        ("believed.drift_sd_mm", believed.drift_sd_mm),
        ("believed.element_sd_mm", believed.element_sd_mm),
        ("believed.marker_sd_mm", believed.marker_sd_mm),
        ("believed.distance_bias_sd_mm", believed.distance_bias_sd_mm),
        ("believed.angle_gain_sd_mm", believed.angle_gain_sd_mm),
        ("believed.color_bias_sd_mm", believed.color_bias_sd_mm),
        (
            "bare_structure.distance_sd_mm",
            session.bare_structure.distance_sd_mm,
        ),
    ];
    let fail = |key: &str, needed, found| {
        Err(CalibError::Session {
            key: key.to_owned(),
            needed,
            found,
        })
    };
    for (key, found) in positive {
        if !(found.is_finite() && found > 0.0) {
            return fail(key, "a positive number", found);
        }
    }
    for (key, found) in not_negative {
        if !(found.is_finite() && found >= 0.0) {
            return fail(key, "a number that is not negative", found);
        }
    }
    Ok(())
}

pub(crate) fn plane_as_drawn(facet: &NominalFacet) -> Result<MirrorPlane, CalibError> {
    let plane = facet.plane().ok_or_else(|| CalibError::Facet {
        name: facet.name.clone(),
        corners: facet.corners_mm.len(),
    })?;
    Ok(MirrorPlane::through(plane.point, plane.normal))
}

/// The plane that most of a facet's solved elements agree on: medians, which a few strays do not move.
pub(crate) fn plane_as_built(
    session: &Session,
    facet: &NominalFacet,
    solved: &[BeamEstimate],
) -> Option<MirrorPlane> {
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
    (planes.len() >= LEAST_ELEMENTS).then_some(plane)
}

/// The plane of a mirror that deflects a beam so.
pub(crate) fn plane_between(azimuth: f64, deflection: &Deflection) -> Option<MirrorPlane> {
    let exit = deflection.exit_direction(azimuth);
    let normal = mirror::normal_between(&beam::direction(azimuth), &exit)?;
    Some(MirrorPlane::through(deflection.deflection_point(azimuth), normal))
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
                .map(|f| work.estimate(beam, &facets[*f], &mirrors[*f]));
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
