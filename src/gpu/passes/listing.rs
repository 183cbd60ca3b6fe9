//! What passes share that list chosen samples: one stage counts those of each block, a scan adds up
//! the counts before each block, and another stage writes the list.

use super::scan::Scan;
use crate::gpu::{
    device::{Gpu, buffers::upload},
    pipeline::{
        commands::Commands,
        recipe::{Binding, Recipe},
        stage::Stage,
    },
};

/// Blocks per workgroup.
const BLOCKS: u32 = 64;

/// The stages that make a list.
#[derive(Debug)]
pub struct Listing {
    count: Stage,
    write: Stage,
    scan: Scan,
}

impl Listing {
    pub fn new(gpu: &Gpu, recipes: [Recipe; 2], scan: &Scan) -> Self {
        let [count, write] = Stage::all(gpu, recipes);
        Self { count, write, scan: scan.clone() }
    }

    /// Returns the recipes of a pass whose shader has the entries `count` and `write`.
    pub fn recipes(pass: &str, sources: &[&'static str], bindings: &[Binding]) -> [Recipe; 2] {
        ["count", "write"]
            .map(|entry| Recipe::new(&format!("{pass}: {entry}"), sources, entry, &[bindings]))
    }

    /// Uploads the levels from which on samples are visible, as the shaders read them.
    pub fn levels(gpu: &Gpu, first_visible: &[u16; 256]) -> wgpu::Buffer {
        upload(gpu, "visible levels", bytemuck::cast_slice(&first_visible.map(u32::from)))
    }

    /// Encodes the list of `count` blocks. `buffers` are those of the shader; `blocks` is the one
    /// of them that holds the counts, and has an element more than there are blocks.
    pub fn encode<const N: usize>(
        &self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        buffers: [&wgpu::Buffer; N],
        (blocks, count): (&wgpu::Buffer, u32),
    ) {
        let buffers = buffers.map(wgpu::Buffer::as_entire_buffer_binding);
        let groups = count.div_ceil(BLOCKS);
        commands.clear(blocks);
        self.count.dispatch(commands, &[&self.count.bind(gpu, 0, &buffers)], groups);
        self.scan.encode(gpu, commands, blocks, count + 1);
        self.write.dispatch(commands, &[&self.write.bind(gpu, 0, &buffers)], groups);
    }
}
