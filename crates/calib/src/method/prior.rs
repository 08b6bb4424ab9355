//! `prior`: the drawing, with nothing measured but d. It states no covariance: nobody knows how far it is off.

use super::row::{Row, Scope};

pub(super) const ROW: Row = Row {
    name: "prior",
    about: "The drawing",
    scope: Scope::Drawing,
};
