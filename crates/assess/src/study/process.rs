//! Processes of third-party programs: each leads a process group of its own, which ends with it, and all of them end with the
//! run that started them.

use catoptric_model::Stop;
use std::collections::BTreeSet;
use std::io;
use std::process::{Child, Command, ExitStatus};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Interval at which a program is polled for its end.
const POLL: Duration = Duration::from_millis(20);

/// Time that a program is given to end on its own, once it is asked to.
const GRACE: Duration = Duration::from_millis(250);

/// The process groups that were started and are not over. Their leaders have not been waited for, so that their numbers
/// belong to nobody else.
#[derive(Default)]
struct Running {
    groups: BTreeSet<u32>,
    /// Whether none may be started any more.
    closed: bool,
}

static RUNNING: Mutex<Running> = Mutex::new(Running {
    groups: BTreeSet::new(),
    closed: false,
});

/// How a program ended.
pub(super) enum Ended {
    /// On its own.
    Alone(ExitStatus),
    /// Because a stop was requested.
    Stopped,
    /// Because its time was over.
    TimedOut,
}

/// Kills all programs of all studies, and lets none be started any more: for a program that is about to exit without waiting
/// for its studies.
pub fn end_programs() {
    let mut running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
    running.closed = true;
    for group in &running.groups {
        signal(*group, Signal::Kill);
    }
}

/// Runs a program to its end. Whatever it started and left behind ends with it, on Unix.
pub(super) fn run(command: &mut Command, limit: Duration, stop: &Stop) -> io::Result<Ended> {
    let mut child = start(command)?;
    let begin = Instant::now();
    let ended = loop {
        if is_over(&mut child)? {
            break Ok(None);
        }
        if stop.is_requested() {
            break Ok(Some(Ended::Stopped));
        }
        if begin.elapsed() > limit {
            break Ok(Some(Ended::TimedOut));
        }
        std::thread::sleep(POLL);
    };
    if !matches!(ended, Ok::<_, io::Error>(None)) {
        signal(child.id(), Signal::Terminate);
        let asked = Instant::now();
        while asked.elapsed() < GRACE && !is_over(&mut child).unwrap_or(true) {
            std::thread::sleep(POLL);
        }
    }
    {
        let mut running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
        signal(child.id(), Signal::Kill);
        running.groups.remove(&child.id());
    }
    // It may have ended on its own.
    let _ = child.kill();
    let status = child.wait()?;
    Ok(ended?.unwrap_or(Ended::Alone(status)))
}

/// Starts a program as the leader of a new process group.
fn start(command: &mut Command) -> io::Result<Child> {
    #[cfg(unix)]
    {
        use std::os::unix::process::CommandExt;
        command.process_group(0);
    }
    let mut running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
    if running.closed {
        return Err(io::Error::other("the run is ending"));
    }
    let child = command.spawn()?;
    running.groups.insert(child.id());
    Ok(child)
}

/// What a process group is sent.
#[derive(Clone, Copy)]
enum Signal {
    Terminate,
    Kill,
}

/// Sends a signal to a process group, which may be empty already.
#[cfg(unix)]
fn signal(group: u32, signal: Signal) {
    use rustix::process::{Pid, Signal as Unix, kill_process_group};
    let Some(group) = i32::try_from(group).ok().and_then(Pid::from_raw) else {
        return;
    };
    let signal = match signal {
        Signal::Terminate => Unix::TERM,
        Signal::Kill => Unix::KILL,
    };
    let _ = kill_process_group(group, signal);
}

#[cfg(not(unix))]
fn signal(_: u32, _: Signal) {}

/// Whether a program has ended. It is not waited for, so that its number stays its own.
#[cfg(unix)]
fn is_over(child: &mut Child) -> io::Result<bool> {
    use rustix::process::{Pid, WaitId, WaitIdOptions, waitid};
    let Some(pid) = i32::try_from(child.id()).ok().and_then(Pid::from_raw) else {
        return Ok(true);
    };
    let options = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
    match waitid(WaitId::Pid(pid), options) {
        Ok(ended) => Ok(ended.is_some()),
        Err(rustix::io::Errno::INTR) => Ok(false),
        Err(e) => Err(e.into()),
    }
}

#[cfg(not(unix))]
fn is_over(child: &mut Child) -> io::Result<bool> {
    Ok(child.try_wait()?.is_some())
}
