//! The CPU engine: draws scenes without a GPU, in the same sheets.
//!
//! A tile of 8 × 8 pixels is drawn sheet by sheet, front to back. *Splats* scatter: each adds its
//! sections to the sheets it meets (`scatter`). The field of a lattice is *gathered*: each pixel
//! evaluates it on the planes between its sheets (`gather`). Then the sheet is classified, lit and
//! composited (`close`). The GPU engine does the same in shaders; tests/pictures/cases.rs compares
//! both with the reference.
//!
//! A scene may have several *fields*. Each has a plan of its own: its tables, its lattice and its
//! light, with the view and the sheets that all share. In a sheet, each field is classified by
//! itself; then all of them and the radiance are mixed by their optical depths.
//!
//! | module | purpose |
//! |---|---|
//! | `plan` | data that all tiles of a picture share |
//! | `changes` | adds items to a scene that is prepared, and takes them out |
//! | `items`, `page_cache`, `nodes`, `brick_cache` | which splats of the scene a view needs |
//! | `fields` | what is kept of each field between pictures, and what a view needs of it |
//! | `footprint`, `project` | the pixels and sheets that splats cover, one or eight at a time |
//! | `bins` | which splats meet which tiles |
//! | `skip` | in which tiles and sheets a lattice may be visible |
//! | `march` | draws the sheets of a tile in order |
//! | `rays` | the rays of eight pixels |
//! | `scatter`, `sums` | adds splats to the open sheets |
//! | `facets`, `rods`, `covered` | the same for splats that are triangles, and for rods |
//! | `gather`, `field` | the field of a lattice at a place, and its gradient |
//! | `blend` | the same by sums over samples, for other kernels and lattices |
//! | `radial`, `bells`, `rectilinear` | the weights of these sums |
//! | `window` | loads the samples around eight places |
//! | `cells` | tetrahedra with linear fields, integrated along the rays |
//! | `close` | classifies, lights and composites a sheet |
//! | `lamps` | the light that reaches a place |
//! | `opacity`, `tile_map` | maps of what the scene absorbs, for shadows |
//! | `vector` | functions of eight numbers at once |

mod bells;
mod bins;
mod blend;
mod brick_cache;
mod cells;
mod changes;
mod close;
mod covered;
mod facets;
mod field;
mod fields;
mod footprint;
mod gather;
mod items;
mod kernel_sums;
mod lamps;
mod layer;
mod march;
mod nodes;
mod opacity;
mod page_cache;
mod plan;
mod project;
mod project_facets;
mod radial;
mod rays;
mod rectilinear;
mod rods;
mod scatter;
mod skip;
mod spare;
mod split;
mod sums;
mod tile_map;
mod vector;
mod visible;
mod window;

use crate::{
    Error, Result, Stop,
    bricks::Choice,
    hierarchy::Detail,
    math::{View, Viewpoint},
    parallel::prelude::*,
    picture::Picture,
    plan::{FrameStats, TILE, gathering, lamps::Lamps, pace::Pace, tables::Values},
    scene::{Evaluate, Optics, Scene, Settings},
    volume::TransferFunction,
};
use bins::{BLOCK, Bins, Lists, TileLists};
use brick_cache::most_bricks;
pub(crate) use changes::Parked;
use close::NO_VALUE;
use fearless_simd::Level;
use fields::FieldState;
use footprint::Record;
use items::Prepared;
use march::{DrawnField, EMPTY, March, Tile};
use opacity::ShadowCache;
use plan::{FieldOutline, Outline, Plan};
use spare::Spare;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use visible::Visible;
use web_time::Instant;

/// A scene, prepared for drawing on the CPU. Cameras and settings may change from picture to
/// picture.
#[derive(Debug)]
pub struct CpuRenderer {
    scene: Scene,
    /// One for each item.
    prepared: Vec<Prepared>,
    fields: Vec<FieldState>,
    pace: Pace,
    level: Level,
    /// Memory to reuse.
    spare: Spare,
    spare_bins: bins::Spare,
    shadows: ShadowCache,
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
        scene.validate_unless_empty()?;
        let mut prepared: Vec<_> = scene.items.iter().map(Prepared::new).collect();
        for (number, prepared) in prepared.iter_mut().enumerate() {
            prepared.update(&scene.items[number], scene.view_pose(number));
        }
        Ok(Self {
            scene: scene.clone(),
            prepared,
            fields: FieldState::all(scene),
            pace: Pace::default(),
            level: Level::new(),
            spare: Spare::new(),
            spare_bins: bins::Spare::default(),
            shadows: ShadowCache::default(),
        })
    }

    /// Replaces the transfer function of the field of an item, by its number in the scene
    /// ([`Scene::fields`]).
    ///
    /// # Errors
    /// [`Error::Argument`] if the item has no field; [`Error::Transfer`] for a transfer function
    /// that [`CpuRenderer::new`] would refuse. The scene then keeps the old one.
    pub fn set_transfer(&mut self, item: usize, transfer: &TransferFunction) -> Result<()> {
        self.scene = self.scene.with_transfer(item, transfer)?;
        for field in &mut self.fields {
            field.item = self.scene.items[field.number].clone();
        }
        self.shadows.forget();
        Ok(())
    }

    /// Draws a picture. The statistics contain the time of each step in milliseconds.
    ///
    /// # Errors
    /// [`Error::Argument`] if the camera or the settings cannot draw this scene. Errors of reading,
    /// for scenes that are read while they are drawn.
    pub fn render(
        &mut self,
        viewpoint: &impl Viewpoint,
        settings: &Settings,
    ) -> Result<(Picture, FrameStats)> {
        let start = Instant::now();
        self.scene.check_items()?;
        self.scene.validate_drawn(settings)?;
        let view = viewpoint.view(settings.size)?;
        let bounds = self.scene.bounds();
        view.validate_for(&bounds)?;
        let mut clock = Clock { last: start, steps: Vec::new() };
        let shadows = self.shadows(&view, settings)?;
        if settings.lighting.needs_maps() {
            clock.step("shadows");
        }
        let outline = self.outline(&view, settings)?;
        let mut plans = self.plans(&view, settings, &outline);
        let lamps = Lamps::new(&view, settings, &shadows);
        plans.iter_mut().for_each(|plan| plan.lamps.clone_from(&lamps));
        clock.step("plan");
        let before: u64 = self.brick_reads();
        let records = self.records(&plans, settings, &outline)?;
        clock.step("project");
        let drawn = self.draw((&plans, &outline, &records), &mut clock);
        self.spare = records;
        if settings.controls.stop.is_requested() {
            return Err(Error::Stopped);
        }
        let (picture, mut stats) = drawn;
        // Of files in parts, shadows may lack what comes later.
        if self.scene.lacks() {
            self.shadows.forget();
        }
        if let Detail::Milliseconds(wanted) = settings.detail {
            self.pace.took(start.elapsed().as_secs_f64() * 1e3, wanted);
        }
        stats.cut_pixels = outline.cut_pixels;
        stats.read_bricks = self.brick_reads() - before;
        for choice in outline.fields.iter().filter_map(|field| field.choice.as_ref()) {
            stats.lambda = stats.lambda.max(choice.lambda);
            stats.bricks += choice.bricks.len() as u64;
        }
        for prepared in &self.prepared {
            match prepared {
                Prepared::Hierarchy(pages) => stats.missing_pages += pages.missing as u64,
                Prepared::Bricks(bricks) => stats.brick_bytes += bricks.bytes(),
                Prepared::Set { .. }
                | Prepared::Facets(_)
                | Prepared::Solid { .. }
                | Prepared::Gaussians { .. }
                | Prepared::Volume { .. }
                | Prepared::Cells => {}
            }
        }
        stats.steps = clock.steps;
        Ok((picture, stats))
    }

    /// Returns a plan for each field, or the only plan of a scene without one.
    fn plans<'a>(&self, view: &'a View, settings: &Settings, outline: &Outline) -> Vec<Plan<'a>> {
        let sheets = &outline.sheets;
        let plan = |(field, field_outline): (&FieldState, &FieldOutline)| {
            let choice = field_outline.choice.as_ref();
            Plan::new(&self.scene, Some((field.number, choice)), view, sheets, settings)
        };
        let mut plans: Vec<_> = self.fields.iter().zip(&outline.fields).map(plan).collect();
        if plans.is_empty() {
            plans.push(Plan::new(&self.scene, None, view, sheets, settings));
        }
        Plan::join(&mut plans);
        plans
    }

    /// Returns the records of all splats that meet the picture.
    fn records(
        &mut self,
        plans: &[Plan],
        settings: &Settings,
        outline: &Outline,
    ) -> Result<Vec<Vec<Record>>> {
        let mut records = Vec::new();
        let mut spare = std::mem::take(&mut self.spare);
        for (number, prepared) in self.prepared.iter_mut().enumerate() {
            let field = self.fields.iter().position(|field| field.number == number);
            let field_outline = field.map(|field| &outline.fields[field]);
            if let (Prepared::Bricks(cache), Some(choice)) =
                (&mut *prepared, field_outline.and_then(|outline| outline.choice.as_ref()))
            {
                cache.update(choice, most_bricks(&cache.bricks, settings))?;
            }
            if !field_outline.is_some_and(|outline| outline.gathers) {
                let plan = &plans[field.unwrap_or(0)];
                let view = &self.scene.view_of(number, plan.view);
                records.extend(prepared.records(
                    (plan, view),
                    settings,
                    outline,
                    field_outline,
                    &mut spare,
                )?);
            }
        }
        items::check_count(&records)?;
        Ok(records)
    }

    /// Bytes of memory held for drawing, besides the scene's own.
    fn bytes(&self) -> u64 {
        let fields: u64 = self.fields.iter().map(FieldState::bytes).sum();
        fields + self.prepared.iter().map(Prepared::bytes).sum::<u64>()
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
        for (number, prepared) in self.prepared.iter_mut().enumerate() {
            prepared.update_levels(&self.scene.view_of(number, view), pixels)?;
        }
        let bounds = self.scene.bounds();
        let scene = &self.scene;
        let choice = |field: &FieldState| field.choice(scene, view, settings, detail, &bounds);
        let choices: Vec<Option<Choice>> = self.fields.iter().map(choice).collect();
        let in_bricks: Vec<Choice> = choices.iter().flatten().cloned().collect();
        let sheets = self.scene.sheets_of(view, settings, &in_bricks, &bounds);
        let fields = self.fields.iter().zip(choices);
        let fields = fields.map(|(field, choice)| field.outline(settings, &sheets, choice));
        let fields = fields.collect::<Result<Vec<_>>>()?;
        if fields.is_empty() && settings.evaluate == Evaluate::Gather {
            return Err(gathering::not_gathered("a scene without a volume on a lattice"));
        }
        let stop = settings.controls.stop.clone();
        Ok(Outline { cut_pixels, sheets, fields, stop })
    }

    fn prepare_gather(&mut self, plans: &[Plan], outline: &Outline) {
        for ((field, plan), field_outline) in self.fields.iter_mut().zip(plans).zip(&outline.fields)
        {
            if field_outline.gathers {
                field.prepare_gather(plan, field_outline, &self.prepared[field.number]);
            }
        }
    }

    /// Returns the fields as all tiles of a picture need them.
    fn drawn_fields<'a>(
        &'a self,
        plans: &'a [Plan<'a>],
        outline: &Outline,
        visible: &'a [Visible],
    ) -> Vec<DrawnField<'a>> {
        let all = self.fields.iter().zip(plans).zip(&outline.fields).zip(visible);
        all.map(|(((field, plan), field_outline), visible)| {
            field.drawn(plan, &outline.sheets, field_outline, &self.prepared[field.number], visible)
        })
        .collect()
    }

    fn draw(
        &mut self,
        (plans, outline, records): (&[Plan], &Outline, &[Vec<Record>]),
        clock: &mut Clock,
    ) -> (Picture, FrameStats) {
        let plan = &plans[0];
        let transfer = self.fields.first().and_then(|field| field.item.transfer()).cloned();
        let [width, height] = plan.view.size;
        let mut color = vec![[0.0f32; 4]; width as usize * height as usize];
        let mut depth = vec![0.0f32; color.len()];
        let band = width as usize * BLOCK * plan.tile_step();
        let bands = color.chunks_mut(band).zip(depth.chunks_mut(band)).collect();
        let (level, drawn) = (self.level, AtomicU64::new(0));
        let mut stats =
            self.march((plans, outline, records), clock, bands, |march, blocks, (color, depth)| {
                let block = |(at, entries): ([usize; 2], TileLists)| {
                    draw_block(level, march, at, &entries, &drawn)
                };
                let blocks: Vec<Vec<Tile>> = blocks.map(block);
                write_band(plan, transfer.as_ref(), &blocks, color, depth);
            });
        stats.entries = drawn.into_inner();
        (Picture { width, height, color, depth }, stats)
    }

    /// Marches through all tiles. `row` draws a row of blocks into one of the bands.
    fn march<B: Send>(
        &mut self,
        (plans, outline, records): (&[Plan], &Outline, &[Vec<Record>]),
        clock: &mut Clock,
        bands: Vec<B>,
        row: impl Fn(&March, RowOfBlocks, B) + Sync,
    ) -> FrameStats {
        let mut spare = std::mem::take(&mut self.spare_bins);
        let visible: Vec<Visible> = plans.iter().map(Visible::new).collect();
        self.prepare_gather(plans, outline);
        let fields = self.drawn_fields(plans, outline, &visible);
        if outline.fields.iter().any(|field| field.gathers) {
            clock.step("skip");
        }
        let gathered = fields.iter().map(DrawnField::marked).sum();
        let crossed: u64 = fields.iter().map(DrawnField::crossed).sum();
        let march = March { plans, fields, records };
        let mut bins = Bins::new(&plans[0], records, &mut spare);
        clock.step("bin");
        let (columns, mut bands) = (bins.columns(), bands.into_iter());
        for rows in bins.parts() {
            let lists = bins.lists(&rows);
            clock.step("bin");
            let bands: Vec<B> = bands.by_ref().take(rows.len()).collect();
            bands.into_par_iter().zip(rows).for_each(|(band, number)| {
                let stop = &outline.stop;
                row(&march, RowOfBlocks { number, columns, lists: &lists, stop }, band);
            });
            clock.step("march");
        }
        self.spare_bins = spare;
        FrameStats {
            splats: crossed + records.iter().map(|batch| batch.len() as u64).sum::<u64>(),
            gathered,
            passes: u32::from(!records.is_empty()),
            gpu_bytes: self.bytes() + record_bytes(records),
            ..FrameStats::default()
        }
    }
}

/// A row of blocks of tiles that is to be drawn.
struct RowOfBlocks<'a> {
    number: usize,
    columns: usize,
    lists: &'a Lists<'a>,
    stop: &'a Stop,
}

impl RowOfBlocks<'_> {
    /// Returns what `block` makes of each block, given its place and its splats. Once drawing is to
    /// end, the rest is empty.
    fn map<T: Send + Default>(
        &self,
        block: impl Fn(([usize; 2], TileLists)) -> T + Sync,
    ) -> Vec<T> {
        let of_column = |column: usize| {
            if self.stop.is_requested() {
                return T::default();
            }
            block(([column, self.number], self.lists.of_tiles(column, self.number, self.columns)))
        };
        (0..self.columns).into_par_iter().map(of_column).collect()
    }
}

fn record_bytes(records: &[Vec<Record>]) -> u64 {
    records.iter().map(|batch| size_of_val(batch.as_slice()) as u64).sum()
}

/// Draws the tiles of a block, row by row.
fn draw_block(
    level: Level,
    march: &March,
    [column, row]: [usize; 2],
    entries: &TileLists,
    drawn: &AtomicU64,
) -> Vec<Tile> {
    let tiles = march.plans[0].tiles();
    let mut block = vec![EMPTY; BLOCK * BLOCK];
    let mut count = 0;
    for (number, tile) in block.iter_mut().enumerate() {
        let at = [column * BLOCK + number % BLOCK, row * BLOCK + number / BLOCK];
        if at[0] < tiles[0] && at[1] < tiles[1] {
            let entries = entries.of(number);
            *tile = march.draw(level, at, entries, &mut count, None);
        }
    }
    drawn.fetch_add(count, Relaxed);
    block
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
            // Drawing has been stopped.
            let Some(tiles) = blocks.get(tile / BLOCK).filter(|tiles| !tiles.is_empty()) else {
                continue;
            };
            let pixels =
                &tiles[y / step * BLOCK + tile % BLOCK][(y % step + apron) * TILE + apron..];
            for ((color, depth), (rgba, hit)) in color.iter_mut().zip(depth).zip(pixels) {
                if plan.optics == Optics::Maximum {
                    *color = transfer
                        .map_or([0.0; 4], |transfer| of_largest(*hit, transfer, plan.field.values));
                    *depth = f32::INFINITY;
                    continue;
                }
                *color = *rgba;
                *depth = if rgba[3] >= 0.5 { *hit } else { f32::INFINITY };
            }
        }
    }
}

/// Returns the colour of a pixel from the largest value on its ray. Its opacity is that of a unit
/// of length.
fn of_largest(value: f32, transfer: &TransferFunction, values: Values<f32>) -> [f32; 4] {
    if value <= NO_VALUE {
        return [0.0; 4];
    }
    let value = f64::from(values.zero) + f64::from(value) / f64::from(values.per_value);
    let opacity = 1.0 - (-transfer.extinction(value) * transfer.unit).exp();
    let [red, green, blue] = transfer.color(value);
    [red, green, blue, 1.0].map(|part| (part * opacity) as f32)
}
