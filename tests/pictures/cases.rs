//! Scenes of every kind, drawn by both engines and compared to the reference in plain double
//! precision. The reference draws each case once for all of them.
//!
//! Unless they differ physically, they agree to 50 dB or better over premultiplied colour. That is
//! a root mean square difference of 0.8 of 255 levels, below what a person sees. The rest of the
//! difference comes from 32-bit arithmetic, the polynomial for the normal distribution (1e-4),
//! sheets thinner than a splat's tails (1e-3 of its mass), and rays that end early (5e-4).

use crate::{
    scenes::{self, Case, facets, fields, gaussians, methods},
    testing::{
        gpu::gpu,
        psnr::{measured, psnr},
    },
};
use glam::DVec3;
use splatkit::{
    cpu::CpuRenderer,
    gpu::{Gpu, Renderer},
    math::Projection,
    picture::Picture,
    reference,
    scene::{Classification, Evaluate, Gradient, Item, Mode, Optics, Order, Scene, Settings},
    volume::Volume,
};
use std::sync::OnceLock;

/// Minimum agreement of most pictures, in dB.
const LEAST: f64 = 50.0;

/// Minimum agreement of a picture that may be gathered, in dB. Gathering cuts kernels off at a cube
/// of four samples a side, the reference at the ball inside that cube. Up to 1 % of the weight lies
/// between the two. Steep functions and sharp surfaces on such coarse lattices show this
/// difference, and so does light where gradients turn within a sheet. A broken sample, a hundred
/// thousand times as large as the others, shows it most of all.
///
/// Ellipsoids around the eye, seen from their edges, turn either side to the lamp beside it.
fn least_of_gathered(name: &str) -> f64 {
    match name {
        "post_classified" | "isosurfaces_in_fog" => 48.0,
        "camera_inside_a_volume" | "clipped_volume" => 48.0,
        "camera_among_ellipsoids" => 49.0,
        "two_volumes_post" | "two_volumes_with_isosurfaces" | "two_clipped_volumes" => 48.0,
        "surfels_in_two_volumes" | "clipped_surfels_in_two_volumes" => 48.0,
        "points_far_off" => 33.0,
        _ => LEAST,
    }
}

/// Minimum agreement of the GPU engine's picture of facets, in dB. In a medium it draws them at the
/// back of their sheets, the reference where they lie in them.
fn least_of_facets(name: &str) -> f64 {
    match name {
        "facets_in_a_volume" | "facets_in_two_volumes" | "rods_among_others" => 44.0,
        "gaussians_among_everything" => 44.0,
        "camera_among_ellipsoids" => 49.0,
        _ => LEAST,
    }
}

/// The reference's pictures of a case, for fields that are gathered and scattered.
struct Truth {
    gathered: Picture,
    scattered: Picture,
}

impl Truth {
    fn new(case: &Case) -> Self {
        let drawn = |evaluate| {
            let settings = Settings { evaluate, ..case.settings.clone() };
            reference::render(&case.scene, &case.camera, &settings).expect(case.name)
        };
        let scattered = drawn(Evaluate::Scatter);
        // The two differ in the gradients of lattices, in sheets of 2.2 samples at most.
        let thickness = case.settings.sheet_thickness.unwrap_or_default();
        let differs = |item: &Item| match item {
            Item::Volume(volume, ..) => thickness <= 2.2 * volume.lattice.kernel_spacing(),
            Item::Bricks(..) => true,
            _ => false,
        };
        let is_analytic = case.settings.gradient == Gradient::Analytic;
        let differ = is_analytic && case.scene.items.iter().any(differs);
        let gathered = if differ { drawn(Evaluate::Gather) } else { scattered.clone() };
        Self { gathered, scattered }
    }

    fn of(&self, evaluate: Evaluate) -> &Picture {
        if evaluate == Evaluate::Scatter { &self.scattered } else { &self.gathered }
    }
}

/// The shared device in the guise of a discrete GPU. On a GPU, an invocation draws one pixel of a
/// tile; on a processor, a column of eight.
fn disguised() -> &'static Gpu {
    static DISGUISED: OnceLock<Gpu> = OnceLock::new();
    DISGUISED.get_or_init(|| {
        let shared = gpu();
        let info = wgpu::AdapterInfo {
            device_type: wgpu::DeviceType::DiscreteGpu,
            ..wgpu::AdapterInfo::clone(&shared.info)
        };
        Gpu::from_wgpu(shared.device.clone(), shared.queue.clone(), info)
    })
}

fn by_gpu(gpu: &Gpu, case: &Case, evaluate: Evaluate) -> splatkit::Result<Picture> {
    let mut renderer = Renderer::new(gpu);
    let mut prepared = renderer.prepare(&case.scene)?;
    let settings = Settings { evaluate, ..case.settings.clone() };
    let (picture, _) = renderer.render(&mut prepared, &case.camera, &settings)?;
    if gpu.is_software() {
        return Ok(picture);
    }
    let (again, _) = renderer.render(&mut prepared, &case.camera, &settings)?;
    assert_eq!(bits(&picture), bits(&again), "{}", case.name);
    Ok(picture)
}

fn bits(picture: &Picture) -> Vec<u32> {
    picture.color.iter().flatten().chain(&picture.depth).map(|v| v.to_bits()).collect()
}

/// Asserts that each engine, and each method that the GPU engine has for the case, agrees with the
/// reference. Scattered pictures of the GPU engine agree to `least` dB or better. The disguised
/// device draws the case too, in the ways of `as_a_gpu`.
fn check(case: &Case, least: f64, as_a_gpu: &[Evaluate]) {
    let truth = Truth::new(case);
    assert_shows_something(case, &truth.scattered);
    save(case, "reference", &truth.scattered);
    let evaluate = case.settings.evaluate;

    let mut renderer = CpuRenderer::new(&case.scene).expect(case.name);
    let picture = renderer.render(&case.camera, &case.settings).expect(case.name).0;
    save(case, "cpu", &picture);
    let agreement = measured(&picture, truth.of(evaluate));
    assert_agrees(case, "by the CPU", agreement, least_of_gathered(case.name));
    assert_most_depths_agree(case, &picture, truth.of(evaluate));

    if let Some(what) = case.scene.beyond_gpu() {
        let error = by_gpu(gpu(), case, evaluate).expect_err(case.name).to_string();
        assert!(error.contains(&what), "{}: {error}", case.name);
        return;
    }
    let least = least.min(least_of_facets(case.name));
    let picture = by_gpu(gpu(), case, Evaluate::Scatter).expect(case.name);
    save(case, "scattered", &picture);
    assert_agrees(case, "scattered", psnr(&picture, &truth.scattered), least);
    match by_gpu(gpu(), case, Evaluate::Gather) {
        Ok(picture) => {
            let least = least.min(least_of_gathered(case.name));
            save(case, "gathered", &picture);
            assert_agrees(case, "gathered", psnr(&picture, &truth.gathered), least);
            assert_depths_agree(case, &picture, &truth.gathered);
        }
        Err(error) if error.to_string().contains("can't be gathered") => {}
        Err(error) => panic!("{}: {error}", case.name),
    }
    for &evaluate in as_a_gpu {
        let picture = by_gpu(disguised(), case, evaluate).expect(case.name);
        let agreement = psnr(&picture, truth.of(evaluate));
        assert_agrees(case, "as on a GPU", agreement, least_of_gathered(case.name));
    }
}

fn assert_agrees(case: &Case, way: &str, agreement: f64, least: f64) {
    println!("{} {way}: {agreement:.1} dB", case.name);
    assert!(agreement >= least, "{} {way}: {agreement:.1} dB, expected {least} dB", case.name);
}

/// Saves a picture to the folder that `SPLATKIT_PICTURES` names.
fn save(case: &Case, way: &str, picture: &Picture) {
    if let Ok(folder) = std::env::var("SPLATKIT_PICTURES") {
        let path = std::path::Path::new(&folder).join(format!("{}-{way}.png", case.name));
        picture.save(path, None).expect("a folder to write to");
    }
}

/// The depths of both pictures where the reference is clearly opaque. Near an opacity of one half,
/// a difference of 1e-4 in opacity moves the depth by any amount.
fn depths<'a>(
    picture: &'a Picture,
    expected: &'a Picture,
) -> impl Iterator<Item = (f32, f32)> + use<'a> {
    let depths = picture.depth.iter().zip(&expected.depth).zip(&expected.color);
    let opaque = depths.filter(|((_, depth), color)| color[3] > 0.9 && depth.is_finite());
    opaque.map(|((depth, expected), _)| (*depth, *expected))
}

/// Asserts that all depths are off by less than 5 % of the scene.
fn assert_depths_agree(case: &Case, picture: &Picture, expected: &Picture) {
    let size = case.scene.bounds().diagonal() as f32;
    for (depth, expected) in depths(picture, expected) {
        let name = case.name;
        assert!((depth - expected).abs() < 0.05 * size, "{name}: depth {depth} for {expected}");
    }
}

/// Asserts that at most one depth in 50 is off by more than 5 % of the scene.
fn assert_most_depths_agree(case: &Case, picture: &Picture, expected: &Picture) {
    // Depths of whole kernels and thick sheets are not compared: the engines place them at the
    // centres of kernels, and spread them evenly within a sheet.
    if case.settings.mode != Mode::Sheets || case.settings.sheet_thickness.is_some() {
        return;
    }
    let size = case.scene.bounds().diagonal() as f32;
    let is_far = |&(depth, expected): &(f32, f32)| (depth - expected).abs() > 0.05 * size;
    let far = depths(picture, expected).filter(is_far).count();
    let all = depths(picture, expected).count();
    assert!(far * 50 <= all, "{}: {far} of {all} depths", case.name);
}

/// Asserts that a picture shows something. Its colours must be numbers, neither all alike nor
/// nearly all empty, and its depths must fit its opacities.
fn assert_shows_something(Case { name, scene, settings, .. }: &Case, picture: &Picture) {
    let [width, height] = settings.size;
    assert_eq!(
        (picture.color.len(), picture.depth.len()),
        ((width * height) as usize, (width * height) as usize)
    );
    // Trained Gaussians may be brighter than white.
    let most = if scene.items.iter().any(Item::is_trained) { 8.0 } else { 1.0 };
    let range = f32::EPSILON..=most + 4.0 * f32::EPSILON;
    let mut covered = 0;
    let mut deep = 0;
    // The maximum along a ray has no depth.
    let has_depths = settings.optics != Optics::Maximum;
    for (color, &depth) in picture.color.iter().zip(&picture.depth) {
        assert!(
            color.iter().all(|v| *v == 0.0 || range.contains(v) || v.abs() < 1e-6),
            "{name}: {color:?}"
        );
        let is_opaque = has_depths && color[3] > 0.500_001;
        assert!(is_opaque <= depth.is_finite(), "{name}: depth {depth} at opacity {}", color[3]);
        assert!(
            (color[3] < 0.499_999) <= (depth == f32::INFINITY),
            "{name}: depth {depth} at opacity {}",
            color[3]
        );
        covered += usize::from(color[3] > 0.05);
        deep += usize::from(depth.is_finite());
    }
    let mut greens: Vec<u8> = picture.color.iter().map(|color| (color[1] * 255.0) as u8).collect();
    greens.sort_unstable();
    greens.dedup();
    let share = covered as f64 / picture.color.len() as f64;
    assert!(share > 0.2, "{name}: only {share:.2} of the picture is covered");
    assert!(!has_depths || deep > 0, "{name}: nothing is opaque");
    assert!(greens.len() > 30, "{name}: only {} shades", greens.len());
}

/// Makes a test of each case, and says in which ways the disguised device draws it too.
macro_rules! cases {
    (ways $ways:expr) => { &$ways };
    (ways) => { &[] };
    ($($name:ident: $case:expr $(, as a GPU $ways:expr)?;)*) => {
        $(
            #[test]
            fn $name() {
                check(&$case, LEAST, cases!(ways $($ways)?));
            }
        )*
    };
}

const AUTO: [Evaluate; 1] = [Evaluate::Auto];
const SCATTER: [Evaluate; 1] = [Evaluate::Scatter];
const BOTH: [Evaluate; 2] = [Evaluate::Auto, Evaluate::Scatter];

cases! {
    ellipsoids_in_perspective: scenes::ellipsoids_in_perspective(), as a GPU AUTO;
    ellipsoids_orthographic: scenes::ellipsoids_orthographic();
    ellipsoids_unlit: scenes::ellipsoids_unlit();
    ellipsoids_without_normals: scenes::ellipsoids_without_normals();
    huge_among_small: scenes::huge_among_small(), as a GPU AUTO;
    splats_below_a_pixel: scenes::splats_below_a_pixel();
    flat_discs_head_on: scenes::flat_discs_head_on();
    camera_among_ellipsoids: scenes::camera_among_ellipsoids();
    wide_angle: scenes::wide_angle();
}

cases! {
    scattered_samples: scenes::scattered_samples(), as a GPU AUTO;
    scattered_samples_orthographic: scenes::scattered_samples_orthographic();
    samples_with_slopes: methods::samples_with_slopes(Classification::PreIntegrated);
    samples_with_slopes_pre_classified: methods::samples_with_slopes(Classification::Pre);
}

cases! {
    blobs_analytic: scenes::blobs_analytic(), as a GPU BOTH;
    blobs_central: scenes::blobs_central(), as a GPU AUTO;
    blobs_from_afar: from_afar();
    blobs_orthographic: scenes::blobs_orthographic();
    blobs_unshaded: scenes::blobs_unshaded();
    camera_inside_a_volume: scenes::camera_inside_a_volume();
    marschner_lobb: scenes::marschner_lobb();
    sheared_lattice: scenes::sheared_lattice();
    sheared_lattice_central: scenes::sheared_lattice_central();
    constant_field: scenes::constant_field();
    body_centred: methods::body_centred();
    body_centred_from_afar: methods::body_centred_from_afar();
    rectilinear: methods::rectilinear(), as a GPU SCATTER;
    sharp: methods::sharp();
    sharp_body_centred: methods::sharp_body_centred(), as a GPU SCATTER;
    b_spline: methods::b_spline();
    table_of_a_gaussian: methods::table_of_a_gaussian(), as a GPU SCATTER;
    closed_form_of_that_gaussian: methods::closed_form_of_that_gaussian();
}

// Slopes, and gradients of kernels that are not round, are vectors across the ray.
cases! {
    samples_with_slopes_orthographic:
        methods::orthographic(methods::samples_with_slopes(Classification::PreIntegrated));
    rectilinear_orthographic: methods::orthographic(methods::rectilinear());
    sheared_lattice_orthographic: methods::orthographic(scenes::sheared_lattice());
}

cases! {
    thin_shells: methods::thin_shells();
    one_value_far_off: methods::one_value_far_off();
    points_far_off: methods::points_far_off();
    post_classified: methods::post_classified();
    post_classified_orthographic: methods::orthographic(methods::post_classified());
    pre_classified: methods::pre_classified();
    gradient_opacity: methods::gradient_opacity();
    uncertain_light: methods::uncertain_light();
    one_isosurface: methods::one_isosurface();
    isosurfaces_in_fog: methods::isosurfaces_in_fog(), as a GPU AUTO;
    maximum: methods::maximum(), as a GPU AUTO;
    x_ray: methods::x_ray();
    clipped_volume: methods::clipped_volume();
}

cases! {
    surface_in_a_volume: scenes::surface_in_a_volume(), as a GPU BOTH;
    surface_in_a_volume_orthographic: scenes::surface_in_a_volume_orthographic();
    clipped_surface_in_a_volume: methods::clipped_surface_in_a_volume(), as a GPU AUTO;
}

// A whole kernel counts if its centre is in front of the eye.
cases! {
    axis_sheets: methods::axis_sheets(), as a GPU AUTO;
    axis_sheets_body_centred_orthographic: methods::axis_sheets_body_centred_orthographic();
    axis_sheets_from_inside: methods::from_inside(methods::axis_sheets());
    single_ellipsoids: methods::single_ellipsoids();
    single_ellipsoids_from_inside: methods::from_inside(methods::single_ellipsoids());
    single_ellipsoids_in_sheets_from_inside: methods::from_inside(ellipsoids_in_axis_sheets());
    single_splats_front_to_back: methods::single_splats(Order::FrontToBack);
    single_splats_back_to_front: methods::single_splats(Order::BackToFront), as a GPU AUTO;
    single_splats_from_inside: methods::from_inside(methods::single_splats(Order::FrontToBack));
}

/// The blobs from far away. Their samples take the isotropic path, in which sections are the same
/// for all pixels of a footprint.
fn from_afar() -> Case {
    let mut case = scenes::blobs_analytic();
    let away = case.camera.position - case.camera.focal_point;
    case.camera.position = case.camera.focal_point + 30.0 * away;
    case.camera.projection = Projection::Perspective { view_angle: 1.0 };
    Case { name: "blobs_from_afar", ..case }
}

fn ellipsoids_in_axis_sheets() -> Case {
    let mut case = methods::single_ellipsoids();
    case.settings.mode = Mode::AxisSheets;
    case
}

#[test]
fn trained_gaussians() {
    gaussians::all().iter().for_each(|case| check(case, LEAST, &[]));
}

#[test]
fn facets() {
    facets::all().iter().for_each(|case| check(case, LEAST, &[]));
}

/// Scenes of several fields. The GPU engine refuses a few.
#[test]
fn several_fields() {
    let cases = fields::all();
    let drawn = cases.iter().filter(|case| case.scene.beyond_gpu().is_none()).count();
    assert!(drawn > 12, "{drawn} scenes");
    for case in cases {
        let as_a_gpu = ["two_volumes", "four_without_cells"].contains(&case.name);
        check(&case, LEAST, if as_a_gpu { &SCATTER } else { &[] });
    }
}

/// Sheets thicker than the kernels' reach also mix in samples whose neighbourhood is invisible. A
/// single sheet is not lit: it begins and ends in the tails of kernels, which have hardly any
/// slope.
fn check_thick_sheets(make: fn() -> Case) {
    for samples in [1.9, 2.1, 2.3, 4.0, 8.0, 1000.0] {
        let mut case = make();
        let Item::Volume(volume, ..) = &case.scene.items[0] else { panic!("{}", case.name) };
        case.settings.sheet_thickness = Some(samples * volume.lattice.kernel_spacing());
        if samples > 100.0 {
            case.settings.volume_shade = Some(None);
        }
        println!("{samples} samples:");
        check(&case, 60.0, &[]);
    }
}

#[test]
fn thick_sheets() {
    check_thick_sheets(scenes::blobs_analytic);
}

#[test]
fn thick_sheets_body_centred() {
    check_thick_sheets(methods::body_centred);
}

#[test]
fn thick_sheets_sharp() {
    check_thick_sheets(methods::sharp);
}

#[test]
fn thick_sheets_rectilinear() {
    check_thick_sheets(methods::rectilinear);
}

/// Seen along the short steps of a lattice whose steps along another axis are long.
#[test]
fn thick_sheets_of_a_flat_lattice() {
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
    check(&flat, 60.0, &[]);
}
