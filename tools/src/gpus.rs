//! `splatkit gpus`.

use crate::{failure::Failure, output};
use clap::Args;
use splatkit::{Error, gpu::Gpu};

#[derive(Args, Debug)]
pub struct Gpus {
    /// Print the list as JSON.
    #[arg(long)]
    json: bool,
}

impl Gpus {
    pub fn run(self) -> Result<(), Failure> {
        let adapters = Gpu::adapters();
        if self.json {
            let list = adapters.iter().enumerate().map(|(index, (info, limits))| {
                serde_json::json!({
                    "index": index,
                    "name": info.name,
                    "type": format!("{:?}", info.device_type),
                    "backend": info.backend.to_string(),
                    "driver": info.driver,
                    "driver_info": info.driver_info,
                    "max_buffer_bytes": limits.max_buffer_size,
                    "max_binding_bytes": limits.max_storage_buffer_binding_size,
                })
            });
            output::json(&serde_json::Value::from_iter(list))?;
        }
        if adapters.is_empty() {
            // The library's own message says what to install.
            return Err(Gpu::headless(&Default::default())
                .err()
                .unwrap_or_else(|| Error::NoAdapter("no adapter was found".into()))
                .into());
        }
        if !self.json {
            for (index, (info, limits)) in adapters.iter().enumerate() {
                let mib = limits.max_storage_buffer_binding_size >> 20;
                let kind = format!("{:?}", info.device_type);
                output::line(format_args!(
                    "{index}  {}\n   {} {kind}, driver {} {}, bindings of {mib} MiB",
                    info.name, info.backend, info.driver, info.driver_info
                ))?;
            }
        }
        Ok(())
    }
}
