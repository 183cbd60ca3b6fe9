//! Scan: exclusive prefix sums in place (shaders/passes/scan.wgsl).

use crate::gpu::{
    budget::SCAN_CAPACITY,
    device::{
        Gpu,
        buffers::{buffer, filled_buffer},
    },
    pipeline::{
        commands::Commands,
        recipe::{Binding, Recipe},
        shaders,
        stage::Stage,
    },
};

/// Numbers per invocation (`SEGMENT` in scan.wgsl).
const SEGMENT: u32 = 64;

/// The pass, with a buffer for the sums of its segments, which its clones share.
#[derive(Debug, Clone)]
pub struct Scan {
    sum: Stage,
    spine: Stage,
    spread: Stage,
    segments: wgpu::Buffer,
}

impl Scan {
    pub fn new(gpu: &Gpu) -> Self {
        let [sum, spine, spread] = Stage::all(gpu, Self::recipes());
        Self {
            sum,
            spine,
            spread,
            segments: buffer(
                gpu,
                "scan segments",
                4 * u64::from(SCAN_CAPACITY / SEGMENT),
                wgpu::BufferUsages::STORAGE,
            ),
        }
    }

    pub fn recipes() -> [Recipe; 3] {
        let recipe = |label, entry| {
            let bindings = [Binding::Uniform, Binding::Write, Binding::Write];
            Recipe::new(label, &[shaders::SCAN], entry, &[&bindings])
        };
        [
            recipe("scan: sum", "sum"),
            recipe("scan: spine", "spine"),
            recipe("scan: spread", "spread"),
        ]
    }

    /// Replaces each number with the sum of those before it. `size` contains the number of
    /// elements, and the indirect dispatch `arguments` covers their segments.
    pub fn encode_indirect(
        &self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        numbers: &wgpu::Buffer,
        size: &wgpu::Buffer,
        arguments: (&wgpu::Buffer, u64),
    ) {
        let buffers = [size, numbers, &self.segments].map(|b| b.as_entire_buffer_binding());
        self.sum.dispatch_indirect(commands, &[&self.sum.bind(gpu, 0, &buffers)], arguments);
        self.spine.dispatch(commands, &[&self.spine.bind(gpu, 0, &buffers)], 1);
        self.spread.dispatch_indirect(commands, &[&self.spread.bind(gpu, 0, &buffers)], arguments);
    }

    /// Replaces each of the first `count` numbers with the sum of those before it.
    pub fn encode(
        &self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        numbers: &wgpu::Buffer,
        count: u32,
    ) {
        let size = [count, 0, 0, 0];
        let size =
            filled_buffer(gpu, "scan size", bytemuck::bytes_of(&size), wgpu::BufferUsages::UNIFORM);
        self.encode_sized(gpu, commands, numbers, (&size, count));
    }

    /// The same, with `count` in a uniform buffer too.
    pub fn encode_sized(
        &self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        numbers: &wgpu::Buffer,
        (size, count): (&wgpu::Buffer, u32),
    ) {
        debug_assert!(count <= SCAN_CAPACITY);
        let buffers = [size, numbers, &self.segments].map(|b| b.as_entire_buffer_binding());
        let groups = count.div_ceil(SEGMENT * 64);
        self.sum.dispatch(commands, &[&self.sum.bind(gpu, 0, &buffers)], groups);
        self.spine.dispatch(commands, &[&self.spine.bind(gpu, 0, &buffers)], 1);
        self.spread.dispatch(commands, &[&self.spread.bind(gpu, 0, &buffers)], groups);
    }
}
