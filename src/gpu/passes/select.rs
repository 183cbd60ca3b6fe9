//! Select: lists the samples of a lattice that can add to the picture under the current transfer
//! function (shaders/passes/select.wgsl). Runs when the transfer function makes other samples
//! visible. Explicit splats have no such list: all are candidates.

use super::{listing::Listing, scan::Scan};
use crate::{
    Result,
    gpu::{
        device::{Gpu, buffers::buffer},
        pipeline::{
            commands::Commands,
            recipe::{Binding, Recipe},
            shaders,
        },
        scene::{
            PreparedScene,
            chunk::{Origin, list_bytes, spans},
            selection::Selection,
        },
    },
    math::View,
    scene::Item,
    volume::reach::{EVERYTHING, first_visible},
};
use wgpu::BufferUsages as Usage;

/// The pass.
#[derive(Debug)]
pub struct Select(Listing);

impl Select {
    pub fn new(gpu: &Gpu, scan: &Scan) -> Self {
        Self(Listing::new(gpu, Self::recipes(), scan))
    }

    pub fn recipes() -> [Recipe; 2] {
        use Binding::{Read, Uniform, Write};
        let sources = [shaders::FRAME, shaders::SELECT];
        Listing::recipes("select", &sources, &[Uniform, Read, Read, Write, Write])
    }

    /// Lists the visible samples of lattices again if others have become visible. `all` lists all
    /// samples.
    pub fn list(
        &self,
        gpu: &Gpu,
        prepared: &mut PreparedScene,
        view: &View,
        all: bool,
    ) -> Result<()> {
        if !prepared.scene.items.iter().any(|item| matches!(item, Item::Volume(..))) {
            return Ok(());
        }
        prepared.bring_lattices(gpu)?;
        for chunk in &mut prepared.chunks {
            let (source, before) =
                (chunk.source(view, false, &prepared.page_caches), chunk.list_bytes());
            let Origin::Lattice { volume, selection, .. } = &mut chunk.origin else { continue };
            let first_visible = match prepared.scene.items[chunk.item].transfer() {
                Some(transfer) if !all => first_visible(transfer, volume.range),
                _ => EVERYTHING,
            };
            if selection.is_for(&first_visible) {
                continue;
            }
            gpu.queue.write_buffer(&chunk.uniform, 0, bytemuck::bytes_of(&source));
            let rest = prepared.bytes - before;
            self.update(gpu, selection, &chunk.uniform, &first_visible, |count| {
                gpu.check_memory(rest + list_bytes(u64::from(count)))
            })?;
            chunk.candidates = selection.count;
            chunk.spans = spans(gpu, selection.count);
            prepared.bytes = rest + chunk.list_bytes();
        }
        prepared.number_runs();
        Ok(())
    }

    /// Makes the list of a chunk, in a buffer of its size, unless `check` refuses the number of
    /// samples. `uniform` is the chunk's source. `first_visible` is the result of
    /// [`first_visible`](crate::volume::reach::first_visible).
    fn update(
        &self,
        gpu: &Gpu,
        selection: &mut Selection,
        uniform: &wgpu::Buffer,
        first_visible: &[u16; 256],
        check: impl Fn(u32) -> Result<()>,
    ) -> Result<()> {
        selection.count = selection.counts.visible(first_visible);
        check(selection.count)?;
        selection.selected =
            buffer(gpu, "selected", 4 * u64::from(selection.count), Usage::STORAGE);
        let visible = Listing::levels(gpu, first_visible);
        let blocks = (&selection.blocks, selection.block_count);
        let buffers = [uniform, &selection.ranges, &visible, blocks.0, &selection.selected];
        Commands::submit(gpu, "select", |commands| {
            self.0.encode(gpu, commands, buffers, blocks);
        });
        selection.first_visible = Some(*first_visible);
        Ok(())
    }
}
