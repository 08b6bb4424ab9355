//! Planning of the board poses to record next: from the drawing of a scene, or for what a dataset lacks.

use crate::{Control, Error, Scene};
use catoptric_calib::CalibError;
use catoptric_calib::plan::{FacetPlan, Plan, Request, SCHEMA_VERSION, Situation, plan_facet_until};
use catoptric_design::plan::{PlanError, completed, situation, with_poses};
use catoptric_files::scene as scenes;
use catoptric_model::Dataset;
use catoptric_model::place::nearest;
use rayon::prelude::*;
use std::path::Path;

/// Starting point of planning: what is known, and how many scans a board pose takes.
#[derive(Debug)]
pub struct PlanStart {
    /// What the experimenter knows.
    pub situation: Situation,
    /// Scans per board pose.
    pub readings: usize,
}

impl PlanStart {
    /// The situation before anything is recorded.
    ///
    /// # Errors
    /// [`Error::Setup`] if the scene cannot be set up, [`Error::Invalid`] if a facet has no plane.
    pub fn of_scene(scene: &Scene) -> Result<Self, Error> {
        let scene = scene.resolved();
        Ok(Self {
            situation: situation(scene).map_err(|error| match error {
                PlanError::Scene(error) => error.into(),
                PlanError::Plan(error) => impossible(&error),
            })?,
            readings: scene.experiment.scans_per_pose as usize,
        })
    }

    /// The situation after the recording of a dataset.
    ///
    /// # Errors
    /// [`Error::Calibration`] if it cannot be calibrated at all.
    pub fn of_dataset(dataset: &Dataset) -> Result<Self, Error> {
        // New poses are assumed to have as many scans as the existing ones: the median is robust to an unusual stretch.
        let mut scans: Vec<usize> = dataset
            .poses
            .iter()
            .filter(|p| p.room_from_board.is_some())
            .map(|p| p.label.scans)
            .collect();
        scans.sort_unstable();
        let median = scans.get(scans.len() / 2).copied();
        Ok(Self {
            situation: Situation::recorded(dataset)?,
            readings: median.unwrap_or(Request::default().readings),
        })
    }

    /// Returns the names of the requested facets in the order of the session; all of them if none is requested.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the most similar name if there is no such facet, or if there are no facets at all.
    pub fn facets(&self, asked: &[String]) -> Result<Vec<String>, Error> {
        let names: Vec<&str> = self
            .situation
            .session()
            .facets
            .iter()
            .map(|f| f.name.as_str())
            .collect();
        if names.is_empty() {
            return Err(Error::invalid("no facet is hit by a beam", None));
        }
        if let Some(unknown) = asked.iter().find(|f| !names.contains(&f.as_str())) {
            let near = nearest(unknown, names.iter().copied());
            return Err(Error::Invalid {
                message: format!(
                    "there is no facet {unknown:?}; the facets are {}",
                    names.join(", ")
                ),
                help: near.map(|near| format!("did you mean --facet {near}?")),
            });
        }
        let wanted = |name: &&str| asked.is_empty() || asked.iter().any(|f| f == name);
        Ok(names.into_iter().filter(wanted).map(str::to_owned).collect())
    }
}

/// Plans the board poses to record next in front of some facets, each facet separately.
///
/// ```
/// use catoptric::calib::plan::Request;
/// use catoptric::{Control, PlanStart, Scene, Template, plan};
///
/// # fn main() -> Result<(), catoptric::Error> {
/// let start = PlanStart::of_scene(&Scene::template(Template::TwoMirror))?;
/// let request = Request { poses: 4, tries: 500, readings: start.readings, ..Request::default() };
/// let plan = plan(&start, &start.facets(&[])?, &request, &Control::default())?;
/// assert_eq!(plan.facets.len(), 2);
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// [`Error::Invalid`] if no pose in front of a facet is possible, [`Error::Stopped`].
pub fn plan(
    start: &PlanStart,
    facets: &[String],
    request: &Request,
    control: &Control,
) -> Result<Plan, Error> {
    control.run(|| {
        let mut planned: Vec<FacetPlan> = Vec::with_capacity(facets.len());
        control.report("planning", 0, facets.len());
        for some in facets.chunks(rayon::current_num_threads()) {
            control.check()?;
            let found: Result<Vec<FacetPlan>, CalibError> = some
                .par_iter()
                .map(|facet| plan_facet_until(&start.situation, facet, request, &control.stop))
                .collect();
            planned.extend(found.map_err(|e| impossible(&e))?);
            control.report("planning", some.len(), facets.len());
        }
        control.check()?;
        Ok(Plan {
            schema_version: SCHEMA_VERSION,
            criterion: request.criterion,
            facets: planned,
        })
    })
}

/// Returns the scene with the planned poses instead of those of its own rules.
///
/// # Errors
/// [`Error::Setup`] if the scene cannot be set up.
pub fn planned_scene(scene: &Scene, plan: &Plan) -> Result<catoptric_sim::Scene, Error> {
    Ok(with_poses(scene.resolved(), plan)?)
}

/// Returns the scene with the poses recorded in a dataset, followed by the planned ones.
pub fn completed_scene(scene: &Scene, dataset: &Dataset, plan: &Plan) -> catoptric_sim::Scene {
    completed(scene.resolved(), dataset, plan)
}

/// Writes a planned scene; if it moves to another folder, its meshes are referred to by their absolute paths.
///
/// # Errors
/// [`Error::File`] if it has no TOML form, a file is there already, or writing fails.
pub fn write_planned(
    planned: catoptric_sim::Scene,
    from: &Path,
    out: impl Into<catoptric_files::Output>,
) -> Result<(), Error> {
    let out = out.into();
    let text = planned_text(planned, from, out.path())?;
    Ok(catoptric_files::write_file(out, text.as_bytes())?)
}

/// The text that [`write_planned`] writes.
///
/// # Errors
/// [`Error::File`] if it has no TOML form.
pub fn planned_text(mut planned: catoptric_sim::Scene, from: &Path, out: &Path) -> Result<String, Error> {
    use catoptric_files::IoError;
    let folder = out.parent().filter(|p| !p.as_os_str().is_empty());
    move_meshes(&mut planned, from, folder.unwrap_or(Path::new(".")))?;
    Ok(scenes::to_toml(&planned).map_err(|e| IoError::content(out, e.to_string()))?)
}

fn move_meshes(scene: &mut catoptric_sim::Scene, from: &Path, to: &Path) -> Result<(), Error> {
    use catoptric_files::IoError;
    let whole = |path: &Path| path.canonicalize().map_err(|e| IoError::read(path, e));
    if scene.mesh_shapes().is_empty() || whole(from)? == whole(to)? {
        return Ok(());
    }
    for mesh in scene.mesh_shapes_mut() {
        mesh.file = whole(&from.join(&mesh.file))?.display().to_string();
    }
    Ok(())
}

fn impossible(error: &CalibError) -> Error {
    if let CalibError::Stopped(stopped) = error {
        return (*stopped).into();
    }
    Error::invalid(
        error.to_string(),
        Some("a wider range of distances, a larger incidence, or one facet at a time"),
    )
}
