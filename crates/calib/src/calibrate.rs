//! The procedure on one dataset, step by step.

use crate::element::{self, facet_plane};
use crate::error::CalibError;
use crate::joint;
use crate::method::{BATCH, GENERALIZED, Method, Scope};
use crate::options::Options;
use crate::prepare::{believable, prepare};
use crate::screen;
use catoptric_model::session::NominalFacet;
use catoptric_model::{Calibration, Dataset, Stop, calibration};

/// Calibrates a recorded experiment: one entry for every beam of the scanner, in order.
///
/// Every element that is not solved has a reason. The angles refer to the frame `sensor`; `rig_from_sensor` is the
/// estimated mounting, with its covariance.
///
/// # Errors
/// [`CalibError`] if the parts of the dataset are inconsistent or its session holds impossible numbers.
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

/// As [`calibrate`], but can be stopped before it ends.
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
    // Steps 5 and 6: the sensor in the rig, the boards in the sensor frame.
    let prepared = prepare(dataset)?;
    let (mount, drawn) = (&prepared.mount, &prepared.drawn);
    // Step 4: which elements a mirror deflects.
    let candidates = screen::candidates(dataset, &prepared.summaries, mount, &prepared.boards);
    // The drawing decides which boards an element can hit until its neighbors show how the facet was built.
    let work = prepared.workspace(dataset, options, stop);
    let first = element::estimates(&work, &BATCH, &candidates, drawn)?;
    let built = facet_plane::as_built(&dataset.session, drawn, &first);
    let mut calibration = Calibration {
        schema_version: calibration::SCHEMA_VERSION,
        method: method.name().to_owned(),
        frame: "sensor".to_owned(),
        scanner: Some(*dataset.session.scanner.scan.angles()),
        dataset: dataset.id.clone(),
        beams: Vec::new(),
        facets: Vec::new(),
        rig_from_sensor: Some(mount.to_file()),
        bias: None,
        warnings,
        assessment: None,
    };
    // Steps 11 to 13: the angles, and whether to believe them.
    match method.scope() {
        Scope::Drawing => {
            calibration.beams = element::as_drawn(&dataset.session, &prepared.bare, &candidates, drawn);
        }
        Scope::Element(solver) => {
            calibration.beams = element::estimates(&work, solver, &candidates, &built)?;
        }
        Scope::Together(extent) => {
            // Each element is solved separately first, which decides whether its readings are usable and which boards it hits.
            calibration.beams = element::estimates(&work, &GENERALIZED, &candidates, &built)?;
            let mut assigned = joint::assigned(&work, &candidates, &built, &calibration.beams);
            let facets = &dataset.session.facets;
            assigned.retain(|element| facets[element.facet].curve.is_none());
            calibration.warnings.extend(curved(facets));
            joint::together(*extent, &work, mount, &built, &assigned, &mut calibration);
        }
    }
    stop.check()?;
    Ok(calibration)
}

/// A sentence about the facets that are drawn as not flat, if there are any.
fn curved(facets: &[NominalFacet]) -> Option<String> {
    let names: Vec<String> = facets
        .iter()
        .filter(|f| f.curve.is_some())
        .map(|f| format!("{:?}", f.name))
        .collect();
    (!names.is_empty()).then(|| {
        format!(
            "not flat as drawn: {}; their elements share no plane, and each was solved individually",
            names.join(", ")
        )
    })
}
