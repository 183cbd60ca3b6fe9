//! The buffers of a frame and the order of its passes.

use super::{
    Gpu,
    cut::Cut,
    large::Large,
    march::March,
    measure::Measure,
    order::Order,
    plan::{self, MAX_PASSES, Plan},
    project::Project,
    scan::{SCAN_CAPACITY, Scan},
    scatter::Scatter,
    select::Select,
    shaders::Variant,
    tables::Tables,
    uniforms::{self, Frame, PASS_BYTES, PASS_STRIDE, Report},
    upload::{Origin, PreparedScene, upload},
};
use crate::{
    Error, Result,
    math::{Profile, Sheets, View},
    scene::{Gradient, Item, Optics, Settings},
    volume::Arrangement,
};
use wgpu::{BufferUsages as Usage, util::DeviceExt};

/// How much room a pass has. A frame that needs more is drawn in several passes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budget {
    /// (splat, tile, window) triples of a pass: 4 bytes each.
    pub entries: u32,
    /// Record words of a pass: an isotropic lattice sample takes one, any other splat four; 28 bytes each.
    pub record_words: u32,
    /// Entries of a tile that one dispatch of march adds up; a tile with more goes on in another. `None`: as many as the
    /// adapter's driver bears.
    pub tile_entries: Option<u32>,
}

impl Default for Budget {
    fn default() -> Self {
        Self { entries: 1 << 24, record_words: 1 << 22, tile_entries: None }
    }
}

impl Budget {
    /// Records are numbered with 23 bits in an entry.
    const MOST_WORDS: u32 = 1 << 23;

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

/// Bins of a pass at most; groups of sheets are made so large that they suffice.
const MOST_BINS: u32 = 1 << 21;
/// Groups hold at most this many sheets (7 bits in an entry).
const MOST_GROUP_SHIFT: u32 = 7;
/// Which light and which sources a picture has decides what is compiled.
pub fn variant(gpu: &Gpu, prepared: &PreparedScene, view: &View, settings: &Settings, budget: Budget) -> Variant {
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
        radiance: false,
        isotropic: false,
        table_kernel: false,
        volume_shaded: false,
        surface_shaded: false,
        gradient_opacity: false,
        isosurfaces: 0,
        clips: 0,
        holes: 0,
        central: false,
        // A software adapter runs eight invocations at once: eight columns of eight pixels fill a tile.
        rows: if gpu.is_software() { 8 } else { 1 },
        most_entries: budget.tile_entries.unwrap_or(if gpu.is_software() { SOFTWARE_ENTRIES } else { u32::MAX }),
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
            Item::Scalar(_, transfer) | Item::Volume(_, _, transfer) => transfer,
        };
        let shaded = is_lit && settings.shade_of(transfer).is_some();
        if classified {
            variant.classified = true;
            variant.surface_shaded |= shaded;
        } else {
            variant.scalar = true;
            variant.volume_shaded = shaded;
            variant.gradient_opacity = !transfer.gradient.is_empty() && settings.optics != Optics::Maximum;
            variant.isosurfaces = if is_lit { transfer.isosurfaces.len() as u32 } else { 0 };
        }
        if let Item::Volume(volume, kernel, _) = item {
            variant.lattice = true;
            variant.body_centred = volume.lattice.arrangement == Arrangement::BodyCentred;
            variant.rectilinear = matches!(volume.lattice.arrangement, Arrangement::Rectilinear(_));
            variant.table_kernel = !matches!(kernel.profile, Profile::Gaussian(_));
            let spacing = volume.lattice.spacing().max_element();
            let near = view.distances(&item.bounds())[0];
            // The sections of a kernel shift by ρ²σ²/2|c| between its centre and radius ρσ.
            let flat = !view.perspective || near > ISOTROPIC_DISTANCE * kernel.extent * spacing;
            let alike = !variant.rectilinear && !variant.table_kernel && is_isotropic(volume.lattice.axes);
            variant.isotropic = flat && alike && !classified;
        }
    }
    variant.central = variant.gradients() && settings.gradient == Gradient::Central;
    variant
}

/// Mesa's software driver ends all loops of an invocation after 65,535 iterations together. In march an entry takes up to
/// six: its own, and those that find its sheet and close the sheets before it.
const SOFTWARE_ENTRIES: u32 = 10_000;

/// Beyond this many footprint radii the sections of an isotropic kernel count as the same for all pixels. The error is at
/// most a hundredth of the radius, at the footprint's rim; tests/engine_equals_reference.rs bounds the picture's.
const ISOTROPIC_DISTANCE: f64 = 50.0;

/// Steps of equal length at right angles.
fn is_isotropic(axes: glam::DMat3) -> bool {
    let product = axes.transpose() * axes;
    let size = product.x_axis.x;
    let difference = product - glam::DMat3::from_diagonal(glam::DVec3::splat(size));
    difference.to_cols_array().iter().all(|d| d.abs() <= 1e-4 * size)
}

/// The pipelines of a variant.
#[derive(Debug)]
pub struct Pipelines {
    measure: Measure,
    plan: Plan,
    project: Project,
    scatter: Scatter,
    large: Large,
    order: Order,
    march: March,
}

impl Pipelines {
    pub fn new(gpu: &Gpu, variant: &Variant) -> Self {
        Self {
            measure: Measure::new(gpu, variant),
            plan: Plan::new(gpu, variant),
            project: Project::new(gpu, variant),
            scatter: Scatter::new(gpu, variant),
            large: Large::new(gpu, variant),
            order: Order::new(gpu, variant),
            march: March::new(gpu, variant),
        }
    }
}

/// The buffers of a frame: what the passes write for each other, and the picture.
#[derive(Debug)]
pub struct Targets {
    pub frame: wgpu::Buffer,
    pub planes: wgpu::Buffer,
    pub tables: wgpu::Buffer,
    pub needs: wgpu::Buffer,
    pub totals: wgpu::Buffer,
    pub census: wgpu::Buffer,
    pub passes: wgpu::Buffer,
    pub report: wgpu::Buffer,
    pub run_count: wgpu::Buffer,
    pub runs: wgpu::Buffer,
    pub records: wgpu::Buffer,
    pub boxes: wgpu::Buffer,
    pub bins: wgpu::Buffer,
    pub entries: wgpu::Buffer,
    pub scatter_arguments: wgpu::Buffer,
    pub large: wgpu::Buffer,
    pub large_count: wgpu::Buffer,
    pub large_arguments: wgpu::Buffer,
    pub long_bins: wgpu::Buffer,
    pub long_count: wgpu::Buffer,
    pub long_arguments: wgpu::Buffer,
    pub progress: wgpu::Buffer,
    pub colors: wgpu::Buffer,
    pub depths: wgpu::Buffer,
    pub run_total: u32,
    pub bin_count: u32,
    pub tile_count: u32,
}

impl Targets {
    pub fn pass(&self, pass: u32) -> wgpu::BufferBinding<'_> {
        wgpu::BufferBinding {
            buffer: &self.passes,
            offset: u64::from(pass) * PASS_STRIDE,
            size: wgpu::BufferSize::new(PASS_BYTES),
        }
    }

    /// What scatter and large bind alike to fill the bins of a pass.
    pub fn bin_bindings(&self, pass: u32) -> [wgpu::BufferBinding<'_>; 7] {
        [
            self.frame.as_entire_buffer_binding(),
            self.pass(pass),
            self.boxes.as_entire_buffer_binding(),
            self.runs.as_entire_buffer_binding(),
            self.bins.as_entire_buffer_binding(),
            self.entries.as_entire_buffer_binding(),
            self.run_count.as_entire_buffer_binding(),
        ]
    }

    /// Where in `progress` it stands whether any tile is unfinished, and whether one cannot be finished: a byte offset.
    pub fn unfinished(&self) -> u64 {
        4 * u64::from(self.tile_count)
    }

    /// Bytes of GPU memory.
    pub fn bytes(&self) -> u64 {
        let Self { frame, planes, tables, needs, totals, census, passes, report, run_count, runs, records, .. } = self;
        let Self { boxes, bins, entries, long_bins, long_count, colors, depths, .. } = self;
        [frame, planes, tables, needs, totals, census, passes, report, run_count, runs, records]
            .into_iter()
            .chain([boxes, bins, entries, long_bins, long_count, colors, depths])
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
        if let Some((_, buffer)) = self.0.iter().find(|(name, buffer)| *name == label && buffer.size() >= bytes) {
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
#[allow(clippy::too_many_arguments, reason = "each is a different thing that the renderer holds apart")]
pub fn targets(
    gpu: &Gpu,
    pool: &mut Pool,
    prepared: &PreparedScene,
    variant: &Variant,
    view: &View,
    sheets: &Sheets,
    settings: &Settings,
    budget: Budget,
) -> Result<Targets> {
    let [width, height] = view.size;
    let pixels = u64::from(width) * u64::from(height);
    if pixels * 16 > gpu.binding_size() {
        // The renderer cuts pictures in strips of whole rows; only a single row can be too long.
        return Err(Error::Argument(format!("a picture {width} pixels wide is too wide for {}", gpu.info.name)));
    }
    if prepared.runs >= SCAN_CAPACITY {
        return Err(Error::Argument(format!(
            "the scene has more than {} splats and samples, more than one picture takes",
            u64::from(SCAN_CAPACITY) * u64::from(super::upload::RUN)
        )));
    }
    let budget = budget.within(gpu);
    let step = variant.tile_step();
    let tiles = [width.div_ceil(step), height.div_ceil(step)];
    let tile_count = tiles[0] * tiles[1];
    // One group more than the sheets fill: passes start a sheet early, and their groups count from there.
    let groups = |shift: u32| ((sheets.count() as u32 + 2) >> shift) + 1;
    let enough = |shift: &u32| u64::from(groups(*shift)) * u64::from(tile_count) <= u64::from(MOST_BINS);
    let Some(group_shift) = (0..=MOST_GROUP_SHIFT).find(enough) else {
        return Err(Error::Argument(format!(
            "a picture of {width}x{height} with {} sheets is too large; draw it smaller or with thicker sheets",
            sheets.count()
        )));
    };
    let bin_count = groups(group_shift) * tile_count;

    let mut frame = Frame::new(&prepared.scene, view, sheets, settings);
    frame.tiles = tiles;
    frame.group_shift = group_shift;
    frame.entry_capacity = budget.entries;
    frame.record_capacity = budget.record_words;
    let table = tables_of(prepared, &mut frame);

    // The sheet before the first reaches back, the one after the last forward, without end.
    let mut planes = vec![-3e38f32];
    planes.extend(sheets.planes.iter().map(|&s| s as f32));
    planes.extend([3e38; 4]);

    let uniform = |label, bytes: &[u8]| {
        gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some(label),
            contents: bytes,
            usage: Usage::UNIFORM,
        })
    };
    let words = u64::from(budget.record_words);
    let runs = u64::from(prepared.runs);
    Ok(Targets {
        frame: uniform("frame", bytemuck::bytes_of(&frame)),
        planes: upload(gpu, "planes", bytemuck::cast_slice(&planes)),
        tables: upload(gpu, "tables", bytemuck::cast_slice(&table)),
        run_count: uniform("run count", bytemuck::bytes_of(&[prepared.runs, 0, 0, 0])),
        needs: pool.take(gpu, "needs", 8 * runs),
        totals: pool.take(gpu, "totals", 12),
        census: pool.take(gpu, "census", plan::census_bytes(sheets.count())),
        passes: pool.take(gpu, "passes", PASS_STRIDE * u64::from(MAX_PASSES)),
        report: pool.take(gpu, "report", size_of::<Report>() as u64),
        runs: pool.take(gpu, "runs", 4 * (runs + 1)),
        records: pool.take(gpu, "records", 16 * words),
        boxes: pool.take(gpu, "boxes", 12 * words),
        bins: pool.take(gpu, "bins", 4 * u64::from(bin_count)),
        entries: pool.take(gpu, "entries", 4 * u64::from(budget.entries)),
        scatter_arguments: pool.take(gpu, "scatter arguments", 12),
        large: pool.take(gpu, "large", 4 * words),
        large_count: pool.take(gpu, "large count", 4),
        large_arguments: pool.take(gpu, "large arguments", 12),
        long_bins: pool.take(gpu, "long bins", 4 * u64::from(bin_count)),
        long_count: pool.take(gpu, "long count", 4),
        long_arguments: pool.take(gpu, "long arguments", 12),
        progress: pool.take(gpu, "progress", 4 * (u64::from(tile_count) + 2)),
        colors: pool.take(gpu, "colors", 16 * pixels),
        depths: pool.take(gpu, "depths", 4 * pixels),
        run_total: prepared.runs,
        bin_count,
        tile_count,
    })
}

/// The tables of the scene's field; a frame without one gets some of no meaning.
fn tables_of(prepared: &PreparedScene, frame: &mut Frame) -> Vec<[f32; 4]> {
    let field = prepared.scene.items.iter().find_map(|item| match item {
        Item::Radiance(_) | Item::Hierarchy(_) => None,
        Item::Scalar(set, transfer) => Some((transfer, set.value_range(), None)),
        Item::Volume(volume, kernel, transfer) => Some((transfer, volume.range, Some(kernel))),
    });
    let Some((transfer, range, kernel)) = field else { return vec![[0.0; 4]; 2] };
    let tables = Tables::new(transfer, range, kernel);
    frame.transfer = tables.transfer;
    tables.entries
}

/// One step of a frame, for profiles.
pub type Step<'a> = (&'static str, Box<dyn Fn(&mut wgpu::CommandEncoder) + 'a>);

/// The steps before the first pass: selection where the transfer function changed, the cuts of hierarchies, then measure and
/// plan.
pub fn opening<'a>(
    gpu: &'a Gpu,
    select: &'a Select,
    cut: &'a Cut,
    scan: &'a Scan,
    pipelines: &'a Pipelines,
    targets: &'a Targets,
    prepared: &'a PreparedScene,
) -> Vec<Step<'a>> {
    let mut steps: Vec<Step<'a>> = Vec::new();
    for chunk in &prepared.chunks {
        if let Origin::Nodes { slots, .. } = &chunk.origin {
            let own = slots.chunk(&chunk.uniform, &chunk.data);
            steps.push(("cut", Box::new(move |encoder| cut.encode(gpu, encoder, scan, &own))));
        }
        let Origin::Lattice { volume, selection, .. } = &chunk.origin else { continue };
        if !selection.outdated {
            continue;
        }
        let transfer = prepared.scene.items.iter().find_map(|item| match item {
            Item::Volume(_, _, transfer) => Some(transfer),
            _ => None,
        });
        if let Some(transfer) = transfer {
            steps.push((
                "select",
                Box::new(move |encoder| {
                    select.encode(gpu, encoder, scan, selection, &chunk.uniform, chunk.count, transfer, volume.range);
                }),
            ));
        }
    }
    steps.push((
        "measure",
        Box::new(move |encoder| {
            encoder.clear_buffer(&targets.needs, 0, None);
            encoder.clear_buffer(&targets.colors, 0, None);
            encoder.clear_buffer(&targets.depths, 0, None);
            for chunk in &prepared.chunks {
                pipelines.measure.encode(gpu, encoder, targets, chunk);
            }
        }),
    ));
    steps.push(("plan", Box::new(move |encoder| pipelines.plan.encode(gpu, encoder, targets, &prepared.chunks))));
    steps
}

/// The steps of one depth pass.
pub fn depth_pass<'a>(
    gpu: &'a Gpu,
    scan: &'a Scan,
    pipelines: &'a Pipelines,
    targets: &'a Targets,
    prepared: &'a PreparedScene,
    pass: u32,
) -> Vec<Step<'a>> {
    vec![
        (
            "project",
            Box::new(move |encoder| {
                pipelines.project.encode(gpu, encoder, targets, scan, &prepared.chunks, pass);
            }),
        ),
        (
            "bin",
            Box::new(move |encoder| {
                pipelines.scatter.encode_count(gpu, encoder, targets, pass);
                pipelines.large.encode_count(gpu, encoder, targets, pass);
                scan.encode(gpu, encoder, &targets.bins, targets.bin_count);
                pipelines.scatter.encode(gpu, encoder, targets, pass);
                pipelines.large.encode_fill(gpu, encoder, targets, pass);
            }),
        ),
        ("order", Box::new(move |encoder| pipelines.order.encode(gpu, encoder, targets, pass))),
        (
            "march",
            Box::new(move |encoder| {
                encoder.clear_buffer(&targets.progress, 0, None);
                pipelines.march.encode(gpu, encoder, targets, pass);
            }),
        ),
    ]
}

/// The step that goes on with the tiles of a pass that march has stopped.
pub fn march_on<'a>(gpu: &'a Gpu, pipelines: &'a Pipelines, targets: &'a Targets, pass: u32) -> Step<'a> {
    let encode = move |encoder: &mut wgpu::CommandEncoder| {
        encoder.clear_buffer(&targets.progress, targets.unfinished(), Some(8));
        pipelines.march.encode(gpu, encoder, targets, pass);
    };
    ("march", Box::new(encode))
}
