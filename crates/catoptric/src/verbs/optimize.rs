//! Search of a scene's parameters for better layouts, and its results as files.

use crate::{Control, Error, Scene};
use catoptric_design::optimize::{LayoutCandidate, Optimum, SearchOptions};
use catoptric_files::parametric::ParametricScene;
#[cfg(feature = "report")]
use catoptric_files::{
    Content, IoError, Output,
    folder::{FolderKind, StagedFolder},
    names::defused,
    scene as scenes,
};

/// Maximum number of layouts of the front that are shown and written.
const SHOWN: usize = 12;

/// Searches those parameters of a scene that have both limits for layouts that are better with respect to some goals.
///
/// Stopping is not an error: the search ends early, sets `interrupted`, and returns what it has found so far.
///
/// # Errors
/// [`Error::Optimize`] if there is no parameter to vary, no goal, or a goal or requirement that no layout has.
pub fn optimize(scene: &Scene, options: &SearchOptions, control: &Control) -> Result<Optimum, Error> {
    let template = parametric(scene)?;
    control.run(|| {
        control.report("searching", 0, options.evaluations);
        Ok(catoptric_design::optimize::optimize(
            &template,
            options,
            &mut |progress| {
                control.report("searching", progress.more, options.evaluations);
                !control.stop.is_requested()
            },
        )?)
    })
}

fn parametric(scene: &Scene) -> Result<ParametricScene, Error> {
    Ok(ParametricScene::of(
        scene.text(),
        scene.name(),
        scene.settings(),
        scene.resolved(),
    )?)
}

/// Returns the front, or a selection of it from one end to the other.
pub fn shown_of_front(found: &Optimum) -> Vec<&LayoutCandidate> {
    let count = found.front.len();
    if count <= SHOWN {
        return found.front.iter().collect();
    }
    (0..SHOWN)
        .map(|k| &found.front[k * (count - 1) / (SHOWN - 1)])
        .collect()
}

/// File name of the page about a search.
pub const OPTIMUM_PAGE: &str = "report.html";
/// File name of the scene of the best layout.
pub const BEST_SCENE: &str = "best.toml";

/// The folder that [`write_optimum`] writes.
#[cfg(feature = "report")]
pub const OPTIMUM_FOLDER: FolderKind = FolderKind {
    what: "the result of a search",
    result: ("optimum.json", Content::Optimum),
    owns: |name, content| match content {
        Content::Optimum => name == "optimum.json",
        Content::Page => name == OPTIMUM_PAGE,
        Content::Svg => name == "front.svg",
        Content::Table(_) => name == "front.csv",
        Content::Scene => name == BEST_SCENE || name.starts_with("front-"),
        Content::Mesh => name.starts_with("meshes/"),
        _ => false,
    },
};

/// Writes the result of a search as a folder: `optimum.json`, the front as a table and a picture, a page, and the best
/// layouts as scenes. An earlier one is replaced as a whole, on request only: its scenes may have been changed.
///
/// # Errors
/// [`Error::File`] if writing fails.
#[cfg(feature = "report")]
pub fn write_optimum(scene: &Scene, found: &Optimum, out: impl Into<Output>) -> Result<(), Error> {
    let template = parametric(scene)?;
    let layouts = before_and_after(&template, found)?;
    let json = serde_json::to_string(found).map_err(|e| Error::invalid(e.to_string(), None))? + "\n";
    let folder = OPTIMUM_FOLDER.create(&out.into())?;
    if let Some(best) = &found.best {
        write_scene(&folder, BEST_SCENE, &template, best)?;
    }
    for (number, candidate) in shown_of_front(found).into_iter().enumerate() {
        let name = format!("front-{:02}.toml", number + 1);
        write_scene(&folder, &name, &template, candidate)?;
    }
    folder.write("front.csv", table(found)?.as_slice())?;
    if let Some(picture) = catoptric_report::front_picture(found) {
        folder.write("front.svg", picture.as_bytes())?;
    }
    folder.write(
        OPTIMUM_PAGE,
        catoptric_report::optimum(found, layouts.as_ref()).as_bytes(),
    )?;
    folder.write("optimum.json", json.as_bytes())?;
    Ok(folder.publish()?)
}

/// The layout as drawn and the best one, to be drawn; `None` if there is none, or if it is the drawing.
#[cfg(feature = "report")]
fn before_and_after(
    template: &ParametricScene,
    found: &Optimum,
) -> Result<Option<[catoptric_report::Drawn; 2]>, Error> {
    use catoptric_design::layout::{Detail, analyze};
    let Some(best) = found.best.as_ref().filter(|b| b.number != found.start.number) else {
        return Ok(None);
    };
    // It has been evaluated, so it is a valid scene.
    let Ok(after) = template.with(&best.choice()) else {
        return Ok(None);
    };
    let draw = |scene: &catoptric_sim::Scene, name: &str| -> Result<catoptric_report::Drawn, Error> {
        let analysis = analyze(scene, None, Detail::Full)?;
        Ok(catoptric_report::Drawn::new(scene, &analysis)?.named(name))
    };
    Ok(Some([draw(template.scene(), "as drawn")?, draw(&after, "best")?]))
}

/// Writes a layout as a scene, along with the meshes it refers to, which scenes share.
#[cfg(feature = "report")]
fn write_scene(
    folder: &StagedFolder,
    name: &str,
    template: &ParametricScene,
    candidate: &LayoutCandidate,
) -> Result<(), Error> {
    let path = folder.shown(name);
    let choice = candidate.choice();
    let refused = |problems: Vec<String>| IoError::content(&path, problems.join("; "));
    let found = template.with(&choice).map_err(refused)?;
    let (kept, meshes) = scenes::kept(&found);
    for (mesh, bytes) in meshes {
        if !folder.has(&mesh) {
            folder.write(&mesh, &bytes)?;
        }
    }
    let text = template
        .text_with(&choice, &kept)
        .ok_or_else(|| refused(vec!["a number that TOML cannot hold".to_owned()]))?;
    let goals: Vec<String> = candidate
        .goals
        .iter()
        .map(|(name, value)| format!("{name} {value:.6}"))
        .collect();
    let text = format!(
        "# Found by catoptric optimize in {}: {}.\n{text}",
        template.name(),
        goals.join(", ")
    );
    Ok(folder.write(name, text.as_bytes())?)
}

/// Returns the whole front as CSV.
#[cfg(feature = "report")]
fn table(found: &Optimum) -> Result<Vec<u8>, Error> {
    let failed = |e: csv::Error| Error::invalid(format!("the front cannot be written: {e}"), None);
    let mut writer = csv::Writer::from_writer(Vec::new());
    let goals = || found.goals.iter().map(|g| g.name.clone());
    let parameters = || found.parameters.iter().map(|p| p.name.clone());
    let heading: Vec<String> = std::iter::once("number".to_owned())
        .chain(goals())
        .chain(parameters())
        .map(|name| defused(&name).into_owned())
        .collect();
    writer.write_record(heading).map_err(failed)?;
    for candidate in &found.front {
        let values = goals().map(|g| candidate.goals.get(&g).copied());
        let values = values.chain(parameters().map(|p| candidate.parameters.get(&p).copied()));
        let values = values.map(|v| v.map_or_else(String::new, |v| v.to_string()));
        let row: Vec<String> = std::iter::once(candidate.number.to_string())
            .chain(values)
            .collect();
        writer.write_record(row).map_err(failed)?;
    }
    writer
        .into_inner()
        .map_err(|e| Error::invalid(format!("the front cannot be written: {e}"), None))
}
