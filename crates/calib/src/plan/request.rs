//! A request for a plan: how many poses, the criterion to minimize, and the limits of each pose.

use serde::Serialize;

catoptric_model::closed_set! {
    /// The quantity to minimize over the elements of a facet.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Criterion {
        /// Mean log det of the angles' covariance: the area of the error ellipse.
        #[default]
        D,
        /// Mean trace of the angles' covariance: the mean square error.
        A,
    }
}

impl Criterion {
    /// The name used in commands.
    pub fn name(self) -> &'static str {
        match self {
            Self::D => "d",
            Self::A => "a",
        }
    }

    /// One-line description.
    pub fn about(self) -> &'static str {
        match self {
            Self::D => "The area of the error ellipse: mean log det of the covariance",
            Self::A => "The mean square error: mean trace of the covariance",
        }
    }
}

/// The number of poses, the criterion, and the limits of a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Request {
    /// Number of poses for each facet.
    pub poses: usize,
    /// The criterion to minimize.
    pub criterion: Criterion,
    /// Start of the sequence of candidates.
    pub seed: u64,
    /// Minimum and maximum distance from the mirror to the board along the beam it is aimed at, in meters; the room and
    /// the divergence of the beam set further limits.
    pub range_m: [f64; 2],
    /// Largest incidence of any beam that the board serves, in degrees.
    pub max_incidence_deg: f64,
    /// Number of readings of each element at each pose.
    pub readings: usize,
    /// Number of poses tried for each facet; the possible ones are its candidates.
    pub tries: usize,
}

impl Default for Request {
    fn default() -> Self {
        Self {
            poses: 5,
            criterion: Criterion::default(),
            seed: 1,
            range_m: [0.5, 4.0],
            max_incidence_deg: 60.0,
            readings: 100,
            tries: 5000,
        }
    }
}
