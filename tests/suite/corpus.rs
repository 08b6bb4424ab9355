//! The fuzzer's corpus, on every run of the tests: seeds for all readers, and every input that once was a fault.
//!
//! This proves that no reader panics on these inputs, not that it gives the right values; the fuzzer itself (`fuzz/run`)
//! looks for others.

use catoptric::{files, model};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

#[path = "../../fuzz/readers.rs"]
mod readers;

pub(crate) fn corpus() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus")
}

fn names(folder: &Path) -> BTreeSet<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    entries
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect()
}

#[test]
fn no_reader_panics_on_the_corpus() {
    let readers: BTreeSet<String> = readers::READERS
        .iter()
        .map(|(name, _)| (*name).to_owned())
        .collect();
    assert_eq!(names(&corpus()), readers, "one folder for every reader");
    for (name, read) in readers::READERS {
        let folder = corpus().join(name);
        let files = names(&folder);
        assert!(!files.is_empty(), "{name} has no seeds");
        for file in files {
            let bytes = std::fs::read(folder.join(&file)).unwrap();
            // The name in the message of a panic.
            let begun = std::panic::catch_unwind(|| read(&bytes));
            assert!(begun.is_ok(), "{name} panics on {file}");
            // Cut short anywhere near its end, as a file whose disk was full.
            for end in (0..bytes.len()).rev().take(32) {
                read(&bytes[..end]);
            }
        }
    }
}
