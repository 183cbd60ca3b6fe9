//! The GPU device that all tests of a program share, because a device compiles each shader once.
//! Tests of devices open their own.

use splatkit::gpu::{AdapterChoice, Gpu};
use std::sync::OnceLock;

/// Returns the shared device.
pub fn gpu() -> &'static Gpu {
    static GPU: OnceLock<Gpu> = OnceLock::new();
    GPU.get_or_init(own_gpu)
}

/// Opens another device, which a test may lose.
pub fn own_gpu() -> Gpu {
    Gpu::headless(&AdapterChoice::Automatic).expect("a GPU, or a software driver")
}
