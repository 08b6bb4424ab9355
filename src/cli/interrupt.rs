//! Ctrl-C: the first asks long work to stop and clean up, the second ends the program at once.

use catoptric::Stop;
use std::sync::{LazyLock, Mutex, Once, PoisonError};

/// What the shell is told of a program ended by Ctrl-C: 128 + SIGINT.
const EXIT_CODE: i32 = 130;

/// The request to stop of the run that is under way.
static CURRENT: LazyLock<Mutex<Stop>> = LazyLock::new(Mutex::default);

/// Begins to listen for a run. Where that cannot be, Ctrl-C ends the program at once, as without it.
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
