//! The device that draws.

#[cfg(feature = "gpu")]
use crate::gpu::{Budget, Gpu};

/// The device that draws.
#[derive(Debug, Clone)]
pub enum Device {
    /// The GPU engine on wgpu, with the capacity of its passes. Needs the feature `gpu`.
    #[cfg(feature = "gpu")]
    Gpu(Gpu, Budget),
    /// The CPU engine. It needs no driver.
    Cpu,
    /// The CPU engine, for a host application with a device of its own: frames are uploaded to the
    /// host's textures ([`Renderer::encode`](crate::Renderer::encode)). Needs the feature `gpu`.
    #[cfg(feature = "gpu")]
    CpuFor(Gpu),
}

impl Device {
    /// Returns the fastest hardware adapter, or the CPU if there is none. The CPU engine is faster
    /// than a GPU driver that runs on the processor. `WGPU_ADAPTER_NAME` can name another adapter
    /// ([`Gpu::hardware`](crate::gpu::Gpu::hardware)). Without the feature `gpu`, and in a browser,
    /// where opening a device cannot wait, this is the CPU.
    pub fn automatic() -> Self {
        #[cfg(all(feature = "gpu", not(target_arch = "wasm32")))]
        if let Some(gpu) = Gpu::hardware() {
            return Self::Gpu(gpu, Budget::default());
        }
        Self::Cpu
    }

    /// Returns the engine for a host's device: the GPU engine, but the CPU engine for a driver that
    /// runs on the processor, where it is faster.
    #[cfg(feature = "gpu")]
    pub fn of_host(gpu: &Gpu) -> Self {
        match gpu.is_software() {
            true => Self::CpuFor(gpu.clone()),
            false => Self::Gpu(gpu.clone(), Budget::default()),
        }
    }

    /// Returns the adapter's name, or “CPU”.
    pub fn name(&self) -> &str {
        match self {
            #[cfg(feature = "gpu")]
            Self::Gpu(gpu, _) => &gpu.info.name,
            Self::Cpu => "CPU",
            #[cfg(feature = "gpu")]
            Self::CpuFor(_) => "CPU",
        }
    }
}
