//! The description of a mesh format, and what its readers share.

use crate::json::MARK;
use catoptric_sim::Mesh;
use nalgebra::Point3;

/// One format.
pub(super) struct Row {
    /// The extension of its files, in lower case.
    pub(super) extension: &'static str,
    /// Reads a file.
    pub(super) parse: fn(&[u8]) -> Parsed,
    /// A tetrahedron in each of its encodings, as (name, bytes), for tests.
    #[cfg(test)]
    pub(super) samples: fn() -> Vec<(&'static str, Vec<u8>)>,
}

/// Location of an error in a file.
pub(super) enum Fault {
    /// In a line, from 1.
    Line(usize, String),
    /// At a byte, from 0.
    Byte(usize, String),
    /// As a whole.
    Whole(String),
}

pub(super) type Parsed = Result<Mesh, Fault>;

pub(super) fn finish(vertices: Vec<Point3<f64>>, triangles: Vec<[u32; 3]>) -> Parsed {
    Mesh::new(vertices, triangles).map_err(|e| Fault::Whole(e.to_string()))
}

/// Three numbers of a line, all finite.
pub(super) fn triple<'a>(
    words: &mut impl Iterator<Item = &'a str>,
    line: usize,
    what: &str,
) -> Result<Point3<f64>, Fault> {
    let mut number = || -> Result<f64, Fault> {
        let word = words
            .next()
            .ok_or_else(|| Fault::Line(line, format!("{what} takes three numbers")))?;
        let value: f64 = word
            .parse()
            .map_err(|_| Fault::Line(line, format!("{word:?} is not a number")))?;
        if value.is_finite() {
            Ok(value)
        } else {
            Err(Fault::Line(line, format!("{word} is not finite")))
        }
    };
    Ok(Point3::new(number()?, number()?, number()?))
}

/// The text of a file, without a byte order mark, and with every kind of line end as `\n`; invalid UTF-8 becomes replacement
/// characters, which no number contains.
pub(super) fn text_of(bytes: &[u8]) -> String {
    let bytes = bytes.strip_prefix(MARK).unwrap_or(bytes);
    String::from_utf8_lossy(bytes)
        .replace("\r\n", "\n")
        .replace('\r', "\n")
}

/// Numbered lines of text, from 1.
pub(super) fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines().enumerate().map(|(i, line)| (i + 1, line.trim()))
}

/// The corners of the tetrahedron of the samples.
#[cfg(test)]
pub(super) const CORNERS: [[f32; 3]; 4] =
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.5]];

/// Its faces, as indices of corners.
#[cfg(test)]
pub(super) const FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
