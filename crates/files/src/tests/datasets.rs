//! Dataset folders: their contents, when they may be replaced, and that none is left half written.

use super::*;
use crate::dataset::{MANIFEST, OBSERVATIONS, RETURNS, SESSION, read_stretches};
use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

fn provenance() -> Provenance {
    Provenance {
        seed: 7,
        command_line: "catoptric simulate scene.toml --seed 7".to_owned(),
        rng_rule: "test".to_owned(),
    }
}

fn write_dataset(out: &Path, replace: bool, session: &Session, stretches: &[Stretch]) -> Result<(), IoError> {
    let mut writer = DatasetWriter::create(out, replace, session)?;
    for stretch in stretches {
        writer.write_stretch(stretch)?;
    }
    writer.write_scene("name = \"truth\"\n")?;
    writer.write_truth(&BTreeMap::from([("beams", vec![1.0, f64::NAN])]))?;
    let mut returns = writer.open_file(RETURNS)?;
    returns.write_all(b"beam,range_m\n0,1.0\n").expect("row");
    returns.finish()?;
    writer.finish(provenance()).map(|_| ())
}

/// Every path below a folder, relative to it.
fn tree(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("folder") {
        let path = entry.expect("entry").path();
        let name = PathBuf::from(path.file_name().expect("name"));
        if path.is_dir() {
            found.extend(tree(&path).iter().map(|below| name.join(below)));
        }
        found.push(name);
    }
    found.sort();
    found
}

#[test]
fn a_dataset_is_read_without_its_truth_and_without_its_manifest() {
    let place = tempfile::tempdir().expect("folder");
    let out = place.path().join("new/folder/set");
    let session = session(5);
    let stretches = [stretch(&session, 0, 2, 3, 5), stretch(&session, 1, 3, 3, 6)];
    write_dataset(&out, false, &session, &stretches).expect("written");
    let files = [
        "manifest.json",
        "observations.mcap",
        "session.toml",
        "truth",
        RETURNS,
        "truth/scene.toml",
        "truth/truth.json",
    ];
    assert_eq!(tree(&out), files.map(PathBuf::from));
    assert_eq!(tree(out.parent().expect("parent")).len(), files.len() + 1);
    let (session_back, back) = read_stretches(&out).expect("read");
    assert_eq!(session_back, session);
    assert!(same(&back, &stretches));
    let manifest: Manifest = read_json(out.join(MANIFEST)).expect("manifest");
    assert_eq!(
        manifest.scene_sha256.as_ref(),
        manifest.files.get("truth/scene.toml")
    );
    assert_eq!(manifest.files.len(), 5);

    fs::remove_dir_all(out.join("truth")).expect("blind");
    let dataset = read_dataset(&out).expect("blind dataset");
    assert_eq!(dataset.poses.len(), 2);
    fs::remove_file(out.join(MANIFEST)).expect("foreign");
    assert_eq!(
        format!("{dataset:?}"),
        format!("{:?}", read_dataset(&out).expect("read"))
    );
}

#[test]
fn two_datasets_of_one_experiment_are_equal() {
    let place = tempfile::tempdir().expect("folder");
    let session = session(5);
    let stretches = [stretch(&session, 0, 2, 3, 5)];
    let [a, b] = ["a", "b"].map(|n| place.path().join(n));
    write_dataset(&a, false, &session, &stretches).expect("written");
    write_dataset(&b, false, &session, &stretches).expect("written");
    for file in tree(&a).iter().filter(|f| a.join(f).is_file()) {
        let [a, b] = [&a, &b].map(|d| fs::read(d.join(file)).expect("file"));
        assert!(a == b, "{}", file.display());
    }
}

#[test]
fn a_changed_file_is_named() {
    let place = tempfile::tempdir().expect("folder");
    let out = place.path().join("set");
    let session = session(3);
    write_dataset(&out, false, &session, &[stretch(&session, 0, 2, 3, 5)]).expect("written");
    let text = fs::read_to_string(out.join(SESSION)).expect("session");
    // Ends of lines mean nothing.
    fs::write(out.join(SESSION), text.replace('\n', "\r\n")).expect("saved by an editor");
    assert!(read_dataset(&out).is_ok());
    fs::write(out.join(SESSION), text.replace("round trip", "round, trip")).expect("edited");
    let error = read_dataset(&out).expect_err("changed");
    assert!(
        error.to_string().contains("session.toml: changed since"),
        "{error}"
    );
    assert_eq!(error.exit_code(), 2);

    // A third-party dataset with a typo in it.
    fs::remove_file(out.join(MANIFEST)).expect("foreign");
    fs::write(
        out.join(SESSION),
        text.replace("step_deg = 0.25", "step_deg = \"fine\""),
    )
    .expect("edited");
    let error = read_dataset(&out).expect_err("not a number").to_string();
    assert!(
        error.contains("session.toml:") && error.contains("scanner.step_deg"),
        "{error}"
    );
    fs::remove_file(out.join(SESSION)).expect("removed");
    let error = read_dataset(&out).expect_err("missing");
    assert_eq!(error.exit_code(), 3);
    assert!(error.to_string().contains("session.toml"), "{error}");
}

#[test]
fn an_interrupted_writer_leaves_nothing() {
    let place = tempfile::tempdir().expect("folder");
    let out = place.path().join("set");
    let session = session(3);
    let mut writer = DatasetWriter::create(&out, false, &session).expect("begun");
    writer
        .write_stretch(&stretch(&session, 0, 2, 3, 5))
        .expect("written");
    assert!(!out.exists());
    drop(writer);
    assert_eq!(tree(place.path()), Vec::<PathBuf>::new());

    // A stretch that is rejected in the middle leaves the existing dataset untouched.
    let old = [stretch(&session, 0, 2, 3, 5)];
    write_dataset(&out, false, &session, &old).expect("written");
    let before = tree(place.path());
    let mut bad = old[0].clone();
    bad.beams = 4;
    write_dataset(&out, true, &session, &[bad]).expect_err("refused");
    assert_eq!(tree(place.path()), before);
    assert!(same(&read_stretches(&out).expect("still there").1, &old));
}

#[test]
fn only_datasets_are_replaced_and_only_on_request() {
    let place = tempfile::tempdir().expect("folder");
    let out = place.path().join("set");
    let session = session(3);
    let [first, second] = [5, 6].map(|seed| [stretch(&session, 0, 2, 3, seed)]);
    fs::create_dir(&out).expect("an empty folder is fine");
    write_dataset(&out, false, &session, &first).expect("written");
    let error = write_dataset(&out, false, &session, &second).expect_err("exists");
    assert!(matches!(error, IoError::Exists { .. }), "{error}");
    write_dataset(&out, true, &session, &second).expect("replaced");
    assert!(same(&read_stretches(&out).expect("read").1, &second));
    assert_eq!(fs::read_dir(place.path()).expect("folder").count(), 1);
    for notes in [out.join("notes.txt"), out.join("truth/notes.txt")] {
        fs::write(&notes, "not ours").expect("notes");
        let error = write_dataset(&out, true, &session, &first).expect_err("notes would be lost");
        assert!(matches!(error, IoError::Foreign { .. }), "{error}");
        fs::remove_file(&notes).expect("still there");
    }

    let theirs = place.path().join("theirs");
    fs::create_dir(&theirs).expect("folder");
    for content in ["{}", "{\"name\": \"web page\"}"] {
        fs::write(theirs.join(MANIFEST), content).expect("a manifest of another kind");
        let error = write_dataset(&theirs, true, &session, &first).expect_err("foreign");
        assert!(matches!(error, IoError::Foreign { .. }), "{error}");
        assert_eq!(error.exit_code(), 2);
        assert_eq!(tree(&theirs), [PathBuf::from(MANIFEST)]);
    }
    let file = theirs.join(MANIFEST);
    let error = write_dataset(&file, true, &session, &first).expect_err("a file");
    assert!(matches!(error, IoError::Foreign { .. }), "{error}");
}

/// Writes the dataset that `tests/mcap_peers.py` reads: to the folder named by `CATOPTRIC_PEER_DATASET`, or
/// temporarily.
#[test]
fn a_dataset_for_other_readers() {
    let place = tempfile::tempdir().expect("folder");
    let out = std::env::var_os("CATOPTRIC_PEER_DATASET").map_or(place.path().join("set"), PathBuf::from);
    let session = session(1081);
    let mut stretches: Vec<_> = (0..3)
        .map(|i| stretch(&session, i, 20, 50, 40 + i as u64))
        .collect();
    stretches[0].label.kind = PoseKind::Room;
    stretches[0].label.board = None;
    stretches[0].label.facet = None;
    stretches[0].label.beams = None;
    stretches[0].tracks.truncate(1);
    write_dataset(&out, true, &session, &stretches).expect("written");
    let recorded = fs::read(out.join(OBSERVATIONS)).expect("observations");
    assert!(same(&play(&session, &recorded).expect("read"), &stretches));
    read_dataset(&out).expect("a dataset");
}
