//! Warnings: what is said of an input that is read all the same, such as of parts left out.
//!
//! Each goes to `tracing`. Work that [`gathered`] does also returns its warnings, for programs that
//! have no subscriber.

use std::{
    cell::RefCell,
    sync::{Arc, Mutex, PoisonError},
};

/// Most warnings that are gathered of one piece of work.
const MOST: usize = 1000;

thread_local! {
    /// Where the warnings of this thread's work go.
    static CURRENT: RefCell<Option<Gathering>> = const { RefCell::new(None) };
}

/// The warnings of a piece of work, on all threads that work on it.
#[derive(Clone, Default)]
pub struct Gathering(Arc<Mutex<Vec<String>>>);

impl Gathering {
    /// Returns where the warnings of this thread's work go, if they are gathered.
    pub fn current() -> Option<Self> {
        CURRENT.with_borrow(Clone::clone)
    }

    /// Does work whose warnings belong to this gathering.
    pub fn within<R>(&self, work: impl FnOnce() -> R) -> R {
        /// Restores what was current before, also after a panic.
        struct Before(Option<Gathering>);
        impl Drop for Before {
            fn drop(&mut self) {
                CURRENT.set(self.0.take());
            }
        }
        let _before = Before(CURRENT.replace(Some(self.clone())));
        work()
    }

    fn add(&self, message: String) {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if all.len() < MOST {
            all.push(message);
        }
    }
}

/// Does work, and returns its result and its warnings.
pub fn gathered<R>(work: impl FnOnce() -> R) -> (R, Vec<String>) {
    let gathering = Gathering::default();
    let result = gathering.within(work);
    let warnings = std::mem::take(&mut *gathering.0.lock().unwrap_or_else(PoisonError::into_inner));
    // Work that contains this one has them, too.
    if let Some(outer) = Gathering::current() {
        warnings.iter().for_each(|warning| outer.add(warning.clone()));
    }
    (result, warnings)
}

/// Adds a warning to those that are gathered. [`give!`] calls it.
pub fn add(message: &str) {
    if let Some(gathering) = Gathering::current() {
        gathering.add(message.to_owned());
    }
}

/// Warns of an input: in `tracing`, and where warnings are gathered. Takes what `format!` takes.
macro_rules! give {
    ($($part:tt)*) => {{
        let message = format!($($part)*);
        $crate::warning::add(&message);
        tracing::warn!("{message}");
    }};
}
pub(crate) use give;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parallel::prelude::*;

    #[test]
    fn warnings_of_all_threads_are_gathered() {
        let numbers: Vec<u32> = (0..500).collect();
        let ((), mut warnings) = gathered(|| {
            numbers.par_iter().for_each(|number| give!("number {number:03}"));
            let ((), inner) = gathered(|| give!("inner"));
            assert_eq!(inner, ["inner"]);
        });
        // Nobody gathers this one.
        give!("later");
        warnings.sort_unstable();
        let mut expected: Vec<String> = numbers.iter().map(|n| format!("number {n:03}")).collect();
        expected.insert(0, "inner".into());
        assert_eq!(warnings, expected);
    }

    #[test]
    fn gatherings_have_an_end() {
        let ((), warnings) = gathered(|| (0..2 * MOST).for_each(|_| give!("again")));
        assert_eq!(warnings.len(), MOST);
        let panicked = std::panic::catch_unwind(|| gathered(|| -> () { panic!("expected") }));
        assert!(panicked.is_err() && Gathering::current().is_none());
    }
}
