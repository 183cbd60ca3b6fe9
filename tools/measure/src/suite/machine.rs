//! The machine that the suite ran on.

use serde_json::{Value, json};
use splatkit::Device;
use std::{fmt, num::NonZero, thread::available_parallelism};

pub struct Machine {
    adapter: String,
    driver: String,
    cores: usize,
    /// Whether the GPU's clock times passes (`true`), or waiting for each (`false`); `None` on the
    /// CPU.
    has_clock: Option<bool>,
}

impl Machine {
    pub fn of(device: &Device) -> Self {
        let cores = available_parallelism().map_or(1, NonZero::get);
        match device {
            Device::Cpu | Device::CpuFor(_) => Self {
                adapter: device.name().to_owned(),
                driver: String::new(),
                cores,
                has_clock: None,
            },
            Device::Gpu(gpu, _) => {
                let info = &gpu.info;
                let driver =
                    [info.backend.to_str(), &info.driver, &info.driver_info].map(str::trim);
                let driver: Vec<_> = driver.into_iter().filter(|part| !part.is_empty()).collect();
                let has_clock = Some(gpu.has_clock());
                Self { adapter: info.name.clone(), driver: driver.join(" "), cores, has_clock }
            }
        }
    }

    /// Returns how passes are timed.
    pub fn timing(&self) -> &'static str {
        match self.has_clock {
            None => "as they follow one another",
            Some(true) => "by the GPU's clock",
            Some(false) => "by waiting for each",
        }
    }

    pub fn json(&self) -> Value {
        json!({
            "adapter": self.adapter,
            "driver": self.driver,
            "cores": self.cores,
            "has_clock": self.has_clock,
        })
    }
}

impl fmt::Display for Machine {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        let Self { adapter, driver, cores, .. } = self;
        let driver = if driver.is_empty() { String::new() } else { format!("; {driver}") };
        write!(out, "{adapter}{driver}; {cores} cores")
    }
}
