//! The renderer of the GPU engine: plans frames and draws them. It keeps pipelines and buffers from
//! frame to frame.

use crate::{
    Error, Result,
    bricks::{Choice, slot_bytes},
    gpu::{
        budget::Budget,
        device::{Gpu, buffers::buffer, timestamps::Timestamps},
        frame::{Pipelines, Step, Work},
        passes::{
            clear::Clear,
            cut::{Cut, finest_within, tally_bytes},
            resume::Resume,
            tiles::Tiles,
        },
        pipeline::{scan::Scan, state::State, variant::Variant},
        scene::{
            PreparedScene,
            bricks::{Listed, Room, SLOT_SAMPLES},
            chunk::{Origin, RUN, list_bytes},
            field,
            nodes::Forest,
            select::Select,
            select_bricks::SelectBricks,
        },
        targets::{self, Pool, Targets},
        variant::{self, Request},
    },
    hierarchy::Detail,
    math::{Camera, Sheets, View},
    picture::Picture,
    plan::{FrameStats, pace::Pace},
    scene::{Evaluate, Optics, Scene, Settings},
};
use std::collections::HashMap;
use web_time::Instant;

/// Draws prepared scenes. One renderer serves any number of scenes, cameras and sizes.
#[derive(Debug)]
pub struct Renderer {
    gpu: Gpu,
    budget: Budget,
    select: Select,
    select_bricks: SelectBricks,
    cut: Cut,
    pace: Pace,
    scan: Scan,
    clear: Clear,
    resume: Resume,
    tiles: Tiles,
    pipelines: HashMap<Variant, Pipelines>,
    pool: Pool,
    /// Depth passes that are submitted together.
    passes: u32,
}

/// Maximum number of depth passes submitted together. Each takes some dozens of bind groups.
const MOST_PASSES: u32 = 16;

/// The plan of a frame, made before anything is drawn.
#[derive(Debug)]
struct Outline {
    /// The cut of hierarchies, in pixels.
    cut_pixels: f64,
    /// The bricks of a volume.
    choice: Option<Choice>,
    /// The number of these bricks that were read for the picture.
    read_bricks: u64,
    sheets: Sheets,
    /// Whether the field is gathered.
    gather: bool,
}

impl Renderer {
    /// Creates a renderer on this GPU with the default [`Budget`].
    pub fn new(gpu: &Gpu) -> Self {
        Self::with_budget(gpu, Budget::default())
    }

    /// Returns a renderer whose depth passes have the given capacity.
    pub fn with_budget(gpu: &Gpu, budget: Budget) -> Self {
        gpu.watch_later(|| Self {
            gpu: gpu.clone(),
            budget,
            select: Select::new(gpu),
            select_bricks: SelectBricks::new(gpu),
            cut: Cut::new(gpu),
            pace: Pace::default(),
            scan: Scan::new(gpu),
            pipelines: HashMap::new(),
            pool: Pool::default(),
            clear: Clear::new(gpu),
            resume: Resume::new(gpu),
            tiles: Tiles::new(gpu),
            passes: 4,
        })
    }

    /// Returns a renderer with the same budget on another device.
    pub fn on(&self, gpu: &Gpu) -> Self {
        Self::with_budget(gpu, self.budget)
    }

    /// Uploads a scene.
    ///
    /// # Errors
    /// [`Error::Argument`] if [`Scene::validate`] refuses the scene, or if its kernel is a tensor
    /// product. [`Error::Driver`] or [`Error::Argument`] if the scene does not fit the device.
    pub fn prepare(&self, scene: &Scene) -> Result<PreparedScene> {
        self.gpu.watch(|| PreparedScene::new(&self.gpu, scene))?
    }

    /// Draws a picture and reads it back. A picture larger than a binding is drawn in strips, one
    /// below the other.
    ///
    /// # Errors
    /// [`Error::Argument`] if the camera or the settings do not suit this scene, or if the scene
    /// was prepared on another device. [`Error::Driver`] if the device's memory runs out or a limit
    /// of the driver is reached; a smaller picture may succeed. [`Error::DeviceLost`]: see
    /// [`Gpu::reopened`]. Scenes that are read while they are drawn also return the errors of
    /// reading.
    pub fn render(
        &mut self,
        prepared: &mut PreparedScene,
        camera: &Camera,
        settings: &Settings,
    ) -> Result<(Picture, FrameStats)> {
        let [width, height] = settings.size;
        let mut picture = Picture { width, height, color: Vec::new(), depth: Vec::new() };
        let stats =
            self.draw_strips(prepared, camera, settings, false, |renderer, targets, strip| {
                renderer.read(targets, strip, settings, &mut picture)
            })?;
        Ok((picture, stats))
    }

    /// Draws a picture and leaves it on the GPU. A frame's time then excludes reading it back.
    ///
    /// # Errors
    /// Those of [`Self::render`].
    pub fn draw(
        &mut self,
        prepared: &mut PreparedScene,
        camera: &Camera,
        settings: &Settings,
    ) -> Result<FrameStats> {
        self.draw_strips(prepared, camera, settings, false, |_, _, _| Ok(()))
    }

    /// Like [`Self::draw`], but the statistics contain the time of each step: by the GPU's clock,
    /// or, without a clock, by waiting for each step.
    ///
    /// # Errors
    /// Those of [`Self::render`].
    pub fn profile(
        &mut self,
        prepared: &mut PreparedScene,
        camera: &Camera,
        settings: &Settings,
    ) -> Result<FrameStats> {
        self.draw_strips(prepared, camera, settings, true, |_, _, _| Ok(()))
    }

    /// Does some work with a scene. After an error, the data on the device is not trusted: buffers
    /// and pipelines are dropped, and the next picture uploads the scene again.
    fn guarded<T>(
        &mut self,
        prepared: &mut PreparedScene,
        work: impl FnOnce(&mut Self, &mut PreparedScene) -> Result<T>,
    ) -> Result<T> {
        let gpu = self.gpu.clone();
        prepared.check_device(&gpu)?;
        let done = gpu.watch(|| {
            prepared.mend(&gpu)?;
            work(self, prepared)
        });
        if done.is_err() {
            self.pool = Pool::default();
            self.pipelines.clear();
            prepared.broken = true;
        }
        done?
    }

    /// Draws a picture strip by strip and passes each strip to `done`. The level of detail is
    /// chosen once, for the whole picture.
    fn draw_strips(
        &mut self,
        prepared: &mut PreparedScene,
        camera: &Camera,
        settings: &Settings,
        profile: bool,
        mut done: impl FnMut(&Self, &Targets, &View) -> Result<()>,
    ) -> Result<FrameStats> {
        self.guarded(prepared, |renderer, prepared| {
            prepared.scene.validate_settings(settings)?;
            let view = camera.view(settings.size)?;
            let start = Instant::now();
            let outline = renderer.outline(prepared, &view, settings)?;
            let mut stats =
                FrameStats { read_bricks: outline.read_bricks, ..FrameStats::default() };
            let strips = renderer.strips(&view, &outline.sheets);
            for strip in &strips {
                if strips.len() > 1 {
                    // The memory may not hold the pages of the whole picture at once.
                    prepared.update_forests(&renderer.gpu, strip, settings, outline.cut_pixels)?;
                }
                let (targets, own) =
                    renderer.draw_frame(prepared, strip, settings, &outline, profile)?;
                done(renderer, &targets, strip)?;
                stats.add(own);
            }
            renderer.note(start, settings.detail);
            Ok(stats)
        })
    }

    /// Plans the frame of a view, and brings the data that it needs to the GPU.
    fn outline(
        &mut self,
        prepared: &mut PreparedScene,
        view: &View,
        settings: &Settings,
    ) -> Result<Outline> {
        let detail = self.paced(view, settings.detail);
        let cut_pixels = match detail {
            _ if prepared.forests.is_empty() => 0.0,
            Detail::Pixels(pixels) => pixels,
            Detail::Splats(most) => self.finest_cut(prepared, view, settings, most)?,
            Detail::Milliseconds(_) => Detail::PIXELS,
        };
        let reads =
            |prepared: &PreparedScene| prepared.shelf.as_ref().map_or(0, |shelf| shelf.reads);
        let before = reads(prepared);
        let pixels = if let Detail::Pixels(pixels) = detail { pixels } else { Detail::PIXELS };
        prepared.update_levels(&self.gpu, view, pixels)?;
        prepared.update_forests(&self.gpu, view, settings, cut_pixels)?;
        let choice = self.bring_bricks(prepared, view, settings, detail)?;
        let sheets = prepared.scene.sheets_of(view, settings, choice.as_ref(), &prepared.bounds);
        let gather = self.gathers(prepared, settings, &sheets)?;
        if gather {
            prepared.update_field(&self.gpu, settings)?;
        } else {
            let all = prepared.scene.mixes_afar(settings, &sheets, choice.as_ref());
            prepared.update_selections(&self.gpu, &self.select, &self.scan, view, all)?;
        }
        Ok(Outline { cut_pixels, choice, read_bricks: reads(prepared) - before, sheets, gather })
    }

    /// Whether a scene's field is gathered. Returns an error if it should be but can't.
    fn gathers(
        &self,
        prepared: &PreparedScene,
        settings: &Settings,
        sheets: &Sheets,
    ) -> Result<bool> {
        if settings.evaluate == Evaluate::Scatter {
            return Ok(false);
        }
        match field::obstacle(&prepared.scene, settings, sheets, &self.gpu) {
            Some(what) if settings.evaluate == Evaluate::Gather => Err(Error::Argument(format!(
                "{what} can't be gathered; scatter instead, or leave it to the engine"
            ))),
            obstacle => Ok(obstacle.is_none()),
        }
    }

    /// Converts a detail in milliseconds to pixels. Returns other details unchanged.
    fn paced(&mut self, view: &View, detail: Detail) -> Detail {
        match detail {
            Detail::Milliseconds(_) => Detail::Pixels(self.pace.next(view)),
            _ => detail,
        }
    }

    /// Records the time of a picture.
    fn note(&mut self, start: Instant, detail: Detail) {
        if let Detail::Milliseconds(wanted) = detail {
            self.pace.took(start.elapsed().as_secs_f64() * 1e3, wanted);
        }
    }

    /// Chooses the bricks of a view and brings them to the GPU. If they show more samples than a
    /// picture can have, coarser bricks are chosen.
    fn bring_bricks(
        &self,
        prepared: &mut PreparedScene,
        view: &View,
        settings: &Settings,
        detail: Detail,
    ) -> Result<Option<Choice>> {
        let choose = |prepared: &PreparedScene, most| {
            prepared.scene.choice(view, settings, detail, most, &prepared.bounds)
        };
        let Some(shelf) = &prepared.shelf else { return Ok(None) };
        // The other half of the memory is for the lists of visible samples.
        let room = prepared.room_to_read(&self.gpu);
        let bytes = settings.page_memory.min(room / 2);
        let held = usize::try_from(bytes / slot_bytes(&shelf.bricks)).unwrap_or(usize::MAX);
        let Some(wanted) = choose(prepared, held) else { return Ok(None) };
        let most_runs =
            u64::from(targets::most_runs(&self.gpu)).saturating_sub(prepared.other_runs());
        let most_runs = most_runs.min((room - bytes) / list_bytes(u64::from(RUN)));
        // For a resting view, the number found last time is used.
        let mut most = prepared.shelf.as_ref().and_then(|shelf| shelf.fitting(&wanted, most_runs));
        loop {
            let choice =
                most.and_then(|most| choose(prepared, most)).unwrap_or_else(|| wanted.clone());
            // The single coarsest brick is always listed. If even its list takes too much memory,
            // that is an error.
            let runs = if choice.bricks.len() > 1 { most_runs } else { u64::MAX };
            let room = Room { bytes, runs };
            let Listed::TooMany { runs, most: fit } = prepared.update_bricks(
                &self.gpu,
                &self.select_bricks,
                &self.scan,
                view,
                &choice,
                room,
            )?
            else {
                if let (Some(most), Some(shelf)) = (most, &mut prepared.shelf) {
                    shelf.set_fitting(&wanted, most_runs, most);
                }
                return Ok(Some(choice));
            };
            // `alike` bricks show few enough samples if each shows as many as the average here;
            // `certain` bricks do so even if all their samples show.
            let alike = (choice.bricks.len() as f64 * (fit as f64 / runs as f64)) as usize;
            let certain = fit * u64::from(RUN) / u64::from(SLOT_SAMPLES);
            most = Some(alike.max(certain as usize).clamp(1, choice.bricks.len() - 1));
        }
    }

    /// Returns the view in strips of whole rows. The colours of a strip (16 bytes a pixel) fit a
    /// binding, and its tiles have enough bins for all sheets.
    fn strips(&self, view: &View, sheets: &Sheets) -> Vec<View> {
        let [width, height] = view.size;
        let colors = self.gpu.binding_size() - targets::most_slot_bytes(&self.gpu);
        let most =
            (colors / (16 * u64::from(width))).min(targets::most_rows(width, sheets.count()));
        let rows = u32::try_from(most).unwrap_or(u32::MAX).clamp(1, height);
        let strip = |first: u32| {
            let mut strip = view.clone();
            strip.size[1] = rows.min(height - first);
            strip.center.y -= f64::from(first);
            strip
        };
        (0..height).step_by(rows as usize).map(strip).collect()
    }

    fn draw_frame(
        &mut self,
        prepared: &mut PreparedScene,
        view: &View,
        settings: &Settings,
        outline: &Outline,
        profile: bool,
    ) -> Result<(Targets, FrameStats)> {
        view.validate_for(&prepared.bounds)?;
        let _span =
            tracing::debug_span!("frame", width = view.size[0], height = view.size[1]).entered();
        let gpu = &self.gpu;
        let Outline { cut_pixels, choice, sheets, gather, .. } = outline;
        let choice = choice.as_ref();
        let kind = prepared.field.as_ref().map_or(0, |field| field.kind);
        let variant = variant::variant(&Request {
            scene: &prepared.scene,
            view,
            settings,
            budget: self.budget,
            choice,
            gathered: gather.then_some(kind),
            is_software: gpu.is_software(),
        });
        let pool = &mut self.pool;
        let targets = targets::targets(
            gpu,
            pool,
            prepared,
            &variant,
            view,
            sheets,
            settings,
            self.budget,
            choice,
        )?;
        let pipelines =
            self.pipelines.entry(variant).or_insert_with(|| Pipelines::new(gpu, &variant));
        for chunk in &prepared.chunks {
            let lattice = matches!(chunk.origin, Origin::Lattice { .. } | Origin::Bricks { .. });
            let source = chunk.source(view, variant.isotropic && lattice, &prepared.forests);
            gpu.queue.write_buffer(&chunk.uniform, 0, bytemuck::bytes_of(&source));
        }
        let mut times = Vec::new();
        let work = Work {
            gpu,
            cut: &self.cut,
            scan: &self.scan,
            clear: &self.clear,
            resume: &self.resume,
            tiles: &self.tiles,
            pipelines,
            targets: &targets,
            prepared,
        };
        let mut state = State::default();
        let mut steps = work.opening();
        if variant.scatters() {
            // Encode as many passes as the last frame took. Superfluous passes do nothing.
            let passes = if profile { 1 } else { self.passes };
            state = draw_passes(
                work,
                std::mem::take(&mut steps),
                passes,
                self.budget,
                profile.then_some(&mut times),
            )?;
        }
        if let Some(gathered) = &targets.gathered {
            steps.extend(work.gathered());
            submit(gpu, std::mem::take(&mut steps), profile.then_some(&mut times))?;
            let word = 4 * targets::gathered_word(targets.tiles[0] * targets.tiles[1]);
            let drawn: u32 = bytemuck::pod_read_unaligned(&gpu.read(&targets.progress, word, 4)?);
            if drawn != gathered.workgroups() {
                return Err(did_nothing(gpu));
            }
        }
        drop(steps);
        // One more pass finds that nothing is left.
        if variant.scatters() {
            self.passes = (state.passes + 1).min(MOST_PASSES);
        }
        let stats = FrameStats {
            splats: u64::from(state.splats),
            hidden: u64::from(state.hidden),
            entries: u64::from(state.binned),
            passes: state.passes,
            gathered: targets.gathered.as_ref().map_or(0, |gathered| gathered.pairs),
            gpu_bytes: prepared.bytes + targets.bytes(),
            cut_pixels: *cut_pixels,
            missing_pages: prepared.forests.iter().map(|forest| forest.missing as u64).sum(),
            lambda: choice.map_or(0.0, |choice| choice.lambda),
            bricks: choice.map_or(0, |choice| choice.bricks.len() as u64),
            // Already counted for the whole picture.
            read_bricks: 0,
            brick_bytes: prepared.shelf.as_ref().map_or(0, |shelf| shelf.bytes()),
            steps: times,
        };
        Ok((targets, stats))
    }

    /// Returns the finest cut, in pixels, that draws at most `most` of the nodes that fit in
    /// memory.
    fn finest_cut(
        &self,
        prepared: &mut PreparedScene,
        view: &View,
        settings: &Settings,
        most: u64,
    ) -> Result<f64> {
        // The pages of a cut contain several times as many nodes as it draws.
        let nodes = most.saturating_mul(8).max(1 << 16);
        let finest = |forest: &Forest| forest.finest_within(view, settings, nodes);
        let pixels = prepared.forests.iter().map(finest).fold(0.0, f64::max);
        let gpu = &self.gpu;
        prepared.update_forests(gpu, view, settings, pixels)?;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        let counters = buffer(gpu, "tally", tally_bytes(), usage);
        let mut encoder = gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("tally") });
        for chunk in &prepared.chunks {
            if let Origin::Nodes { slots, .. } = &chunk.origin {
                let source = chunk.source(view, false, &prepared.forests);
                gpu.queue.write_buffer(&chunk.uniform, 0, bytemuck::bytes_of(&source));
                self.cut.encode_tally(
                    gpu,
                    &mut encoder,
                    &slots.chunk(&chunk.uniform, &chunk.data),
                    &counters,
                );
            }
        }
        gpu.queue.submit([encoder.finish()]);
        let tally: Vec<i32> =
            bytemuck::pod_collect_to_vec(&gpu.read(&counters, 0, tally_bytes())?);
        Ok(pixels.max(finest_within(&tally, most)))
    }

    /// Appends the rows of a strip to a picture.
    fn read(
        &self,
        targets: &Targets,
        view: &View,
        settings: &Settings,
        picture: &mut Picture,
    ) -> Result<()> {
        let pixels = view.size[0] as usize * view.size[1] as usize;
        let color: Vec<[f32; 4]> =
            bytemuck::pod_collect_to_vec(&self.gpu.read(&targets.colors, 0, 16 * pixels as u64)?);
        let hits: Vec<f32> =
            bytemuck::pod_collect_to_vec(&self.gpu.read(&targets.depths, 0, 4 * pixels as u64)?);
        let width = view.size[0] as usize;
        picture.depth.extend((0..pixels).map(|i| {
            // The maximum of a ray has no depth.
            if color[i][3] < 0.5 || settings.optics == Optics::Maximum {
                return f32::INFINITY;
            }
            let at = glam::DVec2::new((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
            hits[i] * view.ray(at).1.z as f32
        }));
        picture.color.extend(color);
        Ok(())
    }
}

fn did_nothing(gpu: &Gpu) -> Error {
    // If the device reported an error, the caller returns that error instead.
    Error::Driver(format!("{} did not do the work that was submitted", gpu.info.name))
}

/// Scatters: submits `passes` depth passes at a time, after the steps that open the frame, until
/// the frame is done.
fn draw_passes<'a>(
    work: Work<'a>,
    mut steps: Vec<Step<'a>>,
    passes: u32,
    budget: Budget,
    mut times: Option<&mut Vec<(&'static str, f64)>>,
) -> Result<State> {
    let Work { gpu, targets, .. } = work;
    let mut advanced = 0;
    let start = Instant::now();
    loop {
        steps.extend((0..passes).flat_map(|_| work.depth_pass()));
        submit(gpu, std::mem::take(&mut steps), times.as_deref_mut())?;
        let state: State = bytemuck::pod_read_unaligned(&gpu.read(
            &targets.state,
            0,
            size_of::<State>() as u64,
        )?);
        let is_done = state.done != 0 && state.stalled == 0;
        if std::mem::replace(&mut advanced, state.advanced) == state.advanced && !is_done {
            return Err(did_nothing(gpu));
        }
        if state.overflow != 0 {
            return Err(Error::EntriesExhausted { budget: budget.entries });
        }
        if is_done {
            return Ok(state);
        }
        if start.elapsed() >= gpu.patience {
            return Err(Error::Driver(format!(
                "{} did not finish the picture within {} s",
                gpu.info.name,
                gpu.patience.as_secs_f64()
            )));
        }
        if state.stalled != 0 {
            steps = work.resumed();
        }
    }
}

/// Runs steps in one submission. If `times` are wanted, the GPU's clock measures the steps. Without
/// a clock, each step is submitted and waited for on its own.
fn submit<'a>(
    gpu: &Gpu,
    steps: impl IntoIterator<Item = Step<'a>>,
    times: Option<&mut Vec<(&'static str, f64)>>,
) -> Result<()> {
    let new = || {
        gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("frame") })
    };
    let mut encoder = new();
    let Some(times) = times else {
        steps.into_iter().for_each(|(_, encode)| encode(&mut encoder));
        gpu.queue.submit([encoder.finish()]);
        return Ok(());
    };
    let mut add = |label, own| match times.iter_mut().find(|(name, _)| *name == label) {
        Some((_, sum)) => *sum += own,
        None => times.push((label, own)),
    };
    let steps: Vec<_> = steps.into_iter().collect();
    if let Some(clock) = Timestamps::new(gpu, steps.len()) {
        clock.mark(&mut encoder, 0);
        for (index, (_, encode)) in (1..).zip(&steps) {
            encode(&mut encoder);
            clock.mark(&mut encoder, index);
        }
        let own = clock.finish(gpu, encoder)?;
        steps.iter().zip(own).for_each(|((label, _), own)| add(*label, own));
        return Ok(());
    }
    for (label, encode) in steps {
        encode(&mut encoder);
        let start = Instant::now();
        gpu.queue.submit([std::mem::replace(&mut encoder, new()).finish()]);
        gpu.wait()?;
        add(label, start.elapsed().as_secs_f64() * 1e3);
    }
    Ok(())
}
