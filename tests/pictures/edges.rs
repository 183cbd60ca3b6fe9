//! Creases, bevels, thin parts and slivers, drawn by the CPU engine and compared with their
//! triangles, traced with 16 rays a pixel. `SPLATKIT_EDGES=800x600` measures pictures of that size,
//! and surfels too; `SPLATKIT_MESHES` names more meshes to measure, separated by colons.

use crate::testing::outline::{Difference, Truth, given_meshes};
use splatkit::{
    cpu::CpuRenderer,
    facet::Sides,
    scene::Scene,
    surface::{Mesh, SurfelOptions},
};
use std::time::Instant;

/// The parts, standing on +Z.
fn parts() -> [(&'static str, Mesh); 5] {
    [
        ("gear", Mesh::gear(24)),
        ("plate", Mesh::bevelled_plate()),
        ("fins", Mesh::fins(12)),
        ("slivers", Mesh::slivers(360)),
        ("sheet", Mesh::folded_sheet(7)),
    ]
}

fn size() -> ([u32; 2], bool) {
    let Ok(text) = std::env::var("SPLATKIT_EDGES") else { return ([200, 150], false) };
    let (width, height) = text.split_once('x').expect("WIDTHxHEIGHT");
    ([width, height].map(|side| side.parse().expect("a number of pixels")), true)
}

/// Draws a scene and compares it; prints a row of the table.
fn row(name: &str, nearer: f64, truth: &Truth, scene: &Scene, what: &str) -> Difference {
    let mut renderer = CpuRenderer::new(scene).expect(name);
    let start = Instant::now();
    let picture = renderer.render(&truth.camera, &truth.settings).expect(name).0;
    let seconds = start.elapsed().as_secs_f64();
    let difference = truth.compare(&picture);
    println!(
        "| {name}, {what}, {nearer}× | {:.1} | {:.1} | {:+.3} | {} | {} | {seconds:.3} |",
        difference.inside,
        difference.whole,
        100.0 * difference.area,
        difference.outside,
        difference.holes
    );
    difference
}

#[test]
fn parts_have_their_outlines() {
    let (size, with_surfels) = size();
    println!("| part | dB inside | dB | area, % | outside | holes | s |");
    println!("|---|---:|---:|---:|---:|---:|---:|");
    let options = SurfelOptions::default();
    for (name, mesh) in given_meshes() {
        for nearer in [1.0, 4.0] {
            let truth = Truth::new(&mesh, size, nearer);
            if let Some(set) = mesh.facets(&options).expect(&name) {
                row(&name, nearer, &truth, &Scene::new().with_facets(set), "facets");
            }
            let surfels = Scene::new().with_splats(mesh.surfels(&options).expect(&name));
            row(&name, nearer, &truth, &surfels, "surfels");
        }
    }
    for (name, mesh) in parts() {
        for nearer in [1.0, 4.0] {
            let truth = Truth::new(&mesh, size, nearer);
            let set = mesh.facets(&options).expect(name).expect("a mesh of facets");
            let scene = Scene::new().with_facets(set);
            let difference = row(name, nearer, &truth, &scene, "facets");
            assert_eq!(difference.outside, 0, "{name}");
            assert!(difference.area.abs() < 3e-3, "{name}: {}", difference.area);
            // At this size, several edges cross a pixel of the smallest pictures.
            let least = if size[0] >= 800 { 35.0 } else { 32.0 };
            assert!(difference.inside > least, "{name}: {} dB", difference.inside);
            if with_surfels {
                let surfels = Scene::new().with_splats(mesh.surfels(&options).expect(name));
                row(name, nearer, &truth, &surfels, "surfels");
            }
        }
    }
}

#[test]
fn sides_are_known() {
    let sides = |mesh: &Mesh| {
        let set = mesh.facets(&SurfelOptions::default()).expect("facets");
        set.map(|set| set.sides)
    };
    assert_eq!(sides(&Mesh::cube(1.0)), Some(Sides::Closed));
    assert_eq!(sides(&Mesh::folded_sheet(3)), Some(Sides::Oriented));
    let mut mesh = Mesh::cube(1.0);
    mesh.triangles[3].swap(0, 1);
    assert_eq!(sides(&mesh), Some(Sides::Mixed));
    // A cube that is inside out is turned, so that its faces are seen.
    let mut turned = Mesh::cube(1.0);
    turned.triangles.iter_mut().for_each(|triangle| triangle.swap(0, 1));
    let set = turned.facets(&SurfelOptions::default()).expect("facets").expect("a cube");
    let facing = set.facets.iter().filter(|facet| {
        let [a, b, c] = facet.corners.map(glam::Vec3::from);
        (b - a).cross(c - a).dot(a + b + c) > 0.0
    });
    assert_eq!(facing.count(), set.facets.len());
}

#[test]
fn what_is_not_opaque_or_too_large_has_no_facets() {
    let facets = |mesh: &Mesh, options: &SurfelOptions| mesh.facets(options).expect("facets");
    let usual = SurfelOptions::default();
    let few = SurfelOptions { most_facets: 11, ..SurfelOptions::default() };
    let cube = Mesh::cube(1.0);
    assert!(facets(&cube, &usual).is_some() && facets(&cube, &few).is_none());
    let mut glass = cube.clone();
    glass.colors = vec![[255; 4]; 8];
    glass.colors[3][3] = 254;
    assert!(facets(&glass, &usual).is_none());
    let points = Mesh { triangles: Vec::new(), ..cube };
    assert!(facets(&points, &usual).is_none());
}
