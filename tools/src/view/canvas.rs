//! The picture on the screen.
//!
//! With a device of the window's, a small shader of its own draws it. On Mesa's software driver
//! that takes a fraction of the time of an image of egui, whose shader blends and mixes colours.

use eframe::{
    egui::{
        Color32, ColorImage, Context, PaintCallbackInfo, Pos2, Rect, TextureHandle, TextureOptions,
        Ui,
    },
    egui_wgpu::{Callback, CallbackResources, CallbackTrait, RenderState},
    wgpu,
};

/// Draws the picture, whose size the area has in pixels or whose pixels are wider than the
/// screen's.
const SHADER: &str = "
@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var mixed: sampler;

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) place: vec2<f32>,
}

@vertex
fn corner(@builtin(vertex_index) index: u32) -> Corner {
    // A triangle around the whole area.
    let place = vec2(f32((index << 1u) & 2u), f32(index & 2u));
    return Corner(vec4(place * vec2(2.0, -2.0) + vec2(-1.0, 1.0), 0.0, 1.0), place);
}

@fragment
fn color(input: Corner) -> @location(0) vec4<f32> {
    return textureSampleLevel(picture, mixed, input.place, 0.0);
}
";

/// The picture on the screen.
pub struct Canvas {
    gpu: Option<Gpu>,
    /// Without a device of the window's: a texture of egui's.
    texture: Option<TextureHandle>,
}

/// What draws on the window's device.
struct Gpu {
    device: wgpu::Device,
    queue: wgpu::Queue,
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    /// For pictures with wider pixels than the screen's, and for others.
    samplers: [wgpu::Sampler; 2],
    format: wgpu::TextureFormat,
    picture: Option<Uploaded>,
}

struct Uploaded {
    texture: wgpu::Texture,
    is_exact: bool,
    group: wgpu::BindGroup,
}

impl Canvas {
    pub fn new(state: Option<&RenderState>) -> Self {
        Self { gpu: state.map(Gpu::new), texture: None }
    }

    /// Takes a picture: rows from the top, and red, green, blue and opacity of each pixel. Those of
    /// an exact one are the screen's.
    pub fn set(&mut self, context: &Context, size: [u32; 2], rgba: &[u8], is_exact: bool) {
        if let Some(gpu) = &mut self.gpu {
            gpu.set(size, rgba, is_exact);
            return;
        }
        let image = ColorImage::from_rgba_unmultiplied(size.map(|side| side as usize), rgba);
        let options = if is_exact { TextureOptions::NEAREST } else { TextureOptions::LINEAR };
        match &mut self.texture {
            Some(texture) => texture.set(image, options),
            none => *none = Some(context.load_texture("picture", image, options)),
        }
    }

    pub fn clear(&mut self) {
        self.texture = None;
        if let Some(gpu) = &mut self.gpu {
            gpu.picture = None;
        }
    }

    pub fn paint(&self, ui: &Ui, area: Rect) {
        if let Some(texture) = &self.texture {
            let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
            ui.painter().image(texture.id(), area, whole, Color32::WHITE);
        }
        if let Some(gpu) = &self.gpu
            && let Some(picture) = &gpu.picture
        {
            let (pipeline, group) = (gpu.pipeline.clone(), picture.group.clone());
            ui.painter().add(Callback::new_paint_callback(area, Paint { pipeline, group }));
        }
    }
}

impl Gpu {
    fn new(state: &RenderState) -> Self {
        let device = &state.device;
        let layout = layout(device);
        let pipeline = pipeline(device, &layout, state.target_format);
        let sampler = |filter| {
            device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("picture"),
                mag_filter: filter,
                min_filter: filter,
                ..wgpu::SamplerDescriptor::default()
            })
        };
        // A screen that computes in linear light encodes what the shader returns.
        let format = match state.target_format.is_srgb() {
            true => wgpu::TextureFormat::Rgba8UnormSrgb,
            false => wgpu::TextureFormat::Rgba8Unorm,
        };
        Self {
            device: device.clone(),
            queue: state.queue.clone(),
            pipeline,
            samplers: [wgpu::FilterMode::Linear, wgpu::FilterMode::Nearest].map(sampler),
            layout,
            format,
            picture: None,
        }
    }

    fn set(&mut self, [width, height]: [u32; 2], rgba: &[u8], is_exact: bool) {
        let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
        let is_same =
            |picture: &Uploaded| picture.texture.size() == size && picture.is_exact == is_exact;
        if !self.picture.as_ref().is_some_and(is_same) {
            self.picture = Some(self.make(size, is_exact));
        }
        if let Some(picture) = &self.picture {
            let layout = wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(4 * width),
                rows_per_image: None,
            };
            self.queue.write_texture(picture.texture.as_image_copy(), rgba, layout, size);
        }
    }

    fn make(&self, size: wgpu::Extent3d, is_exact: bool) -> Uploaded {
        let texture = self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("picture"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: self.format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let group = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("picture"),
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry {
                    binding: 0,
                    resource: wgpu::BindingResource::TextureView(&view),
                },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: wgpu::BindingResource::Sampler(&self.samplers[usize::from(is_exact)]),
                },
            ],
        });
        Uploaded { texture, is_exact, group }
    }
}

/// Draws the picture in a pass of egui's.
struct Paint {
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
}

impl CallbackTrait for Paint {
    fn paint(
        &self,
        _: PaintCallbackInfo,
        pass: &mut wgpu::RenderPass<'static>,
        _: &CallbackResources,
    ) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// Returns the layout of what the shader reads: a texture and a sampler.
fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::FRAGMENT,
        ty,
        count: None,
    };
    let texture = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: true },
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("picture"),
        entries: &[entry(0, texture), entry(1, sampler)],
    })
}

/// Returns the pipeline that draws the picture onto a screen of this format.
fn pipeline(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    target: wgpu::TextureFormat,
) -> wgpu::RenderPipeline {
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("picture"),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("picture"),
        source: wgpu::ShaderSource::Wgsl(SHADER.into()),
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("picture"),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("corner"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("color"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(target.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
