//! Hierarchies on the GPU: a cache of the pages that a view needs, as far as memory allows.
//!
//! Pages lie in slots, and slots in chunks, each as large as a binding. Before a frame, the pages
//! that the view may need are found by their bounds, coarse pages first. Absent pages are read.
//! They take free slots, or the slots of pages that no recent view needed. If there is no capacity
//! for more pages, the nodes above them are drawn instead.

use crate::{
    Result,
    gaussians::{Colors, Eye},
    gpu::device::{Gpu, buffers::buffer},
    hierarchy::{
        self, CutSphere, Hierarchy, Node,
        file::{PAGE_NODES, Page},
        needed::{Needed, parents_around},
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
    sync::{
        Arc,
        atomic::{AtomicU32, Ordering::Relaxed},
    },
};
use wgpu::BufferUsages as Usage;

/// Nodes of a batch (`SELECT_RUN` in nodes.wgsl).
pub const RUN_NODES: u32 = 64;

/// Invocations that share a batch (`SHARERS` in cut.wgsl).
const SHARERS: u32 = 8;

/// Nodes of a batch for each of these invocations.
pub const OWN_NODES: u32 = RUN_NODES / SHARERS;

/// Nodes of a slot (`SLOT_NODES` in nodes.wgsl), as many as the largest page has.
pub const SLOT_NODES: u32 = PAGE_NODES as u32;

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
    found: wgpu::Buffer,
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
        let Slots { bounds, counts, found, selected, arguments, .. } = self.slots;
        [bounds, counts, found, selected, arguments].map(|b| b.as_entire_buffer_binding())
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
        let own = [&self.nodes, &self.bounds, &self.counts, &self.found, &self.selected];
        own.map(wgpu::Buffer::size).iter().sum()
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
    resident: wgpu::Buffer,
    cut: wgpu::Buffer,
    /// The page in each slot, and the last frame that needed it.
    slots: Vec<Option<(u32, u64)>>,
    /// The slot of each page.
    slot_of: Vec<Option<u32>>,
    needed: Needed,
    /// The pages in slots, of trained Gaussians: their colours change with the eye.
    trained: HashMap<u32, Trained>,
    /// The eye that the splats in the slots are coloured for.
    eye: Option<Eye>,
    frame: u64,
    /// Pages that the last view needed but that found no slot.
    pub missing: usize,
}

impl PageCache {
    pub fn new(gpu: &Gpu, hierarchy: &Arc<Hierarchy>) -> Self {
        let pages = hierarchy.pages().len();
        Self {
            hierarchy: hierarchy.clone(),
            resident: buffer(gpu, "resident pages", pages.div_ceil(32) as u64 * 4, Usage::STORAGE),
            cut: buffer(gpu, "cut", size_of::<GpuCut>() as u64, Usage::UNIFORM),
            slots: Vec::new(),
            slot_of: vec![None; pages],
            needed: Needed::new(hierarchy),
            trained: HashMap::new(),
            eye: None,
            frame: 0,
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
    pub fn needed(&self, cut: &hierarchy::Cut) -> Vec<u32> {
        self.needed.of(&self.hierarchy, cut)
    }

    /// Returns the finest cut, in pixels, whose pages contain at most `most` nodes.
    pub fn finest_within(&self, view: &View, settings: &Settings, most: u64) -> f64 {
        self.needed.finest_within(&self.hierarchy, most, |pixels| self.cut(view, settings, pixels))
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
        self.frame += 1;
        self.set_cut(gpu, cut);
        let is_new_eye = self.eye.replace(eye) != Some(eye);
        let mut needed = self.needed(cut);
        let most = usize::try_from(room / SLOT_BYTES).unwrap_or(usize::MAX).max(1);
        self.missing = needed.len().saturating_sub(most);
        needed.truncate(most);
        let mut absent = Vec::new();
        for &page in &needed {
            match self.slot_of[page as usize] {
                Some(slot) => self.slots[slot as usize] = Some((page, self.frame)),
                None => absent.push(page),
            }
        }
        if is_new_eye {
            self.recolor(gpu, eye, chunks);
        }
        let free = self.slots.iter().filter(|slot| slot.is_none()).count();
        let held = self.slots.len();
        let mut grown = Vec::new();
        while self.slots.len() < most && free + grown_slots(&grown) < absent.len() {
            let wanted = absent.len() - free - grown_slots(&grown);
            grown.push(self.grow(gpu, wanted, most - self.slots.len()));
        }
        let all: Vec<(&Slots, &wgpu::Buffer)> = chunks
            .iter()
            .copied()
            .chain(grown.iter().map(|g: &Growth| (&g.slots, &g.splats)))
            .collect();
        if let Err(error) = self.load(gpu, &absent, eye, &all) {
            // Drop the added chunks and the pages in them.
            for (page, _) in self.slots.drain(held..).flatten() {
                self.slot_of[page as usize] = None;
            }
            return Err(error);
        }
        self.describe(gpu, &all);
        Ok(grown)
    }

    /// Returns a chunk with slots for about `wanted` more pages, and at most `most`.
    fn grow(&mut self, gpu: &Gpu, wanted: usize, most: usize) -> Growth {
        let most = most.min((gpu.binding_size() / SLOT_HALF).min(MOST_SLOTS) as usize);
        // Nearby views need a few more pages. The last chunk of a small file need not be larger
        // than the file.
        let left = self.slot_of.len() - self.slots.len().min(self.slot_of.len());
        let count = (wanted + wanted / 4 + 1).min(left.max(1)).max(wanted).min(most);
        let capacity = count as u32 * SLOT_NODES;
        let half = count as u64 * SLOT_HALF;
        let slots = Slots {
            nodes: buffer(gpu, "nodes", half, Usage::STORAGE),
            slots: buffer(gpu, "slots", 8 * count as u64, Usage::STORAGE),
            bounds: buffer(gpu, "node bounds", count as u64 * SLOT_BOUNDS, Usage::STORAGE),
            counts: buffer(gpu, "cut counts", 4 * u64::from(counts_of(capacity)), Usage::STORAGE),
            found: buffer(gpu, "found nodes", 4 * u64::from(capacity), Usage::STORAGE),
            selected: buffer(gpu, "drawn nodes", 4 * (u64::from(capacity) + 1), Usage::STORAGE),
            arguments: buffer(gpu, "drawn arguments", 12, Usage::STORAGE | Usage::INDIRECT),
            resident: self.resident.clone(),
            cut: self.cut.clone(),
            first_slot: self.slots.len(),
            count,
            active: AtomicU32::new(0),
        };
        self.slots.extend(std::iter::repeat_n(None, count));
        Growth { slots, splats: buffer(gpu, "node splats", half, Usage::STORAGE), capacity }
    }

    /// Reads pages into free slots, or into the slots whose pages have been unused for longest.
    fn load(
        &mut self,
        gpu: &Gpu,
        absent: &[u32],
        eye: Eye,
        chunks: &[(&Slots, &wgpu::Buffer)],
    ) -> Result<()> {
        let mut places: Vec<u32> = (0..self.slots.len() as u32).collect();
        let last_needed = |slot: &u32| self.slots[*slot as usize].map_or(0, |(_, frame)| frame);
        places.retain(|slot| last_needed(slot) < self.frame);
        places.sort_by_key(last_needed);
        let mut places = places.into_iter();
        for batch in absent.chunks(BATCH) {
            let pages: Vec<Page> = batch
                .par_iter()
                .map(|&page| self.hierarchy.read_page(page))
                .collect::<Result<_>>()?;
            for (&page, content) in batch.iter().zip(&pages) {
                let Some(slot) = places.next() else {
                    self.missing += 1;
                    continue;
                };
                if let Some((old, _)) = self.slots[slot as usize] {
                    self.slot_of[old as usize] = None;
                    self.trained.remove(&old);
                }
                self.slots[slot as usize] = Some((page, self.frame));
                self.slot_of[page as usize] = Some(slot);
                let holder = chunks.iter().find(|(s, _)| {
                    (s.first_slot..s.first_slot + s.count).contains(&(slot as usize))
                });
                let Some((slots, splats)) = holder else { continue };
                let place = (slot as usize - slots.first_slot) as u64;
                let nodes: Vec<GpuNode> =
                    (0..content.nodes.len()).map(|index| gpu_node(content, index)).collect();
                let own: Vec<Splat> = match Trained::of(content) {
                    None => content.nodes.iter().map(|node| node.splat).collect(),
                    Some(trained) => {
                        let seen = trained.seen(eye, self.hierarchy.header().origin);
                        self.trained.insert(page, trained);
                        seen
                    }
                };
                let runs = (0..content.nodes.len()).step_by(RUN_NODES as usize);
                let bounds: Vec<GpuBounds> = runs.map(|first| run_bounds(content, first)).collect();
                gpu.queue.write_buffer(
                    &slots.nodes,
                    place * SLOT_HALF,
                    bytemuck::cast_slice(&nodes),
                );
                gpu.queue.write_buffer(
                    &slots.bounds,
                    place * SLOT_BOUNDS,
                    bytemuck::cast_slice(&bounds),
                );
                gpu.queue.write_buffer(splats, place * SLOT_HALF, bytemuck::cast_slice(&own));
            }
            // Writes wait in staging memory until the next submission.
            gpu.queue.submit([]);
        }
        Ok(())
    }

    /// Uploads the pages of trained Gaussians that take part in this frame, as an eye sees them.
    fn recolor(&self, gpu: &Gpu, eye: Eye, chunks: &[(&Slots, &wgpu::Buffer)]) {
        let origin = self.hierarchy.header().origin;
        for (slots, splats) in chunks {
            let own = &self.slots[slots.first_slot..slots.first_slot + slots.count];
            let taking_part = (0u64..).zip(own).filter_map(|(place, slot)| match slot {
                Some((page, frame)) if *frame == self.frame => {
                    Some((place, self.trained.get(page)?))
                }
                _ => None,
            });
            let taking_part: Vec<(u64, &Trained)> = taking_part.collect();
            let seen = |(place, page): &(u64, &Trained)| (*place, page.seen(eye, origin));
            let seen: Vec<(u64, Vec<Splat>)> = taking_part.par_iter().map(seen).collect();
            for (place, own) in seen {
                gpu.queue.write_buffer(splats, place * SLOT_HALF, bytemuck::cast_slice(&own));
            }
        }
    }

    /// Uploads which pages take part in this frame, and which are loaded.
    fn describe(&self, gpu: &Gpu, chunks: &[(&Slots, &wgpu::Buffer)]) {
        let mut bits = vec![0u32; self.slot_of.len().div_ceil(32)];
        // Loaded pages that the view does not need, or that exceed its capacity, count as absent.
        for (page, _) in self.slots.iter().flatten().filter(|(_, frame)| *frame == self.frame) {
            bits[*page as usize / 32] |= 1 << (page % 32);
        }
        gpu.queue.write_buffer(&self.resident, 0, bytemuck::cast_slice(&bits));
        for (slots, _) in chunks {
            let own = &self.slots[slots.first_slot..slots.first_slot + slots.count];
            let nodes = |page: u32| self.hierarchy.pages()[page as usize].nodes;
            let taking_part = (0..).zip(own).filter_map(|(number, slot)| match slot {
                Some((page, frame)) if *frame == self.frame => Some([number, nodes(*page)]),
                _ => None,
            });
            let mut active: Vec<[u32; 2]> = taking_part.collect();
            if active.is_empty() {
                // An empty list must be made as well.
                active.push([0, 0]);
            }
            slots.active.store(active.len() as u32, Relaxed);
            gpu.queue.write_buffer(&slots.slots, 0, bytemuck::cast_slice(&active));
        }
    }
}

/// The splats of a page of trained Gaussians, and their colours.
#[derive(Debug)]
struct Trained {
    splats: Vec<Splat>,
    are_leaves: Vec<bool>,
    colors: Colors,
}

impl Trained {
    /// Returns `None` for a page of other splats.
    fn of(page: &Page) -> Option<Self> {
        Some(Self {
            splats: page.nodes.iter().map(|node| node.splat).collect(),
            are_leaves: page.nodes.iter().map(Node::is_leaf).collect(),
            colors: page.colors.clone()?,
        })
    }

    /// Returns the splats as an eye sees them; `origin` is that of their positions.
    fn seen(&self, eye: Eye, origin: DVec3) -> Vec<Splat> {
        let both = self.splats.iter().zip(&self.are_leaves).enumerate();
        both.map(|(index, (splat, is_leaf))| {
            let place = origin + Vec3::from(splat.center).as_dvec3();
            trained::drawn(splat, *is_leaf, 1.0, self.colors.seen(index, eye.toward(place)))
        })
        .collect()
    }
}

fn grown_slots(grown: &[Growth]) -> usize {
    grown.iter().map(|growth| growth.slots.count).sum()
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
