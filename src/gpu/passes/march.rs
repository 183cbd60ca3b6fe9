//! March: processes each tile's entries front to back and composites its sheets
//! (shaders/passes/march.wgsl).

use crate::gpu::{
    device::Gpu,
    pipeline::{
        commands::Commands,
        recipe::{Binding, Recipe},
        shaders,
        stage::Stage,
    },
    targets::Targets,
    variant::Variant,
};

/// The number of the first binding of images (images.wgsl).
const FIRST_IMAGE: u32 = 11;

/// The number of the first binding of what keeps light away (lamps.wgsl).
pub const FIRST_SHADOW: u32 = 13;

/// The pass.
#[derive(Debug)]
pub struct March(Stage);

impl March {
    pub fn new(gpu: &Gpu, variant: &Variant) -> Self {
        Self(Stage::new(gpu, &Self::recipe(variant)))
    }

    pub fn recipe(variant: &Variant) -> Recipe {
        use Binding::{Read, Uniform, Write};
        let constants = variant.constants();
        let mut sources = vec![
            constants.as_str(),
            shaders::FRAME,
            shaders::NORMAL,
            shaders::TABLES,
            shaders::PIXEL,
            shaders::KERNELS,
            if variant.staged { shaders::STAGED } else { shaders::NO_STAGED },
            if variant.central { shaders::SLOPES } else { shaders::NO_SLOPES },
            shaders::SHEET,
            variant.lamp_shader(),
            if variant.facets { shaders::FACETS } else { shaders::NO_FACETS },
            if variant.rods { shaders::RODS } else { shaders::NO_RODS },
            if variant.images { shaders::IMAGES } else { shaders::NO_IMAGES },
            shaders::PICTURE,
            shaders::PROGRESS,
            shaders::SAVED,
            shaders::MARCH,
        ];
        let mut bindings =
            vec![Uniform, Read, Uniform, Read, Read, Read, Read, Write, Write, Write];
        if variant.gather {
            sources.extend([shaders::VALUE, shaders::FIELD_LATTICE]);
            sources.extend([variant.label_shader(), shaders::MARCH_LATTICE]);
            bindings.push(Read);
        } else {
            sources.push(shaders::FIELD_SUMS);
        }
        if variant.images {
            bindings.resize(FIRST_IMAGE as usize, Binding::Unused);
            bindings.extend([Binding::Words; 2]);
        }
        if variant.lamps {
            bindings.resize(FIRST_SHADOW as usize, Binding::Unused);
            bindings.extend([Binding::Texture; 2]);
        }
        let mut groups = vec![bindings.as_slice()];
        groups.extend(variant.gather.then(|| variant.textures()));
        Recipe::new("march", &sources, "march", &groups)
    }

    /// Encodes the pass. `arguments` is the byte offset of its dispatch in the buffer of indirect
    /// dispatches.
    pub fn encode(
        &self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        targets: &Targets,
        arguments: u64,
    ) {
        let mut buffers = vec![
            targets.frame.as_entire_buffer_binding(),
            targets.planes.as_entire_buffer_binding(),
            targets.pass.as_entire_buffer_binding(),
            targets.records.as_entire_buffer_binding(),
            targets.bins.as_entire_buffer_binding(),
            targets.entries.as_entire_buffer_binding(),
            targets.tables.as_entire_buffer_binding(),
            targets.colors.as_entire_buffer_binding(),
            targets.depths.as_entire_buffer_binding(),
            targets.progress.as_entire_buffer_binding(),
        ];
        let mut textures = None;
        if let Some(gathered) = &targets.gathered {
            buffers.push(gathered.visibility.as_entire_buffer_binding());
            textures = Some(self.0.bind_textures(gpu, 1, &gathered.textures));
        }
        let images = targets.images.as_ref().map_or(&[][..], |images| images);
        let shadows = targets.shadows.as_ref().map_or(&[][..], |shadows| shadows);
        let group =
            self.0.bind_both(gpu, 0, &buffers, &[(FIRST_IMAGE, images), (FIRST_SHADOW, shadows)]);
        let groups: Vec<_> = std::iter::once(&group).chain(&textures).collect();
        self.0.dispatch_indirect(commands, &groups, (&targets.arguments, arguments));
    }
}
