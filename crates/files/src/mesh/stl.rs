//! STL: triangles without shared vertices, as text or binary.

use super::row::{Fault, Parsed, Row, finish, lines, text_of, triple};
use crate::json::MARK;
use nalgebra::Point3;
use std::collections::HashMap;

pub(super) const ROW: Row = Row {
    extension: "stl",
    parse,
    #[cfg(test)]
    samples: tests::samples,
};

/// Merges vertices with exactly equal coordinates, since the format does not share vertices between triangles.
#[derive(Default)]
struct Welder {
    vertices: Vec<Point3<f64>>,
    known: HashMap<[u64; 3], u32>,
}

impl Welder {
    fn index(&mut self, point: Point3<f64>) -> Option<u32> {
        // Adding zero makes −0 and 0 equal.
        let key = [point.x, point.y, point.z].map(|c| (c + 0.0).to_bits());
        let next = u32::try_from(self.vertices.len()).ok()?;
        let vertices = &mut self.vertices;
        Some(*self.known.entry(key).or_insert_with(|| {
            vertices.push(point);
            next
        }))
    }

    fn triangle(&mut self, corners: [Point3<f64>; 3]) -> Result<[u32; 3], Fault> {
        let too_many = || Fault::Whole("has more vertices than can be numbered".to_owned());
        let [a, b, c] = corners.map(|p| self.index(p).ok_or_else(too_many));
        Ok([a?, b?, c?])
    }
}

const STL_HEADER: usize = 84;
const STL_TRIANGLE: usize = 50;

/// Reads a text or binary file.
fn parse(bytes: &[u8]) -> Parsed {
    let count = bytes
        .get(80..STL_HEADER)
        .and_then(|b| b.try_into().ok())
        .map(|b| u32::from_le_bytes(b) as usize);
    let fits = |n: usize| n.checked_mul(STL_TRIANGLE).map(|size| size + STL_HEADER) == Some(bytes.len());
    // A binary header may begin with "solid" as text does; then its size decides, or that text has no zero bytes.
    let begin = bytes.strip_prefix(MARK).unwrap_or(bytes).trim_ascii_start();
    let says_solid = begin
        .get(..5)
        .is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    if says_solid && !count.is_some_and(fits) && !bytes.contains(&0) {
        return text(&text_of(bytes));
    }
    let Some(count) = count else {
        return Err(Fault::Byte(
            bytes.len(),
            format!(
                "an STL file has {STL_HEADER} bytes at least, this one {}",
                bytes.len()
            ),
        ));
    };
    // Some programs write more after the last triangle: less than a triangle, or zeros.
    let is_whole = |end: usize| {
        let spare = bytes.get(end..);
        spare.is_some_and(|spare| spare.len() < STL_TRIANGLE || spare.iter().all(|byte| *byte == 0))
    };
    let end = count
        .checked_mul(STL_TRIANGLE)
        .and_then(|size| size.checked_add(STL_HEADER));
    let Some(end) = end.filter(|end| is_whole(*end)) else {
        let expected = count as u64 * STL_TRIANGLE as u64 + STL_HEADER as u64;
        return Err(Fault::Byte(
            bytes.len(),
            format!(
                "it says it has {count} triangles, {expected} bytes; it has {} bytes",
                bytes.len()
            ),
        ));
    };
    let mut welder = Welder::default();
    let mut triangles = Vec::with_capacity(count);
    for (i, record) in bytes[STL_HEADER..end].chunks_exact(STL_TRIANGLE).enumerate() {
        let number = |at: usize| {
            let bytes = record
                .get(12 + 4 * at..16 + 4 * at)
                .and_then(|b| b.try_into().ok());
            bytes.map_or(f64::NAN, |b| f64::from(f32::from_le_bytes(b)))
        };
        let corners = [0, 3, 6].map(|k| Point3::new(number(k), number(k + 1), number(k + 2)));
        if corners.iter().any(|p| p.iter().any(|c| !c.is_finite())) {
            let byte = STL_HEADER + i * STL_TRIANGLE;
            return Err(Fault::Byte(
                byte,
                format!("triangle {i} has a corner that is not finite"),
            ));
        }
        triangles.push(welder.triangle(corners)?);
    }
    finish(welder.vertices, triangles)
}

fn text(text: &str) -> Parsed {
    let mut welder = Welder::default();
    let mut triangles = Vec::new();
    let mut corners = Vec::new();
    let mut last = 1;
    let mut ended = false;
    for (line, content) in lines(text) {
        last = line;
        let mut words = content.split_whitespace();
        let keyword = words.next().unwrap_or_default().to_ascii_lowercase();
        match keyword.as_str() {
            "" | "solid" | "facet" | "outer" => ended = false,
            "vertex" => corners.push(triple(&mut words, line, "a vertex")?),
            "endloop" => match corners.as_slice() {
                &[a, b, c] => {
                    triangles.push(welder.triangle([a, b, c])?);
                    corners.clear();
                }
                other => {
                    let message = format!(
                        "the facet that ends here has {} corners; 3 are needed",
                        other.len()
                    );
                    return Err(Fault::Line(line, message));
                }
            },
            "endfacet" => {}
            "endsolid" => ended = true,
            other => return Err(Fault::Line(line, format!("{other:?} is no word of an STL file"))),
        }
    }
    if !corners.is_empty() || !ended {
        return Err(Fault::Line(
            last,
            "the file ends before its `endsolid`".to_owned(),
        ));
    }
    finish(welder.vertices, triangles)
}

#[cfg(test)]
mod tests {
    use crate::mesh::row::{CORNERS, FACES};

    pub(super) fn samples() -> Vec<(&'static str, Vec<u8>)> {
        let mut binary = vec![b's'; 80];
        binary[..5].copy_from_slice(b"solid");
        binary.extend(4u32.to_le_bytes());
        let mut text = "solid t\n".to_owned();
        for face in FACES {
            binary.extend([0; 12]);
            text.push_str("facet normal 0 0 0\nouter loop\n");
            for i in face {
                let [x, y, z] = CORNERS[i];
                binary.extend(CORNERS[i].iter().flat_map(|c| c.to_le_bytes()));
                text.push_str(&format!("vertex {x} {y} {z}\n"));
            }
            binary.extend([0; 2]);
            text.push_str("endloop\nendfacet\n");
        }
        text.push_str("endsolid t\n");
        vec![("binary.stl", binary), ("text.stl", text.into_bytes())]
    }
}
