//! Joins the blocks of all regions to one file.

use super::{Converted, ExternalOptions, Shape, made::Made};
use crate::{
    Error, Result,
    container::Spill,
    hierarchy::{
        build::Builder,
        file::{Placed, Whole, WriteOptions, Writer},
    },
    math::Bounds,
    surface::EXTENT,
};
use std::path::Path;

/// Writes a file of the blocks in `parts`, in order, each part with the position of its pages in
/// `pages`. The top of the tree is built over the roots of all blocks.
pub fn write<'a>(
    shape: &Shape,
    parts: impl Iterator<Item = (&'a Made, u64)>,
    pages: Spill,
    path: &Path,
    options: &ExternalOptions,
    write: &WriteOptions,
) -> Result<Converted> {
    let writer = Writer::over(path, EXTENT, write, pages)?;
    let mut builder = Builder::over(writer, shape.outer, options.preset);
    let Shape { origin, points, closed, regions, .. } = *shape;
    let (mut bounds, mut splats) = (Bounds::EMPTY, 0);
    for (made, start) in parts {
        bounds = bounds.union(made.bounds);
        splats += made.splats;
        for block in &made.blocks {
            let mut block: Placed = block.clone();
            block.places.iter_mut().for_each(|place| place.offset += start);
            builder.adopt(&block)?;
        }
    }
    if splats == 0 {
        return Err(Error::NothingToDraw("no points are left, or no triangle has an area".into()));
    }
    builder.finish(&Whole { origin, bounds, closed, source_points: points })?;
    Ok(Converted { points, splats, closed, regions })
}
