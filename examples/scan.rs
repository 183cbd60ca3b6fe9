//! Draws a scanned mesh: `cargo run --release --example scan -- bunny.ply`. Without a file it draws
//! a mesh that the library makes.

use splatkit::{
    Device, Renderer, formats,
    input::Limits,
    math::Camera,
    scene::{Scene, Settings},
    surface::{Mesh, SurfelOptions},
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mesh = match std::env::args().nth(1) {
        // PLY, OBJ, glTF, STL, … by their contents, not their names.
        Some(path) => {
            formats::load_mesh(path, &Limits::default(), &formats::ReadOptions::default())?
        }
        None => Mesh::knot(400, 60),
    };
    // One flat, elliptic splat for each vertex.
    let surfels = mesh.surfels(&SurfelOptions::default())?;
    println!("{} surfels", surfels.splats.len());

    let scene = Scene::new().with_splats(surfels);
    let mut renderer = Renderer::new(&Device::automatic(), &scene)?;
    let settings = Settings::new([800, 600]);
    let camera = Camera::fit(&scene, settings.size)?;

    let (picture, stats) = renderer.render(&camera, &settings)?;
    picture.save("scan.png", Some([1.0; 3]))?;
    println!("scan.png: {} splats on {}", stats.splats, renderer.device().name());
    Ok(())
}
