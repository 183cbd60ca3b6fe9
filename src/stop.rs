//! A request to stop drawing.

use std::{
    iter,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering::Relaxed},
    },
};

/// A request to stop drawing a picture, which another thread may make. Clones share it.
///
/// The CPU engine looks at it before each block of tiles, and then ends with
/// [`Error::Stopped`](crate::Error::Stopped). The GPU engine finishes its frame; only
/// [`render_async`](crate::Renderer::render_async) looks at it, before each batch.
#[derive(Debug, Clone, Default)]
pub struct Stop(Arc<State>);

#[derive(Debug, Default)]
struct State {
    is_requested: AtomicBool,
    /// The request that also counts as this one.
    parent: Option<Stop>,
}

impl Stop {
    /// Returns a request that is also made when this one is. What asks the new one for the end
    /// leaves this one alone.
    ///
    /// ```
    /// use splatkit::Stop;
    ///
    /// let (all, other) = (Stop::default(), Stop::default());
    /// let [one, another] = [all.child(), all.child()];
    /// one.request();
    /// assert!(one.is_requested() && !another.is_requested() && !all.is_requested());
    /// all.request();
    /// assert!(another.is_requested() && !other.is_requested());
    /// ```
    #[must_use]
    pub fn child(&self) -> Self {
        let parent = Some(self.clone());
        Self(Arc::new(State { is_requested: AtomicBool::default(), parent }))
    }

    /// Asks for the end.
    pub fn request(&self) {
        self.0.is_requested.store(true, Relaxed);
    }

    /// Returns whether the end was asked for.
    pub fn is_requested(&self) -> bool {
        let mut all = iter::successors(Some(self), |stop| stop.0.parent.as_ref());
        all.any(|stop| stop.0.is_requested.load(Relaxed))
    }
}
