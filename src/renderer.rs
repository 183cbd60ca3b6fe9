//! One renderer for both engines, the GPU engine and the CPU engine.

#[cfg(all(feature = "gpu", not(target_arch = "wasm32")))]
use crate::gpu::{self, Budget, Gpu, PreparedScene};
use crate::{
    Error, Result,
    cpu::CpuRenderer,
    math::Camera,
    picture::Picture,
    plan::FrameStats,
    scene::{Scene, Settings},
    volume::TransferFunction,
};

/// The device that draws.
#[derive(Debug, Clone)]
pub enum Device {
    /// The GPU engine on wgpu, with the capacity of its passes. Needs the feature `gpu`. In a
    /// browser, where nothing may block, see
    /// [`gpu::Renderer::render_async`](crate::gpu::Renderer::render_async).
    #[cfg(all(feature = "gpu", not(target_arch = "wasm32")))]
    Gpu(Gpu, Budget),
    /// The CPU engine. It needs no driver.
    Cpu,
}

impl Device {
    /// Returns the fastest hardware adapter, or the CPU if there is none. The CPU engine is faster
    /// than a GPU driver that runs on the processor. `WGPU_ADAPTER_NAME` can name another adapter
    /// ([`Gpu::hardware`](crate::gpu::Gpu::hardware)). Without the feature `gpu`, this is the CPU.
    pub fn automatic() -> Self {
        #[cfg(all(feature = "gpu", not(target_arch = "wasm32")))]
        if let Some(gpu) = Gpu::hardware() {
            return Self::Gpu(gpu, Budget::default());
        }
        Self::Cpu
    }

    /// Returns the adapter's name, or “CPU”.
    pub fn name(&self) -> &str {
        match self {
            #[cfg(all(feature = "gpu", not(target_arch = "wasm32")))]
            Self::Gpu(gpu, _) => &gpu.info.name,
            Self::Cpu => "CPU",
        }
    }
}

/// Draws one scene on one device. The camera, the settings and the transfer function may change
/// from picture to picture.
///
/// The CPU engine draws everywhere; [`Device::automatic`] takes a GPU if there is one:
///
/// ```
/// use glam::DVec3;
/// use splatkit::{
///     Device, Renderer,
///     math::Camera,
///     scene::{Scene, Settings},
///     surface::{Mesh, SurfelOptions},
/// };
///
/// let ball = Mesh::sphere(3).surfels(&SurfelOptions::default())?;
/// let scene = Scene::new().with_splats(ball);
/// let mut renderer = Renderer::new(&Device::Cpu, &scene)?;
/// let camera = Camera::framing(&scene.bounds(), DVec3::NEG_Z, DVec3::Y, 1.0);
/// let (picture, stats) = renderer.render(&camera, &Settings::new([32, 32]))?;
/// // Red, green, blue and opacity of the pixel in the middle.
/// assert!(picture.color[16 * 32 + 16][3] > 0.99 && stats.splats > 0);
/// # Ok::<(), splatkit::Error>(())
/// ```
#[derive(Debug)]
pub struct Renderer {
    scene: Scene,
    device: Device,
    drawer: Drawer,
}

#[derive(Debug)]
enum Drawer {
    #[cfg(all(feature = "gpu", not(target_arch = "wasm32")))]
    Gpu(Box<gpu::Renderer>, Box<PreparedScene>),
    Cpu(Box<CpuRenderer>),
}

impl Drawer {
    fn new(device: &Device, scene: &Scene) -> Result<Self> {
        Ok(match device {
            #[cfg(all(feature = "gpu", not(target_arch = "wasm32")))]
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
    /// [`Error::Argument`] if [`Scene::validate`] or the engine refuses the scene;
    /// [`Error::Driver`] if it does not fit the device.
    pub fn new(device: &Device, scene: &Scene) -> Result<Self> {
        Ok(Self {
            scene: scene.clone(),
            device: device.clone(),
            drawer: Drawer::new(device, scene)?,
        })
    }

    /// Returns the device that draws.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// Draws a picture. If the device is lost, it is reopened once and the picture is drawn again.
    ///
    /// # Errors
    /// Those of [`gpu::Renderer::render`](crate::gpu::Renderer::render) and
    /// [`CpuRenderer::render`].
    pub fn render(
        &mut self,
        camera: &Camera,
        settings: &Settings,
    ) -> Result<(Picture, FrameStats)> {
        match self.render_once(camera, settings) {
            Err(Error::DeviceLost(reason)) => {
                tracing::warn!("{reason}; reopening the device and drawing the picture again");
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
            #[cfg(all(feature = "gpu", not(target_arch = "wasm32")))]
            Drawer::Gpu(renderer, prepared) => renderer.render(prepared, camera, settings),
            Drawer::Cpu(renderer) => renderer.render(camera, settings),
        }
    }

    /// Draws a picture and leaves it on the device. A frame's time then excludes reading it back
    /// from a GPU.
    ///
    /// # Errors
    /// Those of [`render`](Self::render). A lost device is not reopened: [`Error::DeviceLost`].
    pub fn draw(&mut self, camera: &Camera, settings: &Settings) -> Result<FrameStats> {
        match &mut self.drawer {
            #[cfg(all(feature = "gpu", not(target_arch = "wasm32")))]
            Drawer::Gpu(renderer, prepared) => renderer.draw(prepared, camera, settings),
            Drawer::Cpu(renderer) => Ok(renderer.render(camera, settings)?.1),
        }
    }

    /// Like [`draw`](Self::draw), but the statistics contain the time of each step.
    ///
    /// # Errors
    /// Those of [`draw`](Self::draw).
    pub fn profile(&mut self, camera: &Camera, settings: &Settings) -> Result<FrameStats> {
        match &mut self.drawer {
            #[cfg(all(feature = "gpu", not(target_arch = "wasm32")))]
            Drawer::Gpu(renderer, prepared) => renderer.profile(prepared, camera, settings),
            Drawer::Cpu(renderer) => Ok(renderer.render(camera, settings)?.1),
        }
    }

    /// Sets the transfer function of the field of an item, by its number in the scene
    /// ([`Scene::fields`]).
    ///
    /// # Errors
    /// [`Error::Argument`] if the item has no field; [`Error::Transfer`] if [`new`](Self::new)
    /// would refuse the function. The scene then keeps its old one.
    pub fn set_transfer(&mut self, item: usize, transfer: &TransferFunction) -> Result<()> {
        self.scene = self.scene.with_transfer(item, transfer)?;
        match &mut self.drawer {
            #[cfg(all(feature = "gpu", not(target_arch = "wasm32")))]
            Drawer::Gpu(_, prepared) => prepared.set_transfer(item, transfer),
            Drawer::Cpu(renderer) => renderer.set_transfer(item, transfer),
        }
    }

    /// Reopens a lost device and prepares the scene on it.
    ///
    /// # Errors
    /// Those of [`Gpu::reopened`](crate::gpu::Gpu::reopened) and [`new`](Self::new).
    pub fn reopen(&mut self) -> Result<()> {
        #[cfg(all(feature = "gpu", not(target_arch = "wasm32")))]
        if let Device::Gpu(gpu, budget) = &self.device {
            self.device = Device::Gpu(gpu.reopened()?, *budget);
        }
        self.drawer = Drawer::new(&self.device, &self.scene)?;
        Ok(())
    }
}
