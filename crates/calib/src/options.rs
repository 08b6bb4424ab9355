//! Options of a calibration: how far a method iterates, and with which derivatives.

catoptric_model::closed_set! {
    /// How the derivatives of the range equation are formed.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
    pub enum JacobianForm {
        /// By analytic differentiation of Eq. (6).
        #[default]
        Analytic,
        /// By the central differences of Eq. (7), with δ = 10⁻³ rad.
        CentralDifference,
    }
}

impl JacobianForm {
    /// The name used in commands.
    pub fn name(self) -> &'static str {
        match self {
            Self::Analytic => "analytic",
            Self::CentralDifference => "central",
        }
    }

    /// One-line description.
    pub fn about(self) -> &'static str {
        match self {
            Self::Analytic => "By analytic differentiation of Eq. (6)",
            Self::CentralDifference => "By the central differences of Eq. (7)",
        }
    }
}

/// Options of a calibration besides the method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Form of the Jacobian H.
    pub jacobian: JacobianForm,
    /// The iteration ends with a step of (θ_a, φ) shorter than this, in radians.
    pub step_tolerance_rad: f64,
    /// Whether `joint` also predicts every board from the others, which takes five times as long.
    pub cross_validation: bool,
    /// Number of steps after which an element counts as not converged.
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
