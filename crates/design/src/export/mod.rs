//! Files for making and using a layout: solids to cut and print, a scene to view, a table of its drawing, its frames;
//! and a dataset's boards as a table.
//!
//! | format | contents | unit |
//! |---|---|---|
//! | [`stl`](fn@stl) | mirrors as plates, posts, a printable frame: closed, oriented outward, binary | millimeters |
//! | [`glb`](fn@glb) | mirrors, posts, housing and beams in their colors (glTF 2.0) | meters |
//! | [`drawing_table`] | corners, angles and tolerances of every mirror, as CSV | millimeters, degrees |
//! | [`urdf`](fn@urdf) | the scanner and its mirrors in the rig, as links | meters, radians |
//! | [`board_table`] | the readings of every beam on every board of a dataset, as CSV | meters, radians |
//!
//! ```
//! use catoptric_design::{export, layout};
//! use catoptric_sim as sim;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let scene: sim::Scene = toml::from_str(include_str!("../../../../scenes/prototype.toml"))?;
//! let drawing = layout::Drawing::new(&scene, None)?;
//! let solids = export::solids(&scene, &drawing, export::ExportPart::Mirrors);
//! assert_eq!(solids.len(), 8);
//! assert_eq!(export::stl(&solids).len(), 84 + 50 * 8 * 12);
//! # Ok(())
//! # }
//! ```

mod boards;
mod frame;
mod glb;
mod solid;
mod stl;
mod table;
mod urdf;

pub use boards::{BESIDE, board_table, has_rows};
pub use frame::shaded_by_frame;
pub use glb::glb;
pub use solid::Solid;
pub use stl::stl;
pub use table::drawing_table;
pub use urdf::urdf;

use crate::layout::{Drawing, plate_thickness};
use catoptric_sim::Scene;

catoptric_model::closed_set! {
    /// A selection of solids.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum ExportPart {
        /// The mirrors as plates.
        Mirrors,
        /// The scene's posts, and a frame that holds the mirrors.
        Frame,
        /// Both.
        All,
    }
}

impl ExportPart {
    /// The name used in commands.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mirrors => "mirrors",
            Self::Frame => "frame",
            Self::All => "all",
        }
    }

    /// A one-line description.
    pub fn about(self) -> &'static str {
        match self {
            Self::Mirrors => "The mirrors as plates",
            Self::Frame => "The posts and a frame that holds the mirrors",
            Self::All => "Both",
        }
    }
}

/// Returns the selected solids of a layout, each closed, in the sensor frame.
pub fn solids(scene: &Scene, drawing: &Drawing, part: ExportPart) -> Vec<Solid> {
    let thickness = plate_thickness(scene);
    let mut solids = Vec::new();
    if part != ExportPart::Frame {
        solids.extend(drawing.facets.iter().map(|facet| {
            if let Some(bent) = &facet.bent {
                return Solid::shell(&facet.name, bent, thickness);
            }
            let back: Vec<_> = (facet.face.corners.iter())
                .map(|c| c - facet.face.normal.into_inner() * thickness)
                .collect();
            Solid::between(&facet.name, &back, &facet.face.corners)
        }));
    }
    if part != ExportPart::Mirrors {
        let posts = drawing.parts.iter().filter(|p| !p.housing);
        solids.extend(posts.map(|p| Solid {
            name: p.name.clone(),
            triangles: p.skin.clone(),
        }));
        solids.extend(frame::frame(drawing, thickness));
    }
    solids
}
