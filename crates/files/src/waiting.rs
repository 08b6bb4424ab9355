//! Reading what may never come: pipes, terminals and other files that are not on a disk.
//!
//! The system does not return from such a read, so no request to stop is seen meanwhile. A program that receives a signal asks
//! [`waits_for_input`] and ends itself.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Number of threads that wait for input.
static WAITING: AtomicUsize = AtomicUsize::new(0);

/// Whether any thread waits for input that may never come.
pub fn waits_for_input() -> bool {
    WAITING.load(Ordering::SeqCst) > 0
}

/// A thread that waits, until dropped; counted only if its file may be endless.
struct Waiting(bool);

impl Waiting {
    fn of(is_endless: bool) -> Self {
        if is_endless {
            WAITING.fetch_add(1, Ordering::SeqCst);
        }
        Self(is_endless)
    }
}

impl Drop for Waiting {
    fn drop(&mut self) {
        if self.0 {
            WAITING.fetch_sub(1, Ordering::SeqCst);
        }
    }
}

/// A file that may be a pipe.
pub(super) struct Input {
    file: File,
    is_endless: bool,
}

/// Whether a path names a pipe or a device. Finding out does not wait.
fn is_endless(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|of| !of.is_file() && !of.is_dir())
}

/// Opens a file; a pipe is opened once somebody writes to it.
pub(super) fn open(path: &Path) -> io::Result<Input> {
    let is_endless = is_endless(path);
    let _waiting = Waiting::of(is_endless);
    let file = File::open(path)?;
    Ok(Input { file, is_endless })
}

impl Read for Input {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let _waiting = Waiting::of(self.is_endless);
        self.file.read(buffer)
    }
}

/// Reads a whole file.
///
/// # Errors
/// The error of the operating system if it cannot be read.
pub(super) fn read(path: &Path) -> io::Result<Vec<u8>> {
    let _waiting = Waiting::of(is_endless(path));
    fs::read(path)
}

/// Reads a whole file of text.
///
/// # Errors
/// The error of the operating system if it cannot be read, or is not UTF-8.
pub fn read_text(path: &Path) -> io::Result<String> {
    let _waiting = Waiting::of(is_endless(path));
    fs::read_to_string(path)
}
