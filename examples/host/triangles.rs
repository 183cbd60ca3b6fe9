//! The host's own triangles, drawn with a depth test as in any program.

use bytemuck::{Pod, Zeroable};
use splatkit::{glam::DMat4, wgpu};
use wgpu::{TextureFormat, util::DeviceExt};

/// A corner of a triangle: world position and colour.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Corner {
    pub position: [f32; 3],
    pub color: [f32; 3],
}

pub struct Triangles {
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
    /// The matrix from world coordinates to clip space.
    matrix: wgpu::Buffer,
    corners: wgpu::Buffer,
    count: u32,
}

impl Triangles {
    pub fn new(
        device: &wgpu::Device,
        corners: &[Corner],
        [color, depth]: [TextureFormat; 2],
    ) -> Self {
        let pipeline = pipeline(device, color, depth);
        let matrix = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("host"),
            size: 64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("host"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: matrix.as_entire_binding() }],
        });
        let contents = wgpu::util::BufferInitDescriptor {
            label: Some("host"),
            contents: bytemuck::cast_slice(corners),
            usage: wgpu::BufferUsages::VERTEX,
        };
        let (corners, count) = (device.create_buffer_init(&contents), corners.len() as u32);
        Self { pipeline, group, matrix, corners, count }
    }

    /// Sets the matrix from world coordinates to clip space.
    pub fn look_from(&self, queue: &wgpu::Queue, clip: DMat4) {
        let matrix = clip.as_mat4().to_cols_array();
        queue.write_buffer(&self.matrix, 0, bytemuck::cast_slice(&matrix));
    }

    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.set_vertex_buffer(0, self.corners.slice(..));
        pass.draw(0..self.count, 0..1);
    }
}

const SHADER: &str = "
    @group(0) @binding(0) var<uniform> clip_from_world: mat4x4<f32>;

    struct Vertex {
        @builtin(position) position: vec4<f32>,
        @location(0) color: vec3<f32>,
    }

    @vertex
    fn vertex(@location(0) position: vec3<f32>, @location(1) color: vec3<f32>) -> Vertex {
        return Vertex(clip_from_world * vec4(position, 1.0), color);
    }

    @fragment
    fn fragment(vertex: Vertex) -> @location(0) vec4<f32> {
        return vec4(vertex.color, 1.0);
    }
";

fn pipeline(
    device: &wgpu::Device,
    color: TextureFormat,
    depth: TextureFormat,
) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("host"),
        source: wgpu::ShaderSource::Wgsl(SHADER.into()),
    });
    let corner = wgpu::VertexBufferLayout {
        array_stride: size_of::<Corner>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3],
    };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("host"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[Some(corner)],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: depth,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Less),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("fragment"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(color.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
