//! The buffers of a frame: the data that passes write for later passes, and the picture.

use crate::{
    Error, Result,
    bricks::Choice,
    gpu::{
        budget::{Budget, SCAN_CAPACITY},
        device::{Gpu, buffers::buffer},
        pipeline::{
            commands::Commands,
            state::{ARGUMENT_BYTES, HELD_RECORD_STARTS, PASS_BYTES, State},
        },
        scene::{PreparedScene, chunk::RUN, field::Gathered, tables::FieldTables},
        uniforms::Frame,
        variant::{MOST_BINS, MOST_GROUP_SHIFT, Variant},
    },
    math::{Sheets, View},
    plan::{field::Field, frame, lamps::Lamps},
    scene::{Scene, Settings},
};
use wgpu::BufferUsages as Usage;

/// Bytes of the span of a batch of candidates; its needs take as many.
const RUN_BYTES: u64 = 8;

/// Returns the maximum number of batches of candidates in a picture.
pub fn most_runs(gpu: &Gpu) -> u32 {
    // One place stays free for their sum.
    (gpu.binding_size() / RUN_BYTES).min(u64::from(SCAN_CAPACITY)) as u32 - 1
}

/// Columns and rows of tiles that a span distinguishes (10 bits each in spans.wgsl).
const SPAN_TILES: u32 = 1 << 10;

/// Rows of tiles that a box distinguishes (14 bits in bins.wgsl).
const BOX_ROWS: u64 = 1 << 14;

/// Returns the number of groups of 2 to the power `shift` sheets in a pass through all sheets. That
/// is one more than they fill, because the pass starts a sheet early and counts from there.
fn groups(sheets: usize, shift: u32) -> u64 {
    ((sheets as u64 + 2) >> shift) + 1
}

/// Returns the maximum rows of pixels that have enough bins for this number of sheets, whatever is
/// drawn, and whose rows of tiles a box distinguishes.
pub fn most_rows(width: u32, sheets: usize) -> u64 {
    // A tile without the edge that it may share with its neighbours.
    const STEP: u32 = 6;
    let bins = groups(sheets, MOST_GROUP_SHIFT) * u64::from(width.div_ceil(STEP));
    u64::from(STEP) * (u64::from(MOST_BINS) / bins).min(BOX_ROWS)
}

/// Tiles that march may stop in one pass with their sums saved (`SLOT_WORDS` words in progress.wgsl
/// have a bit for each).
const SLOTS: u64 = 1024;

/// Returns the bytes of a tile's saved sums (`SAVED_VECTORS` in saved.wgsl, with facets).
fn slot_bytes(fields: usize) -> u64 {
    64 * (20 + 8 * fields.max(1) as u64) * 16
}

/// Returns the maximum bytes of the slots for a scene with this number of fields. They lie behind
/// the colours of a picture, in the same binding.
pub fn most_slot_bytes(gpu: &Gpu, fields: usize) -> u64 {
    let bytes = slot_bytes(fields);
    SLOTS.min(gpu.binding_size() / 2 / bytes) * bytes
}

/// The buffers of a frame: the data that passes write for later passes, and the picture.
#[derive(Debug)]
pub struct Targets {
    pub frame: wgpu::Buffer,
    pub planes: wgpu::Buffer,
    pub tables: wgpu::Buffer,
    pub run_spans: wgpu::Buffer,
    pub needs: wgpu::Buffer,
    pub census: wgpu::Buffer,
    pub state: wgpu::Buffer,
    pub pass: wgpu::Buffer,
    pub arguments: wgpu::Buffer,
    pub bin_size: wgpu::Buffer,
    pub map: wgpu::Buffer,
    pub run_count: wgpu::Buffer,
    /// The number of elements of `runs` that are summed.
    pub run_size: wgpu::Buffer,
    pub runs: wgpu::Buffer,
    pub active: wgpu::Buffer,
    pub records: wgpu::Buffer,
    pub boxes: wgpu::Buffer,
    pub bins: wgpu::Buffer,
    pub entries: wgpu::Buffer,
    pub bin_arguments: wgpu::Buffer,
    pub large: wgpu::Buffer,
    pub large_arguments: wgpu::Buffer,
    pub long_bins: wgpu::Buffer,
    pub long_count: wgpu::Buffer,
    pub long_arguments: wgpu::Buffer,
    pub progress: wgpu::Buffer,
    pub colors: wgpu::Buffer,
    pub depths: wgpu::Buffer,
    /// The images that facets show, and what they show of them (images.wgsl).
    pub images: Option<[wgpu::TextureView; 2]>,
    /// What keeps light away (lamps.wgsl), unless all light comes from the eye.
    pub shadows: Option<[wgpu::TextureView; 2]>,
    /// The lattice that is gathered, if any.
    pub gathered: Option<Gathered>,
    pub run_total: u32,
    /// The first batch of each field.
    pub first_runs: Vec<u32>,
    pub tiles: [u32; 2],
}

impl Targets {
    /// Encodes the copy of each field's first record word, from the sums over the batches, to the
    /// frame.
    pub fn copy_record_starts(&self, commands: &mut Commands<'_>) {
        // With a single field, march does not read these words.
        if self.first_runs.len() < 2 {
            return;
        }
        let all = self.first_runs.iter().copied().chain(std::iter::repeat(self.run_total));
        let offset = std::mem::offset_of!(Frame, record_starts) as u64;
        for (field, run) in (0..Scene::MAX_FIELDS as u64).zip(all) {
            let (from, to) = (4 * u64::from(run), offset + 4 * field);
            commands.encoder().copy_buffer_to_buffer(&self.runs, from, &self.frame, to, 4);
        }
    }

    /// Encodes the copy of these words as they were when the pass was held. Later passes that draw
    /// nothing overwrite them.
    pub fn restore_record_starts(&self, commands: &mut Commands<'_>) {
        let offset = std::mem::offset_of!(Frame, record_starts) as u64;
        let bytes = size_of_val(&Frame::default().record_starts) as u64;
        let (state, frame) = (&self.state, &self.frame);
        commands.encoder().copy_buffer_to_buffer(state, HELD_RECORD_STARTS, frame, offset, bytes);
    }

    /// Returns the bytes of GPU memory.
    pub fn bytes(&self) -> u64 {
        let Self {
            frame,
            planes,
            tables,
            run_spans,
            needs,
            census,
            state,
            map,
            runs,
            active,
            records,
            boxes,
            ..
        } = self;
        let Self { bins, entries, large, long_bins, progress, colors, depths, .. } = self;
        [frame, planes, tables, run_spans, needs, census, state, map, runs, active, records, boxes]
            .into_iter()
            .chain([bins, entries, large, long_bins, progress, colors, depths])
            .map(wgpu::Buffer::size)
            .sum()
    }
}

/// Large buffers, kept from frame to frame while they are large enough.
#[derive(Debug, Default)]
pub struct Pool(Vec<(&'static str, wgpu::Buffer)>);

impl Pool {
    fn take(&mut self, gpu: &Gpu, label: &'static str, bytes: u64) -> wgpu::Buffer {
        let bytes = bytes.max(16).next_multiple_of(16);
        if let Some((_, buffer)) =
            self.0.iter().find(|(name, buffer)| *name == label && buffer.size() >= bytes)
        {
            return buffer.clone();
        }
        self.0.retain(|(name, _)| *name != label);
        let buffer = buffer(
            gpu,
            label,
            bytes,
            Usage::STORAGE | Usage::UNIFORM | Usage::INDIRECT | Usage::COPY_SRC | Usage::COPY_DST,
        );
        self.0.push((label, buffer.clone()));
        buffer
    }

    /// Returns a buffer that begins with these bytes once the next work is submitted.
    fn fill(&mut self, gpu: &Gpu, label: &'static str, bytes: &[u8]) -> wgpu::Buffer {
        let buffer = self.take(gpu, label, bytes.len() as u64);
        gpu.queue.write_buffer(&buffer, 0, bytes);
        buffer
    }
}

/// What a strip shows, and within which capacity.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    pub variant: &'a Variant,
    pub view: &'a View,
    pub sheets: &'a Sheets,
    pub settings: &'a Settings,
    pub budget: Budget,
    pub choice: Option<&'a Choice>,
}

impl Request<'_> {
    /// Creates everything that the strip needs, or takes it from the pool.
    pub fn targets(
        &self,
        gpu: &Gpu,
        pool: &mut Pool,
        prepared: &mut PreparedScene,
    ) -> Result<Targets> {
        self.check(gpu, prepared.runs)?;
        let (tiles, unit) = (self.tiles(), self.variant.record_unit());
        let splats = prepared.runs.saturating_mul(RUN);
        let budget = self.budget.within(gpu, splats, unit);
        let mut frame = self.frame(&prepared.scene, budget);
        let tables = FieldTables::of(gpu, &prepared.scene, prepared.tables.take());
        let view = (self.view, self.choice);
        let fields = tables.in_view(&prepared.scene, self.settings, view, self.sheets);
        tables.pack(&fields, &mut frame);
        let gathered = self.gathered(gpu, prepared, (tables.entries(), &fields), &mut frame);
        let shadows = self.shadows(prepared, &mut frame)?;
        let table = tables.buffer.clone();
        prepared.tables = Some(tables);
        let sizes = Sizes::of(self, gpu, budget, prepared.runs);
        let Sizes { tile_count, pixels, slots, bin_count, words, runs, .. } = sizes;
        Ok(Targets {
            frame: pool.fill(gpu, "frame", bytemuck::bytes_of(&frame)),
            planes: pool.fill(gpu, "planes", bytemuck::cast_slice(&planes(self.sheets))),
            tables: table,
            run_count: pool.fill(gpu, "run count", bytemuck::bytes_of(&[prepared.runs, 0, 0, 0])),
            run_size: pool.fill(gpu, "run size", bytemuck::bytes_of(&[prepared.runs + 1, 0, 0, 0])),
            run_spans: pool.take(gpu, "run spans", RUN_BYTES * runs),
            needs: pool.take(gpu, "needs", RUN_BYTES * runs),
            census: pool.take(gpu, "census", sizes.census),
            state: pool.take(gpu, "state", size_of::<State>() as u64),
            pass: pool.take(gpu, "pass", PASS_BYTES),
            arguments: pool.take(gpu, "arguments", ARGUMENT_BYTES),
            bin_size: pool.take(gpu, "bin size", 16),
            map: pool.take(gpu, "map", sizes.map),
            runs: pool.take(gpu, "runs", 4 * (runs + 1)),
            active: pool.take(gpu, "active", 8 * runs),
            records: pool.take(gpu, "records", 16 * words),
            boxes: pool.take(gpu, "boxes", 12 * (words / u64::from(unit) + 1)),
            bins: pool.take(gpu, "bins", 4 * bin_count),
            entries: pool.take(gpu, "entries", sizes.entries),
            bin_arguments: pool.take(gpu, "bin arguments", 12),
            large: pool.take(gpu, "large", 4 * (words / u64::from(unit) + 1)),
            large_arguments: pool.take(gpu, "large arguments", 12),
            long_bins: pool.take(gpu, "long bins", 4 * bin_count),
            long_count: pool.take(gpu, "long count", 4),
            long_arguments: pool.take(gpu, "long arguments", 12),
            progress: pool.take(
                gpu,
                "progress",
                4 * (gathered_word(tile_count) + 2 + u64::from(tile_count)),
            ),
            colors: pool.take(gpu, "colors", 16 * pixels + slots),
            depths: pool.take(gpu, "depths", 4 * pixels),
            images: prepared.images.as_ref().map(|images| images.textures.clone()),
            shadows,
            gathered,
            run_total: prepared.runs,
            first_runs: prepared.first_runs(),
            tiles,
        })
    }

    /// Packs the lights, and returns what keeps light away.
    fn shadows(
        &self,
        prepared: &PreparedScene,
        frame: &mut Frame,
    ) -> Result<Option<[wgpu::TextureView; 2]>> {
        if !self.variant.lamps {
            return Ok(None);
        }
        let Some(shadows) = &prepared.shadows else {
            return Err(Error::Argument(
                "other lights than that from the eye need maps of the scene, which a \
                 splatkit::Renderer draws"
                    .into(),
            ));
        };
        if let Some(lamps) = Lamps::new(self.view, self.settings, &shadows.shadows) {
            frame.set_lamps(&lamps);
        }
        Ok(Some(shadows.textures.clone()))
    }

    /// Columns and rows of tiles.
    fn tiles(&self) -> [u32; 2] {
        self.view.size.map(|n| n.div_ceil(self.variant.tile_step()))
    }

    /// Returns an error if the strip, or the candidates of the scene, are too many for this device.
    fn check(&self, gpu: &Gpu, runs: u32) -> Result<()> {
        let ([width, height], sheets) = (self.view.size, self.sheets.count());
        if u64::from(width) * u64::from(height) * 16 > gpu.binding_size() {
            // The renderer divides pictures into strips of whole rows. Only a single row can be too
            // long.
            return Err(Error::Argument(format!(
                "a picture {width} pixels wide is too wide for {}",
                gpu.info.name
            )));
        }
        let most_runs = most_runs(gpu);
        if runs > most_runs {
            return Err(Error::Argument(format!(
                "the scene has more than {} splats and visible samples, too many for one picture \
                 on {}; convert it and draw it with a coarser --cut, or use a transfer function \
                 that shows less",
                u64::from(most_runs) * u64::from(RUN),
                gpu.info.name
            )));
        }
        let [columns, rows] = self.tiles();
        let bins = groups(sheets, MOST_GROUP_SHIFT) * u64::from(columns * rows);
        if bins > u64::from(MOST_BINS) {
            return Err(Error::Argument(format!(
                "a picture of {width}x{height} with {sheets} sheets is too large; draw it smaller \
                 or with thicker sheets"
            )));
        }
        Ok(())
    }

    /// Returns the constants of the frame, without its tables.
    fn frame(&self, scene: &Scene, budget: Budget) -> Frame {
        let Self { view, sheets, settings, .. } = *self;
        let tiles = self.tiles();
        let most_tiles = tiles[0].max(tiles[1]);
        let mut frame = Frame::new(&frame::Frame::new(scene, view, sheets, settings));
        frame.tiles = tiles;
        frame.tile_shift = most_tiles.div_ceil(SPAN_TILES).next_power_of_two().trailing_zeros();
        frame.entry_capacity = budget.entries;
        frame.record_capacity = budget.record_words;
        frame
    }

    /// Brings what a gathered lattice needs in the strip.
    fn gathered(
        &self,
        gpu: &Gpu,
        prepared: &mut PreparedScene,
        (table, fields): (&[[f32; 4]], &[Field]),
        frame: &mut Frame,
    ) -> Option<Gathered> {
        let field = prepared.field.as_mut().filter(|_| self.variant.gather)?;
        let before = field.bytes();
        let [columns, rows] = self.tiles();
        let place = (self.sheets, columns * rows);
        let table = (table, fields.first()?);
        let gathered = field.gathered(gpu, place, self.variant, table, &mut frame.fields[0])?;
        prepared.bytes += field.bytes() - before;
        Some(gathered)
    }
}

/// The sizes of buffers, in bytes or elements. Those that only scattering needs are empty without.
struct Sizes {
    tile_count: u32,
    pixels: u64,
    /// Bytes of the saved sums of tiles.
    slots: u64,
    bin_count: u64,
    /// Record words.
    words: u64,
    runs: u64,
    census: u64,
    map: u64,
    entries: u64,
}

impl Sizes {
    fn of(request: &Request<'_>, gpu: &Gpu, budget: Budget, runs: u32) -> Self {
        let Request { variant, view, sheets, .. } = *request;
        let room = |count: u64| if variant.scatters() { count } else { 0 };
        let tiles = request.tiles();
        let tile_count = tiles[0] * tiles[1];
        let fields = variant.fields as usize;
        let slots = (u64::from(tile_count) * slot_bytes(fields)).min(most_slot_bytes(gpu, fields));
        // The number of entries is stored behind the last bin.
        let bins = (groups(sheets.count(), 0) * u64::from(tile_count)).min(u64::from(MOST_BINS));
        Self {
            tile_count,
            pixels: u64::from(view.size[0]) * u64::from(view.size[1]),
            slots: if variant.can_stop() { room(slots) } else { 0 },
            bin_count: room(bins + 1),
            words: room(u64::from(budget.record_words)),
            runs: room(u64::from(runs)),
            census: room(census_bytes(sheets.count())),
            map: room(map_bytes(tiles)),
            entries: room(4 * u64::from(budget.entries)),
        }
    }
}

/// Returns the boundaries of the sheets. The sheet before the first extends backward without end,
/// the sheet after the last forward.
fn planes(sheets: &Sheets) -> Vec<f32> {
    let mut planes = vec![-3e38f32];
    planes.extend(sheets.planes.iter().map(|&s| s as f32));
    planes.extend([3e38; 4]);
    planes
}

/// Returns the word of `progress` that counts the tiles that gather has drawn (progress.wgsl).
pub fn gathered_word(tiles: u32) -> u64 {
    2 * u64::from(tiles) + SLOTS / 32 + 3
}

/// Returns the bytes of the counts by sheet and band (census.wgsl) for a number of sheets. There
/// are 6 counts for each of 16 bands and for all bands together, also for the sheet before the
/// first and the one behind the last.
pub fn census_bytes(sheets: usize) -> u64 {
    (sheets as u64 + 2) * 17 * 6 * 4
}

/// Returns the bytes of the map of opaque tiles, for these columns and rows of tiles.
pub fn map_bytes([columns, rows]: [u32; 2]) -> u64 {
    let (columns, rows) = (u64::from(columns), u64::from(rows));
    4 * ((columns + 1) * (rows + 1) + columns * rows)
}
