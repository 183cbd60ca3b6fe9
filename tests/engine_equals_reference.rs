//! Scenes of every kind, drawn by the GPU engine and compared to the reference in plain double
//! precision.
//!
//! Unless they differ physically, the two agree to 50 dB or better over premultiplied colour. That
//! is a root mean square difference of 0.8 of 255 levels, below what a person sees. The rest of the
//! difference comes from 32-bit arithmetic, the polynomial for the normal distribution (1e-4),
//! sheets thinner than a splat's tails (1e-3 of its mass), and rays that end early (5e-4).

mod scenes;
mod testing;

use glam::DVec3;
use scenes::{Case, fields, methods};
use splatkit::{
    gpu::{AdapterChoice, Budget, Gpu, Renderer},
    math::{Kernel, Tensor},
    picture::Picture,
    reference,
    scene::{Classification, Evaluate, Item, Mode, Optics, Order, Scene, Settings},
    volume::{Lattice, Samples, TransferFunction, Volume},
};
use testing::psnr::psnr;

/// Draws the case with its own settings, by which the engine usually chooses how to fill sheets.
fn drawn(case: &Case, budget: Budget) -> Picture {
    drawn_by(case.settings.evaluate, case, budget).expect(case.name)
}

fn drawn_by(evaluate: Evaluate, case: &Case, budget: Budget) -> splatkit::Result<Picture> {
    let gpu = Gpu::headless(&AdapterChoice::Automatic).expect("a GPU, or a software driver");
    let mut renderer = Renderer::with_budget(&gpu, budget);
    let mut prepared = renderer.prepare(&case.scene)?;
    let settings = Settings { evaluate, ..case.settings.clone() };
    Ok(renderer.render(&mut prepared, &case.camera, &settings)?.0)
}

/// The case with a given way to fill sheets.
fn by(evaluate: Evaluate, case: Case) -> Case {
    Case { settings: Settings { evaluate, ..case.settings.clone() }, ..case }
}

/// Minimum agreement of a gathered picture, in dB. Gathering cuts kernels off at a cube of four
/// samples a side, the reference at the ball inside that cube. Up to 1 % of the weight lies between
/// the two. Steep functions and sharp surfaces on such coarse lattices show this difference, and so
/// does light where gradients turn within a sheet. A broken sample, a hundred thousand times as
/// large as the others, shows it most of all.
fn least_of_gathered(name: &str) -> f64 {
    match name {
        "post_classified" | "isosurfaces_in_fog" => 48.0,
        "camera_inside_a_volume" | "clipped_volume" => 48.0,
        "points_far_off" => 33.0,
        _ => 50.0,
    }
}

/// The blobs from far away. Their samples take the isotropic path, in which sections are the same
/// for all pixels of a footprint.
#[test]
fn blobs_from_afar() {
    let mut case = scenes::blobs_analytic();
    let away = case.camera.position - case.camera.focal_point;
    case.camera.position = case.camera.focal_point + 30.0 * away;
    case.camera.projection = splatkit::math::Projection::Perspective { view_angle: 1.0 };
    assert_matches(Case { name: "blobs_from_afar", ..case }, 50.0);
}

/// Draws a case by the reference, and by every method that the GPU engine has for it. Asserts that
/// each picture agrees with the reference to `least` dB or better.
fn assert_matches(case: Case, least: f64) {
    let truth = |evaluate| {
        let settings = Settings { evaluate, ..case.settings.clone() };
        reference::render(&case.scene, &case.camera, &settings).expect(case.name)
    };
    let expected = truth(Evaluate::Scatter);
    assert_shows_something(&case, &expected);
    let gathered = match drawn_by(Evaluate::Gather, &case, Budget::default()) {
        Ok(picture) => Some((picture, "gathered", least.min(least_of_gathered(case.name)))),
        Err(error) if error.to_string().contains("can't be gathered") => None,
        Err(error) => panic!("{}: {error}", case.name),
    };
    let scattered = drawn_by(Evaluate::Scatter, &case, Budget::default()).expect(case.name);
    assert_agrees(&case, "scattered", &scattered, &expected, least);
    if let Some((found, way, least)) = gathered {
        assert_agrees(&case, way, &found, &truth(Evaluate::Gather), least);
    }
}

/// Depths of gathered pictures are compared where the reference is clearly opaque. Near an opacity
/// of one half, a difference of 1e-4 in opacity moves the depth by any amount.
fn assert_agrees(case: &Case, way: &str, found: &Picture, expected: &Picture, least: f64) {
    let agreement = psnr(found, expected);
    println!("{} {way}: {agreement:.1} dB", case.name);
    if let Ok(folder) = std::env::var("SPLATKIT_PICTURES") {
        let folder = std::path::Path::new(&folder);
        found
            .save(folder.join(format!("{}-{way}.png", case.name)), None)
            .expect("a folder to write to");
        expected
            .save(folder.join(format!("{}-reference.png", case.name)), None)
            .expect("a folder to write to");
    }
    assert!(agreement >= least, "{} {way}: {agreement:.1} dB, expected {least} dB", case.name);
    let size = case.scene.bounds().diagonal() as f32;
    for ((found, expected), color) in found.depth.iter().zip(&expected.depth).zip(&expected.color) {
        if way == "gathered" && color[3] > 0.9 && expected.is_finite() {
            assert!(
                (found - expected).abs() < 0.05 * size,
                "{}: depth {found} for {expected}",
                case.name
            );
        }
    }
}

/// Volumes on Cartesian lattices are gathered, also among surfaces. For other scenes, the error
/// names the reason. Pictures alone would not show whether a scene was gathered.
#[test]
fn what_is_gathered_and_what_is_not() {
    for case in [
        scenes::blobs_analytic(),
        scenes::blobs_orthographic(),
        scenes::camera_inside_a_volume(),
        scenes::surface_in_a_volume(),
        scenes::surface_in_a_volume_orthographic(),
        methods::maximum(),
        methods::x_ray(),
        methods::gradient_opacity(),
        methods::uncertain_light(),
        methods::isosurfaces_in_fog(),
        methods::clipped_volume(),
        methods::clipped_surface_in_a_volume(),
    ] {
        let gpu = Gpu::headless(&AdapterChoice::Automatic).expect("a GPU, or a software driver");
        let mut renderer = Renderer::new(&gpu);
        let mut prepared = renderer.prepare(&case.scene).expect(case.name);
        let mut draw = |evaluate| {
            let settings = Settings { evaluate, ..case.settings.clone() };
            renderer.draw(&mut prepared, &case.camera, &settings).expect(case.name)
        };
        // Draw by both methods twice, so that each also follows the other in one prepared scene.
        for _ in 0..2 {
            let [auto, scattered] = [draw(Evaluate::Auto), draw(Evaluate::Scatter)];
            assert!(auto.gathered > 0 && scattered.gathered == 0, "{}: {auto:?}", case.name);
            assert!(auto.splats < scattered.splats, "{}: {auto:?}", case.name);
        }
    }
    for (case, what) in [
        (scenes::ellipsoids_in_perspective(), "without a volume"),
        (scenes::scattered_samples(), "without a volume"),
        (scenes::blobs_central(), "neighbouring pixels"),
        (methods::body_centred(), "body-centred"),
        (methods::rectilinear(), "rectilinear"),
        (methods::b_spline(), "kernels other than"),
        (methods::pre_classified(), "classified before"),
        (methods::axis_sheets(), "classified before"),
        (methods::sharp(), "sharp volumes"),
        (fields::two_volumes(), "several fields"),
        (thick(4.0), "sheets thicker"),
    ] {
        let error =
            drawn_by(Evaluate::Gather, &case, Budget::default()).expect_err(case.name).to_string();
        assert!(
            error.contains(what) && error.contains("can't be gathered"),
            "{}: {error}",
            case.name
        );
    }
}

/// The blobs in sheets that are `samples` samples thick.
fn thick(samples: f64) -> Case {
    let mut case = scenes::blobs_analytic();
    let Item::Volume(volume, ..) = &case.scene.items[0] else { panic!("{}", case.name) };
    case.settings.sheet_thickness = Some(samples * volume.lattice.kernel_spacing());
    case
}

/// Samples of every type, counts that don't fill whole words, and fewer samples along an axis than
/// a kernel reaches.
#[test]
fn samples_of_all_types_and_few() {
    let case = scenes::blobs_analytic();
    let Item::Volume(volume, kernel, transfer) = &case.scene.items[0] else {
        panic!("{}", case.name)
    };
    let values: Vec<f32> =
        (0..volume.lattice.len()).map(|index| volume.value(index) as f32).collect();
    let with = |samples: Samples, dims: [usize; 3]| {
        let lattice = Lattice { dims, ..volume.lattice.clone() };
        Volume::new(lattice, samples).expect("a volume")
    };
    let dims = volume.lattice.dims;
    let part = |dims: [usize; 3]| {
        let own = |index: usize| {
            let at = [index % dims[0], index / dims[0] % dims[1], index / dims[0] / dims[1]]
                .map(|n| n + 6);
            values[(at[2] * volume.lattice.dims[1] + at[1]) * volume.lattice.dims[0] + at[0]]
        };
        (0..dims.iter().product()).map(own).collect::<Vec<f32>>()
    };
    let volumes = [
        with(Samples::U8(values.iter().map(|v| *v as u8).collect()), dims),
        with(Samples::U16(values.iter().map(|v| *v as u16).collect()), dims),
        with(Samples::I16(values.iter().map(|v| *v as i16).collect()), dims),
        with(Samples::I32(values.iter().map(|v| *v as i32).collect()), dims),
        with(Samples::F32(values.clone()), dims),
        with(Samples::U8(part([7, 5, 6]).iter().map(|v| *v as u8).collect()), [7, 5, 6]),
        with(Samples::U16(part([3, 7, 5]).iter().map(|v| *v as u16).collect()), [3, 7, 5]),
        with(Samples::F32(part([7, 2, 3])), [7, 2, 3]),
        with(Samples::U8(part([5, 9, 1]).iter().map(|v| *v as u8).collect()), [5, 9, 1]),
    ];
    for volume in volumes {
        let name = format!("{:?} {:?}", volume.samples.scalar(), volume.lattice.dims);
        let scene = Scene::new().with_volume(volume, kernel.clone(), transfer.clone());
        let mut case = Case { name: "samples", scene, ..scenes::blobs_analytic() };
        case.camera.focal_point = case.scene.bounds().center();
        let [gathered, scattered] = [Evaluate::Gather, Evaluate::Scatter]
            .map(|evaluate| drawn_by(evaluate, &case, Budget::default()).expect(&name));
        let agreement = psnr(&gathered, &scattered);
        println!("{name}: {agreement:.1} dB");
        assert!(gathered.color.iter().any(|color| color[3] > 0.1), "{name}");
        assert!(agreement > 50.0, "{name}: {agreement:.1} dB");
    }
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

#[test]
fn ellipsoids_in_perspective() {
    assert_matches(scenes::ellipsoids_in_perspective(), 50.0);
}

#[test]
fn ellipsoids_orthographic() {
    assert_matches(scenes::ellipsoids_orthographic(), 50.0);
}

#[test]
fn ellipsoids_unlit() {
    assert_matches(scenes::ellipsoids_unlit(), 50.0);
}

#[test]
fn ellipsoids_without_normals() {
    assert_matches(scenes::ellipsoids_without_normals(), 50.0);
}

#[test]
fn gaussians() {
    for case in scenes::gaussians::all() {
        assert_matches(case, 50.0);
    }
}

/// Pages that a view does not need keep the colours for an earlier eye until a view needs them.
#[test]
fn pages_of_gaussians_follow_the_eye() {
    let levels = |case: &Case| case.name == "levels_of_gaussians";
    let Case { scene, camera, settings, .. } =
        scenes::gaussians::all().into_iter().find(levels).expect("the case");
    let mut moved = camera.clone();
    moved.position = camera.focal_point + DVec3::X * camera.position.distance(camera.focal_point);
    let mut away = moved.clone();
    away.focal_point = 2.0 * moved.position - camera.focal_point;
    let gpu = Gpu::headless(&AdapterChoice::Automatic).expect("a GPU, or a software driver");
    let mut renderer = Renderer::with_budget(&gpu, Budget::default());
    let mut prepared = renderer.prepare(&scene).expect("prepared");
    let mut draw = |camera| renderer.render(&mut prepared, camera, &settings).expect("a picture").0;
    draw(&camera);
    draw(&away);
    let found = draw(&moved);
    let expected = reference::render(&scene, &moved, &settings).expect("a picture");
    let agreement = psnr(&found, &expected);
    assert!(agreement > 50.0, "{agreement:.1} dB");
}

#[test]
fn facets() {
    for case in scenes::facets::all() {
        assert_matches(case, 50.0);
    }
}

#[test]
fn huge_among_small() {
    assert_matches(scenes::huge_among_small(), 50.0);
}

#[test]
fn splats_below_a_pixel() {
    assert_matches(scenes::splats_below_a_pixel(), 50.0);
}

#[test]
fn flat_discs_head_on() {
    assert_matches(scenes::flat_discs_head_on(), 50.0);
}

#[test]
fn camera_among_ellipsoids() {
    assert_matches(scenes::camera_among_ellipsoids(), 50.0);
}

#[test]
fn wide_angle() {
    assert_matches(scenes::wide_angle(), 50.0);
}

#[test]
fn scattered_samples() {
    assert_matches(scenes::scattered_samples(), 50.0);
}

#[test]
fn scattered_samples_orthographic() {
    assert_matches(scenes::scattered_samples_orthographic(), 50.0);
}

#[test]
fn blobs_analytic() {
    assert_matches(scenes::blobs_analytic(), 50.0);
}

#[test]
fn blobs_central() {
    assert_matches(scenes::blobs_central(), 50.0);
}

#[test]
fn blobs_orthographic() {
    assert_matches(scenes::blobs_orthographic(), 50.0);
}

#[test]
fn blobs_unshaded() {
    assert_matches(scenes::blobs_unshaded(), 50.0);
}

#[test]
fn camera_inside_a_volume() {
    assert_matches(scenes::camera_inside_a_volume(), 50.0);
}

#[test]
fn marschner_lobb() {
    assert_matches(scenes::marschner_lobb(), 50.0);
}

#[test]
fn sheared_lattice() {
    assert_matches(scenes::sheared_lattice(), 50.0);
}

#[test]
fn sheared_lattice_central() {
    assert_matches(scenes::sheared_lattice_central(), 50.0);
}

#[test]
fn constant_field() {
    assert_matches(scenes::constant_field(), 50.0);
}

#[test]
fn surface_in_a_volume() {
    assert_matches(scenes::surface_in_a_volume(), 50.0);
}

#[test]
fn surface_in_a_volume_orthographic() {
    assert_matches(scenes::surface_in_a_volume_orthographic(), 50.0);
}

#[test]
fn body_centred() {
    assert_matches(methods::body_centred(), 50.0);
}

#[test]
fn body_centred_from_afar() {
    assert_matches(methods::body_centred_from_afar(), 50.0);
}

#[test]
fn rectilinear() {
    assert_matches(methods::rectilinear(), 50.0);
}

#[test]
fn b_spline() {
    assert_matches(methods::b_spline(), 50.0);
}

#[test]
fn table_of_a_gaussian() {
    assert_matches(methods::table_of_a_gaussian(), 50.0);
}

#[test]
fn thin_shells() {
    assert_matches(methods::thin_shells(), 50.0);
}

#[test]
fn one_value_far_off() {
    assert_matches(methods::one_value_far_off(), 50.0);
}

#[test]
fn points_far_off() {
    assert_matches(methods::points_far_off(), 50.0);
}

#[test]
fn post_classified() {
    assert_matches(methods::post_classified(), 50.0);
}

#[test]
fn pre_classified() {
    assert_matches(methods::pre_classified(), 50.0);
}

#[test]
fn axis_sheets() {
    assert_matches(methods::axis_sheets(), 50.0);
}

#[test]
fn axis_sheets_body_centred_orthographic() {
    assert_matches(methods::axis_sheets_body_centred_orthographic(), 50.0);
}

#[test]
fn single_ellipsoids() {
    assert_matches(methods::single_ellipsoids(), 50.0);
}

/// Sheets thicker than the kernels' reach also mix in samples whose neighbourhood is invisible. A
/// single sheet is not lit: it begins and ends in the tails of kernels, which have hardly any
/// slope.
#[test]
fn thick_sheets() {
    for case in
        [scenes::blobs_analytic, methods::body_centred, methods::sharp, methods::rectilinear]
    {
        for samples in [1.9, 2.1, 4.0, 8.0, 1000.0] {
            let mut case = case();
            let Item::Volume(volume, ..) = &case.scene.items[0] else { panic!("{}", case.name) };
            case.settings.sheet_thickness = Some(samples * volume.lattice.kernel_spacing());
            if samples > 100.0 {
                case.settings.volume_shade = Some(None);
            }
            println!("{samples} samples:");
            assert_matches(case, 60.0);
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
    assert_matches(flat, 60.0);
}

#[test]
fn gradient_opacity() {
    assert_matches(methods::gradient_opacity(), 50.0);
    assert_matches(methods::uncertain_light(), 50.0);
}

#[test]
fn one_isosurface() {
    assert_matches(methods::one_isosurface(), 50.0);
}

#[test]
fn isosurfaces_in_fog() {
    assert_matches(methods::isosurfaces_in_fog(), 50.0);
}

#[test]
fn maximum() {
    assert_matches(methods::maximum(), 50.0);
}

#[test]
fn x_ray() {
    assert_matches(methods::x_ray(), 50.0);
}

#[test]
fn clipped_volume() {
    assert_matches(methods::clipped_volume(), 50.0);
}

#[test]
fn clipped_surface_in_a_volume() {
    assert_matches(methods::clipped_surface_in_a_volume(), 50.0);
}

#[test]
fn sharp() {
    assert_matches(methods::sharp(), 50.0);
}

#[test]
fn sharp_body_centred() {
    assert_matches(methods::sharp_body_centred(), 50.0);
}

#[test]
fn single_splats_in_both_orders() {
    let [front, back] = [Order::FrontToBack, Order::BackToFront].map(|order| {
        let case = methods::single_splats(order);
        let found = drawn(&case, Budget::default());
        let expected =
            reference::render(&case.scene, &case.camera, &case.settings).expect(case.name);
        let agreement = psnr(&found, &expected);
        println!("{order:?}: {agreement:.1} dB");
        assert!(agreement > 50.0, "{order:?}: {agreement:.1} dB");
        found
    });
    // Rays that end early leave up to 5e-4 of the light.
    let agreement = psnr(&front, &back);
    println!("front to back and back to front: {agreement:.1} dB");
    assert!(agreement > 60.0, "{agreement:.1} dB");
}

#[test]
fn samples_with_slopes_and_weights() {
    for classification in [Classification::PreIntegrated, Classification::Pre] {
        assert_matches(methods::samples_with_slopes(classification), 50.0);
    }
}

/// Slopes, and gradients of kernels that are not round, are vectors across the ray.
#[test]
fn slopes_and_gradients_orthographic() {
    let samples = methods::samples_with_slopes(Classification::PreIntegrated);
    for case in [samples, methods::rectilinear(), scenes::sheared_lattice()] {
        assert_matches(methods::orthographic(case), 50.0);
    }
}

/// A whole kernel counts if its centre is in front of the eye.
#[test]
fn whole_kernels_from_inside() {
    let mut in_sheets = methods::single_ellipsoids();
    in_sheets.settings.mode = Mode::AxisSheets;
    let splats = methods::single_splats(Order::FrontToBack);
    for case in [splats, methods::single_ellipsoids(), methods::axis_sheets(), in_sheets] {
        assert_matches(methods::from_inside(case), 50.0);
    }
}

/// Compares Westover's table, with one more axis, to the closed form.
#[test]
fn the_section_table_agrees_with_the_closed_form() {
    let [table, closed] = [methods::table_of_a_gaussian(), methods::closed_form_of_that_gaussian()]
        .map(|case| drawn(&case, Budget::default()));
    let agreement = psnr(&table, &closed);
    println!("table to closed form: {agreement:.1} dB");
    assert!(agreement > 60.0, "{agreement:.1} dB");
}

/// A frame that does not fit in one pass is drawn in several. The picture is the same, except that
/// sums are rounded differently at the seams between passes.
#[test]
fn small_budgets_draw_the_same_picture() {
    let gpu = Gpu::headless(&AdapterChoice::Automatic).expect("a GPU, or a software driver");
    let cases = [
        (scenes::ellipsoids_in_perspective(), 700, 700),
        (by(Evaluate::Scatter, scenes::blobs_analytic()), 20_000, 16_000),
        (by(Evaluate::Scatter, scenes::surface_in_a_volume()), 20_000, 16_000),
        (by(Evaluate::Gather, scenes::surface_in_a_volume()), 700, 700),
        (fields::two_volumes(), 20_000, 16_000),
    ];
    for (case, few_entries, few_words) in cases {
        let whole = drawn(&case, Budget::default());
        for (entries, record_words) in
            [(few_entries, 1 << 22), (1 << 24, few_words), (few_entries, few_words)]
        {
            let mut renderer =
                Renderer::with_budget(&gpu, Budget { entries, record_words, ..Budget::default() });
            let mut prepared = renderer.prepare(&case.scene).expect(case.name);
            let (parts, stats) =
                renderer.render(&mut prepared, &case.camera, &case.settings).expect(case.name);
            assert!(stats.passes > 1, "{}: {entries} entries fit in one pass", case.name);
            let agreement = psnr(&parts, &whole);
            println!("{}: {} passes, {agreement:.1} dB", case.name, stats.passes);
            assert!(
                agreement > 90.0,
                "{}: {agreement:.1} dB in {} passes",
                case.name,
                stats.passes
            );
        }
    }
}

/// On a GPU an invocation draws one pixel of a tile, on a processor a column of eight. If the
/// software driver is presented as a GPU, the engine draws as on a GPU.
#[test]
fn the_gpus_way_is_the_same() {
    let cases = [
        scenes::ellipsoids_in_perspective(),
        scenes::huge_among_small(),
        scenes::scattered_samples(),
        scenes::blobs_analytic(),
        by(Evaluate::Scatter, scenes::blobs_analytic()),
        scenes::blobs_central(),
        scenes::surface_in_a_volume(),
        by(Evaluate::Scatter, scenes::surface_in_a_volume()),
        by(Evaluate::Scatter, methods::rectilinear()),
        by(Evaluate::Scatter, methods::table_of_a_gaussian()),
        methods::axis_sheets(),
        methods::single_splats(Order::BackToFront),
        methods::isosurfaces_in_fog(),
        methods::maximum(),
        methods::clipped_surface_in_a_volume(),
        by(Evaluate::Scatter, methods::sharp_body_centred()),
        by(Evaluate::Scatter, fields::two_volumes()),
        by(Evaluate::Scatter, fields::four_without_cells()),
    ];
    let own = Gpu::headless(&AdapterChoice::Automatic).expect("a GPU, or a software driver");
    let info = wgpu::AdapterInfo {
        device_type: wgpu::DeviceType::DiscreteGpu,
        ..wgpu::AdapterInfo::clone(&own.info)
    };
    let gpu = Gpu::from_wgpu(own.device.clone(), own.queue, info);
    for case in cases {
        let mut renderer = Renderer::new(&gpu);
        let mut prepared = renderer.prepare(&case.scene).expect(case.name);
        let mut draw =
            || renderer.render(&mut prepared, &case.camera, &case.settings).expect(case.name).0;
        let found = draw();
        assert_eq!(bits(&found), bits(&draw()), "{}", case.name);
        let expected =
            reference::render(&case.scene, &case.camera, &case.settings).expect(case.name);
        let agreement = psnr(&found, &expected);
        println!("{} as on a GPU: {agreement:.1} dB", case.name);
        assert!(agreement >= least_of_gathered(case.name), "{}: {agreement:.1} dB", case.name);
    }
}

/// A tile that stops after 300 entries and continues in another dispatch draws the same picture.
#[test]
fn tiles_that_stop_go_on() {
    let cases = [
        scenes::blobs_analytic(),
        by(Evaluate::Scatter, scenes::blobs_analytic()),
        scenes::blobs_central(),
        scenes::surface_in_a_volume(),
        by(Evaluate::Scatter, scenes::surface_in_a_volume()),
        scenes::huge_among_small(),
        fields::two_volumes(),
        methods::single_splats(Order::FrontToBack),
        methods::single_splats(Order::BackToFront),
    ];
    for case in cases {
        let budget = Budget { tile_entries: Some(300), ..Budget::default() };
        let agreement = psnr(&drawn(&case, budget), &drawn(&case, Budget::default()));
        println!("{} in stops: {agreement:.1} dB", case.name);
        assert!(agreement > 80.0, "{}: {agreement:.1} dB", case.name);
    }
}

/// Scenes of several fields, except those with something that the engine refuses.
#[test]
fn several_fields() {
    let (drawn, refused): (Vec<Case>, Vec<Case>) =
        fields::all().into_iter().partition(|case| case.scene.beyond_gpu().is_none());
    assert!(drawn.len() > 12, "{} scenes", drawn.len());
    for case in refused {
        let what = case.scene.beyond_gpu().expect(case.name);
        let error = drawn_by(Evaluate::Auto, &case, Budget::default()).expect_err(case.name);
        assert!(error.to_string().contains(&what), "{}: {error}", case.name);
    }
    for case in drawn {
        assert_matches(case, 50.0);
    }
}

/// Each field is drawn with its own transfer function: with exchanged ones, or without one of the
/// fields, the reference draws another picture.
#[test]
fn fields_are_not_exchanged() {
    let case = by(Evaluate::Scatter, fields::two_volumes());
    let found = drawn(&case, Budget::default());
    let truth = |items: Vec<Item>| {
        reference::render(&Scene { items }, &case.camera, &case.settings).expect(case.name)
    };
    let items = &case.scene.items;
    let [Item::Volume(a, kernel_a, shown_a), Item::Volume(b, kernel_b, shown_b)] = &items[..]
    else {
        panic!("{} has two volumes", case.name)
    };
    // Both functions over the values 0 … 1.
    let per_byte =
        |points: &[(f64, f64)], by: f64| points.iter().map(|(v, o)| (v * by, *o)).collect();
    let to_a = TransferFunction {
        opacity: per_byte(&shown_b.opacity, 255.0),
        color: shown_b.color.iter().map(|(v, c)| (v * 255.0, *c)).collect(),
        ..shown_b.clone()
    };
    let to_b = TransferFunction {
        opacity: per_byte(&shown_a.opacity, 1.0 / 255.0),
        color: shown_a.color.iter().map(|(v, c)| (v / 255.0, *c)).collect(),
        ..shown_a.clone()
    };
    let exchanged = vec![
        Item::Volume(a.clone(), kernel_a.clone(), to_a),
        Item::Volume(b.clone(), kernel_b.clone(), to_b),
    ];
    assert!(psnr(&found, &truth(items.clone())) > 50.0);
    for (what, items) in [
        ("exchanged", exchanged),
        ("the first alone", vec![items[0].clone()]),
        ("the second alone", vec![items[1].clone()]),
    ] {
        let agreement = psnr(&found, &truth(items));
        println!("{what}: {agreement:.1} dB");
        assert!(agreement < 35.0, "{what}: {agreement:.1} dB");
    }
}

/// If one sheet of one band has more splats than the budget holds, the result is an error that says
/// so. It is not a picture without those splats.
#[test]
fn a_budget_too_small_for_a_single_sheet_is_an_error() {
    let gpu = Gpu::headless(&AdapterChoice::Automatic).expect("a GPU, or a software driver");
    let case = by(Evaluate::Scatter, scenes::blobs_analytic());
    let mut renderer =
        Renderer::with_budget(&gpu, Budget { entries: 8, record_words: 8, ..Budget::default() });
    let mut prepared = renderer.prepare(&case.scene).expect(case.name);
    let found = renderer.render(&mut prepared, &case.camera, &case.settings);
    assert!(found.is_err_and(|e| e.to_string().contains("budget")));
}

#[test]
fn the_same_input_draws_the_same_bytes() {
    for case in [
        scenes::huge_among_small(),
        scenes::blobs_analytic(),
        by(Evaluate::Scatter, scenes::blobs_analytic()),
        scenes::surface_in_a_volume(),
        by(Evaluate::Scatter, scenes::surface_in_a_volume()),
    ] {
        let first = drawn(&case, Budget::default());
        for _ in 0..3 {
            let again = drawn(&case, Budget::default());
            assert_eq!(bits(&first), bits(&again), "{}", case.name);
        }
    }
}

fn bits(picture: &Picture) -> Vec<u32> {
    picture.color.iter().flatten().chain(&picture.depth).map(|v| v.to_bits()).collect()
}

/// Bins too long for one invocation are sorted by a bitonic network.
#[test]
fn thousands_of_splats_in_one_bin() {
    let case = scenes::ellipsoids_orthographic();
    let splatkit::scene::Item::Radiance(set) = &case.scene.items[0] else { panic!("radiance") };
    let mut set = (**set).clone();
    for splat in &mut set.splats {
        splat.center = splat.center.map(|v| 0.5 * v);
        splat.strength *= 0.01;
    }
    set.splats = set.splats.repeat(9);
    let scene = splatkit::scene::Scene::new().with_splats(set);
    let case = Case { name: "thousands_in_one_bin", scene, ..case };
    let expected = reference::render(&case.scene, &case.camera, &case.settings).expect(case.name);
    let agreement = psnr(&drawn(&case, Budget::default()), &expected);
    println!("{}: {agreement:.1} dB", case.name);
    assert!(agreement > 50.0, "{agreement:.1} dB");
}

/// Only the CPU engine draws tensor-product kernels.
#[test]
fn kernels_that_are_not_drawn_are_named() {
    let case = scenes::blobs_analytic();
    let splatkit::scene::Item::Volume(volume, _, transfer) = &case.scene.items[0] else {
        panic!("a volume")
    };
    let gpu = Gpu::headless(&AdapterChoice::Automatic).expect("a GPU, or a software driver");
    for tensor in Tensor::ALL {
        let scene =
            Scene::new().with_volume(volume.clone(), Kernel::tensor(tensor), transfer.clone());
        let error = Renderer::new(&gpu)
            .prepare(&scene)
            .expect_err("tensor products are refused")
            .to_string();
        assert!(error.contains(tensor.name()) && error.contains("the CPU engine does"), "{error}");
    }
}

#[test]
fn a_new_transfer_function_needs_no_new_upload() {
    let case = scenes::blobs_analytic();
    let splatkit::scene::Item::Volume(volume, kernel, transfer) = &case.scene.items[0] else {
        panic!("a volume")
    };
    let mut other = transfer.clone();
    other.opacity = vec![(100.0, 0.0), (130.0, 0.9), (160.0, 0.0)];
    let scene =
        splatkit::scene::Scene::new().with_volume(volume.clone(), kernel.clone(), other.clone());
    let gpu = Gpu::headless(&AdapterChoice::Automatic).expect("a GPU, or a software driver");
    let mut renderer = Renderer::new(&gpu);
    for evaluate in [Evaluate::Gather, Evaluate::Scatter] {
        let settings = Settings { evaluate, ..case.settings.clone() };
        let expected = reference::render(&scene, &case.camera, &settings).expect(case.name);
        let mut prepared = renderer.prepare(&case.scene).expect(case.name);
        renderer.render(&mut prepared, &case.camera, &settings).expect(case.name);
        prepared.set_transfer(0, &other).unwrap();
        let (found, _) = renderer.render(&mut prepared, &case.camera, &settings).expect(case.name);
        assert!(psnr(&found, &expected) > 50.0, "{evaluate:?}: {:.1} dB", psnr(&found, &expected));
    }
}
