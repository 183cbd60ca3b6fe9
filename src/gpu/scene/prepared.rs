//! A prepared scene: its items are divided into chunks that fit a binding, uploaded, and updated
//! for each view.

use super::chunk::{Chunk, Origin, SPAN_BYTES, runs_of, spans};
use crate::{
    Error, Result,
    bricks::Choice,
    cells::Solid,
    facet::{Facet, FacetSet, Sides},
    gaussians::{Eye, Gaussians},
    gpu::{
        device::{
            Gpu,
            buffers::{buffer, filled_buffer, upload},
        },
        lamps::ShadowTextures,
        scene::{
            bricks::{BrickCache, Listed, Room, Slab},
            field::{Field, label_obstacle, texture_bytes, unsuited},
            harmonics::Harmonics,
            images::Images,
            nodes::{Growth, PageCache, Slots},
            selection::Selection,
            tables::FieldTables,
        },
        uniforms::Source,
    },
    hierarchy::{Cut, Levels},
    math::{Bounds, Kernel, View},
    parallel::prelude::*,
    plan::lamps::Shadows,
    scene::{Item, Optics, Scene, Settings},
    splat::{SampleSplats, Splat, Splats, Surfels},
    volume::{
        Arrangement, Lattice, TransferFunction, Volume,
        reach::{EVERYTHING, first_visible},
    },
};
use glam::{UVec3, Vec3};
use std::{
    borrow::Cow,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
};

/// Maximum number of voxels in a chunk, apart from those of its neighbours. The spans of all its
/// voxels then fit a binding of 128 MiB.
const CHUNK_VOXELS: u64 = 1 << 24;

/// Slices of the neighbouring chunks that a chunk also contains, for gradients. On a body-centred
/// lattice, layers of the same kind are two slices apart.
const NEIGHBOURS: usize = 2;

/// Maximum number of coordinates of a rectilinear lattice: those that fit the smallest uniform
/// binding that WebGPU promises.
const MOST_PLACES: usize = 8192;

/// A set of splats with levels of detail. The GPU holds the splats that the last view showed.
#[derive(Debug)]
pub(super) struct LevelledSet {
    pub item: usize,
    levels: Levels,
    /// The cut of the last view.
    cut: Option<Cut>,
    /// The splats on the GPU.
    set: Option<Splats>,
}

/// A solid, of which the GPU holds what the clips of the last picture left.
#[derive(Debug)]
pub(super) struct ClippedSolid {
    pub item: usize,
    solid: Arc<Solid>,
    drawn: Option<Arc<FacetSet>>,
}

/// Trained Gaussians, which are uploaded for the first picture.
#[derive(Debug)]
pub struct SeenSet {
    pub item: usize,
    pub set: Arc<Gaussians>,
    /// The eye of the last view.
    pub eye: Option<Eye>,
}

/// A scene whose splats and samples lie on the GPU. Cameras, settings and transfer functions may
/// change between frames.
#[derive(Debug)]
pub struct PreparedScene {
    pub(crate) scene: Scene,
    pub(crate) chunks: Vec<Chunk>,
    /// The sets that pictures may show in levels of detail.
    pub(super) levels: Vec<LevelledSet>,
    /// The solids.
    pub(super) solids: Vec<ClippedSolid>,
    /// The trained Gaussians.
    pub(crate) seen: Vec<SeenSet>,
    /// The hierarchies, in the scene's order.
    pub(crate) page_caches: Vec<PageCache>,
    /// The brick cache of the scene's volume in bricks.
    pub(crate) brick_cache: Option<BrickCache>,
    /// The data to gather the scene's volume. It is made for the first picture that gathers.
    pub(crate) field: Option<Field>,
    /// The number of its item.
    pub(super) field_item: usize,
    /// The images that facets show.
    pub(crate) images: Option<Images>,
    /// What keeps light away.
    pub(crate) shadows: Option<ShadowTextures>,
    /// The tables of the last picture's fields.
    pub(crate) tables: Option<FieldTables>,
    /// Batches of candidates in all chunks.
    pub(crate) runs: u32,
    /// Bytes of GPU memory that the scene holds.
    pub(crate) bytes: u64,
    /// The data on the GPU cannot be trusted, because an error occurred there.
    pub(crate) broken: bool,
    /// The number of this upload among all.
    pub(super) upload: u64,
    /// The number of the picture that was begun last.
    pub(crate) picture: u64,
    /// The box around everything.
    pub(crate) bounds: Bounds,
    /// The device that holds the data.
    pub(super) gpu: Gpu,
}

/// The numbers of uploads, all different.
static UPLOADS: AtomicU64 = AtomicU64::new(1);

/// Returns an error that names what of a scene the device does not draw.
pub(super) fn check_drawable(gpu: &Gpu, scene: &Scene) -> Result<()> {
    match gpu.beyond(scene) {
        None => Ok(()),
        Some(what) => Err(Error::Argument(format!(
            "the GPU engine does not draw {what} yet; the CPU engine does"
        ))),
    }
}

impl Gpu {
    /// Returns what of a scene this device does not draw, but the CPU engine does: what
    /// [`Scene::beyond_gpu`] names, and a label map that is too large for the device. `None` if the
    /// device draws all of it.
    pub fn beyond(&self, scene: &Scene) -> Option<String> {
        let too_large = || label_obstacle(scene, self).map(str::to_owned);
        scene.beyond_gpu().or_else(too_large)
    }
}

impl PreparedScene {
    /// Sets what keeps light away in the pictures that follow.
    pub(crate) fn set_shadows(&mut self, shadows: &Shadows) {
        if !self.shadows.as_ref().is_some_and(|textures| textures.hold(shadows)) {
            self.shadows = Some(ShadowTextures::new(&self.gpu, shadows));
        }
    }

    /// Uploads a scene. The scene's splats and samples are shared with the caller's, not copied.
    pub(crate) fn new(gpu: &Gpu, scene: &Scene) -> Result<Self> {
        scene.validate_unless_empty()?;
        check_drawable(gpu, scene)?;
        let mut prepared = Self {
            scene: scene.clone(),
            chunks: Vec::new(),
            levels: Vec::new(),
            solids: Vec::new(),
            seen: Vec::new(),
            page_caches: Vec::new(),
            brick_cache: None,
            field: None,
            field_item: 0,
            tables: None,
            images: None,
            shadows: None,
            runs: 0,
            bytes: 0,
            broken: false,
            upload: UPLOADS.fetch_add(1, Ordering::Relaxed),
            picture: 0,
            bounds: scene.bounds(),
            gpu: gpu.clone(),
        };
        gpu.check_memory(Images::bytes_of(scene))?;
        prepared.images = Images::of(gpu, scene);
        prepared.bytes += prepared.images.as_ref().map_or(0, |images| images.bytes);
        (0..scene.items.len()).try_for_each(|number| prepared.prepare_item(gpu, number))?;
        Ok(prepared)
    }

    /// Uploads an item of the scene, unless it is uploaded for the first picture.
    pub(super) fn prepare_item(&mut self, gpu: &Gpu, number: usize) -> Result<()> {
        let item = self.scene.items[number].clone();
        if let Some(levels) = item.splats().as_ref().and_then(Levels::new) {
            self.levels.push(LevelledSet { item: number, levels, cut: None, set: None });
            return Ok(());
        }
        gpu.check_memory(self.bytes + bytes_of(&item))?;
        match &item {
            Item::Radiance(set) => {
                self.add_splats(gpu, &in_space_order(Splats::Surfels(set.clone())), number);
            }
            Item::Scalar(set, _) => {
                self.add_splats(gpu, &in_space_order(Splats::Samples(set.clone())), number);
            }
            // They are uploaded as the first picture sees them.
            Item::Gaussians(set) => {
                self.seen.push(SeenSet { item: number, set: set.clone(), eye: None });
            }
            Item::Facets(set) => self.add_facets(gpu, set, number),
            // Their facets are uploaded as the clips of the first picture leave them.
            Item::Solid(solid) => {
                self.solids.push(ClippedSolid { item: number, solid: solid.clone(), drawn: None });
            }
            Item::Hierarchy(hierarchy) => {
                let index = self.page_caches.iter().filter(|other| other.item < number).count();
                self.renumber_caches(|old| old + usize::from(old >= index));
                self.page_caches.insert(index, PageCache::new(gpu, hierarchy, number));
            }
            // Other volumes are uploaded when a picture first gathers or scatters them.
            Item::Volume(volume, kernel, _) if unsuited(volume, kernel).is_some() => {
                self.add_volume(gpu, volume, kernel.clone(), number)?;
            }
            Item::Volume(..) | Item::Cells(..) => {}
            Item::Bricks(bricks, kernel, _) => {
                self.brick_cache = Some(BrickCache::new(bricks, kernel, number));
            }
        }
        Ok(())
    }

    /// Returns an error if the scene was prepared on another device.
    pub(crate) fn check_device(&self, gpu: &Gpu) -> Result<()> {
        if self.gpu.is(gpu) {
            return Ok(());
        }
        let name = &gpu.info.name;
        Err(Error::Argument(format!(
            "the scene was prepared on another device than the renderer's ({name}); prepare it \
             with this renderer"
        )))
    }

    /// Uploads the scene again if it is broken.
    pub(crate) fn mend(&mut self, gpu: &Gpu) -> Result<()> {
        if self.broken {
            *self = Self { picture: self.picture, ..Self::new(gpu, &self.scene)? };
        }
        Ok(())
    }

    /// Sets the transfer function of the field of an item, by its number in the scene. Nothing is
    /// rebuilt on the CPU.
    ///
    /// # Errors
    /// [`Error::Argument`] if the item has no field; [`Error::Transfer`] if
    /// [`Renderer::prepare`](crate::gpu::Renderer::prepare) would refuse the function. The scene
    /// then keeps its old one.
    pub fn set_transfer(&mut self, item: usize, transfer: &TransferFunction) -> Result<()> {
        self.scene = self.scene.with_transfer(item, transfer)?;
        Ok(())
    }

    /// Prepares the scene's volume to be gathered, and drops the lists of its samples to scatter.
    pub(crate) fn update_field(&mut self, gpu: &Gpu, settings: &Settings) -> Result<()> {
        let items = self.scene.items.iter().enumerate();
        let volume = items.into_iter().find_map(|(number, item)| match item {
            Item::Volume(volume, kernel, transfer) => Some((number, volume, kernel, transfer)),
            _ => None,
        });
        let Some((number, volume, kernel, transfer)) = volume else { return Ok(()) };
        if self.field_item != number
            && let Some(other) = self.field.take()
        {
            self.bytes = self.bytes.saturating_sub(other.bytes());
        }
        self.field_item = number;
        let first = match settings.optics {
            Optics::Maximum => EVERYTHING,
            _ => first_visible(transfer, volume.range),
        };
        let field = match &mut self.field {
            Some(field) => field,
            None => {
                let bytes = texture_bytes(gpu, volume);
                gpu.check_memory(self.bytes + bytes)?;
                self.bytes += bytes;
                self.field.insert(Field::new(gpu, volume, kernel))
            }
        };
        field.show(&first);
        for chunk in &mut self.chunks {
            let before = chunk.list_bytes();
            let Origin::Lattice { selection, .. } = &mut chunk.origin else { continue };
            if selection.forget(gpu) {
                chunk.candidates = 0;
                chunk.spans = spans(gpu, 0);
                self.bytes = self.bytes - before + chunk.list_bytes();
            }
        }
        self.number_runs();
        Ok(())
    }

    /// Uploads the samples of volumes that are scattered for the first time.
    pub(crate) fn bring_lattices(&mut self, gpu: &Gpu) -> Result<()> {
        let items = self.scene.items.iter().enumerate();
        let is_missing = |(number, item): &(usize, &Item)| {
            matches!(item, Item::Volume(..))
                && self.chunks.iter().all(|chunk| chunk.item != *number)
        };
        let missing = items.filter(is_missing).map(|(number, item)| (number, item.clone()));
        for (number, item) in missing.collect::<Vec<_>>() {
            if let Item::Volume(volume, kernel, _) = &item {
                gpu.check_memory(self.bytes + bytes_of(&item))?;
                self.add_volume(gpu, volume, kernel.clone(), number)?;
            }
        }
        Ok(())
    }

    /// Brings the bricks of a choice to the GPU, within `room`. Returns the list of their visible
    /// samples if there is one.
    pub(crate) fn bring_bricks(
        &mut self,
        gpu: &Gpu,
        choice: &Choice,
        room: Room,
    ) -> Result<Option<Listed>> {
        let Some(brick_cache) = &mut self.brick_cache else { return Ok(Some(Listed::All)) };
        if brick_cache.draws(choice) {
            let (runs, most) = (self.brick_runs(), room.runs);
            let is_listed = runs <= most;
            return Ok(Some(if is_listed { Listed::All } else { Listed::TooMany { runs, most } }));
        }
        let grown = brick_cache.update(gpu, choice, room.bytes)?;
        let (bricks, kernel) = (brick_cache.bricks.clone(), brick_cache.kernel.clone());
        let item = brick_cache.item;
        for samples in grown {
            // One chunk for each of two levels: they share the slots.
            for part in 0..2 {
                let slab = Box::new(Slab::new(gpu, &samples, part));
                self.bytes += slab.bytes();
                let (bricks, kernel, data) = (bricks.clone(), kernel.clone(), samples.data.clone());
                let origin = Origin::Bricks { bricks, kernel, slab, level: 0 };
                self.push_chunk(gpu, item, origin, data, samples.capacity());
            }
            // Both chunks have counted the samples, but neither the ranges.
            self.bytes += samples.ranges.size();
            self.bytes -= samples.data.size();
        }
        Ok(None)
    }

    /// Returns the batches of candidates in bricks.
    fn brick_runs(&self) -> u64 {
        let bricks =
            self.chunks.iter().filter(|chunk| matches!(chunk.origin, Origin::Bricks { .. }));
        bricks.map(|chunk| u64::from(runs_of(chunk.candidates))).sum()
    }

    /// Returns the bytes that each hierarchy, and the volume in bricks, may take with all its
    /// lists. The memory that the device has for data read on demand is divided into equal parts,
    /// so that no part depends on which item was loaded first.
    pub(crate) fn room_to_read(&self, gpu: &Gpu) -> u64 {
        let held = self.chunks.iter().map(|chunk| match &chunk.origin {
            Origin::Nodes { .. } => chunk.data.size() + chunk.list_bytes(),
            Origin::Bricks { slab, .. } => slab.slots.size() + chunk.list_bytes(),
            Origin::Splats { .. } | Origin::Facets { .. } | Origin::Lattice { .. } => 0,
        });
        let slots = self.brick_cache.as_ref().map_or(0, BrickCache::bytes);
        let readers = self.page_caches.len() + usize::from(self.brick_cache.is_some());
        gpu.memory_left(self.bytes.saturating_sub(slots + held.sum::<u64>()))
            / readers.max(1) as u64
    }

    /// Returns the batches of candidates outside bricks.
    pub(crate) fn other_runs(&self) -> u64 {
        u64::from(self.runs) - self.brick_runs()
    }

    /// Sorts the chunks, and numbers the batches of candidates through all of them. Sums depend on
    /// the order of the splats, which must not depend on earlier views. The chunks of fields lie
    /// behind the others, field by field, and so do their records (`record_starts` in frame.wgsl).
    /// One number stays free before the batches of each chunk (active.wgsl).
    pub(crate) fn number_runs(&mut self) {
        let items = &self.scene.items;
        self.chunks.sort_by_key(|chunk| (items[chunk.item].transfer().is_some(), chunk.item));
        self.runs = 0;
        for chunk in &mut self.chunks {
            chunk.first_run = self.runs + 1;
            self.runs += runs_of(chunk.candidates);
        }
    }

    /// Returns the first batch of candidates of each field. A field without chunks has the first
    /// batch of the next field that has some, or the number of all batches.
    pub(crate) fn first_runs(&self) -> Vec<u32> {
        let items = &self.scene.items;
        let first = |field: usize| {
            let is_from =
                |chunk: &&Chunk| chunk.item >= field && items[chunk.item].transfer().is_some();
            self.chunks.iter().find(is_from).map_or(self.runs, |chunk| chunk.first_run)
        };
        self.scene.fields().into_iter().map(first).collect()
    }

    /// Uploads the splats that a view shows of the sets with levels of detail. `pixels` is as in
    /// `Detail::Pixels`.
    pub(crate) fn update_levels(&mut self, gpu: &Gpu, view: &View, pixels: f64) -> Result<()> {
        let mut levels = std::mem::take(&mut self.levels);
        let done = levels
            .iter_mut()
            .try_for_each(|levelled| self.update_level(gpu, levelled, view, pixels));
        self.levels = levels;
        self.number_runs();
        done
    }

    fn update_level(
        &mut self,
        gpu: &Gpu,
        levelled: &mut LevelledSet,
        view: &View,
        pixels: f64,
    ) -> Result<()> {
        let view = &self.scene.view_of(levelled.item, view);
        let cut = Cut::new(view, levelled.levels.origin(), pixels, false);
        if levelled.cut == Some(cut) {
            return Ok(());
        }
        let set = levelled.levels.drawn(&cut)?;
        levelled.cut = Some(cut);
        if levelled.set.as_ref().is_some_and(|last| last.is_same(&set)) {
            return Ok(());
        }
        self.remove_chunks(levelled.item);
        levelled.set = None;
        gpu.check_memory(self.bytes + splat_bytes(set.splats()))?;
        self.add_splats(gpu, &in_space_order(set.clone()), levelled.item);
        levelled.set = Some(set);
        Ok(())
    }

    /// Uploads trained Gaussians, with their harmonics if their colours depend on the eye.
    pub(crate) fn add_gaussians(&mut self, gpu: &Gpu, set: &Gaussians, item: usize, eye: Eye) {
        let seen = set.seen_from(eye);
        let order = space_order(&seen.splats);
        let each = Harmonics::bytes_of(set).max(size_of::<Splat>() as u64);
        // Whole blocks of harmonics.
        let most = (gpu.binding_size() / each) as usize / 64 * 64;
        for order in order.chunks(most) {
            let splats: Vec<Splat> =
                order.par_iter().map(|index| seen.splats[*index as usize]).collect();
            let harmonics = set.depends_on_eye().then(|| Box::new(Harmonics::new(gpu, set, order)));
            self.bytes += harmonics.as_ref().map_or(0, |harmonics| harmonics.bytes());
            let origin = Origin::Splats { set: seen.common(), harmonics };
            self.add_chunk(gpu, item, origin, bytemuck::cast_slice(&splats), order.len() as u32);
        }
    }

    fn add_splats(&mut self, gpu: &Gpu, set: &Splats, item: usize) {
        let most = (gpu.binding_size() / size_of::<Splat>() as u64) as usize;
        for splats in set.splats().chunks(most) {
            let origin = Origin::Splats { set: set.common(), harmonics: None };
            self.add_chunk(gpu, item, origin, bytemuck::cast_slice(splats), splats.len() as u32);
        }
    }

    fn add_facets(&mut self, gpu: &Gpu, set: &Arc<FacetSet>, item: usize) {
        let most = (gpu.binding_size() / size_of::<Facet>() as u64) as usize;
        let first = self.images.as_ref().and_then(|images| images.first(item));
        // Without room for the images, facets are cut to texels.
        let plain = if first.is_some() { Cow::Borrowed(&**set) } else { set.baked() };
        for (number, facets) in plain.facets.chunks(most).enumerate() {
            let first_textured = first.map_or(0, |first| first + 1 + (number * most) as u32);
            let origin = Origin::Facets { set: set.clone(), is_culled: false, first_textured };
            self.add_chunk(gpu, item, origin, bytemuck::cast_slice(facets), facets.len() as u32);
        }
    }

    /// Uploads the facets that the clips of a picture leave of solids, if the clips have changed.
    pub(crate) fn update_solids(&mut self, gpu: &Gpu, settings: &Settings) -> Result<()> {
        let mut has_changed = false;
        for number in 0..self.solids.len() {
            let ClippedSolid { item, solid, drawn } = &mut self.solids[number];
            let pose = self.scene.view_pose(*item);
            let (item, set) = (*item, solid.facets(&pose.clips(&settings.clips)?));
            if drawn.as_ref().is_some_and(|drawn| Arc::ptr_eq(drawn, &set)) {
                continue;
            }
            *drawn = None;
            self.remove_chunks(item);
            gpu.check_memory(self.bytes + facet_bytes(&set))?;
            self.add_facets(gpu, &set, item);
            self.solids[number].drawn = Some(set);
            has_changed = true;
        }
        if has_changed {
            self.number_runs();
        }
        Ok(())
    }

    /// Frees the chunks of an item.
    fn remove_chunks(&mut self, item: usize) {
        let is_old = |chunk: &Chunk| chunk.item == item;
        let old = self.chunks.iter().filter(|chunk| is_old(chunk));
        self.bytes -= old.map(Chunk::bytes).sum::<u64>();
        self.chunks.retain(|chunk| !is_old(chunk));
    }

    /// Decides for each set of facets whether a view leaves out backs.
    pub(crate) fn update_facets(&mut self, view: &View, settings: &Settings) {
        for chunk in &mut self.chunks {
            if let Origin::Facets { set, is_culled, .. } = &mut chunk.origin {
                let view = &self.scene.view_of(chunk.item, view);
                *is_culled = settings.culls(set.sides == Sides::Closed, &set.bounds(), view);
            }
        }
    }

    fn add_volume(
        &mut self,
        gpu: &Gpu,
        volume: &Arc<Volume>,
        kernel: Kernel,
        item: usize,
    ) -> Result<()> {
        let lattice = volume.drawn_lattice();
        let [width, height, depth] = lattice.dims;
        let slice = (width * height) as u64;
        let bytes =
            volume.coefficients.as_ref().map_or(volume.samples.sample_bytes() as u64, |_| 4);
        let held = gpu.binding_size() / bytes / slice;
        // If all samples of a chunk are visible, it also holds a span for each.
        let most = CHUNK_VOXELS.min(gpu.binding_size() / SPAN_BYTES) / slice;
        let slices = held.saturating_sub(2 * NEIGHBOURS as u64).min(most) as usize;
        if slices == 0 {
            return Err(Error::Argument(format!(
                "a slice of the volume has {slice} samples, and {} slices are too large for {}; \
                 convert the volume to bricks (.splv), which can be drawn at any size",
                2 * NEIGHBOURS + 1,
                gpu.info.name
            )));
        }
        let places = places(gpu, lattice)?;
        let ranges = volume.drawn_ranges(&kernel);
        for first in (0..depth).step_by(slices) {
            let end = (first + slices).min(depth);
            let held = first.saturating_sub(NEIGHBOURS)..(end + NEIGHBOURS).min(depth);
            let in_slices = |slices: std::ops::Range<usize>| {
                slices.start * slice as usize..slices.end * slice as usize
            };
            let samples = in_slices(first..end);
            let dims = [width, height, end - first].map(|n| n as u32);
            let selection = Selection::new(gpu, dims, &ranges[samples.clone()]);
            self.bytes += selection.bytes();
            let origin = Origin::Lattice {
                volume: volume.clone(),
                kernel: kernel.clone(),
                slices: [first, held.start, held.end - 1].map(|slice| slice as u32),
                selection: Box::new(selection),
                places: places.clone(),
            };
            let part = in_slices(held);
            let bytes = match &volume.coefficients {
                Some(coefficients) => bytemuck::cast_slice(&coefficients.values[part]),
                None => {
                    let size = volume.samples.sample_bytes();
                    &volume.samples.bytes()[part.start * size..part.end * size]
                }
            };
            self.add_chunk(gpu, item, origin, bytes, samples.len() as u32);
        }
        Ok(())
    }

    fn add_chunk(&mut self, gpu: &Gpu, item: usize, origin: Origin, bytes: &[u8], count: u32) {
        let data = upload(gpu, "chunk", bytes);
        self.push_chunk(gpu, item, origin, data, count);
    }

    /// Brings the pages that the cuts of all hierarchies need to the GPU, as far as memory allows.
    pub(crate) fn update_forests(
        &mut self,
        gpu: &Gpu,
        view: &View,
        settings: &Settings,
        pixels: f64,
    ) -> Result<()> {
        let room = settings.controls.page_memory.min(self.room_to_read(gpu));
        for index in 0..self.page_caches.len() {
            let view = &*self.scene.view_of(self.page_caches[index].item, view);
            let cut = self.page_caches[index].cut(view, settings, pixels);
            let chunks: Vec<(&Slots, &wgpu::Buffer)> = self
                .chunks
                .iter()
                .filter_map(|chunk| match &chunk.origin {
                    Origin::Nodes { page_cache, slots } if *page_cache == index => {
                        Some((slots.as_ref(), &chunk.data))
                    }
                    _ => None,
                })
                .collect();
            let grown =
                self.page_caches[index].update(gpu, (&cut, Eye::of(view)), room, &chunks)?;
            for Growth { slots, splats, capacity } in grown {
                self.bytes += slots.bytes();
                let item = self.page_caches[index].item;
                self.push_chunk(
                    gpu,
                    item,
                    Origin::Nodes { page_cache: index, slots: Box::new(slots) },
                    splats,
                    capacity,
                );
            }
        }
        Ok(())
    }

    fn push_chunk(
        &mut self,
        gpu: &Gpu,
        item: usize,
        origin: Origin,
        data: wgpu::Buffer,
        count: u32,
    ) {
        let uniform =
            buffer(gpu, "source", size_of::<Source>() as u64, wgpu::BufferUsages::UNIFORM);
        // Which samples are visible is not known yet.
        let candidates = if matches!(origin, Origin::Lattice { .. } | Origin::Bricks { .. }) {
            0
        } else {
            count
        };
        let spans = spans(gpu, candidates);
        self.bytes += data.size() + spans.size();
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::INDIRECT;
        let active_arguments = buffer(gpu, "active arguments", 12, usage);
        self.chunks.push(Chunk {
            origin,
            item,
            data,
            uniform,
            spans,
            active_arguments,
            count,
            candidates,
            first_run: 0,
        });
        self.number_runs();
    }
}

/// Sorts splats along the curve of Morton (1966), so that neighbours in the list are neighbours in
/// space. The splats of a batch then meet the same tiles and sheets, and are hidden together. Short
/// lists keep their order.
fn in_space_order(set: Splats) -> Splats {
    const FEW: usize = 1 << 15;
    if set.splats().len() <= FEW {
        return set;
    }
    let order = space_order(set.splats());
    let splats = order.par_iter().map(|index| set.splats()[*index as usize]).collect();
    match set {
        Splats::Surfels(set) => Splats::Surfels(Surfels { splats, ..*set }.into()),
        Splats::Samples(set) => Splats::Samples(SampleSplats { splats, ..*set }.into()),
    }
}

/// Returns the numbers of splats along the curve of Morton.
fn space_order(splats: &[Splat]) -> Vec<u32> {
    let centers = || splats.par_iter().map(|splat| Vec3::from_array(splat.center));
    let low = centers().reduce(|| Vec3::INFINITY, Vec3::min);
    let size = centers().reduce(|| Vec3::NEG_INFINITY, Vec3::max) - low;
    let to_cells = 1023.0 / size.max_element().max(f32::MIN_POSITIVE);
    // Ten bits, two zeros after each.
    let spread = |cell: u32| (0..10).fold(0, |code, bit| code | (cell >> bit & 1) << (3 * bit));
    let code = |splat: &Splat| {
        let cell =
            ((Vec3::from_array(splat.center) - low) * to_cells).as_uvec3().min(UVec3::splat(1023));
        spread(cell.x) | spread(cell.y) << 1 | spread(cell.z) << 2
    };
    let mut order: Vec<(u32, u32)> =
        splats.par_iter().zip(0u32..splats.len() as u32).map(|(s, i)| (code(s), i)).collect();
    order.par_sort_unstable();
    order.into_par_iter().map(|(_, index)| index).collect()
}

/// Returns the coordinate and the unit of every sample along x, then y, then z, relative to the
/// first sample. The buffer contains zeros unless the lattice is rectilinear.
fn places(gpu: &Gpu, lattice: &Lattice) -> Result<wgpu::Buffer> {
    let mut places = vec![[0.0f32; 2]; MOST_PLACES];
    if let Arrangement::Rectilinear(coordinates) = &lattice.arrangement {
        let count: usize = lattice.dims.iter().sum();
        if count > MOST_PLACES {
            return Err(Error::Argument(format!(
                "the rectilinear volume has {count} coordinates along its axes; the GPU engine \
                 allows {MOST_PLACES}"
            )));
        }
        let each = (0..3).flat_map(|axis| (0..lattice.dims[axis]).map(move |at| (axis, at)));
        for (place, (axis, at)) in places.iter_mut().zip(each) {
            let mut index = [0; 3];
            index[axis] = at;
            *place = [coordinates[axis][at] - coordinates[axis][0], lattice.unit(index)[axis]]
                .map(|v| v as f32);
        }
    }
    Ok(filled_buffer(gpu, "places", bytemuck::cast_slice(&places), wgpu::BufferUsages::UNIFORM))
}

/// Returns the bytes that an item's splats or samples take on the GPU before it is drawn, each with
/// its span or the range around it. Items that are read on demand take none yet.
fn bytes_of(item: &Item) -> u64 {
    match item {
        Item::Radiance(set) => splat_bytes(&set.splats),
        Item::Scalar(set, _) => splat_bytes(&set.splats),
        Item::Gaussians(set) => gaussian_bytes(set),
        Item::Volume(volume, ..) => {
            let sample =
                volume.coefficients.as_ref().map_or(volume.samples.sample_bytes() as u64, |_| 4);
            volume.drawn_lattice().len() as u64 * (sample + 2)
        }
        Item::Facets(set) => facet_bytes(set),
        Item::Solid(solid) => facet_bytes(solid.boundary()),
        Item::Hierarchy(_) | Item::Bricks(..) | Item::Cells(..) => 0,
    }
}

/// Returns the bytes of facets on the GPU, and of their spans.
fn facet_bytes(set: &FacetSet) -> u64 {
    set.facets.len() as u64 * (size_of::<Facet>() as u64 + SPAN_BYTES)
}

/// Returns the bytes of splats on the GPU, and of their spans.
fn splat_bytes(splats: &[Splat]) -> u64 {
    splats.len() as u64 * (size_of::<Splat>() as u64 + SPAN_BYTES)
}

/// Returns the bytes of trained Gaussians on the GPU, with their harmonics and spans.
pub fn gaussian_bytes(set: &Gaussians) -> u64 {
    let each = size_of::<Splat>() as u64 + SPAN_BYTES + Harmonics::bytes_of(set);
    set.len() as u64 * each
}
