//! The buffers of a frame and the order of its passes.

use super::{
    Gpu,
    bin::Bin,
    clear::Clear,
    cull::Cull,
    cut::Cut,
    gather::{Gather, Gathered},
    large::Large,
    march::March,
    measure::Measure,
    occlusion::{Occlusion, map_bytes},
    order::Order,
    plan::{self, Plan},
    project::Project,
    resume::Resume,
    scan::{SCAN_CAPACITY, Scan},
    shaders::Variant,
    tables::{self, Tables},
    tiles::Tiles,
    uniforms::{
        self, AGAIN_ARGUMENTS, ARGUMENT_BYTES, Frame, MARCH_ARGUMENTS, PASS_BYTES, SCAN_ARGUMENTS,
        State,
    },
    upload::{Origin, PreparedScene, upload},
};
use crate::{
    Error, Result,
    math::{Kernel, Profile, Sheets, View},
    scene::{Gradient, Item, Optics, Settings},
    volume::{Arrangement, Lattice, bricks::Choice},
};
use wgpu::BufferUsages as Usage;

/// How much room a pass has. A frame that needs more is drawn in several passes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budget {
    /// (splat, tile, window) triples of a pass: 4 bytes each.
    pub entries: u32,
    /// Record words of a pass: an isotropic lattice sample takes one, any other splat four; 28 bytes each.
    pub record_words: u32,
    /// Entries that a pass takes at least, where it might end earlier to see what is hidden behind it. `None`: as many as
    /// another pass is worth.
    pub least_share: Option<u32>,
    /// Entries of a tile that one dispatch of march adds up; a tile with more goes on in another. `None`: as many as the
    /// adapter's driver bears.
    pub tile_entries: Option<u32>,
}

impl Default for Budget {
    fn default() -> Self {
        Self { entries: 1 << 24, record_words: 1 << 22, least_share: None, tile_entries: None }
    }
}

impl Budget {
    /// Records are numbered with 22 bits in an entry.
    const MOST_WORDS: u32 = 1 << 22;

    /// The budget within what a binding of this device holds.
    fn within(self, gpu: &Gpu) -> Self {
        let room = u32::try_from(gpu.binding_size() / 16).unwrap_or(u32::MAX);
        Self {
            entries: self.entries.clamp(1, room.saturating_mul(4)),
            record_words: self.record_words.clamp(4, room.min(Self::MOST_WORDS)),
            ..self
        }
    }
}

/// Bytes of a run's span, and of what it needs.
const RUN_BYTES: u64 = 8;

/// Runs of candidates that a picture takes at most.
pub fn most_runs(gpu: &Gpu) -> u32 {
    // One place stays free for their sum.
    (gpu.binding_size() / RUN_BYTES).min(u64::from(SCAN_CAPACITY)) as u32 - 1
}

/// Bins of a pass at most; groups of sheets are made so large that they suffice.
pub const MOST_BINS: u32 = 1 << 21;
/// Groups hold at most 2 to this power sheets (7 bits in an entry).
pub const MOST_GROUP_SHIFT: u32 = 7;
/// Columns and rows of tiles that a span tells apart (10 bits each in spans.wgsl).
const SPAN_TILES: u32 = 1 << 10;

/// Rows of tiles that a box tells apart (14 bits in bins.wgsl).
const BOX_ROWS: u64 = 1 << 14;

/// Groups of 2 to the power `shift` sheets that a pass through all of them has: one more than they fill, as it starts a sheet
/// early and counts from there.
fn groups(sheets: usize, shift: u32) -> u64 {
    ((sheets as u64 + 2) >> shift) + 1
}

/// Rows of pixels that have bins enough for so many sheets, whatever is drawn, and whose tiles' rows a box tells apart.
pub fn most_rows(width: u32, sheets: usize) -> u64 {
    // A tile without the edge that it may share with its neighbours.
    const STEP: u32 = 6;
    let bins = groups(sheets, MOST_GROUP_SHIFT) * u64::from(width.div_ceil(STEP));
    u64::from(STEP) * (u64::from(MOST_BINS) / bins).min(BOX_ROWS)
}

/// Which light and which sources a picture has decides what is compiled.
pub fn variant(
    gpu: &Gpu,
    prepared: &PreparedScene,
    view: &View,
    settings: &Settings,
    budget: Budget,
    choice: Option<&Choice>,
    gather: bool,
) -> Variant {
    let mut variant = Variant {
        perspective: view.perspective,
        mode: settings.mode,
        classification: settings.classification,
        optics: settings.optics,
        scalar: false,
        classified: false,
        lattice: false,
        body_centred: false,
        rectilinear: false,
        gather,
        sample_kind: 0,
        two_levels: false,
        radiance: false,
        isotropic: false,
        table_kernel: false,
        beyond: false,
        volume_shaded: false,
        surface_shaded: false,
        gradient_opacity: false,
        occlusion: settings.occlusion && settings.hides() && prepared.scene.can_hide(),
        least_share: 0,
        isosurfaces: 0,
        clips: 0,
        holes: 0,
        central: false,
        // A software adapter runs eight invocations at once: eight columns of eight pixels fill a tile.
        rows: if gpu.is_software() { 8 } else { 1 },
        most_entries: budget.tile_entries.unwrap_or(if gpu.is_software() {
            SOFTWARE_ENTRIES
        } else {
            u32::MAX
        }),
    };
    [variant.clips, variant.holes] = uniforms::clip_counts(settings);
    let classified = settings.classifies_samples();
    // Light is seen in emission alone.
    let is_lit = settings.optics == Optics::EmissionAbsorption;
    for item in &prepared.scene.items {
        let transfer = match item {
            Item::Radiance(_) | Item::Hierarchy(_) => {
                variant.radiance = true;
                variant.surface_shaded |= is_lit && settings.surface_shade.is_some();
                continue;
            }
            Item::Scalar(_, transfer)
            | Item::Volume(_, _, transfer)
            | Item::Bricks(_, _, transfer) => transfer,
        };
        let shaded = is_lit && settings.shade_of(transfer).is_some();
        if classified {
            variant.classified = true;
            variant.surface_shaded |= shaded;
        } else {
            variant.scalar = true;
            variant.volume_shaded = shaded;
            variant.gradient_opacity =
                !transfer.gradient.is_empty() && settings.optics != Optics::Maximum;
            variant.isosurfaces = if is_lit { transfer.isosurfaces.len() as u32 } else { 0 };
        }
        variant.beyond = match item {
            Item::Volume(volume, ..) => tables::leaves_out(transfer, volume.range),
            Item::Bricks(bricks, ..) => tables::leaves_out(transfer, bricks.header().range),
            // To find their range takes longer.
            _ => true,
        };
        if let Item::Volume(volume, kernel, _) = item {
            variant.lattice = true;
            variant.body_centred = volume.lattice.arrangement == Arrangement::BodyCentred;
            variant.rectilinear = matches!(volume.lattice.arrangement, Arrangement::Rectilinear(_));
            variant.table_kernel = !matches!(kernel.profile, Profile::Gaussian(_));
            let alike = !variant.rectilinear && !variant.table_kernel && !classified;
            variant.isotropic = alike && !gather && are_flat(&volume.lattice, kernel, view, item);
            variant.sample_kind =
                prepared.field.as_ref().filter(|_| gather).map_or(0, |field| field.kind);
        }
        if let (Item::Bricks(bricks, kernel, _), Some(choice)) = (item, choice) {
            variant.lattice = true;
            variant.two_levels = choice.levels.len() > 1;
            let flat =
                |&(level, _): &(usize, f64)| are_flat(&bricks.lattice(level), kernel, view, item);
            variant.isotropic = choice.levels.iter().all(flat);
        }
    }
    // Where a pass ends, march meets splats again and closes sheets twice: of a field that costs more than of a surface.
    variant.least_share =
        budget.least_share.unwrap_or(if variant.scalar { 1 << 21 } else { 1 << 18 });
    variant.central = variant.gradients() && settings.gradient == Gradient::Central;
    if gather && variant.rows > 1 {
        // Each pixel looks at the samples around its own ray, so pixels of an invocation would share nothing.
        variant.rows = GATHERED_ROWS;
        variant.most_entries = variant.most_entries.min(GATHERED_ENTRIES);
    }
    variant
}

/// Tiles that march may stop in one pass with their sums kept (`SLOT_WORDS` in progress.wgsl has a bit for each).
const SLOTS: u64 = 1024;
/// Bytes of a tile's sums (`SAVED_VECTORS` in saved.wgsl).
const SLOT_BYTES: u64 = 64 * 17 * 16;
/// Bytes that slots take at most behind the colours of a picture, which they share a binding with.
pub fn most_slot_bytes(gpu: &Gpu) -> u64 {
    SLOTS.min(gpu.binding_size() / 2 / SLOT_BYTES) * SLOT_BYTES
}

/// Mesa's software driver ends all loops of an invocation after 65,535 iterations together. In march an entry takes up to
/// six: its own, and those that find its sheet and close the sheets before it.
const SOFTWARE_ENTRIES: u32 = 10_000;
/// The same beside a field that is gathered: all sheets may lie between two entries.
const GATHERED_ENTRIES: u32 = 5_000;
/// Pixels of an invocation of march on such a driver, beside a field that is gathered.
const GATHERED_ROWS: u32 = 1;

/// Beyond this many footprint radii the sections of an isotropic kernel count as the same for all pixels. The error is at
/// most a hundredth of the radius, at the footprint's rim; tests/engine_equals_reference.rs bounds the picture's.
const ISOTROPIC_DISTANCE: f64 = 50.0;

/// Whether the kernels of a lattice are round, and so far away that their sections are the same for all pixels.
fn are_flat(lattice: &Lattice, kernel: &Kernel, view: &View, item: &Item) -> bool {
    let near = view.distances(&item.bounds())[0];
    // The sections of a kernel shift by ρ²σ²/2|c| between its centre and radius ρσ.
    let reach = kernel.extent * lattice.spacing().max_element();
    (!view.perspective || near > ISOTROPIC_DISTANCE * reach) && is_isotropic(lattice.axes)
}

/// Steps of equal length at right angles.
fn is_isotropic(axes: glam::DMat3) -> bool {
    let product = axes.transpose() * axes;
    let size = product.x_axis.x;
    let difference = product - glam::DMat3::from_diagonal(glam::DVec3::splat(size));
    difference.to_cols_array().iter().all(|d| d.abs() <= 1e-4 * size)
}

/// The pipelines of a variant: those that scatter splats, and that which gathers a lattice.
#[derive(Debug)]
pub struct Pipelines {
    scatter: Option<Scatter>,
    gather: Option<Gather>,
}

#[derive(Debug)]
struct Scatter {
    measure: Measure,
    plan: Plan,
    project: Project,
    cull: Cull,
    bin: Bin,
    large: Large,
    order: Order,
    march: March,
    occlusion: Option<Occlusion>,
}

impl Pipelines {
    pub fn new(gpu: &Gpu, variant: &Variant) -> Self {
        Self {
            scatter: variant.scatters().then(|| Scatter::new(gpu, variant)),
            gather: variant.gather.then(|| Gather::new(gpu, variant)),
        }
    }
}

impl Scatter {
    fn new(gpu: &Gpu, variant: &Variant) -> Self {
        Self {
            measure: Measure::new(gpu, variant),
            plan: Plan::new(gpu, variant),
            project: Project::new(gpu, variant),
            cull: Cull::new(gpu, variant),
            bin: Bin::new(gpu, variant),
            large: Large::new(gpu, variant),
            order: Order::new(gpu, variant),
            march: March::new(gpu, variant),
            occlusion: variant.occlusion.then(|| Occlusion::new(gpu, variant)),
        }
    }
}

/// The buffers of a frame: what the passes write for each other, and the picture.
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
    /// What is gathered.
    pub gathered: Option<Gathered>,
    pub run_total: u32,
    pub tiles: [u32; 2],
}

impl Targets {
    /// Bytes of GPU memory.
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
        let buffer = super::buffer(
            gpu,
            label,
            bytes,
            Usage::STORAGE | Usage::UNIFORM | Usage::INDIRECT | Usage::COPY_SRC | Usage::COPY_DST,
        );
        self.0.push((label, buffer.clone()));
        buffer
    }
}

/// Makes (or takes from the pool) everything a frame needs.
#[allow(
    clippy::too_many_arguments,
    reason = "each is a different thing that the renderer holds apart"
)]
pub fn targets(
    gpu: &Gpu,
    pool: &mut Pool,
    prepared: &mut PreparedScene,
    variant: &Variant,
    view: &View,
    sheets: &Sheets,
    settings: &Settings,
    budget: Budget,
    choice: Option<&Choice>,
) -> Result<Targets> {
    let [width, height] = view.size;
    let pixels = u64::from(width) * u64::from(height);
    if pixels * 16 > gpu.binding_size() {
        // The renderer cuts pictures in strips of whole rows; only a single row can be too long.
        return Err(Error::Argument(format!(
            "a picture {width} pixels wide is too wide for {}",
            gpu.info.name
        )));
    }
    let most_runs = most_runs(gpu);
    if prepared.runs > most_runs {
        return Err(Error::Argument(format!(
            "the scene has more than {} splats and samples that may show, more than one picture takes on {}; \
             convert it, and draw it by a coarser --cut, or let a transfer function show less",
            u64::from(most_runs) * u64::from(super::upload::RUN),
            gpu.info.name
        )));
    }
    let budget = budget.within(gpu);
    let scatters = variant.scatters();
    let room = |count: u64| if scatters { count } else { 0 };
    let step = variant.tile_step();
    let tiles = [width.div_ceil(step), height.div_ceil(step)];
    let tile_count = tiles[0] * tiles[1];
    let groups = |shift: u32| groups(sheets.count(), shift);
    if groups(MOST_GROUP_SHIFT) * u64::from(tile_count) > u64::from(MOST_BINS) {
        return Err(Error::Argument(format!(
            "a picture of {width}x{height} with {} sheets is too large; draw it smaller or with thicker sheets",
            sheets.count()
        )));
    }
    let slots = (u64::from(tile_count) * SLOT_BYTES).min(most_slot_bytes(gpu));
    let slots = if variant.can_stop() { room(slots) } else { 0 };
    // The number of entries stands behind the last bin.
    let bin_count = room((groups(0) * u64::from(tile_count)).min(u64::from(MOST_BINS)) + 1);
    let most_tiles = tiles[0].max(tiles[1]);

    let mut frame = Frame::new(&prepared.scene, view, sheets, settings, choice);
    frame.tiles = tiles;
    frame.tile_shift = most_tiles.div_ceil(SPAN_TILES).next_power_of_two().trailing_zeros();
    frame.entry_capacity = budget.entries;
    frame.record_capacity = budget.record_words;
    let table = tables_of(prepared, view, sheets, &mut frame);
    let field = prepared.field.as_mut().filter(|_| variant.gather);
    let before = field.as_ref().map_or(0, |field| field.bytes());
    let gathered =
        field.and_then(|field| field.list(gpu, view, sheets, variant, &table, &mut frame));
    if gathered.is_some() {
        prepared.bytes += prepared.field.as_ref().map_or(0, |field| field.bytes()) - before;
    }

    // The sheet before the first reaches back, the one after the last forward, without end.
    let mut planes = vec![-3e38f32];
    planes.extend(sheets.planes.iter().map(|&s| s as f32));
    planes.extend([3e38; 4]);

    let uniform = |label, bytes: &[u8]| super::filled_buffer(gpu, label, bytes, Usage::UNIFORM);
    let words = room(u64::from(budget.record_words));
    let runs = room(u64::from(prepared.runs));
    Ok(Targets {
        frame: uniform("frame", bytemuck::bytes_of(&frame)),
        planes: upload(gpu, "planes", bytemuck::cast_slice(&planes)),
        tables: upload(gpu, "tables", bytemuck::cast_slice(&table)),
        run_count: uniform("run count", bytemuck::bytes_of(&[prepared.runs, 0, 0, 0])),
        run_spans: pool.take(gpu, "run spans", RUN_BYTES * runs),
        needs: pool.take(gpu, "needs", RUN_BYTES * runs),
        census: pool.take(gpu, "census", room(plan::census_bytes(sheets.count()))),
        state: pool.take(gpu, "state", size_of::<State>() as u64),
        pass: pool.take(gpu, "pass", PASS_BYTES),
        arguments: pool.take(gpu, "arguments", ARGUMENT_BYTES),
        bin_size: pool.take(gpu, "bin size", 16),
        map: pool.take(gpu, "map", room(map_bytes(tiles))),
        runs: pool.take(gpu, "runs", 4 * (runs + 1)),
        active: pool.take(gpu, "active", 8 * runs),
        records: pool.take(gpu, "records", 16 * words),
        boxes: pool.take(gpu, "boxes", 12 * words),
        bins: pool.take(gpu, "bins", 4 * bin_count),
        entries: pool.take(gpu, "entries", room(4 * u64::from(budget.entries))),
        bin_arguments: pool.take(gpu, "bin arguments", 12),
        large: pool.take(gpu, "large", 4 * (words + 1)),
        large_arguments: pool.take(gpu, "large arguments", 12),
        long_bins: pool.take(gpu, "long bins", 4 * bin_count),
        long_count: pool.take(gpu, "long count", 4),
        long_arguments: pool.take(gpu, "long arguments", 12),
        progress: pool.take(
            gpu,
            "progress",
            4 * (gathered_word(tile_count) + 1 + u64::from(tile_count)),
        ),
        colors: pool.take(gpu, "colors", 16 * pixels + slots),
        depths: pool.take(gpu, "depths", 4 * pixels),
        gathered,
        run_total: prepared.runs,
        tiles,
    })
}

/// The word of `progress` that counts tiles that gather has drawn (progress.wgsl).
pub fn gathered_word(tiles: u32) -> u64 {
    2 * u64::from(tiles) + SLOTS / 32 + 3
}

/// The tables of the scene's field; a frame without one gets some of no meaning.
fn tables_of(
    prepared: &PreparedScene,
    view: &View,
    sheets: &Sheets,
    frame: &mut Frame,
) -> Vec<[f32; 4]> {
    let field = prepared.scene.items.iter().find_map(|item| match item {
        Item::Radiance(_) | Item::Hierarchy(_) => None,
        Item::Scalar(set, transfer) => Some((transfer, set.value_range(), None)),
        Item::Volume(volume, kernel, transfer) => Some((transfer, volume.range, Some(kernel))),
        Item::Bricks(bricks, kernel, transfer) => {
            Some((transfer, bricks.header().range, Some(kernel)))
        }
    });
    let Some((transfer, range, kernel)) = field else { return vec![[0.0; 4]; 2] };
    let tables = Tables::new(transfer, range, kernel);
    frame.set_tables(&tables, transfer, view, sheets);
    tables.entries
}

/// One step of a frame, for profiles.
pub type Step<'a> = (&'static str, Box<dyn Fn(&mut wgpu::CommandEncoder) + 'a>);

/// What the steps of a frame work with.
#[derive(Clone, Copy)]
pub struct Work<'a> {
    pub gpu: &'a Gpu,
    pub cut: &'a Cut,
    pub scan: &'a Scan,
    pub clear: &'a Clear,
    pub resume: &'a Resume,
    pub tiles: &'a Tiles,
    pub pipelines: &'a Pipelines,
    pub targets: &'a Targets,
    pub prepared: &'a PreparedScene,
}

impl<'a> Work<'a> {
    /// The steps before the first pass: the cuts of hierarchies, then measure and plan.
    pub fn opening(self) -> Vec<Step<'a>> {
        let Self { gpu, cut, scan, pipelines, targets, prepared, .. } = self;
        let mut steps: Vec<Step<'a>> = Vec::new();
        if targets.gathered.is_some() {
            let clear = |encoder: &mut wgpu::CommandEncoder| {
                for buffer in [&targets.colors, &targets.depths, &targets.progress] {
                    encoder.clear_buffer(buffer, 0, None);
                }
            };
            steps.push(("clear", Box::new(clear)));
        }
        let Some(scatter) = &pipelines.scatter else { return steps };
        for chunk in &prepared.chunks {
            if let Origin::Nodes { slots, .. } = &chunk.origin {
                let own = slots.chunk(&chunk.uniform, &chunk.data);
                steps.push(("cut", Box::new(move |encoder| cut.encode(gpu, encoder, scan, &own))));
            }
        }
        steps.push((
            "measure",
            Box::new(move |encoder| {
                for buffer in [&targets.needs, &targets.colors, &targets.depths, &targets.map] {
                    encoder.clear_buffer(buffer, 0, None);
                }
                for chunk in &prepared.chunks {
                    scatter.measure.encode(gpu, encoder, targets, chunk);
                }
            }),
        ));
        steps.push(("plan", Box::new(move |encoder| scatter.plan.encode(gpu, encoder, targets))));
        steps
    }

    /// The steps of the next depth pass; they do nothing where the frame is done.
    pub fn depth_pass(self) -> Vec<Step<'a>> {
        let Self { gpu, scan, clear, resume, tiles, pipelines, targets, prepared, .. } = self;
        let Some(scatter) = &pipelines.scatter else { return Vec::new() };
        let chunks = prepared.chunks.as_slice();
        let mut steps: Vec<Step<'a>> = vec![
            (
                "cull",
                Box::new(move |encoder| {
                    scatter.plan.encode_advance(gpu, encoder, targets);
                    scatter.cull.encode(gpu, encoder, targets, chunks);
                    scan.encode(gpu, encoder, &targets.runs, targets.run_total + 1);
                }),
            ),
            (
                "project",
                Box::new(move |encoder| scatter.project.encode(gpu, encoder, targets, chunks)),
            ),
            (
                "bin",
                Box::new(move |encoder| {
                    clear.encode(gpu, encoder, targets);
                    scatter.bin.encode_count(gpu, encoder, targets);
                    scatter.large.encode_count(gpu, encoder, targets);
                    let arguments = (&targets.arguments, SCAN_ARGUMENTS);
                    scan.encode_indirect(gpu, encoder, &targets.bins, &targets.bin_size, arguments);
                    scatter.bin.encode_fill(gpu, encoder, targets);
                    scatter.large.encode_fill(gpu, encoder, targets);
                    tiles.encode(gpu, encoder, targets);
                }),
            ),
            ("order", Box::new(move |encoder| scatter.order.encode(gpu, encoder, targets))),
            (
                "march",
                Box::new(move |encoder| {
                    scatter.march.encode(gpu, encoder, targets, MARCH_ARGUMENTS);
                    resume.encode_again(gpu, encoder, targets);
                    scatter.march.encode(gpu, encoder, targets, AGAIN_ARGUMENTS);
                    resume.encode_hold(gpu, encoder, targets);
                }),
            ),
        ];
        steps.extend(self.occlusion());
        steps
    }

    /// The steps that go on with a pass at which the frame stopped.
    pub fn resumed(self) -> Vec<Step<'a>> {
        // Each march that finds nothing left is empty.
        const MARCHES: usize = 8;
        let Self { gpu, resume, pipelines, targets, .. } = self;
        let Some(scatter) = &pipelines.scatter else { return Vec::new() };
        let march: Step<'a> = (
            "march",
            Box::new(move |encoder| {
                resume.encode_resume(gpu, encoder, targets);
                scatter.march.encode(gpu, encoder, targets, MARCH_ARGUMENTS);
                for _ in 1..MARCHES {
                    resume.encode_again(gpu, encoder, targets);
                    scatter.march.encode(gpu, encoder, targets, AGAIN_ARGUMENTS);
                }
                resume.encode_hold(gpu, encoder, targets);
            }),
        );
        [march].into_iter().chain(self.occlusion()).collect()
    }

    /// The step that gathers what is left of a lattice's field.
    pub fn gathered(self) -> Vec<Step<'a>> {
        let Self { gpu, pipelines, targets, .. } = self;
        let Some(gather) = &pipelines.gather else { return Vec::new() };
        vec![("gather", Box::new(move |encoder| gather.encode(gpu, encoder, targets)))]
    }

    fn occlusion(self) -> Option<Step<'a>> {
        let Self { gpu, pipelines, targets, .. } = self;
        let occlusion = pipelines.scatter.as_ref()?.occlusion.as_ref()?;
        Some(("occlusion", Box::new(move |encoder| occlusion.encode(gpu, encoder, targets))))
    }
}
