//! Analysis of a mirror layout: coverage, losses and attainable accuracy, as values or as files.

use crate::{Control, Error, Scene};
use catoptric_design::layout::{self, Analysis, Detail};
#[cfg(feature = "report")]
use catoptric_files::{Content, Output, folder::FolderKind};
use serde::Serialize;

/// Options of the analysis of a layout.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct LayoutOptions {
    /// Analyze the structure as built under the seed instead of the drawing.
    pub as_built: bool,
    /// Seed of the structure as built and of the predicted accuracy; the scene's own by default.
    pub seed: Option<u64>,
    /// Use one ray per beam and predict no accuracy: takes milliseconds.
    pub coarse: bool,
}

/// Analyzes the mirror layout of a scene, without noise: the class of every element, field of regard, margins, sizes, and
/// the accuracy that a calibration with the boards of the scene can attain.
///
/// ```
/// use catoptric::{LayoutOptions, Scene, Template, layout};
///
/// # fn main() -> Result<(), catoptric::Error> {
/// let scene = Scene::template(Template::Prototype);
/// let coarse = LayoutOptions { coarse: true, ..LayoutOptions::default() };
/// assert_eq!(layout(&scene, &coarse)?.facets.len(), 8);
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// [`Error::Setup`] if the scene cannot be set up.
pub fn layout(scene: &Scene, options: &LayoutOptions) -> Result<Analysis, Error> {
    let scene = scene.resolved();
    let seed = options.seed.unwrap_or(scene.seed);
    let detail = if options.coarse {
        Detail::Coarse
    } else {
        Detail::Full
    };
    let mut analysis = layout::analyze(scene, options.as_built.then_some(seed), detail)?;
    if !options.coarse {
        analysis.accuracy = Some(layout::predict(scene, seed));
    }
    Ok(analysis)
}

/// JSON form of several analyses.
#[derive(Serialize)]
struct SideBySide<'a> {
    schema_version: u32,
    layouts: &'a [Analysis],
}

/// Returns analyses as `layout --json` prints them: a single one as an object, several in a list.
///
/// # Errors
/// [`Error::Invalid`] if an analysis has no JSON form.
pub fn layout_json(analyses: &[Analysis]) -> Result<String, Error> {
    let text = match analyses {
        [one] => serde_json::to_string(one),
        several => serde_json::to_string(&SideBySide {
            schema_version: layout::SCHEMA_VERSION,
            layouts: several,
        }),
    };
    text.map(|t| t + "\n")
        .map_err(|e| Error::invalid(e.to_string(), None))
}

/// Names that tell several layouts apart: those of their scenes, with the file where two have the same name, and with
/// their number where that is the same too.
pub fn distinct_names(layouts: &[(&Scene, &Analysis)]) -> Vec<String> {
    let mut names: Vec<String> = layouts.iter().map(|(_, a)| a.name.clone()).collect();
    let repeats = |names: &[String], name: &String| names.iter().filter(|n| *n == name).count() > 1;
    let files: Vec<String> = (names.iter().zip(layouts))
        .map(|(name, (scene, _))| match repeats(&names, name) {
            true => format!("{name} ({})", scene.name()),
            false => name.clone(),
        })
        .collect();
    names.clone_from(&files);
    for (number, name) in names.iter_mut().enumerate() {
        if repeats(&files, name) {
            *name = format!("{name}, no. {}", number + 1);
        }
    }
    names
}

/// File name of the page about layouts.
pub const LAYOUT_PAGE: &str = "report.html";

/// The folder that [`write_layouts`] writes.
#[cfg(feature = "report")]
pub const LAYOUT_FOLDER: FolderKind = FolderKind {
    what: "a layout",
    result: ("layout.json", Content::Layout),
    owns: |name, content| match content {
        Content::Layout => name == "layout.json",
        Content::Page => name == LAYOUT_PAGE,
        Content::Svg => name.ends_with(".svg"),
        Content::Png => name.ends_with("perspective.png"),
        _ => false,
    },
};

/// Writes analyses of layouts as a folder: `layout.json`, the pictures and a page. An earlier one is replaced as a whole.
///
/// # Errors
/// [`Error::Setup`] if a scene cannot be set up, [`Error::File`] if writing fails, [`Error::Stopped`].
#[cfg(feature = "report")]
pub fn write_layouts(
    layouts: &[(&Scene, &Analysis)],
    out: impl Into<Output>,
    control: &Control,
) -> Result<(), Error> {
    use catoptric_report::Drawn;
    let out = out.into();
    let draw = |(scene, analysis): &(&Scene, &Analysis)| {
        control.check()?;
        Ok(Drawn::new(scene.resolved(), analysis)?)
    };
    let drawn: Vec<Drawn> = layouts.iter().map(draw).collect::<Result<_, Error>>()?;
    let names = distinct_names(layouts);
    let drawn: Vec<Drawn> = drawn
        .into_iter()
        .zip(&names)
        .map(|(d, name)| d.named(name))
        .collect();
    control.check()?;
    let analyses: Vec<Analysis> = layouts.iter().map(|(_, analysis)| (*analysis).clone()).collect();
    let json = layout_json(&analyses)?;
    let pictures = catoptric_report::layout_pictures(&drawn);
    control.check()?;
    let page = catoptric_report::layout(&drawn);
    // From here on, everything is written.
    control.check()?;
    let folder = LAYOUT_FOLDER.create(&out)?;
    for (name, bytes) in pictures {
        folder.write(&name, &bytes)?;
    }
    folder.write(LAYOUT_PAGE, page.as_bytes())?;
    folder.write("layout.json", json.as_bytes())?;
    Ok(folder.publish()?)
}
