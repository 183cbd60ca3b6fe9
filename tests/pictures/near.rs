//! Hierarchies seen from near: inside the outline of a mesh, no light passes. `SPLATKIT_MESHES`
//! with paths of meshes, separated by colons, measures these, too.

use crate::testing::outline::{Truth, given_meshes};
use splatkit::{
    cpu::CpuRenderer,
    glam::Vec3,
    hierarchy::{
        BuildOptions, Hierarchy, Tree,
        file::{WriteOptions, to_bytes},
    },
    input::Limits,
    scene::Scene,
    surface::{Mesh, SurfelOptions},
};

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
        let difference = truth.compare(&picture);
        let (inside, below, least) = truth.opacity_inside(&picture, LEAST);
        let area = 100.0 * difference.area;
        println!(
            "| {name}, {nearer}× | {inside} | {below} | {least:.3} | {area:+.3} | {} | {:.1} |",
            difference.outside, difference.whole
        );
        all += below;
    }
    all
}

/// A ball with bumps and uneven triangles, as scans have them.
fn rough_ball() -> Mesh {
    let mut mesh = Mesh::sphere(6);
    // A third of an edge.
    let by = 0.006;
    let mut seed = 1u32;
    let mut random = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (seed >> 8) as f32 / (1 << 23) as f32 - 1.0
    };
    for place in &mut mesh.positions {
        let bumps = 1.0 + 0.04 * (25.0 * place.x).sin() * (25.0 * place.y).sin();
        let moved = *place + by * Vec3::new(random(), random(), random());
        *place = bumps * moved.normalize();
    }
    mesh
}

#[test]
fn no_light_passes_inside_the_outline() {
    println!("| mesh | pixels inside | below {LEAST} | least | area, % | outside | dB |");
    println!("|---|---:|---:|---:|---:|---:|---:|");
    for (name, mesh) in given_meshes() {
        draw(&name, &mesh, [800, 600]);
    }
    for (name, mesh) in [("knot", Mesh::knot(600, 60)), ("rough ball", rough_ball())] {
        assert_eq!(draw(name, &mesh, [240, 180]), 0, "{name}");
    }
}
