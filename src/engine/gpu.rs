//! The device: adapters, their limits, and the errors of both.

use super::timestamps;
use crate::{Error, Result};
use std::sync::{Arc, Mutex, PoisonError};

/// A wgpu device and queue, with the adapter's description.
#[derive(Debug, Clone)]
pub struct Gpu {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    pub info: Arc<wgpu::AdapterInfo>,
    /// The first error that the device reported outside of a call, memory that ran out above all.
    fault: Arc<Mutex<Option<String>>>,
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
const NO_ADAPTER_HELP: &str = "install a Vulkan driver; without a GPU, Mesa's software driver serves \
    (Debian and Ubuntu: apt-get install mesa-vulkan-drivers libvulkan1)";

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
        flags.contains(wgpu::DownlevelFlags::COMPUTE_SHADERS) && a.limits().max_storage_buffers_per_shader_stage >= 8
    });
    adapters.sort_by_key(|a| rank(&a.get_info()));
    adapters
}

impl Gpu {
    /// The adapters that can run the engine, fastest first, with their limits.
    pub fn adapters() -> Vec<(wgpu::AdapterInfo, wgpu::Limits)> {
        usable_adapters().iter().map(|a| (a.get_info(), a.limits())).collect()
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
                Ok(name) if !name.is_empty() => (by_name(&name), format!("named “{name}” (WGPU_ADAPTER_NAME)")),
                _ => (Some(0), String::new()),
            },
            AdapterChoice::Index(index) => (Some(*index).filter(|&i| i < adapters.len()), format!("number {index}")),
            AdapterChoice::Name(name) => (by_name(name), format!("named “{name}”")),
            AdapterChoice::Software => {
                let found = adapters.iter().position(|a| a.get_info().device_type == wgpu::DeviceType::Cpu);
                (found, format!("in software; {NO_ADAPTER_HELP}"))
            }
        };
        let Some(index) = wanted.0 else {
            return Err(Error::NoAdapter(format!("there is no adapter {}; found: {}", wanted.1, names())));
        };
        Self::open(&adapters.swap_remove(index))
    }

    fn open(adapter: &wgpu::Adapter) -> Result<Self> {
        // WebGPU's defaults are what the engine is built for; larger bindings only save passes.
        let limits = wgpu::Limits {
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
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|e| Error::NoAdapter(format!("{} cannot be opened: {e}", adapter.get_info().name)))?;
        let gpu = Self::from_wgpu(device, queue, adapter.get_info());
        let fault = gpu.fault.clone();
        // Without a handler wgpu ends the program where memory runs out.
        gpu.device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            fault.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert_with(|| error.to_string());
        }));
        Ok(gpu)
    }

    /// Takes the device of a host application. It must keep WebGPU's default limits, and its errors go to the host's own
    /// handler.
    pub fn from_wgpu(device: wgpu::Device, queue: wgpu::Queue, info: wgpu::AdapterInfo) -> Self {
        Self { device, queue, info: Arc::new(info), fault: Arc::default() }
    }

    /// Whether the adapter runs on the processor. Tiles are then walked by fewer, wider invocations.
    pub fn is_software(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// Whether the times of [`Renderer::profile`](super::Renderer::profile) are the GPU's own.
    pub fn has_clock(&self) -> bool {
        self.device.features().contains(timestamps::FEATURES)
    }

    /// The most bytes that one storage binding holds, as a multiple of 256.
    pub fn binding_size(&self) -> u64 {
        let limits = self.device.limits();
        (limits.max_storage_buffer_binding_size).min(limits.max_buffer_size) / 256 * 256
    }

    /// Waits until the device has done all that was submitted.
    ///
    /// # Errors
    /// [`Error::Gpu`] where the device is lost, or reported an error since the last time.
    pub fn wait(&self) -> Result<()> {
        let name = &self.info.name;
        if let Err(error) = self.device.poll(wgpu::PollType::wait_indefinitely()) {
            return Err(Error::Gpu(format!("{name} stopped answering: {error}")));
        }
        match self.fault.lock().unwrap_or_else(PoisonError::into_inner).take() {
            None => Ok(()),
            Some(fault) => Err(Error::Gpu(format!("{name}: {fault}"))),
        }
    }

    /// Reads a part of a buffer back, when the device has done all before.
    pub(super) fn read(&self, buffer: &wgpu::Buffer, offset: u64, bytes: u64) -> Result<Vec<u8>> {
        let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read back"),
            size: bytes,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(buffer, offset, &staging, 0, bytes);
        self.queue.submit([encoder.finish()]);
        let (sender, receiver) = std::sync::mpsc::channel();
        // The receiver outlives the callback: it is waited for below.
        staging.map_async(wgpu::MapMode::Read, .., move |result| drop(sender.send(result)));
        self.wait()?;
        match receiver.recv() {
            Ok(Ok(())) => {}
            _ => return Err(Error::Gpu(format!("what was drawn could not be read back from {}", self.info.name))),
        }
        let view = staging.get_mapped_range(..).map_err(|e| Error::Gpu(e.to_string()))?;
        Ok(view.to_vec())
    }
}
