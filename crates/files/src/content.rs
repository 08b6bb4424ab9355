//! What a file holds, by its beginning: this decides whether it may be written over.

use super::waiting;
use std::io::{self, Read};
use std::path::Path;

/// Bytes of a file that are read for that.
const HEAD: usize = 1 << 16;

/// What a file holds, as far as its beginning shows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Content {
    /// Nothing.
    Empty,
    /// A scene, TOML or JSON.
    Scene,
    /// What an experimenter knows, `session.toml`.
    Session,
    /// A recording, MCAP.
    Recording,
    /// The manifest of a dataset.
    Manifest,
    /// The truth of a dataset.
    Truth,
    /// A calibration.
    Calibration,
    /// A characterization.
    Characterization,
    /// A score.
    Score,
    /// `layout.json`.
    Layout,
    /// `optimum.json`.
    Optimum,
    /// `tolerance.json`.
    Tolerance,
    /// `study.json`.
    Study,
    /// The plan of a study.
    StudyPlan,
    /// A page of ours.
    Page,
    /// A picture, SVG.
    Svg,
    /// A picture, PNG.
    Png,
    /// A cloud of ours, PLY.
    PlyCloud,
    /// A cloud of ours, PCD.
    PcdCloud,
    /// A mesh of a scene as we keep it, PLY.
    Mesh,
    /// Solids of ours, STL.
    Stl,
    /// A 3D scene of ours, glTF.
    Glb,
    /// Frames of ours, URDF.
    Urdf,
    /// JUnit XML.
    Junit,
    /// A manual page of ours.
    Manual,
    /// A table with this line of column names.
    Table(String),
    /// A NumPy array with this number of columns.
    Array(usize),
    /// Anything else.
    Unknown,
}

/// The first keys of our JSON files, in the order in which they are written.
const JSON: [(&[&str], Content); 11] = [
    (&["schema_version", "method", "frame"], Content::Calibration),
    (&["schema_version", "name", "spots"], Content::Characterization),
    (&["schema_version", "method", "verdict"], Content::Score),
    (&["schema_version", "name", "seed", "sub_rays"], Content::Layout),
    (&["schema_version", "layouts"], Content::Layout),
    (
        &["schema_version", "name", "seed", "evaluations"],
        Content::Optimum,
    ),
    (&["schema_version", "name", "seed", "draws"], Content::Tolerance),
    (
        &["schema_version", "name", "seed", "room_from_rig"],
        Content::Truth,
    ),
    (&["schema_version", "seeds", "methods"], Content::Study),
    (
        &["schema_version", "version", "name", "cells"],
        Content::StudyPlan,
    ),
    (&["schema_version", "version", "git_hash"], Content::Manifest),
];

/// The beginnings of files that need no more than that.
const BEGINNINGS: [(&[u8], Content); 9] = [
    (b"\x89MCAP0\r\n", Content::Recording),
    (b"\x89PNG\r\n\x1a\n", Content::Png),
    (
        b"ply\nformat binary_little_endian 1.0\ncomment catoptric,",
        Content::PlyCloud,
    ),
    (
        b"ply\nformat binary_little_endian 1.0\nelement vertex ",
        Content::Mesh,
    ),
    (
        b"# .PCD v0.7 - Point Cloud Data file format\n# catoptric,",
        Content::PcdCloud,
    ),
    (b"catoptric, millimeters, ", Content::Stl),
    (b"<svg ", Content::Svg),
    (
        b"<?xml version=\"1.0\"?>\n<!-- Frames of a layout of mirrors ",
        Content::Urdf,
    ),
    (
        b"<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites",
        Content::Junit,
    ),
];

/// Keys at the beginnings of lines that scenes have, and sessions.
const SCENE: [&str; 6] = [
    "[scanner",
    "[superstructure",
    "[[superstructure",
    "[room",
    "[experiment",
    "[parameters",
];
const SESSION: &str = "nominal_rig_from_sensor";

impl Content {
    /// What begins with some bytes.
    pub fn of(bytes: &[u8]) -> Self {
        if bytes.is_empty() {
            return Self::Empty;
        }
        let bytes = &bytes[..bytes.len().min(HEAD)];
        if let Some((_, found)) = BEGINNINGS.iter().find(|(start, _)| bytes.starts_with(start)) {
            return found.clone();
        }
        let holds = |text: &[u8]| bytes.windows(text.len()).any(|w| w == text);
        if bytes.starts_with(b"glTF") && holds(b"\"generator\":\"catoptric ") {
            return Self::Glb;
        }
        if bytes.starts_with(b"\x93NUMPY") {
            return array(bytes);
        }
        let bytes = bytes.strip_prefix(super::json::MARK).unwrap_or(bytes);
        let text = String::from_utf8_lossy(bytes);
        if text.starts_with("<!DOCTYPE html>")
            && text.contains("<meta name=\"generator\" content=\"catoptric\">")
        {
            return Self::Page;
        }
        if text.starts_with(".ie \\n(.g") && text.contains("\n.TH catoptric") {
            return Self::Manual;
        }
        if text.trim_start().starts_with('{') {
            return json(&text);
        }
        let begins = |key: &str| text.lines().any(|line| line.trim_start().starts_with(key));
        if begins(SESSION) || begins(&format!("[{SESSION}")) {
            return Self::Session;
        }
        if SCENE.iter().any(|key| begins(key)) {
            return Self::Scene;
        }
        table(&text).unwrap_or(Self::Unknown)
    }

    /// What a file begins with.
    ///
    /// # Errors
    /// The error of the operating system if it cannot be read.
    pub fn of_file(path: &Path) -> io::Result<Self> {
        let mut head = Vec::new();
        waiting::open(path)?.take(HEAD as u64).read_to_end(&mut head)?;
        Ok(Self::of(&head))
    }

    /// Whether a file of this content may be written over by one of the same content: it can be made again by the command
    /// that made it. Scenes, sessions and recordings are what a person or a laboratory made.
    pub fn is_made(&self) -> bool {
        !matches!(
            self,
            Self::Scene
                | Self::Session
                | Self::Recording
                | Self::Manifest
                | Self::Truth
                | Self::Mesh
                | Self::Unknown
        )
    }

    /// What it is, as in "it is a scene".
    pub fn words(&self) -> &'static str {
        match self {
            Self::Empty => "an empty file",
            Self::Scene => "a scene",
            Self::Session => "the session of a dataset",
            Self::Recording => "a recording",
            Self::Manifest => "the manifest of a dataset",
            Self::Truth => "the truth of a dataset",
            Self::Calibration => "a calibration",
            Self::Characterization => "a characterization",
            Self::Score => "a score",
            Self::Layout => "the analysis of a layout",
            Self::Optimum => "the result of a search",
            Self::Tolerance => "the analysis of tolerances",
            Self::Study => "the result of a study",
            Self::StudyPlan => "the plan of a study",
            Self::Page => "a page of catoptric",
            Self::Svg => "an SVG picture",
            Self::Png => "a PNG picture",
            Self::PlyCloud => "a point cloud in PLY",
            Self::PcdCloud => "a point cloud in PCD",
            Self::Mesh => "a mesh",
            Self::Stl => "an STL of catoptric",
            Self::Glb => "a glTF file of catoptric",
            Self::Urdf => "a URDF of catoptric",
            Self::Junit => "JUnit XML",
            Self::Manual => "a manual page of catoptric",
            Self::Table(_) => "a table with other columns",
            Self::Array(_) => "a NumPy array of another width",
            Self::Unknown => "a file that catoptric did not write",
        }
    }
}

/// A NumPy array, by its header.
fn array(bytes: &[u8]) -> Content {
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(256)]).into_owned();
    let columns = text
        .split_once("'shape': (")
        .and_then(|(_, rest)| rest.split_once(')'))
        .and_then(|(shape, _)| shape.split_once(',')?.1.trim().parse().ok());
    columns.map_or(Content::Unknown, Content::Array)
}

/// A table, by a first line that consists of names of columns.
fn table(text: &str) -> Option<Content> {
    let (line, _) = text.split_once('\n')?;
    let line = line.trim_end_matches('\r');
    let is_name = |name: &str| {
        name.starts_with(|c: char| c.is_ascii_alphabetic())
            && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
    };
    let columns = line.split(',');
    (line.contains(',') && columns.into_iter().all(is_name)).then(|| Content::Table(line.to_owned()))
}

/// A JSON file, by its first keys.
fn json(text: &str) -> Content {
    let keys = keys(text);
    let named = |start: &&(&[&str], Content)| {
        keys.len() >= start.0.len() && keys.iter().zip(start.0).all(|(a, b)| a == b)
    };
    if let Some((_, found)) = JSON.iter().find(named) {
        return found.clone();
    }
    let is_scene = |key: &String| ["scanner", "superstructure", "room", "experiment"].contains(&key.as_str());
    if keys.iter().any(is_scene) && keys.iter().any(|key| key == "schema_version") {
        return Content::Scene;
    }
    Content::Unknown
}

/// The keys of the outermost object in the beginning of a JSON file, in order.
fn keys(text: &str) -> Vec<String> {
    let (mut keys, mut depth, mut is_key) = (Vec::new(), 0usize, false);
    let mut characters = text.chars();
    while let Some(c) = characters.next() {
        match c {
            '{' | '[' => {
                depth += 1;
                is_key = depth == 1;
            }
            '}' | ']' => depth = depth.saturating_sub(1),
            ',' => is_key = depth == 1,
            '"' => {
                let mut string = String::new();
                loop {
                    match characters.next() {
                        None => return keys,
                        Some('"') => break,
                        Some('\\') => string.extend(characters.next()),
                        Some(other) => string.push(other),
                    }
                }
                if depth == 1 && is_key {
                    keys.push(string);
                    is_key = false;
                }
            }
            _ => {}
        }
    }
    keys
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_recognized_by_their_beginnings() {
        for (bytes, content) in [
            (&b""[..], Content::Empty),
            (b"\x89MCAP0\r\n\x01", Content::Recording),
            (
                b"{\n  \"schema_version\": 2,\n  \"method\": \"a\\\"b,\", \"frame\": \"sensor\"",
                Content::Calibration,
            ),
            (
                b"{\"schema_version\":1,\"method\":\"joint\",\"verdict\":\"pass\"}",
                Content::Score,
            ),
            (
                b"{\"schema_version\":1,\"layouts\":[{\"name\":1}]}",
                Content::Layout,
            ),
            (
                b"{\"schema_version\": 1, \"name\": \"x\", \"scanner\": {\"preset\": 1}}",
                Content::Scene,
            ),
            (
                b"{\"beams\": [{\"schema_version\": 1, \"method\": 2, \"frame\": 3}]}",
                Content::Unknown,
            ),
            (
                b"# mine\nschema_version = 1\n[scanner]\npreset = \"ust-20lx\"\n",
                Content::Scene,
            ),
            (
                b"schema_version = 2\n[nominal_rig_from_sensor]\n",
                Content::Session,
            ),
            (
                b"ray,vertex,surface\n0,1,x\n",
                Content::Table("ray,vertex,surface".to_owned()),
            ),
            (b"dear reader, this is a letter\n", Content::Unknown),
            (
                b"\x93NUMPY\x01\0v\0{'descr': '<f8', 'fortran_order': False, 'shape': (5, 3), }",
                Content::Array(3),
            ),
            (
                b"<!DOCTYPE html>\n<html><body>mine</body></html>",
                Content::Unknown,
            ),
            (b"\x7fELF\x02\x01", Content::Unknown),
            (b"{", Content::Unknown),
            (b"{\"a", Content::Unknown),
        ] {
            assert_eq!(Content::of(bytes), content, "{}", String::from_utf8_lossy(bytes));
        }
        assert!(!Content::Scene.is_made() && !Content::Unknown.is_made() && Content::Calibration.is_made());
    }
}
