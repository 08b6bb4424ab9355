//! The methods: what each needs, how it solves, which covariance it states, and what it says of itself, in a file each.
//!
//! To add one, write its file with its [`Row`] and give it a row of the table below.

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

/// The enum, the list of all, and the way from a method to its row: three things that cannot fall apart.
macro_rules! table {
    ($($(#[$doc:meta])* $method:ident => $row:path,)+) => {
        /// How the angles of the elements are estimated from their ranges.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
        pub enum Method {
            $($(#[$doc])* $method,)+
        }

        impl Method {
            /// All of them.
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
    /// Everything at once: facets, mounting, boards, drifts and biases, beams free to depart from their facet's plane.
    #[default]
    Joint => joint::ROW,
    /// One plane per facet, each facet by itself.
    Facet => facet::ROW,
    /// Per element, weighted by the covariance of all errors believed in.
    BeamGls => beam_gls::ROW,
    /// Batch Gauss–Newton per element, Eqs. (7)–(8): what the paper prints and calls RLS.
    Beam => beam::ROW,
    /// Recursive least squares per element, reading after reading: what the paper names.
    Recursive => recursive::ROW,
    /// Per element without iteration: linear in the exit direction.
    ClosedForm => closed_form::ROW,
    /// The drawing, with nothing measured but d: what calibrating has to improve on.
    Prior => prior::ROW,
}

impl Method {
    /// The word that files and commands use.
    ///
    /// ```
    /// use catoptric_calib::Method;
    /// assert_eq!("recursive".parse(), Ok(Method::Recursive));
    /// assert_eq!(Method::Beam.name(), "beam");
    /// ```
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// What it is, in a line.
    pub fn about(self) -> &'static str {
        self.row().about
    }

    /// What it needs, and how it solves.
    pub(crate) fn scope(self) -> &'static Scope {
        &self.row().scope
    }

    /// Whether it can be asked to predict boards from the others, as
    /// [`Options::cross_validation`](crate::Options::cross_validation) has it.
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
        let refused = "beems".parse::<Method>().expect_err("it is no method's");
        assert_eq!(refused.help().as_deref(), Some("did you mean \"beam\"?"));
        let refused = "annealing".parse::<Method>().expect_err("it is no method's");
        assert_eq!(refused.help(), None);
    }
}
