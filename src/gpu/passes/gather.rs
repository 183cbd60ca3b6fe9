//! Gather: draws the field of a lattice without splats (shaders/passes/gather.wgsl and
//! shaders/shared/field_lattice.wgsl). The splats of other items in the scene are scattered as
//! usual; march then evaluates the field itself, sheet by sheet.

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

/// Number of lanes to which tiles are dealt (`LANES` in frame.wgsl).
const LANES: u32 = 16;

/// The pass.
#[derive(Debug)]
pub struct Gather(Stage);

impl Gather {
    pub fn new(gpu: &Gpu, variant: &Variant) -> Self {
        Self(Stage::new(gpu, &Self::recipe(variant)))
    }

    pub fn recipe(variant: &Variant) -> Recipe {
        use Binding::{Read, Uniform, Write};
        // An invocation draws one pixel, and only the field.
        let reduced = Variant {
            rows: 1,
            radiance: false,
            trained: false,
            facets: false,
            rods: false,
            images: false,
            surface_shaded: false,
            staged: false,
            ..*variant
        };
        let sources = [
            &reduced.constants(),
            shaders::FRAME,
            shaders::TABLES,
            shaders::PIXEL,
            shaders::SHEET,
            shaders::PICTURE,
            shaders::VALUE,
            shaders::FIELD_LATTICE,
            reduced.label_shader(),
            shaders::PROGRESS,
            shaders::GATHER,
        ];
        let bindings = [Uniform, Read, Uniform, Read, Write, Write, Read, Write];
        Recipe::new("gather", &sources, "gather", &[&bindings, reduced.textures()])
    }

    pub fn encode(&self, gpu: &Gpu, commands: &mut Commands<'_>, targets: &Targets) {
        let Some(gathered) = &targets.gathered else { return };
        for window in &gathered.windows {
            let buffers = [
                &targets.frame,
                &targets.planes,
                window,
                &gathered.visibility,
                &targets.progress,
                &targets.depths,
                &targets.tables,
                &targets.colors,
            ];
            let group = self.0.bind(gpu, 0, &buffers.map(|b| b.as_entire_buffer_binding()));
            let samples = self.0.bind_textures(gpu, 1, &gathered.textures);
            let tiles = gathered.tiles.next_multiple_of(LANES);
            self.0.dispatch(commands, &[&group, &samples], tiles);
        }
    }
}
