//! Rules of files that concern more than one number: sorted, unique, equally long, within another number.
//!
//! The limits of single numbers stand at their fields, in the schemas of the types.

use super::door::{Readable, schema_of};
#[cfg(feature = "recording")]
use super::manifest::Manifest;
use catoptric_model::place::{KeyPath, Problem};
use catoptric_model::{Calibration, Characterization, PoseData, RangeBias, Session, covariance};
use serde_json::Value as Json;
use std::collections::BTreeMap;
use std::fmt::{Debug, Display};
use std::sync::OnceLock;

/// Tolerance of the length of a quaternion or a normal that was written by hand with one decimal.
const UNIT_TOLERANCE: f64 = 0.1;

/// The schema of a type, which takes longer to make than a file to check.
macro_rules! made_once {
    () => {
        fn schema() -> &'static Json {
            static SCHEMA: OnceLock<Json> = OnceLock::new();
            SCHEMA.get_or_init(schema_of::<Self>)
        }
    };
}

/// Collects problems.
#[derive(Default)]
struct Found(Vec<Problem>);

impl Found {
    /// Records a problem; the message continues from the name of the key.
    fn add(&mut self, path: &KeyPath, message: impl Display) {
        self.0.push(Problem {
            path: path.clone(),
            message: format!("`{path}` {message}"),
            help: None,
        });
    }

    /// Requires that names, or numbers that serve as names, occur once.
    fn unique<T: Ord + Debug>(&mut self, list: &KeyPath, key: &str, names: impl Iterator<Item = T>) {
        let mut seen = BTreeMap::new();
        for (i, name) in names.enumerate() {
            if let Some(first) = seen.get(&name) {
                let message = format!("is {name:?}, as in `{list}[{first}]`: it is listed more than once");
                self.add(&list.index(i).key(key), message);
            } else {
                seen.insert(name, i);
            }
        }
    }

    fn named<'a>(&mut self, list: &KeyPath, names: impl Iterator<Item = &'a str> + Clone) {
        for (i, _) in names
            .clone()
            .enumerate()
            .filter(|(_, name)| name.trim().is_empty())
        {
            self.add(
                &list.index(i).key("name"),
                "is empty; a name needs at least one letter",
            );
        }
        self.unique(list, "name", names);
    }

    /// Requires strictly increasing nodes, and a value for each.
    fn table(&mut self, table: &KeyPath, (name, nodes): (&str, &[f64]), (column, values): (&str, &[f64])) {
        if nodes.len() != values.len() {
            let message = format!(
                "has {} entries, `{table}.{name}` has {}",
                values.len(),
                nodes.len()
            );
            self.add(&table.key(column), message);
        }
        let path = table.key(name);
        for (i, pair) in nodes
            .windows(2)
            .enumerate()
            .filter(|(_, pair)| pair[1] <= pair[0])
        {
            let message = format!("is {}, not more than the {} before it", pair[1], pair[0]);
            self.add(&path.index(i + 1), message);
        }
    }

    fn bias(&mut self, bias: &KeyPath, of: &RangeBias) {
        let distance = &of.distance;
        self.table(
            &bias.key("distance"),
            ("range_m", &distance.range_m),
            ("error_mm", &distance.error_mm),
        );
        if let Some(table) = &of.angle.table {
            self.table(
                &bias.key("angle").key("table"),
                ("incidence_deg", &table.incidence_deg),
                ("error_mm", &table.error_mm),
            );
        }
    }

    fn ordered(&mut self, path: &KeyPath, (low, high): (&str, &str), [least, most]: [f64; 2]) {
        if least >= most {
            let message = format!("is {least}, not less than `{high}`, which is {most}");
            self.add(&path.key(low), message);
        }
    }

    fn unit(&mut self, path: &KeyPath, of: &[f64]) {
        let length = of.iter().map(|x| x * x).sum::<f64>().sqrt();
        if (length - 1.0).abs() > UNIT_TOLERANCE {
            self.add(path, format!("has length {length}; its length must be 1"));
        }
    }

    fn pose(&mut self, path: &KeyPath, pose: &PoseData) {
        self.unit(&path.key("rotation_xyzw"), &pose.rotation_xyzw);
    }

    fn square(&mut self, path: &KeyPath, rows: &[Vec<f64>], size: usize, of: &str) -> bool {
        let before = self.0.len();
        if rows.len() != size {
            self.add(
                path,
                format!("has {} rows, and there are {size} {of}", rows.len()),
            );
        }
        for (i, row) in rows.iter().enumerate().filter(|(_, row)| row.len() != rows.len()) {
            self.add(
                &path.index(i),
                format!("has {} entries, and there are {} rows", row.len(), rows.len()),
            );
        }
        self.0.len() == before
    }

    fn covariance(&mut self, path: &KeyPath, size: usize, entry: impl Fn(usize, usize) -> f64) {
        if let Err(message) = covariance::check(size, entry) {
            self.add(path, message);
        }
    }

    fn beams(&mut self, path: &KeyPath, beam: usize, beams: usize) {
        if beam >= beams {
            self.add(
                path,
                format!(
                    "is {beam}; the scanner has the beams 0 to {}",
                    beams.saturating_sub(1)
                ),
            );
        }
    }
}

impl Readable for Session {
    made_once!();

    fn problems(&self) -> Vec<Problem> {
        let mut found = Found::default();
        let (of, scanner) = (KeyPath::of, &self.scanner);
        let beams = scanner.scan.beams();
        found.ordered(
            &of("scanner"),
            ("range_min_m", "range_max_m"),
            [scanner.range_min_m, scanner.range_max_m],
        );
        found.pose(&of("nominal_rig_from_sensor"), &self.nominal_rig_from_sensor);
        if let Some(room) = &self.room {
            for (axis, (min, max)) in room
                .min_m
                .iter()
                .zip(room.max_m)
                .enumerate()
                .filter(|(_, (a, b))| *a >= b)
            {
                let message = format!("is {min}, not less than `room.max_m[{axis}]`, which is {max}");
                found.add(&of("room").key("min_m").index(axis), message);
            }
        }
        let believed = of("believed");
        found.bias(&believed.key("bias"), &self.believed.bias);
        let noise = &self.believed.noise;
        let mut tables: Vec<_> = noise.iter().map(|table| (believed.key("noise"), table)).collect();
        for (color, table) in &self.believed.noise_of {
            tables.push((believed.key("noise_of").key(color), table));
        }
        for (path, table) in tables {
            found.table(&path, ("range_m", &table.range_m), ("sd_mm", &table.sd_mm));
        }
        let bare = &self.bare_structure;
        let path = of("bare_structure");
        if !bare.distance_m.is_empty() {
            found.beams(&path.key("first_beam"), bare.first_beam, beams);
            if bare.first_beam < beams && bare.distance_m.len() > beams - bare.first_beam {
                let message = format!(
                    "has {} entries, but there are {} beams from `first_beam` on",
                    bare.distance_m.len(),
                    beams - bare.first_beam
                );
                found.add(&path.key("distance_m"), message);
            }
        }
        found.named(
            &of("rig_markers"),
            self.rig_markers.iter().map(|m| m.name.as_str()),
        );
        found.named(&of("facets"), self.facets.iter().map(|f| f.name.as_str()));
        for (i, facet) in self.facets.iter().enumerate() {
            for (end, beam) in facet.beams.iter().enumerate() {
                found.beams(&of("facets").index(i).key("beams").index(end), *beam, beams);
            }
        }
        found.named(&of("boards"), self.boards.iter().map(|b| b.name.as_str()));
        for (i, board) in self.boards.iter().enumerate() {
            let path = of("boards").index(i).key("markers");
            found.named(&path, board.markers.iter().map(|m| m.name.as_str()));
        }
        found.0
    }
}

/// Well formed is all that is asked of a calibration here: how plausible it is, and which mistake was made where it is
/// not, is up to `validate`, which every verdict begins with.
impl Readable for Calibration {
    made_once!();

    fn problems(&self) -> Vec<Problem> {
        let mut found = Found::default();
        if let Some(Err(wrong)) = self.scanner.map(|angles| angles.check()) {
            found.add(&KeyPath::of("scanner").key(wrong.key), wrong.problem);
        }
        if let Some(bias) = &self.bias {
            found.bias(&KeyPath::of("bias"), bias);
        }
        if let Some(assessment) = &self.assessment {
            let path = KeyPath::of("assessment").key("correlations");
            found.square(
                &path,
                &assessment.correlations,
                assessment.parameters.len(),
                "parameters",
            );
        }
        found.0
    }
}

impl Readable for Characterization {
    made_once!();

    fn problems(&self) -> Vec<Problem> {
        let mut found = Found::default();
        let of = KeyPath::of;
        found.bias(&of("bias"), &self.bias);
        let path = of("covariance");
        if found.square(&path, &self.covariance, self.parameters.len(), "parameters") {
            found.covariance(&path, self.covariance.len(), |i, j| self.covariance[i][j]);
        }
        if let Some(line) = &self.distance_line {
            let path = of("distance_line").key("covariance");
            found.covariance(&path, 2, |i, j| line.covariance[i][j]);
        }
        let mount = &self.rig_from_sensor;
        found.unit(&of("rig_from_sensor").key("rotation_xyzw"), &mount.rotation_xyzw);
        if let Some(c) = mount.covariance {
            found.covariance(&of("rig_from_sensor").key("covariance"), 6, |i, j| c[i][j]);
        }
        found.0
    }
}

#[cfg(feature = "recording")]
impl Readable for Manifest {
    made_once!();

    fn problems(&self) -> Vec<Problem> {
        let mut found = Found::default();
        let hashes = self
            .files
            .iter()
            .map(|(name, hash)| (KeyPath::of("files").key(name), hash));
        let scene = self
            .scene_sha256
            .iter()
            .map(|hash| (KeyPath::of("scene_sha256"), hash));
        for (path, hash) in scene.chain(hashes) {
            if hash.len() != 64 || !hash.bytes().all(|b| b.is_ascii_hexdigit()) {
                found.add(&path, format!("is {hash:?}; a SHA-256 has 64 hexadecimal digits"));
            }
        }
        found.0
    }
}

#[cfg(feature = "scene")]
impl Readable for catoptric_sim::Truth {
    made_once!();

    fn problems(&self) -> Vec<Problem> {
        let mut found = Found::default();
        let of = KeyPath::of;
        found.pose(&of("room_from_rig"), &self.room_from_rig);
        found.pose(&of("rig_from_sensor"), &self.rig_from_sensor);
        found.bias(&of("bias"), &self.bias);
        let facets = of("facets");
        found.named(&facets, self.facets.iter().map(|f| f.name.as_str()));
        for (i, facet) in self.facets.iter().enumerate() {
            found.unit(&facets.index(i).key("normal"), &facet.normal);
        }
        let known: std::collections::BTreeSet<&str> = self.facets.iter().map(|f| f.name.as_str()).collect();
        let beams = of("beams");
        found.unique(&beams, "beam", self.beams.iter().map(|b| b.beam));
        for (i, beam) in self.beams.iter().enumerate() {
            let path = beams.index(i);
            for (j, name) in beam
                .facets
                .iter()
                .enumerate()
                .filter(|(_, name)| !known.contains(name.as_str()))
            {
                found.add(
                    &path.key("facets").index(j),
                    format!("is {name:?}, which is no facet of the file"),
                );
            }
            if beam.points_m.len() != beam.facets.len() {
                let message = format!(
                    "has {} entries, `{path}.facets` has {}",
                    beam.points_m.len(),
                    beam.facets.len()
                );
                found.add(&path.key("points_m"), message);
            }
        }
        for (i, pose) in self.poses.iter().enumerate() {
            let path = of("poses").index(i);
            let boards = [
                ("room_from_board", &pose.room_from_board),
                ("room_from_board_after", &pose.room_from_board_after),
            ];
            for (key, board) in boards {
                if let Some(board) = board {
                    found.pose(&path.key(key), board);
                }
            }
            for (j, sensor) in pose.room_from_sensor.iter().enumerate() {
                found.pose(&path.key("room_from_sensor").index(j), sensor);
            }
        }
        found.0
    }
}
