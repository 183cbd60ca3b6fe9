//! What the suite ran on.

use serde_json::{Value, json};
use splatkit::engine::Gpu;
use std::{fmt, num::NonZero, thread::available_parallelism};

pub struct Machine {
    adapter: String,
    driver: String,
    cores: usize,
    /// Passes are timed by the GPU's clock; else by waiting for each.
    has_clock: bool,
}

impl Machine {
    pub fn of(gpu: &Gpu) -> Self {
        let info = &gpu.info;
        let driver = [info.backend.to_str(), &info.driver, &info.driver_info].map(str::trim);
        let driver: Vec<_> = driver.into_iter().filter(|part| !part.is_empty()).collect();
        let cores = available_parallelism().map_or(1, NonZero::get);
        Self { adapter: info.name.clone(), driver: driver.join(" "), cores, has_clock: gpu.has_clock() }
    }

    /// How passes are timed.
    pub fn timing(&self) -> &'static str {
        if self.has_clock { "by the GPU's clock" } else { "by waiting for each" }
    }

    pub fn json(&self) -> Value {
        json!({ "adapter": self.adapter, "driver": self.driver, "cores": self.cores, "has_clock": self.has_clock })
    }
}

impl fmt::Display for Machine {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        let Self { adapter, driver, cores, .. } = self;
        write!(out, "{adapter}; {driver}; {cores} cores")
    }
}
