//! One compute pipeline with its bindings, compiled from its recipe.

use super::{
    commands::Commands,
    recipe::{Binding, Recipe},
};
use crate::gpu::device::{Gpu, pipeline_cache::Compiled};

/// A compute pipeline, ready to be bound and dispatched.
#[derive(Debug, Clone)]
pub struct Stage {
    label: String,
    compiled: Compiled,
    /// Maximum number of workgroups along one dimension of a dispatch. Shaders know it as
    /// `MOST_WORKGROUPS`.
    most_workgroups: u32,
}

impl Stage {
    /// Returns the stages of several recipes.
    pub fn all<const N: usize>(gpu: &Gpu, recipes: [Recipe; N]) -> [Self; N] {
        recipes.map(|recipe| Self::new(gpu, &recipe))
    }

    /// Returns the stage of a recipe, which is compiled if the device does not have it yet.
    pub fn new(gpu: &Gpu, recipe: &Recipe) -> Self {
        let label = recipe.label.clone();
        let most_workgroups = gpu.device.limits().max_compute_workgroups_per_dimension;
        let compile = || Self::compile(&gpu.device, recipe, most_workgroups);
        let compiled = gpu.pipeline_cache.get(recipe.hash(most_workgroups), compile);
        Self { label, compiled, most_workgroups }
    }

    fn compile(device: &wgpu::Device, recipe: &Recipe, most_workgroups: u32) -> Compiled {
        let label = recipe.label.as_str();
        let descriptor = wgpu::ShaderModuleDescriptor {
            label: Some(label),
            source: wgpu::ShaderSource::Wgsl(recipe.source(most_workgroups).into()),
        };
        // Loop counters and clamped indices keep the driver from unrolling the loops over an
        // invocation's pixels. The sums of the pixels then live in memory instead of registers:
        // march took 5 times as long with them (Mesa 22.3 software Vulkan).
        let checks = wgpu::ShaderRuntimeChecks {
            force_loop_bounding: false,
            bounds_checks: false,
            ..wgpu::ShaderRuntimeChecks::checked()
        };
        // SAFETY: the shaders are this crate's own files. Every loop in them counts towards a
        // constant, a number of tiles, sheets or entries of the frame, or the length of a list.
        // Indices come from counts that determined the sizes of the buffers on the CPU, or are
        // compared with the buffers' capacities before use (records and entries). None comes from a
        // file.
        #[expect(unsafe_code, reason = "shaders without the checks that untrusted ones need")]
        let module = unsafe { device.create_shader_module_trusted(descriptor, checks) };
        let visibility = wgpu::ShaderStages::COMPUTE;
        let layouts: Vec<_> = recipe
            .groups
            .iter()
            .map(|bindings| layout_of(device, label, bindings, visibility))
            .collect();
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(label),
            bind_group_layouts: &layouts.iter().map(Some).collect::<Vec<_>>(),
            immediate_size: 0,
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(label),
            layout: Some(&pipeline_layout),
            module: &module,
            entry_point: Some(recipe.entry),
            // No shader reads workgroup memory before it writes it.
            compilation_options: wgpu::PipelineCompilationOptions {
                zero_initialize_workgroup_memory: false,
                ..Default::default()
            },
            cache: None,
        });
        Compiled { pipeline, layouts }
    }

    /// Binds buffers, or parts of them, to group `group`, in the order of their binding numbers.
    pub fn bind(
        &self,
        gpu: &Gpu,
        group: usize,
        buffers: &[wgpu::BufferBinding<'_>],
    ) -> wgpu::BindGroup {
        self.bind_both(gpu, group, buffers, &[])
    }

    /// Binds buffers as [`bind`](Self::bind) does, and lists of textures, each from a number on.
    pub fn bind_both(
        &self,
        gpu: &Gpu,
        group: usize,
        buffers: &[wgpu::BufferBinding<'_>],
        textures: &[(u32, &[wgpu::TextureView])],
    ) -> wgpu::BindGroup {
        let buffers = buffers.iter().cloned().map(wgpu::BindingResource::Buffer);
        let textures = textures.iter().flat_map(|(first, views)| {
            (*first..).zip(views.iter().map(wgpu::BindingResource::TextureView))
        });
        let entries: Vec<_> = (0..)
            .zip(buffers)
            .chain(textures)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(&self.label),
            layout: &self.compiled.layouts[group],
            entries: &entries,
        })
    }

    /// Binds textures as the bindings of group `group`.
    pub fn bind_textures(
        &self,
        gpu: &Gpu,
        group: usize,
        textures: &[wgpu::TextureView],
    ) -> wgpu::BindGroup {
        self.bind_both(gpu, group, &[], &[(0, textures)])
    }

    /// Encodes a dispatch of a fixed number of workgroups. Workgroups that do not fit one dimension
    /// continue in the second: workgroup (x, y) is number x + y · `MOST_WORKGROUPS`. The last row
    /// may contain a few too many.
    pub fn dispatch(
        &self,
        commands: &mut Commands<'_>,
        groups: &[&wgpu::BindGroup],
        workgroups: u32,
    ) {
        let columns = workgroups.min(self.most_workgroups);
        if columns > 0 {
            self.begin(commands, groups).dispatch_workgroups(
                columns,
                workgroups.div_ceil(columns),
                1,
            );
        }
    }

    /// Encodes a dispatch whose number of workgroups is stored in `arguments`, at a byte offset.
    pub fn dispatch_indirect(
        &self,
        commands: &mut Commands<'_>,
        groups: &[&wgpu::BindGroup],
        (arguments, offset): (&wgpu::Buffer, u64),
    ) {
        self.begin(commands, groups).dispatch_workgroups_indirect(arguments, offset);
    }

    fn begin<'a>(
        &self,
        commands: &'a mut Commands<'_>,
        groups: &[&wgpu::BindGroup],
    ) -> &'a mut wgpu::ComputePass<'static> {
        let pass = commands.pass();
        pass.set_pipeline(&self.compiled.pipeline);
        for (index, group) in (0..).zip(groups) {
            pass.set_bind_group(index, *group, &[]);
        }
        pass
    }
}

/// Creates the layout of a bind group.
pub fn layout_of(
    device: &wgpu::Device,
    label: &str,
    bindings: &[Binding],
    visibility: wgpu::ShaderStages,
) -> wgpu::BindGroupLayout {
    let buffer =
        |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let words = |view_dimension| wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Uint,
        view_dimension,
        multisampled: false,
    };
    let entries: Vec<_> = (0..)
        .zip(bindings)
        .filter(|(_, kind)| **kind != Binding::Unused)
        .map(|(binding, kind)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility,
            ty: match kind {
                Binding::Uniform => buffer(wgpu::BufferBindingType::Uniform),
                Binding::Read => buffer(wgpu::BufferBindingType::Storage { read_only: true }),
                Binding::Write => buffer(wgpu::BufferBindingType::Storage { read_only: false }),
                Binding::Texture => words(wgpu::TextureViewDimension::D3),
                _ => words(wgpu::TextureViewDimension::D2),
            },
            count: None,
        })
        .collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some(label),
        entries: &entries,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::{device::AdapterChoice, passes::scan::Scan};

    #[test]
    fn a_device_compiles_each_recipe_once() {
        let gpu = Gpu::headless(&AdapterChoice::Automatic).expect("an adapter");
        let pipelines =
            |gpu: &Gpu| Stage::all(gpu, Scan::recipes()).map(|stage| stage.compiled.pipeline);
        let first = pipelines(&gpu);
        assert_eq!(first, pipelines(&gpu.clone().with_memory(1)), "shared by the device's clones");
        assert!(first[0] != first[1] && first[1] != first[2], "entry points differ");
        gpu.pipeline_cache.forget();
        assert_ne!(first, pipelines(&gpu), "compiled again after an error");
    }
}
