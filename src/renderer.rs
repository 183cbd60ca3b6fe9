//! One renderer over both engines: the GPU's and the processor's.

use crate::{
    Error, Result,
    cpu::CpuRenderer,
    gpu::{self, Budget, Gpu, PreparedScene},
    math::Camera,
    picture::Picture,
    plan::FrameStats,
    scene::{Scene, Settings},
    volume::TransferFunction,
};

/// What draws.
#[derive(Debug, Clone)]
pub enum Device {
    /// The engine on wgpu, with the room of its passes.
    Gpu(Gpu, Budget),
    /// The engine for processors. It needs no driver.
    Cpu,
}

impl Device {
    /// The fastest adapter that is hardware, else the processor: its own engine is faster than a driver that runs there.
    pub fn automatic() -> Self {
        Gpu::hardware().map_or(Self::Cpu, |gpu| Self::Gpu(gpu, Budget::default()))
    }

    /// The adapter's name, or “CPU”.
    pub fn name(&self) -> &str {
        match self {
            Self::Gpu(gpu, _) => &gpu.info.name,
            Self::Cpu => "CPU",
        }
    }
}

/// A scene on a device. Cameras, settings and the transfer function may change from picture to picture.
#[derive(Debug)]
pub struct Renderer {
    scene: Scene,
    device: Device,
    drawer: Drawer,
}

#[derive(Debug)]
enum Drawer {
    Gpu(Box<gpu::Renderer>, Box<PreparedScene>),
    Cpu(Box<CpuRenderer>),
}

impl Drawer {
    fn new(device: &Device, scene: &Scene) -> Result<Self> {
        Ok(match device {
            Device::Gpu(gpu, budget) => {
                let renderer = gpu::Renderer::with_budget(gpu, *budget);
                let prepared = renderer.prepare(scene)?;
                gpu.wait()?;
                Self::Gpu(Box::new(renderer), Box::new(prepared))
            }
            Device::Cpu => Self::Cpu(Box::new(CpuRenderer::new(scene)?)),
        })
    }
}

impl Renderer {
    /// Prepares a scene on a device.
    ///
    /// # Errors
    /// [`Error::Argument`] for a scene that [`Scene::validate`] refuses; [`Error::Driver`] for one that does not fit the device.
    pub fn new(device: &Device, scene: &Scene) -> Result<Self> {
        Ok(Self {
            scene: scene.clone(),
            device: device.clone(),
            drawer: Drawer::new(device, scene)?,
        })
    }

    /// What draws.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// Draws a picture. Where the device is lost, it is opened anew, once.
    ///
    /// # Errors
    /// Those of [`gpu::Renderer::render`] and [`CpuRenderer::render`].
    pub fn render(
        &mut self,
        camera: &Camera,
        settings: &Settings,
    ) -> Result<(Picture, FrameStats)> {
        match self.render_once(camera, settings) {
            Err(Error::DeviceLost(reason)) => {
                tracing::warn!("{reason}; drawing again on a device opened anew");
                self.reopen()?;
                self.render_once(camera, settings)
            }
            done => done,
        }
    }

    fn render_once(
        &mut self,
        camera: &Camera,
        settings: &Settings,
    ) -> Result<(Picture, FrameStats)> {
        match &mut self.drawer {
            Drawer::Gpu(renderer, prepared) => renderer.render(prepared, camera, settings),
            Drawer::Cpu(renderer) => renderer.render(camera, settings),
        }
    }

    /// Draws a picture and leaves it where it was drawn: a frame's time without the way back from a GPU.
    ///
    /// # Errors
    /// As of [`render`](Self::render), and [`Error::DeviceLost`].
    pub fn draw(&mut self, camera: &Camera, settings: &Settings) -> Result<FrameStats> {
        match &mut self.drawer {
            Drawer::Gpu(renderer, prepared) => renderer.draw(prepared, camera, settings),
            Drawer::Cpu(renderer) => Ok(renderer.render(camera, settings)?.1),
        }
    }

    /// As [`draw`](Self::draw), but the statistics hold the time of each step.
    ///
    /// # Errors
    /// As of [`draw`](Self::draw).
    pub fn profile(&mut self, camera: &Camera, settings: &Settings) -> Result<FrameStats> {
        match &mut self.drawer {
            Drawer::Gpu(renderer, prepared) => renderer.profile(prepared, camera, settings),
            Drawer::Cpu(renderer) => Ok(renderer.render(camera, settings)?.1),
        }
    }

    /// Shows the scene's volume or sample set by another transfer function.
    ///
    /// # Errors
    /// [`Error::Argument`] for one that [`new`](Self::new) would refuse; the scene is then shown as before.
    pub fn set_transfer(&mut self, transfer: &TransferFunction) -> Result<()> {
        self.scene = self.scene.shown_by(transfer)?;
        match &mut self.drawer {
            Drawer::Gpu(_, prepared) => prepared.set_transfer(transfer),
            Drawer::Cpu(renderer) => renderer.set_transfer(transfer),
        }
    }

    /// Opens a lost device anew and prepares the scene on it.
    ///
    /// # Errors
    /// As of [`Gpu::reopened`] and [`new`](Self::new).
    pub fn reopen(&mut self) -> Result<()> {
        if let Device::Gpu(gpu, budget) = &self.device {
            self.device = Device::Gpu(gpu.reopened()?, *budget);
        }
        self.drawer = Drawer::new(&self.device, &self.scene)?;
        Ok(())
    }
}
