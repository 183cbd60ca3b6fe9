//! Scenes of which a few parts lie far away from all others.

use crate::testing::psnr::measured;
use glam::{DVec3, Vec3};
use splatkit::{
    cpu::CpuRenderer,
    math::{Bounds, Camera},
    picture::Picture,
    scene::{Scene, Settings},
    surface::{Mesh, SurfelOptions},
};

/// Points far away from all others make the scene large. They hide nothing, and the camera is
/// fitted to the rest.
#[test]
fn a_few_points_far_away_change_nothing() {
    let ball = |strays: usize| {
        let mut positions = Mesh::sphere(4).positions;
        positions.extend((0..strays).map(|n| Vec3::new(5000.0, 3000.0 + n as f32, 8000.0)));
        let cloud = Mesh { positions, ..Mesh::default() };
        let scene =
            Scene::new().with_splats(cloud.surfels(&SurfelOptions::default()).expect("surfels"));
        let settings = Settings::new([48, 36]);
        let bounds = Bounds { min: DVec3::splat(-1.0), max: DVec3::ONE };
        let mut camera = Camera::framing(&bounds, DVec3::new(0.3, -1.0, 0.4), DVec3::Z, 4.0 / 3.0);
        camera.fit_points(&scene.seen(&[]).expect("points"), settings.size, 0.04).expect("fits");
        let mut renderer = CpuRenderer::new(&scene).expect("prepares");
        renderer.render(&camera, &settings).expect("draws").0
    };
    let [alone, with] = [0, 10].map(ball);
    let filled = |picture: &Picture| picture.color.iter().filter(|color| color[3] > 0.9).count();
    assert!(filled(&alone) > 600, "{}", filled(&alone));
    let ratio = measured(&with, &alone);
    // The sheets begin at another distance.
    assert!(ratio > 35.0, "{ratio} dB");
}
