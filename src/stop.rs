//! A request to stop drawing.

use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering::Relaxed},
};

/// A request to stop drawing a picture, which another thread may make. Clones share it.
///
/// The CPU engine looks at it before each block of tiles, and then ends with
/// [`Error::Stopped`](crate::Error::Stopped). The GPU engine finishes its frame.
#[derive(Debug, Clone, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Asks for the end.
    pub fn request(&self) {
        self.0.store(true, Relaxed);
    }

    /// Returns whether the end was asked for.
    pub fn is_requested(&self) -> bool {
        self.0.load(Relaxed)
    }
}
