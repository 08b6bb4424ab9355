//! The fuzzer of one reader, which the environment variable `READER` names. `./run` builds and runs it.
#![no_main]

mod readers;

use catoptric_files as files;
use catoptric_model as model;
use libfuzzer_sys::fuzz_target;
use std::sync::OnceLock;

fn chosen() -> fn(&[u8]) {
    static CHOSEN: OnceLock<fn(&[u8])> = OnceLock::new();
    *CHOSEN.get_or_init(|| {
        let name = std::env::var("READER").unwrap_or_default();
        let found = readers::READERS.into_iter().find(|(known, _)| *known == name);
        let known = readers::READERS.map(|(name, _)| name).join(", ");
        found.unwrap_or_else(|| panic!("READER is {name:?}; known: {known}")).1
    })
}

fuzz_target!(|bytes: &[u8]| chosen()(bytes));
