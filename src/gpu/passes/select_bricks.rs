//! Select bricks: lists the samples of the loaded bricks that can add to the picture
//! (shaders/passes/select_bricks.wgsl).

use super::{listing::Listing, scan::Scan};
use crate::{
    Result,
    bricks::Choice,
    gpu::{
        device::{Gpu, buffers::buffer},
        pipeline::{
            commands::Commands,
            recipe::{Binding, Recipe},
            shaders,
        },
        scene::{
            PreparedScene,
            bricks::{Listed, Room, Slab},
            chunk::{Origin, list_bytes, runs_of, spans},
        },
    },
    math::View,
};
use wgpu::BufferUsages as Usage;

/// The pass.
#[derive(Debug)]
pub struct SelectBricks(Listing);

impl SelectBricks {
    pub fn new(gpu: &Gpu, scan: &Scan) -> Self {
        Self(Listing::new(gpu, Self::recipes(), scan))
    }

    pub fn recipes() -> [Recipe; 2] {
        use Binding::{Read, Uniform, Write};
        let sources = [shaders::FRAME, shaders::SELECT_BRICKS];
        let bindings = [Uniform, Read, Read, Write, Write, Uniform];
        Listing::recipes("select bricks", &sources, &bindings)
    }

    /// Brings the bricks of a choice to the GPU and lists their visible samples, unless these
    /// exceed `room`. Returns whether they were listed.
    pub fn list(
        &self,
        gpu: &Gpu,
        prepared: &mut PreparedScene,
        view: &View,
        choice: &Choice,
        room: Room,
    ) -> Result<Listed> {
        match prepared.bring_bricks(gpu, choice, room)? {
            Some(listed) => Ok(listed),
            None => self.select(gpu, prepared, view, choice, room.runs),
        }
    }

    /// Lists the samples of all used slots that can add to the picture.
    fn select(
        &self,
        gpu: &Gpu,
        prepared: &mut PreparedScene,
        view: &View,
        choice: &Choice,
        most: u64,
    ) -> Result<Listed> {
        let Some(brick_cache) = &mut prepared.brick_cache else { return Ok(Listed::All) };
        let (mut slabs, mut before, mut samples, mut runs) = (Vec::new(), 0, 0, 0);
        for chunk in &mut prepared.chunks {
            let Origin::Bricks { slab, level, .. } = &mut chunk.origin else { continue };
            let drawn = choice.levels.get(slab.part).map(|(level, _)| *level);
            *level = drawn.unwrap_or(0);
            let count = brick_cache.count(slab, drawn, &choice.first_visible);
            samples += u64::from(count);
            runs += u64::from(runs_of(count));
            brick_cache.describe(gpu, slab, drawn);
            let source = chunk.source(view, false, &prepared.page_caches);
            gpu.queue.write_buffer(&chunk.uniform, 0, bytemuck::bytes_of(&source));
            before += chunk.list_bytes();
            let Origin::Bricks { slab, .. } = &mut chunk.origin else { continue };
            slabs.push((slab.as_mut(), &chunk.uniform, count));
        }
        if runs > most {
            return Ok(Listed::TooMany { runs, most });
        }
        gpu.check_memory(prepared.bytes - before + list_bytes(samples))?;
        self.update(gpu, &mut slabs, &choice.first_visible);
        prepared.bytes -= before;
        for chunk in &mut prepared.chunks {
            let Origin::Bricks { slab, .. } = &chunk.origin else { continue };
            chunk.candidates = slab.count;
            chunk.spans = spans(gpu, slab.count);
            prepared.bytes += chunk.list_bytes();
        }
        brick_cache.set_drawn(choice);
        prepared.number_runs();
        Ok(Listed::All)
    }

    /// Makes the lists of all slabs, each with its uniform and its number of visible samples.
    /// `first_visible` is `shown` of `Choice`.
    fn update(
        &self,
        gpu: &Gpu,
        slabs: &mut [(&mut Slab, &wgpu::Buffer, u32)],
        first_visible: &[u16; 256],
    ) {
        let visible = Listing::levels(gpu, first_visible);
        // All slabs count in the same buffer, one after the other.
        let most = slabs.iter().map(|(slab, ..)| slab.blocks()).max().unwrap_or(0);
        let blocks = buffer(gpu, "select blocks", 4 * (u64::from(most) + 1), Usage::STORAGE);
        Commands::submit(gpu, "select", |commands| {
            for (slab, uniform, count) in slabs {
                slab.count = *count;
                slab.selected = buffer(gpu, "selected", 4 * u64::from(*count), Usage::STORAGE);
                if *count == 0 {
                    continue;
                }
                let buffers =
                    [uniform, &slab.ranges, &visible, &blocks, &slab.selected, &slab.slots];
                self.0.encode(gpu, commands, buffers, (&blocks, slab.blocks()));
            }
        });
    }
}
