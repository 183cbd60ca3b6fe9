//! March: walks each tile's entries front to back and composites its sheets (shaders/march.wgsl).

use super::{
    Gpu,
    frame::Targets,
    shaders::{self, Variant},
    stage::{Binding, Stage},
};

/// The pass.
#[derive(Debug)]
pub struct March(Stage);

impl March {
    pub fn new(gpu: &Gpu, variant: &Variant) -> Self {
        use Binding::{Read, Uniform, Write};
        let sources = [
            &variant.constants(),
            shaders::FRAME,
            shaders::NORMAL,
            shaders::TABLES,
            shaders::PIXEL,
            shaders::KERNELS,
            shaders::SHEET,
            shaders::PROGRESS,
            shaders::SAVED,
            shaders::MARCH,
        ];
        let bindings = [Uniform, Read, Uniform, Read, Read, Read, Read, Write, Write, Write];
        Self(Stage::new(gpu, "march", &sources, "march", &[&bindings]))
    }

    /// `arguments`: where in the pass's the dispatch stands.
    pub fn encode(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, targets: &Targets, arguments: u64) {
        let buffers = [
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
        self.0.dispatch_indirect(encoder, &[&self.0.bind(gpu, 0, &buffers)], (&targets.arguments, arguments));
    }
}
