//! splatkit's frame in a window of egui, on the window's own device:
//! `cargo run --release --example egui`. Drag to turn; the slider changes the opacity.

use eframe::{egui, egui_wgpu::RenderState, wgpu};
use splatkit::{
    Device, Frame, ItemId, Renderer, Result,
    gpu::{Gpu, Progress},
    math::{Camera, Kernel},
    scene::{Scene, Settings},
    volume::{TransferFunction, phantoms::Phantom},
};

/// A view of a scene.
struct View {
    gpu: Gpu,
    state: RenderState,
    renderer: Renderer,
    camera: Camera,
    transfer: TransferFunction,
    opacity: f64,
    /// The texture that splatkit writes, and its name in egui.
    texture: Option<(wgpu::TextureView, egui::TextureId)>,
    /// The frame that is being drawn.
    frame: Option<Frame>,
    /// Whether what is shown is out of date.
    is_old: bool,
}

impl View {
    fn new(state: RenderState) -> Result<Self> {
        let (device, queue) = (state.device.clone(), state.queue.clone());
        let gpu = Gpu::from_wgpu(device, queue, state.adapter.get_info());
        let volume = Phantom::Specimen.sample_bytes([96; 3])?;
        let transfer = TransferFunction::automatic(&volume);
        let scene = Scene::new().with_volume(volume, Kernel::default(), transfer.clone());
        // The GPU engine, or the CPU engine where the driver runs on the processor.
        let renderer = Renderer::new(&Device::of_host(&gpu), &scene)?;
        let camera = Camera::fit(&scene, [640, 480])?;
        let (texture, frame) = (None, None);
        Ok(Self {
            gpu,
            state,
            renderer,
            camera,
            transfer,
            opacity: 1.0,
            texture,
            frame,
            is_old: true,
        })
    }

    /// Returns the texture of a size for egui.
    fn texture(&mut self, [width, height]: [u32; 2]) -> (wgpu::TextureView, egui::TextureId) {
        let fits = |view: &wgpu::TextureView| {
            (view.texture().width(), view.texture().height()) == (width, height)
        };
        if let Some(texture) = self.texture.clone().filter(|(view, _)| fits(view)) {
            return texture;
        }
        let texture = self.state.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("picture"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba8Unorm,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let mut renderer = self.state.renderer.write();
        if let Some((_, last)) = self.texture.take() {
            renderer.free_texture(&last);
        }
        let nearest = wgpu::FilterMode::Nearest;
        let id = renderer.register_native_texture(&self.state.device, &view, nearest);
        self.is_old = true;
        self.texture.insert((view, id)).clone()
    }

    /// Goes on with the frame that is drawn, or begins one. Returns whether there is more to do.
    fn draw(&mut self, texture: &wgpu::TextureView, size: [u32; 2]) -> Result<bool> {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        if self.is_old && self.frame.is_none() {
            let settings = Settings::new(size);
            let frame = self.renderer.encode(&mut encoder, &self.camera, &settings, texture)?;
            (self.frame, self.is_old) = (Some(frame), false);
        } else if let Some(frame) = &mut self.frame {
            match self.renderer.poll(frame)? {
                Progress::NextBatch => self.renderer.encode_next(&mut encoder, frame)?,
                Progress::Done(_) => self.frame = None,
                _ => {}
            }
        }
        self.gpu.queue.submit([encoder.finish()]);
        Ok(self.frame.is_some() || self.is_old)
    }

    fn set_opacity(&mut self) -> Result<()> {
        let mut transfer = self.transfer.clone();
        transfer.opacity.iter_mut().for_each(|(_, opacity)| *opacity *= self.opacity);
        self.frame = None;
        self.is_old = true;
        self.renderer.set_transfer(ItemId::from(0), &transfer)
    }
}

impl eframe::App for View {
    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        let slider = egui::Slider::new(&mut self.opacity, 0.0..=1.0).text("opacity");
        if ui.add(slider).changed()
            && let Err(error) = self.set_opacity()
        {
            ui.label(error.to_string());
        }
        let area = ui.available_size();
        let pixels = area * ui.pixels_per_point();
        let size = [pixels.x, pixels.y].map(|side| side.max(1.0) as u32);
        let (texture, id) = self.texture(size);
        let picture = egui::Image::new((id, area)).sense(egui::Sense::drag());
        let drag = ui.add(picture).drag_delta();
        if drag != egui::Vec2::ZERO {
            self.camera.azimuth(-0.4 * f64::from(drag.x));
            self.camera.elevation(0.4 * f64::from(drag.y));
            self.is_old = true;
        }
        match self.draw(&texture, size) {
            Ok(true) => ui.ctx().request_repaint(),
            Ok(false) => {}
            Err(error) => eprintln!("{error}"),
        }
    }
}

fn main() -> eframe::Result {
    let create = |creation: &eframe::CreationContext<'_>| {
        let state = creation.wgpu_render_state.clone().ok_or("egui draws without wgpu")?;
        Ok(Box::new(View::new(state)?) as Box<dyn eframe::App>)
    };
    let options = eframe::NativeOptions { renderer: eframe::Renderer::Wgpu, ..Default::default() };
    eframe::run_native("splatkit in egui", options, Box::new(create))
}
