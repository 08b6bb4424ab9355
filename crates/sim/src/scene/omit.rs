//! What keeps out of files: values that say nothing.

pub(super) fn is_false(value: &bool) -> bool {
    !value
}

pub(super) fn is_zero(value: &f64) -> bool {
    *value == 0.0
}
