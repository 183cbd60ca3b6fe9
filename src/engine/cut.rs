//! Cut: which nodes of a hierarchy are drawn (shaders/cut.wgsl), and how many each possible cut would draw
//! (shaders/tally.wgsl).

use super::{
    Gpu,
    nodes::NodeChunk,
    scan::Scan,
    shaders,
    stage::{Binding, Stage},
};

/// Nodes per invocation (`SELECT_RUN` in nodes.wgsl).
const SELECT_RUN: u32 = 64;
const WORKGROUP_NODES: u32 = 64 * SELECT_RUN;

/// Counters of a tally, eight an octave, the first for a cut of 2⁻⁸ pixels (tally.wgsl).
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
        use Binding::{Read, Uniform, Write};
        let stage = |label, shader, entry, own: &[Binding]| {
            let sources = [shaders::FRAME, shaders::NORMAL, shaders::NODES, shader];
            let bindings = [&[Uniform, Uniform, Read, Read, Read, Read], own].concat();
            Stage::new(gpu, label, &sources, entry, &[&bindings])
        };
        Self {
            count: stage("cut: count", shaders::CUT, "count", &[Write; 4]),
            write: stage("cut: write", shaders::CUT, "write", &[Write; 4]),
            tally: stage("tally", shaders::TALLY, "count", &[Write]),
        }
    }

    /// Encodes the making of a chunk's list.
    pub fn encode(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, scan: &Scan, chunk: &NodeChunk<'_>) {
        let own = [chunk.runs, chunk.selected, chunk.arguments, chunk.found].map(|b| b.as_entire_buffer_binding());
        let buffers = [chunk.bindings().as_slice(), &own].concat();
        let groups = chunk.capacity.div_ceil(WORKGROUP_NODES);
        self.count.dispatch(encoder, &[&self.count.bind(gpu, 0, &buffers)], groups);
        scan.encode(gpu, encoder, chunk.runs, runs_of(chunk.capacity) + 1);
        self.write.dispatch(encoder, &[&self.write.bind(gpu, 0, &buffers)], groups);
    }

    /// Encodes the counting of a chunk's nodes into `counters` ([`tally_bytes`] of them).
    pub fn encode_tally(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        chunk: &NodeChunk<'_>,
        counters: &wgpu::Buffer,
    ) {
        let buffers = [chunk.bindings().as_slice(), &[counters.as_entire_buffer_binding()]].concat();
        self.tally.dispatch(encoder, &[&self.tally.bind(gpu, 0, &buffers)], chunk.capacity.div_ceil(WORKGROUP_NODES));
    }
}

/// Runs of a chunk with room for so many nodes.
pub fn runs_of(capacity: u32) -> u32 {
    capacity.div_ceil(SELECT_RUN)
}

pub const fn tally_bytes() -> u64 {
    4 * TALLY_COUNT as u64
}

/// The finest cut, in pixels, that draws no more than `most` splats.
pub fn finest_within(tally: &[i32], most: u64) -> f64 {
    let mut drawn = 0i64;
    let counts = tally.iter().map(|difference| {
        drawn += i64::from(*difference);
        drawn
    });
    let counts: Vec<i64> = counts.collect();
    // Not all nodes of a cut get coarser together: the last that is too much decides.
    let step = counts.iter().rposition(|&count| count > most as i64).map_or(0, |last| last + 1);
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
