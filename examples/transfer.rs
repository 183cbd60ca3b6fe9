//! Changes the transfer function of a volume while it is drawn, as an editor does:
//! `cargo run --release --example transfer`. The volume is prepared once.

use splatkit::{
    Device, Renderer,
    glam::DVec3,
    math::{Camera, Kernel},
    scene::{Scene, Settings},
    volume::{TransferFunction, phantoms::Phantom},
};
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let volume = Phantom::Head.sample_bytes([128; 3])?;
    let transfer = TransferFunction::automatic(&volume);
    let [low, high] = volume.range;
    let scene = Scene::new().with_volume(volume, Kernel::default(), transfer.clone());

    let mut renderer = Renderer::new(&Device::automatic(), &scene)?;
    let settings = Settings::new([640, 480]);
    let mut camera = Camera::framing(&scene.bounds(), DVec3::Y, DVec3::Z, 640.0 / 480.0);
    camera.azimuth(30.0);

    // A window of values that moves from the skin to the bone.
    for step in 0..4 {
        let at = |share: f64| low + (high - low) * share;
        let first = 0.2 + 0.2 * f64::from(step);
        let window = TransferFunction {
            opacity: vec![(at(first - 0.05), 0.0), (at(first), 0.3), (at(1.0), 0.3)],
            ..transfer.clone()
        };
        let start = Instant::now();
        renderer.set_transfer(0, &window)?;
        let (picture, _) = renderer.render(&camera, &settings)?;
        let milliseconds = start.elapsed().as_secs_f64() * 1e3;
        let path = format!("transfer-{step}.png");
        picture.save(&path, Some([0.0; 3]))?;
        println!("{path}: values from {:.0} on, {milliseconds:.0} ms", at(first));
    }
    Ok(())
}
