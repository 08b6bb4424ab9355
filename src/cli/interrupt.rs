//! Ctrl-C, SIGTERM and SIGHUP: the first one requests long work to stop and clean up, the next one ends the program
//! immediately, with all programs it has started. A signal that is ignored when the program starts stays ignored.

use catoptric::files::waiting::waits_for_input;
use catoptric::{Stop, study};
use std::io::Write;
use std::sync::atomic::{AtomicI32, Ordering};
use std::sync::{LazyLock, Mutex, Once, PoisonError};
use std::time::{Duration, Instant};

/// A program ended by a signal has this exit code plus the signal's number, as in a shell.
const BY_SIGNAL: i32 = 128;

/// SIGINT, which Ctrl-C sends, on every system.
const SIGINT: i32 = 2;

/// Signals within this time of the first are the same one: `timeout` sends its signal twice, to a process and its group.
const SAME: Duration = Duration::from_millis(200);

/// The stop request of the current run, and when the signal for it came.
static CURRENT: LazyLock<Mutex<(Stop, Option<Instant>)>> = LazyLock::new(Mutex::default);

/// The signal that stopped the current run; 0 for none.
static SIGNAL: AtomicI32 = AtomicI32::new(0);

/// Starts listening on behalf of a run. If no handler can be installed, signals end the program immediately.
pub(crate) fn listen() -> Stop {
    static INSTALLED: Once = Once::new();
    INSTALLED.call_once(install);
    let stop = Stop::default();
    SIGNAL.store(0, Ordering::SeqCst);
    *CURRENT.lock().unwrap_or_else(PoisonError::into_inner) = (stop.clone(), None);
    stop
}

/// Exit code of a run that was stopped: 130 after Ctrl-C, 143 after SIGTERM, 129 after SIGHUP.
pub(crate) fn exit_code() -> u8 {
    let signal = match SIGNAL.load(Ordering::SeqCst) {
        0 => SIGINT,
        signal => signal,
    };
    u8::try_from(BY_SIGNAL + signal).unwrap_or(u8::MAX)
}

/// What happened to a run that was stopped.
pub(crate) fn word() -> &'static str {
    match SIGNAL.load(Ordering::SeqCst) {
        1 => "hung up",
        15 => "terminated",
        _ => "interrupted",
    }
}

fn received(signal: i32) {
    let mut current = CURRENT.lock().unwrap_or_else(PoisonError::into_inner);
    match current.1 {
        None => {
            SIGNAL.store(signal, Ordering::SeqCst);
            current.1 = Some(Instant::now());
            current.0.request();
            let _ = std::thread::Builder::new().spawn(move || end_a_wait(signal));
        }
        Some(first) if first.elapsed() < SAME => {}
        Some(_) => {
            study::end_programs();
            std::process::exit(BY_SIGNAL + signal);
        }
    }
}

/// Ends the program once it waits for input, where no request to stop is seen.
fn end_a_wait(signal: i32) {
    loop {
        if waits_for_input() {
            study::end_programs();
            // If stderr is closed, there is nowhere left to report to.
            let _ = writeln!(anstream::stderr(), "{} while waiting for input", word());
            std::process::exit(BY_SIGNAL + signal);
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[cfg(unix)]
fn install() {
    use signal_hook::consts::{SIGHUP, SIGTERM, SIGXFSZ};
    // A file that becomes larger than the system allows is an error like a full disk, not the end of the program.
    let _ = signal_hook::flag::register(SIGXFSZ, std::sync::Arc::default());
    let ignored = ignored();
    let is_ignored = |signal: i32| ignored.map_or(signal == SIGHUP, |mask| mask >> (signal - 1) & 1 == 1);
    let wanted = [SIGINT, SIGTERM, SIGHUP].into_iter().filter(|s| !is_ignored(*s));
    if let Ok(mut signals) = signal_hook::iterator::Signals::new(wanted) {
        let listener = std::thread::Builder::new().name("signals".to_owned());
        let _ = listener.spawn(move || signals.forever().for_each(received));
    }
}

#[cfg(not(unix))]
fn install() {
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;
    let came = Arc::new(AtomicBool::new(false));
    if signal_hook::flag::register(SIGINT, came.clone()).is_ok() {
        std::thread::spawn(move || {
            loop {
                if came.swap(false, Ordering::SeqCst) {
                    received(SIGINT);
                }
                std::thread::sleep(Duration::from_millis(20));
            }
        });
    }
}

/// The signals that were ignored when the program started, a bit each; none where the system does not say it in a file, and
/// where SIGHUP is therefore left as it was.
#[cfg(unix)]
fn ignored() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"))?;
    u64::from_str_radix(mask.trim(), 16).ok()
}
