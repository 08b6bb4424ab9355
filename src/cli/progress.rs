//! Progress on stderr: a bar on a terminal, a plain line every few seconds elsewhere, nothing if quiet.

use super::Context;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// Time between two plain lines.
const LINE_INTERVAL: Duration = Duration::from_secs(3);

/// Progress of one piece of work of known size. The bar goes when this is dropped.
pub(crate) struct Progress<'a> {
    context: &'a Context,
    what: &'static str,
    total: usize,
    done: usize,
    bar: Option<ProgressBar>,
    last_line: Instant,
}

impl<'a> Progress<'a> {
    /// Begins; `what` reads "simulating".
    pub(crate) fn new(context: &'a Context, what: &'static str, total: usize) -> Self {
        let bar = (std::io::stderr().is_terminal() && !context.global.quiet).then(|| {
            let bar = ProgressBar::new(total as u64).with_message(what);
            match ProgressStyle::with_template("{msg:12} {wide_bar} {pos}/{len} {eta:>4}") {
                Ok(style) => bar.with_style(style),
                Err(_) => bar,
            }
        });
        Self {
            context,
            what,
            total,
            done: 0,
            bar,
            last_line: Instant::now(),
        }
    }

    /// So much more is done.
    pub(crate) fn advance(&mut self, by: usize) {
        self.done += by;
        if let Some(bar) = &self.bar {
            bar.inc(by as u64);
        } else if self.last_line.elapsed() >= LINE_INTERVAL {
            self.last_line = Instant::now();
            self.context
                .say(&format!("{}: {} of {}", self.what, self.done, self.total));
        }
    }
}

impl Drop for Progress<'_> {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
