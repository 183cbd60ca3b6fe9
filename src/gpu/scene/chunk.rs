//! Chunks: parts of a scene's items, each of which fits a binding.

use crate::{
    bricks::Bricks,
    facet::FacetSet,
    gpu::{
        device::{Gpu, buffers::buffer},
        scene::{
            bricks::Slab,
            field::kind_of,
            harmonics::Harmonics,
            nodes::{PageCache, Slots},
            selection::Selection,
        },
        uniforms::{COARSE, NODES, Source},
    },
    math::{Kernel, View},
    splat::Common,
    volume::{Scalar, Volume},
};
use std::sync::Arc;

/// Candidates of a batch, which one invocation handles (`RUN` in frame.wgsl).
pub const RUN: u32 = 16;

/// Candidates of a workgroup of 64 invocations.
pub const WORKGROUP_CANDIDATES: u32 = 64 * RUN;

/// The source of a chunk's candidates.
#[derive(Debug)]
pub enum Origin {
    Splats {
        set: Common,
        /// Of trained Gaussians whose colours depend on the eye.
        harmonics: Option<Box<Harmonics>>,
    },
    Facets {
        set: Arc<FacetSet>,
        /// Whether the view leaves out backs.
        is_culled: bool,
        /// One more than the number of the chunk's first facet among those that show images; 0 if
        /// they show none.
        first_textured: u32,
    },
    /// Slots for pages of the hierarchy with this number.
    Nodes { page_cache: usize, slots: Box<Slots> },
    Lattice {
        volume: Arc<Volume>,
        kernel: Kernel,
        /// First slice of the chunk; first and last slice in its data.
        slices: [u32; 3],
        selection: Box<Selection>,
        /// Coordinates along the axes (`places` in sources/lattice.wgsl).
        places: wgpu::Buffer,
    },
    /// The bricks of one level that lie in a chunk of slots.
    Bricks { bricks: Arc<Bricks>, kernel: Kernel, slab: Box<Slab>, level: usize },
}

/// A part of an item that fits a binding.
#[derive(Debug)]
pub struct Chunk {
    pub origin: Origin,
    /// The index of the item in the scene.
    pub item: usize,
    /// Splats (48 bytes each), facets (60 bytes), or samples in their own type.
    pub data: wgpu::Buffer,
    pub uniform: wgpu::Buffer,
    /// The span of every candidate: the tiles and sheets that it meets (8 bytes each, see
    /// spans.wgsl).
    pub spans: wgpu::Buffer,
    /// The dispatch over the batches with at least one candidate that a pass draws.
    pub active_arguments: wgpu::Buffer,
    /// Splats, or capacity for nodes, or samples of the lattice.
    pub count: u32,
    /// The number of these that may be drawn: of a lattice, the selected ones.
    pub candidates: u32,
    pub first_run: u32,
}

impl Chunk {
    /// Returns the bytes of the splats or samples, and of their spans.
    pub(super) fn bytes(&self) -> u64 {
        let harmonics = match &self.origin {
            Origin::Splats { harmonics: Some(harmonics), .. } => harmonics.bytes(),
            _ => 0,
        };
        self.data.size() + self.spans.size() + harmonics
    }

    /// Returns the bytes of the lists of candidates, and of their spans.
    pub fn list_bytes(&self) -> u64 {
        let selected = match &self.origin {
            Origin::Lattice { selection, .. } => selection.selected.size(),
            Origin::Bricks { slab, .. } => slab.selected.size(),
            Origin::Nodes { slots, .. } => slots.bytes(),
            Origin::Splats { .. } | Origin::Facets { .. } => 0,
        };
        selected + self.spans.size()
    }

    /// Returns the chunk's uniform for a view.
    pub fn source(&self, view: &View, isotropic: bool, page_caches: &[PageCache]) -> Source {
        let source = match &self.origin {
            Origin::Nodes { page_cache, .. } => {
                let header = page_caches[*page_cache].hierarchy.header();
                Source::of_nodes(view, header)
            }
            Origin::Splats { set, .. } => Source::of_splats(view, set),
            Origin::Facets { set, is_culled, first_textured } => {
                let lattice = [*first_textured, 0, 0, 0];
                Source { lattice, ..Source::of_facets(view, set, *is_culled) }
            }
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

pub fn spans(gpu: &Gpu, candidates: u32) -> wgpu::Buffer {
    buffer(gpu, "spans", SPAN_BYTES * u64::from(candidates), wgpu::BufferUsages::STORAGE)
}

/// Returns the bytes of a list of samples: their numbers and spans.
pub fn list_bytes(count: u64) -> u64 {
    count * (4 + SPAN_BYTES)
}

/// Bytes of a candidate's span.
pub(super) const SPAN_BYTES: u64 = 8;

/// Returns the batches of a chunk with this number of candidates, and the number that stays free
/// before them.
pub fn runs_of(candidates: u32) -> u32 {
    1 + candidates.div_ceil(RUN)
}
