//! What the GPU engine promises beside pictures that agree with the reference: which scenes it
//! gathers, that budgets and seams do not show, and that equal input gives equal bytes.

use crate::{
    scenes::{self, Case, fields, methods},
    testing::{gpu::gpu, psnr::psnr},
};
use glam::DVec3;
use splatkit::{
    gpu::{Budget, Renderer},
    math::{Kernel, Tensor},
    picture::Picture,
    reference,
    scene::{Evaluate, Item, Order, Scene, Settings},
    volume::{Lattice, Samples, TransferFunction, Volume},
};

/// Draws the case with its own settings, by which the engine usually chooses how to fill sheets.
fn drawn(case: &Case, budget: Budget) -> Picture {
    drawn_by(case.settings.evaluate, case, budget).expect(case.name)
}

fn drawn_by(evaluate: Evaluate, case: &Case, budget: Budget) -> splatkit::Result<Picture> {
    let mut renderer = Renderer::with_budget(gpu(), budget);
    let mut prepared = renderer.prepare(&case.scene)?;
    let settings = Settings { evaluate, ..case.settings.clone() };
    Ok(renderer.render(&mut prepared, &case.camera, &settings)?.0)
}

/// The case with a given way to fill sheets.
fn by(evaluate: Evaluate, case: Case) -> Case {
    Case { settings: Settings { evaluate, ..case.settings.clone() }, ..case }
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
        let mut renderer = Renderer::new(gpu());
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
        let value_at = |index: usize| {
            let at = [index % dims[0], index / dims[0] % dims[1], index / dims[0] / dims[1]]
                .map(|n| n + 6);
            values[(at[2] * volume.lattice.dims[1] + at[1]) * volume.lattice.dims[0] + at[0]]
        };
        (0..dims.iter().product()).map(value_at).collect::<Vec<f32>>()
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
    let mut renderer = Renderer::with_budget(gpu(), Budget::default());
    let mut prepared = renderer.prepare(&scene).expect("prepared");
    let mut draw = |camera| renderer.render(&mut prepared, camera, &settings).expect("a picture").0;
    draw(&camera);
    draw(&away);
    let picture = draw(&moved);
    let expected = reference::render(&scene, &moved, &settings).expect("a picture");
    let agreement = psnr(&picture, &expected);
    assert!(agreement > 50.0, "{agreement:.1} dB");
}

#[test]
fn single_splats_in_both_orders() {
    let [front, back] = [Order::FrontToBack, Order::BackToFront]
        .map(|order| drawn(&methods::single_splats(order), Budget::default()));
    // Rays that end early leave up to 5e-4 of the light.
    let agreement = psnr(&front, &back);
    println!("front to back and back to front: {agreement:.1} dB");
    assert!(agreement > 60.0, "{agreement:.1} dB");
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
                Renderer::with_budget(gpu(), Budget { entries, record_words, ..Budget::default() });
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

/// Each field is drawn with its own transfer function: with exchanged ones, or without one of the
/// fields, the reference draws another picture.
#[test]
fn fields_are_not_exchanged() {
    let case = by(Evaluate::Scatter, fields::two_volumes());
    let picture = drawn(&case, Budget::default());
    let truth = |items: Vec<Item>| {
        reference::render(&Scene::from(items), &case.camera, &case.settings).expect(case.name)
    };
    let items = &case.scene.items;
    let [Item::Volume(a, kernel_a, transfer_a), Item::Volume(b, kernel_b, transfer_b)] = &items[..]
    else {
        panic!("{} has two volumes", case.name)
    };
    // Both functions over the values 0 … 1.
    let per_byte =
        |points: &[(f64, f64)], by: f64| points.iter().map(|(v, o)| (v * by, *o)).collect();
    let to_a = TransferFunction {
        opacity: per_byte(&transfer_b.opacity, 255.0),
        color: transfer_b.color.iter().map(|(v, c)| (v * 255.0, *c)).collect(),
        ..transfer_b.clone()
    };
    let to_b = TransferFunction {
        opacity: per_byte(&transfer_a.opacity, 1.0 / 255.0),
        color: transfer_a.color.iter().map(|(v, c)| (v / 255.0, *c)).collect(),
        ..transfer_a.clone()
    };
    let exchanged = vec![
        Item::Volume(a.clone(), kernel_a.clone(), to_a),
        Item::Volume(b.clone(), kernel_b.clone(), to_b),
    ];
    for (what, items) in [
        ("exchanged", exchanged),
        ("the first alone", vec![items[0].clone()]),
        ("the second alone", vec![items[1].clone()]),
    ] {
        let agreement = psnr(&picture, &truth(items));
        println!("{what}: {agreement:.1} dB");
        assert!(agreement < 35.0, "{what}: {agreement:.1} dB");
    }
}

/// If one sheet of one band has more splats than the budget holds, the result is an error that says
/// so. It is not a picture without those splats.
#[test]
fn a_budget_too_small_for_a_single_sheet_is_an_error() {
    let case = by(Evaluate::Scatter, scenes::blobs_analytic());
    let mut renderer =
        Renderer::with_budget(gpu(), Budget { entries: 8, record_words: 8, ..Budget::default() });
    let mut prepared = renderer.prepare(&case.scene).expect(case.name);
    let result = renderer.render(&mut prepared, &case.camera, &case.settings);
    assert!(result.is_err_and(|e| e.to_string().contains("budget")));
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
    for tensor in Tensor::ALL {
        let scene =
            Scene::new().with_volume(volume.clone(), Kernel::tensor(tensor), transfer.clone());
        let error = Renderer::new(gpu())
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
    let mut renderer = Renderer::new(gpu());
    for evaluate in [Evaluate::Gather, Evaluate::Scatter] {
        let settings = Settings { evaluate, ..case.settings.clone() };
        let expected = reference::render(&scene, &case.camera, &settings).expect(case.name);
        let mut prepared = renderer.prepare(&case.scene).expect(case.name);
        renderer.render(&mut prepared, &case.camera, &settings).expect(case.name);
        prepared.set_transfer(0, &other).unwrap();
        let (picture, _) =
            renderer.render(&mut prepared, &case.camera, &settings).expect(case.name);
        assert!(
            psnr(&picture, &expected) > 50.0,
            "{evaluate:?}: {:.1} dB",
            psnr(&picture, &expected)
        );
    }
}

/// The invocations of a tile may load and sort its entries together, as they do on a GPU.
#[test]
fn entries_that_a_tile_loads_together_give_the_same_picture() {
    for case in [
        scenes::ellipsoids_in_perspective(),
        scenes::scattered_samples(),
        by(Evaluate::Scatter, scenes::blobs_analytic()),
        by(Evaluate::Gather, scenes::blobs_analytic()),
        scenes::facets::facets_in_a_volume(),
        methods::single_splats(Order::BackToFront),
        fields::two_volumes(),
    ]
    .into_iter()
    .chain(
        scenes::gaussians::all()
            .into_iter()
            .filter(|case| ["whole_gaussians", "gaussians_among_everything"].contains(&case.name)),
    ) {
        let draw = |staged| drawn(&case, Budget { staged: Some(staged), ..Budget::default() });
        let agreement = psnr(&draw(false), &draw(true));
        println!("{}: {agreement:.1} dB", case.name);
        assert!(agreement > 80.0, "{}: {agreement:.1} dB", case.name);
    }
}
