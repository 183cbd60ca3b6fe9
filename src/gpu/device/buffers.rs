//! Making buffers.

use crate::gpu::device::Gpu;

/// An empty buffer; its size is rounded up to what every binding takes.
pub fn buffer(gpu: &Gpu, label: &str, bytes: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: bytes.max(16).next_multiple_of(16),
        usage: usage | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// A buffer that holds some bytes, padded with zeros to what every binding takes.
pub fn filled_buffer(
    gpu: &Gpu,
    label: &str,
    bytes: &[u8],
    usage: wgpu::BufferUsages,
) -> wgpu::Buffer {
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: (bytes.len() as u64).max(16).next_multiple_of(16),
        usage,
        mapped_at_creation: true,
    });
    // Without memory for it there is nothing to fill; the device has told so (see fault.rs).
    if let Ok(mut mapped) = buffer.get_mapped_range_mut(..) {
        mapped.slice(..bytes.len()).copy_from_slice(bytes);
        drop(mapped);
        buffer.unmap();
    }
    buffer
}

/// A read-only storage buffer of some bytes.
pub fn upload(gpu: &Gpu, label: &str, bytes: &[u8]) -> wgpu::Buffer {
    filled_buffer(gpu, label, bytes, wgpu::BufferUsages::STORAGE)
}
