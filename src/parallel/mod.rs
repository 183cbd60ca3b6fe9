//! Parallel work: rayon's or, in builds without the feature `rayon`, the same calls on one thread.

#[cfg(not(feature = "rayon"))]
mod alone;

#[cfg(not(feature = "rayon"))]
pub use alone::{current_num_threads, prelude};
#[cfg(feature = "rayon")]
pub use rayon::{current_num_threads, prelude};
