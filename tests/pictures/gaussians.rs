//! Trained Gaussians against the formulas of their trainer.

use crate::{
    scenes::{self, gaussians::trained},
    testing::psnr::psnr,
};
use splatkit::{
    Device, Renderer,
    gaussians::Gaussians,
    glam::{DVec3, Quat, Vec3},
    math::{Camera, Projection},
    picture::Picture,
    reference,
    scene::{Mode, Order, Scene, Settings},
};

/// A camera that sees all of the scene under a view angle, in degrees.
fn camera(view_angle: f64) -> Camera {
    let distance = 1.7 / (0.5 * view_angle).to_radians().tan();
    let focal_point = scenes::ORIGIN;
    let position = focal_point + distance * DVec3::new(0.5, -0.7, 0.4).normalize();
    let projection = Projection::Perspective { view_angle };
    Camera { position, focal_point, view_up: DVec3::Z, projection }
}

fn drawn(set: &Gaussians, camera: &Camera, settings: &Settings) -> Picture {
    let scene = Scene::new().with_gaussians(set.clone());
    let mut renderer = Renderer::new(&Device::Cpu, &scene).expect("a renderer");
    renderer.render(camera, settings).expect("a picture").0
}

/// Whole splats are the trainer's picture; the rest is that of exact footprints against those of a
/// projection's linear part, which grows with the angle. Sheets differ where splats in one sheet
/// overlap.
#[test]
fn whole_splats_are_the_trainers_picture() {
    let set = trained(400);
    for (angle, whole, sheets) in [(5.0, 62.0, 52.0), (30.0, 50.0, 52.0)] {
        let camera = camera(angle);
        let settings = Settings::new([120, 90]);
        let truth = reference::trained(&set, &camera, &settings).expect("a picture");
        let single = Settings { mode: Mode::Splats(Order::FrontToBack), ..settings.clone() };
        let by_splats = psnr(&drawn(&set, &camera, &single), &truth);
        let by_sheets = psnr(&drawn(&set, &camera, &settings), &truth);
        println!("{angle}°: whole {by_splats:.1} dB, in sheets {by_sheets:.1} dB");
        assert!(by_splats >= whole, "{angle}°: {by_splats:.1} dB");
        assert!(by_sheets >= sheets, "{angle}°: {by_sheets:.1} dB");
    }
}

/// However thick or thin the sheets are, one splat covers what it was trained to.
#[test]
fn one_splat_keeps_its_opacity() {
    let set = Gaussians {
        centers: vec![Vec3::ZERO],
        scales: vec![Vec3::new(0.4, 0.5, 0.6)],
        rotations: vec![Quat::from_rotation_x(0.4)],
        opacities: vec![0.7],
        harmonics: vec![[0.0; 3]],
        ..Gaussians::default()
    };
    let camera =
        Camera { focal_point: DVec3::ZERO, position: DVec3::new(0.0, -6.0, 0.0), ..camera(30.0) };
    for pixels in [0.5, 2.0, 20.0, 500.0] {
        let settings = Settings { sheet_pixels: pixels, ..Settings::new([33, 33]) };
        let [.., opacity] = drawn(&set, &camera, &settings).color[16 * 33 + 16];
        assert!((opacity - 0.7).abs() < 2e-3, "sheets of {pixels} pixels: {opacity}");
    }
}

/// The colour follows the camera, and a renderer that has drawn another view forgets nothing.
#[test]
fn a_renderer_colours_each_view_anew() {
    let set = trained(200);
    let scene = Scene::new().with_gaussians(set.clone());
    let settings = Settings::new([60, 45]);
    let mut renderer = Renderer::new(&Device::Cpu, &scene).expect("a renderer");
    let mut camera = camera(30.0);
    for _ in 0..3 {
        camera.azimuth(70.0);
        let (again, _) = renderer.render(&camera, &settings).expect("a picture");
        assert_eq!(again.color, drawn(&set, &camera, &settings).color);
    }
}
