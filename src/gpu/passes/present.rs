//! Present: writes a finished strip to where the host application wants it
//! (shaders/passes/present.wgsl).

#[cfg(test)]
use crate::gpu::pipeline::recipe::Recipe;
use crate::{
    gpu::{
        device::{Gpu, buffers::filled_buffer},
        output::Output,
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
    pub unused: u32,
}

/// A strip of a picture, and where its rows lie.
#[derive(Debug)]
pub struct Strip<'a> {
    pub view: &'a View,
    /// Its first row in the picture.
    pub first_row: u32,
    pub targets: &'a Targets,
    pub optics: Optics,
}

/// The bindings of the pass.
const BINDINGS: [Binding; 4] = [Binding::Uniform, Binding::Read, Binding::Read, Binding::Read];

/// The pipelines of the pass: one for each format of colours, with depths and without.
#[derive(Debug, Default)]
pub struct Presenter {
    pipelines: HashMap<(TextureFormat, bool), wgpu::RenderPipeline>,
}

impl Presenter {
    /// Returns the entry points of the shader, for the checks of shaders.
    #[cfg(test)]
    pub fn recipes() -> [Recipe; 3] {
        ["corner", "color", "color_and_depth"].map(|entry| {
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
            Output::Textures { color, format, depth } => {
                let pipeline = self
                    .pipelines
                    .entry((*format, depth.is_some()))
                    .or_insert_with(|| pipeline(gpu, *format, depth.is_some()));
                let group = bind(gpu, pipeline, strip, format.is_srgb());
                let views = [Some(color), depth.as_ref()];
                draw(encoder, pipeline, &group, views, strip);
            }
            Output::Buffers { color, distance } => {
                let [width, height] = strip.view.size.map(u64::from);
                let (pixels, first) = (width * height, u64::from(strip.first_row) * width);
                let Targets { colors, depths, .. } = strip.targets;
                encoder.copy_buffer_to_buffer(colors, 0, color, 16 * first, 16 * pixels);
                if let Some(distance) = distance {
                    encoder.copy_buffer_to_buffer(depths, 0, distance, 4 * first, 4 * pixels);
                }
            }
        }
    }
}

fn pipeline(gpu: &Gpu, format: TextureFormat, has_depth: bool) -> wgpu::RenderPipeline {
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
    let target = |format| Some(wgpu::ColorTargetState::from(format));
    let targets = [target(format), target(TextureFormat::R32Float)];
    let (entry, targets) = match has_depth {
        true => ("color_and_depth", &targets[..]),
        false => ("color", &targets[..1]),
    };
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
        depth_stencil: None,
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
) -> wgpu::BindGroup {
    let Strip { view, targets, .. } = strip;
    let (words, [word, wanted, stalled]) = match &targets.gathered {
        Some(gathered) => {
            let word = gathered_word(targets.tiles[0] * targets.tiles[1]) as u32;
            (&targets.progress, [word, gathered.workgroups(), NONE])
        }
        None => (&targets.state, [DONE_WORD, 1, STALLED_WORD]),
    };
    let constants = Present {
        size: view.size,
        first_row: strip.first_row,
        is_srgb: is_srgb.into(),
        center: view.center.as_vec2().to_array(),
        scale: view.scale as f32,
        perspective: view.perspective.into(),
        word,
        wanted,
        stalled,
        far: f32::INFINITY,
        // The maximum of a ray has no depth.
        has_depth: (strip.optics != Optics::Maximum).into(),
        unused: 0,
    };
    let usage = wgpu::BufferUsages::UNIFORM;
    let constants = filled_buffer(gpu, "present", bytemuck::bytes_of(&constants), usage);
    let buffers = [&constants, words, &targets.colors, &targets.depths];
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
    views: [Option<&wgpu::TextureView>; 2],
    strip: &Strip<'_>,
) {
    let attachment = |view| wgpu::RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
    };
    let attachments: Vec<_> =
        views.into_iter().flatten().map(|view| Some(attachment(view))).collect();
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("present"),
        color_attachments: &attachments,
        ..wgpu::RenderPassDescriptor::default()
    });
    let [width, height] = strip.view.size;
    pass.set_scissor_rect(0, strip.first_row, width, height);
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, group, &[]);
    pass.draw(0..3, 0..1);
}
