//! The GPU's own clock, read between the steps of a frame.

use crate::{
    Result,
    gpu::device::{Gpu, buffers::buffer},
};

/// Timestamps in a submission, one before the first step and one after each.
pub struct Timestamps {
    marks: wgpu::QuerySet,
    count: u32,
}

impl Timestamps {
    /// Allocates the timestamps around this number of steps. Returns `None` on devices without a
    /// clock ([`Gpu::has_clock`]).
    pub fn new(gpu: &Gpu, steps: usize) -> Option<Self> {
        if !gpu.has_clock() {
            return None;
        }
        let count = u32::try_from(steps).ok()? + 1;
        let marks = gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
            label: Some("timestamps"),
            ty: wgpu::QueryType::Timestamp,
            count,
        });
        Some(Self { marks, count })
    }

    /// Writes timestamp number `index`.
    pub fn mark(&self, encoder: &mut wgpu::CommandEncoder, index: u32) {
        encoder.write_timestamp(&self.marks, index);
    }

    /// Submits the encoded work and waits for it. Returns the milliseconds between each timestamp
    /// and the next.
    pub fn finish(self, gpu: &Gpu, mut encoder: wgpu::CommandEncoder) -> Result<Vec<f64>> {
        let bytes = u64::from(self.count) * u64::from(wgpu::QUERY_SIZE);
        let usage = wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC;
        let resolved = buffer(gpu, "timestamps", bytes, usage);
        encoder.resolve_query_set(&self.marks, 0..self.count, &resolved, 0);
        gpu.queue.submit([encoder.finish()]);
        let ticks: Vec<u64> = bytemuck::pod_collect_to_vec(&gpu.read(&resolved, 0, bytes)?);
        let period = f64::from(gpu.queue.get_timestamp_period()) * 1e-6;
        // The clocks of some drivers step back when a device changes its speed.
        Ok(ticks.windows(2).map(|pair| pair[1].saturating_sub(pair[0]) as f64 * period).collect())
    }
}
