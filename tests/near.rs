//! Hierarchies seen from near: inside the outline of a mesh, no light passes. `SPLATKIT_MESHES`
//! with paths of meshes, separated by colons, measures these, too.

mod testing;

use splatkit::{
    cpu::CpuRenderer,
    hierarchy::{
        BuildOptions, Hierarchy, Tree,
        file::{WriteOptions, to_bytes},
    },
    input::Limits,
    scene::Scene,
    surface::{Mesh, SurfelOptions},
};
use testing::outline::{Truth, given_meshes};

/// Opacities below this count.
const LEAST: f32 = 0.99;

/// Draws a mesh as a file of a hierarchy, from several distances. Returns the number of pixels with
/// less opacity.
fn draw(name: &str, mesh: &Mesh, size: [u32; 2]) -> usize {
    let set = mesh.surfels(&SurfelOptions::default()).expect("surfels");
    let options = BuildOptions { closed: mesh.is_solid(), ..BuildOptions::default() };
    let tree = Tree::build(&set, &options, None).expect("a tree");
    let bytes = to_bytes(&tree, &WriteOptions::default()).expect("a file");
    let hierarchy =
        Hierarchy::from_bytes(bytes, "a.splk", &Limits::default()).expect("a hierarchy");
    let scene = Scene::new().with_hierarchy(hierarchy);
    let mut all = 0;
    for nearer in [1.0, 2.0, 4.0, 8.0] {
        let truth = Truth::new(mesh, size, nearer);
        let mut renderer = CpuRenderer::new(&scene).expect("a renderer");
        let picture = renderer.render(&truth.camera, &truth.settings).expect("a picture").0;
        let found = truth.compare(&picture);
        let (inside, below, least) = truth.opacity_inside(&picture, LEAST);
        let area = 100.0 * found.area;
        println!(
            "| {name}, {nearer}× | {inside} | {below} | {least:.3} | {area:+.3} | {} | {:.1} |",
            found.outside, found.whole
        );
        all += below;
    }
    all
}

#[test]
fn no_light_passes_inside_the_outline() {
    println!("| mesh | pixels inside | below {LEAST} | least | area, % | outside | dB |");
    println!("|---|---:|---:|---:|---:|---:|---:|");
    for (name, mesh) in given_meshes() {
        draw(&name, &mesh, [800, 600]);
    }
    for (name, mesh) in [("knot", Mesh::knot(600, 60)), ("sphere", Mesh::sphere(5))] {
        assert_eq!(draw(name, &mesh, [240, 180]), 0, "{name}");
    }
}
