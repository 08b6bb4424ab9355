//! The common start of every procedure: check and correct a dataset, place the sensor in the rig (step 5), and place
//! the boards in the sensor frame (step 6).

use crate::element::attempt::Workspace;
use crate::element::facet_plane::plane_as_drawn;
use crate::error::CalibError;
use crate::mount::pose::{self, Mount};
use crate::options::Options;
use crate::readings::bare::Bare;
use crate::readings::locate;
use crate::readings::observations::BoardInSensor;
use crate::tracking;
use catoptric_model::{Dataset, MirrorPlane, Session, Stop, Summary};
use std::borrow::Cow;

/// The basis of everything else: mounting and boards in the sensor frame.
pub(crate) struct Prepared {
    pub(crate) drawn: Vec<MirrorPlane>,
    pub(crate) summaries: Vec<Vec<Summary>>,
    pub(crate) bare: Bare,
    pub(crate) mount: Mount,
    pub(crate) boards: Vec<Option<BoardInSensor>>,
}

/// Checks a dataset, and corrects or leaves out what cannot be believed, with a sentence for each change.
pub(crate) fn believable(dataset: &Dataset) -> Result<(Cow<'_, Dataset>, Vec<String>), CalibError> {
    dataset.check()?;
    check_session(&dataset.session)?;
    let (repaired, found) = tracking::put_right(dataset);
    Ok((repaired, dataset.warnings.iter().cloned().chain(found).collect()))
}

/// Places the sensor in the rig (steps 5 and 6) from a [`believable`] dataset.
pub(crate) fn prepare(dataset: &Dataset) -> Result<Prepared, CalibError> {
    let session = &dataset.session;
    let drawn = session
        .facets
        .iter()
        .map(plane_as_drawn)
        .collect::<Result<_, _>>()?;
    let summaries = locate::summaries(dataset)?;
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
        options: &'a Options,
        stop: &'a Stop,
    ) -> Workspace<'a> {
        Workspace {
            dataset,
            summaries: &self.summaries,
            bare: &self.bare,
            boards: &self.boards,
            rig_from_sensor: self.mount.rig_from_sensor,
            mount: &self.mount.uncertainty,
            options,
            stop,
            columns: None,
        }
    }
}

/// Checks that the numbers of a session are possible.
pub(crate) fn check_session(session: &Session) -> Result<(), CalibError> {
    let believed = &session.believed;
    let positive = [("scanner.range_max_m", session.scanner.range_max_m)];
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
