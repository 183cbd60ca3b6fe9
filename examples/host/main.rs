//! A host application with its own window, device and triangles, which draws splatkit's frame
//! behind and before them: `cargo run --release --example host`. Drag to turn.
//!
//! compositor.rs shows how splatkit is embedded; this file is the window.

mod compositor;

use compositor::{Compositor, Corner};
use splatkit::{
    glam::{DVec2, DVec3},
    gpu::Gpu,
    math::{Camera, Kernel},
    scene::Scene,
    volume::{TransferFunction, phantoms::Phantom},
    wgpu,
};
use std::{error::Error, sync::Arc};
use winit::{
    application::ApplicationHandler,
    event::{ElementState, MouseButton, WindowEvent},
    event_loop::{ActiveEventLoop, ControlFlow, EventLoop},
    window::{Window, WindowId},
};

/// The window, its surface, and what draws into it.
struct Open {
    window: Arc<Window>,
    surface: wgpu::Surface<'static>,
    configuration: wgpu::SurfaceConfiguration,
    gpu: Gpu,
    compositor: Compositor,
    camera: Camera,
}

#[derive(Default)]
struct Host {
    open: Option<Open>,
    error: Option<Box<dyn Error>>,
    cursor: DVec2,
    is_dragging: bool,
}

/// A volume of splatkit's.
fn scene() -> splatkit::Result<Scene> {
    let volume = Phantom::Specimen.sample_bytes([96; 3])?;
    let transfer = TransferFunction::automatic(&volume);
    Ok(Scene::new().with_volume(volume, Kernel::default(), transfer))
}

/// The host's own geometry: two triangles through the middle of the scene.
fn triangles(center: DVec3, size: f64) -> Vec<Corner> {
    let corner = |x: f64, y: f64, z: f64, color| Corner {
        position: (center + size * DVec3::new(x, y, z)).as_vec3().to_array(),
        color,
    };
    let (red, blue) = ([0.9, 0.2, 0.1], [0.1, 0.4, 0.9]);
    vec![
        corner(-0.6, 0.0, -0.5, red),
        corner(0.6, 0.0, -0.5, red),
        corner(0.0, 0.0, 0.6, red),
        corner(0.0, -0.6, 0.5, blue),
        corner(0.0, 0.6, 0.5, blue),
        corner(0.0, 0.0, -0.6, blue),
    ]
}

impl Open {
    async fn new(window: Arc<Window>) -> Result<Self, Box<dyn Error>> {
        let instance =
            wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
        let surface = instance.create_surface(window.clone())?;
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            compatible_surface: Some(&surface),
            ..wgpu::RequestAdapterOptions::default()
        };
        let adapter = instance.request_adapter(&options).await?;
        // splatkit needs WebGPU's default limits.
        let descriptor = wgpu::DeviceDescriptor::default();
        let (device, queue) = adapter.request_device(&descriptor).await?;
        let gpu = Gpu::from_wgpu(device, queue, adapter.get_info());

        let size = window.inner_size();
        let mut configuration = surface
            .get_default_config(&adapter, size.width.max(1), size.height.max(1))
            .ok_or("the window's surface does not suit the adapter")?;
        // Colours are written as they are displayed.
        configuration.format = configuration.format.remove_srgb_suffix();
        surface.configure(&gpu.device, &configuration);

        let scene = scene()?;
        let bounds = scene.bounds();
        let size = [configuration.width, configuration.height];
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        let corners = triangles(bounds.center(), bounds.diagonal());
        Ok(Self {
            compositor: Compositor::new(&gpu, &scene, &corners, configuration.format, size)?,
            camera: Camera::framing(&bounds, DVec3::Y, DVec3::Z, aspect),
            window,
            surface,
            configuration,
            gpu,
        })
    }

    fn resize(&mut self, width: u32, height: u32) {
        // A minimised window has no pixels.
        if width > 0 && height > 0 {
            (self.configuration.width, self.configuration.height) = (width, height);
            self.surface.configure(&self.gpu.device, &self.configuration);
            self.compositor.resize([width, height]);
            self.window.request_redraw();
        }
    }

    fn redraw(&mut self) -> Result<(), Box<dyn Error>> {
        use wgpu::CurrentSurfaceTexture::{Lost, Outdated, Suboptimal, Success, Validation};
        let texture = match self.surface.get_current_texture() {
            Success(texture) | Suboptimal(texture) => texture,
            Outdated | Lost => {
                self.surface.configure(&self.gpu.device, &self.configuration);
                self.window.request_redraw();
                return Ok(());
            }
            Validation => return Err("the window's surface is not valid".into()),
            // Hidden, or late: the next event draws.
            _ => return Ok(()),
        };
        let view = texture.texture.create_view(&wgpu::TextureViewDescriptor::default());
        let is_up_to_date = self.compositor.draw(&self.camera, &view)?;
        self.window.pre_present_notify();
        self.gpu.queue.present(texture);
        if !is_up_to_date {
            self.window.request_redraw();
        }
        Ok(())
    }
}

impl Host {
    /// Keeps the first error and ends.
    fn end(&mut self, event_loop: &ActiveEventLoop, error: Box<dyn Error>) {
        self.error.get_or_insert(error);
        event_loop.exit();
    }
}

impl ApplicationHandler for Host {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        let attributes = Window::default_attributes().with_title("splatkit in a host");
        let opened = event_loop
            .create_window(attributes)
            .map_err(Into::into)
            .and_then(|window| pollster::block_on(Open::new(Arc::new(window))));
        match opened {
            Ok(open) => self.open = Some(open),
            Err(error) => self.end(event_loop, error),
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(open) = &mut self.open else { return };
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::Resized(size) => open.resize(size.width, size.height),
            WindowEvent::RedrawRequested => {
                if let Err(error) = open.redraw() {
                    self.end(event_loop, error);
                }
            }
            WindowEvent::MouseInput { state, button: MouseButton::Left, .. } => {
                self.is_dragging = state == ElementState::Pressed;
            }
            WindowEvent::CursorMoved { position, .. } => {
                let place = DVec2::new(position.x, position.y);
                let moved = place - std::mem::replace(&mut self.cursor, place);
                if self.is_dragging {
                    open.camera.azimuth(-0.4 * moved.x);
                    open.camera.elevation(0.4 * moved.y);
                    open.window.request_redraw();
                }
            }
            _ => {}
        }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let event_loop = EventLoop::new()?;
    event_loop.set_control_flow(ControlFlow::Wait);
    let mut host = Host::default();
    event_loop.run_app(&mut host)?;
    host.error.map_or(Ok(()), Err)
}
