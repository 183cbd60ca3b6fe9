//! The commands of a frame. Dispatches share one compute pass until a copy comes between them:
//! beginning a pass for each would take the processor longer than all the rest of a dispatch.

use crate::gpu::device::Gpu;

/// Commands that are being encoded.
#[derive(Debug)]
pub struct Commands<'a> {
    encoder: &'a mut wgpu::CommandEncoder,
    pass: Option<wgpu::ComputePass<'static>>,
}

impl<'a> Commands<'a> {
    pub fn new(encoder: &'a mut wgpu::CommandEncoder) -> Self {
        Self { encoder, pass: None }
    }

    /// Submits some work on its own.
    pub fn submit(gpu: &Gpu, label: &str, work: impl FnOnce(&mut Commands<'_>)) {
        let descriptor = wgpu::CommandEncoderDescriptor { label: Some(label) };
        let mut encoder = gpu.device.create_command_encoder(&descriptor);
        work(&mut Commands::new(&mut encoder));
        gpu.queue.submit([encoder.finish()]);
    }

    /// Returns the compute pass for the next dispatch.
    pub fn pass(&mut self) -> &mut wgpu::ComputePass<'static> {
        self.pass.get_or_insert_with(|| {
            let descriptor =
                wgpu::ComputePassDescriptor { label: Some("frame"), timestamp_writes: None };
            self.encoder.begin_compute_pass(&descriptor).forget_lifetime()
        })
    }

    /// Ends the compute pass, and returns the encoder for other commands.
    pub fn encoder(&mut self) -> &mut wgpu::CommandEncoder {
        self.pass = None;
        self.encoder
    }

    /// Fills a buffer with zeros.
    pub fn clear(&mut self, buffer: &wgpu::Buffer) {
        self.encoder().clear_buffer(buffer, 0, None);
    }
}
