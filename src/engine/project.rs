//! Project: the records of a pass's splats, and the sizes of its bins (shaders/project.wgsl).

use super::{
    Gpu,
    frame::Targets,
    scan::Scan,
    shaders::{self, Variant},
    source::{Sources, per_source},
    stage::{Binding, Stage},
    upload::Chunk,
};

/// The pass: count, scan, write.
#[derive(Debug)]
pub struct Project {
    count: Sources<Stage>,
    write: Sources<Stage>,
}

impl Project {
    pub fn new(gpu: &Gpu, variant: &Variant) -> Self {
        use Binding::{Read, Uniform, Write};
        let constants = variant.constants();
        let stage = |label, entry| {
            per_source(|source, bindings| {
                let sources = [
                    &constants,
                    shaders::FRAME,
                    shaders::NORMAL,
                    shaders::FOOTPRINT,
                    source,
                    shaders::SPANS,
                    shaders::BINS,
                    shaders::PROJECT,
                ];
                let own = [Uniform, Read, Read, Uniform, Write, Write, Write, Write];
                Stage::new(gpu, label, &sources, entry, &[&own, bindings])
            })
        };
        Self { count: stage("project: count", "count"), write: stage("project: write", "write") }
    }

    pub fn encode(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        targets: &Targets,
        scan: &Scan,
        chunks: &[Chunk],
        pass: u32,
    ) {
        // Runs behind a lattice's last selected sample, and the element after the last run, count nothing.
        encoder.clear_buffer(&targets.runs, 0, None);
        encoder.clear_buffer(&targets.bins, 0, None);
        for stage in [&self.count, &self.write] {
            for chunk in chunks {
                let buffers = [
                    targets.frame.as_entire_buffer_binding(),
                    targets.planes.as_entire_buffer_binding(),
                    chunk.spans.as_entire_buffer_binding(),
                    targets.pass(pass),
                    targets.runs.as_entire_buffer_binding(),
                    targets.records.as_entire_buffer_binding(),
                    targets.boxes.as_entire_buffer_binding(),
                    targets.bins.as_entire_buffer_binding(),
                ];
                stage.dispatch(gpu, encoder, chunk, &buffers);
            }
            if std::ptr::eq(stage, &self.count) {
                scan.encode(gpu, encoder, &targets.runs, targets.run_total + 1);
            }
        }
    }
}
