//! Volumes in bricks. Their pictures match those of the volume, or are coarser if the view or the
//! memory budget asks for it. No brick is read twice.

use crate::testing::{folder::Folder, gpu::gpu, psnr::measured};
use glam::DVec3;
use splatkit::{
    FrameStats,
    bricks::{self, Bricks, Wish, WriteOptions},
    cpu::CpuRenderer,
    gpu::Renderer,
    hierarchy::Detail,
    input::Limits,
    math::{Bounds, Camera, Kernel, Projection},
    picture::Picture,
    reference,
    scene::{Classification, Clip, ClipShape, Evaluate, Scene, Settings},
    volume::{Lattice, Samples, TransferFunction, Volume, reach::EVERYTHING},
};
use std::sync::Arc;

/// Spherical waves that reach the borders of a lattice of any size. Values are 0 … 200.
fn value(dims: [usize; 3], index: usize) -> f64 {
    let at = [index % dims[0], index / dims[0] % dims[1], index / dims[0] / dims[1]];
    let p =
        DVec3::from_array(std::array::from_fn(|axis| at[axis] as f64 / dims[axis] as f64 - 0.45));
    let wave = (22.0 * p.length()).cos() + 0.4 * (17.0 * p.x).sin() * (13.0 * p.y).cos();
    (100.0 + 90.0 * wave * (1.0 - p.length())).clamp(0.0, 200.0)
}

fn volume(dims: [usize; 3], spacing: DVec3, bytes: bool) -> Arc<Volume> {
    let values = (0..dims.iter().product()).map(|index| value(dims, index));
    let samples = if bytes {
        Samples::U8(values.map(|v| v as u8).collect())
    } else {
        Samples::F32(values.map(|v| v as f32).collect())
    };
    Arc::new(Volume::new(Lattice::with_spacing(dims, spacing), samples).expect("a volume"))
}

fn transfer() -> TransferFunction {
    TransferFunction {
        color: vec![(0.0, [0.1, 0.2, 0.9]), (100.0, [0.9, 0.8, 0.2]), (200.0, [0.9, 0.1, 0.1])],
        opacity: vec![(0.0, 0.0), (90.0, 0.0), (130.0, 0.06), (200.0, 0.3)],
        unit: 1.0,
        ..TransferFunction::default()
    }
}

fn scene(bricks: &Arc<Bricks>) -> Scene {
    Scene::new().with_bricks(bricks.clone(), Kernel::default(), transfer())
}

fn bricks_of(volume: &Arc<Volume>) -> Arc<Bricks> {
    Arc::new(Bricks::from_volume(volume.clone()).expect("bricks"))
}

/// Cameras that look from a corner. Near: each record has a shape of its own. Far: sections are the
/// same for all pixels of a footprint. Flat: orthographic.
fn cameras(scene: &Scene) -> [(&'static str, Camera); 3] {
    let bounds = scene.bounds();
    let near = Camera::framing(&bounds, DVec3::new(1.0, -2.0, 0.7), DVec3::Z, 1.0);
    let away = near.position - near.focal_point;
    let mut far = near.clone();
    far.position = near.focal_point + 30.0 * away;
    far.projection = Projection::Perspective { view_angle: 1.0 };
    let mut flat = near.clone();
    flat.projection = Projection::Orthographic { height: bounds.diagonal() };
    [("near", near), ("far", far), ("flat", flat)]
}

fn renderer() -> Renderer {
    Renderer::new(gpu())
}

/// Settings that let the steps between samples cover `pixels` pixels at most.
fn with_memory(mut settings: Settings, page_memory: u64) -> Settings {
    settings.controls.page_memory = page_memory;
    settings
}

fn settings(pixels: f64) -> Settings {
    // The GPU engine scatters bricks. Whole volumes match them most closely if they are scattered
    // too.
    let (detail, evaluate) = (Detail::Pixels(2.0 * pixels), Evaluate::Scatter);
    Settings { detail, evaluate, ..Settings::new([96, 96]) }
}

fn draw(
    renderer: &mut Renderer,
    scene: &Scene,
    camera: &Camera,
    settings: &Settings,
) -> (Picture, FrameStats) {
    let mut prepared = renderer.prepare(scene).expect("a scene");
    renderer.render(&mut prepared, camera, settings).expect("a picture")
}

fn assert_shows_something(picture: &Picture) {
    let covered = picture.color.iter().filter(|color| color[3] > 0.1).count();
    assert!(covered * 5 > picture.color.len(), "{covered} pixels");
}

#[test]
fn the_finest_level_is_the_volume() {
    let mut renderer = renderer();
    for (bytes, spacing, dims) in
        [(true, DVec3::ONE, [75, 60, 49]), (false, DVec3::new(1.0, 1.3, 0.8), [49, 65, 33])]
    {
        let volume = volume(dims, spacing, bytes);
        let plain = Scene::new().with_volume(volume.clone(), Kernel::default(), transfer());
        let folder = Folder::new();
        let path = folder.path("a.splv");
        bricks::write(&volume, &path, &WriteOptions::default(), None).expect("a file");
        let file = Arc::new(Bricks::open(&path, &Limits::default()).expect("bricks"));
        for (name, camera) in cameras(&plain) {
            for occlusion in [true, false] {
                let settings = Settings { occlusion, ..settings(0.0) };
                let (expected, _) = draw(&mut renderer, &plain, &camera, &settings);
                assert_shows_something(&expected);
                for (origin, bricks) in [("memory", bricks_of(&volume)), ("file", file.clone())] {
                    let (picture, stats) = draw(&mut renderer, &scene(&bricks), &camera, &settings);
                    assert_eq!(stats.lambda, 0.0);
                    let agreement = measured(&picture, &expected);
                    println!(
                        "{name}, bytes: {bytes}, {origin}, occlusion: {occlusion}: {agreement:.1} \
                         dB"
                    );
                    assert!(
                        agreement > 100.0,
                        "{name}, {bytes}, {origin}, {occlusion}: {agreement:.1} dB"
                    );
                }
            }
        }
    }
}

/// Sheets thicker than the kernels' reach also mix in samples whose neighbourhood is invisible, and
/// bricks in which nothing is visible.
#[test]
fn thick_sheets_take_all_bricks() {
    let volume = volume([75, 60, 49], DVec3::ONE, true);
    // Only one corner is visible.
    let corner = TransferFunction { opacity: vec![(175.0, 0.0), (190.0, 0.5)], ..transfer() };
    let plain = Scene::new().with_volume(volume.clone(), Kernel::default(), corner.clone());
    let bricks = Scene::new().with_bricks(bricks_of(&volume), Kernel::default(), corner);
    let (_, camera) = &cameras(&plain)[2];
    let mut renderer = renderer();
    let mut prepared = renderer.prepare(&bricks).expect("a scene");
    let mut counts = Vec::new();
    for thickness in [1.0, 4.0, 1.0] {
        let settings = Settings { sheet_thickness: Some(thickness), ..settings(0.0) };
        let (expected, _) = draw(&mut renderer, &plain, camera, &settings);
        let (picture, stats) =
            renderer.render(&mut prepared, camera, &settings).expect("a picture");
        let agreement = measured(&picture, &expected);
        assert!(agreement > 80.0, "{thickness}: {agreement:.1} dB");
        counts.push((stats.bricks, stats.splats));
    }
    println!("{counts:?}");
    assert!(counts[0] == counts[2] && counts[0].1 < counts[1].1, "{counts:?}");
}

#[test]
fn the_reference_draws_the_whole_volume() {
    let volume = volume([21, 18, 35], DVec3::ONE, true);
    let [.., (_, camera)] = cameras(&scene(&bricks_of(&volume)));
    let settings = Settings { size: [40, 40], ..settings(0.0) };
    let expected =
        reference::render(&scene(&bricks_of(&volume)), &camera, &settings).expect("a picture");
    let (picture, _) = draw(&mut renderer(), &scene(&bricks_of(&volume)), &camera, &settings);
    let agreement = measured(&picture, &expected);
    assert!(agreement > 50.0, "{agreement:.1} dB");
}

#[test]
fn budgets_are_kept_by_coarser_levels() {
    let volume = volume([100; 3], DVec3::ONE, true);
    let bricks = bricks_of(&volume);
    let scene = scene(&bricks);
    let (_, camera) = &cameras(&scene)[2];
    let mut renderer = renderer();
    let (finest, all) = draw(&mut renderer, &scene, camera, &settings(0.0));
    assert_eq!((all.lambda, all.bricks, all.read_bricks), (0.0, 64, 64));
    let slot = 32 * 32 * 32 + 1024;
    for (count, lambda) in [(64, 0.0), (20, 1.0), (8, 1.0), (1, 2.0)] {
        let settings = with_memory(settings(0.0), count * slot);
        let (picture, stats) = draw(&mut renderer, &scene, camera, &settings);
        assert_eq!(stats.lambda, lambda, "{count}");
        assert!(stats.brick_bytes <= count * slot, "{count}: {}", stats.brick_bytes);
        let agreement = measured(&picture, &finest);
        println!("{count} bricks: {agreement:.1} dB");
        assert!(agreement > 20.0, "{count}: {agreement:.1} dB");
    }
    // Two views that need different bricks share the slots. The first view looks the same
    // afterwards.
    let mut prepared = renderer.prepare(&scene).expect("a scene");
    let room = with_memory(settings(0.0), 16 * slot);
    let mut corner = camera.clone();
    corner.projection = Projection::Orthographic { height: 12.0 };
    corner.position -= 20.0;
    corner.focal_point -= 20.0;
    let (first, _) = renderer.render(&mut prepared, camera, &room).expect("a picture");
    let (_, between) = renderer.render(&mut prepared, &corner, &room).expect("a picture");
    assert!(between.read_bricks > 0 && between.brick_bytes <= 16 * slot, "{between:?}");
    corner.position += 40.0;
    corner.focal_point += 40.0;
    let (_, between) = renderer.render(&mut prepared, &corner, &room).expect("a picture");
    assert!(between.read_bricks > 0 && between.brick_bytes <= 16 * slot, "{between:?}");
    let (again, _) = renderer.render(&mut prepared, camera, &room).expect("a picture");
    // Bricks now lie in other slots, so sums are added in another order.
    assert!(measured(&again, &first) > 80.0);
}

#[test]
fn a_zoom_shows_no_pop() {
    let volume = volume([100; 3], DVec3::ONE, true);
    let bricks = bricks_of(&volume);
    let scene = scene(&bricks);
    let mut renderer = renderer();
    let mut prepared = renderer.prepare(&scene).expect("a scene");
    for (name, camera) in &cameras(&scene) {
        // λ is 1 if steps may cover twice the pixels that they cover at the finest level.
        let view = camera.view([96, 96]).expect("a view");
        let lambda = |pixels| {
            let wish = Wish { pixels, most: usize::MAX, least: 0.0, region: None };
            bricks::choice(&bricks, &view, 2.0, &EVERYTHING, &wish).lambda
        };
        let some = (0..)
            .map(|power| 2f64.powi(power))
            .find(|pixels| lambda(*pixels) > 0.0)
            .expect("pixels");
        let covered = some / lambda(some).exp2();
        const STEPS: u32 = 8;
        let pictures: Vec<Picture> = (0..=2 * STEPS)
            .map(|step| {
                let wanted = f64::from(step) / f64::from(STEPS);
                let (picture, stats) = renderer
                    .render(
                        &mut prepared,
                        camera,
                        &settings(covered * wanted.exp2() * (1.0 + 1e-12)),
                    )
                    .expect("a picture");
                assert!((stats.lambda - wanted).abs() < 1e-6, "{} {wanted}", stats.lambda);
                assert_shows_something(&picture);
                picture
            })
            .collect();
        let change = |pair: &[Picture]| {
            let squares = pair[0].color.iter().zip(&pair[1].color);
            let sum: f64 =
                squares.flat_map(|(a, b)| (0..4).map(|c| f64::from(a[c] - b[c]).powi(2))).sum();
            (sum / (4 * pair[0].color.len()) as f64).sqrt()
        };
        let changes: Vec<f64> = pictures.windows(2).map(change).collect();
        let mean = changes.iter().sum::<f64>() / changes.len() as f64;
        let most = changes.iter().copied().fold(0.0, f64::max);
        println!("{name}: mean {mean:.5}, most {most:.5}, {changes:.5?}");
        assert!(mean > 0.0 && most < 3.0 * mean, "{name}: {most} of {mean}");
    }
}

#[test]
fn bricks_are_read_once() {
    let volume = volume([75, 60, 49], DVec3::ONE, true);
    let scene = scene(&bricks_of(&volume));
    let (_, camera) = &cameras(&scene)[0];
    let mut renderer = renderer();
    // Another transfer function lists other samples of the same bricks.
    let mut other = transfer();
    other.opacity = vec![(150.0, 0.0), (160.0, 1.0)];
    let plain = Scene::new().with_volume(volume, Kernel::default(), other.clone());
    let (expected, _) = draw(&mut renderer, &plain, camera, &settings(0.0));
    let mut prepared = renderer.prepare(&scene).expect("a scene");
    let mut frame = |prepared: &mut _, camera: &Camera| {
        renderer.render(prepared, camera, &settings(0.0)).expect("a picture")
    };
    let (first, stats) = frame(&mut prepared, camera);
    assert_eq!((stats.bricks, stats.read_bricks), (12, 12));
    let (second, stats) = frame(&mut prepared, camera);
    assert_eq!((stats.bricks, stats.read_bricks), (12, 0));
    assert_eq!(first.color, second.color);
    let mut turned = camera.clone();
    turned.position += DVec3::X;
    assert_eq!(frame(&mut prepared, &turned).1.read_bricks, 0);
    prepared.set_transfer(0, &other).unwrap();
    let (third, stats) = frame(&mut prepared, camera);
    assert_eq!(stats.read_bricks, 0);
    assert!(measured(&third, &expected) > 60.0 && measured(&third, &first) < 40.0);
}

#[test]
fn what_bricks_cannot_do_is_told() {
    let bricks = bricks_of(&volume([9; 3], DVec3::ONE, true));
    let mut settings = settings(1.0);
    let refused = |scene: &Scene, settings: &Settings| {
        scene.validate_settings(settings).unwrap_err().to_string()
    };
    let hann =
        Scene::new().with_bricks(bricks.clone(), Kernel::hann(2.0).expect("a kernel"), transfer());
    assert!(refused(&hann, &settings).contains("Gaussian"));
    settings.classification = Classification::Pre;
    assert!(refused(&scene(&bricks), &settings).contains("after interpolation"));
    let more = |scene: Scene| scene.with_bricks(bricks.clone(), Kernel::default(), transfer());
    let most = (1..Scene::MAX_FIELDS).fold(scene(&bricks), |scene, _| more(scene));
    assert!(most.validate().is_ok());
    assert!(more(most).validate().unwrap_err().to_string().contains("the scene has 9"));
}

/// The CPU engine gathers bricks. At the finest level the picture is that of the whole volume.
/// Between levels it matches the picture that scattering draws.
#[test]
fn processors_gather_bricks() {
    let cases = [
        (true, DVec3::ONE, [75, 60, 49]),
        (false, DVec3::new(1.0, 1.3, 0.8), [49, 65, 33]),
        // Fewer samples along an axis than a kernel reaches.
        (true, DVec3::new(1.0, 2.0, 1.0), [64, 3, 40]),
    ];
    for (bytes, spacing, dims) in cases {
        let volume = volume(dims, spacing, bytes);
        let plain = Scene::new().with_volume(volume.clone(), Kernel::default(), transfer());
        let bricks = scene(&bricks_of(&volume));
        for (name, camera) in cameras(&plain) {
            let drawn = |scene: &Scene, settings: &Settings| {
                let mut renderer = CpuRenderer::new(scene).expect("a scene");
                renderer.render(&camera, settings).expect("a picture")
            };
            let finest = Settings { evaluate: Evaluate::Gather, ..settings(0.0) };
            let ((whole, _), (picture, stats)) = (drawn(&plain, &finest), drawn(&bricks, &finest));
            assert!(
                whole.color.iter().any(|color| color[3] > 0.1),
                "{name}, {dims:?}: an empty picture"
            );
            assert!(stats.gathered > 0 && stats.lambda == 0.0, "{stats:?}");
            let agreement = measured(&picture, &whole);
            println!("{name}, {dims:?}: {agreement:.1} dB to the whole volume");
            assert!(agreement > 80.0, "{name}, {dims:?}: {agreement:.1} dB");
            let step = spacing.max_element() * camera.view([96, 96]).expect("a view").scale;
            let near = if name == "flat" {
                1.0
            } else {
                camera.view([96, 96]).expect("a view").distances(&plain.bounds())[0]
            };
            for lambda in [0.3f64, 0.7] {
                let between = Settings {
                    detail: Detail::Pixels(2.0 * lambda.exp2() * step / near),
                    ..finest.clone()
                };
                let (picture, stats) = drawn(&bricks, &between);
                let (scattered, _) =
                    drawn(&bricks, &Settings { evaluate: Evaluate::Scatter, ..between });
                let agreement = measured(&picture, &scattered);
                println!(
                    "{name}, {dims:?}, level {:.2}: {agreement:.1} dB to scattering",
                    stats.lambda
                );
                assert!(
                    stats.lambda > 0.0 && stats.lambda < 1.0,
                    "{name}, {dims:?}: {}",
                    stats.lambda
                );
                assert!(
                    stats.gathered > 0 && agreement > 45.0,
                    "{name}, {dims:?}, {lambda}: {agreement:.1} dB"
                );
            }
        }
    }
}

/// Slots are reused. The samples stored beside a brick follow the bricks that are its neighbours at
/// the time.
#[test]
fn processors_hold_few_bricks() {
    let volume = volume([130, 120, 110], DVec3::ONE, true);
    let bricks = bricks_of(&volume);
    let scene = scene(&bricks);
    let [(_, near), ..] = cameras(&scene);
    let mut beside = near.clone();
    beside.azimuth(140.0);
    let settings =
        Settings { evaluate: Evaluate::Gather, ..with_memory(settings(0.0), 30 * 48_000) };
    let mut renderer = CpuRenderer::new(&scene).expect("a scene");
    let draw = |renderer: &mut CpuRenderer, camera: &Camera| {
        renderer.render(camera, &settings).expect("a picture")
    };
    let (first, stats) = draw(&mut renderer, &near);
    assert!(stats.lambda > 0.0 && stats.brick_bytes <= settings.controls.page_memory, "{stats:?}");
    let (_, stats) = draw(&mut renderer, &beside);
    assert!(stats.brick_bytes <= settings.controls.page_memory, "{stats:?}");
    let (again, _) = draw(&mut renderer, &near);
    assert_shows_something(&first);
    assert_eq!(first.color, again.color);
    // Clip boxes from one end to the other, drawn by one renderer and each by a renderer of its
    // own.
    let part = |from: f64, to: f64| {
        let mut settings = settings.clone();
        settings.controls.page_memory = 1 << 30;
        let shape = ClipShape::Box(Bounds { min: DVec3::splat(from), max: DVec3::splat(to) });
        settings.clips = vec![Clip { shape, inside: true }];
        settings
    };
    for (from, to) in [(0.0, 40.0), (30.0, 70.0), (60.0, 110.0)] {
        let settings = part(from, to);
        let (picture, _) = renderer.render(&near, &settings).expect("a picture");
        let (alone, _) =
            CpuRenderer::new(&scene).expect("a scene").render(&near, &settings).expect("a picture");
        assert_eq!(picture.color, alone.color);
    }
}
