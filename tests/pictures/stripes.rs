//! Flat faces, lit ridges and surfaces in a medium show no stripe for each sheet, and cut faces no
//! noise.

use crate::testing::psnr::measured;
use glam::{DVec3, Vec3};
use splatkit::{
    cpu::CpuRenderer,
    math::{Camera, Kernel, Projection},
    picture::Picture,
    scene::{Clip, ClipShape, Scene, Settings},
    surface::{Mesh, SurfelOptions},
    volume::{Isosurface, Lattice, Samples, Shade, TransferFunction, Volume, phantoms::Phantom},
};

const SIDE: usize = 32;

/// A volume whose values depend on the place along y and on that along x.
fn volume(value: impl Fn(usize, usize) -> u8) -> Volume {
    let at = |i: usize| value(i % SIDE, i / SIDE % SIDE);
    let values = (0..SIDE.pow(3)).map(at).collect();
    Volume::new(Lattice::with_spacing([SIDE; 3], DVec3::ONE), Samples::U8(values)).expect("valid")
}

/// Sees the volume's middle from above, obliquely, without perspective.
fn camera() -> Camera {
    let middle = DVec3::splat(0.5 * (SIDE - 1) as f64);
    Camera {
        position: middle + DVec3::new(25.0, 70.0, 40.0),
        focal_point: middle,
        view_up: DVec3::Z,
        projection: Projection::Orthographic { height: 14.0 },
    }
}

fn drawn(scene: &Scene, sheet_thickness: Option<f64>) -> Picture {
    let settings = Settings { sheet_thickness, ..Settings::new([96, 96]) };
    CpuRenderer::new(scene).expect("a scene").render(&camera(), &settings).expect("a picture").0
}

/// The step between two values lies between two samples, so sheets cross it at every place of their
/// thickness.
#[test]
fn a_flat_isosurface_has_one_colour() {
    let volume = volume(|_, y| if y < SIDE / 2 { 200 } else { 0 });
    let surface = Isosurface { value: 100.0, color: [0.8; 3], opacity: 1.0 };
    let transfer = TransferFunction {
        shade: Some(Shade::default()),
        isosurfaces: vec![surface],
        ..TransferFunction::default()
    };
    let scene = Scene::new().with_volume(volume, Kernel::default(), transfer);
    let picture = drawn(&scene, None);
    let reds = picture.color.iter().map(|pixel| {
        assert!(pixel[3] > 0.999, "the surface fills the picture");
        pixel[0]
    });
    let (low, high) = reds.fold((1.0f32, 0.0f32), |(low, high), red| (low.min(red), high.max(red)));
    println!("a flat isosurface: {low} to {high}");
    assert!(high - low < 0.02, "{low} to {high}");
}

/// A ridge of the field, steep on both sides and level on top, lit where it is translucent.
#[test]
fn a_lit_ridge_looks_as_in_thin_sheets() {
    let volume = volume(|x, y| {
        let top = 16.0 + 3.0 * (x as f64 / 4.0).sin();
        (200.0 - 24.0 * (y as f64 - top).abs()).clamp(0.0, 255.0) as u8
    });
    let transfer = TransferFunction {
        color: vec![(0.0, [0.9, 0.6, 0.4])],
        opacity: vec![(60.0, 0.0), (120.0, 0.3), (200.0, 0.6)],
        shade: Some(Shade::default()),
        ..TransferFunction::default()
    };
    let scene = Scene::new().with_volume(volume, Kernel::default(), transfer);
    let agreement = measured(&drawn(&scene, None), &drawn(&scene, Some(1.0 / 6.0)));
    println!("a lit ridge: {agreement:.1} dB");
    assert!(agreement > 40.0, "{agreement:.1} dB");
}

/// The specimen's material turns opaque within a few sheets. Lines that thinner sheets do not have
/// are contours: they follow the places where sheets cut the material.
#[test]
fn lit_materials_that_turn_opaque_have_no_contours() {
    const SIDE: usize = 64;
    let volume = Phantom::Specimen.sample([SIDE; 3]).expect("a volume");
    let transfer = TransferFunction {
        color: vec![(0.4, [0.8, 0.36, 0.16]), (0.75, [0.96, 0.72, 0.36]), (1.0, [0.9, 0.95, 1.0])],
        opacity: vec![(0.36, 0.03), (0.45, 0.03), (0.65, 0.35), (0.8, 0.6), (1.0, 0.8)],
        unit: 0.02,
        shade: Some(Shade {
            ambient: 0.3,
            diffuse: 0.7,
            specular: 0.3,
            power: 24.0,
            certain: None,
        }),
        ..TransferFunction::default()
    };
    let scene = Scene::new().with_volume(volume, Kernel::default(), transfer);
    let mut camera = Camera::framing(&scene.bounds(), DVec3::Y, DVec3::Z, 1.0);
    camera.azimuth(40.0);
    camera.elevation(30.0);
    let drawn = |sheet_thickness| {
        let settings = Settings { sheet_thickness, ..Settings::new([256, 256]) };
        let mut renderer = CpuRenderer::new(&scene).expect("a scene");
        renderer.render(&camera, &settings).expect("a picture").0
    };
    let (default, thin) = (drawn(None), drawn(Some(0.25 / SIDE as f64)));
    let line = |picture: &Picture, at: usize| {
        let green = |at: usize| 255.0 * picture.color[at][1];
        green(at) - 0.5 * (green(at - 1) + green(at + 1))
    };
    let inner = (0..default.color.len()).filter(|at| (1..255).contains(&(at % 256)));
    let mut lines: Vec<f32> =
        inner.map(|at| (line(&default, at) - line(&thin, at)).abs()).collect();
    lines.sort_by(f32::total_cmp);
    let strongest = lines[lines.len() * 99 / 100];
    let agreement = measured(&default, &thin);
    println!("an opaque material: {agreement:.1} dB, lines of {strongest:.2} / 255");
    assert!(strongest < 4.0, "{strongest:.2} / 255");
}

/// A slanted surface in a medium passes a plane between two sheets every few pixels. If all of a
/// sheet's medium counted in front of its facets, each plane would draw a line.
#[test]
fn a_surface_in_a_medium_looks_as_in_thin_sheets() {
    let top = |x: f32| Vec3::new(31.0 * x, 18.0 + 5.0 * (x - 0.5), 0.0);
    let corner = |x: f32, z: f32| top(x) + 31.0 * z * Vec3::Z;
    let mesh = Mesh {
        positions: vec![corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    };
    let facets = mesh.facets(&SurfelOptions::default()).expect("facets").expect("of a small mesh");
    let transfer = TransferFunction {
        color: vec![(0.0, [0.9, 0.3, 0.1])],
        opacity: vec![(0.0, 0.25)],
        unit: 1.0,
        shade: None,
        ..TransferFunction::default()
    };
    let medium = volume(|_, _| 100);
    let scene = Scene::new().with_volume(medium, Kernel::default(), transfer).with_facets(facets);
    let agreement = measured(&drawn(&scene, None), &drawn(&scene, Some(1.0 / 16.0)));
    println!("a surface in a medium: {agreement:.1} dB");
    assert!(agreement > 50.0, "{agreement:.1} dB");
}

/// Where a clip cuts a lit, opaque and noisy material open, its face shows the values: noise has no
/// normals. Behind, surfaces are lit as without the clip.
#[test]
fn cut_faces_are_even() {
    let noise = |x: usize, y: usize| ((x * 7919 + y * 104_729) % 101) as u8 % 13;
    let volume = volume(|x, y| 120 + noise(x, y));
    let transfer = |shade: Option<Shade>| TransferFunction {
        color: vec![(0.0, [0.8, 0.6, 0.4])],
        opacity: vec![(60.0, 0.0), (100.0, 0.95)],
        unit: 0.5,
        shade,
        ..TransferFunction::default()
    };
    let middle = 0.5 * (SIDE - 1) as f64;
    let clip =
        Clip { shape: ClipShape::HalfSpace { normal: DVec3::Y, offset: middle }, inside: true };
    let drawn = |shade: Option<Shade>| {
        let scene = Scene::new().with_volume(volume.clone(), Kernel::default(), transfer(shade));
        let settings = Settings { clips: vec![clip], ..Settings::new([96, 96]) };
        let mut renderer = CpuRenderer::new(&scene).expect("a scene");
        renderer.render(&camera(), &settings).expect("a picture").0
    };
    let shade = Shade { certain: Some([0.0, 0.0]), specular: 0.0, ..Shade::default() };
    // What is lit from the front has this share of its colour.
    let share = (shade.ambient + shade.diffuse) as f32;
    let (lit, plain) = (drawn(Some(shade)), drawn(None));
    let mut most = 0.0f32;
    for (lit, plain) in lit.color.iter().zip(&plain.color) {
        most = most.max((lit[0] - share * plain[0]).abs());
    }
    println!("a cut face: {most}");
    // Light by the noise itself takes up to half of the colour away.
    assert!(most < 0.2, "{most}");
}
