//! Ctrl-C: the first asks long work to stop and clean up, the second ends the program at once.

use super::error::CliError;
use std::sync::atomic::{AtomicBool, Ordering};

/// What the shell is told of a program ended by Ctrl-C: 128 + SIGINT.
const EXIT_CODE: i32 = 130;

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Begins to listen. Where that cannot be, Ctrl-C ends the program at once, as without it.
pub(crate) fn install() {
    let _ = ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::SeqCst) {
            std::process::exit(EXIT_CODE);
        }
    });
}

/// An error once Ctrl-C was pressed. Long loops ask for it.
pub(crate) fn check() -> Result<(), CliError> {
    if INTERRUPTED.load(Ordering::SeqCst) {
        Err(CliError::Interrupted)
    } else {
        Ok(())
    }
}
