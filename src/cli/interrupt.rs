//! Ctrl-C: the first one requests long work to stop and clean up, the second one ends the program immediately.

use catoptric::Stop;
use std::sync::{LazyLock, Mutex, Once, PoisonError};

/// Exit code of a program ended by Ctrl-C: 128 + SIGINT.
const EXIT_CODE: i32 = 130;

/// The stop request of the current run.
static CURRENT: LazyLock<Mutex<Stop>> = LazyLock::new(Mutex::default);

/// Starts listening for Ctrl-C on behalf of a run. If no handler can be installed, Ctrl-C ends the program immediately.
pub(crate) fn listen() -> Stop {
    static INSTALLED: Once = Once::new();
    INSTALLED.call_once(|| {
        let _ = ctrlc::set_handler(|| {
            let stop = CURRENT.lock().unwrap_or_else(PoisonError::into_inner);
            if stop.is_requested() {
                std::process::exit(EXIT_CODE);
            }
            stop.request();
        });
    });
    let stop = Stop::default();
    *CURRENT.lock().unwrap_or_else(PoisonError::into_inner) = stop.clone();
    stop
}
