//! Control of a long verb: stop request, progress reports, number of threads.

use crate::Error;
use catoptric_model::Stop;
use std::num::NonZeroUsize;
use std::sync::Arc;

/// Control of a long verb. The default runs to completion without progress reports, on all threads of the machine.
///
/// Nothing here changes a result: a stopped verb has none, and the number of threads affects speed only.
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
    /// Once a stop is requested, the verb ends with [`Error::Stopped`] within a tenth of a second and leaves no
    /// incomplete files. A few indivisible steps may take longer: the index of a mesh of more than a hundred thousand
    /// triangles, and one evaluation of a calibration with thousands of elements.
    pub stop: Stop,
    /// Called whenever part of the work is done, from one thread at a time.
    pub progress: Option<Arc<dyn Fn(Progress) + Send + Sync>>,
    /// Number of threads; `None` uses the caller's thread pool.
    pub threads: Option<NonZeroUsize>,
}

/// Progress of a verb.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// The current activity, such as "simulating".
    pub doing: &'static str,
    /// Steps done since the last report.
    pub more: usize,
    /// Total number of steps.
    pub of: usize,
}

impl Control {
    /// Runs some work on the requested number of threads. Work that fails after a stop was requested has been stopped.
    pub(crate) fn run<T: Send>(&self, work: impl FnOnce() -> Result<T, Error> + Send) -> Result<T, Error> {
        self.check()?;
        let done = match self.threads {
            None => work(),
            Some(threads) => rayon::ThreadPoolBuilder::new()
                .num_threads(threads.get())
                .build()
                .map_err(|e| Error::Threads(e.to_string()))?
                .install(work),
        };
        done.map_err(|error| self.check().err().unwrap_or(error))
    }

    /// Returns an error once a stop has been requested.
    pub(crate) fn check(&self) -> Result<(), Error> {
        Ok(self.stop.check()?)
    }

    /// Reports `more` steps done, out of `of`.
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
