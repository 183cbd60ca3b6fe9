//! Hierarchies whose file comes in parts: the pages that are there.

use super::{Hierarchy, Page};
use crate::{
    Error, Result,
    input::{Bytes, Limits, Parts},
    parallel::prelude::*,
};
use std::{collections::HashSet, path::Path};

impl Hierarchy {
    /// Opens a file that comes in parts, which errors call `name`.
    ///
    /// # Errors
    /// Those of [`open`](Self::open); [`Error::Absent`] until the header and the root of the
    /// directory have come: the first 128 KiB.
    pub fn from_parts(parts: &Parts, name: impl AsRef<Path>, limits: &Limits) -> Result<Self> {
        Self::new(name.as_ref(), Bytes::Parts(parts.clone()), limits)
    }

    /// Returns whether its file comes in parts.
    pub(crate) fn is_in_parts(&self) -> bool {
        self.parts().is_some()
    }

    /// Returns whether its file comes in parts, and some were missed since the picture began.
    pub(crate) fn lacks(&self) -> bool {
        self.parts().is_some_and(Parts::lacks)
    }

    fn parts(&self) -> Option<&Parts> {
        self.bytes().and_then(Bytes::parts)
    }

    /// As [`read_pages`](Self::read_pages), but `None` for pages that have not come yet.
    ///
    /// # Errors
    /// Those of [`read_page`](Self::read_page), except [`Error::Absent`].
    pub(crate) fn read_there(&self, pages: &[u32]) -> Result<Vec<Option<Page>>> {
        if !self.is_in_parts() {
            return Ok(self.read_pages(pages)?.into_iter().map(Some).collect());
        }
        // Asked for in this order, before threads read them in another one.
        for &page in pages {
            if let Some(entry) = there(self.entry(page))? {
                self.bytes()
                    .map_or(Ok(()), |bytes| bytes.fetch([entry.place.range()].into_iter()))?;
            }
        }
        let read: Vec<_> = pages.par_iter().map(|&page| there(self.read_page(page))).collect();
        read.into_iter().collect()
    }

    /// Returns those of the pages, which come after the pages of their parents, that can be drawn:
    /// they are there, and so are all pages above them.
    ///
    /// # Errors
    /// Those of [`entry`](Self::entry).
    pub(crate) fn closed(
        &self,
        pages: impl IntoIterator<Item = u32>,
        is_there: impl Fn(u32) -> bool,
    ) -> Result<Vec<u32>> {
        let (mut closed, mut known) = (Vec::new(), HashSet::new());
        for page in pages {
            let Some(entry) = there(self.entry(page))? else { continue };
            if is_there(page) && entry.parent_pages.clone().all(|above| known.contains(&above)) {
                known.insert(page);
                closed.push(page);
            }
        }
        Ok(closed)
    }
}

/// Makes `None` of what has not come yet.
pub(crate) fn there<T>(result: Result<T>) -> Result<Option<T>> {
    match result {
        Err(Error::Absent { .. }) => Ok(None),
        other => other.map(Some),
    }
}
