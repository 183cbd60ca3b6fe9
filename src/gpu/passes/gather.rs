//! Gather: draws the field of a lattice without splats (shaders/passes/gather.wgsl and
//! shaders/shared/field_lattice.wgsl). The splats of other items in the scene are scattered as
//! usual; march then evaluates the field itself, sheet by sheet.

use super::march::FIRST_SHADOW;
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

/// The pass, and whether it binds what keeps light away.
#[derive(Debug)]
pub struct Gather(Stage, bool);

impl Gather {
    pub fn new(gpu: &Gpu, variant: &Variant) -> Self {
        let has_shadows = variant.lamps && variant.volume_shaded;
        Self(Stage::new(gpu, &Self::recipe(variant)), has_shadows)
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
            lamps: variant.lamps && variant.volume_shaded,
            staged: false,
            ..*variant
        };
        let sources = [
            &reduced.constants(),
            shaders::FRAME,
            shaders::TABLES,
            shaders::PIXEL,
            shaders::SHEET,
            reduced.lamp_shader(),
            shaders::PICTURE,
            shaders::VALUE,
            shaders::FIELD_LATTICE,
            reduced.label_shader(),
            shaders::PROGRESS,
            shaders::GATHER,
        ];
        let mut bindings = vec![Uniform, Read, Uniform, Read, Write, Write, Read, Write];
        if reduced.lamps {
            bindings.resize(FIRST_SHADOW as usize, Binding::Unused);
            bindings.extend([Binding::Texture; 2]);
        }
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
            let buffers = buffers.map(|b| b.as_entire_buffer_binding());
            let shadows = targets.shadows.as_ref().filter(|_| self.1).map_or(&[][..], |all| all);
            let group = self.0.bind_both(gpu, 0, &buffers, &[(FIRST_SHADOW, shadows)]);
            let samples = self.0.bind_textures(gpu, 1, &gathered.textures);
            let tiles = gathered.tiles.next_multiple_of(LANES);
            self.0.dispatch(commands, &[&group, &samples], tiles);
        }
    }
}
