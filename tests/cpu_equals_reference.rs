//! Scenes of every kind, drawn by the CPU engine and compared to the reference in double precision.

#[allow(dead_code, reason = "other tests use the rest")]
mod scenes;
mod testing;

use glam::DVec3;
use scenes::{Case, methods};
use splatkit::{
    cpu::CpuRenderer,
    math::Projection,
    picture::Picture,
    reference,
    scene::{Classification, Item, Mode, Order, Scene},
    volume::Volume,
};
use testing::psnr::measured;

fn drawn(case: &Case) -> Picture {
    let mut renderer = CpuRenderer::new(&case.scene).expect(case.name);
    renderer.render(&case.camera, &case.settings).expect(case.name).0
}

/// Asserts that both pictures of a case agree to `least` dB or better. Depths are compared where
/// the reference is clearly opaque; one in 50 may be off by more than 5 % of the scene.
fn assert_matches(case: &Case, least: f64) {
    let found = drawn(case);
    let truth = reference::render(&case.scene, &case.camera, &case.settings).expect(case.name);
    let psnr = measured(&found, &truth);
    println!("{}: {psnr:.1} dB", case.name);
    if let Ok(folder) = std::env::var("SPLATKIT_PICTURES") {
        let folder = std::path::Path::new(&folder);
        found
            .save(folder.join(format!("{}-cpu.png", case.name)), None)
            .expect("a folder to write to");
        truth
            .save(folder.join(format!("{}-reference.png", case.name)), None)
            .expect("a folder to write to");
    }
    assert!(psnr >= least, "{}: {psnr:.1} dB, expected {least} dB", case.name);
    // Depths of whole kernels and thick sheets are not compared: the engines place them at the
    // centres of kernels, and spread them evenly within a sheet.
    if case.settings.mode != Mode::Sheets || case.settings.sheet_thickness.is_some() {
        return;
    }
    let size = case.scene.bounds().diagonal() as f32;
    let opaque = || {
        let depths = found.depth.iter().zip(&truth.depth).zip(&truth.color);
        depths.filter(|((_, depth), color)| color[3] > 0.9 && depth.is_finite())
    };
    let far = opaque()
        .filter(|((found, expected), _)| (**found - **expected).abs() > 0.05 * size)
        .count();
    assert!(far * 50 <= opaque().count(), "{}: {far} of {} depths", case.name, opaque().count());
}

/// Minimum agreement of a gathered case, in dB. Gathering cuts kernels off at a cube of four
/// samples a side, the reference at the ball inside that cube. Up to 1 % of the weight lies between
/// the two. Steep functions and sharp surfaces on so coarse a lattice show this difference, and so
/// does light where gradients turn within a sheet. A broken sample, a hundred thousand times as
/// large as the others, shows it most of all.
fn least(name: &str) -> f64 {
    match name {
        "post_classified" | "isosurfaces_in_fog" => 48.0,
        "camera_inside_a_volume" | "clipped_volume" => 48.0,
        "two_volumes_post" | "two_volumes_with_isosurfaces" | "two_clipped_volumes" => 48.0,
        "surfels_in_two_volumes" | "clipped_surfels_in_two_volumes" => 48.0,
        "points_far_off" => 33.0,
        _ => 50.0,
    }
}

fn from_afar() -> Case {
    let mut afar = scenes::blobs_analytic();
    let away = afar.camera.position - afar.camera.focal_point;
    afar.camera.position = afar.camera.focal_point + 30.0 * away;
    afar.camera.projection = Projection::Perspective { view_angle: 1.0 };
    Case { name: "blobs_from_afar", ..afar }
}

#[test]
fn volumes() {
    let cases = [
        scenes::blobs_analytic(),
        scenes::blobs_central(),
        from_afar(),
        scenes::blobs_orthographic(),
        scenes::blobs_unshaded(),
        scenes::camera_inside_a_volume(),
        scenes::marschner_lobb(),
        scenes::sheared_lattice(),
        scenes::sheared_lattice_central(),
        scenes::constant_field(),
        methods::thin_shells(),
        methods::one_value_far_off(),
        methods::points_far_off(),
        methods::post_classified(),
        methods::orthographic(methods::post_classified()),
        methods::pre_classified(),
        methods::gradient_opacity(),
        methods::uncertain_light(),
        methods::one_isosurface(),
        methods::isosurfaces_in_fog(),
        methods::orthographic(methods::isosurfaces_in_fog()),
        methods::maximum(),
        methods::x_ray(),
        methods::clipped_volume(),
    ];
    for case in cases {
        assert_matches(&case, least(case.name));
    }
}

#[test]
fn other_lattices_and_kernels() {
    let cases = [
        methods::body_centred(),
        methods::body_centred_from_afar(),
        methods::rectilinear(),
        methods::orthographic(methods::rectilinear()),
        methods::orthographic(scenes::sheared_lattice()),
        methods::b_spline(),
        methods::table_of_a_gaussian(),
        methods::closed_form_of_that_gaussian(),
        methods::sharp(),
        methods::sharp_body_centred(),
    ];
    for case in cases {
        assert_matches(&case, 50.0);
    }
}

#[test]
fn splats() {
    let cases = [
        scenes::ellipsoids_in_perspective(),
        scenes::ellipsoids_orthographic(),
        scenes::ellipsoids_unlit(),
        scenes::ellipsoids_without_normals(),
        scenes::huge_among_small(),
        scenes::splats_below_a_pixel(),
        scenes::flat_discs_head_on(),
        scenes::camera_among_ellipsoids(),
        scenes::wide_angle(),
        scenes::scattered_samples(),
        scenes::scattered_samples_orthographic(),
        methods::samples_with_slopes(Classification::PreIntegrated),
        methods::samples_with_slopes(Classification::Pre),
        methods::orthographic(methods::samples_with_slopes(Classification::PreIntegrated)),
    ];
    for case in cases {
        assert_matches(&case, 50.0);
    }
}

#[test]
fn mixed_scenes() {
    for case in [
        scenes::surface_in_a_volume(),
        scenes::surface_in_a_volume_orthographic(),
        methods::clipped_surface_in_a_volume(),
    ] {
        assert_matches(&case, 50.0);
    }
}

#[test]
fn whole_kernels() {
    let mut in_sheets = methods::single_ellipsoids();
    in_sheets.settings.mode = Mode::AxisSheets;
    let inside = [
        methods::single_splats(Order::FrontToBack),
        methods::single_ellipsoids(),
        methods::axis_sheets(),
        in_sheets,
    ];
    let outside = [
        methods::axis_sheets(),
        methods::axis_sheets_body_centred_orthographic(),
        methods::single_ellipsoids(),
        methods::single_splats(Order::FrontToBack),
        methods::single_splats(Order::BackToFront),
    ];
    for case in outside.into_iter().chain(inside.map(methods::from_inside)) {
        assert_matches(&case, 50.0);
    }
}

/// Sheets thicker than the kernels' reach also mix in samples whose neighbourhood is invisible.
#[test]
fn thick_sheets() {
    for case in
        [scenes::blobs_analytic, methods::body_centred, methods::sharp, methods::rectilinear]
    {
        for samples in [1.9, 2.3, 4.0, 8.0, 1000.0] {
            let mut case = case();
            let Item::Volume(volume, ..) = &case.scene.items[0] else { panic!("{}", case.name) };
            case.settings.sheet_thickness = Some(samples * volume.lattice.kernel_spacing());
            if samples > 100.0 {
                case.settings.volume_shade = Some(None);
            }
            println!("{samples} samples:");
            assert_matches(&case, 50.0);
        }
    }
    // Seen along the short steps of a lattice whose steps along another axis are long.
    let mut flat = scenes::blobs_analytic();
    let Item::Volume(volume, kernel, transfer) = &flat.scene.items[0] else {
        panic!("{}", flat.name)
    };
    let mut volume = Volume::clone(volume);
    volume.lattice.axes.z_axis *= 8.0;
    volume.lattice.origin.z -= 7.0 * 19.0 * 0.05;
    flat.settings.sheet_thickness = Some(1.9 * volume.lattice.kernel_spacing());
    flat.scene = Scene::new().with_volume(volume, kernel.clone(), transfer.clone());
    flat.camera.position = flat.camera.focal_point + DVec3::new(12.0, 1.0, 2.0);
    assert_matches(&flat, 50.0);
}

/// Any number of threads draws the same bytes.
#[test]
fn threads_change_nothing() {
    for make in [
        scenes::marschner_lobb,
        scenes::huge_among_small,
        scenes::surface_in_a_volume,
        methods::body_centred,
    ] {
        let case = make();
        let with = |threads: usize| {
            let pool =
                rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| drawn(&case)).color
        };
        assert_eq!(with(1), with(3), "{}", case.name);
    }
}

#[test]
fn scenes_without_anything_are_refused() {
    assert!(CpuRenderer::new(&Scene::new()).is_err());
}

#[test]
fn gaussians() {
    for case in scenes::gaussians::all() {
        assert_matches(&case, 50.0);
    }
}

#[test]
fn facets() {
    for case in scenes::facets::all() {
        assert_matches(&case, 50.0);
    }
}

#[test]
fn several_fields() {
    for case in scenes::fields::all() {
        assert_matches(&case, least(case.name));
    }
}
