//! Lists whose lengths no header bounds.

use super::Source;
use crate::Result;

/// Items that are added between two checks of the time limit.
const BREATH: usize = 1 << 12;

/// A list that grows within the limits. It takes its capacity from the budget before it allocates,
/// and checks the time every `BREATH` items.
pub(crate) struct Growing<'a, T> {
    source: &'a Source<'a>,
    what: &'static str,
    items: Vec<T>,
}

impl<'a, T> Growing<'a, T> {
    /// Creates an empty list; `what` names it in errors.
    pub fn new(source: &'a Source<'a>, what: &'static str) -> Self {
        Self { source, what, items: Vec::new() }
    }

    pub fn push(&mut self, item: T) -> Result<()> {
        let count = self.items.len();
        if count == self.items.capacity() {
            let more = count.max(16);
            self.source.room::<T>(self.what, more)?;
            self.items.reserve_exact(more);
        }
        if count % BREATH == BREATH - 1 {
            self.source.check_time()?;
        }
        self.items.push(item);
        Ok(())
    }

    pub fn into_inner(self) -> Vec<T> {
        self.items
    }
}

impl<T> std::ops::Deref for Growing<'_, T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.items
    }
}
