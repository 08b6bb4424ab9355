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
pub struct Stop(Arc<AtomicBool>);

/// The work was stopped on request; it has no result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("stopped on request")]
pub struct Stopped;

impl Stop {
    /// Requests a stop.
    pub fn request(&self) {
        self.0.store(true, Ordering::SeqCst);
    }

    /// Whether a stop was requested.
    pub fn is_requested(&self) -> bool {
        self.0.load(Ordering::SeqCst)
    }

    /// Returns an error once a stop was requested.
    ///
    /// # Errors
    /// [`Stopped`] after [`request`](Self::request).
    pub fn check(&self) -> Result<(), Stopped> {
        if self.is_requested() { Err(Stopped) } else { Ok(()) }
    }
}
