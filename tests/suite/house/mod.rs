//! Layering: no file imports one that imports it, no folder of a crate one that uses it, and no crate one above it.
//!
//! The sources of every package are read, tests aside: their `use` lines, and paths in code that begin with `crate`,
//! `super`, a module or a crate. A re-exported name counts for the file that defines it, so a parent that declares its
//! children and re-exports their names imports nothing. Methods are not seen: a method may be defined in a file above the
//! one of its type, and called from anywhere without a path.

mod graph;
mod source;
mod tokens;

use graph::Graph;
use source::Sources;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// A room: a package in `crates/`, or the program.
struct Room {
    name: &'static str,
    /// Rooms that it depends on; it may also use what those depend on.
    on: &'static [&'static str],
    /// Its folders and files from the bottom up, each of which may use those before it; empty if any acyclic order will
    /// do.
    floors: &'static [&'static str],
}

/// The package of the program, at the root.
const PROGRAM: &str = "the program";

const fn room(name: &'static str, on: &'static [&'static str]) -> Room {
    Room {
        name,
        on,
        floors: &[],
    }
}

impl Room {
    const fn with_floors(self, floors: &'static [&'static str]) -> Self {
        Self { floors, ..self }
    }
}

const ROOMS: [Room; 16] = [
    room("model", &[]),
    room("cast", &["model"]).with_floors(&[
        "lanes", "rounding", "hit", "ray", "solid", "index", "packet", "mesh", "shape", "skin", "world",
        "sweep",
    ]),
    room("sim", &["model", "cast"]).with_floors(&[
        "error",
        "findings",
        "lanes",
        "noise",
        "scene",
        "build",
        "light",
        "check",
        "receive",
        "laboratory",
        "trace",
    ]),
    room("calib", &["model"]).with_floors(&[
        "tracking",
        "error",
        "options",
        "lsq",
        "readings",
        "judge",
        "mount",
        "screen",
        "element",
        "prepare",
        "joint",
        "method",
        "calibrate",
        "plan",
        "characterize",
        "calibrator",
    ]),
    room("files", &["model", "sim"]),
    room("assess", &["files", "sim", "calib"]),
    room("design", &["assess"]),
    room("report", &["assess", "design"]),
    room("catoptric", &["files", "assess", "design", "report"]),
    room("fixtures", &["model", "sim"]),
    room("studio", &["catoptric"]),
    room("import", &["catoptric"]),
    room("live", &["catoptric"]),
    room("flight", &["catoptric"]),
    room(PROGRAM, &["catoptric", "studio", "import", "live", "flight"]),
    room("py", &[PROGRAM]),
];

/// The only room that may name each of these packages.
const ONE_USER: [(&str, &str); 1] = [("parry3d", "cast")];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The existing rooms, with their folders.
fn rooms() -> Vec<(&'static Room, PathBuf)> {
    let known = |name: &str| {
        let room = ROOMS.iter().find(|room| room.name == name);
        room.unwrap_or_else(|| panic!("crates/{name} is not among the rooms"))
    };
    let mut found = vec![(known(PROGRAM), root())];
    for entry in std::fs::read_dir(root().join("crates")).unwrap() {
        let folder = entry.unwrap().path();
        if folder.join("Cargo.toml").exists() {
            found.push((known(folder.file_name().unwrap().to_str().unwrap()), folder));
        }
    }
    found
}

/// The rooms that a room may use: all below it.
fn below(room: &Room) -> BTreeSet<&'static str> {
    let mut all = BTreeSet::new();
    let mut open = room.on.to_vec();
    while let Some(name) = open.pop() {
        if all.insert(name) {
            let room = ROOMS.iter().find(|room| room.name == name);
            open.extend(room.expect("every named room exists").on);
        }
    }
    all
}

/// Lines of a section of a `Cargo.toml`.
fn section<'a>(manifest: &'a str, name: &str) -> impl Iterator<Item = &'a str> {
    let head = format!("[{name}]");
    let lines = manifest.lines().skip_while(move |line| *line != head);
    lines.skip(1).take_while(|line| !line.starts_with('['))
}

/// The name by which code refers to a package's library.
fn library(folder: &Path) -> String {
    let manifest = read(&folder.join("Cargo.toml"));
    let name = section(&manifest, "package").find_map(|line| line.strip_prefix("name = "));
    name.expect("a package has a name")
        .trim_matches('"')
        .replace('-', "_")
}

/// All sources, by the room they are in.
fn sources() -> (Sources, Vec<(&'static Room, PathBuf)>) {
    let rooms = rooms();
    let mut sources = Sources::default();
    for (_, folder) in &rooms {
        let library = library(folder);
        for (file, name) in [
            ("lib.rs", library.clone()),
            ("main.rs", format!("{library}'s program")),
        ] {
            let path = folder.join("src").join(file);
            if path.exists() {
                sources.add_crate(&name, &path);
            }
        }
    }
    (sources, rooms)
}

/// The room of a file and its place in it: a folder, or a file next to the folders.
fn place(rooms: &[(&'static Room, PathBuf)], file: &str) -> (&'static str, String) {
    let within = |folder: &PathBuf| {
        Path::new(file)
            .strip_prefix(folder.join("src"))
            .ok()
            .map(Path::to_owned)
    };
    let found = rooms
        .iter()
        .find_map(|(room, folder)| Some((room.name, within(folder)?)));
    let (room, inner) = found.unwrap_or_else(|| panic!("{file} is in a room"));
    let first = inner.iter().next().unwrap().to_str().unwrap();
    (room, first.trim_end_matches(".rs").to_owned())
}

/// The same edges between other things: those that the names map to.
fn contracted(graph: &Graph, to: impl Fn(&str) -> Option<String>) -> Graph {
    let mut contracted = Graph::default();
    for (from, onto, names) in graph.edges() {
        if let (Some(a), Some(b)) = (to(from), to(onto))
            && a != b
        {
            for name in names {
                // A file stands for itself; of what it is in, it is worth naming.
                let told = if a == from {
                    name.clone()
                } else {
                    format!("{name} in {}", short(from))
                };
                contracted.add(&a, &b, &told);
            }
        }
    }
    contracted
}

fn short(file: &str) -> &str {
    let root = root();
    file.strip_prefix(root.to_str().unwrap())
        .unwrap_or(file)
        .trim_start_matches('/')
}

/// Formats cycles.
fn formatted_cycles(graph: &Graph) -> Option<String> {
    let lines = graph.cycle()?.into_iter().map(|(from, onto, names)| {
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        format!(
            "  {} takes {} from {}",
            short(from),
            names.join(", "),
            short(onto)
        )
    });
    Some(lines.collect::<Vec<_>>().join("\n"))
}

#[test]
fn no_file_imports_one_that_imports_it() {
    let (sources, rooms) = sources();
    let all = sources.graph();
    assert!(all.edges().count() > 300, "the sources are not read");
    for (room, _) in &rooms {
        let own = contracted(&all, |file| {
            (place(&rooms, file).0 == room.name).then(|| file.to_owned())
        });
        if let Some(cycle) = formatted_cycles(&own) {
            panic!("a cycle of files:\n{cycle}");
        }
    }
}

#[test]
fn no_folder_uses_one_that_uses_it() {
    let (sources, rooms) = sources();
    let all = sources.graph();
    for (room, _) in &rooms {
        let floors = contracted(&all, |file| {
            let (name, floor) = place(&rooms, file);
            (name == room.name && floor != "lib" && floor != "main").then_some(floor)
        });
        if let Some(cycle) = formatted_cycles(&floors) {
            panic!("a cycle of folders in {}:\n{cycle}", room.name);
        }
        if room.floors.is_empty() {
            continue;
        }
        let height = |floor: &str| {
            let found = room.floors.iter().position(|f| *f == floor);
            found.unwrap_or_else(|| panic!("{floor} has no layer in {}", room.name))
        };
        for (from, onto, names) in floors.edges() {
            assert!(
                height(from) > height(onto),
                "in {}, {from} uses {onto}: {names:?}",
                room.name
            );
        }
    }
}

#[test]
fn no_room_uses_one_above_it() {
    let (sources, rooms) = sources();
    let all = sources.graph();
    let edges = contracted(&all, |file| Some(place(&rooms, file).0.to_owned()));
    let allowed: BTreeMap<&str, BTreeSet<&str>> = ROOMS.iter().map(|r| (r.name, below(r))).collect();
    for (from, onto, names) in edges.edges() {
        assert!(allowed[from].contains(onto), "{from} uses {onto}: {names:?}");
    }
    for (room, folder) in &rooms {
        let manifest = read(&folder.join("Cargo.toml"));
        for line in section(&manifest, "dependencies") {
            let package = line.split(['.', ' ', '=']).next().unwrap();
            if let Some((_, only)) = ONE_USER.iter().find(|(name, _)| *name == package) {
                assert_eq!(room.name, *only, "{package} has one user");
            }
            let other = rooms
                .iter()
                .find(|(_, f)| library(f) == package.replace('-', "_"));
            if let Some((other, _)) = other {
                assert!(
                    allowed[room.name].contains(other.name),
                    "{} depends on {package}",
                    room.name
                );
            }
        }
    }
}

#[test]
fn the_plan_itself_has_no_cycle() {
    for room in &ROOMS {
        assert!(
            !below(room).contains(room.name),
            "{} depends on itself",
            room.name
        );
    }
}
