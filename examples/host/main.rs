//! A host application with its own device, camera and triangles, and splatkit's frame among them:
//! `cargo run --release --example host`, or `… host cpu` for the CPU engine. Writes host.png.
//!
//! frame.rs shows how splatkit is embedded; target.rs and triangles.rs are the host's own drawing.

mod frame;
mod target;
mod triangles;

use frame::Host;
use splatkit::{
    Device,
    glam::{DVec3, dcamera::rh},
    gpu::Gpu,
    math::Kernel,
    scene::Scene,
    volume::{TransferFunction, phantoms::Phantom},
    wgpu,
};
use std::error::Error;
use triangles::Corner;

/// Opens a device as any host does. splatkit needs WebGPU's default limits.
async fn open() -> Result<Gpu, Box<dyn Error>> {
    let instance =
        wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
    let adapter = instance.request_adapter(&wgpu::RequestAdapterOptions::default()).await?;
    let (device, queue) = adapter.request_device(&wgpu::DeviceDescriptor::default()).await?;
    Ok(Gpu::from_wgpu(device, queue, adapter.get_info()))
}

/// Two triangles through the middle of the scene.
fn triangles(center: DVec3, size: f64) -> Vec<Corner> {
    let corner = |x: f64, y: f64, z: f64, color| Corner {
        position: (center + size * DVec3::new(x, y, z)).as_vec3().to_array(),
        color,
    };
    let (red, blue) = ([0.9, 0.2, 0.1], [0.1, 0.4, 0.9]);
    vec![
        corner(-0.6, 0.0, -0.5, red),
        corner(0.6, 0.0, -0.5, red),
        corner(0.0, 0.0, 0.6, red),
        corner(0.0, -0.6, 0.5, blue),
        corner(0.0, 0.6, 0.5, blue),
        corner(0.0, 0.0, -0.6, blue),
    ]
}

fn main() -> Result<(), Box<dyn Error>> {
    let gpu = pollster::block_on(open())?;
    let device = match std::env::args().nth(1).as_deref() {
        Some("cpu") => Device::CpuFor(gpu.clone()),
        _ => Device::of_host(&gpu),
    };
    let volume = Phantom::Specimen.sample_bytes([96; 3])?;
    let transfer = TransferFunction::automatic(&volume);
    let scene = Scene::new().with_volume(volume, Kernel::default(), transfer);
    let (center, size) = (scene.bounds().center(), scene.bounds().diagonal());

    // The host's camera: any matrices, here those of glam.
    let eye = center + 1.5 * size * DVec3::new(0.5, 0.8, 0.4);
    let view = rh::view::look_at_mat4(eye, center, DVec3::Z);
    let [near, far] = [0.1 * size, 10.0 * size];
    let projection = rh::proj::directx::perspective(0.6, 4.0 / 3.0, near, far);

    let mut host = Host::new(&gpu, &device, &scene, &triangles(center, size), [640, 480])?;
    host.draw([view, projection], [near, far])?;
    host.picture()?.save("host.png", None)?;
    println!("host.png, drawn by {}", device.name());
    Ok(())
}
