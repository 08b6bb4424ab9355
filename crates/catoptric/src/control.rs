//! How a long verb runs: when it stops, whom it reports to, on how many threads.

use crate::Error;
use catoptric_model::Stop;
use std::num::NonZeroUsize;
use std::sync::Arc;

/// How a long verb runs. The default runs to its end in silence, on all threads of the machine.
///
/// Nothing here changes a result: a verb that stops has none, and threads change speed only.
///
/// ```
/// use catoptric::{Control, Error, Scene, Template, simulate_with};
///
/// # fn main() -> Result<(), Error> {
/// let scene = Scene::template(Template::TwoMirror);
/// let control = Control::default();
/// control.stop.request();
/// assert!(matches!(simulate_with(&scene, &control), Err(Error::Stopped(_))));
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Default)]
pub struct Control {
    /// Once it is requested, the verb ends with [`Error::Stopped`] within a tenth of a second and leaves nothing
    /// half-written.
    pub stop: Stop,
    /// Called each time some of the work is done, from one thread at a time.
    pub progress: Option<Arc<dyn Fn(Progress) + Send + Sync>>,
    /// Threads to compute with; `None` takes those of the thread pool that the caller is in.
    pub threads: Option<NonZeroUsize>,
}

/// How far a verb has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// What it is doing, such as "simulating".
    pub doing: &'static str,
    /// Steps done since the last report.
    pub more: usize,
    /// Steps in all.
    pub of: usize,
}

impl Control {
    /// Runs some work on the threads that were asked for.
    pub(crate) fn run<T: Send>(&self, work: impl FnOnce() -> Result<T, Error> + Send) -> Result<T, Error> {
        self.check()?;
        match self.threads {
            None => work(),
            Some(threads) => rayon::ThreadPoolBuilder::new()
                .num_threads(threads.get())
                .build()
                .map_err(|e| Error::Threads(e.to_string()))?
                .install(work),
        }
    }

    /// An error once stopping was requested.
    pub(crate) fn check(&self) -> Result<(), Error> {
        Ok(self.stop.check()?)
    }

    /// Reports that some more of the work is done.
    pub(crate) fn report(&self, doing: &'static str, more: usize, of: usize) {
        if let Some(progress) = &self.progress {
            progress(Progress { doing, more, of });
        }
    }
}

impl std::fmt::Debug for Control {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Control")
            .field("stop", &self.stop)
            .field("progress", &self.progress.is_some())
            .field("threads", &self.threads)
            .finish()
    }
}
