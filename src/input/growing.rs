//! Lists whose lengths no header bounds.

use super::Source;
use crate::Result;

/// How many items are taken between two looks at the clock.
const BREATH: usize = 1 << 12;

/// A list that grows under the limits: what it makes room for is taken from the budget before, and the time is looked at
/// now and then.
pub(crate) struct Growing<'a, T> {
    source: &'a Source<'a>,
    what: &'static str,
    items: Vec<T>,
}

impl<'a, T> Growing<'a, T> {
    /// An empty list; `what` names it in errors.
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
