//! Export of a layout as files for manufacturing and use, and of a dataset's boards as a table.

use crate::{Error, Scene};
use catoptric_design::export::{self, Part};
use catoptric_design::layout::Drawing;
use catoptric_model::{Dataset, closed_set};

closed_set! {
    /// The format of an exported layout.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum Format {
        /// Closed solids in millimeters, for slicers and CAD: mirrors, a printable frame, or both.
        Stl,
        /// Mirrors, housing and beams for viewing (binary glTF), in meters.
        Glb,
        /// Corners, angles and tolerances of every mirror, as CSV.
        Csv,
        /// Frames of the laser and the mirrors in the rig.
        Urdf,
    }
}

impl Format {
    /// The name used in commands.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stl => "stl",
            Self::Glb => "glb",
            Self::Csv => "csv",
            Self::Urdf => "urdf",
        }
    }

    /// A one-line description.
    pub fn about(self) -> &'static str {
        match self {
            Self::Stl => "Mirrors and a printable frame as closed solids, in millimeters",
            Self::Glb => "Mirrors, housing and beams for viewing (binary glTF), in meters",
            Self::Csv => {
                "Of a scene: corners, angles and tolerances of every mirror; of a dataset: the readings of every beam \
                 on every board"
            }
            Self::Urdf => "Frames of the laser and the mirrors in the rig",
        }
    }
}

/// What to export, where a format leaves a choice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExportOptions {
    /// The solids in an STL.
    pub part: Part,
    /// Length of the outgoing beams of a GLB after their last mirror, in meters.
    pub reach_m: f64,
    /// Seed of the structure as built; the drawing if `None`.
    pub as_built: Option<u64>,
}

impl Default for ExportOptions {
    fn default() -> Self {
        Self {
            part: Part::All,
            reach_m: 1.0,
            as_built: None,
        }
    }
}

/// A layout as a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Exported {
    /// The bytes of the file.
    pub bytes: Vec<u8>,
    /// Number of solids in it, or of mirrors.
    pub parts: usize,
    /// Elements whose view the printed frame blocks.
    pub shaded: Vec<usize>,
}

/// Exports the mirrors of a scene as drawn, or as built under a seed.
///
/// ```
/// use catoptric::{ExportFormat, ExportOptions, Scene, Template, export};
///
/// # fn main() -> Result<(), catoptric::Error> {
/// let scene = Scene::template(Template::Prototype);
/// let urdf = export(&scene, ExportFormat::Urdf, &ExportOptions::default())?;
/// assert_eq!(urdf.parts, 8);
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// [`Error::Setup`] if the scene cannot be set up, [`Error::Invalid`] if the scene has no such solids or the reach is
/// not a positive number.
pub fn export(scene: &Scene, format: Format, options: &ExportOptions) -> Result<Exported, Error> {
    let scene = scene.resolved();
    let &ExportOptions {
        part,
        reach_m,
        as_built,
    } = options;
    if format == Format::Glb && !(reach_m.is_finite() && reach_m > 0.0) {
        let message = format!("the reach of beams must be a positive number, not {reach_m}");
        return Err(Error::invalid(message, None));
    }
    let drawing = Drawing::new(scene, as_built)?;
    let mirrors = drawing.facets.len();
    let (bytes, parts, shaded) = match format {
        Format::Stl => {
            let solids = export::solids(scene, &drawing, part);
            if solids.is_empty() {
                let message = "the scene has no such solids";
                return Err(Error::invalid(message, Some("see --part")));
            }
            let shaded = match part {
                Part::Mirrors => Vec::new(),
                Part::Frame | Part::All => export::shaded_by_frame(scene, as_built)?,
            };
            (export::stl(&solids), solids.len(), shaded)
        }
        Format::Glb => (export::glb(scene, &drawing, reach_m), mirrors, Vec::new()),
        Format::Csv => {
            let table = export::drawing_table(scene, &drawing);
            (table.map_err(unwritten)?, mirrors, Vec::new())
        }
        Format::Urdf => (export::urdf(scene, &drawing).into_bytes(), mirrors, Vec::new()),
    };
    Ok(Exported { bytes, parts, shaded })
}

/// Returns the readings of every beam on every board of a dataset as CSV, and the number of boards.
///
/// # Errors
/// [`Error::Invalid`] if no board was recorded.
pub fn export_boards(dataset: &Dataset) -> Result<(Vec<u8>, usize), Error> {
    let boards = dataset.poses.iter().filter(|p| export::has_rows(p)).count();
    if boards == 0 {
        return Err(Error::invalid(
            "no board was recorded",
            Some("a flight and an empty room have no rows in this table"),
        ));
    }
    Ok((export::board_table(dataset).map_err(unwritten)?, boards))
}

fn unwritten(error: csv::Error) -> Error {
    Error::invalid(format!("the table cannot be written: {error}"), None)
}
