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

/// Maximum number of problems of a file that are shown; the rest is counted.
pub(super) const MOST_SHOWN: usize = 50;

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
            Place::Span(span) => Some(Lines::of(&self.text).position(span.start)),
            Place::Position(line, column) => Some((*line, *column)),
            Place::Set(_) | Place::Key(_) => None,
        }
    }

    /// The first problems, each with its excerpt, then a line with the number of all; with terminal colors if `styled`.
    pub fn render(&self, styled: bool) -> String {
        let renderer = if styled {
            Renderer::styled()
        } else {
            Renderer::plain()
        };
        let (file, text) = (printable(&self.file), masked(&self.text));
        let lines = Lines::of(&text);
        let mut out = String::new();
        for diagnostic in self.list.iter().take(MOST_SHOWN) {
            out.push_str(&renderer.render(&[group(&file, &lines, diagnostic)]));
            out.push_str("\n\n");
        }
        let count = match self.list.len() {
            1 => "1 problem".to_owned(),
            n if n > MOST_SHOWN => format!("{n} problems, of which the first {MOST_SHOWN} are shown"),
            n => format!("{n} problems"),
        };
        out.push_str(&format!("{file}: {count}"));
        out
    }
}

/// A problem with its excerpt from the lines of a text that a terminal can be shown.
fn group<'a>(file: &'a str, lines: &Lines<'a>, diagnostic: &'a Diagnostic) -> Group<'a> {
    let message = match &diagnostic.place {
        Place::Set(argument) => format!("--set {argument}: {}", diagnostic.message),
        _ => diagnostic.message.clone(),
    };
    let message = printable(&message).into_owned();
    let mut group = Group::with_title(Level::ERROR.primary_title(message));
    match &diagnostic.place {
        Place::Span(span) => {
            // The line alone: an excerpt of a whole table would hide the problem.
            let (number, line) = lines.line(span.start);
            let start = span.start.clamp(line.start, line.end) - line.start;
            let end = span.end.clamp(line.start + start, line.end) - line.start;
            group = group.element(
                Snippet::source(&lines.text[line])
                    .line_start(number)
                    .path(file)
                    .annotation(AnnotationKind::Primary.span(start..end)),
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

/// The lines of a text, to find many positions in it.
pub(super) struct Lines<'a> {
    text: &'a str,
    /// Where each line begins, in bytes.
    starts: Vec<usize>,
}

impl<'a> Lines<'a> {
    pub(super) fn of(text: &'a str) -> Self {
        let after = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
        let starts = std::iter::once(0).chain(after.map(|(at, _)| at + 1));
        Self {
            text,
            starts: starts.collect(),
        }
    }

    /// Number, from 1, and bytes of the line of a byte offset, without its end.
    pub(super) fn line(&self, byte: usize) -> (usize, Range<usize>) {
        let number = self
            .starts
            .partition_point(|start| *start <= byte.min(self.text.len()));
        let start = self.starts[number - 1];
        let end = self.starts.get(number).map_or(self.text.len(), |next| next - 1);
        (number, start..end)
    }

    /// Line and column of a byte offset, both from 1 and in characters.
    pub(super) fn position(&self, byte: usize) -> (usize, usize) {
        let mut byte = byte.min(self.text.len());
        while !self.text.is_char_boundary(byte) {
            byte -= 1;
        }
        let (number, line) = self.line(byte);
        (number, self.text[line.start..byte].chars().count() + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_count_characters_from_one() {
        let text = "a = 1\n\"é\" = x\n";
        let lines = Lines::of(text);
        assert_eq!(lines.position(0), (1, 1));
        assert_eq!(lines.position(text.find('x').expect("it is there")), (2, 7));
        assert_eq!(lines.position(text.find('é').expect("it is there") + 1), (2, 2));
        assert_eq!(lines.position(999), (3, 1));
        assert_eq!(lines.line(3), (1, 0..5));
        assert_eq!(Lines::of("").position(0), (1, 1));
    }
}
