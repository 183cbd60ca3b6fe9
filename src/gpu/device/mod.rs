//! The device: adapters and their limits.

pub(crate) mod buffers;
pub(crate) mod fault;
pub(crate) mod timestamps;

use crate::{Error, Result, memory};
use fault::Condition;
use std::{sync::Arc, time::Duration};

/// Storage buffers that march binds beside a lattice that is gathered. WebGPU promises eight.
pub const MOST_BUFFERS: u32 = 9;

/// How long a picture may take by default: a large scene takes minutes on a processor.
const PATIENCE: Duration = Duration::from_secs(600);

/// A wgpu device and queue, with the adapter's description.
#[derive(Debug, Clone)]
pub struct Gpu {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    pub info: Arc<wgpu::AdapterInfo>,
    pub(crate) condition: Arc<Condition>,
    pub(crate) patience: Duration,
    /// The most bytes of memory that a scene may take.
    memory: u64,
    /// How it was found; a host's device was not.
    choice: Option<AdapterChoice>,
}

/// Which adapter to take.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum AdapterChoice {
    /// The environment's `WGPU_ADAPTER_NAME` if set, else the fastest: discrete, integrated, virtual, then software.
    #[default]
    Automatic,
    /// By its place in [`Gpu::adapters`].
    Index(usize),
    /// By a part of its name, in any case.
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

/// What the user can do where no adapter is found.
const NO_ADAPTER_HELP: &str = "install a Vulkan driver; without a GPU, the CPU engine draws the same pictures, and Mesa's \
    software driver serves too (Debian and Ubuntu: apt-get install mesa-vulkan-drivers libvulkan1)";

fn instance() -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
    // The debug layers that wgpu turns on in debug builds are a developer's choice, not a default.
    descriptor.flags = wgpu::InstanceFlags::from_env_or_default();
    wgpu::Instance::new(descriptor)
}

/// Fastest first; software last.
fn rank(info: &wgpu::AdapterInfo) -> u8 {
    match info.device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    }
}

fn usable_adapters() -> Vec<wgpu::Adapter> {
    let mut adapters = pollster::block_on(instance().enumerate_adapters(wgpu::Backends::all()));
    // One that lacks compute shaders, or storage buffers in them, cannot run the engine.
    adapters.retain(|a| {
        let flags = a.get_downlevel_capabilities().flags;
        flags.contains(wgpu::DownlevelFlags::COMPUTE_SHADERS)
            && a.limits().max_storage_buffers_per_shader_stage >= 8
    });
    adapters.sort_by_key(|a| rank(&a.get_info()));
    adapters
}

impl Gpu {
    /// The adapters that can run the engine, fastest first, with their limits.
    pub fn adapters() -> Vec<(wgpu::AdapterInfo, wgpu::Limits)> {
        usable_adapters().iter().map(|a| (a.get_info(), a.limits())).collect()
    }

    /// Opens the fastest adapter that does not run on the processor, or the one that the environment's `WGPU_ADAPTER_NAME`
    /// names; none where there is none or it cannot be opened.
    pub fn hardware() -> Option<Self> {
        let is_named = std::env::var("WGPU_ADAPTER_NAME").is_ok_and(|name| !name.is_empty());
        let gpu = Self::headless(&AdapterChoice::Automatic).ok()?;
        (is_named || !gpu.is_software()).then_some(gpu)
    }

    /// Opens a device without a window.
    ///
    /// # Errors
    /// [`Error::NoAdapter`] where there is none (or none of that name), with what to install.
    pub fn headless(choice: &AdapterChoice) -> Result<Self> {
        let mut adapters = usable_adapters();
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
                let found =
                    adapters.iter().position(|a| a.get_info().device_type == wgpu::DeviceType::Cpu);
                (found, format!("in software; {NO_ADAPTER_HELP}"))
            }
        };
        let Some(index) = wanted.0 else {
            return Err(Error::NoAdapter(format!(
                "there is no adapter {}; found: {}",
                wanted.1,
                names()
            )));
        };
        let gpu = Self::open(&adapters.swap_remove(index))?;
        gpu.condition.listen(&gpu.device);
        Ok(Self { choice: Some(choice.clone()), ..gpu })
    }

    /// Opens a device as this one was opened: what to do where it was lost ([`Error::DeviceLost`]). Renderers and scenes are
    /// prepared anew on it.
    ///
    /// # Errors
    /// As of [`Self::headless`]; [`Error::Argument`] for the device of a host application, which is the host's to open.
    pub fn reopened(&self) -> Result<Self> {
        let Some(choice) = &self.choice else {
            return Err(Error::Argument(
                "the device is the host's; it has to be opened there".into(),
            ));
        };
        Ok(Self { patience: self.patience, memory: self.memory, ..Self::headless(choice)? })
    }

    /// The same device with a time limit, ten minutes by default. A picture that takes longer is an error. A device that does not
    /// finish one submission in that time counts as lost.
    #[must_use]
    pub fn with_patience(self, patience: Duration) -> Self {
        Self { patience, ..self }
    }

    /// The same device, on which a scene and the lists made of it may take so many bytes of memory: what takes more is refused
    /// before it is there. By default what [`memory::most`] tells where the adapter runs on the processor, whose memory is the
    /// machine's; elsewhere the device itself says what is too much.
    #[must_use]
    pub fn with_memory(self, memory: u64) -> Self {
        Self { memory, ..self }
    }

    /// How much more may be taken where so many bytes are.
    pub(crate) fn memory_left(&self, taken: u64) -> u64 {
        self.memory.saturating_sub(taken)
    }

    /// Refuses what would take more memory than there is to take.
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

    fn open(adapter: &wgpu::Adapter) -> Result<Self> {
        // WebGPU's defaults are what the engine is built for; larger bindings only save passes, and with two more of them a volume
        // among surfaces can be gathered.
        let buffers = adapter.limits().max_storage_buffers_per_shader_stage.clamp(8, MOST_BUFFERS);
        let limits = wgpu::Limits {
            max_storage_buffers_per_shader_stage: buffers,
            max_storage_buffer_binding_size: adapter.limits().max_storage_buffer_binding_size,
            max_buffer_size: adapter.limits().max_buffer_size,
            ..wgpu::Limits::default()
        };
        let features = adapter.features() & timestamps::FEATURES;
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("splatkit"),
            required_features: features,
            required_limits: limits,
            ..Default::default()
        };
        let (device, queue) =
            pollster::block_on(adapter.request_device(&descriptor)).map_err(|e| {
                Error::NoAdapter(format!("{} cannot be opened: {e}", adapter.get_info().name))
            })?;
        Ok(Self::from_wgpu(device, queue, adapter.get_info()))
    }

    /// Takes the device of a host application, once: what is made with one `Gpu` goes with it and its clones. It must keep WebGPU's default limits. What goes wrong while the engine works is
    /// the engine's error; what the host hears of is its own.
    pub fn from_wgpu(device: wgpu::Device, queue: wgpu::Queue, info: wgpu::AdapterInfo) -> Self {
        let on_processor = info.device_type == wgpu::DeviceType::Cpu;
        let memory = memory::most().filter(|_| on_processor).unwrap_or(u64::MAX);
        Self {
            device,
            queue,
            info: Arc::new(info),
            condition: Arc::default(),
            patience: PATIENCE,
            memory,
            choice: None,
        }
    }

    /// Whether the other is a clone of this one. What wgpu compares devices by may be the same in two instances of it.
    pub(crate) fn is(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.condition, &other.condition)
    }

    /// Whether the adapter runs on the processor. Tiles are then walked by fewer, wider invocations.
    pub fn is_software(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// Whether the times of [`Renderer::profile`](crate::gpu::Renderer::profile) are the GPU's own.
    pub fn has_clock(&self) -> bool {
        self.device.features().contains(timestamps::FEATURES)
    }

    /// The most bytes that one storage binding holds, as a multiple of 256.
    pub fn binding_size(&self) -> u64 {
        let limits = self.device.limits();
        (limits.max_storage_buffer_binding_size).min(limits.max_buffer_size) / 256 * 256
    }
}
