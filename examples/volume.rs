//! Draws a volume that the library generates: `cargo run --release --example volume`.

use splatkit::{
    Device, Renderer,
    glam::DVec3,
    math::{Camera, Kernel},
    scene::{Scene, Settings},
    volume::{TransferFunction, phantoms::Phantom},
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let volume = Phantom::Specimen.sample_bytes([96; 3])?;
    let transfer = TransferFunction::automatic(&volume);
    let scene = Scene::new().with_volume(volume, Kernel::default(), transfer);

    let mut renderer = Renderer::new(&Device::automatic(), &scene)?;

    let settings = Settings::new([640, 480]);
    let mut camera = Camera::framing(&scene.bounds(), DVec3::Y, DVec3::Z, 640.0 / 480.0);
    camera.azimuth(40.0);
    camera.elevation(30.0);
    camera.zoom(1.9);
    let (picture, stats) = renderer.render(&camera, &settings)?;
    picture.save("specimen.png", Some([0.0, 0.0, 0.0]))?;
    println!("{} bytes of memory on {}", stats.gpu_bytes, renderer.device().name());
    Ok(())
}
