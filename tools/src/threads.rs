//! The threads that the library computes on.

use crate::failure::Failure;
use std::{num::NonZero, sync::mpsc, thread};

/// Most threads per processor, and in all. More would only take memory.
const OF_PROCESSOR: usize = 4;
const MOST: usize = 1024;

/// Starts as many threads as `threads` or `RAYON_NUM_THREADS` says, or one per processor. If the
/// system does not start them all, everything runs on the calling thread.
///
/// # Errors
/// [`Failure::Threads`] if the system started the threads when tried, but not for the pool.
pub fn start(threads: Option<u32>) -> Result<(), Failure> {
    let processors = thread::available_parallelism().map_or(1, NonZero::get);
    let variable =
        || std::env::var("RAYON_NUM_THREADS").ok().and_then(|text| text.trim().parse().ok());
    let asked = threads.map(|threads| threads as usize).or_else(variable);
    let count = count(asked, processors);
    if let Some(asked) = asked.filter(|&asked| asked > count) {
        let name = if threads.is_some() { "--threads " } else { "RAYON_NUM_THREADS=" };
        tracing::warn!(
            "{name}{asked} is more than {processors} processors can use: using {count} threads"
        );
    }
    // Building the pool cannot be retried, so first check that the system starts the threads.
    let had = available(count);
    let builder = rayon::ThreadPoolBuilder::new();
    let built = if had == count {
        builder.num_threads(count).build_global()
    } else {
        tracing::warn!(
            "the system started {had} of {count} threads (see `ulimit -u` and `ulimit -v`): \
             one thread does all the work"
        );
        builder.num_threads(1).use_current_thread().build_global()
    };
    built.map_err(|error| Failure::Threads(error.to_string()))
}

/// Returns the number of threads to use.
fn count(asked: Option<usize>, processors: usize) -> usize {
    let most = processors.saturating_mul(OF_PROCESSOR).min(MOST);
    asked.filter(|&asked| asked > 0).unwrap_or(processors).clamp(1, most)
}

/// Whether the system can start another thread.
pub fn is_available() -> bool {
    available(1) == 1
}

/// Returns how many of `count` threads the system runs at once.
fn available(count: usize) -> usize {
    let (hold, wait) = mpsc::channel::<()>();
    let wait = std::sync::Arc::new(std::sync::Mutex::new(wait));
    let spawn = |_| {
        let wait = wait.clone();
        // Each thread waits until all have started, and ends when the channel closes.
        let body = move || drop(wait.lock().map(|wait| wait.recv()));
        thread::Builder::new().spawn(body).ok()
    };
    let threads: Vec<_> = (0..count).map_while(spawn).collect();
    drop(hold);
    let had = threads.len();
    threads.into_iter().for_each(|thread| drop(thread.join()));
    had
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_threads_are_sensible() {
        assert_eq!(
            [None, Some(0), Some(3), Some(100_000)].map(|asked| count(asked, 2)),
            [2, 2, 3, 8]
        );
        assert_eq!(
            [None, Some(1), Some(usize::MAX)].map(|asked| count(asked, 1000)),
            [1000, 1, 1024]
        );
        assert_eq!(count(None, 2000), 1024);
        assert_eq!(available(4), 4);
    }
}
