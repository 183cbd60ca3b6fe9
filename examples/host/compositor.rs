//! The drawing of the host, without a window: splatkit's picture in textures, and the host's own
//! triangles before and behind it.

use bytemuck::{Pod, Zeroable};
use splatkit::{
    gpu::{Depth, Gpu, Output, PendingFrame, PreparedScene, Progress, Renderer},
    math::{Camera, View},
    scene::{Scene, Settings},
    wgpu,
};
use wgpu::{TextureFormat, TextureUsages};

const DEPTH: TextureFormat = TextureFormat::Depth32Float;

/// A corner of the host's triangles: world position and colour.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Corner {
    pub position: [f32; 3],
    pub color: [f32; 3],
}

/// The constants of host.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Constants {
    clip_from_world: [[f32; 4]; 4],
    depth_scale: f32,
    depth_shift: f32,
    unused: [f32; 2],
}

/// The textures of one size.
struct Textures {
    colors: wgpu::TextureView,
    depths: wgpu::TextureView,
    depth_buffer: wgpu::TextureView,
}

/// Draws a scene of splats and the host's triangles with one camera.
pub struct Compositor {
    gpu: Gpu,
    renderer: Renderer,
    prepared: PreparedScene,
    /// splatkit's picture that is being drawn, with its camera.
    frame: Option<(PendingFrame, Camera)>,
    /// The camera of the picture in the textures.
    drawn_camera: Option<Camera>,
    size: [u32; 2],
    textures: Textures,
    layout: wgpu::BindGroupLayout,
    splats: wgpu::RenderPipeline,
    triangles: wgpu::RenderPipeline,
    corners: wgpu::Buffer,
    constants: wgpu::Buffer,
}

impl Compositor {
    /// `format` is that of the views to draw into.
    pub fn new(
        gpu: &Gpu,
        scene: &Scene,
        corners: &[Corner],
        format: TextureFormat,
        size: [u32; 2],
    ) -> splatkit::Result<Self> {
        let renderer = Renderer::new(gpu);
        let prepared = renderer.prepare(scene)?;
        let layout = bind_group_layout(&gpu.device);
        let [splats, triangles] = pipelines(&gpu.device, &layout, format);
        let buffer = |usage, bytes: u64| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("host"),
                size: bytes,
                usage: usage | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let bytes: &[u8] = bytemuck::cast_slice(corners);
        let corners = buffer(wgpu::BufferUsages::VERTEX, bytes.len() as u64);
        gpu.queue.write_buffer(&corners, 0, bytes);
        Ok(Self {
            gpu: gpu.clone(),
            renderer,
            prepared,
            frame: None,
            drawn_camera: None,
            size,
            textures: textures(&gpu.device, size),
            layout,
            splats,
            triangles,
            corners,
            constants: buffer(wgpu::BufferUsages::UNIFORM, size_of::<Constants>() as u64),
        })
    }

    /// Draws pictures of another size from now on.
    pub fn resize(&mut self, size: [u32; 2]) {
        self.size = size;
        self.textures = textures(&self.gpu.device, size);
        (self.frame, self.drawn_camera) = (None, None);
    }

    /// Draws what there is: splatkit's last finished picture, and the triangles as its camera sees
    /// them. Returns whether that is the picture of `camera`; if not, call again.
    pub fn draw(&mut self, camera: &Camera, to: &wgpu::TextureView) -> splatkit::Result<bool> {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        self.advance(camera, &mut encoder)?;
        if let Some(drawn_camera) = &self.drawn_camera {
            self.composite(&drawn_camera.view(self.size)?, to, &mut encoder);
        }
        self.gpu.queue.submit([encoder.finish()]);
        Ok(self.drawn_camera.as_ref() == Some(camera))
    }

    /// Encodes the next part of splatkit's picture, if it is time for it. Nothing here waits.
    fn advance(
        &mut self,
        camera: &Camera,
        encoder: &mut wgpu::CommandEncoder,
    ) -> splatkit::Result<()> {
        let Some((frame, frame_camera)) = &mut self.frame else {
            if self.drawn_camera.as_ref() != Some(camera) {
                let output = Output::Textures {
                    color: self.textures.colors.clone(),
                    format: self.textures.colors.texture().format(),
                    depth: Some(Depth::Linear(self.textures.depths.clone())),
                    over: false,
                };
                let (renderer, prepared) = (&mut self.renderer, &mut self.prepared);
                let settings = Settings::new(self.size);
                let frame = renderer.encode(encoder, prepared, camera, &settings, output)?;
                self.frame = Some((frame, camera.clone()));
            }
            return Ok(());
        };
        match self.renderer.poll(&mut self.prepared, frame)? {
            Progress::Done(_) => {
                self.drawn_camera = Some(frame_camera.clone());
                self.frame = None;
            }
            Progress::NextBatch => {
                self.renderer.encode_next(encoder, &mut self.prepared, frame)?;
            }
            _ => {}
        }
        Ok(())
    }

    /// Encodes the host's own pass.
    fn composite(&self, view: &View, to: &wgpu::TextureView, encoder: &mut wgpu::CommandEncoder) {
        // What the host's depth buffer covers, in world units from the camera.
        let (near, far) = (0.1, 1000.0);
        let constants = Constants {
            clip_from_world: view.clip_from_world(near, far).as_mat4().to_cols_array_2d(),
            depth_scale: (far / (far - near)) as f32,
            depth_shift: (-far * near / (far - near)) as f32,
            unused: [0.0; 2],
        };
        self.gpu.queue.write_buffer(&self.constants, 0, bytemuck::bytes_of(&constants));
        let Textures { colors, depths, depth_buffer } = &self.textures;
        let group = self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("host"),
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: self.constants.as_entire_binding() },
                entry_of(1, colors),
                entry_of(2, depths),
            ],
        });
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("host"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: to,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations::default(),
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: depth_buffer,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_bind_group(0, &group, &[]);
        pass.set_pipeline(&self.splats);
        pass.draw(0..3, 0..1);
        pass.set_pipeline(&self.triangles);
        pass.set_vertex_buffer(0, self.corners.slice(..));
        pass.draw(0..(self.corners.size() / size_of::<Corner>() as u64) as u32, 0..1);
    }
}

fn entry_of(binding: u32, view: &wgpu::TextureView) -> wgpu::BindGroupEntry<'_> {
    wgpu::BindGroupEntry { binding, resource: wgpu::BindingResource::TextureView(view) }
}

fn textures(device: &wgpu::Device, [width, height]: [u32; 2]) -> Textures {
    let texture = |format, usage| {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("host"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: TextureUsages::RENDER_ATTACHMENT | usage,
            view_formats: &[],
        });
        texture.create_view(&wgpu::TextureViewDescriptor::default())
    };
    Textures {
        colors: texture(TextureFormat::Rgba8Unorm, TextureUsages::TEXTURE_BINDING),
        depths: texture(TextureFormat::R32Float, TextureUsages::TEXTURE_BINDING),
        depth_buffer: texture(DEPTH, TextureUsages::empty()),
    }
}

fn bind_group_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let uniform = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    let texture = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: false },
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let entry = |(binding, ty)| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
        ty,
        count: None,
    };
    let entries: Vec<_> = (0..).zip([uniform, texture, texture]).map(entry).collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("host"),
        entries: &entries,
    })
}

/// Returns the pipelines of splatkit's picture and of the triangles.
fn pipelines(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    format: TextureFormat,
) -> [wgpu::RenderPipeline; 2] {
    let module = device.create_shader_module(wgpu::include_wgsl!("host.wgsl"));
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("host"),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    let corner = wgpu::VertexBufferLayout {
        array_stride: size_of::<Corner>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3],
    };
    let pipeline = |[vertex, fragment]: [&str; 2], buffers: &[Option<_>], compare| {
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(fragment),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some(vertex),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers,
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH,
                depth_write_enabled: Some(true),
                depth_compare: Some(compare),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some(fragment),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(format.into())],
            }),
            multiview_mask: None,
            cache: None,
        })
    };
    [
        pipeline(["corner", "splats"], &[], wgpu::CompareFunction::Always),
        pipeline(["vertex", "triangles"], &[Some(corner)], wgpu::CompareFunction::Less),
    ]
}
