//! Bytes on their way from the GPU: encoded among other work, mapped once that work is submitted.
//! Nothing here waits, except [`Gpu::read`].

use crate::{Error, Result, gpu::device::Gpu};
use std::{
    future::poll_fn,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    task::{Poll, Waker},
};

/// Parts of buffers that are being copied to the CPU.
#[derive(Debug)]
pub struct Readback {
    staging: wgpu::Buffer,
    arrival: Arc<Mutex<Arrival>>,
}

#[derive(Debug, Default)]
struct Arrival {
    /// Whether the bytes can be read; `None` while they are on the way.
    mapped: Option<bool>,
    /// The task that waits for them.
    waker: Option<Waker>,
}

impl Readback {
    /// Encodes the copies of parts of buffers: a buffer, the first byte, the number of bytes. The
    /// bytes travel once the encoder is submitted.
    pub fn encode(
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        parts: &[(&wgpu::Buffer, u64, u64)],
    ) -> Self {
        let staging = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read back"),
            size: parts.iter().map(|(.., bytes)| bytes).sum(),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut at = 0;
        for &(buffer, first, bytes) in parts {
            encoder.copy_buffer_to_buffer(buffer, first, &staging, at, bytes);
            at += bytes;
        }
        let arrival = Arc::<Mutex<Arrival>>::default();
        let shared = arrival.clone();
        encoder.map_buffer_on_submit(&staging, wgpu::MapMode::Read, .., move |result| {
            let mut arrival = lock(&shared);
            arrival.mapped = Some(result.is_ok());
            if let Some(waker) = arrival.waker.take() {
                waker.wake();
            }
        });
        Self { staging, arrival }
    }

    /// Returns the bytes of all parts, one after the other, or `None` while they are on the way.
    pub fn bytes(&self, gpu: &Gpu) -> Result<Option<Vec<u8>>> {
        let mapped = lock(&self.arrival).mapped;
        match mapped {
            None => Ok(None),
            Some(true) => {
                let view = self.staging.get_mapped_range(..);
                let bytes = view.map_err(|error| Error::Driver(error.to_string()))?.to_vec();
                // A browser would keep the memory until it collects its garbage. It asks once.
                #[cfg(target_arch = "wasm32")]
                self.staging.destroy();
                Ok(Some(bytes))
            }
            Some(false) => {
                gpu.sound()?;
                let name = &gpu.info.name;
                Err(Error::DeviceLost(format!("{name} did not return the requested data")))
            }
        }
    }

    /// Waits, without blocking, until the bytes are there or will not come.
    pub async fn arrived(&self) {
        poll_fn(|context| {
            let mut arrival = lock(&self.arrival);
            if arrival.mapped.is_some() {
                return Poll::Ready(());
            }
            arrival.waker = Some(context.waker().clone());
            Poll::Pending
        })
        .await;
    }
}

fn lock(arrival: &Mutex<Arrival>) -> MutexGuard<'_, Arrival> {
    arrival.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(not(target_arch = "wasm32"))]
impl Gpu {
    /// Waits for all submitted work and returns the bytes that it was to bring back.
    pub(crate) fn receive(&self, readback: &Readback) -> Result<Vec<u8>> {
        use std::{thread, time::Instant};
        // Another thread that waits for the same device may be about to call back. A lost device
        // may never call back.
        const CALL_BACK: std::time::Duration = std::time::Duration::from_secs(10);
        self.wait()?;
        let start = Instant::now();
        loop {
            if let Some(bytes) = readback.bytes(self)? {
                return Ok(bytes);
            }
            if start.elapsed() > self.patience.min(CALL_BACK) {
                let name = &self.info.name;
                return Err(Error::DeviceLost(format!("{name} did not return the requested data")));
            }
            thread::yield_now();
            self.wait()?;
        }
    }

    /// Reads a part of a buffer back, after all earlier work.
    pub(crate) fn read(&self, buffer: &wgpu::Buffer, first: u64, bytes: u64) -> Result<Vec<u8>> {
        let mut encoder =
            self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let readback = Readback::encode(self, &mut encoder, &[(buffer, first, bytes)]);
        self.queue.submit([encoder.finish()]);
        self.receive(&readback)
    }
}
