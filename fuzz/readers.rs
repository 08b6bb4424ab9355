//! Every reader of a file, as a function of the file's bytes that must neither panic nor take long, whatever they are.
//!
//! The fuzzer (`reader.rs`) and the test suite (`tests/suite/corpus.rs`) run the same functions: to add a reader, add its
//! line to [`READERS`] and a file to `corpus/NAME`. The module above names the crates.

use super::files::{cdr, mesh, messages, playback, rays, scene};
use super::files::{parse_calibration, parse_characterization, parse_dataset, parse_manifest};
use super::files::{parse_session, parse_truth};
use super::model::Session;
use std::path::Path;
use std::sync::OnceLock;

/// Name of a reader, and what reads the bytes of a file.
pub(super) type Reader = (&'static str, fn(&[u8]));

/// All readers.
pub(super) const READERS: [Reader; 14] = [
    ("scene", scene_text),
    ("expression", expression),
    ("session", |bytes| done(parse_session(bytes, "session.toml"))),
    ("manifest", |bytes| done(parse_manifest(bytes, "manifest.json"))),
    ("truth", |bytes| done(parse_truth(bytes, "truth.json"))),
    ("calibration", |bytes| {
        done(parse_calibration(bytes, Path::new("calibration.json")))
    }),
    ("characterization", |bytes| {
        done(parse_characterization(bytes, Path::new("characterization.json")))
    }),
    ("rays", |bytes| all_rays(bytes, "rays.csv")),
    ("npy", |bytes| all_rays(bytes, "rays.npy")),
    ("stl", |bytes| done(mesh::parse_mesh(bytes, "mesh.stl"))),
    ("obj", |bytes| done(mesh::parse_mesh(bytes, "mesh.obj"))),
    ("ply", |bytes| done(mesh::parse_mesh(bytes, "mesh.ply"))),
    ("recording", recording),
    ("message", message),
];

/// Ends a reading: an error must have a message.
fn done<T, E: std::fmt::Display>(read: Result<T, E>) {
    if let Err(error) = read {
        assert!(!error.to_string().is_empty());
    }
}

/// A scene as TOML, or as JSON if it begins with a brace.
fn scene_text(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    let name = if text.starts_with('{') {
        "scene.json"
    } else {
        "scene.toml"
    };
    done(scene::parse(text, name, &[]));
}

/// An expression instead of a number of a scene; its parameters are `a` to `d`.
fn expression(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    let text = text.escape_default();
    let scene = format!(
        "[parameters]\na = 1\nb = {{ value = 2.5, low = 1, high = 3 }}\nc = \"= a + b\"\nd = \"={text}\"\n[room]\nsize_m = [\"={text}\"]\n"
    );
    done(scene::parse(&scene, "scene.toml", &[]));
}

fn all_rays(bytes: &[u8], name: &str) {
    let mut reader = match rays::RayReader::parse(bytes, Path::new(name)) {
        Ok(reader) => reader,
        error => return done(error),
    };
    loop {
        match reader.next_rays(64) {
            Ok(rays) if rays.is_empty() => return,
            Ok(rays) => assert!(rays.iter().all(|r| r.origin.coords.norm().is_finite())),
            error => return done(error),
        }
    }
}

/// The session that belongs to the recordings of the corpus.
fn session() -> &'static Session {
    static SESSION: OnceLock<Session> = OnceLock::new();
    SESSION.get_or_init(|| {
        let text = include_bytes!("corpus/session/small.toml");
        parse_session(text, "small.toml").expect("it is a session")
    })
}

/// A recording, frame by frame and as a dataset.
fn recording(bytes: &[u8]) {
    done(playback::parse_recording(
        bytes,
        Path::new("observations.mcap"),
        session(),
    ));
    done(parse_dataset(session().clone(), bytes));
}

/// A message of a recording, as each of the types that are read.
fn message(bytes: &[u8]) {
    done(messages::decode_scan(bytes));
    done(messages::decode_echoes(bytes));
    done(messages::decode_pose(bytes));
    done(messages::decode_markers(bytes));
    done(messages::decode_text(bytes));
    done(cdr::CdrReader::new(bytes).and_then(|mut reader| reader.string().map(drop)));
}
