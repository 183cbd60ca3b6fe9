//! Frames for a host application: encoded among its own work, on both engines.

use super::{Drawer, Renderer};
use crate::{
    Error, FrameStats, Result,
    gpu::{self, Output, Progress, Upload},
    math::{View, Viewpoint},
    picture::Picture,
    scene::Settings,
};
use std::{
    sync::atomic::{AtomicU64, Ordering},
    task::Poll,
};

/// A frame that is being drawn into a host's textures or buffers, from [`Renderer::encode`] on.
#[derive(Debug)]
pub struct Frame(Engine);

#[derive(Debug)]
enum Engine {
    Gpu(Box<gpu::PendingFrame>),
    Cpu(Box<CpuFrame>),
}

/// A frame of the CPU engine.
#[derive(Debug)]
struct CpuFrame {
    /// Its number among all frames.
    number: u64,
    view: View,
    output: Output,
    stage: Stage,
}

#[derive(Debug)]
enum Stage {
    /// A thread draws.
    Drawing,
    /// The picture is to be uploaded.
    Drawn(Picture, FrameStats),
    Done(FrameStats),
}

/// The numbers of frames of the CPU engine, all different.
static FRAMES: AtomicU64 = AtomicU64::new(1);

impl Renderer {
    /// Encodes the first batch of a frame, and where it goes. The caller submits the encoder to the
    /// device's queue before the next call for this renderer, and then asks [`poll`](Self::poll).
    /// Nothing waits, and no picture is read back. A frame that another one follows is abandoned.
    ///
    /// Most frames of the GPU engine need one batch, others a few. The CPU engine
    /// ([`Device::CpuFor`](super::Device::CpuFor)) draws in a thread meanwhile; its second batch
    /// uploads the picture. Until the last batch is done, the output keeps what it contains.
    ///
    /// Work that prepares the frame, such as uploads, is submitted at once. Pages of hierarchies
    /// and bricks of volumes are read from their files.
    ///
    /// ```no_run
    /// use splatkit::{Renderer, gpu::Progress, math::Camera, scene::Settings, wgpu};
    ///
    /// # fn frame(
    /// #     gpu: &splatkit::gpu::Gpu, renderer: &mut Renderer, camera: &Camera,
    /// #     texture: &wgpu::TextureView,
    /// # ) -> splatkit::Result<()> {
    /// let mut encoder = gpu.device.create_command_encoder(&Default::default());
    /// let mut frame = renderer.encode(&mut encoder, camera, &Settings::new([800, 600]), texture)?;
    /// // … the host's own passes …
    /// gpu.queue.submit([encoder.finish()]);
    /// // Now or in the next turns of the event loop:
    /// match renderer.poll(&mut frame)? {
    ///     Progress::Done(stats) => println!("{} splats", stats.splats),
    ///     Progress::NextBatch => {
    ///         let mut encoder = gpu.device.create_command_encoder(&Default::default());
    ///         renderer.encode_next(&mut encoder, &mut frame)?;
    ///         gpu.queue.submit([encoder.finish()]);
    ///     }
    ///     _ => {}
    /// }
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// Those of [`render`](Self::render). [`Error::Argument`] if the picture does not fit the
    /// output, or if the renderer has no device of a host ([`Device::Cpu`](super::Device::Cpu)).
    pub fn encode(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        viewpoint: &impl Viewpoint,
        settings: &Settings,
        output: impl Into<Output>,
    ) -> Result<Frame> {
        let (view, output) = (viewpoint.view(settings.size)?, output.into());
        if self.scene.items.is_empty() {
            return self.encode_clear(encoder, view, settings, output);
        }
        self.cast_shadows(&view, settings)?;
        match &mut self.drawer {
            Drawer::Gpu(engine, prepared) => {
                let frame = engine.encode(encoder, prepared, &view, settings, output)?;
                Ok(Frame(Engine::Gpu(Box::new(frame))))
            }
            Drawer::Cpu(worker) => {
                if self.upload.is_none() {
                    return Err(no_device());
                }
                output.check(&view)?;
                worker.begin(view.clone(), settings);
                Ok(self.begin(view, output, Stage::Drawing))
            }
        }
    }

    /// Encodes the frame of a scene without items.
    fn encode_clear(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        view: View,
        settings: &Settings,
        output: Output,
    ) -> Result<Frame> {
        let picture = super::clear(&view, settings)?;
        output.check(&view)?;
        let Some(upload) = &mut self.upload else { return Err(no_device()) };
        upload.encode(encoder, &picture, &view, &output)?;
        Ok(self.begin(view, output, Stage::Done(FrameStats::default())))
    }

    fn begin(&mut self, view: View, output: Output, stage: Stage) -> Frame {
        self.frame = FRAMES.fetch_add(1, Ordering::Relaxed);
        Frame(Engine::Cpu(Box::new(CpuFrame { number: self.frame, view, output, stage })))
    }

    /// Encodes the next batch of a frame, after [`poll`](Self::poll) has asked for it.
    ///
    /// # Errors
    /// Those of [`encode`](Self::encode). [`Error::Argument`] if the last batch is not done, or if
    /// another frame was begun with this renderer.
    pub fn encode_next(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        frame: &mut Frame,
    ) -> Result<()> {
        match (&mut self.drawer, &mut frame.0) {
            (Drawer::Gpu(engine, prepared), Engine::Gpu(frame)) => {
                engine.encode_next(encoder, prepared, frame)
            }
            (_, Engine::Cpu(frame)) if frame.number == self.frame => {
                let Some(upload) = &mut self.upload else { return Err(abandoned()) };
                let Stage::Drawn(picture, stats) = &frame.stage else {
                    return Err(Error::Argument(
                        "the last batch of the picture is not done; encode the next when `poll` \
                         asks for it"
                            .into(),
                    ));
                };
                upload.encode(encoder, picture, &frame.view, &frame.output)?;
                frame.stage = Stage::Done(stats.clone());
                Ok(())
            }
            _ => Err(abandoned()),
        }
    }

    /// Looks, without waiting, how far a frame is.
    ///
    /// # Errors
    /// Those of [`render`](Self::render). [`Error::Argument`] if another frame was begun with this
    /// renderer.
    pub fn poll(&mut self, frame: &mut Frame) -> Result<Progress> {
        match (&mut self.drawer, &mut frame.0) {
            (Drawer::Gpu(engine, prepared), Engine::Gpu(frame)) => engine.poll(prepared, frame),
            (drawer, Engine::Cpu(frame)) if frame.number == self.frame => {
                if let (Drawer::Cpu(worker), Stage::Drawing) = (drawer, &frame.stage) {
                    let Poll::Ready(drawn) = worker.poll(None) else {
                        return Ok(Progress::Working);
                    };
                    let (picture, stats) = drawn?;
                    frame.stage = Stage::Drawn(picture, stats);
                }
                Ok(match &frame.stage {
                    Stage::Drawing => Progress::Working,
                    Stage::Drawn(..) => Progress::NextBatch,
                    Stage::Done(stats) => Progress::Done(stats.clone()),
                })
            }
            _ => Err(abandoned()),
        }
    }
}

fn no_device() -> Error {
    let message = "Device::Cpu has no device to write textures of; use Device::CpuFor";
    Error::Argument(message.into())
}

fn abandoned() -> Error {
    Error::Argument("another frame was begun with this renderer; drop the older one".into())
}

/// Returns what uploads pictures of the CPU engine to a host's device.
pub fn upload(device: &super::Device) -> Option<Upload> {
    match device {
        super::Device::Gpu(gpu, _) | super::Device::CpuFor(gpu) => Some(Upload::new(gpu)),
        super::Device::Cpu => None,
    }
}
