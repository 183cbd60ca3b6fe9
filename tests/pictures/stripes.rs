//! Flat faces and lit ridges show no stripe for each sheet.

use crate::testing::psnr::measured;
use glam::DVec3;
use splatkit::{
    cpu::CpuRenderer,
    math::{Camera, Kernel, Projection},
    picture::Picture,
    scene::{Scene, Settings},
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
