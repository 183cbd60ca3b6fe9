//! Creates buffers.

use crate::gpu::device::Gpu;

/// Returns an empty buffer. Its size is rounded up to a multiple of 16 bytes, which suits every
/// binding.
pub fn buffer(gpu: &Gpu, label: &str, bytes: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: bytes.max(16).next_multiple_of(16),
        usage: usage | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// Returns a buffer that contains these bytes, padded with zeros to a size that suits every
/// binding.
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
    // If there is no memory for the buffer, there is nothing to fill, and the device has reported
    // the error (see fault.rs).
    if let Ok(mut mapped) = buffer.get_mapped_range_mut(..) {
        mapped.slice(..bytes.len()).copy_from_slice(bytes);
        drop(mapped);
        buffer.unmap();
    }
    buffer
}

/// Returns a read-only storage buffer that contains these bytes.
pub fn upload(gpu: &Gpu, label: &str, bytes: &[u8]) -> wgpu::Buffer {
    filled_buffer(gpu, label, bytes, wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST)
}
