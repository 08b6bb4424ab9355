//! What can keep a calibration from starting. An element that cannot be solved is data, not an error.

use catoptric_model::{ModelError, Stopped, Unreadable};

/// A dataset or a request that no calibration can be made from.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CalibError {
    /// The dataset's parts do not fit together.
    #[error(transparent)]
    Dataset(#[from] ModelError),
    /// A number of the session that cannot be what it is said to be.
    #[error("session: {key} is {found}, needed: {needed}")]
    Session {
        /// Which number.
        key: String,
        /// What it has to be.
        needed: &'static str,
        /// What it is.
        found: f64,
    },
    /// A nominal facet whose corners span no plane.
    #[error("session: facet {name:?} needs at least three corners that span a plane, it has {corners}")]
    Facet {
        /// Its name.
        name: String,
        /// How many corners it has.
        corners: usize,
    },
    /// Boards that tell nothing of the bare sensor.
    #[error("the sensor cannot be characterized: {what}")]
    Characterization {
        /// What is missing.
        what: String,
    },
    /// A facet that the session does not hold.
    #[error("no facet is called {name:?}; there are {known}")]
    UnknownFacet {
        /// The name asked for.
        name: String,
        /// The names there are.
        known: String,
    },
    /// No board can stand where a facet's beams go.
    #[error("no board pose before facet {facet:?} is possible: {reason}")]
    NoPlace {
        /// The facet.
        facet: String,
        /// What is in the way.
        reason: String,
    },
    /// A calibrator that is not ours and gave no calibration.
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
    /// A name that is no method's.
    #[error("no method is called {name:?}; there are {known}")]
    UnknownMethod {
        /// The name asked for.
        name: String,
        /// The names there are.
        known: String,
        /// The one that was probably meant.
        nearest: Option<&'static str>,
    },
}

impl CalibError {
    /// What to do about it, where that is known.
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
