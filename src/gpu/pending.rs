//! A picture that is being drawn: batches of passes, each followed by an answer of the GPU that
//! decides what comes next. Nothing here waits.

use crate::{
    Error, FrameStats, Result,
    gpu::{
        budget::Budget,
        device::{Gpu, buffers::buffer, readback::Readback},
        frame::{Passes, Pipelines, Step, Work},
        outline::{Outline, Request, Rows, strips},
        output::Output,
        passes::{
            cut::{finest_within, tally_bytes},
            present::{Pixels, Presenter, Strip},
        },
        pipeline::{commands::Commands, state::State},
        scene::{PreparedScene, chunk::Origin},
        targets::{self, Pool, Targets},
        variant::{self, Variant},
    },
    hierarchy::Detail,
    math::View,
    picture::Picture,
    scene::{Optics, Settings},
};
use std::collections::HashMap;
use web_time::Instant;

/// Maximum number of depth passes in a batch. Each takes some dozens of bind groups.
const MOST_PASSES: u32 = 16;

/// What a renderer keeps on its device from picture to picture.
#[derive(Debug)]
pub struct Engine {
    pub gpu: Gpu,
    pub budget: Budget,
    passes: Passes,
    pipelines: HashMap<Variant, Pipelines>,
    presenter: Presenter,
    pool: Pool,
    /// Depth passes of a batch.
    batch: u32,
    /// The number of the picture that was begun last.
    pub picture: u64,
}

impl Engine {
    pub fn new(gpu: &Gpu, budget: Budget) -> Self {
        Self {
            gpu: gpu.clone(),
            budget,
            passes: Passes::new(gpu),
            pipelines: HashMap::new(),
            presenter: Presenter::default(),
            pool: Pool::default(),
            batch: 4,
            picture: 0,
        }
    }

    /// Drops buffers and pipelines after an error, when the data on the device is not trusted.
    pub fn forget(&mut self) {
        self.pool = Pool::default();
        self.pipelines.clear();
        self.presenter = Presenter::default();
    }
}

/// Where a picture goes.
#[derive(Debug)]
pub enum Sink {
    /// It stays in the engine's buffers.
    Nowhere,
    /// It is read back.
    Picture(Picture),
    Output(Output),
}

/// Runs the steps of a batch: encodes them, or measures each.
pub type Run<'a> = &'a mut dyn FnMut(Vec<Step<'_>>, &mut wgpu::CommandEncoder) -> Result<()>;

/// A picture that is being drawn, from [`Renderer::encode`](super::Renderer::encode) on.
#[derive(Debug)]
pub struct PendingFrame {
    /// Its number among all pictures.
    pub(super) number: u64,
    view: View,
    settings: Settings,
    detail: Detail,
    sink: Sink,
    start: Instant,
    stage: Stage,
    outline: Option<Outline>,
    /// The strips that are not drawn yet, the next one last.
    strips: Vec<Rows>,
    /// The strip that is drawn.
    strip: Option<Drawn>,
    /// What the GPU has been asked for.
    answer: Option<Readback>,
    /// Whether each batch draws one depth pass only, so that none is superfluous.
    singly: bool,
    stats: FrameStats,
}

/// A strip on the device.
#[derive(Debug)]
struct Drawn {
    rows: Rows,
    variant: Variant,
    targets: Targets,
    state: State,
}

/// What the next batch of a picture, or the batch on the device, does.
#[derive(Debug, Clone, Copy)]
enum Stage {
    /// Counts the nodes that each cut of the hierarchies would draw, for a cut of `most` splats.
    Tally {
        pixels: f64,
        most: u64,
    },
    /// Plans the frame with this cut.
    Plan {
        cut_pixels: f64,
    },
    /// Begins a strip.
    Open,
    /// Draws further depth passes.
    Scatter,
    /// Continues a pass at which the strip stopped.
    Resume,
    /// Gathers the field.
    Gather,
    /// Reads the strip back.
    Read,
    Done,
}

impl PendingFrame {
    /// `detail` is the settings' with milliseconds converted to pixels.
    pub(super) fn new(
        engine: &Engine,
        prepared: &mut PreparedScene,
        view: View,
        settings: &Settings,
        detail: Detail,
        sink: Sink,
    ) -> Result<Self> {
        let stage = match detail {
            _ if prepared.page_caches.is_empty() => Stage::Plan { cut_pixels: 0.0 },
            Detail::Pixels(pixels) => Stage::Plan { cut_pixels: pixels },
            Detail::Milliseconds(_) => Stage::Plan { cut_pixels: Detail::PIXELS },
            Detail::Splats(most) => {
                // The pages of a cut contain several times as many nodes as it draws.
                let nodes = most.saturating_mul(8).max(1 << 16);
                let mut pixels = 0.0f64;
                for cache in &prepared.page_caches {
                    let view = prepared.scene.view_of(cache.item, &view);
                    pixels = pixels.max(cache.finest_within(&view, settings, nodes)?);
                }
                prepared.update_forests(&engine.gpu, &view, settings, pixels)?;
                Stage::Tally { pixels, most }
            }
        };
        Ok(Self {
            number: engine.picture,
            view,
            settings: settings.clone(),
            detail,
            sink,
            start: Instant::now(),
            stage,
            outline: None,
            strips: Vec::new(),
            strip: None,
            answer: None,
            singly: false,
            stats: FrameStats::default(),
        })
    }

    /// Draws one depth pass in each batch.
    pub(super) fn singly(self) -> Self {
        Self { singly: true, ..self }
    }

    /// Returns the time since the picture was begun, in milliseconds.
    pub(super) fn milliseconds(&self) -> f64 {
        self.start.elapsed().as_secs_f64() * 1e3
    }

    /// Counts the time since `start` as the processor's.
    pub(super) fn spend(&mut self, start: Instant) {
        self.stats.host_ms += start.elapsed().as_secs_f64() * 1e3;
    }

    /// What the GPU has been asked for.
    pub(super) fn answer(&self) -> Option<&Readback> {
        self.answer.as_ref()
    }

    /// Returns the statistics of a finished picture.
    pub(super) fn stats(&self) -> Option<&FrameStats> {
        matches!(self.stage, Stage::Done).then_some(&self.stats)
    }

    /// Returns the detail of the settings.
    pub(super) fn wanted(&self) -> Detail {
        self.settings.detail
    }

    /// Returns the picture if it was to be read back, and the statistics.
    pub(super) fn finish(self) -> (Option<Picture>, FrameStats) {
        let picture = if let Sink::Picture(picture) = self.sink { Some(picture) } else { None };
        (picture, self.stats)
    }

    /// Encodes the next batch.
    pub(super) fn encode(
        &mut self,
        engine: &mut Engine,
        prepared: &mut PreparedScene,
        encoder: &mut wgpu::CommandEncoder,
        run: Run<'_>,
    ) -> Result<()> {
        if self.answer.is_some() {
            return Err(Error::Argument(
                "the last batch of the picture is not done; encode the next when `poll` asks for it"
                    .into(),
            ));
        }
        if let Stage::Plan { cut_pixels } = self.stage {
            self.plan(engine, prepared, cut_pixels)?;
            self.stage = Stage::Open;
        }
        if let Stage::Open = self.stage {
            self.open(engine, prepared)?;
        }
        self.answer = match self.stage {
            Stage::Tally { .. } => Some(self.tally(engine, prepared, encoder)),
            Stage::Read => self.read(engine, encoder),
            Stage::Done => None,
            _ => self.draw(engine, prepared, encoder, run)?,
        };
        Ok(())
    }

    fn plan(
        &mut self,
        engine: &Engine,
        prepared: &mut PreparedScene,
        cut_pixels: f64,
    ) -> Result<()> {
        let Self { view, settings, detail, .. } = self;
        let request = Request { view, settings, detail: *detail, cut_pixels };
        let outline = request.outline(&engine.gpu, &engine.passes, prepared)?;
        self.stats.read_bricks = outline.read_bricks;
        self.strips =
            strips(&engine.gpu, &self.view, &outline.sheets, prepared.scene.fields().len());
        self.strips.reverse();
        self.outline = Some(outline);
        Ok(())
    }

    /// Makes the buffers of the next strip.
    fn open(&mut self, engine: &mut Engine, prepared: &mut PreparedScene) -> Result<()> {
        let (Some(outline), Some(rows)) = (&self.outline, self.strips.pop()) else {
            self.stage = Stage::Done;
            return Ok(());
        };
        let (gpu, settings, view) = (&engine.gpu, &self.settings, &rows.view);
        if view.size != self.view.size {
            // The memory may not hold the pages of the whole picture at once.
            prepared.update_forests(gpu, view, settings, outline.cut_pixels)?;
        }
        view.validate_for(&prepared.bounds)?;
        let choice = outline.choice.as_ref();
        let kind = prepared.field.as_ref().map_or(0, |field| field.kind);
        let request = variant::Request {
            scene: &prepared.scene,
            view,
            settings,
            budget: engine.budget,
            choice,
            gathered: outline.gather.then_some(kind),
            images: prepared.images.is_some(),
            is_software: gpu.is_software(),
        };
        let variant = variant::variant(&request);
        let fields = prepared.scene.fields();
        for chunk in &prepared.chunks {
            let isotropic = request.is_isotropic(&prepared.scene.items[chunk.item]);
            let field = fields.iter().position(|item| *item == chunk.item).unwrap_or(0);
            let source = chunk
                .source(&prepared.scene.view_of(chunk.item, view), isotropic, &prepared.page_caches)
                .of_field(field);
            gpu.queue.write_buffer(&chunk.uniform, 0, bytemuck::bytes_of(&source));
        }
        let request = targets::Request {
            variant: &variant,
            view,
            sheets: &outline.sheets,
            settings,
            budget: engine.budget,
            choice,
        };
        let targets = request.targets(gpu, &mut engine.pool, prepared)?;
        engine.pipelines.entry(variant).or_insert_with(|| Pipelines::new(gpu, &variant));
        self.strip = Some(Drawn { rows, variant, targets, state: State::default() });
        Ok(())
    }

    /// Encodes a count of the nodes that each cut would draw.
    fn tally(
        &self,
        engine: &Engine,
        prepared: &PreparedScene,
        encoder: &mut wgpu::CommandEncoder,
    ) -> Readback {
        let gpu = &engine.gpu;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        let counters = buffer(gpu, "tally", tally_bytes(), usage);
        let mut commands = Commands::new(encoder);
        for chunk in &prepared.chunks {
            if let Origin::Nodes { slots, .. } = &chunk.origin {
                let source = chunk.source(
                    &prepared.scene.view_of(chunk.item, &self.view),
                    false,
                    &prepared.page_caches,
                );
                gpu.queue.write_buffer(&chunk.uniform, 0, bytemuck::bytes_of(&source));
                let nodes = slots.chunk(&chunk.uniform, &chunk.data);
                engine.passes.cut.encode_tally(gpu, &mut commands, &nodes, &counters);
            }
        }
        Readback::encode(gpu, commands.encoder(), &[(&counters, 0, tally_bytes())])
    }

    /// Encodes the passes of the stage, and what shows how far they got.
    fn draw(
        &mut self,
        engine: &mut Engine,
        prepared: &PreparedScene,
        encoder: &mut wgpu::CommandEncoder,
        run: Run<'_>,
    ) -> Result<Option<Readback>> {
        let Engine { gpu, passes, pipelines, presenter, batch, .. } = engine;
        let Some(Drawn { rows, variant, targets, .. }) = &self.strip else { return Ok(None) };
        let Some(pipelines) = pipelines.get(variant) else { return Ok(None) };
        let work = Work { gpu, passes, pipelines, targets, prepared };
        let mut steps = Vec::new();
        if let Stage::Open = self.stage {
            steps.extend(work.opening());
            self.stage = if variant.scatters() { Stage::Scatter } else { Stage::Gather };
        }
        if let Stage::Resume = self.stage {
            steps.extend(work.resumed());
        }
        let is_last = match self.stage {
            Stage::Gather => {
                steps.extend(work.gathered());
                true
            }
            _ => {
                // As many passes as the last picture took. Superfluous passes do nothing.
                let passes = if self.singly { 1 } else { *batch };
                steps.extend((0..passes).flat_map(|_| work.depth_pass()));
                targets.gathered.is_none()
            }
        };
        run(steps, encoder)?;
        if let Sink::Output(output) = &self.sink
            && is_last
        {
            let optics = self.settings.optics;
            let pixels = Pixels::of(targets);
            let strip = Strip { view: &rows.view, first_row: rows.first, pixels, optics };
            presenter.encode(gpu, encoder, output, &strip);
        }
        let part = match self.stage {
            Stage::Gather => (&targets.progress, 4 * word_of(targets), 8),
            _ => (&targets.state, 0, size_of::<State>() as u64),
        };
        Ok(Some(Readback::encode(gpu, encoder, &[part])))
    }

    /// Encodes the copy of the strip.
    fn read(&self, engine: &Engine, encoder: &mut wgpu::CommandEncoder) -> Option<Readback> {
        let Drawn { rows, targets, .. } = self.strip.as_ref()?;
        let pixels = u64::from(rows.view.size[0]) * u64::from(rows.view.size[1]);
        let parts = [(&targets.colors, 0, 16 * pixels), (&targets.depths, 0, 4 * pixels)];
        Some(Readback::encode(&engine.gpu, encoder, &parts))
    }

    /// Takes the answer of the GPU, if it is there, and decides what comes next. Returns whether
    /// it was there.
    pub(super) fn take(&mut self, engine: &mut Engine, prepared: &PreparedScene) -> Result<bool> {
        let Some(answer) = &self.answer else { return Ok(true) };
        let Some(bytes) = answer.bytes(&engine.gpu)? else { return Ok(false) };
        self.answer = None;
        self.stage = match self.stage {
            Stage::Tally { pixels, most } => {
                let tally: Vec<i32> = bytemuck::pod_collect_to_vec(&bytes);
                Stage::Plan { cut_pixels: pixels.max(finest_within(&tally, most)) }
            }
            Stage::Scatter | Stage::Resume => self.scattered(engine, prepared, &bytes)?,
            Stage::Gather => {
                let [drawn, marked]: [u32; 2] = bytemuck::pod_read_unaligned(&bytes);
                self.stats.gathered += u64::from(marked);
                let targets = self.strip.as_ref().map(|strip| &strip.targets);
                let gathered = targets.and_then(|targets| targets.gathered.as_ref());
                if gathered.is_some_and(|gathered| drawn != gathered.workgroups()) {
                    return Err(did_nothing(&engine.gpu));
                }
                self.close(engine, prepared)
            }
            Stage::Read => {
                self.append(&bytes);
                self.next_strip()
            }
            stage => stage,
        };
        Ok(true)
    }

    /// Looks at how far the depth passes got.
    fn scattered(
        &mut self,
        engine: &mut Engine,
        prepared: &PreparedScene,
        bytes: &[u8],
    ) -> Result<Stage> {
        let Some(strip) = &mut self.strip else { return Ok(Stage::Done) };
        let gpu = &engine.gpu;
        let state: State = bytemuck::pod_read_unaligned(bytes);
        let before = std::mem::replace(&mut strip.state, state);
        let is_done = state.done != 0 && state.stalled == 0;
        if before.advanced == state.advanced && !is_done {
            return Err(did_nothing(gpu));
        }
        if state.overflow != 0 {
            return Err(Error::EntriesExhausted { budget: engine.budget.entries });
        }
        if is_done {
            engine.batch = state.passes.clamp(1, MOST_PASSES);
            let gathers = strip.targets.gathered.is_some();
            return Ok(if gathers { Stage::Gather } else { self.close(engine, prepared) });
        }
        if self.start.elapsed() >= gpu.patience {
            return Err(Error::Driver(format!(
                "{} did not finish the picture within {} s",
                gpu.info.name,
                gpu.patience.as_secs_f64()
            )));
        }
        Ok(if state.stalled != 0 { Stage::Resume } else { Stage::Scatter })
    }

    /// Counts a strip that is drawn.
    fn close(&mut self, engine: &Engine, prepared: &PreparedScene) -> Stage {
        let (Some(Drawn { targets, state, .. }), Some(outline)) = (&self.strip, &self.outline)
        else {
            return Stage::Done;
        };
        let choice = outline.choice.as_ref();
        self.stats.add(FrameStats {
            splats: u64::from(state.splats),
            hidden: u64::from(state.hidden),
            entries: u64::from(state.binned),
            passes: state.passes,
            // Already counted.
            gathered: 0,
            gpu_bytes: prepared.bytes + targets.bytes(),
            cut_pixels: outline.cut_pixels,
            missing_pages: prepared.page_caches.iter().map(|cache| cache.missing as u64).sum(),
            lambda: choice.map_or(0.0, |choice| choice.lambda),
            bricks: choice.map_or(0, |choice| choice.bricks.len() as u64),
            // Already counted for the whole picture.
            read_bricks: 0,
            brick_bytes: prepared.brick_cache.as_ref().map_or(0, |cache| cache.bytes()),
            host_ms: 0.0,
            steps: Vec::new(),
        });
        tracing::debug!(passes = state.passes, device = engine.gpu.info.name, "strip drawn");
        if matches!(self.sink, Sink::Picture(_)) { Stage::Read } else { self.next_strip() }
    }

    fn next_strip(&self) -> Stage {
        if self.strips.is_empty() { Stage::Done } else { Stage::Open }
    }

    /// Appends the rows of a strip to the picture: its colours, then its distances.
    fn append(&mut self, bytes: &[u8]) {
        let (Sink::Picture(picture), Some(strip)) = (&mut self.sink, &self.strip) else { return };
        let view = &strip.rows.view;
        let (width, pixels) = (view.size[0] as usize, bytes.len() / 20);
        let color: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&bytes[..16 * pixels]);
        let hits: Vec<f32> = bytemuck::pod_collect_to_vec(&bytes[16 * pixels..]);
        picture.depth.extend((0..pixels).map(|i| {
            // The maximum of a ray has no depth.
            if color[i][3] < 0.5 || self.settings.optics == Optics::Maximum {
                return f32::INFINITY;
            }
            let at = glam::DVec2::new((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
            hits[i] * view.ray(at).1.z as f32
        }));
        picture.color.extend(color);
    }
}

/// The word of `progress` that counts the tiles that gather has drawn. The next one counts the
/// sheets of tiles that were marked.
fn word_of(targets: &Targets) -> u64 {
    targets::gathered_word(targets.tiles[0] * targets.tiles[1])
}

fn did_nothing(gpu: &Gpu) -> Error {
    // If the device reported an error, the caller returns that error instead.
    Error::Driver(format!("{} did not do the work that was submitted", gpu.info.name))
}
