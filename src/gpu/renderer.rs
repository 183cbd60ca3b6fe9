//! The renderer of the GPU engine: draws pictures of prepared scenes, batch by batch. It keeps
//! pipelines and buffers from picture to picture.

use crate::{
    Error, Result,
    gpu::{
        budget::Budget,
        device::Gpu,
        frame::{Step, encode_all},
        output::Output,
        pending::{Engine, PendingFrame, Sink},
        pipeline::commands::Commands,
        scene::PreparedScene,
    },
    hierarchy::Detail,
    math::{View, Viewpoint},
    picture::Picture,
    plan::{FrameStats, pace::Pace},
    scene::{Scene, Settings},
};
use std::sync::atomic::{AtomicU64, Ordering};

/// Draws prepared scenes. One renderer serves any number of scenes, cameras and sizes, one picture
/// at a time.
///
/// [`render`](Self::render) and [`draw`](Self::draw) wait for the GPU. A host application that owns
/// the frame calls [`encode`](Self::encode) instead, submits, and asks [`poll`](Self::poll) from
/// time to time. In a browser, [`render_async`](Self::render_async) awaits.
#[derive(Debug)]
pub struct Renderer {
    engine: Engine,
    pace: Pace,
}

/// How far a picture is.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub enum Progress {
    /// The GPU works on the last batch, or its encoder is not submitted yet.
    Working,
    /// The last batch is done, and another is needed: [`Renderer::encode_next`].
    NextBatch,
    /// The picture is finished.
    Done(FrameStats),
}

/// The numbers of pictures, all different.
static PICTURES: AtomicU64 = AtomicU64::new(1);

impl Renderer {
    /// Creates a renderer on this GPU with the default [`Budget`].
    pub fn new(gpu: &Gpu) -> Self {
        Self::with_budget(gpu, Budget::default())
    }

    /// Returns a renderer whose depth passes have the given capacity.
    pub fn with_budget(gpu: &Gpu, budget: Budget) -> Self {
        let engine = gpu.watch_later(|| Engine::new(gpu, budget));
        Self { engine, pace: Pace::default() }
    }

    /// Returns a renderer with the same budget on another device.
    pub fn on(&self, gpu: &Gpu) -> Self {
        Self::with_budget(gpu, self.engine.budget)
    }

    /// Uploads a scene.
    ///
    /// # Errors
    /// [`Error::Argument`] if [`Scene::validate`] refuses the scene, or if [`Scene::beyond_gpu`]
    /// names something in it. [`Error::Driver`] or [`Error::Argument`] if the scene does not fit
    /// the device.
    pub fn prepare(&self, scene: &Scene) -> Result<PreparedScene> {
        let gpu = &self.engine.gpu;
        gpu.watch(|| PreparedScene::new(gpu, scene))?
    }

    /// Encodes the first batch of a picture, and where it goes. The caller submits the encoder to
    /// the device's queue before the next call for this renderer or scene, and then asks
    /// [`poll`](Self::poll). Nothing waits and nothing is read back, apart from a few words that
    /// say how far the picture is. Most pictures need one batch, others a few; a picture that
    /// another follows is abandoned.
    ///
    /// Work that prepares the picture, such as uploads, is submitted at once. Pages of hierarchies
    /// and bricks of volumes are read from their files.
    ///
    /// ```no_run
    /// use splatkit::{gpu::{Progress, Renderer}, math::Camera, scene::Settings, wgpu};
    ///
    /// # fn frame(
    /// #     gpu: &splatkit::gpu::Gpu, renderer: &mut Renderer,
    /// #     prepared: &mut splatkit::gpu::PreparedScene, camera: &Camera,
    /// #     texture: &wgpu::TextureView,
    /// # ) -> splatkit::Result<()> {
    /// let mut encoder = gpu.device.create_command_encoder(&Default::default());
    /// let settings = Settings::new([800, 600]);
    /// let mut frame = renderer.encode(&mut encoder, prepared, camera, &settings, texture)?;
    /// // … the host's own passes …
    /// gpu.queue.submit([encoder.finish()]);
    /// // Now or in the next turns of the event loop:
    /// match renderer.poll(prepared, &mut frame)? {
    ///     Progress::Done(stats) => println!("{} splats", stats.splats),
    ///     Progress::NextBatch => {
    ///         let mut encoder = gpu.device.create_command_encoder(&Default::default());
    ///         renderer.encode_next(&mut encoder, prepared, &mut frame)?;
    ///         gpu.queue.submit([encoder.finish()]);
    ///     }
    ///     _ => {}
    /// }
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// Those of [`Self::render`]; [`Error::Argument`] if the picture does not fit the output.
    pub fn encode(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        prepared: &mut PreparedScene,
        viewpoint: &impl Viewpoint,
        settings: &Settings,
        output: impl Into<Output>,
    ) -> Result<PendingFrame> {
        let (output, view) = (output.into(), viewpoint.view(settings.size)?);
        output.check(&view)?;
        let mut frame = self.begin(prepared, &view, settings, Sink::Output(output))?;
        self.encode_next(encoder, prepared, &mut frame)?;
        Ok(frame)
    }

    /// Encodes the next batch of a picture, after [`poll`](Self::poll) has asked for it.
    ///
    /// # Errors
    /// Those of [`Self::render`]. [`Error::Argument`] if the last batch is not done, or if another
    /// picture was begun with this renderer or scene.
    pub fn encode_next(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        prepared: &mut PreparedScene,
        frame: &mut PendingFrame,
    ) -> Result<()> {
        self.check(prepared, frame)?;
        self.guarded(prepared, |renderer, prepared| {
            frame.encode(&mut renderer.engine, prepared, encoder, &mut |steps, encoder| {
                encode_all(&steps, encoder);
                Ok(())
            })
        })
    }

    /// Looks, without waiting, how far a picture is.
    ///
    /// # Errors
    /// Those of [`Self::render`]. [`Error::Argument`] if another picture was begun with this
    /// renderer or scene.
    pub fn poll(
        &mut self,
        prepared: &mut PreparedScene,
        frame: &mut PendingFrame,
    ) -> Result<Progress> {
        self.check(prepared, frame)?;
        self.guarded(prepared, |renderer, prepared| {
            renderer.engine.gpu.poll()?;
            renderer.take(prepared, frame)
        })
    }

    /// Draws a picture and reads it back, without blocking. In a browser, the device calls back by
    /// itself. Elsewhere, someone must poll it meanwhile ([`wgpu::Device::poll`]).
    ///
    /// # Errors
    /// Those of [`Self::render`]; [`Error::Stopped`] if the settings ask for the end before a
    /// batch.
    pub async fn render_async(
        &mut self,
        prepared: &mut PreparedScene,
        viewpoint: &impl Viewpoint,
        settings: &Settings,
    ) -> Result<(Picture, FrameStats)> {
        let mut frame = self.begin(prepared, viewpoint, settings, empty_picture(settings))?;
        loop {
            // What is on the device stays sound: another picture may follow.
            if settings.controls.stop.is_requested() {
                return Err(Error::Stopped);
            }
            let mut encoder = self.encoder();
            self.encode_next(&mut encoder, prepared, &mut frame)?;
            self.engine.gpu.queue.submit([encoder.finish()]);
            if let Some(answer) = frame.answer() {
                answer.arrived().await;
            }
            if let Progress::Done(_) = self.poll(prepared, &mut frame)? {
                return Ok(finished(frame));
            }
        }
    }

    /// Begins a picture. Returns the first error that its camera or settings have.
    fn begin(
        &mut self,
        prepared: &mut PreparedScene,
        viewpoint: &impl Viewpoint,
        settings: &Settings,
        sink: Sink,
    ) -> Result<PendingFrame> {
        self.guarded(prepared, |renderer, prepared| {
            prepared.scene.check_items()?;
            prepared.scene.validate_drawn(settings)?;
            if settings.region.is_some() {
                let what = "the GPU engine does not draw regions yet; the CPU engine does";
                return Err(Error::Argument(what.into()));
            }
            let view: View = viewpoint.view(settings.size)?;
            let detail = match settings.detail {
                Detail::Milliseconds(_) => Detail::Pixels(renderer.pace.next(&view)),
                detail => detail,
            };
            let number = PICTURES.fetch_add(1, Ordering::Relaxed);
            (renderer.engine.picture, prepared.picture) = (number, number);
            let start = web_time::Instant::now();
            let mut frame =
                PendingFrame::new(&renderer.engine, prepared, view, settings, detail, sink)?;
            frame.spend(start);
            Ok(frame)
        })
    }

    /// Returns an error if this is not the picture that was begun last.
    fn check(&self, prepared: &PreparedScene, frame: &PendingFrame) -> Result<()> {
        if [self.engine.picture, prepared.picture] == [frame.number; 2] {
            return Ok(());
        }
        Err(Error::Argument(
            "another picture was begun with this renderer or scene; drop the older one, or use a \
             renderer and a prepared scene for each"
                .into(),
        ))
    }

    /// Takes the GPU's answer, if it is there.
    fn take(&mut self, prepared: &mut PreparedScene, frame: &mut PendingFrame) -> Result<Progress> {
        let was_done = frame.stats().is_some();
        if !frame.take(&mut self.engine, prepared)? {
            return Ok(Progress::Working);
        }
        let Some(stats) = frame.stats() else { return Ok(Progress::NextBatch) };
        if let Detail::Milliseconds(wanted) = frame.wanted()
            && !was_done
        {
            self.pace.took(frame.milliseconds(), wanted);
        }
        Ok(Progress::Done(stats.clone()))
    }

    /// Does some work with a scene. After an error, the data on the device is not trusted: buffers
    /// and pipelines are dropped, and the next picture uploads the scene again.
    fn guarded<T>(
        &mut self,
        prepared: &mut PreparedScene,
        work: impl FnOnce(&mut Self, &mut PreparedScene) -> Result<T>,
    ) -> Result<T> {
        let gpu = self.engine.gpu.clone();
        prepared.check_device(&gpu)?;
        let done = gpu.watch(|| {
            prepared.mend(&gpu)?;
            work(self, prepared)
        });
        if done.is_err() {
            self.engine.forget();
            prepared.broken = true;
        }
        done?
    }

    fn encoder(&self) -> wgpu::CommandEncoder {
        let descriptor = wgpu::CommandEncoderDescriptor { label: Some("frame") };
        self.engine.gpu.device.create_command_encoder(&descriptor)
    }
}

/// What waits for the GPU.
#[cfg(not(target_arch = "wasm32"))]
impl Renderer {
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
        viewpoint: &impl Viewpoint,
        settings: &Settings,
    ) -> Result<(Picture, FrameStats)> {
        let mut frame = self.begin(prepared, viewpoint, settings, empty_picture(settings))?;
        self.complete(prepared, &mut frame, None)?;
        Ok(finished(frame))
    }

    /// Draws a picture and leaves it on the GPU. A frame's time then excludes reading it back.
    ///
    /// # Errors
    /// Those of [`Self::render`].
    pub fn draw(
        &mut self,
        prepared: &mut PreparedScene,
        viewpoint: &impl Viewpoint,
        settings: &Settings,
    ) -> Result<FrameStats> {
        let mut frame = self.begin(prepared, viewpoint, settings, Sink::Nowhere)?;
        self.complete(prepared, &mut frame, None)?;
        Ok(frame.finish().1)
    }

    /// Like [`Self::draw`], but the statistics contain the time of each step: by the GPU's clock,
    /// or, without a clock, by waiting for each step.
    ///
    /// # Errors
    /// Those of [`Self::render`].
    pub fn profile(
        &mut self,
        prepared: &mut PreparedScene,
        viewpoint: &impl Viewpoint,
        settings: &Settings,
    ) -> Result<FrameStats> {
        let mut frame = self.begin(prepared, viewpoint, settings, Sink::Nowhere)?.singly();
        let mut times = Times::new();
        self.complete(prepared, &mut frame, Some(&mut times))?;
        Ok(FrameStats { steps: times, ..frame.finish().1 })
    }

    /// Draws a picture, batch by batch, and waits for each.
    fn complete(
        &mut self,
        prepared: &mut PreparedScene,
        frame: &mut PendingFrame,
        mut times: Option<&mut Times>,
    ) -> Result<()> {
        let gpu = self.engine.gpu.clone();
        loop {
            let progress = self.guarded(prepared, |renderer, prepared| {
                let start = web_time::Instant::now();
                let mut encoder = renderer.encoder();
                frame.encode(
                    &mut renderer.engine,
                    prepared,
                    &mut encoder,
                    &mut |steps, encoder| match times.as_deref_mut() {
                        Some(times) => measure(&gpu, steps, times),
                        None => {
                            encode_all(&steps, encoder);
                            Ok(())
                        }
                    },
                )?;
                gpu.queue.submit([encoder.finish()]);
                frame.spend(start);
                if let Some(answer) = frame.answer() {
                    gpu.receive(answer)?;
                }
                renderer.take(prepared, frame)
            })?;
            if let Progress::Done(_) = progress {
                return Ok(());
            }
        }
    }
}

/// The times of the steps of a frame, in milliseconds.
type Times = Vec<(&'static str, f64)>;

fn empty_picture(settings: &Settings) -> Sink {
    let [width, height] = settings.size;
    Sink::Picture(Picture { width, height, color: Vec::new(), depth: Vec::new() })
}

/// Returns the picture that was read back.
fn finished(frame: PendingFrame) -> (Picture, FrameStats) {
    let (picture, stats) = frame.finish();
    let none = Picture { width: 0, height: 0, color: Vec::new(), depth: Vec::new() };
    (picture.unwrap_or(none), stats)
}

/// Runs steps and adds their times: by the GPU's clock, or, without one, by submitting and waiting
/// for each step on its own.
#[cfg(not(target_arch = "wasm32"))]
fn measure(gpu: &Gpu, steps: Vec<Step<'_>>, times: &mut Times) -> Result<()> {
    use crate::gpu::device::timestamps::Timestamps;
    let new = || {
        gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("frame") })
    };
    let mut encoder = new();
    let mut add = |label, time| match times.iter_mut().find(|(name, _)| *name == label) {
        Some((_, sum)) => *sum += time,
        None => times.push((label, time)),
    };
    if let Some(clock) = Timestamps::new(gpu, steps.len()) {
        clock.mark(&mut encoder, 0);
        for (index, (_, encode)) in (1..).zip(&steps) {
            encode(&mut Commands::new(&mut encoder));
            clock.mark(&mut encoder, index);
        }
        let durations = clock.finish(gpu, encoder)?;
        steps.iter().zip(durations).for_each(|((label, _), time)| add(*label, time));
        return Ok(());
    }
    for (label, encode) in steps {
        encode(&mut Commands::new(&mut encoder));
        let start = web_time::Instant::now();
        gpu.queue.submit([std::mem::replace(&mut encoder, new()).finish()]);
        gpu.wait()?;
        add(label, start.elapsed().as_secs_f64() * 1e3);
    }
    Ok(())
}
