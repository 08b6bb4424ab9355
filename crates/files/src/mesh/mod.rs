//! Mesh files: STL, OBJ and PLY, as text and binary; and a lossless PLY writer.
//!
//! The extension determines the format. Damaged files give an error that names the line, or the byte in a binary file;
//! no content can crash the reader, and sizes stated in a file are not trusted before the bytes are read. Polygons of
//! more than three corners are split into a fan.

mod obj;
mod ply;
mod stl;

pub use ply::to_ply;

use super::error::IoError;
use catoptric_sim::Mesh;
use nalgebra::Point3;
use std::fs;
use std::path::Path;

/// Location of an error in a file.
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
/// or [`IoError::Content`] if it is not a valid mesh.
pub fn read_mesh(path: impl AsRef<Path>) -> Result<Mesh, IoError> {
    let path = path.as_ref();
    let bytes = fs::read(path).map_err(|e| IoError::read(path, e))?;
    parse_mesh(&bytes, path)
}

/// Reads a mesh from the bytes of its file; `path` determines the format and names the file in errors.
///
/// ```
/// use catoptric_files::mesh::parse_mesh;
/// let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
/// assert_eq!(parse_mesh(text.as_bytes(), "one.obj")?.triangles(), [[0, 1, 2]]);
/// let error = parse_mesh(b"v 0 0 zero\n", "two.obj").unwrap_err();
/// assert!(error.to_string().starts_with("two.obj:1:1: "));
/// # Ok::<(), catoptric_files::IoError>(())
/// ```
///
/// # Errors
/// As [`read_mesh`].
pub fn parse_mesh(bytes: &[u8], path: impl AsRef<Path>) -> Result<Mesh, IoError> {
    let path = path.as_ref();
    let end = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    let parsed = match end.as_deref() {
        Some("stl") => stl::parse(bytes),
        Some("obj") => obj::parse(bytes),
        Some("ply") => ply::parse(bytes),
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

/// Numbered lines of text, from 1; invalid UTF-8 becomes replacement characters, which no number contains.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines().enumerate().map(|(i, line)| (i + 1, line.trim()))
}

/// A polygon as triangles that share its first corner.
fn fan(corners: &[u32]) -> impl Iterator<Item = [u32; 3]> {
    corners
        .windows(2)
        .skip(1)
        .map(|pair| [corners[0], pair[0], pair[1]])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same tetrahedron in every format.
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
