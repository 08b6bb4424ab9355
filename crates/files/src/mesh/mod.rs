//! Mesh files: STL, OBJ and PLY, as text and binary; and a lossless PLY writer.
//!
//! The extension determines the format: to add one, write its file with its row, and add its variant to [`MeshFormat`].
//! Damaged files give an error that names the line, or the byte in a binary file; no content can crash the reader, and
//! sizes stated in a file are not trusted before the bytes are read. Polygons of more than three corners are split into
//! triangles.

mod obj;
mod ply;
mod polygon;
mod row;
mod stl;

pub use ply::to_ply;

use super::error::IoError;
use super::extension::{by_extension, listed};
use super::paths::unread;
use super::waiting;
use catoptric_sim::Mesh;
use row::{Fault, Row};
use std::path::Path;

catoptric_model::closed_set! {
    /// A format of mesh files.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum MeshFormat {
        /// Triangles without shared vertices, as text or binary.
        Stl,
        /// Vertices and faces as text.
        Obj,
        /// Stanford's polygon file format, as text or binary.
        Ply,
    }
}

impl MeshFormat {
    const fn row(self) -> &'static Row {
        match self {
            Self::Stl => &stl::ROW,
            Self::Obj => &obj::ROW,
            Self::Ply => &ply::ROW,
        }
    }

    /// The extension of its files.
    pub fn extension(self) -> &'static str {
        self.row().extension
    }
}

/// Reads a mesh in the unit of its file.
///
/// # Errors
/// [`IoError::Read`] if the file cannot be read; [`IoError::Text`] with the line, [`IoError::Recording`] with the byte
/// or [`IoError::Content`] if it is not a valid mesh.
pub fn read_mesh(path: impl AsRef<Path>) -> Result<Mesh, IoError> {
    let path = path.as_ref();
    let bytes = waiting::read(path).map_err(|e| IoError::read(path, unread(path, e)))?;
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
    let Some(format) = by_extension(path, &MeshFormat::ALL, MeshFormat::extension) else {
        let known = listed(&MeshFormat::ALL, MeshFormat::extension, "and");
        let message = format!("is no mesh that can be read; {known} can");
        return Err(IoError::content(path, message));
    };
    (format.row().parse)(bytes).map_err(|fault| match fault {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The same tetrahedron in every format.
    fn files() -> Vec<(&'static str, Vec<u8>)> {
        let samples = MeshFormat::ALL.map(|format| (format.row().samples)());
        samples.into_iter().flatten().collect()
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
        for format in MeshFormat::ALL {
            let ours = |(name, _): &(&str, _)| name.ends_with(&format!(".{}", format.extension()));
            assert!((format.row().samples)().iter().all(ours), "{format:?}");
        }
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

    /// A U of 6 m by 4 m whose notch is 2 m wide and 3 m deep: a fan from its first corner would cover the notch.
    #[test]
    fn the_notch_of_a_concave_face_stays_open_in_every_text() {
        let corners = [[0, 0], [6, 0], [6, 4], [4, 4], [4, 1], [2, 1], [2, 4], [0, 4]];
        let vertices = |before: &str| corners.map(|[x, y]| format!("{before}{x} {y} 0\n")).concat();
        let obj = format!("{}f 1 2 3 4 5 6 7 8\n", vertices("v "));
        let ply = format!(
            "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
             property list uchar int vertex_indices\nend_header\n{}8 0 1 2 3 4 5 6 7\n",
            vertices("")
        );
        for (name, text) in [("u.obj", obj), ("u.ply", ply)] {
            let mesh = parse_mesh(text.as_bytes(), name).expect("a mesh");
            let (mut area, mut in_notch) = (0.0, false);
            for [a, b, c] in corners_of(&mesh) {
                let cross = |p: [f64; 3], q: [f64; 3], r: [f64; 3]| {
                    (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
                };
                area += 0.5 * cross(a, b, c);
                let inside = [3.0, 2.5, 0.0];
                let sides = [cross(a, b, inside), cross(b, c, inside), cross(c, a, inside)];
                in_notch |= sides.iter().all(|s| *s > 0.0) || sides.iter().all(|s| *s < 0.0);
            }
            assert!((area - 18.0).abs() < 1e-12 && !in_notch, "{name}: {area}");
        }
    }

    #[test]
    fn damaged_files_are_errors_and_nothing_worse() {
        for (name, bytes) in files() {
            for cut in 0..bytes.len() {
                let said = parse_mesh(&bytes[..cut], name);
                // Text may be cut in a comment, between two faces or in the last number.
                let is_binary = !name.starts_with("text");
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

    /// A square of 2 m as other programs write it.
    #[test]
    fn peculiarities_of_other_programs_change_nothing() {
        let obj = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nf 1 2 3 4\n";
        let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face \
                   1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n2 0 0\n2 2 0\n0 2 0\n4 0 1 2 3\n";
        let facet = |[a, b, c]: [&str; 3]| {
            format!("facet normal 0 0 1\nouter loop\nvertex {a}\nvertex {b}\nvertex {c}\nendloop\nendfacet\n")
        };
        let stl = format!(
            "solid sq\n{}{}endsolid sq\n",
            facet(["0 0 0", "2 0 0", "2 2 0"]),
            facet(["0 0 0", "2 2 0", "0 2 0"])
        );
        let expected = corners_of(&parse_mesh(obj.as_bytes(), "a.obj").expect("plain"));
        let strips = ply
            .replace("element face 1", "element tristrips 1")
            .replace("4 0 1 2 3", "8 0 1 2 -1 0 2 3 -1");
        let mut spare = vec![b'x'; 80];
        spare.extend(2_u32.to_le_bytes());
        for [a, b, c] in &expected {
            spare.extend([0; 12]);
            #[allow(clippy::cast_possible_truncation)]
            spare.extend(
                [a, b, c]
                    .into_iter()
                    .flatten()
                    .flat_map(|x| (*x as f32).to_le_bytes()),
            );
            spare.extend([0; 2]);
        }
        spare.extend(b"end.");
        let marked = |text: &str| format!("\u{feff}{text}").into_bytes();
        let cases: [(&str, Vec<u8>); 11] = [
            ("mark.obj", marked(obj)),
            ("mark.ply", marked(ply)),
            ("mark.stl", marked(&stl)),
            ("upper.stl", stl.to_ascii_uppercase().into_bytes()),
            ("continued.obj", obj.replace("1 2 3", "1 2 \\\n 3").into_bytes()),
            ("strips.ply", strips.into_bytes()),
            ("cr.obj", obj.replace('\n', "\r").into_bytes()),
            ("cr.ply", ply.replace('\n', "\r").into_bytes()),
            ("cr.stl", stl.replace('\n', "\r").into_bytes()),
            ("spare.stl", spare),
            (
                "rows.ply",
                ply.replace("2 2 0\n", "2 2 0 255 128 0\n").into_bytes(),
            ),
        ];
        for (name, bytes) in cases {
            let mesh = parse_mesh(&bytes, name).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(corners_of(&mesh), expected, "{name}");
        }
        let nan = obj.replace("2 2 0", "2 2 1.#QNAN0");
        let error = parse_mesh(nan.as_bytes(), "a.obj")
            .expect_err("refused")
            .to_string();
        assert!(
            error.starts_with("a.obj:3:1: ") && error.contains("not a number"),
            "{error}"
        );
    }

    #[test]
    fn errors_say_where() {
        let said = |bytes: &[u8], name: &str| parse_mesh(bytes, name).expect_err("damaged").to_string();
        assert!(said(b"v 0 0 0\nf 1 2 3\n", "a.obj").starts_with("a.obj:2:1: there is no vertex 2"));
        assert!(said(b"v 0 nan 0\n", "a.obj").contains("not finite"));
        assert!(said(b"solid\nvertex 1 2\n", "a.stl").starts_with("a.stl:2:1: a vertex takes three numbers"));
        assert!(said(&[1; 90], "a.stl").contains("(by byte 90)"));
        assert!(
            said(
                b"ply\nformat ascii 1.0\nelement x 99999999999\nend_header\n",
                "a.ply"
            )
            .contains("no properties")
        );
        let (_, cut) = (ply::ROW.samples)().swap_remove(1);
        assert!(said(&cut[..cut.len() - 1], "a.ply").contains("ends before its last element"));
        let unknown = said(b"x", "a.step");
        for format in MeshFormat::ALL {
            assert!(unknown.contains(&format!(".{}", format.extension())), "{unknown}");
        }
    }
}
