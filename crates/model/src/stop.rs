//! A request to stop, shared between the caller and a worker.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A request to stop, which long work polls often. Clones share it; it cannot be withdrawn.
///
/// ```
/// use catoptric_model::Stop;
///
/// let stop = Stop::default();
/// let worker = stop.clone();
/// assert!(worker.check().is_ok());
/// stop.request();
/// assert!(worker.check().is_err());
/// ```
#[derive(Debug, Clone, Default)]
pub struct Stop {
    own: Arc<AtomicBool>,
    above: Option<Arc<Stop>>,
}

/// The work was stopped on request; it has no result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("stopped on request")]
pub struct Stopped;

impl Stop {
    /// A request for a part of the work: made along with this one, or on its own without it.
    ///
    /// ```
    /// # use catoptric_model::Stop;
    /// let whole = Stop::default();
    /// let part = whole.part();
    /// part.request();
    /// assert!(whole.check().is_ok() && part.check().is_err());
    /// whole.request();
    /// assert!(whole.part().check().is_err());
    /// ```
    #[must_use]
    pub fn part(&self) -> Self {
        Self {
            own: Arc::default(),
            above: Some(Arc::new(self.clone())),
        }
    }

    /// Requests a stop.
    pub fn request(&self) {
        self.own.store(true, Ordering::SeqCst);
    }

    /// Whether a stop was requested.
    pub fn is_requested(&self) -> bool {
        self.own.load(Ordering::SeqCst) || self.above.as_ref().is_some_and(|above| above.is_requested())
    }

    /// Returns an error once a stop was requested.
    ///
    /// # Errors
    /// [`Stopped`] after [`request`](Self::request).
    pub fn check(&self) -> Result<(), Stopped> {
        if self.is_requested() { Err(Stopped) } else { Ok(()) }
    }
}
