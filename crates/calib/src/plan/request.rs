//! What is asked of a plan: how many poses, what they are to make small, and the limits of each.

use serde::Serialize;

/// What is to be small over the elements of a facet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Criterion {
    /// Mean log det of the angles' covariance: the area of the error ellipse.
    #[default]
    D,
    /// Mean trace of the angles' covariance: the mean square error.
    A,
}

impl Criterion {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::D, Self::A];

    /// The word that commands use.
    pub fn name(self) -> &'static str {
        match self {
            Self::D => "d",
            Self::A => "a",
        }
    }

    /// What it is, in a line.
    pub fn about(self) -> &'static str {
        match self {
            Self::D => "The area of the error ellipse: mean log det of the covariance",
            Self::A => "The mean square error: mean trace of the covariance",
        }
    }
}

/// What is asked for, and the limits of a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Request {
    /// Poses for each facet.
    pub poses: usize,
    /// What is to be small.
    pub criterion: Criterion,
    /// Where the sequence of candidates begins.
    pub seed: u64,
    /// Least and greatest way from the mirror to the board along the beam it is aimed at, in meters; the room and the
    /// divergence of the beam set limits of their own.
    pub range_m: [f64; 2],
    /// Largest incidence of any beam that the board serves, in degrees.
    pub max_incidence_deg: f64,
    /// Readings of each element at each pose.
    pub readings: usize,
    /// Poses that are tried for each facet; those that are possible are its candidates.
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
