//! Leaving out hidden splats does not show. Over many views and transfer functions, pictures with
//! and without culling differ by no more than the light that an opaque pixel still lets through.

use crate::{
    scenes::{self, Case, methods},
    testing::gpu::gpu,
};
use glam::{DQuat, DVec3};
use splatkit::{
    FrameStats,
    gpu::{Budget, Renderer},
    math::{Camera, Kernel, Projection},
    picture::Picture,
    scene::{Evaluate, Order, Scene, Settings},
    surface::{Mesh, SurfelOptions},
    volume::{Shade, TransferFunction, phantoms::Phantom},
};
use std::sync::Arc;

/// The most that a channel of a pixel may differ by. One part is the light that is left when a
/// pixel counts as opaque (0.0005). The other is a difference of the field where another pass
/// begins: samples that end just before the seam no longer reach across it with the last 0.4 % of
/// their kernels. If the transfer function is steep and lit, that makes up to 0.0026 (measured with
/// nothing hidden).
const MOST_DIFFERENCE: f32 = 0.004;

/// A renderer with passes as thin as possible, so that small scenes have many.
fn renderer() -> Renderer {
    Renderer::with_budget(gpu(), Budget { least_share: Some(1), ..Budget::default() })
}

/// The camera turned around its focal point, in steps that do not divide a full turn.
fn turned(camera: &Camera, step: u32) -> Camera {
    let angle = 0.9 * f64::from(step);
    let away = camera.position - camera.focal_point;
    let up = camera.view_up;
    let turn = DQuat::from_axis_angle(up.normalize(), angle);
    Camera { position: camera.focal_point + turn * away, ..camera.clone() }
}

fn case(name: &'static str, scene: Scene) -> Case {
    let camera = Camera::framing(&scene.bounds(), DVec3::new(0.4, -0.3, -1.0), DVec3::Y, 1.2);
    // Gathered volumes have no splats that could be hidden.
    let settings = Settings { evaluate: Evaluate::Scatter, ..Settings::new([96, 80]) };
    Case { name, scene, camera, settings }
}

/// A solid of rind, flesh and stones, all drawn with one opacity.
fn specimen(opacity: f64) -> Case {
    let volume = Phantom::Specimen.sample_bytes([40; 3]).unwrap();
    let transfer = TransferFunction {
        color: vec![(20.0, [0.7, 0.3, 0.2]), (255.0, [1.0, 0.9, 0.7])],
        opacity: vec![(20.0, 0.0), (60.0, opacity)],
        unit: volume.lattice.kernel_spacing(),
        shade: Some(Shade::default()),
        ..TransferFunction::default()
    };
    case("specimen", Scene::new().with_volume(volume, Kernel::default(), transfer))
}

fn knot_in_a_sphere() -> Case {
    let surfels = |mesh: &Mesh| Arc::new(mesh.surfels(&SurfelOptions::default()).unwrap());
    let knot = surfels(&Mesh::knot(300, 24));
    let mut sphere = Mesh::sphere(5);
    let reach = 1.1 * Scene::new().with_splats(knot.clone()).bounds().diagonal() / 2.0;
    sphere.positions.iter_mut().for_each(|place| *place *= reach as f32);
    case("knot in a sphere", Scene::new().with_splats(knot).with_splats(surfels(&sphere)))
}

fn draw(
    renderer: &mut Renderer,
    case: &Case,
    camera: &Camera,
    occlusion: bool,
) -> (Picture, FrameStats) {
    let mut prepared = renderer.prepare(&case.scene).expect(case.name);
    let settings = Settings { occlusion, ..case.settings.clone() };
    renderer.render(&mut prepared, camera, &settings).expect(case.name)
}

fn largest_difference(a: &Picture, b: &Picture) -> f32 {
    let channels = a.color.as_flattened().iter().zip(b.color.as_flattened());
    channels.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

/// Asserts that a case looks the same with culling and without, from all around. Returns the number
/// of hidden splats over all views.
fn hidden_in(case: &Case, views: u32) -> u64 {
    let mut renderer = renderer();
    let mut hidden = 0;
    for step in 0..views {
        let camera = turned(&case.camera, step);
        let (culled, stats) = draw(&mut renderer, case, &camera, true);
        let (whole, others) = draw(&mut renderer, case, &camera, false);
        assert_eq!(others.hidden, 0);
        assert!(stats.passes >= others.passes, "{}: {} passes", case.name, stats.passes);
        let difference = largest_difference(&culled, &whole);
        println!(
            "{} view {step}: {} of {} hidden, {difference:.5}",
            case.name, stats.hidden, stats.splats
        );
        assert!(
            difference <= MOST_DIFFERENCE,
            "{} view {step}: a channel differs by {difference}",
            case.name
        );
        hidden += stats.hidden;
    }
    hidden
}

#[test]
fn opaque_volumes_hide_their_inside() {
    for opacity in [0.8, 0.95] {
        let case = specimen(opacity);
        assert!(hidden_in(&case, 4) > 1000, "opacity {opacity}");
    }
}

#[test]
fn clear_volumes_hide_nothing() {
    assert_eq!(hidden_in(&specimen(0.02), 2), 0);
}

#[test]
fn a_sphere_hides_what_is_in_it() {
    assert!(hidden_in(&knot_in_a_sphere(), 4) > 1000);
}

#[test]
fn scenes_of_all_kinds_are_the_same() {
    for make in [
        scenes::surface_in_a_volume,
        scenes::blobs_central,
        scenes::ellipsoids_in_perspective,
        scenes::huge_among_small,
        methods::isosurfaces_in_fog,
        methods::clipped_surface_in_a_volume,
        methods::gradient_opacity,
    ] {
        for evaluate in [Evaluate::Auto, Evaluate::Scatter] {
            let case = make();
            let settings = Settings { evaluate, ..case.settings.clone() };
            hidden_in(&Case { settings, ..case }, 3);
        }
    }
}

/// Nothing is left out of scenes in which every splat counts.
#[test]
fn nothing_hides_where_all_counts() {
    for case in [methods::maximum(), methods::single_splats(Order::BackToFront)] {
        let (_, stats) = draw(&mut renderer(), &case, &case.camera, true);
        assert_eq!(stats.hidden, 0, "{}", case.name);
    }
}

/// A scene draws the same bytes each time, in whatever order its tiles and batches are processed.
#[test]
fn the_same_bytes_each_time() {
    let mut renderer = renderer();
    let case = knot_in_a_sphere();
    let (first, _) = draw(&mut renderer, &case, &case.camera, true);
    for _ in 0..10 {
        let (again, _) = draw(&mut renderer, &case, &case.camera, true);
        assert!(first.color == again.color && first.depth == again.depth);
    }
    let orthographic =
        Camera { projection: Projection::Orthographic { height: 3.0 }, ..case.camera.clone() };
    let (first, _) = draw(&mut renderer, &case, &orthographic, true);
    let (again, _) = draw(&mut renderer, &case, &orthographic, true);
    assert!(first.color == again.color);
}
