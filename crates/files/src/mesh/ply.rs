//! PLY: a header of elements and their properties, then numbers as text or in either byte order.

use super::polygon;
use super::row::{Fault, Parsed, Row, finish};
use crate::json::MARK;
use catoptric_sim::Mesh;
use nalgebra::Point3;

pub(super) const ROW: Row = Row {
    extension: "ply",
    parse,
    #[cfg(test)]
    samples: tests::samples,
};

/// A mesh as a binary PLY file of 64-bit numbers, which reads back as the same mesh.
pub fn to_ply(mesh: &Mesh) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\n\
         property double z\nelement face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        mesh.vertices().len(),
        mesh.triangles().len()
    )
    .into_bytes();
    for value in mesh.vertices().iter().flat_map(|p| p.iter()) {
        bytes.extend(value.to_le_bytes());
    }
    for triangle in mesh.triangles() {
        bytes.push(3);
        bytes.extend(triangle.iter().flat_map(|v| v.to_le_bytes()));
    }
    bytes
}

/// Type of a number in a PLY file.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

/// Encoding of the numbers in a PLY file.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Encoding {
    Text,
    Little,
    Big,
}

struct Property {
    name: String,
    /// Type of a list's length.
    list: Option<Number>,
    number: Number,
}

struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
}

impl Number {
    fn parse(word: &str) -> Option<Self> {
        Some(match word {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The number from its bytes, least significant first.
    fn decode(self, bytes: [u8; 8]) -> f64 {
        let [a, b, c, d, ..] = bytes;
        match self {
            Self::I8 => f64::from(i8::from_le_bytes([a])),
            Self::U8 => f64::from(a),
            Self::I16 => f64::from(i16::from_le_bytes([a, b])),
            Self::U16 => f64::from(u16::from_le_bytes([a, b])),
            Self::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
            Self::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
            Self::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
            Self::F64 => f64::from_le_bytes(bytes),
        }
    }
}

/// Reader of the numbers after a PLY header, in order.
struct Body<'a> {
    bytes: &'a [u8],
    at: usize,
    encoding: Encoding,
    line: usize,
}

impl Body<'_> {
    fn fault(&self, message: impl Into<String>) -> Fault {
        match self.encoding {
            Encoding::Text => Fault::Line(self.line, message.into()),
            Encoding::Little | Encoding::Big => Fault::Byte(self.at, message.into()),
        }
    }

    fn next(&mut self, number: Number) -> Result<f64, Fault> {
        if self.encoding == Encoding::Text {
            return self.next_word();
        }
        let size = number.size();
        let Some(bytes) = self.bytes.get(self.at..self.at + size) else {
            return Err(self.fault("the file ends before its last element"));
        };
        let mut little = [0; 8];
        little[..size].copy_from_slice(bytes);
        if self.encoding == Encoding::Big {
            little[..size].reverse();
        }
        self.at += size;
        Ok(number.decode(little))
    }

    fn next_word(&mut self) -> Result<f64, Fault> {
        while self.bytes.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.pass();
        }
        let rest = &self.bytes[self.at..];
        let end = rest
            .iter()
            .position(u8::is_ascii_whitespace)
            .unwrap_or(rest.len());
        if end == 0 {
            return Err(self.fault("the file ends before its last element"));
        }
        let word = String::from_utf8_lossy(&rest[..end]);
        let value = word
            .parse()
            .map_err(|_| self.fault(format!("{word:?} is not a number")))?;
        self.at += end;
        Ok(value)
    }

    /// Passes over one byte of text, and counts the lines.
    fn pass(&mut self) {
        let ends_line = match self.bytes[self.at] {
            b'\n' => true,
            b'\r' => self.bytes.get(self.at + 1) != Some(&b'\n'),
            _ => false,
        };
        self.line += usize::from(ends_line);
        self.at += 1;
    }

    /// Passes over numbers beyond those of an element: some programs write more in a row than they say.
    fn end_row(&mut self) {
        if self.encoding == Encoding::Text {
            while self
                .bytes
                .get(self.at)
                .is_some_and(|byte| !matches!(byte, b'\n' | b'\r'))
            {
                self.at += 1;
            }
        }
    }

    /// A vertex of a strip; `None` where a strip ends.
    fn next_of_strip(&mut self, number: Number) -> Result<Option<u32>, Fault> {
        let (at, line) = (self.at, self.line);
        if self.next(number)? == -1.0 {
            return Ok(None);
        }
        (self.at, self.line) = (at, line);
        self.next_index(number).map(Some)
    }

    /// A non-negative integer.
    fn next_index(&mut self, number: Number) -> Result<u32, Fault> {
        let value = self.next(number)?;
        if value.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&value) {
            // In range and an integer.
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            return Ok(value as u32);
        }
        Err(self.fault(format!("{value} is no count or number of a vertex")))
    }
}

/// Reads a file of any encoding.
fn parse(bytes: &[u8]) -> Parsed {
    let (encoding, elements, start, line) = header(bytes)?;
    let mut body = Body {
        bytes,
        at: start,
        encoding,
        line,
    };
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    // Faces of more than three corners, each with its place among the triangles; vertices may come after them.
    let mut polygons: Vec<(usize, Vec<u32>, Fault)> = Vec::new();
    for element in &elements {
        // Elements of zero size would let a corrupt count loop forever.
        if element.properties.is_empty() && element.count > 0 {
            return Err(Fault::Whole(format!(
                "element {} has no properties",
                element.name
            )));
        }
        for _ in 0..element.count {
            let mut point = [None; 3];
            for property in &element.properties {
                let Some(list) = property.list else {
                    let value = body.next(property.number)?;
                    let axis = ["x", "y", "z"].iter().position(|a| *a == property.name);
                    if let (Some(axis), "vertex") = (axis, element.name.as_str()) {
                        point[axis] = Some(value);
                    }
                    continue;
                };
                let count = body.next_index(list)?;
                let corners = ["vertex_indices", "vertex_index"].contains(&property.name.as_str());
                if element.name == "face" && corners {
                    let mut face = Vec::new();
                    for _ in 0..count {
                        face.push(body.next_index(property.number)?);
                    }
                    if face.len() < 3 {
                        return Err(body.fault(format!("a face has {count} corners; 3 at least are needed")));
                    }
                    match face[..] {
                        [a, b, c] => triangles.push([a, b, c]),
                        _ => polygons.push((triangles.len(), face, body.fault(""))),
                    }
                } else if element.name == "tristrips" && corners {
                    let mut strip = Vec::new();
                    for _ in 0..count {
                        match body.next_of_strip(property.number)? {
                            Some(vertex) => strip.push(vertex),
                            None => triangles.extend(of_strip(&std::mem::take(&mut strip))),
                        }
                    }
                    triangles.extend(of_strip(&strip));
                } else {
                    for _ in 0..count {
                        body.next(property.number)?;
                    }
                }
            }
            body.end_row();
            if element.name == "vertex" {
                let [Some(x), Some(y), Some(z)] = point else {
                    return Err(Fault::Whole("its vertices have no x, y and z".to_owned()));
                };
                let point = Point3::new(x, y, z);
                if point.iter().any(|c| !c.is_finite()) {
                    return Err(body.fault("a vertex is not finite"));
                }
                vertices.push(point);
            }
        }
    }
    let triangles = with_polygons(triangles, polygons, &vertices)?;
    finish(vertices, triangles)
}

/// The triangles of a strip, every other one with its corners exchanged.
fn of_strip(strip: &[u32]) -> impl Iterator<Item = [u32; 3]> + '_ {
    strip
        .windows(3)
        .enumerate()
        .map(|(number, corners)| match number % 2 {
            0 => [corners[0], corners[1], corners[2]],
            _ => [corners[1], corners[0], corners[2]],
        })
}

/// All triangles in the order of the faces.
fn with_polygons(
    triangles: Vec<[u32; 3]>,
    polygons: Vec<(usize, Vec<u32>, Fault)>,
    vertices: &[Point3<f64>],
) -> Result<Vec<[u32; 3]>, Fault> {
    if polygons.is_empty() {
        return Ok(triangles);
    }
    let mut all = Vec::with_capacity(triangles.len() + 2 * polygons.len());
    let mut done = 0;
    for (before, face, place) in polygons {
        all.extend_from_slice(&triangles[done..before]);
        done = before;
        let at = |message: String| match place {
            Fault::Line(line, _) => Fault::Line(line, message),
            Fault::Byte(byte, _) => Fault::Byte(byte, message),
            Fault::Whole(_) => Fault::Whole(message),
        };
        let split = match face.iter().find(|v| **v as usize >= vertices.len()) {
            Some(vertex) => Err(format!(
                "a face uses vertex {vertex}; there are {}, numbered from 0",
                vertices.len()
            )),
            None => polygon::triangles(&face, vertices),
        };
        all.extend(split.map_err(at)?);
    }
    all.extend_from_slice(&triangles[done..]);
    Ok(all)
}

/// Encoding, elements, offset of the numbers, and their line.
fn header(bytes: &[u8]) -> Result<(Encoding, Vec<Element>, usize, usize), Fault> {
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut at = if bytes.starts_with(MARK) { MARK.len() } else { 0 };
    // Lines end as the first one does: a binary body may begin with any byte.
    let first = bytes.iter().position(|b| matches!(b, b'\n' | b'\r'));
    let ends_in_cr = first.is_some_and(|end| bytes[end] == b'\r' && bytes.get(end + 1) != Some(&b'\n'));
    let line_end = if ends_in_cr { b'\r' } else { b'\n' };
    for line in 1.. {
        let rest = &bytes[at..];
        let Some(end) = rest.iter().position(|b| *b == line_end) else {
            return Err(Fault::Line(
                line,
                "the file ends before its `end_header`".to_owned(),
            ));
        };
        let content = String::from_utf8_lossy(&rest[..end]).into_owned();
        at += end + 1;
        let fault = |message: String| Fault::Line(line, message);
        let words: Vec<&str> = content.split_whitespace().collect();
        match words.as_slice() {
            _ if line == 1 => {
                if words != ["ply"] {
                    return Err(fault("a PLY file begins with the line `ply`".to_owned()));
                }
            }
            ["format", name, _] => {
                encoding = Some(match *name {
                    "ascii" => Encoding::Text,
                    "binary_little_endian" => Encoding::Little,
                    "binary_big_endian" => Encoding::Big,
                    other => return Err(fault(format!("{other:?} is no format of a PLY file"))),
                });
            }
            ["element", name, count] => elements.push(Element {
                name: (*name).to_owned(),
                count: count
                    .parse()
                    .map_err(|_| fault(format!("{count:?} is not a number of elements")))?,
                properties: Vec::new(),
            }),
            ["property", kind @ .., name] => {
                let number = |word: &str| {
                    Number::parse(word).ok_or_else(|| fault(format!("{word:?} is no type of a number")))
                };
                let (list, number) = match kind {
                    ["list", length, item] => (Some(number(length)?), number(item)?),
                    [item] => (None, number(item)?),
                    _ => return Err(fault(format!("{content:?} is no property"))),
                };
                let element = elements
                    .last_mut()
                    .ok_or_else(|| fault("a property comes before its element".to_owned()))?;
                element.properties.push(Property {
                    name: (*name).to_owned(),
                    list,
                    number,
                });
            }
            ["end_header"] => {
                let encoding = encoding.ok_or_else(|| fault("the header names no format".to_owned()))?;
                return Ok((encoding, elements, at, line + 1));
            }
            [] | ["comment" | "obj_info", ..] => {}
            _ => return Err(fault(format!("{content:?} is no line of a PLY header"))),
        }
    }
    Err(Fault::Whole("it has no end".to_owned()))
}

#[cfg(test)]
mod tests {
    use crate::mesh::row::{CORNERS, FACES};

    pub(super) fn samples() -> Vec<(&'static str, Vec<u8>)> {
        let mut text = String::new();
        let (mut little, mut big) = (Vec::new(), Vec::new());
        for [x, y, z] in CORNERS {
            text.push_str(&format!("{x} {y} {z}\n"));
            little.extend([x, y, z].iter().flat_map(|c| c.to_le_bytes()));
            big.extend([x, y, z].iter().flat_map(|c| c.to_be_bytes()));
        }
        for [a, b, c] in FACES {
            text.push_str(&format!("3 {a} {b} {c}\n"));
            little.push(3);
            big.push(3);
            for i in [a, b, c] {
                let i = i32::try_from(i).expect("small");
                little.extend(i.to_le_bytes());
                big.extend(i.to_be_bytes());
            }
        }
        let file = |format: &str, body: &[u8]| {
            let header = format!(
                "ply\nformat {format} 1.0\ncomment c\nelement vertex 4\nproperty float x\nproperty float y\n\
                 property float z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n"
            );
            [header.as_bytes(), body].concat()
        };
        vec![
            ("text.ply", file("ascii", text.as_bytes())),
            ("little.ply", file("binary_little_endian", &little)),
            ("big.ply", file("binary_big_endian", &big)),
        ]
    }
}
