//! One renderer for both engines, the GPU engine and the CPU engine.

mod device;
#[cfg(feature = "gpu")]
mod host;
mod items;
mod loaded;
mod maxima;
mod worker;

#[cfg(feature = "gpu")]
use crate::gpu::{self, PreparedScene, Upload};
use crate::{
    Error, Result,
    cpu::CpuRenderer,
    math::Viewpoint,
    picture::Picture,
    plan::FrameStats,
    scene::{Scene, Settings},
};
pub use device::Device;
#[cfg(feature = "gpu")]
pub use host::Frame;
pub use items::ItemId;
use items::Slot;
use std::future::poll_fn;
use worker::Worker;

/// Draws one scene on one device. The viewpoint and the settings may change from picture to
/// picture. Items are added, hidden, moved and removed by their names ([`ItemId`]), while the
/// others stay prepared.
///
/// | method | waits | the picture is |
/// |---|---|---|
/// | [`render`](Self::render) | yes | returned |
/// | [`render_async`](Self::render_async) | no, it is awaited | returned |
/// | [`encode`](Self::encode), [`poll`](Self::poll) | no | written to textures or buffers |
/// | [`draw`](Self::draw), [`profile`](Self::profile) | yes | left on the device |
///
/// The CPU engine draws everywhere; [`Device::automatic`] takes a GPU if there is one:
///
/// ```
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
/// let camera = Camera::fit(&scene, [32, 32])?;
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
    slots: Vec<Slot>,
    /// The number in the name of the next item.
    next_item: usize,
    /// The number of the CPU engine's last frame for a host; 0 if it is abandoned.
    frame: u64,
    /// The CPU engine, where it draws the maps of a GPU's shadows ([`Lighting`]).
    ///
    /// [`Lighting`]: crate::scene::Lighting
    #[cfg(feature = "gpu")]
    maps: Option<Box<CpuRenderer>>,
    /// What uploads the CPU engine's frames.
    #[cfg(feature = "gpu")]
    upload: Option<Upload>,
}

#[derive(Debug)]
enum Drawer {
    #[cfg(feature = "gpu")]
    Gpu(Box<gpu::Renderer>, Box<PreparedScene>),
    Cpu(Worker),
}

impl Drawer {
    fn new(device: &Device, scene: &Scene) -> Result<Self> {
        #[cfg(feature = "gpu")]
        if let Device::Gpu(gpu, budget) = device {
            let renderer = gpu::Renderer::with_budget(gpu, *budget);
            let prepared = renderer.prepare(scene)?;
            #[cfg(not(target_arch = "wasm32"))]
            gpu.wait()?;
            return Ok(Self::Gpu(Box::new(renderer), Box::new(prepared)));
        }
        let _ = device;
        Ok(Self::Cpu(Worker::new(CpuRenderer::new(scene)?)))
    }
}

/// Returns the picture of a scene without items.
fn clear(viewpoint: &impl Viewpoint, settings: &Settings) -> Result<Picture> {
    Scene::new().validate_settings(settings)?;
    let [width, height] = viewpoint.view(settings.size)?.size;
    let pixels = width as usize * height as usize;
    let (color, depth) = (vec![[0.0; 4]; pixels], vec![f32::INFINITY; pixels]);
    Ok(Picture { width, height, color, depth })
}

/// Returned where a browser's GPU would have to be waited for.
#[cfg(all(feature = "gpu", target_arch = "wasm32"))]
fn cannot_wait<T>() -> Result<T> {
    Err(Error::Argument("a browser cannot wait for the GPU; use render_async or encode".into()))
}

impl Renderer {
    /// Prepares a scene on a device. A scene without items is one to which they are added later;
    /// its pictures are clear.
    ///
    /// # Errors
    /// [`Error::Argument`] if [`Scene::validate`] or the engine refuses the scene;
    /// [`Error::Driver`] if it does not fit the device.
    pub fn new(device: &Device, scene: &Scene) -> Result<Self> {
        Ok(Self {
            scene: scene.clone(),
            device: device.clone(),
            drawer: Drawer::new(device, scene)?,
            slots: items::slots(scene),
            next_item: scene.items.len(),
            frame: 0,
            #[cfg(feature = "gpu")]
            maps: None,
            #[cfg(feature = "gpu")]
            upload: host::upload(device),
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
    /// [`CpuRenderer::render`]. [`Error::Argument`] on a GPU in a browser, which cannot be waited
    /// for.
    pub fn render(
        &mut self,
        viewpoint: &impl Viewpoint,
        settings: &Settings,
    ) -> Result<(Picture, FrameStats)> {
        match self.render_once(viewpoint, settings) {
            Err(Error::DeviceLost(reason)) => {
                tracing::warn!("{reason}; reopening the device and drawing the picture again");
                self.reopen()?;
                self.render_once(viewpoint, settings)
            }
            done => done,
        }
    }

    /// Forgets what depends on the scene.
    fn changed(&mut self) {
        self.frame = 0;
        #[cfg(feature = "gpu")]
        {
            self.maps = None;
        }
    }

    /// Draws what keeps light away in a picture of a GPU.
    fn cast_shadows(&mut self, viewpoint: &impl Viewpoint, settings: &Settings) -> Result<()> {
        let _ = viewpoint;
        if settings.lighting.is_plain() || self.scene.items.is_empty() {
            return Ok(());
        }
        #[cfg(feature = "gpu")]
        if let Drawer::Gpu(_, prepared) = &mut self.drawer {
            let view = viewpoint.view(settings.size)?;
            self.scene.validate_settings(settings)?;
            let maps = match &mut self.maps {
                Some(maps) => maps,
                none => none.insert(CpuRenderer::new(&self.scene)?.into()),
            };
            prepared.set_shadows(&maps.shadows(&view, settings)?);
        }
        Ok(())
    }

    fn render_once(
        &mut self,
        viewpoint: &impl Viewpoint,
        settings: &Settings,
    ) -> Result<(Picture, FrameStats)> {
        self.frame = 0;
        if self.scene.items.is_empty() {
            return Ok((clear(viewpoint, settings)?, FrameStats::default()));
        }
        if self.adds_maxima(settings) {
            return self.render_maxima(viewpoint, settings);
        }
        self.cast_shadows(viewpoint, settings)?;
        match &mut self.drawer {
            #[cfg(all(feature = "gpu", not(target_arch = "wasm32")))]
            Drawer::Gpu(renderer, prepared) => renderer.render(prepared, viewpoint, settings),
            #[cfg(all(feature = "gpu", target_arch = "wasm32"))]
            Drawer::Gpu(..) => cannot_wait(),
            Drawer::Cpu(worker) => worker.engine().render(viewpoint, settings),
        }
    }

    /// Draws a picture without blocking. The CPU engine draws in a thread, except in a browser.
    /// Elsewhere than in a browser, someone must poll a GPU's device meanwhile
    /// ([`wgpu::Device::poll`]).
    ///
    /// # Errors
    /// Those of [`render`](Self::render). A lost device is not reopened: [`Error::DeviceLost`].
    pub async fn render_async(
        &mut self,
        viewpoint: &impl Viewpoint,
        settings: &Settings,
    ) -> Result<(Picture, FrameStats)> {
        let view = viewpoint.view(settings.size)?;
        self.frame = 0;
        if self.scene.items.is_empty() {
            return Ok((clear(&view, settings)?, FrameStats::default()));
        }
        if self.adds_maxima(settings) {
            return self.render_maxima_async(&view, settings).await;
        }
        self.cast_shadows(&view, settings)?;
        match &mut self.drawer {
            #[cfg(feature = "gpu")]
            Drawer::Gpu(renderer, prepared) => {
                renderer.render_async(prepared, &view, settings).await
            }
            Drawer::Cpu(worker) => {
                worker.begin(view, settings);
                poll_fn(|context| worker.poll(Some(context.waker()))).await
            }
        }
    }

    /// Draws a picture and leaves it on the device. A frame's time then excludes reading it back
    /// from a GPU.
    ///
    /// # Errors
    /// Those of [`render`](Self::render). A lost device is not reopened: [`Error::DeviceLost`].
    pub fn draw(&mut self, viewpoint: &impl Viewpoint, settings: &Settings) -> Result<FrameStats> {
        let by_render = self.scene.items.is_empty() || self.adds_maxima(settings);
        if !by_render {
            self.cast_shadows(viewpoint, settings)?;
        }
        match &mut self.drawer {
            #[cfg(all(feature = "gpu", not(target_arch = "wasm32")))]
            Drawer::Gpu(renderer, prepared) if !by_render => {
                renderer.draw(prepared, viewpoint, settings)
            }
            _ => Ok(self.render_once(viewpoint, settings)?.1),
        }
    }

    /// Like [`draw`](Self::draw), but the statistics contain the time of each step.
    ///
    /// # Errors
    /// Those of [`draw`](Self::draw).
    pub fn profile(
        &mut self,
        viewpoint: &impl Viewpoint,
        settings: &Settings,
    ) -> Result<FrameStats> {
        let by_render = self.scene.items.is_empty() || self.adds_maxima(settings);
        if !by_render {
            self.cast_shadows(viewpoint, settings)?;
        }
        match &mut self.drawer {
            #[cfg(all(feature = "gpu", not(target_arch = "wasm32")))]
            Drawer::Gpu(renderer, prepared) if !by_render => {
                renderer.profile(prepared, viewpoint, settings)
            }
            _ => Ok(self.render_once(viewpoint, settings)?.1),
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
        self.frame = 0;
        self.forget_parked();
        #[cfg(feature = "gpu")]
        {
            self.upload = host::upload(&self.device);
        }
        Ok(())
    }
}
