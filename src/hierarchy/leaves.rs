//! The finest level on its own.

use super::{Hierarchy, file::Page};
use crate::{
    Result, memory,
    splat::{Splat, Surfels},
};

impl Hierarchy {
    /// Returns what is made of each page, in their order. A few pages are in memory at a time.
    pub(super) fn each_page<T: Send>(&self, make: impl Fn(&Page) -> T + Sync) -> Result<Vec<T>> {
        let all: Vec<u32> = (0..self.page_count()).collect();
        self.batched(&all, |page| Ok(make(&self.read_page(page)?)))
    }

    /// Returns the splats of the finest level, page by page: those that the hierarchy was built
    /// from, as stored in its file.
    ///
    /// # Errors
    /// Those of [`read_tree`](Self::read_tree), and [`Error::Memory`](crate::Error::Memory).
    pub fn leaves(&self) -> Result<Surfels> {
        self.check_size()?;
        // Once page by page, and once joined.
        memory::room(
            "reading the splats of the finest level",
            2 * size_of::<Splat>() as u64 * self.header().leaves,
        )?;
        let of_page = |page: &Page| {
            let nodes = page.nodes.iter().filter(|node| node.is_leaf() && !page.has_portals);
            nodes.map(|node| node.splat).collect::<Vec<Splat>>()
        };
        let pages = self.each_page(of_page)?;
        let header = self.header();
        let splats = pages.concat();
        Ok(Surfels { origin: header.origin, splats, extent: header.extent })
    }
}
