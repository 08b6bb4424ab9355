//! Mesh files: STL, OBJ and PLY, as text and binary; and a PLY writer that loses nothing.
//!
//! The format is told by the end of the file's name. Whatever is damaged is an error that names the line, or the byte
//! in a binary file; nothing in a file can bring the reader down, and no size it claims is believed before the bytes
//! are there. Polygons of more than three corners are cut into a fan.

use super::error::IoError;
use catoptric_sim::Mesh;
use nalgebra::Point3;
use std::collections::HashMap;
use std::fs;
use std::path::Path;

/// What is wrong with a file, and where.
enum Fault {
    /// In a line, from 1.
    Line(usize, String),
    /// At a byte, from 0.
    Byte(usize, String),
    /// As a whole.
    Whole(String),
}

type Parsed = Result<Mesh, Fault>;

/// Reads a mesh in the unit of its file.
///
/// # Errors
/// [`IoError::Read`] if the file cannot be read; [`IoError::Text`] with the line, [`IoError::Recording`] with the byte
/// or [`IoError::Content`] if it is no mesh.
pub fn read_mesh(path: impl AsRef<Path>) -> Result<Mesh, IoError> {
    let path = path.as_ref();
    let bytes = fs::read(path).map_err(|e| IoError::read(path, e))?;
    parse_mesh(&bytes, path)
}

/// Reads a mesh from the bytes of its file; `path` tells the format and names the file in errors.
///
/// ```
/// use catoptric::io::mesh::parse_mesh;
/// let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
/// assert_eq!(parse_mesh(text.as_bytes(), "one.obj")?.triangles(), [[0, 1, 2]]);
/// let error = parse_mesh(b"v 0 0 zero\n", "two.obj").unwrap_err();
/// assert!(error.to_string().starts_with("two.obj:1:1: "));
/// # Ok::<(), catoptric::io::IoError>(())
/// ```
///
/// # Errors
/// As [`read_mesh`].
pub fn parse_mesh(bytes: &[u8], path: impl AsRef<Path>) -> Result<Mesh, IoError> {
    let path = path.as_ref();
    let end = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    let parsed = match end.as_deref() {
        Some("stl") => stl(bytes),
        Some("obj") => obj(bytes),
        Some("ply") => ply(bytes),
        _ => Err(Fault::Whole(
            "is no mesh that can be read; .stl, .obj and .ply can".to_owned(),
        )),
    };
    parsed.map_err(|fault| match fault {
        Fault::Line(line, message) => IoError::Text {
            path: path.to_owned(),
            line,
            column: 1,
            message,
        },
        Fault::Byte(byte, what) => IoError::Recording {
            path: path.to_owned(),
            what,
            offset: byte as u64,
        },
        Fault::Whole(message) => IoError::content(path, message),
    })
}

/// A mesh as a binary PLY file of 64-bit numbers: read back it is the same mesh.
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

fn finish(vertices: Vec<Point3<f64>>, triangles: Vec<[u32; 3]>) -> Parsed {
    Mesh::new(vertices, triangles).map_err(|e| Fault::Whole(e.to_string()))
}

/// Three numbers of a line, all finite.
fn triple<'a>(
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

/// Numbered lines of text, from 1; bytes that are no UTF-8 become marks that no number holds.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines().enumerate().map(|(i, line)| (i + 1, line.trim()))
}

/// Vertices by their exact coordinates, so that triangles of a format without shared vertices share them again.
#[derive(Default)]
struct Welder {
    vertices: Vec<Point3<f64>>,
    known: HashMap<[u64; 3], u32>,
}

impl Welder {
    fn index(&mut self, point: Point3<f64>) -> Option<u32> {
        // Adding zero makes −0 and 0 one.
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

fn stl(bytes: &[u8]) -> Parsed {
    let count = bytes
        .get(80..STL_HEADER)
        .and_then(|b| b.try_into().ok())
        .map(|b| u32::from_le_bytes(b) as usize);
    let fits = |n: usize| n.checked_mul(STL_TRIANGLE).map(|size| size + STL_HEADER) == Some(bytes.len());
    // A binary header may begin with "solid" as text does; its size is what tells.
    let is_text = bytes.trim_ascii_start().starts_with(b"solid") && !count.is_some_and(fits);
    if is_text {
        return stl_text(&String::from_utf8_lossy(bytes));
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
    if !fits(count) {
        let expected = count as u64 * STL_TRIANGLE as u64 + STL_HEADER as u64;
        return Err(Fault::Byte(
            bytes.len(),
            format!(
                "it says it has {count} triangles, {expected} bytes; it has {} bytes",
                bytes.len()
            ),
        ));
    }
    let mut welder = Welder::default();
    let mut triangles = Vec::with_capacity(count);
    for (i, record) in bytes[STL_HEADER..].chunks_exact(STL_TRIANGLE).enumerate() {
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

fn stl_text(text: &str) -> Parsed {
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

fn obj(bytes: &[u8]) -> Parsed {
    let text = String::from_utf8_lossy(bytes);
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    for (line, content) in lines(&text) {
        let content = content.split('#').next().unwrap_or_default();
        let mut words = content.split_whitespace();
        match words.next() {
            Some("v") => vertices.push(triple(&mut words, line, "a vertex")?),
            Some("f") => {
                let corners = words
                    .map(|word| obj_index(word, vertices.len()).map_err(|m| Fault::Line(line, m)))
                    .collect::<Result<Vec<u32>, _>>()?;
                if corners.len() < 3 {
                    let message = format!("a face has {} corners; 3 at least are needed", corners.len());
                    return Err(Fault::Line(line, message));
                }
                triangles.extend(fan(&corners));
            }
            // Normals, texture, groups, materials, lines and curves: nothing that light meets.
            _ => {}
        }
    }
    finish(vertices, triangles)
}

/// A corner such as `7`, `7/1/3` or `-1`, the last vertex so far, as a number from 0.
fn obj_index(word: &str, count: usize) -> Result<u32, String> {
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

fn fan(corners: &[u32]) -> impl Iterator<Item = [u32; 3]> {
    corners
        .windows(2)
        .skip(1)
        .map(|pair| [corners[0], pair[0], pair[1]])
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

/// How a PLY file writes its numbers.
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

    /// The number in bytes of its size, the least significant first.
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

/// The numbers after a PLY header, one after the other.
struct PlyBody<'a> {
    bytes: &'a [u8],
    at: usize,
    encoding: Encoding,
    line: usize,
}

impl PlyBody<'_> {
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
        while let Some(byte) = self.bytes.get(self.at).filter(|b| b.is_ascii_whitespace()) {
            self.line += usize::from(*byte == b'\n');
            self.at += 1;
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

    /// A whole number that is not negative.
    fn next_index(&mut self, number: Number) -> Result<u32, Fault> {
        let value = self.next(number)?;
        if value.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&value) {
            // In range and whole.
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            return Ok(value as u32);
        }
        Err(self.fault(format!("{value} is no count or number of a vertex")))
    }
}

fn ply(bytes: &[u8]) -> Parsed {
    let (encoding, elements, start, line) = ply_header(bytes)?;
    let mut body = PlyBody {
        bytes,
        at: start,
        encoding,
        line,
    };
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    for element in &elements {
        // An element that takes no bytes would let its count run on for ever.
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
                    triangles.extend(fan(&face));
                } else {
                    for _ in 0..count {
                        body.next(property.number)?;
                    }
                }
            }
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
    finish(vertices, triangles)
}

/// Encoding, elements, where the numbers begin, and in which line.
fn ply_header(bytes: &[u8]) -> Result<(Encoding, Vec<Element>, usize, usize), Fault> {
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut at = 0;
    for line in 1.. {
        let rest = &bytes[at..];
        let Some(end) = rest.iter().position(|b| *b == b'\n') else {
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
    use super::*;

    /// A tetrahedron in every format.
    fn files() -> Vec<(&'static str, Vec<u8>)> {
        let corners = [
            [0.0f32, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 0.5],
        ];
        let faces = [[0usize, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let mut stl_binary = vec![b's'; 80];
        stl_binary[..5].copy_from_slice(b"solid");
        stl_binary.extend(4u32.to_le_bytes());
        let mut stl_text = "solid t\n".to_owned();
        let mut obj = "# a tetrahedron\n".to_owned();
        let mut vertices = String::new();
        let mut indices = String::new();
        let (mut little, mut big) = (Vec::new(), Vec::new());
        for [x, y, z] in corners {
            obj.push_str(&format!("v {x} {y} {z}\n"));
            vertices.push_str(&format!("{x} {y} {z}\n"));
            little.extend([x, y, z].iter().flat_map(|c| c.to_le_bytes()));
            big.extend([x, y, z].iter().flat_map(|c| c.to_be_bytes()));
        }
        for face in faces {
            stl_binary.extend([0; 12]);
            stl_text.push_str("facet normal 0 0 0\nouter loop\n");
            for i in face {
                let [x, y, z] = corners[i];
                stl_binary.extend(corners[i].iter().flat_map(|c| c.to_le_bytes()));
                stl_text.push_str(&format!("vertex {x} {y} {z}\n"));
            }
            stl_binary.extend([0; 2]);
            stl_text.push_str("endloop\nendfacet\n");
            obj.push_str(&format!(
                "f {}/1 {}//2 -{}\n",
                face[0] + 1,
                face[1] + 1,
                4 - face[2]
            ));
            indices.push_str(&format!("3 {} {} {}\n", face[0], face[1], face[2]));
            little.push(3);
            big.push(3);
            for i in face {
                let i = i32::try_from(i).expect("small");
                little.extend(i.to_le_bytes());
                big.extend(i.to_be_bytes());
            }
        }
        stl_text.push_str("endsolid t\n");
        let header = |format: &str| {
            format!(
                "ply\nformat {format} 1.0\ncomment c\nelement vertex 4\nproperty float x\nproperty float y\n\
                 property float z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n"
            )
        };
        let ply = |format, body: &[u8]| [header(format).as_bytes(), body].concat();
        vec![
            ("b.stl", stl_binary),
            ("t.stl", stl_text.into_bytes()),
            ("t.obj", obj.into_bytes()),
            ("t.ply", ply("ascii", (vertices + &indices).as_bytes())),
            ("l.ply", ply("binary_little_endian", &little)),
            ("b.ply", ply("binary_big_endian", &big)),
        ]
    }

    fn corners_of(mesh: &Mesh) -> Vec<[[f64; 3]; 3]> {
        let corner = |v: &u32| mesh.vertices()[*v as usize].coords.into();
        mesh.triangles()
            .iter()
            .map(|t| [corner(&t[0]), corner(&t[1]), corner(&t[2])])
            .collect()
    }

    #[test]
    fn every_format_holds_the_same_mesh() {
        let meshes: Vec<_> = files()
            .iter()
            .map(|(name, bytes)| parse_mesh(bytes, name).unwrap_or_else(|e| panic!("{e}")))
            .collect();
        for mesh in &meshes {
            assert_eq!(corners_of(mesh), corners_of(&meshes[0]));
            assert_eq!(mesh.vertices().len(), 4, "corners are shared");
            assert_eq!(parse_mesh(&to_ply(mesh), "x.ply").expect("our own"), *mesh);
        }
    }

    #[test]
    fn damaged_files_are_errors_and_nothing_worse() {
        for (name, bytes) in files() {
            for cut in 0..bytes.len() {
                let said = parse_mesh(&bytes[..cut], name);
                // Text may be cut in a comment, between two faces or in the last number.
                let is_binary = name.starts_with('b') || name.starts_with('l');
                assert!(!is_binary || said.is_err(), "{name} cut at {cut}");
            }
            for at in 0..bytes.len() {
                for value in [0, 0x20, 0x2d, 0x39, 0x7f, 0x80, 0xff] {
                    let mut damaged = bytes.clone();
                    damaged[at] = value;
                    let _ = parse_mesh(&damaged, name);
                }
            }
        }
    }

    #[test]
    fn errors_say_where() {
        let said = |bytes: &[u8], name: &str| parse_mesh(bytes, name).expect_err("damaged").to_string();
        assert!(said(b"v 0 0 0\nf 1 2 3\n", "a.obj").starts_with("a.obj:2:1: there is no vertex 2"));
        assert!(said(b"v 0 nan 0\n", "a.obj").contains("not finite"));
        assert!(said(b"solid\nvertex 1 2\n", "a.stl").starts_with("a.stl:2:1: a vertex takes three numbers"));
        assert!(said(&[0; 90], "a.stl").contains("(by byte 90)"));
        assert!(
            said(
                b"ply\nformat ascii 1.0\nelement x 99999999999\nend_header\n",
                "a.ply"
            )
            .contains("no properties")
        );
        let cut = &files()[4].1;
        assert!(said(&cut[..cut.len() - 1], "a.ply").contains("ends before its last element"));
        assert!(said(b"x", "a.step").contains(".stl, .obj and .ply"));
    }
}
