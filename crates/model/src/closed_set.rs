//! Closed sets: enums without fields that list all their variants.

/// Defines an enum without fields, and `ALL` from the same text: the list cannot forget a variant.
///
/// ```
/// catoptric_model::closed_set! {
///     /// The sides of a mirror.
///     #[derive(Debug, Clone, Copy, PartialEq, Eq)]
///     pub enum Side {
///         /// The reflecting one.
///         Front,
///         /// The other one.
///         Back,
///     }
/// }
/// assert_eq!(Side::ALL, [Side::Front, Side::Back]);
/// ```
#[macro_export]
macro_rules! closed_set {
    ($(#[$about:meta])* $visibility:vis enum $set:ident { $($(#[$doc:meta])* $variant:ident,)+ }) => {
        $(#[$about])*
        $visibility enum $set {
            $($(#[$doc])* $variant,)+
        }

        impl $set {
            /// All of them.
            $visibility const ALL: [Self; [$(Self::$variant),+].len()] = [$(Self::$variant),+];
        }
    };
}
