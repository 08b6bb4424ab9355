//! Options that take one word of a closed set: which words there are, and what each is, the set itself says.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

/// Reads one of a set by its name; `about` is its line in the help.
pub(crate) fn one_of<T: Copy + Send + Sync + 'static>(
    all: &'static [T],
    name: fn(T) -> &'static str,
    about: fn(T) -> &'static str,
) -> impl TypedValueParser<Value = T> {
    let words = all
        .iter()
        .map(|one| PossibleValue::new(name(*one)).help(about(*one)));
    let find = move |word: String| all.iter().copied().find(|one| name(*one) == word);
    PossibleValuesParser::new(words).try_map(move |word| find(word).ok_or("no such word"))
}
