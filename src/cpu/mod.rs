//! The CPU engine: draws scenes without a GPU, in the same sheets.
//!
//! A tile of 8 × 8 pixels is drawn sheet by sheet, front to back. *Splats* scatter: each adds its
//! sections to the sheets it meets (`scatter`). The field of a lattice is *gathered*: each pixel
//! evaluates it on the planes between its sheets (`gather`). Then the sheet is classified, lit and
//! composited (`close`). The GPU engine does the same in shaders; tests/cpu_equals_reference.rs
//! compares both with the reference.
//!
//! | module | purpose |
//! |---|---|
//! | `plan` | data that all tiles of a picture share |
//! | `items`, `page_cache`, `nodes`, `brick_cache` | which splats of the scene a view needs |
//! | `footprint`, `project` | the pixels and sheets that splats cover, one or eight at a time |
//! | `bins` | which splats meet which tiles |
//! | `skip` | in which tiles and sheets a lattice may be visible |
//! | `march` | draws the sheets of a tile in order |
//! | `rays` | the rays of eight pixels |
//! | `scatter`, `sums` | adds splats to the open sheets |
//! | `facets` | the same for splats whose footprint is a triangle |
//! | `gather`, `field` | the field of a lattice at a place, and its gradient |
//! | `blend` | the same by sums over samples, for other kernels and lattices |
//! | `radial`, `bells`, `rectilinear` | the weights of these sums |
//! | `window` | loads the samples around eight places |
//! | `cells` | tetrahedra with linear fields, integrated along the rays |
//! | `close` | classifies, lights and composites a sheet |
//! | `vector` | functions of eight numbers at once |

mod bells;
mod bins;
mod blend;
mod brick_cache;
mod cells;
mod close;
mod facets;
mod field;
mod footprint;
mod gather;
mod items;
mod kernel_sums;
mod march;
mod nodes;
mod page_cache;
mod plan;
mod project;
mod radial;
mod rays;
mod rectilinear;
mod scatter;
mod skip;
mod spare;
mod sums;
mod vector;
mod window;

use crate::{
    Error, Result,
    bricks::{Bricks, Choice},
    hierarchy::Detail,
    math::{Camera, Kernel, View},
    parallel::prelude::*,
    picture::Picture,
    plan::{
        FrameStats, TILE, gathering,
        pace::Pace,
        shown::{self, Shown},
        uniforms::Frame,
        weighting::{Weighting, deviation, weighting},
    },
    scene::{Evaluate, Item, Optics, Scene, Settings},
    volume::{
        Lattice, TransferFunction, Volume,
        reach::{EVERYTHING, first_visible},
    },
};
use bins::{BLOCK, Bins, TileLists};
use blend::{Blend, Way};
use brick_cache::{BrickCache, Grid};
use cells::CellField;
use close::{NO_VALUE, Visible};
use fearless_simd::Level;
use field::Typed;
use footprint::Record;
use gather::Gather;
use items::Prepared;
use march::{EMPTY, March, Tile};
use plan::{Outline, Plan};
use spare::Spare;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use vector::lanes;
use web_time::Instant;

/// A scene, prepared for drawing on the CPU. Cameras and settings may change from picture to
/// picture.
#[derive(Debug)]
pub struct CpuRenderer {
    scene: Scene,
    prepared: Vec<Prepared>,
    /// The ranges of the field around the samples of a gathered lattice.
    ranges: Option<Vec<[u8; 2]>>,
    /// The kernel sums of a gathered lattice, if four weights an axis do not suffice.
    blend: Option<Blend>,
    /// The visible samples of a gathered lattice, and the transfer function's visibility table for
    /// which they were found.
    shown: Option<([u16; 256], Shown)>,
    /// The levels of a gathered volume in bricks, for the bricks of the last picture.
    levels: Option<(Choice, Vec<(Grid, Shown)>)>,
    pace: Pace,
    level: Level,
    /// Memory to reuse.
    spare: Spare,
    spare_bins: bins::Spare,
}

/// The times of a picture's steps.
struct Clock {
    last: Instant,
    steps: Vec<(&'static str, f64)>,
}

impl Clock {
    fn step(&mut self, name: &'static str) {
        let now = Instant::now();
        let milliseconds = (now - self.last).as_secs_f64() * 1e3;
        match self.steps.iter_mut().find(|step| step.0 == name) {
            Some(step) => step.1 += milliseconds,
            None => self.steps.push((name, milliseconds)),
        }
        self.last = now;
    }
}

impl CpuRenderer {
    /// Prepares a scene.
    ///
    /// # Errors
    /// [`Error::Argument`] for a scene that [`Scene::validate`] refuses.
    pub fn new(scene: &Scene) -> Result<Self> {
        scene.validate()?;
        Ok(Self {
            scene: scene.clone(),
            prepared: scene.items.iter().map(Prepared::new).collect(),
            ranges: None,
            blend: None,
            shown: None,
            levels: None,
            pace: Pace::default(),
            level: Level::new(),
            spare: Spare::new(),
            spare_bins: bins::Spare::default(),
        })
    }

    /// Replaces the transfer function of the scene's volume or sample set.
    ///
    /// # Errors
    /// [`Error::Argument`] for a transfer function that [`CpuRenderer::new`] would refuse. The
    /// scene then keeps the old one.
    pub fn set_transfer(&mut self, transfer: &TransferFunction) -> Result<()> {
        self.scene = self.scene.shown_by(transfer)?;
        Ok(())
    }

    /// Draws a picture. The statistics contain the time of each step in milliseconds.
    ///
    /// # Errors
    /// [`Error::Argument`] if the camera or the settings cannot draw this scene. Errors of reading,
    /// for scenes that are read while they are drawn.
    pub fn render(
        &mut self,
        camera: &Camera,
        settings: &Settings,
    ) -> Result<(Picture, FrameStats)> {
        let start = Instant::now();
        self.scene.validate_settings(settings)?;
        let view = camera.view(settings.size)?;
        let bounds = self.scene.bounds();
        view.validate_for(&bounds)?;
        let mut clock = Clock { last: start, steps: Vec::new() };
        let outline = self.outline(&view, settings)?;
        let plan =
            Plan::new(&self.scene, &view, &outline.sheets, settings, outline.choice.as_ref());
        clock.step("plan");
        let gathers = self.gathers(settings, &outline)?;
        let before: u64 = self.brick_reads();
        let mut records = Vec::new();
        let mut spare = std::mem::take(&mut self.spare);
        for (item, prepared) in self.scene.items.iter().zip(&mut self.prepared) {
            if let (Prepared::Bricks(cache), Some(choice)) = (&mut *prepared, &outline.choice) {
                cache.update(choice, most_bricks(&cache.bricks, settings))?;
            }
            if !(gathers && matches!(item, Item::Volume(..) | Item::Bricks(..))) {
                records.extend(prepared.records(&plan, settings, &outline, &mut spare)?);
            }
        }
        items::check_count(&records)?;
        clock.step("project");
        let drawn = self.draw(&plan, &outline, &records, gathers, &mut clock);
        self.spare = records;
        if settings.stop.is_requested() {
            return Err(Error::Stopped);
        }
        let (picture, mut stats) = drawn;
        if let Detail::Milliseconds(wanted) = settings.detail {
            self.pace.took(start.elapsed().as_secs_f64() * 1e3, wanted);
        }
        stats.cut_pixels = outline.cut_pixels;
        stats.read_bricks = self.brick_reads() - before;
        if let Some(choice) = &outline.choice {
            (stats.lambda, stats.bricks) = (choice.lambda, choice.bricks.len() as u64);
        }
        for prepared in &self.prepared {
            match prepared {
                Prepared::Hierarchy(pages) => stats.missing_pages += pages.missing as u64,
                Prepared::Bricks(bricks) => stats.brick_bytes += bricks.bytes(),
                Prepared::Set { .. }
                | Prepared::Facets(_)
                | Prepared::Gaussians { .. }
                | Prepared::Volume { .. }
                | Prepared::Cells => {}
            }
        }
        stats.steps = clock.steps;
        Ok((picture, stats))
    }

    /// Bytes of memory held for drawing, besides the scene's own.
    fn bytes(&self) -> u64 {
        let shown = self.shown.as_ref().map_or(0, |(_, shown)| shown.bytes());
        let ranges = self.ranges.as_ref().map_or(0, |ranges| size_of_val(ranges.as_slice()) as u64);
        shown + ranges + self.prepared.iter().map(Prepared::bytes).sum::<u64>()
    }

    fn brick_reads(&self) -> u64 {
        let reads = |prepared: &Prepared| {
            if let Prepared::Bricks(bricks) = prepared { bricks.reads } else { 0 }
        };
        self.prepared.iter().map(reads).sum()
    }

    fn outline(&mut self, view: &View, settings: &Settings) -> Result<Outline> {
        let detail = match settings.detail {
            Detail::Milliseconds(_) => Detail::Pixels(self.pace.next(view)),
            detail => detail,
        };
        let mut pages: Vec<_> = self
            .prepared
            .iter_mut()
            .filter_map(|prepared| {
                if let Prepared::Hierarchy(pages) = prepared { Some(pages.as_mut()) } else { None }
            })
            .collect();
        let cut_pixels = match detail {
            _ if pages.is_empty() => 0.0,
            Detail::Pixels(pixels) => pixels,
            Detail::Splats(most) => page_cache::finest_within(&mut pages, view, settings, most)?,
            Detail::Milliseconds(_) => Detail::PIXELS,
        };
        let pixels = if let Detail::Pixels(pixels) = detail { pixels } else { Detail::PIXELS };
        self.prepared.iter_mut().try_for_each(|prepared| prepared.update_levels(view, pixels))?;
        let bounds = self.scene.bounds();
        let most = self.scene.items.iter().find_map(|item| match item {
            Item::Bricks(bricks, ..) => Some(most_bricks(bricks, settings)),
            _ => None,
        });
        let choice = self.scene.choice(view, settings, detail, most.unwrap_or(usize::MAX), &bounds);
        let sheets = self.scene.sheets_of(view, settings, choice.as_ref(), &bounds);
        let mut shown = EVERYTHING;
        if let Some(Item::Volume(volume, _, transfer)) =
            self.scene.items.iter().find(|i| matches!(i, Item::Volume(..)))
            && !self.scene.mixes_afar(settings, &sheets, choice.as_ref())
        {
            shown = first_visible(transfer, volume.range);
        }
        let stop = settings.stop.clone();
        Ok(Outline { cut_pixels, choice, sheets, shown, stop })
    }

    /// Whether the field of the scene's volume is gathered.
    fn gathers(&self, settings: &Settings, outline: &Outline) -> Result<bool> {
        if settings.evaluate == Evaluate::Scatter {
            // The sections of tensor products have no known form.
            return self.scene.tensor().map_or(Ok(false), |tensor| {
                let name = tensor.name();
                Err(Error::Argument(format!(
                    "the kernel {name} can't be scattered; gather instead, \
                     or leave it to the engine"
                )))
            });
        }
        let parts = gathering::parts(&self.scene, &outline.sheets, outline.choice.as_ref());
        match gathering::obstacle(&self.scene, settings, parts, gather::unsuited) {
            Some(what) if settings.evaluate == Evaluate::Gather => Err(Error::Argument(format!(
                "{what} can't be gathered; scatter instead, or leave it to the engine"
            ))),
            Some(what) if let Some(tensor) = self.scene.tensor() => {
                Err(Error::Argument(format!("the kernel {} does not draw {what}", tensor.name())))
            }
            obstacle => Ok(obstacle.is_none()),
        }
    }

    fn prepare_gather(&mut self, plan: &Plan, outline: &Outline) {
        for (item, prepared) in self.scene.items.iter().zip(&self.prepared) {
            match (item, prepared, &outline.choice) {
                (Item::Volume(volume, kernel, transfer), ..) => {
                    let first = match plan.optics {
                        Optics::Maximum => EVERYTHING,
                        _ => first_visible(transfer, volume.range),
                    };
                    if let (None, Ok(Way::Blend(taps))) = (&self.blend, Way::of(volume, kernel)) {
                        self.blend = Some(Blend::new(volume, kernel, taps));
                    }
                    let ranges = self.ranges.get_or_insert_with(|| match &self.blend {
                        Some(blend) => blend.ranges(volume, kernel),
                        None => shown::field_ranges(volume, kernel),
                    });
                    let dims =
                        self.blend.as_ref().map_or(volume.drawn_lattice(), Blend::cells).dims;
                    self.shown.take_if(|(own, _)| *own != first);
                    self.shown.get_or_insert_with(|| (first, Shown::new(dims, ranges, &first)));
                }
                (_, Prepared::Bricks(cache), Some(choice))
                    if self.levels.as_ref().is_none_or(|(own, _)| own != choice) =>
                {
                    let level = |(level, _): &(usize, f64)| {
                        (Grid::new(cache, choice, *level), Shown::of_bricks(cache, choice, *level))
                    };
                    self.levels = Some((choice.clone(), choice.levels.iter().map(level).collect()));
                }
                _ => {}
            }
        }
    }

    /// Returns the gathered field, or `None` if none of its bricks is visible.
    fn gather<'a>(
        &'a self,
        plan: &'a Plan,
        outline: &Outline,
        visible: &'a Visible,
    ) -> Option<Gather<'a>> {
        let zero = plan.tables.values[0];
        let mut levels = Vec::new();
        for (item, prepared) in self.scene.items.iter().zip(&self.prepared) {
            match (item, prepared) {
                (Item::Volume(volume, kernel, _), _) => {
                    levels.push(self.whole_level(volume, kernel, zero)?);
                }
                (Item::Bricks(bricks, kernel, _), Prepared::Bricks(cache))
                    if !cache.samples().is_empty() =>
                {
                    levels = self.levels_of_bricks(bricks, cache, weighting(kernel)?, zero)?;
                }
                _ => {}
            }
        }
        let [finest, _] = levels.first()?.cells;
        let steps = (0..3).map(|axis| {
            let [x, y, z, _] = plan.frame.field_axes()[axis];
            f64::from(x * x + y * y + z * z).sqrt() * f64::from(finest[axis])
        });
        let steps = steps.fold(0.0, f64::max) * outline.sheets.step;
        let looks =
            if steps <= 1.0 { 0 } else { ((steps / gather::MOST_APART).ceil() as usize).max(2) };
        let parts = gathering::parts(&self.scene, &outline.sheets, outline.choice.as_ref());
        let deviation = self.scene.items.iter().find_map(|item| deviation(item.kernel()?));
        let ends = deviation.map(|deviation| (1.0 / deviation) as f32);
        let is_blended = self.blend.is_some();
        Some(Gather { plan, levels, parts, ends, looks, is_blended, visible, zero: zero as f32 })
    }

    /// Returns a volume in memory as the only level. Values are relative to `zero`.
    fn whole_level<'a>(
        &'a self,
        volume: &'a Volume,
        kernel: &Kernel,
        zero: f64,
    ) -> Option<gather::Level<'a>> {
        let (_, shown) = self.shown.as_ref()?;
        let field = match &self.blend {
            Some(blend) => Typed::blended(volume, blend, zero),
            None => Typed::new(volume, weighting(kernel)?, zero),
        };
        // Coefficients begin before the samples.
        let drawn = volume.drawn_lattice();
        let before = volume.lattice.axes.inverse() * (volume.lattice.origin - drawn.origin);
        let shift = before.as_vec3().to_array();
        let to_cells = |blend: &Blend| blend.to_cells(shift);
        Some(gather::Level {
            field,
            dims: drawn.dims,
            grid: None,
            shown,
            share: 1.0,
            scale: [1.0; 3],
            shift,
            cells: self.blend.as_ref().map_or([[1.0; 3], shift], to_cells),
        })
    }

    /// Returns the levels of a volume in bricks, the finer first.
    fn levels_of_bricks<'a>(
        &'a self,
        bricks: &Bricks,
        cache: &'a BrickCache,
        weighting: Weighting,
        zero: f64,
    ) -> Option<Vec<gather::Level<'a>>> {
        let (choice, found) = self.levels.as_ref()?;
        let fine = &bricks.header().lattice;
        let level = |((level, share), (grid, shown)): (&(usize, f64), &'a (Grid, Shown))| {
            let (own, dims) = (bricks.lattice(*level), bricks.level(*level).dims);
            let to_own = own.axes.inverse();
            let scale = (to_own * fine.axes).to_cols_array_2d();
            let shift = (to_own * (fine.origin - own.origin)).as_vec3().to_array();
            let scale = [0, 1, 2].map(|axis| scale[axis][axis] as f32);
            gather::Level {
                field: Typed::of_bricks(cache.samples(), dims, grid, weighting, zero),
                dims,
                grid: Some(grid),
                shown,
                share: *share as f32,
                scale,
                shift,
                cells: [scale, shift],
            }
        };
        Some(choice.levels.iter().zip(found).map(level).collect())
    }

    /// Returns the lattices of the gathered levels.
    fn lattices(&self, outline: &Outline) -> Vec<Lattice> {
        let own = |item: &Item| match (item, &outline.choice) {
            (Item::Volume(volume, ..), _) => {
                Some(vec![self.blend.as_ref().map_or(volume.drawn_lattice(), Blend::cells).clone()])
            }
            (Item::Bricks(bricks, ..), Some(choice)) => {
                Some(choice.levels.iter().map(|(level, _)| bricks.lattice(*level)).collect())
            }
            _ => None,
        };
        self.scene.items.iter().find_map(own).unwrap_or_default()
    }

    /// Returns a bit for each sheet of each tile in which the gathered field may be visible.
    fn marks(&self, plan: &Plan, outline: &Outline, gather: &Gather) -> Vec<Vec<u64>> {
        let mut marks: Vec<Vec<u64>> = Vec::new();
        for (level, lattice) in gather.levels.iter().zip(self.lattices(outline)) {
            let own = level.shown.sheets_of_tiles(&lattice, plan.view, &outline.sheets);
            if marks.is_empty() {
                marks = own;
                continue;
            }
            for (tile, other) in marks.iter_mut().zip(own) {
                tile.iter_mut().zip(other).for_each(|(a, b)| *a |= b);
            }
        }
        marks
    }

    /// Returns the scene's cells as a view shows them.
    fn cells<'a>(&'a self, plan: &Plan, visible: &Visible) -> Option<CellField<'a>> {
        self.scene.items.iter().find_map(|item| match item {
            Item::Cells(own, _) => Some(CellField::new(plan, own, visible)),
            _ => None,
        })
    }

    fn draw(
        &mut self,
        plan: &Plan,
        outline: &Outline,
        records: &[Vec<Record>],
        gathers: bool,
        clock: &mut Clock,
    ) -> (Picture, FrameStats) {
        let mut spare = std::mem::take(&mut self.spare_bins);
        let visible = Visible::new(plan);
        let mut gather = None;
        if gathers {
            self.prepare_gather(plan, outline);
            gather = self.gather(plan, outline, &visible);
            clock.step("skip");
        }
        let marks = gather.as_ref().map_or_else(Vec::new, |gather| {
            let marks = self.marks(plan, outline, gather);
            clock.step("skip");
            marks
        });
        let marked =
            |own: &Vec<u64>| own.iter().map(|word| u64::from(word.count_ones())).sum::<u64>();
        let gathered = marks.iter().map(marked).sum();
        let cells = self.cells(plan, &visible);
        let crossed = cells.as_ref().map_or(0, CellField::count);
        let march = March { plan, gather, cells, visible: &visible, records };
        let mut bins = Bins::new(plan, records, &mut spare);
        clock.step("bin");
        let drawn = AtomicU64::new(0);
        let transfer = items::transfer_of(&self.scene);
        let [width, height] = plan.view.size;
        let mut color = vec![[0.0f32; 4]; width as usize * height as usize];
        let mut depth = vec![0.0f32; color.len()];
        let (columns, band) = (bins.columns(), width as usize * BLOCK * plan.tile_step());
        for rows in bins.parts() {
            let lists = bins.lists(&rows);
            clock.step("bin");
            let from = rows.start * band;
            let parts = color[from..].par_chunks_mut(band).zip(depth[from..].par_chunks_mut(band));
            parts.zip(rows).for_each(|((color, depth), row)| {
                let block = |column: usize| {
                    if outline.stop.is_requested() {
                        return vec![EMPTY; BLOCK * BLOCK];
                    }
                    let entries = lists.of_tiles(column, row, columns);
                    draw_block(self.level, &march, [column, row], &entries, &marks, &drawn)
                };
                let blocks: Vec<Vec<Tile>> = (0..columns).into_par_iter().map(block).collect();
                write_band(plan, transfer, &blocks, color, depth);
            });
            clock.step("march");
        }
        self.spare_bins = spare;
        let picture = Picture { width, height, color, depth };
        let stats = FrameStats {
            splats: crossed + records.iter().map(|batch| batch.len() as u64).sum::<u64>(),
            gathered,
            entries: drawn.into_inner(),
            passes: u32::from(!records.is_empty()),
            gpu_bytes: self.bytes() + record_bytes(records),
            ..FrameStats::default()
        };
        (picture, stats)
    }
}

fn record_bytes(records: &[Vec<Record>]) -> u64 {
    records.iter().map(|batch| size_of_val(batch.as_slice()) as u64).sum()
}

/// Returns the number of bricks that fit into the settings' memory, at least one.
fn most_bricks(bricks: &Bricks, settings: &Settings) -> usize {
    usize::try_from(settings.page_memory / brick_cache::slot_bytes(bricks))
        .unwrap_or(usize::MAX)
        .max(1)
}

/// Draws the tiles of a block, row by row.
fn draw_block(
    level: Level,
    march: &March,
    [column, row]: [usize; 2],
    entries: &TileLists,
    marks: &[Vec<u64>],
    drawn: &AtomicU64,
) -> Vec<Tile> {
    let tiles = march.plan.tiles();
    let mut found = vec![EMPTY; BLOCK * BLOCK];
    let mut count = 0;
    for (number, tile) in found.iter_mut().enumerate() {
        let at = [column * BLOCK + number % BLOCK, row * BLOCK + number / BLOCK];
        if at[0] < tiles[0] && at[1] < tiles[1] {
            let (entries, marks) = (
                entries.of(number),
                marks.get(at[1] * tiles[0] + at[0]).map_or(&[][..], Vec::as_slice),
            );
            *tile = lanes!(level, simd => march.tile(simd, at, entries, marks, &mut count));
        }
    }
    drawn.fetch_add(count, Relaxed);
    found
}

/// Writes the pixels of a row of blocks.
fn write_band(
    plan: &Plan,
    transfer: Option<&TransferFunction>,
    blocks: &[Vec<Tile>],
    color: &mut [[f32; 4]],
    depth: &mut [f32],
) {
    let (step, apron) = (plan.tile_step(), plan.apron() as usize);
    let width = plan.view.size[0] as usize;
    for (y, (color, depth)) in color.chunks_mut(width).zip(depth.chunks_mut(width)).enumerate() {
        let parts = color.chunks_mut(step).zip(depth.chunks_mut(step));
        for (tile, (color, depth)) in parts.enumerate() {
            let own = &blocks[tile / BLOCK][y / step * BLOCK + tile % BLOCK]
                [(y % step + apron) * TILE + apron..];
            for ((color, depth), (own, hit)) in color.iter_mut().zip(depth).zip(own) {
                if plan.optics == Optics::Maximum {
                    *color = transfer
                        .map_or([0.0; 4], |transfer| of_largest(*hit, transfer, &plan.frame));
                    *depth = f32::INFINITY;
                    continue;
                }
                *color = *own;
                *depth = if own[3] >= 0.5 { *hit } else { f32::INFINITY };
            }
        }
    }
}

/// Returns the colour of a pixel from the largest value on its ray. Its opacity is that of a unit
/// of length.
fn of_largest(value: f32, transfer: &TransferFunction, frame: &Frame) -> [f32; 4] {
    if value <= NO_VALUE {
        return [0.0; 4];
    }
    let value = f64::from(frame.transfer[0]) + f64::from(value) / f64::from(frame.transfer[1]);
    let opacity = 1.0 - (-transfer.extinction(value) * transfer.unit).exp();
    let [red, green, blue] = transfer.color(value);
    [red, green, blue, 1.0].map(|part| (part * opacity) as f32)
}
