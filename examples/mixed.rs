//! Draws a volume and a surface in one picture, each before and behind parts of the other:
//! `cargo run --release --example mixed`.

use splatkit::{
    Device, Renderer,
    glam::DVec3,
    math::{Camera, Kernel},
    scene::{Clip, ClipShape, Scene, Settings},
    surface::{Mesh, SurfelOptions},
    volume::{TransferFunction, phantoms::Phantom},
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let volume = Phantom::Specimen.sample_bytes([96; 3])?;
    let transfer = TransferFunction::automatic(&volume);
    let bounds = volume.bounds();

    // A knot around the middle of the volume, in its units.
    let mut knot = Mesh::knot(400, 40);
    let (middle, size) = (bounds.center().as_vec3(), 0.3 * bounds.size().as_vec3());
    for place in &mut knot.positions {
        *place = middle + size * *place / 3.0;
    }
    let surfels = knot.surfels(&SurfelOptions::default())?;

    let scene = Scene::new().with_volume(volume, Kernel::default(), transfer).with_splats(surfels);
    let mut renderer = Renderer::new(&Device::automatic(), &scene)?;
    let mut camera = Camera::framing(&scene.bounds(), DVec3::Y, DVec3::Z, 640.0 / 480.0);
    camera.azimuth(40.0);
    camera.elevation(30.0);

    // The whole scene, then without the part of it that lies in front of the middle.
    let settings = Settings::new([640, 480]);
    let toward_eye = camera.position - camera.focal_point;
    let offset = toward_eye.dot(camera.focal_point);
    let behind = ClipShape::HalfSpace { normal: toward_eye, offset };
    let cut = Clip { shape: behind, inside: true };
    for (path, clips) in [("mixed.png", Vec::new()), ("mixed-cut.png", vec![cut])] {
        let settings = Settings { clips, ..settings.clone() };
        let (picture, _) = renderer.render(&camera, &settings)?;
        picture.save(path, Some([1.0; 3]))?;
        println!("{path}");
    }
    Ok(())
}
