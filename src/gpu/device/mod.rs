//! The GPU device: which adapters can run the engine, how a device is opened, and its limits. The
//! submodules create buffers, keep compiled pipelines, turn a device's faults into errors, and read
//! its clock.

pub(crate) mod buffers;
pub(crate) mod fault;
pub(crate) mod pipeline_cache;
pub(crate) mod readback;
#[cfg(not(target_arch = "wasm32"))]
pub(crate) mod timestamps;

#[cfg(not(target_arch = "wasm32"))]
use crate::input::isolate::unless_panics;
use crate::{Error, Result, memory};
use fault::{Answers, Condition};
use pipeline_cache::PipelineCache;
use std::{sync::Arc, time::Duration};

/// Storage buffers that march binds if a lattice is gathered among surfaces. WebGPU promises eight.
pub const MOST_BUFFERS: u32 = 9;

/// Default time limit of a picture: a large scene takes minutes on a processor.
const PATIENCE: Duration = Duration::from_secs(600);

/// The features that a device needs for its clock.
const CLOCK: wgpu::Features =
    wgpu::Features::TIMESTAMP_QUERY.union(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS);

/// A wgpu device and queue, with the adapter's description.
#[derive(Debug, Clone)]
pub struct Gpu {
    /// The wgpu device that draws.
    pub device: wgpu::Device,
    /// The queue of the device.
    pub queue: wgpu::Queue,
    /// The adapter's name, type, backend and driver.
    pub info: Arc<wgpu::AdapterInfo>,
    pub(crate) condition: Arc<Condition>,
    pub(crate) answers: Answers,
    pub(crate) pipeline_cache: Arc<PipelineCache>,
    pub(crate) patience: Duration,
    /// Maximum bytes of memory that a scene may take.
    memory: u64,
    /// How the adapter was chosen; `None` for the device of a host application.
    choice: Option<AdapterChoice>,
}

/// Which adapter to use.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum AdapterChoice {
    /// The adapter named by the environment variable `WGPU_ADAPTER_NAME`, if that is set; otherwise
    /// the fastest: discrete, integrated, virtual, then software.
    #[default]
    Automatic,
    /// By its index in [`Gpu::adapters`].
    Index(usize),
    /// By a part of its name, ignoring case.
    Name(String),
    /// A software adapter.
    Software,
}

impl std::str::FromStr for AdapterChoice {
    type Err = std::convert::Infallible;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(match text.parse() {
            Ok(index) => Self::Index(index),
            Err(_) if text.eq_ignore_ascii_case("software") => Self::Software,
            Err(_) => Self::Name(text.to_owned()),
        })
    }
}

/// What the user can do if no adapter is found.
#[cfg(not(target_arch = "wasm32"))]
const NO_ADAPTER_HELP: &str = "install a Vulkan driver; without a GPU, use the CPU engine, which \
    draws the same pictures, or Mesa's software driver (Debian and Ubuntu: apt-get install \
    mesa-vulkan-drivers libvulkan1)";
#[cfg(target_arch = "wasm32")]
const NO_ADAPTER_HELP: &str = "this browser has no WebGPU for this machine; use the CPU engine, \
    which draws the same pictures";

fn instance() -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
    // wgpu turns its debug layers on in debug builds; environment variables override that.
    // The engine's own dispatches never exceed the limits (`rows_of` in frame.wgsl), so wgpu need
    // not look at their numbers of workgroups in a dispatch of its own before each.
    let flags = wgpu::InstanceFlags::default() - wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL;
    descriptor.flags = flags.with_env();
    wgpu::Instance::new(descriptor)
}

/// Returns the rank of an adapter: fastest first, software last.
fn rank(info: &wgpu::AdapterInfo) -> u8 {
    match info.device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    }
}

/// What the shaders need beside eight storage buffers.
const SHADERS_NEED: wgpu::DownlevelFlags =
    wgpu::DownlevelFlags::COMPUTE_SHADERS.union(wgpu::DownlevelFlags::SHADER_F16_IN_F32);

async fn usable_adapters() -> Vec<wgpu::Adapter> {
    let mut adapters = instance().enumerate_adapters(wgpu::Backends::all()).await;
    adapters.retain(|a| {
        a.get_downlevel_capabilities().flags.contains(SHADERS_NEED)
            && a.limits().max_storage_buffers_per_shader_stage >= 8
    });
    adapters.sort_by_key(|a| rank(&a.get_info()));
    adapters
}

/// The beginnings of the names that Linux gives to files of GPUs: those of drivers in the kernel,
/// of NVIDIA's, of Windows behind it, and of phones and small boards.
const GPU_FILES: [&str; 6] = ["dri", "nvidia", "dxg", "kgsl", "mali", "nvhost"];

/// Returns whether a folder of devices has a GPU's file. Without one, there can only be software
/// adapters. To ask the drivers takes a tenth of a second, because each of them is loaded.
#[cfg(not(target_arch = "wasm32"))]
fn has_gpu(devices: &std::path::Path) -> bool {
    let Ok(entries) = std::fs::read_dir(devices) else { return true };
    entries.flatten().any(|entry| {
        let name = entry.file_name();
        GPU_FILES.iter().any(|file| name.to_string_lossy().starts_with(file))
    })
}

impl Gpu {
    /// Returns the adapters that can run the engine, fastest first, with their limits.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn adapters() -> Vec<(wgpu::AdapterInfo, wgpu::Limits)> {
        pollster::block_on(usable_adapters()).iter().map(|a| (a.get_info(), a.limits())).collect()
    }

    /// Opens the fastest adapter that does not run on the processor, or the adapter named by the
    /// environment variable `WGPU_ADAPTER_NAME`. Returns `None` if there is none or it cannot be
    /// opened.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn hardware() -> Option<Self> {
        let is_named = std::env::var("WGPU_ADAPTER_NAME").is_ok_and(|name| !name.is_empty());
        if !is_named && cfg!(target_os = "linux") && !has_gpu("/dev".as_ref()) {
            return None;
        }
        let gpu = Self::headless(&AdapterChoice::Automatic).ok()?;
        (is_named || !gpu.is_software()).then_some(gpu)
    }

    /// Opens a device without a window, and waits for it.
    ///
    /// # Errors
    /// Those of [`Self::request`]; [`Error::Driver`] if the driver gives up, as without memory.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn headless(choice: &AdapterChoice) -> Result<Self> {
        unless_panics(|| pollster::block_on(Self::request(choice)))
            .unwrap_or_else(|panic| Err(Error::Driver(format!("it cannot be opened: {panic}"))))
    }

    /// Opens a device without a window. Nothing blocks, so that a browser can await it.
    ///
    /// # Errors
    /// [`Error::NoAdapter`] if there is no adapter, or none that matches `choice`. The message says
    /// what to install.
    pub async fn request(choice: &AdapterChoice) -> Result<Self> {
        let mut adapters = usable_adapters().await;
        let names = || adapters.iter().map(|a| a.get_info().name).collect::<Vec<_>>().join(", ");
        let by_name = |part: &str| {
            let part = part.to_lowercase();
            adapters.iter().position(|a| a.get_info().name.to_lowercase().contains(&part))
        };
        if adapters.is_empty() {
            return Err(Error::NoAdapter(format!("no adapter was found; {NO_ADAPTER_HELP}")));
        }
        let wanted = match choice {
            AdapterChoice::Automatic => match std::env::var("WGPU_ADAPTER_NAME") {
                Ok(name) if !name.is_empty() => {
                    (by_name(&name), format!("named “{name}” (WGPU_ADAPTER_NAME)"))
                }
                _ => (Some(0), String::new()),
            },
            AdapterChoice::Index(index) => {
                (Some(*index).filter(|&i| i < adapters.len()), format!("number {index}"))
            }
            AdapterChoice::Name(name) => (by_name(name), format!("named “{name}”")),
            AdapterChoice::Software => {
                let index =
                    adapters.iter().position(|a| a.get_info().device_type == wgpu::DeviceType::Cpu);
                (index, format!("that runs in software; {NO_ADAPTER_HELP}"))
            }
        };
        let Some(index) = wanted.0 else {
            return Err(Error::NoAdapter(format!(
                "there is no adapter {}; found: {}",
                wanted.1,
                names()
            )));
        };
        let gpu = Self::open(&adapters.swap_remove(index)).await?;
        gpu.condition.listen(&gpu.device);
        Ok(Self { choice: Some(choice.clone()), ..gpu })
    }

    /// Opens a device in the way that this one was opened, after it was lost
    /// ([`Error::DeviceLost`]). Renderers and scenes must be prepared again on the new device.
    ///
    /// # Errors
    /// Those of [`Self::headless`]; [`Error::Argument`] for the device of a host application, which
    /// only the host can reopen.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn reopened(&self) -> Result<Self> {
        let Some(choice) = &self.choice else {
            return Err(Error::Argument(
                "the device belongs to the host application, which must reopen it".into(),
            ));
        };
        Ok(Self { patience: self.patience, memory: self.memory, ..Self::headless(choice)? })
    }

    /// Returns the same device with a time limit. The default is ten minutes. A picture that takes
    /// longer is an error. A device that does not finish one submission in that time counts as
    /// lost.
    #[must_use]
    pub fn with_patience(self, patience: Duration) -> Self {
        Self { patience, ..self }
    }

    /// Returns the same device with a limit, in bytes, on the memory of a scene and the lists made
    /// from it. What exceeds the limit is refused before it is allocated. If the adapter runs on
    /// the processor, it uses the machine's memory, and the default limit is [`memory::most`].
    /// Other adapters have no default limit: the device itself reports that memory ran out.
    #[must_use]
    pub fn with_memory(self, memory: u64) -> Self {
        Self { memory, ..self }
    }

    /// Returns how many more bytes may be taken if `taken` bytes are.
    pub(crate) fn memory_left(&self, taken: u64) -> u64 {
        self.memory.saturating_sub(taken)
    }

    /// Returns an error if `bytes` exceed the memory limit.
    pub(crate) fn check_memory(&self, bytes: u64) -> Result<()> {
        if bytes <= self.memory {
            return Ok(());
        }
        Err(Error::MemoryBound {
            adapter: self.info.name.clone(),
            needed: bytes,
            limit: self.memory,
        })
    }

    async fn open(adapter: &wgpu::Adapter) -> Result<Self> {
        // The engine is built for WebGPU's default limits. Larger bindings only save passes. With a
        // ninth storage buffer, a volume among surfaces can be gathered.
        let buffers = adapter.limits().max_storage_buffers_per_shader_stage.clamp(8, MOST_BUFFERS);
        let limits = wgpu::Limits {
            max_storage_buffers_per_shader_stage: buffers,
            max_storage_buffer_binding_size: adapter.limits().max_storage_buffer_binding_size,
            max_buffer_size: adapter.limits().max_buffer_size,
            ..wgpu::Limits::default()
        };
        let features = adapter.features() & CLOCK;
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("splatkit"),
            required_features: features,
            required_limits: limits,
            ..Default::default()
        };
        let (device, queue) = adapter.request_device(&descriptor).await.map_err(|e| {
            Error::NoAdapter(format!("{} cannot be opened: {e}", adapter.get_info().name))
        })?;
        let mut info = adapter.get_info();
        if info.name.is_empty() {
            // Browsers keep the names of adapters to themselves.
            info.name = "WebGPU".into();
        }
        Ok(Self::from_wgpu(device, queue, info))
    }

    /// Uses a device that the host application owns. It must keep WebGPU's default limits. Call
    /// this once per device: resources created through this `Gpu` or its clones can't be used with
    /// another `Gpu`. Errors caused by the engine are returned by the engine; the host's own error
    /// scopes and callbacks still see the host's errors only.
    pub fn from_wgpu(device: wgpu::Device, queue: wgpu::Queue, info: wgpu::AdapterInfo) -> Self {
        let on_processor = info.device_type == wgpu::DeviceType::Cpu;
        let memory = memory::most().filter(|_| on_processor).unwrap_or(u64::MAX);
        Self {
            device,
            queue,
            info: Arc::new(info),
            condition: Arc::default(),
            answers: Answers::default(),
            pipeline_cache: Arc::default(),
            patience: PATIENCE,
            memory,
            choice: None,
        }
    }

    /// Whether the other is a clone of this one. wgpu's own comparison may find devices of two
    /// instances equal.
    pub(crate) fn is(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.condition, &other.condition)
    }

    /// Whether the adapter runs on the processor. If so, fewer and wider invocations draw a tile.
    pub fn is_software(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// Whether the times of [`Renderer::profile`](crate::gpu::Renderer::profile) come from the
    /// GPU's own clock.
    pub fn has_clock(&self) -> bool {
        self.device.features().contains(CLOCK)
    }

    /// Returns the maximum size of a storage binding in bytes, as a multiple of 256.
    pub fn binding_size(&self) -> u64 {
        let limits = self.device.limits();
        (limits.max_storage_buffer_binding_size).min(limits.max_buffer_size) / 256 * 256
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::testing::Folder;

    #[test]
    fn gpus_have_files() {
        let folder = Folder::new();
        let devices = folder.path("");
        folder.write("null", b"");
        folder.write("random", b"");
        assert!(!has_gpu(&devices));
        // What cannot be read says nothing.
        assert!(has_gpu(&folder.path("missing")));
        folder.write("nvidiactl", b"");
        assert!(has_gpu(&devices));
    }
}
