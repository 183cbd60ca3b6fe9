//! Cut: lists the nodes of a hierarchy that are drawn (shaders/passes/cut.wgsl), and counts how
//! many nodes each possible cut would draw (shaders/passes/tally.wgsl).

use crate::gpu::{
    device::Gpu,
    passes::scan::Scan,
    pipeline::{
        commands::Commands,
        recipe::{Binding, Recipe},
        shaders,
        stage::Stage,
    },
    scene::{
        nodes::{NodeChunk, OWN_NODES, counts_of},
        slots::SLOT_NODES,
    },
};

// A workgroup visits the nodes of one slot.
const _: () = assert!(SLOT_NODES == 64 * OWN_NODES);

/// Counters of a tally: eight per octave, the first for a cut of 2⁻⁸ pixels (tally.wgsl).
const TALLY_COUNT: usize = 256;

const TALLY_STEPS: f64 = 8.0;

const TALLY_FIRST: f64 = -8.0;

/// The pass.
#[derive(Debug)]
pub struct Cut {
    count: Stage,
    write: Stage,
    tally: Stage,
}

impl Cut {
    pub fn new(gpu: &Gpu) -> Self {
        let [count, write, tally] = Stage::all(gpu, Self::recipes());
        Self { count, write, tally }
    }

    pub fn recipes() -> [Recipe; 3] {
        use Binding::{Read, Uniform, Write};
        let nodes = [Uniform, Uniform, Read, Read, Read, Read];
        let recipe = |label, shader, entry, groups: &[&[Binding]]| {
            let sources = [shaders::FRAME, shaders::NORMAL, shaders::SPLAT, shaders::NODES, shader];
            Recipe::new(label, &sources, entry, groups)
        };
        [
            recipe("cut: count", shaders::CUT, "count", &[&nodes, &[Read, Write, Write]]),
            recipe(
                "cut: write",
                shaders::CUT,
                "write",
                &[&[Uniform], &[Read, Write, Write, Write, Write]],
            ),
            recipe("tally", shaders::TALLY, "count", &[&[nodes.as_slice(), &[Write]].concat()]),
        ]
    }

    /// Encodes the commands that list a chunk's drawn nodes.
    pub fn encode(
        &self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        scan: &Scan,
        chunk: &NodeChunk<'_>,
    ) {
        let (nodes, list) = (chunk.nodes(), chunk.list());
        let groups = chunk.slots.active();
        let at_hand = groups * SLOT_NODES;
        let bound = [self.count.bind(gpu, 0, &nodes), self.count.bind(gpu, 1, &list[..3])];
        self.count.dispatch(commands, &[&bound[0], &bound[1]], groups);
        scan.encode(gpu, commands, &chunk.slots.counts, counts_of(at_hand));
        let bound = [self.write.bind(gpu, 0, &nodes[..1]), self.write.bind(gpu, 1, &list)];
        self.write.dispatch(commands, &[&bound[0], &bound[1]], groups);
    }

    /// Encodes the commands that count a chunk's nodes into `counters`, of [`tally_bytes`] bytes.
    pub fn encode_tally(
        &self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        chunk: &NodeChunk<'_>,
        counters: &wgpu::Buffer,
    ) {
        let buffers = [chunk.nodes().as_slice(), &[counters.as_entire_buffer_binding()]].concat();
        self.tally.dispatch(commands, &[&self.tally.bind(gpu, 0, &buffers)], chunk.slots.active());
    }
}

pub const fn tally_bytes() -> u64 {
    4 * TALLY_COUNT as u64
}

/// Returns the finest cut, in pixels, that draws at most `most` splats.
pub fn finest_within(tally: &[i32], most: u64) -> f64 {
    let mut drawn = 0i64;
    let counts = tally.iter().map(|difference| {
        drawn += i64::from(*difference);
        drawn
    });
    let counts: Vec<i64> = counts.collect();
    // Nodes do not all become coarser at the same cut, so the count may rise again. The last cut
    // with too many splats decides.
    let step = counts
        .iter()
        .rposition(|&count| u64::try_from(count).is_ok_and(|count| count > most))
        .map_or(0, |last| last + 1);
    2f64.powf(TALLY_FIRST + step as f64 / TALLY_STEPS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_finest_cut_within_a_budget_is_found() {
        let mut tally = [0; TALLY_COUNT];
        (tally[0], tally[64], tally[72], tally[80]) = (100, -60, -30, -5);
        assert_eq!(finest_within(&tally, 100), 2f64.powi(-8));
        assert_eq!(finest_within(&tally, 99), 1.0);
        assert_eq!(finest_within(&tally, 39), 2.0);
        assert_eq!(finest_within(&tally, 10), 2.0);
        assert_eq!(finest_within(&tally, 9), 4.0);
    }
}
