//! Volumes drawn by the CPU engine and by the reference in double precision.

#[allow(dead_code, reason = "scenes of other tests")]
mod scenes;

use scenes::{Case, methods};
use splatkit::{compare::compare_pictures, cpu::CpuRenderer, math::Projection, reference, scene::Scene};

fn drawn(case: &Case) -> splatkit::Result<splatkit::picture::Picture> {
    CpuRenderer::new(&case.scene)?.render(&case.camera, &case.settings)
}

/// Every kind of scene that this engine draws.
fn volumes() -> Vec<Case> {
    let mut afar = scenes::blobs_analytic();
    let away = afar.camera.position - afar.camera.focal_point;
    afar.camera.position = afar.camera.focal_point + 30.0 * away;
    afar.camera.projection = Projection::Perspective { view_angle: 1.0 };
    vec![
        scenes::blobs_analytic(),
        Case { name: "blobs_from_afar", ..afar },
        scenes::blobs_orthographic(),
        scenes::blobs_unshaded(),
        scenes::camera_inside_a_volume(),
        scenes::marschner_lobb(),
        scenes::constant_field(),
        methods::thin_shells(),
        methods::one_value_far_off(),
        methods::points_far_off(),
        methods::post_classified(),
        methods::orthographic(methods::post_classified()),
        methods::gradient_opacity(),
        methods::one_isosurface(),
        methods::isosurfaces_in_fog(),
        methods::orthographic(methods::isosurfaces_in_fog()),
        methods::maximum(),
        methods::x_ray(),
        kept(methods::clipped_volume()),
    ]
}

/// What a case must agree to, in dB. This engine cuts kernels to a cube of four samples a side, the reference to the ball in it.
/// What lies between is up to a hundredth of the weight, which steep functions and sharp surfaces on a lattice as coarse as this
/// one show, and a broken sample a hundred thousand times as large as the others most of all.
fn least(name: &str) -> f64 {
    match name {
        "post_classified" | "isosurfaces_in_fog" => 48.0,
        "points_far_off" => 35.0,
        _ => 50.0,
    }
}

/// With the clips that keep a part alone.
fn kept(case: Case) -> Case {
    let mut settings = case.settings.clone();
    settings.clips.retain(|clip| clip.inside);
    Case { settings, ..case }
}

#[test]
fn volumes_agree_with_the_reference() {
    for case in volumes() {
        let found = drawn(&case).expect(case.name);
        let truth = reference::render(&case.scene, &case.camera, &case.settings).expect(case.name);
        let agreement = compare_pictures(&found, &truth).expect("pictures of one size").psnr.unwrap_or(f64::INFINITY);
        println!("{}: {agreement:.1} dB", case.name);
        assert!(agreement >= least(case.name), "{}: {agreement:.1} dB", case.name);
        let size = case.scene.bounds().diagonal() as f32;
        for ((found, expected), color) in found.depth.iter().zip(&truth.depth).zip(&truth.color) {
            if color[3] > 0.9 && expected.is_finite() {
                assert!((found - expected).abs() < 0.05 * size, "{}: depth {found} for {expected}", case.name);
            }
        }
    }
}

/// The same bytes however many threads draw.
#[test]
fn threads_change_nothing() {
    let case = scenes::marschner_lobb();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| drawn(&case)).expect("draws").color
    };
    assert_eq!(with(1), with(3));
}

/// What is not drawn yet is an error that names it, never another picture.
#[test]
fn what_is_not_drawn_is_named() {
    for (case, what) in [
        (scenes::ellipsoids_in_perspective(), "anything but a single volume"),
        (scenes::surface_in_a_volume(), "anything but a single volume"),
        (scenes::blobs_central(), "gradients from neighbouring pixels"),
        (methods::body_centred(), "body-centred and rectilinear lattices"),
        (methods::b_spline(), "kernels other than"),
        (methods::axis_sheets(), "classified before"),
        (methods::clipped_volume(), "boxes that are cut out"),
        (methods::sharp(), "sharp volumes"),
    ] {
        let error = drawn(&case).expect_err(case.name).to_string();
        assert!(error.contains(what), "{}: {error}", case.name);
    }
    assert!(CpuRenderer::new(&Scene::new()).is_err());
}
