//! The errors that keep a calibration from starting. An element that cannot be solved is data, not an error.

use catoptric_model::{ModelError, Stopped, Unreadable};

/// A dataset or a request from which no calibration can be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CalibError {
    /// The parts of the dataset are inconsistent.
    #[error(transparent)]
    Dataset(#[from] ModelError),
    /// An impossible number in the session.
    #[error("session: {key} is {found}, needed: {needed}")]
    Session {
        /// Key of the number.
        key: String,
        /// The values allowed.
        needed: &'static str,
        /// The value found.
        found: f64,
    },
    /// A nominal facet whose corners span no plane.
    #[error("session: facet {name:?} needs at least three corners that span a plane, it has {corners}")]
    Facet {
        /// Its name.
        name: String,
        /// Number of its corners.
        corners: usize,
    },
    /// The boards do not characterize the bare sensor.
    #[error("the sensor cannot be characterized: {what}")]
    Characterization {
        /// What is missing.
        what: String,
    },
    /// A facet that is not in the session.
    #[error("no facet is called {name:?}; there are {known}")]
    UnknownFacet {
        /// The name requested.
        name: String,
        /// The names available.
        known: String,
    },
    /// No board can be placed where a facet's beams go.
    #[error("no board pose before facet {facet:?} is possible: {reason}")]
    NoPlace {
        /// The facet.
        facet: String,
        /// The obstacle.
        reason: String,
    },
    /// A third-party calibrator gave no calibration.
    #[error("{name}: {what}")]
    Foreign {
        /// Its name.
        name: String,
        /// What happened.
        what: String,
    },
    /// Readings that the dataset's recording gives no more.
    #[error(transparent)]
    Unreadable(#[from] Unreadable),
    /// The work was stopped on request.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// An unknown name of a method.
    #[error("no method is called {name:?}; there are {known}")]
    UnknownMethod {
        /// The name requested.
        name: String,
        /// The names available.
        known: String,
        /// The name that was probably meant.
        nearest: Option<&'static str>,
    },
}

impl CalibError {
    /// Advice on how to correct the error, if known.
    pub fn help(&self) -> Option<String> {
        match self {
            Self::UnknownMethod { nearest, .. } => nearest.map(|name| format!("did you mean {name:?}?")),
            Self::Dataset(_)
            | Self::Session { .. }
            | Self::Facet { .. }
            | Self::Characterization { .. }
            | Self::UnknownFacet { .. }
            | Self::NoPlace { .. }
            | Self::Foreign { .. }
            | Self::Unreadable(_)
            | Self::Stopped(_) => None,
        }
    }
}
