//! Names that other people chose, where they could do harm: on a terminal, which obeys escape sequences, and in a table that
//! a spreadsheet opens, which computes formulas.

use std::borrow::Cow;

/// A text without anything that a terminal obeys: control characters other than the end of a line and the tab, and marks that
/// change the direction of writing, are written as JSON writes them, so that JSON remains JSON.
///
/// ```
/// use catoptric_files::names::printable;
/// assert_eq!(printable("left\u{1b}[2J"), r"left\u001b[2J");
/// assert_eq!(printable("0.5°, left"), "0.5°, left");
/// ```
pub fn printable(text: &str) -> Cow<'_, str> {
    escaped(text, is_obeyed)
}

/// The same for a name within a line: the ends of lines are escaped, too, so that it cannot pass for a line of ours.
pub fn printable_name(name: &str) -> Cow<'_, str> {
    escaped(name, |c| is_obeyed(c) || c == '\n' || c == '\t')
}

/// A text of the same length in bytes without anything that a terminal obeys: for excerpts with places in them.
#[cfg(feature = "scene")]
pub(crate) fn masked(text: &str) -> Cow<'_, str> {
    if !text.contains(is_obeyed) {
        return Cow::Borrowed(text);
    }
    let mut characters = text.chars().peekable();
    let mut out = String::with_capacity(text.len());
    while let Some(c) = characters.next() {
        let ends_line = c == '\r' && characters.peek() == Some(&'\n');
        out.push(match c.len_utf8() {
            _ if ends_line || !is_obeyed(c) => c,
            1 => '?',
            2 => '·',
            _ => '\u{fffd}',
        });
    }
    Cow::Owned(out)
}

fn escaped(text: &str, is_escaped: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.contains(&is_escaped) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        if is_escaped(c) {
            out += &format!("\\u{:04x}", u32::from(c));
        } else {
            out.push(c);
        }
    }
    Cow::Owned(out)
}

/// Whether a terminal does something else with a character than to show it, or to begin the next line or column.
fn is_obeyed(c: char) -> bool {
    match c {
        '\n' | '\t' => false,
        // Marks, embeddings, overrides and isolates of the bidirectional algorithm; separators of lines and paragraphs.
        '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => true,
        c => c.is_control(),
    }
}

/// Walls, whose names begin like formulas and are known to programs that read the tables.
const WALLS: [&str; 4] = ["-x wall", "+x wall", "-y wall", "+y wall"];

/// A name as it stands in a table: one that a spreadsheet would take for a formula gets an apostrophe in front, which
/// spreadsheets take for the sign of a text. Numbers stay numbers, and the walls of the room keep their names. [`original`]
/// takes it off again.
///
/// ```
/// use catoptric_files::names::defused;
/// assert_eq!(defused("=HYPERLINK(\"x\")"), "'=HYPERLINK(\"x\")");
/// assert_eq!(defused("-0.5"), "-0.5");
/// assert_eq!(defused("left"), "left");
/// assert_eq!(defused("-y wall"), "-y wall");
/// ```
pub fn defused(name: &str) -> Cow<'_, str> {
    let is_ours = WALLS.contains(&name) || name.parse::<f64>().is_ok();
    if begins_formula(name.trim_start_matches('\'')) && !is_ours {
        Cow::Owned(format!("'{name}"))
    } else {
        Cow::Borrowed(name)
    }
}

/// The name that [`defused`] wrote.
pub fn original(field: &str) -> &str {
    match field.strip_prefix('\'') {
        Some(name) if begins_formula(name.trim_start_matches('\'')) => name,
        _ => field,
    }
}

/// Whether a spreadsheet computes what begins like this; some do so for the wide forms of the signs as well.
fn begins_formula(text: &str) -> bool {
    text.starts_with(['=', '+', '-', '@', '\t', '\r', '\n', '＝', '＋', '－', '＠'])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_is_printed_holds_nothing_that_a_terminal_obeys(text in any::<String>()) {
            prop_assert!(!printable(&text).contains(is_obeyed));
            prop_assert_eq!(masked(&text).len(), text.len());
            prop_assert!(!masked(&text).replace("\r\n", "").contains(is_obeyed));
            prop_assert!(!printable_name(&text).contains(|c: char| c.is_control()));
            // JSON with such a text is still JSON of the same text.
            let json = serde_json::to_string(&text).expect("a text");
            let back: String = serde_json::from_str(&printable(&json)).expect("still JSON");
            prop_assert_eq!(back, text);
        }

        #[test]
        fn defused_names_are_no_formulas_and_can_be_restored(name in "['=+@\t\r＝-]{0,3}.{0,4}") {
            let field = defused(&name).into_owned();
            prop_assert!(!begins_formula(&field) || field.parse::<f64>().is_ok());
            prop_assert_eq!(original(&field), name);
        }
    }

    #[test]
    fn marks_of_direction_are_escaped_and_letters_are_not() {
        assert_eq!(
            printable("a\u{202e}b\u{9b}c\u{7f}\r\n"),
            "a\\u202eb\\u009bc\\u007f\\u000d\n"
        );
        assert_eq!(printable_name("a\nb"), "a\\u000ab");
        assert_eq!(printable("שמאל ←→ 左\n\t"), "שמאל ←→ 左\n\t");
        for number in ["-0.5", "+3", "-1e-9", "-inf"] {
            assert_eq!(defused(number), number);
        }
    }
}
