//! A host in sixty lines: its triangles and splatkit's sphere in one depth buffer.
//! `cargo run --release --example embed` writes embed.png.

// The host's own textures and triangles, as in any program with wgpu.
#[path = "host/target.rs"]
mod target;
#[path = "host/triangles.rs"]
mod triangles;

use pollster::block_on;
use splatkit::{
    Device, Renderer,
    glam::{DVec3, dcamera::rh},
    gpu::{Depth, Gpu, Output, Progress},
    math::View,
    scene::{Scene, Settings},
    surface::{Mesh, SurfelOptions},
    wgpu,
};
use target::{COLOR, DEPTH, Target};
use triangles::{Corner, Triangles};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // The host: its device, camera and triangles, a red one before the sphere, a blue one behind.
    let instance =
        wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
    let adapter = block_on(instance.request_adapter(&Default::default()))?;
    let (device, queue) = block_on(adapter.request_device(&Default::default()))?;
    let [near, far] = [0.5, 20.0];
    let view = rh::view::look_at_mat4(DVec3::NEG_Y * 4.0, DVec3::ZERO, DVec3::Z);
    let projection = rh::proj::directx::perspective(0.8, 4.0 / 3.0, near, far);
    let triangle = |y: f32, x: f32, color| {
        [[x, -0.7], [x + 1.2, -0.7], [x, 0.9]].map(|[x, z]| Corner { position: [x, y, z], color })
    };
    let corners = [triangle(-1.5, -0.2, [0.9, 0.2, 0.1]), triangle(1.5, -1.6, [0.1, 0.4, 0.9])];
    let triangles = Triangles::new(&device, corners.as_flattened(), [COLOR, DEPTH]);
    triangles.look_from(&queue, projection * view);
    let target = Target::new(&device, [640, 480]);

    // splatkit: a scene on the host's device.
    let gpu = Gpu::from_wgpu(device.clone(), queue.clone(), adapter.get_info());
    let sphere = Mesh::sphere(4).surfels(&SurfelOptions::default())?;
    let mut renderer = Renderer::new(&Device::of_host(&gpu), &Scene::new().with_splats(sphere))?;

    // A frame: the host's pass, then splatkit's picture over it where it is not behind.
    let mut encoder = device.create_command_encoder(&Default::default());
    triangles.draw(&mut target.pass(&mut encoder, true));
    let depth = Some(Depth::Buffer { view: target.depth.clone(), near, far });
    let color = target.color.clone();
    let output = Output::Textures { color, format: COLOR, depth, over: true };
    let viewpoint = View::from_matrices(view, projection, target.size)?;
    let settings = Settings::new(target.size);
    let mut frame = renderer.encode(&mut encoder, &viewpoint, &settings, output)?;
    queue.submit([encoder.finish()]);
    loop {
        match renderer.poll(&mut frame)? {
            Progress::Done(_) => break,
            Progress::NextBatch => {
                let mut encoder = device.create_command_encoder(&Default::default());
                renderer.encode_next(&mut encoder, &mut frame)?;
                queue.submit([encoder.finish()]);
            }
            _ => std::thread::yield_now(),
        }
    }
    Ok(target.picture(&gpu)?.save("embed.png", None)?)
}
