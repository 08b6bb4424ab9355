//! The methods, one file each: what a method needs, how it solves, which covariance it states, and its description.
//!
//! To add a method, write its file with its [`Row`] and add a row to the table below.

mod beam;
mod beam_gls;
mod closed_form;
mod facet;
mod joint;
mod prior;
mod recursive;
mod row;

pub(crate) use beam::BATCH;
pub(crate) use beam_gls::GENERALIZED;
pub(crate) use row::Scope;

use crate::error::CalibError;
use crate::joint::Extent;
use catoptric_model::place::nearest;
use row::Row;
use std::str::FromStr;

/// Defines the enum, the list of all methods and the mapping from a method to its row from one table, so that they
/// cannot diverge.
macro_rules! table {
    ($($(#[$doc:meta])* $method:ident => $row:path,)+) => {
        /// How the angles of the elements are estimated from their ranges.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
        pub enum Method {
            $($(#[$doc])* $method,)+
        }

        impl Method {
            /// All methods.
            pub const ALL: [Self; [$(Self::$method),+].len()] = [$(Self::$method),+];

            const fn row(self) -> &'static Row {
                match self {
                    $(Self::$method => &$row,)+
                }
            }
        }
    };
}

table! {
    /// Everything at once: facets, mounting, boards, drifts and biases; beams may deviate from their facet's plane.
    #[default]
    Joint => joint::ROW,
    /// One plane per facet, each facet separately.
    Facet => facet::ROW,
    /// Per element, weighted by the covariance of all believed errors.
    BeamGls => beam_gls::ROW,
    /// Batch Gauss–Newton per element, Eqs. (7)–(8), which the paper prints and calls RLS.
    Beam => beam::ROW,
    /// Recursive least squares per element, reading by reading: what the paper names.
    Recursive => recursive::ROW,
    /// Per element without iteration: linear in the exit direction.
    ClosedForm => closed_form::ROW,
    /// The drawing, with nothing measured but d: the baseline that a calibration has to improve on.
    Prior => prior::ROW,
}

impl Method {
    /// The name used in files and commands.
    ///
    /// ```
    /// use catoptric_calib::Method;
    /// assert_eq!("recursive".parse(), Ok(Method::Recursive));
    /// assert_eq!(Method::Beam.name(), "beam");
    /// ```
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// One-line description.
    pub fn about(self) -> &'static str {
        self.row().about
    }

    /// What the method needs, and how it solves.
    pub(crate) fn scope(self) -> &'static Scope {
        &self.row().scope
    }

    /// Whether the method supports predicting boards from the others,
    /// [`Options::cross_validation`](crate::Options::cross_validation).
    pub fn cross_validates(self) -> bool {
        match self.scope() {
            Scope::Together(Extent::Everything) => true,
            Scope::Together(Extent::EachFacet) | Scope::Element(_) | Scope::Drawing => false,
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
                nearest: nearest(name, Self::ALL.map(Self::name)),
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn methods_are_found_by_their_names_and_nothing_else_is() {
        for method in Method::ALL {
            assert_eq!(method.name().parse(), Ok(method));
        }
        let refused = "beem".parse::<Method>().expect_err("not a method");
        assert_eq!(refused.help().as_deref(), Some("did you mean \"beam\"?"));
        let refused = "annealing".parse::<Method>().expect_err("not a method");
        assert_eq!(refused.help(), None);
    }
}
