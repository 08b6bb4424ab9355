//! Default values that are omitted from files.

pub(crate) fn is_false(value: &bool) -> bool {
    !value
}

pub(super) fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

pub(super) fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}
