//! How one value is laid over another: key by key, entry by entry, or as a whole.

use std::collections::BTreeMap;

/// What can be laid over a value.
pub(super) trait LieOver<T> {
    /// Changes the value where this says something.
    fn lie_over(&self, value: &mut T);
}

/// Plain values replace what is there.
macro_rules! replaces {
    ($($type:ty),+) => {
        $(impl LieOver<$type> for $type {
            fn lie_over(&self, value: &mut $type) {
                value.clone_from(self);
            }
        })+
    };
}
replaces!(
    f64,
    bool,
    u32,
    usize,
    String,
    [f64; 3],
    [f64; 4],
    [usize; 2],
    Vec<f64>,
    Vec<[f64; 3]>
);

/// What the session may leave out begins with its default.
impl<T: Default, O: LieOver<T>> LieOver<Option<T>> for O {
    fn lie_over(&self, value: &mut Option<T>) {
        self.lie_over(value.get_or_insert_default());
    }
}

/// Entry by entry.
impl<T: Default, O: LieOver<T>> LieOver<BTreeMap<String, T>> for BTreeMap<String, O> {
    fn lie_over(&self, value: &mut BTreeMap<String, T>) {
        for (name, over) in self {
            over.lie_over(value.entry(name.clone()).or_default());
        }
    }
}

/// Defines a struct of optional keys that lies over another, key by key; with `named`, it says which entry of a list.
macro_rules! overlay {
    ($(#[$meta:meta])* named $name:ident over $target:ty { $($(#[$doc:meta])* $key:ident: $type:ty,)+ }) => {
        $(#[$meta])*
        #[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            /// Name of the entry that this is laid over.
            pub name: String,
            $($(#[$doc])* #[serde(default, skip_serializing_if = "Option::is_none")] pub $key: Option<$type>,)+
        }
        overlay!(@over $name, $target, $($key)+);
        impl LieOver<Vec<$target>> for Vec<$name> {
            fn lie_over(&self, value: &mut Vec<$target>) {
                for over in self {
                    for entry in value.iter_mut().filter(|e| e.name == over.name) {
                        over.lie_over(entry);
                    }
                }
            }
        }
    };
    ($(#[$meta:meta])* $name:ident over $target:ty { $($(#[$doc:meta])* $key:ident: $type:ty,)+ }) => {
        $(#[$meta])*
        #[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            $($(#[$doc])* #[serde(default, skip_serializing_if = "Option::is_none")] pub $key: Option<$type>,)+
        }
        overlay!(@over $name, $target, $($key)+);
    };
    (@over $name:ident, $target:ty, $($key:ident)+) => {
        impl LieOver<$target> for $name {
            fn lie_over(&self, value: &mut $target) {
                $(if let Some(key) = &self.$key {
                    key.lie_over(&mut value.$key);
                })+
            }
        }
    };
}
pub(super) use overlay;
