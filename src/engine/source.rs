//! Passes that read candidates come in three kinds, one per source of candidates: explicit splats
//! (shaders/source_splats.wgsl), hierarchies (shaders/source_nodes.wgsl) and lattices (shaders/source_lattice.wgsl).

use super::{
    Gpu, shaders,
    stage::{Binding, Stage},
    upload::{Chunk, Origin, WORKGROUP_CANDIDATES},
};

/// One thing per kind of source.
#[derive(Debug)]
pub struct Sources<T> {
    splats: T,
    nodes: T,
    lattice: T,
}

/// Makes all kinds of a stage from the source's shader and the bindings of its group.
pub fn per_source(make: impl Fn(&str, &[Binding]) -> Stage) -> Sources<Stage> {
    use Binding::{Read, Uniform};
    let lattice = [shaders::SAMPLE, shaders::SOURCE_LATTICE].concat();
    Sources {
        splats: make(&[shaders::SPLATS, shaders::SOURCE_SPLATS].concat(), &[Uniform, Read]),
        nodes: make(&[shaders::SPLATS, shaders::SOURCE_NODES].concat(), &[Uniform, Read, Read]),
        lattice: make(&lattice, &[Uniform, Read, Read, Uniform]),
    }
}

impl Sources<Stage> {
    /// Encodes the stage over the candidates of a chunk; `buffers` is its first bind group.
    pub fn dispatch(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        chunk: &Chunk,
        buffers: &[wgpu::BufferBinding<'_>],
    ) {
        match &chunk.origin {
            Origin::Splats { .. } => {
                let own = [&chunk.uniform, &chunk.data].map(|b| b.as_entire_buffer_binding());
                let groups = [self.splats.bind(gpu, 0, buffers), self.splats.bind(gpu, 1, &own)];
                let workgroups = chunk.count.div_ceil(WORKGROUP_CANDIDATES);
                self.splats.dispatch(encoder, &[&groups[0], &groups[1]], workgroups);
            }
            Origin::Nodes { slots, .. } => {
                let own = [&chunk.uniform, &chunk.data, &slots.selected].map(|b| b.as_entire_buffer_binding());
                let groups = [self.nodes.bind(gpu, 0, buffers), self.nodes.bind(gpu, 1, &own)];
                self.nodes.dispatch_indirect(encoder, &[&groups[0], &groups[1]], (&slots.arguments, 0));
            }
            Origin::Lattice { selection, places, .. } => {
                let own = [&chunk.uniform, &chunk.data, &selection.selected, places];
                let own = own.map(|b| b.as_entire_buffer_binding());
                let groups = [self.lattice.bind(gpu, 0, buffers), self.lattice.bind(gpu, 1, &own)];
                // The number of selected samples is known on the GPU alone.
                self.lattice.dispatch_indirect(encoder, &[&groups[0], &groups[1]], (&selection.arguments, 0));
            }
        }
    }
}
