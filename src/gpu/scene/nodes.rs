//! Hierarchies on the GPU: a cache of the pages that a view needs, as far as memory allows.
//!
//! Pages lie in slots, and slots in chunks, each as large as a binding. Before a frame, the pages
//! that the view may need are found by their bounds, coarse pages first. Absent pages are read.
//! They take free slots, or the slots of pages that no recent view needed. If there is no capacity
//! for more pages, the nodes above them are drawn instead.

use super::slots::{Part, SLOT_NODES, SlotTable, slots_for};
use crate::{
    Result,
    gaussians::{Colors, Eye},
    gpu::device::{Gpu, buffers::buffer},
    hierarchy::{
        self, CutSphere, Hierarchy, Node,
        file::Page,
        needed::{self, Needed, needed, parents_around},
        trained,
    },
    math::View,
    parallel::prelude::*,
    scene::Settings,
    splat::Splat,
};
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};
use std::{
    collections::HashMap,
    ops::Range,
    sync::{
        Arc,
        atomic::{AtomicU32, Ordering::Relaxed},
    },
};
use wgpu::BufferUsages as Usage;

/// Nodes of a batch (`SELECT_RUN` in nodes.wgsl).
pub const RUN_NODES: u32 = 64;

/// Invocations that share a batch (`SHARERS` in nodes.wgsl).
const SHARERS: u32 = 8;

/// Nodes of a batch for each of these invocations.
pub const OWN_NODES: u32 = RUN_NODES / SHARERS;

/// Maximum number of slots in a chunk: the number of a node has 22 bits in cut.wgsl's list.
const MOST_SLOTS: u64 = (1 << 22) / SLOT_NODES as u64;

/// Pages read before they are uploaded.
const BATCH: usize = 64;

/// `Node` in nodes.wgsl.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
pub struct GpuNode {
    pub center: [f32; 3],
    pub radius: f32,
    pub size: f32,
    pub cone: f32,
    pub child_page: u32,
    pub parent_size: f32,
    pub parent_center: [f32; 3],
    pub parent_radius: f32,
}

const _: () = assert!(size_of::<GpuNode>() == size_of::<crate::splat::Splat>());

/// `Bounds` in cut.wgsl.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
pub struct GpuBounds {
    pub center: [f32; 3],
    pub radius: f32,
    pub size: f32,
    pub unused: [f32; 3],
}

/// Bytes of the bounds of a slot's batches.
const SLOT_BOUNDS: u64 = (SLOT_NODES / RUN_NODES) as u64 * size_of::<GpuBounds>() as u64;

/// Bytes of a slot's nodes; their splats take as many.
const SLOT_HALF: u64 = SLOT_NODES as u64 * size_of::<GpuNode>() as u64;

/// Bytes of a slot: nodes, splats and bounds, the lists that the cut makes, and the spans.
const SLOT_BYTES: u64 =
    2 * SLOT_HALF + SLOT_BOUNDS + 4 * (4 * SLOT_NODES + counts_of(SLOT_NODES)) as u64;

/// `Cut` in nodes.wgsl.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
pub struct GpuCut {
    pub sides: [[f32; 4]; 4],
    pub scale: f32,
    pub fineness: f32,
    pub perspective: u32,
    pub culls: u32,
    pub sin_margin: f32,
    pub cos_margin: f32,
    pub unused: [f32; 2],
}

/// The buffers of one chunk of slots, apart from its splats.
#[derive(Debug)]
pub struct Slots {
    nodes: wgpu::Buffer,
    slots: wgpu::Buffer,
    bounds: wgpu::Buffer,
    pub counts: wgpu::Buffer,
    cut_nodes: wgpu::Buffer,
    pub selected: wgpu::Buffer,
    pub arguments: wgpu::Buffer,
    resident: wgpu::Buffer,
    cut: wgpu::Buffer,
    first_slot: usize,
    count: usize,
    active: AtomicU32,
}

/// A chunk of slots, with its splats and the uniform that places them in the view.
pub struct NodeChunk<'a> {
    pub source: &'a wgpu::Buffer,
    pub splats: &'a wgpu::Buffer,
    pub slots: &'a Slots,
}

impl NodeChunk<'_> {
    /// Returns the bindings of nodes.wgsl.
    pub fn nodes(&self) -> [wgpu::BufferBinding<'_>; 6] {
        let Slots { cut, nodes, slots, resident, .. } = self.slots;
        [self.source, cut, nodes, self.splats, slots, resident]
            .map(|b| b.as_entire_buffer_binding())
    }

    /// Returns the other bindings of cut.wgsl.
    pub fn list(&self) -> [wgpu::BufferBinding<'_>; 5] {
        let Slots { bounds, counts, cut_nodes, selected, arguments, .. } = self.slots;
        [bounds, counts, cut_nodes, selected, arguments].map(|b| b.as_entire_buffer_binding())
    }
}

impl Slots {
    pub fn chunk<'a>(
        &'a self,
        source: &'a wgpu::Buffer,
        splats: &'a wgpu::Buffer,
    ) -> NodeChunk<'a> {
        NodeChunk { source, splats, slots: self }
    }

    /// Returns the bytes of the chunk's own buffers.
    pub fn bytes(&self) -> u64 {
        let buffers = [&self.nodes, &self.bounds, &self.counts, &self.cut_nodes, &self.selected];
        buffers.map(wgpu::Buffer::size).iter().sum()
    }

    /// Returns the number of slots that take part in the frame.
    pub fn active(&self) -> u32 {
        self.active.load(Relaxed)
    }
}

/// A chunk that was added to a hierarchy. The caller keeps it with the others.
#[derive(Debug)]
pub struct Growth {
    pub slots: Slots,
    pub splats: wgpu::Buffer,
    pub capacity: u32,
}

/// The page cache of one hierarchy.
#[derive(Debug)]
pub struct PageCache {
    pub hierarchy: Arc<Hierarchy>,
    /// The index of the item in the scene.
    pub item: usize,
    resident: wgpu::Buffer,
    cut: wgpu::Buffer,
    table: SlotTable,
    /// The pages in slots, of trained Gaussians: their colours change with the eye.
    trained: HashMap<u32, Trained>,
    /// Pages that the last view needed but that found too few slots.
    pub missing: usize,
}

impl PageCache {
    pub fn new(gpu: &Gpu, hierarchy: &Arc<Hierarchy>, item: usize) -> Self {
        // One bit a page.
        let resident = u64::from(hierarchy.page_count().div_ceil(32)) * 4;
        Self {
            hierarchy: hierarchy.clone(),
            item,
            resident: buffer(gpu, "resident pages", resident, Usage::STORAGE),
            cut: buffer(gpu, "cut", size_of::<GpuCut>() as u64, Usage::UNIFORM),
            table: SlotTable::default(),
            trained: HashMap::new(),
            missing: 0,
        }
    }

    /// Returns the cut of this hierarchy in a view.
    pub fn cut(&self, view: &View, settings: &Settings, pixels: f64) -> hierarchy::Cut {
        let header = self.hierarchy.header();
        let culls = settings.culls(header.closed, &header.bounds, view);
        hierarchy::Cut::new(view, header.origin, pixels, culls)
    }

    /// Returns the pages that a cut may need, coarse pages first, with all pages above them.
    pub fn needed(&self, cut: &hierarchy::Cut) -> Result<Vec<Needed>> {
        needed(&self.hierarchy, cut)
    }

    /// Returns the finest cut, in pixels, whose pages contain at most `most` nodes.
    pub fn finest_within(&self, view: &View, settings: &Settings, most: u64) -> Result<f64> {
        let cut = |pixels| self.cut(view, settings, pixels);
        needed::finest_within(&self.hierarchy, most, cut)
    }

    /// Sets the cut without loading pages.
    pub fn set_cut(&self, gpu: &Gpu, cut: &hierarchy::Cut) {
        let (sin_margin, cos_margin) = hierarchy::cone_margin();
        let uniform = GpuCut {
            sides: cut.sides.map(|side| side.to_array()),
            scale: cut.scale,
            fineness: cut.fineness,
            perspective: u32::from(cut.perspective),
            culls: u32::from(cut.culls),
            sin_margin,
            cos_margin,
            unused: [0.0; 2],
        };
        gpu.queue.write_buffer(&self.cut, 0, bytemuck::bytes_of(&uniform));
    }

    /// Brings the pages that a cut needs to the GPU, within `room` bytes, as an eye sees them.
    /// `chunks` are the chunks of this hierarchy in order, each with its splats. Returns the chunks
    /// that were added.
    pub fn update(
        &mut self,
        gpu: &Gpu,
        (cut, eye): (&hierarchy::Cut, Eye),
        room: u64,
        chunks: &[(&Slots, &wgpu::Buffer)],
    ) -> Result<Vec<Growth>> {
        self.table.begin();
        self.set_cut(gpu, cut);
        let mut needed = self.needed(cut)?;
        let most = self.fit(&mut needed, usize::try_from(room / SLOT_BYTES).unwrap_or(usize::MAX));
        let order: Vec<u32> = needed.iter().map(|request| request.page).collect();
        let absent: Vec<Needed> =
            needed.into_iter().filter(|request| !self.table.need(request.page)).collect();
        self.recolor(gpu, eye, chunks);
        let wanted: usize = absent.iter().map(|request| slots_for(request.nodes)).sum();
        let held = self.table.len();
        let mut grown = Vec::new();
        while self.table.len() < most && self.table.free() < wanted {
            grown.push(self.grow(gpu, wanted - self.table.free(), most - self.table.len()));
        }
        for page in self.table.make_room(wanted) {
            self.trained.remove(&page);
        }
        let all: Vec<(&Slots, &wgpu::Buffer)> = chunks
            .iter()
            .copied()
            .chain(grown.iter().map(|g: &Growth| (&g.slots, &g.splats)))
            .collect();
        let loaded = self.load(gpu, &absent, eye, &all).and_then(|()| self.leave_out(order));
        if let Err(error) = loaded {
            self.table.shrink(held);
            return Err(error);
        }
        self.describe(gpu, &all);
        Ok(grown)
    }

    /// Shortens a list of pages to those that fit into `room` slots, but never below one. Returns
    /// the number of slots that the hierarchy may take.
    fn fit(&mut self, needed: &mut Vec<Needed>, room: usize) -> usize {
        let most = room.max(needed.first().map_or(1, |request| slots_for(request.nodes)));
        let mut taken = 0;
        let mut fits = |request: &Needed| {
            taken += slots_for(request.nodes);
            taken <= most
        };
        let count = needed.iter().take_while(|request| fits(request)).count();
        self.missing = needed.len() - count;
        needed.truncate(count);
        most
    }

    /// Returns a chunk of about `wanted` more slots, and at most `most`.
    fn grow(&mut self, gpu: &Gpu, wanted: usize, most: usize) -> Growth {
        let most = most.min((gpu.binding_size() / SLOT_HALF).min(MOST_SLOTS) as usize);
        // Nearby views need a few more pages. The last chunk of a small file need not be larger
        // than the file.
        let pages = self.hierarchy.page_count() as usize;
        let all = (self.hierarchy.header().nodes / u64::from(SLOT_NODES)) as usize + pages;
        let left = all.saturating_sub(self.table.len());
        let count = (wanted + wanted / 4 + 1).min(left.max(1)).max(wanted).min(most);
        let capacity = count as u32 * SLOT_NODES;
        let half = count as u64 * SLOT_HALF;
        let slots = Slots {
            nodes: buffer(gpu, "nodes", half, Usage::STORAGE),
            slots: buffer(gpu, "slots", 8 * count as u64, Usage::STORAGE),
            bounds: buffer(gpu, "node bounds", count as u64 * SLOT_BOUNDS, Usage::STORAGE),
            counts: buffer(gpu, "cut counts", 4 * u64::from(counts_of(capacity)), Usage::STORAGE),
            cut_nodes: buffer(gpu, "found nodes", 4 * u64::from(capacity), Usage::STORAGE),
            selected: buffer(gpu, "drawn nodes", 4 * (u64::from(capacity) + 1), Usage::STORAGE),
            arguments: buffer(gpu, "drawn arguments", 12, Usage::STORAGE | Usage::INDIRECT),
            resident: self.resident.clone(),
            cut: self.cut.clone(),
            first_slot: self.table.len(),
            count,
            active: AtomicU32::new(0),
        };
        self.table.grow(count);
        Growth { slots, splats: buffer(gpu, "node splats", half, Usage::STORAGE), capacity }
    }

    /// Reads pages into free slots.
    fn load(
        &mut self,
        gpu: &Gpu,
        absent: &[Needed],
        eye: Eye,
        chunks: &[(&Slots, &wgpu::Buffer)],
    ) -> Result<()> {
        for batch in absent.chunks(BATCH) {
            let numbers: Vec<u32> = batch.iter().map(|request| request.page).collect();
            let pages = self.hierarchy.read_there(&numbers)?;
            for (&request, content) in batch.iter().zip(&pages) {
                let Some(content) = content else { continue };
                let Some(slots) = self.table.place(request) else {
                    self.missing += 1;
                    continue;
                };
                let splats = match Trained::of(content) {
                    None => content.nodes.iter().map(|node| node.splat).collect(),
                    Some(mut trained) => {
                        trained.eye = Some(eye);
                        let all = 0..content.nodes.len();
                        let seen = trained.seen(all, eye, self.hierarchy.header().origin);
                        self.trained.insert(request.page, trained);
                        seen
                    }
                };
                upload(gpu, content, &splats, &slots, chunks);
            }
            // Writes wait in staging memory until the next submission.
            gpu.queue.submit([]);
        }
        Ok(())
    }

    /// Of a file in parts, leaves pages out of the frame whose parents have not come yet: a page
    /// is drawn in place of its parents. `order` are the needed pages, coarse ones first.
    fn leave_out(&mut self, order: Vec<u32>) -> Result<()> {
        if !self.hierarchy.is_in_parts() {
            return Ok(());
        }
        let closed = self.hierarchy.closed(order, |page| self.table.holds(page))?;
        self.table.keep_needed(&closed.into_iter().collect());
        Ok(())
    }

    /// Uploads the pages of trained Gaussians that take part in this frame and that were uploaded
    /// as another eye sees them.
    fn recolor(&mut self, gpu: &Gpu, eye: Eye, chunks: &[(&Slots, &wgpu::Buffer)]) {
        let origin = self.hierarchy.header().origin;
        for (slots, splats) in chunks {
            let parts = self.table.parts(slots.first_slot, slots.count);
            let stale = parts.filter_map(|(place, part)| {
                let page = self.trained.get(&part.page).filter(|page| page.eye != Some(eye))?;
                Some((place, part, page))
            });
            let stale: Vec<(u32, Part, &Trained)> = stale.collect();
            let seen = |(place, part, page): &(u32, Part, &Trained)| {
                let range = part.first as usize..(part.first + part.nodes) as usize;
                (*place, page.seen(range, eye, origin))
            };
            let seen: Vec<(u32, Vec<Splat>)> = stale.par_iter().map(seen).collect();
            for (place, recolored) in seen {
                let at = u64::from(place) * SLOT_HALF;
                gpu.queue.write_buffer(splats, at, bytemuck::cast_slice(&recolored));
            }
        }
        for page in self.table.needed() {
            if let Some(trained) = self.trained.get_mut(&page) {
                trained.eye = Some(eye);
            }
        }
    }

    /// Uploads which pages take part in this frame, and which are loaded.
    fn describe(&self, gpu: &Gpu, chunks: &[(&Slots, &wgpu::Buffer)]) {
        let mut bits = vec![0u32; self.hierarchy.page_count().div_ceil(32) as usize];
        // Loaded pages that the view does not need, or that exceed its capacity, count as absent.
        for page in self.table.needed() {
            bits[page as usize / 32] |= 1 << (page % 32);
        }
        gpu.queue.write_buffer(&self.resident, 0, bytemuck::cast_slice(&bits));
        for (slots, _) in chunks {
            let parts = self.table.parts(slots.first_slot, slots.count);
            let mut active: Vec<[u32; 2]> =
                parts.map(|(number, part)| [number, part.nodes]).collect();
            if active.is_empty() {
                // An empty list must be made as well.
                active.push([0, 0]);
            }
            slots.active.store(active.len() as u32, Relaxed);
            gpu.queue.write_buffer(&slots.slots, 0, bytemuck::cast_slice(&active));
        }
    }
}

/// Uploads a page, with its splats as they are drawn, into slots of these chunks.
fn upload(
    gpu: &Gpu,
    page: &Page,
    splats: &[Splat],
    slots: &[u32],
    chunks: &[(&Slots, &wgpu::Buffer)],
) {
    for (number, &slot) in slots.iter().enumerate() {
        let slot = slot as usize;
        let holds = |(chunk, _): &&(&Slots, &wgpu::Buffer)| {
            (chunk.first_slot..chunk.first_slot + chunk.count).contains(&slot)
        };
        let Some((chunk, splats_of)) = chunks.iter().find(holds) else { continue };
        let place = (slot - chunk.first_slot) as u64;
        let first = number * SLOT_NODES as usize;
        let nodes = first..page.nodes.len().min(first + SLOT_NODES as usize);
        let write = |to: &wgpu::Buffer, size: u64, bytes: &[u8]| {
            gpu.queue.write_buffer(to, place * size, bytes);
        };
        let runs = nodes.clone().step_by(RUN_NODES as usize);
        let bounds: Vec<GpuBounds> = runs.map(|first| run_bounds(page, first)).collect();
        write(&chunk.bounds, SLOT_BOUNDS, bytemuck::cast_slice(&bounds));
        write(splats_of, SLOT_HALF, bytemuck::cast_slice(&splats[nodes.clone()]));
        let nodes: Vec<GpuNode> = nodes.map(|index| gpu_node(page, index)).collect();
        write(&chunk.nodes, SLOT_HALF, bytemuck::cast_slice(&nodes));
    }
}

/// The splats of a page of trained Gaussians, and their colours.
#[derive(Debug)]
struct Trained {
    splats: Vec<Splat>,
    are_leaves: Vec<bool>,
    colors: Colors,
    /// The eye that the splats in the slots are coloured for.
    eye: Option<Eye>,
}

impl Trained {
    /// Returns `None` for a page of other splats.
    fn of(page: &Page) -> Option<Self> {
        Some(Self {
            splats: page.nodes.iter().map(|node| node.splat).collect(),
            are_leaves: page.nodes.iter().map(Node::is_leaf).collect(),
            colors: page.colors.clone()?,
            eye: None,
        })
    }

    /// Returns a range of the splats as an eye sees them; `origin` is that of their positions.
    fn seen(&self, range: Range<usize>, eye: Eye, origin: DVec3) -> Vec<Splat> {
        range
            .map(|index| {
                let (splat, is_leaf) = (&self.splats[index], self.are_leaves[index]);
                let place = origin + Vec3::from(splat.center).as_dvec3();
                trained::drawn(splat, is_leaf, 1.0, self.colors.seen(index, eye.toward(place)))
            })
            .collect()
    }
}

/// Returns the bounds of the parents of a batch of nodes, as the shader reads them.
fn run_bounds(page: &Page, first: usize) -> GpuBounds {
    match parents_around(page, first, RUN_NODES as usize) {
        None => GpuBounds { size: -1.0, ..GpuBounds::default() },
        Some(CutSphere { center, radius, size }) => {
            GpuBounds { center, radius, size, unused: [0.0; 3] }
        }
    }
}

fn gpu_node(page: &Page, index: usize) -> GpuNode {
    let node = &page.nodes[index];
    let parent = page.parents.get(page.parent[index] as usize).copied();
    let child_page = page.child_pages[index];
    // A portal is replaced by its block whenever that is loaded.
    let size = if page.is_portal(index) { f32::MAX } else { node.size };
    let CutSphere { center, radius, size: parent_size } =
        parent.unwrap_or(CutSphere { center: [0.0; 3], radius: 0.0, size: -1.0 });
    GpuNode {
        center: node.center,
        radius: node.radius,
        size,
        cone: node.cone,
        child_page,
        parent_size,
        parent_center: center,
        parent_radius: radius,
    }
}

/// Returns how many counts the cut of this number of nodes makes: one per invocation, and one
/// behind the last.
pub const fn counts_of(nodes: u32) -> u32 {
    nodes.div_ceil(OWN_NODES) + 1
}
