//! Builds a hierarchy of splats, writes it to a file, and draws it with cuts of several sizes:
//! `cargo run --release --example hierarchy -- bunny.ply`. Without a file it takes a mesh that the
//! library makes.

use splatkit::{
    Device, Renderer, formats,
    glam::DVec3,
    hierarchy::{BuildOptions, Detail, Hierarchy, Tree, file},
    input::Limits,
    math::Camera,
    scene::{Scene, Settings},
    surface::{Mesh, SurfelOptions},
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let limits = Limits::default();
    let mesh = match std::env::args().nth(1) {
        Some(path) => formats::load_mesh(path, &limits, &formats::ReadOptions::default())?,
        None => Mesh::knot(1000, 100),
    };
    let surfels = mesh.surfels(&SurfelOptions::default())?;
    let tree = Tree::build(&surfels, &BuildOptions::default(), None)?;
    file::write(&tree, "hierarchy.splk", &file::WriteOptions::default())?;
    println!(
        "hierarchy.splk: {} splats, {} bytes",
        surfels.splats.len(),
        std::fs::metadata("hierarchy.splk")?.len()
    );

    // The file is mapped. Only the pages that a picture needs are read.
    let hierarchy = Hierarchy::open("hierarchy.splk", &limits)?;
    let scene = Scene::new().with_hierarchy(hierarchy);
    let mut renderer = Renderer::new(&Device::automatic(), &scene)?;
    let mut camera = Camera::framing(&scene.bounds(), DVec3::NEG_Z, DVec3::Y, 800.0 / 600.0);
    camera.azimuth(30.0);
    // No splat is larger than this many pixels, or there are at most so many splats.
    for (name, detail) in [
        ("1-pixel", Detail::Pixels(1.0)),
        ("8-pixels", Detail::Pixels(8.0)),
        ("2000-splats", Detail::Splats(2000)),
    ] {
        let settings = Settings { detail, ..Settings::new([800, 600]) };
        let (picture, stats) = renderer.render(&camera, &settings)?;
        let path = format!("hierarchy-{name}.png");
        picture.save(&path, Some([1.0; 3]))?;
        println!("{path}: {} splats, a cut of {:.2} pixels", stats.splats, stats.cut_pixels);
    }
    Ok(())
}
