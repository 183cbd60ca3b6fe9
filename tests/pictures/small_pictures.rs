//! Dense scenes in small pictures, with thousands of splats in every pixel. They are drawn at any
//! size. A picture that takes too long ends with an error at the time limit.

use crate::testing::{
    gpu::{gpu, own_gpu},
    psnr::measured,
};
use glam::{DVec3, Vec3};
use splatkit::{
    bricks::Bricks,
    gpu::{Budget, Renderer},
    hierarchy::{BuildOptions, Detail, Hierarchy, Tree},
    math::{Camera, Kernel},
    picture::Picture,
    reference,
    scattered::{Points, SampleOptions},
    scene::{Evaluate, Scene, Settings},
    splat::Surfels,
    surface::{Mesh, SurfelOptions},
    volume::{TransferFunction, Volume, phantoms::Phantom},
};
use std::{
    sync::Arc,
    time::{Duration, Instant},
};

/// A hilly surface of `side`² vertices over a unit square.
fn hills(side: u32) -> Surfels {
    let at = |i: u32| i as f32 / (side - 1) as f32;
    let place = |x: f32, y: f32| Vec3::new(x, y, 0.08 * (9.0 * x).sin() * (7.0 * y).cos());
    let positions = (0..side * side).map(|i| place(at(i % side), at(i / side))).collect();
    let corners = (0..side - 1).flat_map(|y| (0..side - 1).map(move |x| y * side + x));
    let triangles =
        corners.flat_map(|a| [[a, a + 1, a + side + 1], [a, a + side + 1, a + side]]).collect();
    let mesh = Mesh { positions, triangles, ..Mesh::default() };
    mesh.surfels(&SurfelOptions::default()).expect("surfels")
}

fn samples(count: u32) -> Scene {
    let unit = |i: u32, step: f64| (f64::from(i) * step).fract() as f32;
    // Steps that fill space evenly (Roberts 2018).
    let place =
        |i: u32| Vec3::new(unit(i, 0.819_172_5), unit(i, 0.671_043_6), unit(i, 0.549_700_5));
    let positions: Vec<Vec3> = (0..count).map(place).collect();
    let values = positions.iter().map(|p| (6.0 * p.x).sin() * (5.0 * p.y).cos() + p.z).collect();
    let set = Points { positions, values, ..Points::default() }
        .to_splats(&SampleOptions::default())
        .expect("splats");
    let json = r#"{"color": [[0, 0.9, 0.5, 0.3]], "opacity": [[-1, 0], [2, 0.9]], "unit": 0.1}"#;
    let transfer = TransferFunction::from_json(json).expect("a transfer function");
    Scene::new().with_samples(set, transfer)
}

fn drawn(scene: &Scene, settings: &Settings, budget: Budget) -> Picture {
    let mut renderer = Renderer::with_budget(gpu(), budget);
    let mut prepared = renderer.prepare(scene).expect("prepares");
    renderer.render(&mut prepared, &camera(scene, settings.size), settings).expect("draws").0
}

fn camera(scene: &Scene, [width, height]: [u32; 2]) -> Camera {
    let aspect = f64::from(width) / f64::from(height);
    Camera::framing(&scene.bounds(), DVec3::new(0.2, 0.3, -1.0), DVec3::Y, aspect)
}

/// A tile of one sheet holds more splats than a driver adds up in one dispatch; for every kind of
/// splat.
#[test]
fn thousands_of_splats_in_a_pixel_agree_with_the_reference() {
    let volume = Phantom::Specimen.sample_bytes([48; 3]).expect("samples");
    let transfer = TransferFunction::automatic(&volume);
    let volume = Scene::new().with_volume(volume, Kernel::default(), transfer);
    let surface = Scene::new().with_splats(hills(300));
    for (name, scene, evaluate) in [
        ("surface", surface, Evaluate::Auto),
        ("samples", samples(60_000), Evaluate::Auto),
        ("gathered volume", volume.clone(), Evaluate::Gather),
        ("scattered volume", volume, Evaluate::Scatter),
    ] {
        for size in [[1, 1], [5, 3], [16, 24]] {
            let settings = Settings { evaluate, ..Settings::new(size) };
            let draw = |tile_entries| {
                drawn(&scene, &settings, Budget { tile_entries, ..Budget::default() })
            };
            let whole = draw(None);
            let stopped = measured(&draw(Some(700)), &whole);
            let truth = reference::render(&scene, &camera(&scene, size), &settings)
                .expect("the reference draws");
            let agreement = measured(&whole, &truth);
            println!("{name} {size:?}: {agreement:.1} dB, with more stops {stopped:.1} dB");
            assert!(stopped > 80.0, "{name} {size:?}: {stopped:.1} dB with more stops");
            // Footprints as large as the scene, or as half the distance to it, are beyond what
            // their bounds hold. Only the largest picture must agree to 50 dB.
            assert!(agreement > 50.0 || size[1] < 24, "{name} {size:?}: {agreement:.1} dB");
        }
    }
}

/// The same if the invocations of a tile load its entries together. A workgroup's memory holds
/// fewer than those of the largest tile, and the software driver's limit is not reached.
#[test]
fn thousands_of_splats_in_a_pixel_may_be_loaded_together() {
    let scene = Scene::new().with_splats(hills(60));
    for size in [[1, 1], [16, 24]] {
        let settings = Settings::new(size);
        let draw =
            |staged| drawn(&scene, &settings, Budget { staged: Some(staged), ..Budget::default() });
        let agreement = measured(&draw(true), &draw(false));
        assert!(agreement > 80.0, "{size:?}: {agreement:.1} dB");
    }
}

/// Sets far too fine for the picture are drawn with fewer splats, and the picture stays the same.
#[test]
fn fewer_splats_stand_for_what_is_too_fine() {
    let surface = Scene::new().with_splats(hills(500));
    for (name, scene, side, factor) in
        [("surface", surface, 160, 4), ("samples", samples(300_000), 20, 1)]
    {
        let mut renderer = Renderer::new(gpu());
        let mut prepared = renderer.prepare(&scene).expect("prepares");
        let mut draw = |detail| {
            let settings = Settings { detail, ..Settings::new([side; 2]) };
            renderer.render(&mut prepared, &camera(&scene, [side; 2]), &settings).expect("draws")
        };
        let (small, few) = draw(Detail::default());
        let (whole, all) = draw(Detail::Pixels(0.0));
        // The picture does not depend on what was drawn before.
        let (again, _) = draw(Detail::default());
        let reduced =
            |picture: &Picture| picture.clone().reduced(factor).expect("a smaller picture");
        let agreement = measured(&reduced(&small), &reduced(&whole));
        println!("{name}: {} splats for {}, {agreement:.1} dB", few.splats, all.splats);
        assert!(few.splats * 8 < all.splats, "{name}: {} splats for {}", few.splats, all.splats);
        assert!(agreement > 35.0, "{name}: {agreement:.1} dB");
        assert_eq!(small.color, again.color, "{name}");
    }
}

/// A picture that makes progress, but too slowly, ends at the time limit.
#[test]
fn a_picture_ends_at_the_time_limit() {
    let gpu = own_gpu().with_patience(Duration::from_millis(300));
    let scene = Scene::new().with_splats(hills(300));
    // Some hundred thousand dispatches.
    let budget = Budget { tile_entries: Some(1), ..Budget::default() };
    let mut renderer = Renderer::with_budget(&gpu, budget);
    let mut prepared = renderer.prepare(&scene).expect("prepares");
    let start = Instant::now();
    let size = [8, 8];
    let error = renderer
        .render(&mut prepared, &camera(&scene, size), &Settings::new(size))
        .expect_err("too slow");
    assert!(error.to_string().contains("within 0.3 s"), "{error}");
    assert!(start.elapsed() < Duration::from_secs(60), "{:?}", start.elapsed());
}

/// Numbers that look random and are the same in every run (xorshift: Marsaglia 2003).
struct Random(u64);

impl Random {
    fn below(&mut self, end: u32) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 33) as u32 % end
    }

    fn unit(&mut self) -> f64 {
        f64::from(self.below(1 << 20)) / f64::from(1 << 20)
    }
}

fn any_scenes() -> Vec<(&'static str, Scene)> {
    let tree = Tree::build(&hills(200), &BuildOptions::default(), None).expect("a tree");
    let hierarchy = || Hierarchy::from_tree(tree.clone()).expect("a hierarchy");
    let volume = |side| Phantom::Specimen.sample_bytes([side; 3]).expect("samples");
    let automatic = |volume: &Volume| TransferFunction::automatic(volume);
    let (small, large) = (volume(20), volume(60));
    let (small_transfer, large_transfer) = (automatic(&small), automatic(&large));
    let bricks = Bricks::from_volume(Arc::new(large.clone())).expect("bricks");
    vec![
        ("surface", Scene::new().with_splats(hills(120))),
        ("dense surface", Scene::new().with_splats(hills(500))),
        ("samples", samples(5_000)),
        ("dense samples", samples(150_000)),
        ("volume", Scene::new().with_volume(large, Kernel::default(), large_transfer.clone())),
        ("bricks", Scene::new().with_bricks(bricks, Kernel::default(), large_transfer)),
        ("hierarchy", Scene::new().with_hierarchy(hierarchy())),
        (
            "mixed",
            Scene::new()
                .with_volume(small, Kernel::default(), small_transfer)
                .with_hierarchy(hierarchy())
                .with_splats(hills(400)),
        ),
    ]
}

/// Draws pictures of random sizes, cuts and cameras for SPLATKIT_SIZES_SECONDS (5 if unset). Every
/// picture is finished in time and has valid colours.
#[test]
fn any_scene_draws_at_any_size() {
    let seconds = std::env::var("SPLATKIT_SIZES_SECONDS")
        .ok()
        .and_then(|text| text.parse().ok())
        .unwrap_or(5.0);
    let gpu = own_gpu().with_patience(Duration::from_secs(60));
    let scenes = any_scenes();
    let mut renderers: Vec<Renderer> = [None, Some(50)]
        .map(|tile_entries| {
            Renderer::with_budget(&gpu, Budget { tile_entries, ..Budget::default() })
        })
        .into();
    let mut prepared: Vec<_> =
        scenes.iter().map(|(_, scene)| renderers[0].prepare(scene).expect("prepares")).collect();
    let mut random = Random(0x0005_eed0_f512_e5aa);
    let start = Instant::now();
    let (mut pictures, mut longest) = (0, Duration::ZERO);
    while start.elapsed().as_secs_f64() < seconds {
        let which = random.below(scenes.len() as u32) as usize;
        let (name, scene) = &scenes[which];
        let most = [2, 12, 50, 200][random.below(4) as usize];
        let size = [1 + random.below(most), 1 + random.below(most)];
        let mut camera = camera(scene, size);
        camera.azimuth(360.0 * random.unit());
        camera.elevation(120.0 * random.unit() - 60.0);
        // From within the scene to far away.
        let nearness = [0.02, 0.3, 1.0, 3.0, 40.0][random.below(5) as usize];
        camera.position = camera.focal_point + nearness * (camera.position - camera.focal_point);
        let pixels = [0.0, 0.5, 2.0, 2.0, 9.0][random.below(5) as usize];
        let settings = Settings { detail: Detail::Pixels(pixels), ..Settings::new(size) };
        let begun = Instant::now();
        let number = random.below(2) as usize;
        let drawn = renderers[number].render(&mut prepared[which], &camera, &settings);
        let took = begun.elapsed();
        let what =
            format!("{name} at {size:?}, cut {pixels}, {camera:?}, picture {pictures}, {took:?}");
        let (picture, _) = drawn.unwrap_or_else(|error| panic!("{what}: {error}"));
        let inside = |value: &f32| (-1e-4..=1.0001).contains(value);
        assert!(picture.color.as_flattened().iter().all(inside), "{what}: colours beyond 0 … 1");
        assert!(
            !picture.depth.iter().any(|depth| depth.is_nan()),
            "{what}: depths that are not numbers"
        );
        pictures += 1;
        longest = longest.max(took);
    }
    println!("{pictures} pictures; the longest took {longest:?}");
}
