//! The blocks of finished regions: their pages in a file, and everything else about them.

use crate::{
    Error, Result,
    container::{Cursor, Put, directory::Place},
    disk::BUFFER,
    hierarchy::{
        Block, Node,
        file::{Around, Contents, Placed, Run, encode},
    },
    math::Bounds,
    splat::Splat,
    surface::EXTENT,
};
use std::{
    io::{BufWriter, Write},
    ops::Range,
    path::{Path, PathBuf},
};

/// The blocks of some regions, in order, without their pages.
#[derive(Debug, Clone, PartialEq)]
pub struct Made {
    /// The box around all footprints, in world coordinates.
    pub bounds: Bounds,
    pub splats: u64,
    pub blocks: Vec<Placed>,
}

/// Encodes blocks as they arrive and writes their pages.
pub struct PartWriter<W: Write> {
    out: BufWriter<W>,
    /// The position of the next page.
    at: u64,
    is_lossless: bool,
    /// The file, as errors name it.
    wanted: PathBuf,
    pub made: Made,
}

impl<W: Write> PartWriter<W> {
    /// Begins to write to `out`, which errors call `wanted`.
    pub fn new(out: W, is_lossless: bool, wanted: &Path) -> Self {
        let made = Made { bounds: Bounds::EMPTY, splats: 0, blocks: Vec::new() };
        let out = BufWriter::with_capacity(BUFFER, out);
        Self { out, at: 0, is_lossless, wanted: wanted.to_owned(), made }
    }

    /// Writes bytes between pages, and returns their position.
    pub fn put(&mut self, bytes: &[u8]) -> Result<u64> {
        self.out.write_all(bytes).map_err(|e| Error::output(&self.wanted, e))?;
        self.at += bytes.len() as u64;
        Ok(self.at - bytes.len() as u64)
    }

    /// Writes blocks.
    pub fn add(&mut self, blocks: &[Block]) -> Result<()> {
        let blocks: Vec<&Block> = blocks.iter().collect();
        let number = self.made.blocks.len();
        for (coded, around) in encode(&blocks, number, EXTENT, self.is_lossless, &self.wanted)? {
            let place = |page: &Vec<u8>| {
                let (bytes, crc) = (page.len() as u32, crc32fast::hash(page));
                Ok(Place { offset: self.put(page)?, bytes, crc })
            };
            let places: Result<Vec<Place>> = coded.pages.iter().map(place).collect();
            self.made.blocks.push(Placed::new(&coded, around, places?));
        }
        Ok(())
    }

    /// Returns where the bytes were written, their number, and the blocks.
    pub fn end(self) -> Result<(W, u64, Made)> {
        let out = self.out.into_inner().map_err(|e| Error::output(&self.wanted, e.into_error()))?;
        Ok((out, self.at, self.made))
    }
}

impl Made {
    /// Returns all of it as bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut out = Vec::new();
        out.dvec3(self.bounds.min);
        out.dvec3(self.bounds.max);
        out.u64(self.splats);
        out.u64(self.blocks.len() as u64);
        self.blocks.iter().for_each(|block| put_block(&mut out, block));
        out
    }

    /// Whether it can be what a conversion makes, with pages in this part of the file.
    pub fn is_sound(&self, pages: Range<u64>) -> bool {
        let leaves =
            self.blocks.iter().map(|block| u128::from(block.contents.leaves)).sum::<u128>();
        let Bounds { min, max } = self.bounds;
        let is_box = min.is_finite() && max.is_finite() && !self.bounds.is_empty();
        u128::from(self.splats) == leaves
            && (is_box || self.splats == 0)
            && self.blocks.iter().all(|block| block.is_sound(&pages))
    }

    /// Reads the bytes that [`to_bytes`](Self::to_bytes) returns. Returns `None` for others.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let mut bytes = Cursor::new(bytes);
        let bounds = Bounds { min: bytes.dvec3()?, max: bytes.dvec3()? };
        let (splats, count) = (bytes.u64()?, bytes.u64()?);
        let blocks: Option<Vec<Placed>> = (0..count).map(|_| block(&mut bytes)).collect();
        (bytes.remaining() == 0).then_some(Self { bounds, splats, blocks: blocks? })
    }
}

fn put_block(out: &mut Vec<u8>, block: &Placed) {
    let Placed { root, runs, around, places, contents } = block;
    out.put(bytemuck::bytes_of(&root.splat));
    out.f32s(&root.center);
    out.f32s(&[root.radius, root.size, root.cone]);
    out.u32(root.first_child);
    out.u32(root.children);
    out.u64(contents.leaves);
    out.u32(u32::from(contents.has_color) | u32::from(contents.has_normals) << 1);
    out.u32(contents.color.unwrap_or(u32::MAX));
    out.u32(runs.len() as u32);
    for ((run, around), place) in runs.iter().zip(around).zip(places) {
        let Run { nodes, parents, children } = run;
        let ends = [nodes, parents, children].map(|range| [range.start, range.end]);
        ends.as_flattened().iter().for_each(|&end| out.u32(end as u32));
        out.f32s(&around.center);
        out.f32s(&[around.radius, around.largest_size]);
        out.u64(place.offset);
        out.u32(place.bytes);
        out.u32(place.crc);
    }
}

fn block(bytes: &mut Cursor) -> Option<Placed> {
    let splat: Splat = bytemuck::pod_read_unaligned(bytes.take(size_of::<Splat>())?);
    let center = bytes.f32s()?;
    let [radius, size, cone] = bytes.f32s()?;
    let (first_child, children) = (bytes.u32()?, bytes.u32()?);
    let root = Node { splat, center, radius, size, cone, first_child, children };
    let leaves = bytes.u64()?;
    let (flags, color) = (bytes.u32()?, bytes.u32()?);
    let contents = Contents {
        leaves,
        has_color: flags & 1 != 0,
        has_normals: flags & 2 != 0,
        color: (color != u32::MAX).then_some(color),
    };
    let (mut runs, mut all_around, mut places) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..bytes.u32()? {
        let mut range = || Some(bytes.u32()? as usize..bytes.u32()? as usize);
        runs.push(Run { nodes: range()?, parents: range()?, children: range()? });
        let center = bytes.f32s()?;
        let [radius, largest_size] = bytes.f32s()?;
        all_around.push(Around { center, radius, largest_size });
        places.push(Place { offset: bytes.u64()?, bytes: bytes.u32()?, crc: bytes.u32()? });
    }
    Some(Placed { root, runs, around: all_around, places, contents })
}
