//! `prior`: the drawing, with nothing measured but d. It states no covariance, because its error is unknown.

use super::row::{Row, Scope};

pub(super) const ROW: Row = Row {
    name: "prior",
    about: "The drawing",
    scope: Scope::Drawing,
};
