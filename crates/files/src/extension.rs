//! Formats that the extension of a file selects, and how errors list them.

use std::path::Path;

/// The format with the extension of a file, in upper or lower case.
pub(crate) fn by_extension<T: Copy>(path: &Path, all: &[T], extension: fn(T) -> &'static str) -> Option<T> {
    let end = path.extension()?.to_str()?.to_ascii_lowercase();
    all.iter().copied().find(|format| extension(*format) == end)
}

/// The extensions as a sentence lists them: `.stl, .obj and .ply`.
pub(crate) fn listed<T: Copy>(all: &[T], extension: fn(T) -> &'static str, before_last: &str) -> String {
    let names: Vec<String> = all
        .iter()
        .map(|format| format!(".{}", extension(*format)))
        .collect();
    match names.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, others)) => format!("{} {before_last} {last}", others.join(", ")),
        None => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extensions_are_found_in_any_case_and_listed_as_in_a_sentence() {
        let all = ["stl", "obj", "ply"];
        let own = |word| word;
        assert_eq!(by_extension(Path::new("a/b.OBJ"), &all, own), Some("obj"));
        assert_eq!(by_extension(Path::new("a/obj"), &all, own), None);
        assert_eq!(listed(&all, own, "and"), ".stl, .obj and .ply");
        assert_eq!(listed(&all[..2], own, "or"), ".stl or .obj");
        assert_eq!(listed(&all[..1], own, "or"), ".stl");
    }
}
