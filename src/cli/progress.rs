//! Progress on stderr: a bar on a terminal, otherwise a plain line every few seconds; nothing with `--quiet`.

use catoptric::Progress;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Time between two plain lines.
const LINE_INTERVAL: Duration = Duration::from_secs(3);

/// Shows the progress of the current piece of work.
pub(crate) struct Reporter {
    quiet: bool,
    current: Mutex<Option<Work>>,
}

/// A piece of work of known size.
struct Work {
    doing: &'static str,
    done: usize,
    bar: Option<ProgressBar>,
    last_line: Instant,
}

impl Reporter {
    /// Creates a reporter, which shows nothing if quiet.
    pub(crate) fn new(quiet: bool) -> Self {
        Self {
            quiet,
            current: Mutex::new(None),
        }
    }

    /// Adds some progress; a report of zero progress begins a new piece of work.
    pub(crate) fn report(&self, progress: Progress) {
        let mut current = self.current.lock().unwrap_or_else(PoisonError::into_inner);
        if progress.more == 0 || current.as_ref().is_none_or(|work| work.doing != progress.doing) {
            clear(current.take());
            *current = Some(self.begin(progress));
        }
        let Some(work) = current.as_mut() else { return };
        work.done += progress.more;
        if let Some(bar) = &work.bar {
            bar.inc(progress.more as u64);
        } else if work.last_line.elapsed() >= LINE_INTERVAL && !self.quiet {
            work.last_line = Instant::now();
            // If stderr is closed, there is nowhere left to report to.
            let _ = writeln!(
                anstream::stderr(),
                "{}: {} of {}",
                work.doing,
                work.done,
                progress.of
            );
        }
    }

    /// Removes the bar before anything else is printed.
    pub(crate) fn finish(&self) {
        clear(self.current.lock().unwrap_or_else(PoisonError::into_inner).take());
    }

    fn begin(&self, progress: Progress) -> Work {
        let bar = (std::io::stderr().is_terminal() && !self.quiet).then(|| {
            let bar = ProgressBar::new(progress.of as u64).with_message(progress.doing);
            match ProgressStyle::with_template("{msg:12} {wide_bar} {pos}/{len} {eta:>4}") {
                Ok(style) => bar.with_style(style),
                Err(_) => bar,
            }
        });
        Work {
            doing: progress.doing,
            done: 0,
            bar,
            last_line: Instant::now(),
        }
    }
}

fn clear(work: Option<Work>) {
    if let Some(bar) = work.and_then(|work| work.bar) {
        bar.finish_and_clear();
    }
}
