//! OBJ: the vertices and faces of a text file; everything else is ignored.

use super::polygon;
use super::row::{Fault, Parsed, Row, finish, lines, text_of, triple};

pub(super) const ROW: Row = Row {
    extension: "obj",
    parse,
    #[cfg(test)]
    samples: tests::samples,
};

/// Reads a file.
fn parse(bytes: &[u8]) -> Parsed {
    let text = text_of(bytes);
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    let mut lines = lines(&text);
    while let Some((line, content)) = lines.next() {
        let mut content = content.to_owned();
        // A backslash at its end continues a line.
        while content.ends_with('\\') {
            content.pop();
            content.push(' ');
            content.push_str(lines.next().map_or("", |(_, more)| more));
        }
        // A comment begins a word; in `1.#QNAN0` the sign does not.
        let mut words = content
            .split_whitespace()
            .take_while(|word| !word.starts_with('#'));
        match words.next() {
            Some("v") => vertices.push(triple(&mut words, line, "a vertex")?),
            Some("f") => {
                let corners = words
                    .map(|word| index(word, vertices.len()).map_err(|m| Fault::Line(line, m)))
                    .collect::<Result<Vec<u32>, _>>()?;
                if corners.len() < 3 {
                    let message = format!("a face has {} corners; 3 at least are needed", corners.len());
                    return Err(Fault::Line(line, message));
                }
                let split = polygon::triangles(&corners, &vertices);
                triangles.extend(split.map_err(|m| Fault::Line(line, m))?);
            }
            // Normals, textures, groups, materials, lines and curves do not affect the surface.
            _ => {}
        }
    }
    finish(vertices, triangles)
}

/// A corner such as `7`, `7/1/3` or `-1` (the last vertex so far), as an index from 0.
fn index(word: &str, count: usize) -> Result<u32, String> {
    let number = word.split('/').next().unwrap_or_default();
    let value: i64 = number
        .parse()
        .map_err(|_| format!("{word:?} is not the number of a vertex"))?;
    let count = i64::try_from(count).unwrap_or(i64::MAX);
    let index = if value < 0 {
        count.checked_add(value)
    } else {
        value.checked_sub(1)
    };
    index
        .filter(|i| (0..count).contains(i))
        .and_then(|i| u32::try_from(i).ok())
        .ok_or_else(|| format!("there is no vertex {value} yet; there are {count}"))
}

#[cfg(test)]
mod tests {
    use crate::mesh::row::{CORNERS, FACES};

    pub(super) fn samples() -> Vec<(&'static str, Vec<u8>)> {
        let mut text = "# a tetrahedron\n".to_owned();
        for [x, y, z] in CORNERS {
            text.push_str(&format!("v {x} {y} {z}\n"));
        }
        for [a, b, c] in FACES {
            text.push_str(&format!("f {}/1 {}//2 -{}\n", a + 1, b + 1, 4 - c));
        }
        vec![("text.obj", text.into_bytes())]
    }
}
