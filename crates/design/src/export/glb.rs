//! Export to glTF 2.0 in one binary file: mirrors, posts, housing and beams in their colors, in meters.
//!
//! The up axis is y in glTF and z here: the root node holds the rotation between the two.

use super::ExportPart;
use super::stl::single;
use super::{Solid, solids};
use crate::layout::{Class, Drawing};
use catoptric_assess::palette::facet_color;
use catoptric_sim::Scene;
use nalgebra::{Point3, Vector3};
use serde_json::{Value, json};
use std::collections::BTreeMap;

const GRAY: [u8; 3] = [0x7A, 0x80, 0x87];
const DARK: [u8; 3] = [0x48, 0x4C, 0x52];

/// glTF's constants for component types, buffer targets and primitive modes.
const FLOAT: u32 = 5126;
const ARRAY_BUFFER: u32 = 34962;
const LINES: u32 = 1;
const TRIANGLES: u32 = 4;

/// Every n-th beam is drawn.
const STEP: usize = 2;

/// A glTF file being built.
#[derive(Default)]
struct Builder {
    data: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    materials: Vec<Value>,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
}

impl Builder {
    /// Appends vectors and returns the index of their accessor.
    fn vectors(&mut self, vectors: &[Vector3<f64>]) -> usize {
        let begin = self.data.len();
        for v in vectors {
            self.data.extend(single(v));
        }
        let bound = |fold: fn(f64, f64) -> f64| {
            let all = vectors.iter().copied();
            let v = all
                .reduce(|a, b| a.zip_map(&b, fold))
                .unwrap_or_else(Vector3::zeros);
            // The bounds of the numbers as stored.
            #[allow(clippy::cast_possible_truncation)]
            let stored = [v.x, v.y, v.z].map(|c| f64::from(c as f32));
            stored
        };
        let view = self.views.len();
        self.views.push(json!({
            "buffer": 0, "byteOffset": begin, "byteLength": self.data.len() - begin, "target": ARRAY_BUFFER
        }));
        self.accessors.push(json!({
            "bufferView": view, "componentType": FLOAT, "count": vectors.len(), "type": "VEC3",
            "min": bound(f64::min), "max": bound(f64::max)
        }));
        self.accessors.len() - 1
    }

    fn material(&mut self, name: &str, color: [u8; 3]) -> usize {
        let [r, g, b] = color.map(linear);
        self.materials.push(json!({
            "name": name,
            "doubleSided": true,
            "pbrMetallicRoughness": { "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.8 }
        }));
        self.materials.len() - 1
    }

    fn mesh(&mut self, name: &str, primitive: &Value) {
        self.meshes
            .push(json!({ "name": name, "primitives": [primitive] }));
        self.nodes
            .push(json!({ "name": name, "mesh": self.meshes.len() - 1 }));
    }

    fn solid(&mut self, solid: &Solid, color: [u8; 3]) {
        let corners: Vec<Vector3<f64>> = solid.triangles.iter().flatten().map(|p| p.coords).collect();
        let normals = solid.triangles.iter().flat_map(|[a, b, c]| {
            let normal = (b - a).cross(&(c - a)).try_normalize(0.0);
            [normal.unwrap_or_else(Vector3::z); 3]
        });
        let normals: Vec<Vector3<f64>> = normals.collect();
        let (position, normal) = (self.vectors(&corners), self.vectors(&normals));
        let material = self.material(&solid.name, color);
        self.mesh(
            &solid.name,
            &json!({
                "attributes": { "POSITION": position, "NORMAL": normal }, "material": material, "mode": TRIANGLES
            }),
        );
    }

    fn lines(&mut self, name: &str, ends: &[Vector3<f64>], color: [u8; 3]) {
        let position = self.vectors(ends);
        let material = self.material(name, color);
        self.mesh(
            name,
            &json!({ "attributes": { "POSITION": position }, "material": material, "mode": LINES }),
        );
    }

    fn finish(mut self, name: &str) -> Vec<u8> {
        let children: Vec<usize> = (0..self.nodes.len()).collect();
        let root = self.nodes.len();
        // A quarter turn about x takes our up axis z to the format's y.
        let half = std::f64::consts::FRAC_1_SQRT_2;
        self.nodes
            .push(json!({ "name": name, "rotation": [-half, 0.0, 0.0, half], "children": children }));
        let document = json!({
            "asset": { "version": "2.0", "generator": concat!("catoptric ", env!("CARGO_PKG_VERSION")) },
            "scene": 0,
            "scenes": [{ "name": name, "nodes": [root] }],
            "nodes": self.nodes,
            "meshes": self.meshes,
            "materials": self.materials,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{ "byteLength": self.data.len() }]
        });
        let mut text = document.to_string().into_bytes();
        // The length of a chunk is a multiple of four.
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut data = self.data;
        data.resize(data.len().next_multiple_of(4), 0);
        let length = |bytes: usize| u32::try_from(bytes).unwrap_or(u32::MAX).to_le_bytes();
        let mut file = b"glTF".to_vec();
        file.extend(2_u32.to_le_bytes());
        file.extend(length(12 + 8 + text.len() + 8 + data.len()));
        file.extend(length(text.len()));
        file.extend(b"JSON");
        file.extend(text);
        file.extend(length(data.len()));
        file.extend(b"BIN\0");
        file.extend(data);
        file
    }
}

/// Returns the layout and its beams as a binary glTF file; beams that leave end `reach_m` after their last mirror.
pub fn glb(scene: &Scene, drawing: &Drawing, reach_m: f64) -> Vec<u8> {
    let mut builder = Builder::default();
    for (facet, solid) in solids(scene, drawing, ExportPart::Mirrors).iter().enumerate() {
        builder.solid(solid, facet_color(facet));
    }
    for part in &drawing.parts {
        let solid = Solid {
            name: part.name.clone(),
            triangles: part.skin.clone(),
        };
        builder.solid(&solid, if part.housing { DARK } else { GRAY });
    }
    let mut beams: BTreeMap<Option<usize>, Vec<Vector3<f64>>> = BTreeMap::new();
    for ray in drawing.rays.iter().filter(|r| r.beam.is_multiple_of(STEP)) {
        let key = match ray.class {
            Class::Direct | Class::Deflected | Class::MultiBounce => ray.facets.last().copied(),
            _ => continue,
        };
        let mut points: Vec<Point3<f64>> = ray.points.clone();
        if let (Some(last), Some(exit)) = (points.last().copied(), ray.exit) {
            points.push(last + exit.into_inner() * reach_m);
        }
        let ends = beams.entry(key).or_default();
        ends.extend(
            points
                .windows(2)
                .flat_map(|pair| [pair[0].coords, pair[1].coords]),
        );
    }
    for (facet, ends) in &beams {
        match facet {
            Some(facet) => {
                let name = format!("beams {}", drawing.facets[*facet].name);
                builder.lines(&name, ends, facet_color(*facet));
            }
            None => builder.lines("beams undeflected", ends, GRAY),
        }
    }
    builder.finish(&drawing.name)
}

/// Converts a byte of sRGB to linear light (IEC 61966-2-1).
fn linear(byte: u8) -> f64 {
    let c = f64::from(byte) / 255.0;
    if c <= 0.04045 {
        c / 12.92
    } else {
        libm::pow((c + 0.055) / 1.055, 2.4)
    }
}
