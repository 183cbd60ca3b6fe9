//! The sources of candidates. A pass that reads candidates has a stage for each of the five kinds:
//! explicit splats (shaders/sources/splats.wgsl), hierarchies (shaders/sources/nodes.wgsl),
//! lattices (shaders/sources/lattice.wgsl), volumes in bricks (shaders/sources/bricks.wgsl) and
//! facets (shaders/sources/facets.wgsl).

use crate::gpu::{
    device::Gpu,
    pipeline::{
        commands::Commands,
        recipe::{Binding, Recipe},
        shaders,
        stage::Stage,
    },
    scene::chunk::{Chunk, Origin, WORKGROUP_CANDIDATES},
};

/// One value per kind of source.
#[derive(Debug)]
pub struct Sources<T> {
    splats: T,
    nodes: T,
    lattice: T,
    bricks: T,
    facets: T,
}

impl<T> Sources<T> {
    #[cfg(test)]
    pub fn into_array(self) -> [T; 5] {
        [self.splats, self.nodes, self.lattice, self.bricks, self.facets]
    }

    pub fn map<U>(self, make: impl Fn(T) -> U) -> Sources<U> {
        let Self { splats, nodes, lattice, bricks, facets } = self;
        Sources {
            splats: make(splats),
            nodes: make(nodes),
            lattice: make(lattice),
            bricks: make(bricks),
            facets: make(facets),
        }
    }
}

/// Returns the recipes of a pass for all kinds of sources. `make` takes the kind's name, the
/// source's shader and the bindings of its group.
pub fn per_source(make: impl Fn(&str, &str, &[Binding]) -> Recipe) -> Sources<Recipe> {
    use Binding::{Read, Uniform};
    let others = shaders::SOURCE_NO_FACETS;
    let lattice = [shaders::VALUE, shaders::SAMPLE, shaders::SOURCE_LATTICE, others].concat();
    let bricks = [shaders::VALUE, shaders::SAMPLE, shaders::SOURCE_BRICKS, others].concat();
    let splats = [shaders::VALUE, shaders::SPLAT, shaders::SPLATS, others].concat();
    Sources {
        splats: make("splats", &[&splats, shaders::SOURCE_SPLATS].concat(), &[Uniform, Read]),
        nodes: make("nodes", &[&splats, shaders::SOURCE_NODES].concat(), &[Uniform, Read, Read]),
        lattice: make("lattice", &lattice, &[Uniform, Read, Read, Uniform]),
        bricks: make("bricks", &bricks, &[Uniform, Read, Read, Uniform]),
        facets: make("facets", shaders::SOURCE_FACETS, &[Uniform, Read]),
    }
}

impl Sources<Stage> {
    /// Encodes the stage over the candidates of a chunk; `buffers` is its first bind group.
    pub fn dispatch(
        &self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        chunk: &Chunk,
        buffers: &[wgpu::BufferBinding<'_>],
    ) {
        match &chunk.origin {
            // Only the GPU knows the number of drawn nodes.
            Origin::Nodes { slots, .. } => {
                self.dispatch_indirect(gpu, commands, chunk, buffers, &slots.arguments);
            }
            _ => {
                let (stage, groups) = self.bound(gpu, chunk, buffers);
                let workgroups = chunk.candidates.div_ceil(WORKGROUP_CANDIDATES);
                stage.dispatch(commands, &[&groups[0], &groups[1]], workgroups);
            }
        }
    }

    /// The same, with the number of workgroups in a buffer.
    pub fn dispatch_indirect(
        &self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        chunk: &Chunk,
        buffers: &[wgpu::BufferBinding<'_>],
        arguments: &wgpu::Buffer,
    ) {
        let (stage, groups) = self.bound(gpu, chunk, buffers);
        stage.dispatch_indirect(commands, &[&groups[0], &groups[1]], (arguments, 0));
    }

    fn bound(
        &self,
        gpu: &Gpu,
        chunk: &Chunk,
        buffers: &[wgpu::BufferBinding<'_>],
    ) -> (&Stage, [wgpu::BindGroup; 2]) {
        let (stage, chunk_buffers) = match &chunk.origin {
            Origin::Splats { .. } => (&self.splats, vec![&chunk.uniform, &chunk.data]),
            Origin::Facets { .. } => (&self.facets, vec![&chunk.uniform, &chunk.data]),
            Origin::Nodes { slots, .. } => {
                (&self.nodes, vec![&chunk.uniform, &chunk.data, &slots.selected])
            }
            Origin::Lattice { selection, places, .. } => {
                (&self.lattice, vec![&chunk.uniform, &chunk.data, &selection.selected, places])
            }
            Origin::Bricks { slab, .. } => {
                (&self.bricks, vec![&chunk.uniform, &chunk.data, &slab.selected, &slab.slots])
            }
        };
        let chunk_buffers: Vec<_> =
            chunk_buffers.into_iter().map(wgpu::Buffer::as_entire_buffer_binding).collect();
        (stage, [stage.bind(gpu, 0, buffers), stage.bind(gpu, 1, &chunk_buffers)])
    }
}
