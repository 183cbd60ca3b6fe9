//! The finest level on its own.

use super::Hierarchy;
use crate::{
    Result, memory,
    parallel::prelude::*,
    splat::{Payload, Splat, SplatSet},
};

impl Hierarchy {
    /// Returns the splats of the finest level, page by page: those that the hierarchy was built
    /// from, as stored in its file.
    ///
    /// # Errors
    /// Those of [`read_tree`](Self::read_tree), and [`Error::Memory`](crate::Error::Memory).
    pub fn leaves(&self) -> Result<SplatSet> {
        self.check_size()?;
        // Once page by page, and once joined.
        memory::room(
            "reading the splats of the finest level",
            2 * size_of::<Splat>() as u64 * self.header().leaves,
        )?;
        let of_page = |page: u32| {
            let page = self.read_page(page)?;
            let nodes = page.nodes.iter().filter(|node| node.is_leaf() && !page.has_portals);
            Ok(nodes.map(|node| node.splat).collect::<Vec<Splat>>())
        };
        let pages: Vec<Vec<Splat>> =
            (0..self.pages().len() as u32).into_par_iter().map(of_page).collect::<Result<_>>()?;
        let header = self.header();
        let splats = pages.concat();
        Ok(SplatSet {
            origin: header.origin,
            payload: Payload::Radiance,
            splats,
            extent: header.extent,
            overlap: 1.0,
        })
    }
}
