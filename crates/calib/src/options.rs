//! Which estimator runs, and how far it iterates.

use crate::error::CalibError;
use std::str::FromStr;

/// How the angles of an element are estimated from its ranges.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Method {
    /// Everything at once: facets, mounting, boards, drifts and biases, beams free to depart from their facet's plane.
    #[default]
    Joint,
    /// One plane per facet, each facet by itself.
    Facet,
    /// Per element, weighted by the covariance of all errors believed in.
    BeamGls,
    /// Batch Gauss–Newton per element, Eqs. (7)–(8): what the paper prints and calls RLS.
    Beam,
    /// Recursive least squares per element, reading after reading: what the paper names.
    Recursive,
    /// Per element without iteration: linear in the exit direction.
    ClosedForm,
    /// The drawing, with nothing measured but d: what calibrating has to improve on.
    Prior,
}

impl Method {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Joint,
        Self::Facet,
        Self::BeamGls,
        Self::Beam,
        Self::Recursive,
        Self::ClosedForm,
        Self::Prior,
    ];

    /// The word that files and commands use.
    ///
    /// ```
    /// use catoptric_calib::Method;
    /// assert_eq!("recursive".parse(), Ok(Method::Recursive));
    /// assert_eq!(Method::Beam.name(), "beam");
    /// ```
    pub fn name(self) -> &'static str {
        match self {
            Self::Joint => "joint",
            Self::Facet => "facet",
            Self::BeamGls => "beam-gls",
            Self::Beam => "beam",
            Self::Recursive => "recursive",
            Self::ClosedForm => "closed-form",
            Self::Prior => "prior",
        }
    }
}

impl FromStr for Method {
    type Err = CalibError;

    fn from_str(name: &str) -> Result<Self, CalibError> {
        Self::ALL
            .into_iter()
            .find(|m| m.name() == name)
            .ok_or_else(|| CalibError::UnknownMethod {
                name: name.to_owned(),
                known: Self::ALL.map(Self::name).join(", "),
            })
    }
}

/// How the derivatives of the range equation are formed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum JacobianForm {
    /// By differentiating Eq. (6).
    #[default]
    Analytic,
    /// By the central differences of Eq. (7), with δ = 10⁻³ rad.
    CentralDifference,
}

/// What a calibration may be told besides the method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Form of the Jacobian H.
    pub jacobian: JacobianForm,
    /// The iteration ends with a step of (θ_a, φ) shorter than this, in radians.
    pub step_tolerance_rad: f64,
    /// Whether `joint` is asked to predict every board from the others as well, for five times the time.
    pub cross_validation: bool,
    /// Steps after which an element counts as not converged.
    pub max_iterations: usize,
}

impl Default for Options {
    /// A step of 10⁻¹³ rad is a few roundings of the range; ten steps are usual, fifty are a failure.
    fn default() -> Self {
        Self {
            jacobian: JacobianForm::default(),
            step_tolerance_rad: 1e-13,
            cross_validation: false,
            max_iterations: 50,
        }
    }
}
