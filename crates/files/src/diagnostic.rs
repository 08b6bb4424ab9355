//! Problems in a file written by a person: each with its location, an excerpt, and a suggestion.

use super::names::{masked, printable};
use annotate_snippets::{AnnotationKind, Group, Level, Origin, Renderer, Snippet};
use std::fmt;
use std::ops::Range;

/// Location of a problem.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// Byte range in the file.
    Span(Range<usize>),
    /// Line and column in the file, both from 1, if no range is known.
    Position(usize, usize),
    /// The argument of a `--set`.
    Set(String),
    /// A key of the file with unknown position.
    Key(String),
}

/// One problem.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// Its location.
    pub place: Place,
    /// What was found and what is allowed.
    pub message: String,
    /// How to fix it.
    pub help: Option<String>,
}

/// All problems of one file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostics {
    /// The file's name as given.
    pub file: String,
    /// Its contents.
    pub text: String,
    /// The problems, in the order of their locations.
    pub list: Vec<Diagnostic>,
}

impl Diagnostics {
    /// Line and column, both from 1 and in characters, of a problem with a known position in the file.
    pub fn position(&self, diagnostic: &Diagnostic) -> Option<(usize, usize)> {
        match &diagnostic.place {
            Place::Span(span) => Some(position(&self.text, span.start)),
            Place::Position(line, column) => Some((*line, *column)),
            Place::Set(_) | Place::Key(_) => None,
        }
    }

    /// Every problem with its excerpt, then a line with their number; with terminal colors if `styled`.
    pub fn render(&self, styled: bool) -> String {
        let renderer = if styled {
            Renderer::styled()
        } else {
            Renderer::plain()
        };
        let mut out = String::new();
        for diagnostic in &self.list {
            let text = masked(&self.text);
            let file = printable(&self.file);
            out.push_str(&renderer.render(&[group(&file, &text, diagnostic)]));
            out.push_str("\n\n");
        }
        let count = match self.list.len() {
            1 => "1 problem".to_owned(),
            n => format!("{n} problems"),
        };
        out.push_str(&format!("{}: {count}", printable(&self.file)));
        out
    }
}

/// A problem with its excerpt from a text that a terminal can be shown.
fn group<'a>(file: &'a str, text: &'a str, diagnostic: &'a Diagnostic) -> Group<'a> {
    let message = match &diagnostic.place {
        Place::Set(argument) => format!("--set {argument}: {}", diagnostic.message),
        _ => diagnostic.message.clone(),
    };
    let message = printable(&message).into_owned();
    let mut group = Group::with_title(Level::ERROR.primary_title(message));
    match &diagnostic.place {
        Place::Span(span) => {
            group = group.element(
                Snippet::source(text)
                    .path(file)
                    .annotation(AnnotationKind::Primary.span(first_line(text, span))),
            );
        }
        Place::Position(line, column) => {
            group = group.element(Origin::path(file).line(*line).char_column(*column));
        }
        Place::Key(_) => group = group.element(Origin::path(file)),
        Place::Set(_) => {}
    }
    if let Some(help) = &diagnostic.help {
        group = group.element(Level::HELP.message(printable(help)));
    }
    group
}

impl fmt::Display for Diagnostics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.render(false))
    }
}

impl std::error::Error for Diagnostics {}

/// Line and column of a byte offset, both from 1 and in characters.
pub(super) fn position(text: &str, byte: usize) -> (usize, usize) {
    let mut byte = byte.min(text.len());
    while !text.is_char_boundary(byte) {
        byte -= 1;
    }
    let before = &text[..byte];
    let line_start = before.rfind('\n').map_or(0, |n| n + 1);
    (
        before.matches('\n').count() + 1,
        before[line_start..].chars().count() + 1,
    )
}

/// The first line of a span: an excerpt of a whole table would hide the problem.
fn first_line(text: &str, span: &Range<usize>) -> Range<usize> {
    let start = span.start.min(text.len());
    let end = span.end.clamp(start, text.len());
    let length = text
        .get(start..end)
        .and_then(|s| s.find('\n'))
        .unwrap_or(end - start);
    start..start + length
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_count_characters_from_one() {
        let text = "a = 1\n\"é\" = x\n";
        assert_eq!(position(text, 0), (1, 1));
        assert_eq!(position(text, text.find('x').expect("it is there")), (2, 7));
        assert_eq!(position(text, 999), (3, 1));
    }
}
