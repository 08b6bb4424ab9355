//! Ctrl-C: the first asks long work to stop and clean up, the second ends the program at once.

use super::error::CliError;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock};

/// What the shell is told of a program ended by Ctrl-C: 128 + SIGINT.
const EXIT_CODE: i32 = 130;

static INTERRUPTED: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);

/// Begins to listen. Where that cannot be, Ctrl-C ends the program at once, as without it.
pub(crate) fn install() {
    let _ = ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::SeqCst) {
            std::process::exit(EXIT_CODE);
        }
    });
}

/// Set once Ctrl-C was pressed, for what must not know of this program.
pub(crate) fn flag() -> Arc<AtomicBool> {
    INTERRUPTED.clone()
}

/// An error once Ctrl-C was pressed. Long loops ask for it.
pub(crate) fn check() -> Result<(), CliError> {
    if INTERRUPTED.load(Ordering::SeqCst) {
        Err(CliError::Interrupted)
    } else {
        Ok(())
    }
}
