//! What the suite ran on.

use serde_json::{Value, json};
use splatkit::engine::Gpu;
use std::{fmt, num::NonZero, thread::available_parallelism};

pub struct Machine {
    adapter: String,
    driver: String,
    cores: usize,
}

impl Machine {
    pub fn of(gpu: &Gpu) -> Self {
        let info = &gpu.info;
        let driver = [info.backend.to_str(), &info.driver, &info.driver_info].map(str::trim);
        let driver: Vec<_> = driver.into_iter().filter(|part| !part.is_empty()).collect();
        let cores = available_parallelism().map_or(1, NonZero::get);
        Self { adapter: info.name.clone(), driver: driver.join(" "), cores }
    }

    pub fn json(&self) -> Value {
        json!({ "adapter": self.adapter, "driver": self.driver, "cores": self.cores })
    }
}

impl fmt::Display for Machine {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        let Self { adapter, driver, cores } = self;
        write!(out, "{adapter}; {driver}; {cores} cores")
    }
}
