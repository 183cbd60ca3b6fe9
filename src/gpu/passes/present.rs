//! Present: writes a finished strip to where the host application wants it
//! (shaders/passes/present.wgsl).

#[cfg(test)]
use crate::gpu::pipeline::recipe::Recipe;
use crate::{
    gpu::{
        device::{Gpu, buffers::filled_buffer},
        output::{Depth, Output},
        pipeline::{
            recipe::Binding,
            shaders,
            stage::layout_of,
            state::{DONE_WORD, STALLED_WORD},
        },
        targets::{Targets, gathered_word},
    },
    math::View,
    scene::Optics,
};
use bytemuck::{Pod, Zeroable};
use std::collections::HashMap;
use wgpu::TextureFormat;

/// The word that a strip is finished without.
const NONE: u32 = u32::MAX;

/// The constants of present.wgsl, field by field.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Present {
    pub size: [u32; 2],
    pub first_row: u32,
    pub is_srgb: u32,
    pub center: [f32; 2],
    pub scale: f32,
    pub perspective: u32,
    pub word: u32,
    pub wanted: u32,
    pub stalled: u32,
    pub far: f32,
    pub has_depth: u32,
    pub are_distances: u32,
    pub depth_shift: f32,
    pub depth_factor: f32,
}

/// A strip of a picture, and where its rows lie.
#[derive(Debug)]
pub struct Strip<'a> {
    pub view: &'a View,
    /// Its first row in the picture.
    pub first_row: u32,
    pub pixels: Pixels<'a>,
    pub optics: Optics,
}

/// The pixels of a strip on the device.
#[derive(Debug, Clone, Copy)]
pub struct Pixels<'a> {
    pub colors: &'a wgpu::Buffer,
    pub depths: &'a wgpu::Buffer,
    /// Whether the depths are distances along the rays; otherwise they are view-space z.
    pub are_distances: bool,
    /// The strip is finished if this word of the buffer has this value, and the last word, if there
    /// is one, is 0.
    pub finished: (&'a wgpu::Buffer, u32, u32, Option<u32>),
}

impl<'a> Pixels<'a> {
    /// Returns the pixels of the engine's buffers.
    pub fn of(targets: &'a Targets) -> Self {
        let finished = match &targets.gathered {
            Some(gathered) => {
                let word = gathered_word(targets.tiles[0] * targets.tiles[1]) as u32;
                (&targets.progress, word, gathered.workgroups(), None)
            }
            None => (&targets.state, DONE_WORD, 1, Some(STALLED_WORD)),
        };
        let Targets { colors, depths, .. } = targets;
        Self { colors, depths, are_distances: true, finished }
    }
}

/// What a pipeline of the pass writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Writes {
    color: TextureFormat,
    depth: Option<TextureFormat>,
    over: bool,
    /// Whether depths of the depth buffer decrease with the distance.
    is_reversed: bool,
}

/// The bindings of the pass.
const BINDINGS: [Binding; 4] = [Binding::Uniform, Binding::Read, Binding::Read, Binding::Read];

/// The pipelines of the pass.
#[derive(Debug, Default)]
pub struct Presenter {
    pipelines: HashMap<Writes, wgpu::RenderPipeline>,
}

impl Presenter {
    /// Returns the entry points of the shader, for the checks of shaders.
    #[cfg(test)]
    pub fn recipes() -> [Recipe; 4] {
        ["corner", "color", "color_and_depth", "color_and_depth_buffer"].map(|entry| {
            Recipe::new(&format!("present: {entry}"), &[shaders::PRESENT], entry, &[&BINDINGS])
        })
    }

    /// Encodes the commands that write a strip, once it is finished.
    pub fn encode(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        output: &Output,
        strip: &Strip<'_>,
    ) {
        match output {
            Output::Textures { color, format, depth, over } => {
                let is_reversed =
                    matches!(depth, Some(Depth::Buffer { near, far, .. }) if near > far);
                let writes = Writes {
                    color: *format,
                    depth: depth.as_ref().map(|depth| depth.texture().texture().format()),
                    over: *over,
                    is_reversed,
                };
                let pipeline =
                    self.pipelines.entry(writes).or_insert_with(|| pipeline(gpu, writes));
                let group = bind(gpu, pipeline, strip, format.is_srgb(), depth.as_ref());
                draw(encoder, pipeline, &group, (color, depth.as_ref()), strip);
            }
            Output::Buffers { color, distance } => {
                let [width, height] = strip.view.size.map(u64::from);
                let (pixels, first) = (width * height, u64::from(strip.first_row) * width);
                let Pixels { colors, depths, .. } = strip.pixels;
                encoder.copy_buffer_to_buffer(colors, 0, color, 16 * first, 16 * pixels);
                if let Some(distance) = distance {
                    encoder.copy_buffer_to_buffer(depths, 0, distance, 4 * first, 4 * pixels);
                }
            }
        }
    }
}

fn pipeline(gpu: &Gpu, writes: Writes) -> wgpu::RenderPipeline {
    let Writes { color, depth, over, is_reversed } = writes;
    let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("present"),
        source: wgpu::ShaderSource::Wgsl(shaders::PRESENT.into()),
    });
    let group = layout_of(&gpu.device, "present", &BINDINGS, wgpu::ShaderStages::FRAGMENT);
    let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("present"),
        bind_group_layouts: &[Some(&group)],
        immediate_size: 0,
    });
    let blend = over.then_some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING);
    let write_mask = wgpu::ColorWrites::ALL;
    let color = Some(wgpu::ColorTargetState { format: color, blend, write_mask });
    let linear = Some(wgpu::ColorTargetState::from(TextureFormat::R32Float));
    let targets = [color, linear];
    let (entry, targets) = match depth {
        None => ("color", &targets[..1]),
        Some(TextureFormat::R32Float) => ("color_and_depth", &targets[..]),
        Some(_) => ("color_and_depth_buffer", &targets[..1]),
    };
    let compare = match (over, is_reversed) {
        (false, _) => wgpu::CompareFunction::Always,
        (true, false) => wgpu::CompareFunction::LessEqual,
        (true, true) => wgpu::CompareFunction::GreaterEqual,
    };
    let buffer = depth.filter(|format| format.has_depth_aspect());
    let depth_stencil = buffer.map(|format| wgpu::DepthStencilState {
        format,
        depth_write_enabled: Some(true),
        depth_compare: Some(compare),
        stencil: wgpu::StencilState::default(),
        bias: wgpu::DepthBiasState::default(),
    });
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("present"),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("corner"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some(entry),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}

fn bind(
    gpu: &Gpu,
    pipeline: &wgpu::RenderPipeline,
    strip: &Strip<'_>,
    is_srgb: bool,
    depth: Option<&Depth>,
) -> wgpu::BindGroup {
    let Strip { view, pixels, .. } = strip;
    let Pixels { colors, depths, are_distances, finished: (words, word, wanted, stalled) } = pixels;
    let (far, [depth_shift, depth_factor]) = match depth {
        Some(&Depth::Buffer { near, far, .. }) => {
            let reversed = if near > far { 0.0 } else { 1.0 };
            (reversed, Depth::factors(near, far, view.perspective).map(|factor| factor as f32))
        }
        _ => (f32::INFINITY, [0.0; 2]),
    };
    let constants = Present {
        size: view.size,
        first_row: strip.first_row,
        is_srgb: is_srgb.into(),
        center: view.center.as_vec2().to_array(),
        scale: view.scale as f32,
        perspective: view.perspective.into(),
        word: *word,
        wanted: *wanted,
        stalled: stalled.unwrap_or(NONE),
        far,
        // The maximum of a ray has no depth.
        has_depth: (strip.optics != Optics::Maximum).into(),
        are_distances: (*are_distances).into(),
        depth_shift,
        depth_factor,
    };
    let usage = wgpu::BufferUsages::UNIFORM;
    let constants = filled_buffer(gpu, "present", bytemuck::bytes_of(&constants), usage);
    let buffers = [&constants, words, colors, depths];
    let entries: Vec<_> = (0..)
        .zip(buffers)
        .map(|(binding, buffer)| wgpu::BindGroupEntry {
            binding,
            resource: buffer.as_entire_binding(),
        })
        .collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("present"),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &entries,
    })
}

fn draw(
    encoder: &mut wgpu::CommandEncoder,
    pipeline: &wgpu::RenderPipeline,
    group: &wgpu::BindGroup,
    (color, depth): (&wgpu::TextureView, Option<&Depth>),
    strip: &Strip<'_>,
) {
    let attachment = |view| wgpu::RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
    };
    let mut attachments = vec![Some(attachment(color))];
    if let Some(Depth::Linear(view)) = depth {
        attachments.push(Some(attachment(view)));
    }
    let buffer = match depth {
        Some(Depth::Buffer { view, .. }) => Some(wgpu::RenderPassDepthStencilAttachment {
            view,
            depth_ops: Some(wgpu::Operations {
                load: wgpu::LoadOp::Load,
                store: wgpu::StoreOp::Store,
            }),
            stencil_ops: None,
        }),
        _ => None,
    };
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("present"),
        color_attachments: &attachments,
        depth_stencil_attachment: buffer,
        ..wgpu::RenderPassDescriptor::default()
    });
    let [width, height] = strip.view.size;
    pass.set_scissor_rect(0, strip.first_row, width, height);
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, group, &[]);
    pass.draw(0..3, 0..1);
}
