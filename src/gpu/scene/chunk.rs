//! Chunks: the parts of a scene that fit a binding.

use crate::{
    gpu::{
        device::{Gpu, buffers::buffer},
        scene::{
            bricks::Slab,
            field::kind_of,
            nodes::{Forest, Slots},
            select::Selection,
        },
    },
    math::{Kernel, View},
    plan::uniforms::{COARSE, NODES, Source},
    splat::SplatSet,
    volume::{Scalar, Volume, bricks::Bricks},
};
use std::sync::Arc;

/// Candidates that one invocation handles (`RUN` in frame.wgsl) and those of its workgroup of 64.
pub const RUN: u32 = 16;

pub const WORKGROUP_CANDIDATES: u32 = 64 * RUN;

/// What the candidates of a chunk are made from.
#[derive(Debug)]
pub enum Origin {
    Splats {
        set: Arc<SplatSet>,
        radiance: bool,
        /// The number of their item in the scene.
        item: usize,
    },
    /// Slots for pages of the hierarchy of this number.
    Nodes { forest: usize, slots: Box<Slots> },
    Lattice {
        volume: Arc<Volume>,
        kernel: Kernel,
        /// First slice of the chunk; first and last slice that its data hold.
        slices: [u32; 3],
        selection: Box<Selection>,
        /// Coordinates along the axes (`places` in sources/lattice.wgsl).
        places: wgpu::Buffer,
    },
    /// Those bricks of one level that lie in some slots.
    Bricks { bricks: Arc<Bricks>, kernel: Kernel, slab: Box<Slab>, level: usize },
}

/// A part of an item that fits a binding.
#[derive(Debug)]
pub struct Chunk {
    pub origin: Origin,
    /// Splats (48 bytes each) or samples in their own type.
    pub data: wgpu::Buffer,
    pub uniform: wgpu::Buffer,
    /// What every candidate meets of the picture (8 bytes each, see spans.wgsl).
    pub spans: wgpu::Buffer,
    /// The dispatch over the runs of which a pass draws something.
    pub active_arguments: wgpu::Buffer,
    /// Splats, or room for nodes, or samples of the lattice.
    pub count: u32,
    /// Those of them that may be drawn: of a lattice the selected ones.
    pub candidates: u32,
    pub first_run: u32,
}

impl Chunk {
    /// Bytes of its splats or samples, and of what these meet.
    pub(super) fn bytes(&self) -> u64 {
        self.data.size() + self.spans.size()
    }

    /// Bytes of what lists its candidates, and of what these meet.
    pub(super) fn list_bytes(&self) -> u64 {
        let selected = match &self.origin {
            Origin::Lattice { selection, .. } => selection.selected.size(),
            Origin::Bricks { slab, .. } => slab.selected.size(),
            Origin::Nodes { slots, .. } => slots.bytes(),
            Origin::Splats { .. } => 0,
        };
        selected + self.spans.size()
    }

    /// The chunk's uniform for a view.
    pub fn source(&self, view: &View, isotropic: bool, forests: &[Forest]) -> Source {
        let source = match &self.origin {
            Origin::Nodes { forest, .. } => {
                let header = forests[*forest].hierarchy.header();
                Source::of_radiance(view, header.origin, header.extent)
            }
            Origin::Splats { set, radiance, .. } => Source::of_splats(view, set, *radiance),
            Origin::Bricks { bricks, kernel, slab, level } => {
                let lattice = bricks.lattice(*level);
                let [width, height, depth] = lattice.dims.map(|n| n as u32);
                let kind = kind_of(bricks.header().scalar);
                let source = Source::of_lattice(view, &lattice, kernel, isotropic);
                let flags = source.flags | if slab.part == 1 { COARSE } else { 0 };
                Source { lattice: [width, height, depth, kind], flags, ..source }
            }
            Origin::Lattice { volume, kernel, slices: [first, low, high], .. } => {
                let lattice = volume.drawn_lattice();
                let [width, height, depth] = lattice.dims.map(|n| n as u32);
                let kind = kind_of(
                    volume.coefficients.as_ref().map_or(volume.samples.scalar(), |_| Scalar::F32),
                );
                Source {
                    lattice: [width, height, depth, kind],
                    slices: [*first, *low, *high, 0],
                    ..Source::of_lattice(view, lattice, kernel, isotropic)
                }
            }
        };

        let [first, low, high, _] = source.slices;
        let slices = [first, low, high, self.candidates];
        let flags =
            source.flags | if matches!(self.origin, Origin::Nodes { .. }) { NODES } else { 0 };
        Source { count: self.count, first_run: self.first_run, slices, flags, ..source }
    }
}

pub(super) fn spans(gpu: &Gpu, candidates: u32) -> wgpu::Buffer {
    buffer(gpu, "spans", SPAN_BYTES * u64::from(candidates), wgpu::BufferUsages::STORAGE)
}

/// Bytes of a list of samples: their numbers and spans.
pub fn list_bytes(count: u64) -> u64 {
    count * (4 + SPAN_BYTES)
}

/// Bytes of what a candidate meets of the picture.
pub(super) const SPAN_BYTES: u64 = 8;

/// Runs of so many candidates of a chunk, with the number that stays free before them.
pub fn runs_of(candidates: u32) -> u32 {
    1 + candidates.div_ceil(RUN)
}
