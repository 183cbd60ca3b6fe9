//! Faults of a device: it is lost, does not answer, or has little memory. The result is the usual
//! picture or an error, never a part of a picture.

use crate::testing::{
    gpu::{gpu, own_gpu},
    psnr::measured,
};
use glam::DVec3;
use splatkit::{
    Error, FrameStats,
    bricks::Bricks,
    gpu::{Gpu, Renderer},
    hierarchy::{BuildOptions, Detail, Hierarchy, Tree},
    math::{Camera, Kernel},
    picture::Picture,
    scene::{Evaluate, Scene, Settings},
    surface::{Mesh, SurfelOptions},
    volume::{Lattice, Samples, Shade, TransferFunction, Volume, phantoms::Phantom},
};
use std::{sync::Arc, time::Duration};

/// A volume of 48³ samples, whole or in bricks, with a knot in its middle.
fn scene(in_bricks: bool) -> Scene {
    let volume = Arc::new(Phantom::Specimen.sample_bytes([48; 3]).unwrap());
    let transfer = TransferFunction::automatic(&volume);
    let mut knot = Mesh::knot(200, 16);
    let middle = volume.bounds().center().as_vec3();
    knot.positions.iter_mut().for_each(|place| *place = *place * 0.5 + middle);
    let scene = Scene::new().with_splats(knot.surfels(&SurfelOptions::default()).unwrap());
    match in_bricks {
        true => {
            scene.with_bricks(Bricks::from_volume(volume).unwrap(), Kernel::default(), transfer)
        }
        false => scene.with_volume(volume, Kernel::default(), transfer),
    }
}

fn view(scene: &Scene) -> (Camera, Settings) {
    (
        Camera::framing(&scene.bounds(), DVec3::new(0.4, -0.3, -1.0), DVec3::Y, 1.2),
        Settings::new([160, 120]),
    )
}

fn drawn(gpu: &Gpu, scene: &Scene) -> splatkit::Result<Picture> {
    drawn_by(Evaluate::Auto, gpu, scene)
}

/// Draws by scattering. A device may be too small to gather a volume that another device gathers;
/// scattered, the picture is the same on both.
fn scattered(gpu: &Gpu, scene: &Scene) -> splatkit::Result<Picture> {
    drawn_by(Evaluate::Scatter, gpu, scene)
}

fn drawn_by(evaluate: Evaluate, gpu: &Gpu, scene: &Scene) -> splatkit::Result<Picture> {
    let mut renderer = Renderer::new(gpu);
    let mut prepared = renderer.prepare(scene)?;
    let (camera, settings) = view(scene);
    Ok(renderer.render(&mut prepared, &camera, &Settings { evaluate, ..settings })?.0)
}

fn same(a: &Picture, b: &Picture) -> bool {
    let bits = |picture: &Picture| {
        let numbers = picture.color.as_flattened().iter().chain(&picture.depth);
        numbers.map(|number| number.to_bits()).collect::<Vec<_>>()
    };
    bits(a) == bits(b)
}

#[test]
fn a_lost_device_is_an_error_and_another_draws_the_same() {
    let (gpu, scene) = (own_gpu(), scene(false));
    let before = drawn(&gpu, &scene).expect("draws");
    let renderer = Renderer::new(&gpu);
    let mut lost = (Renderer::new(&gpu), renderer.prepare(&scene).unwrap());
    gpu.device.destroy();
    let (camera, settings) = view(&scene);
    // Every call fails from now on, however often it is made.
    for _ in 0..2 {
        let error = lost.0.render(&mut lost.1, &camera, &settings).unwrap_err();
        assert!(matches!(error, Error::DeviceLost(_)), "{error}");
        assert!(matches!(lost.0.draw(&mut lost.1, &camera, &settings), Err(Error::DeviceLost(_))));
        assert!(matches!(lost.0.prepare(&scene), Err(Error::DeviceLost(_))));
        assert!(matches!(gpu.wait(), Err(Error::DeviceLost(_))));
    }
    let again = drawn(&gpu.reopened().expect("opens again"), &scene).expect("draws again");
    assert!(same(&before, &again));
}

#[test]
fn a_device_lost_at_any_moment_gives_no_part_of_a_picture() {
    let whole = scene(false);
    let cut = scene(true);
    let truth = [&whole, &cut].map(|scene| drawn(gpu(), scene).expect("draws"));
    let mut outcomes = [0; 2];
    for moment in 0..16 {
        for (scene, truth) in [&whole, &cut].into_iter().zip(&truth) {
            let gpu = own_gpu();
            let device = gpu.device.clone();
            let killer = std::thread::spawn(move || {
                // A picture takes a few tenths of a second, including the compilation of shaders.
                std::thread::sleep(Duration::from_millis(35 * moment));
                device.destroy();
            });
            match drawn(&gpu, scene) {
                Ok(picture) => {
                    assert!(same(&picture, truth), "moment {moment}: a different picture");
                    outcomes[0] += 1;
                }
                Err(Error::DeviceLost(_)) => outcomes[1] += 1,
                Err(other) => panic!("moment {moment}: {other}"),
            }
            killer.join().unwrap();
        }
    }
    assert!(outcomes[1] > 0, "the device was never lost: {outcomes:?}");
}

/// Keeps the device busy: for a second or more in software, for a few hundredths of a second on a
/// fast GPU. No invocation takes more steps than Mesa's software driver allows.
fn hang(gpu: &Gpu) {
    let source = "@group(0) @binding(0) var<storage, read_write> state: u32;
        @compute @workgroup_size(8) fn main(@builtin(global_invocation_id) id: vec3u) {
            var x = id.x | 1u;
            for (var step = 0u; step < 60000u; step++) {
                x ^= x << 13u;
                x ^= x >> 17u;
                x ^= x << 5u;
            }
            // Never true, but compilers do not know that.
            if x == 0u {
                state = x;
            }
        }";
    let source = wgpu::ShaderSource::Wgsl(source.into());
    let module =
        gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source });
    let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("hang"),
        layout: None,
        module: &module,
        entry_point: None,
        compilation_options: Default::default(),
        cache: None,
    });
    let usage = wgpu::BufferUsages::STORAGE;
    let state = wgpu::BufferDescriptor { label: None, size: 4, usage, mapped_at_creation: false };
    let state = gpu.device.create_buffer(&state);
    let bindings = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[wgpu::BindGroupEntry { binding: 0, resource: state.as_entire_binding() }],
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &bindings, &[]);
        pass.dispatch_workgroups(1 << 15, 1, 1);
    }
    gpu.queue.submit([encoder.finish()]);
}

#[test]
fn a_device_that_does_not_answer_in_time_is_an_error() {
    let (gpu, scene) = (own_gpu(), scene(false));
    let truth = drawn(&gpu, &scene).expect("draws");
    let impatient = gpu.clone().with_patience(Duration::from_millis(1));
    // A fast device may finish while this thread is suspended.
    let mut waits = (0..5).map(|_| {
        hang(&gpu);
        impatient.wait()
    });
    let error = waits.find_map(Result::err).expect("the device is busy for longer");
    assert!(error.to_string().contains("did not answer within"), "{error}");
    // Later calls do not wait again, also those through other clones.
    assert!(matches!(impatient.wait(), Err(Error::DeviceLost(_))));
    assert!(matches!(drawn(&gpu, &scene), Err(Error::DeviceLost(_))));
    // A picture that is finished before the wait begins is returned. A part of a picture never is.
    let pictures = (0..20).map(|_| {
        let impatient = gpu.reopened().expect("opens again").with_patience(Duration::from_nanos(1));
        drawn(&impatient, &scene).map(|picture| assert!(same(&picture, &truth)))
    });
    let error =
        pictures.filter_map(Result::err).next().expect("slower than a nanosecond, at least once");
    let error = error.to_string();
    assert!(
        error.contains("did not answer within")
            || error.contains("did not finish the picture within"),
        "{error}"
    );
}

/// Largest difference of a channel if smaller buffers split the scene into other parts; the same as
/// in tests/pictures/occlusion.rs.
const MOST_DIFFERENCE: f32 = 0.004;

fn difference(a: &Picture, b: &Picture) -> f32 {
    let pairs = a.color.as_flattened().iter().zip(b.color.as_flattened());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

/// A device of a host application, with the given limits.
fn host_device(required_limits: wgpu::Limits) -> Gpu {
    let open = async {
        let instance =
            wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
        let adapter = instance.enumerate_adapters(wgpu::Backends::all()).await.swap_remove(0);
        let descriptor = wgpu::DeviceDescriptor { required_limits, ..Default::default() };
        let (device, queue) = adapter.request_device(&descriptor).await.expect("a device");
        // The host panics if it hears of an error. It must not hear of errors that the engine
        // causes.
        device.on_uncaptured_error(Arc::new(|error| panic!("the host heard of {error}")));
        Gpu::from_wgpu(device, queue, adapter.get_info())
    };
    pollster::block_on(open)
}

/// A device of a host application whose buffers have at most `bytes`.
fn small_device(bytes: u64) -> Gpu {
    host_device(wgpu::Limits {
        max_buffer_size: bytes,
        max_storage_buffer_binding_size: bytes,
        ..wgpu::Limits::default()
    })
}

#[test]
fn a_small_device_draws_the_same_or_says_why_not() {
    let scene = scene(false);
    let truth = scattered(gpu(), &scene).expect("draws");
    let mut errors = 0;
    for shift in 16..27 {
        match scattered(&small_device(1 << shift), &scene) {
            Ok(picture) => {
                let difference = difference(&picture, &truth);
                assert!(
                    difference <= MOST_DIFFERENCE,
                    "2^{shift} bytes per buffer: the picture differs by {difference}"
                );
            }
            Err(Error::Driver(message)) => {
                assert!(message.contains("buffer"), "2^{shift} bytes per buffer: {message}");
                errors += 1;
            }
            Err(other) => panic!("2^{shift} bytes per buffer: {other}"),
        }
    }
    assert!((1..11).contains(&errors), "{errors}");
}

#[test]
fn what_did_not_fit_leaves_the_device_usable() {
    let scene = scene(true);
    let gpu = small_device(1 << 26);
    let mut renderer = Renderer::new(&gpu);
    let mut prepared = renderer.prepare(&scene).expect("fits");
    let (camera, settings) = view(&scene);
    let first = renderer.render(&mut prepared, &camera, &settings).expect("draws").0;
    // One row of this picture is larger than the largest buffer.
    let huge = Settings::new([1 << 23, 2]);
    let error = renderer.render(&mut prepared, &camera, &huge).unwrap_err();
    assert!(matches!(error, Error::Driver(_) | Error::Argument(_)), "{error}");
    let again = renderer.render(&mut prepared, &camera, &settings).expect("draws again").0;
    assert!(same(&first, &again));
}

/// Scenes of 67 million candidates and pictures of 65,536 tiles need more workgroups than one row
/// of a dispatch holds. If a row holds 16 or 24 workgroups, the small scenes here need several rows
/// too. Rows of 24 end beyond the last tile.
#[test]
fn dispatches_of_many_rows_draw_the_same() {
    let usual = host_device(wgpu::Limits::default());
    let narrow = [16, 24].map(|row| {
        host_device(wgpu::Limits {
            max_compute_workgroups_per_dimension: row,
            ..wgpu::Limits::default()
        })
    });
    for (name, scene) in [("whole", scene(false)), ("in bricks", scene(true))] {
        let expected = drawn(&usual, &scene).expect("draws");
        let covered = expected.color.iter().filter(|color| color[3] > 0.5).count();
        assert!(covered > 1000, "{name}: {covered} pixels");
        for gpu in &narrow {
            assert!(
                same(&drawn(gpu, &scene).expect("draws"), &expected),
                "{name}: a different picture"
            );
        }
    }
}

/// If slices are so wide that a binding holds few, a chunk has two slices and their neighbours.
/// Wider slices are refused.
#[test]
fn wide_slices_are_drawn_in_thin_chunks() {
    let gpu = host_device(wgpu::Limits {
        max_storage_buffer_binding_size: 1 << 20,
        ..wgpu::Limits::default()
    });
    let scene = |side: usize| {
        let value = |index: usize| {
            let [x, y] = [index % side, index / side % side].map(|at| at as f64 / side as f64);
            (255.0 * (20.0 * x).sin().abs() * (20.0 * y).cos().abs()) as u8
        };
        let samples = Samples::U8((0..9 * side * side).map(value).collect());
        let volume =
            Volume::new(Lattice::with_spacing([side, side, 9], DVec3::ONE), samples).unwrap();
        let transfer = TransferFunction {
            opacity: vec![(0.0, 0.0), (255.0, 0.9)],
            shade: Some(Shade::default()),
            ..TransferFunction::default()
        };
        Scene::new().with_volume(volume, Kernel::default(), transfer)
    };
    let wide = scene(300);
    let expected = scattered(&host_device(wgpu::Limits::default()), &wide).expect("draws");
    let covered = expected.color.iter().filter(|color| color[3] > 0.5).count();
    assert!(covered > 1000, "{covered} pixels");
    let difference = difference(&scattered(&gpu, &wide).expect("draws"), &expected);
    assert!(difference < MOST_DIFFERENCE, "the picture differs by {difference}");
    let refused = scattered(&gpu, &scene(600)).unwrap_err();
    assert!(
        matches!(&refused, Error::Argument(what) if what.contains("convert the volume to bricks")),
        "{refused}"
    );
}

/// A picture with so many tiles that there are not enough bins for all its sheets is drawn in
/// strips.
#[test]
fn many_sheets_of_many_tiles_are_drawn_in_strips() {
    let gpu = gpu();
    let mut knot = Mesh::knot(60, 6);
    knot.positions.iter_mut().for_each(|place| *place *= 0.5);
    let scene = Scene::new().with_splats(knot.surfels(&SurfelOptions::default()).unwrap());
    let camera = Camera::framing(&scene.bounds(), DVec3::new(0.4, -0.3, -1.0), DVec3::Y, 1.2);
    let mut renderer = Renderer::new(gpu);
    let mut prepared = renderer.prepare(&scene).expect("fits");
    // 90,000 tiles of 8 × 8 pixels, with about 30 groups of 128 sheets, need more than the
    // 2,097,152 bins.
    let settings = Settings { size: [2400, 2400], sheet_pixels: 0.35, ..Settings::new([1, 1]) };
    let sheets = scene.sheets(&camera.view(settings.size).unwrap(), &settings).count();
    assert!(sheets > 3500, "{sheets} sheets");
    let thin = renderer.render(&mut prepared, &camera, &settings).expect("draws").0;
    // The same number of sheets in a picture that needs no strips.
    let small = Settings { size: [600, 600], sheet_pixels: 0.35 / 4.0, ..settings };
    let whole = renderer.render(&mut prepared, &camera, &small).expect("draws").0;
    let coverage = |picture: &Picture| {
        let covered = picture.color.iter().filter(|color| color[3] > 0.5).count();
        covered as f64 / picture.color.len() as f64
    };
    let [large, small] = [&thin, &whole].map(coverage);
    assert!(small > 0.05 && (large / small - 1.0).abs() < 0.01, "{large} and {small}");
}

/// One binding holds the batches of candidates of a picture, so it limits their number: here to two
/// million. If bricks show more, coarser bricks are drawn.
#[test]
fn bricks_that_show_too_much_are_drawn_coarser() {
    let volume = Arc::new(Phantom::Specimen.sample_bytes([128; 3]).unwrap());
    // Everything is visible, the air faintly.
    let transfer = TransferFunction {
        opacity: vec![(0.0, 0.001), (255.0, 0.9)],
        ..TransferFunction::automatic(&volume)
    };
    let scene =
        Scene::new().with_bricks(Bricks::from_volume(volume).unwrap(), Kernel::default(), transfer);
    let (camera, settings) = view(&scene);
    let settings = Settings { detail: Detail::Pixels(0.0), ..settings };
    let [(fine, all), (coarse, fewer)] = [1 << 27, 1 << 20].map(|bytes| {
        let gpu = host_device(wgpu::Limits {
            max_storage_buffer_binding_size: bytes,
            ..wgpu::Limits::default()
        });
        let mut renderer = Renderer::new(&gpu);
        let mut prepared = renderer.prepare(&scene).expect("fits");
        let first = renderer.render(&mut prepared, &camera, &settings).expect("draws").0;
        let (again, stats) =
            renderer.render(&mut prepared, &camera, &settings).expect("draws again");
        assert!(same(&first, &again), "a different picture");
        assert_eq!(stats.read_bricks, 0, "a resting view reads no bricks");
        (again, stats)
    });
    assert_eq!((all.lambda, all.bricks), (0.0, 64));
    assert!(fewer.lambda > 0.0 && fewer.bricks < 64, "{fewer:?}");
    let agreement = measured(&fine, &coarse);
    assert!(agreement > 25.0, "{agreement:.1} dB");
}

/// A picture too large for a binding is drawn in strips. Its splat budget applies to the whole
/// picture; otherwise the strips would differ.
#[test]
fn a_budget_counts_for_the_whole_picture() {
    let splats = Mesh::knot(600, 50).surfels(&SurfelOptions::default()).unwrap();
    let tree = Tree::build(&splats, &BuildOptions::default(), None).expect("a tree");
    let scene = Scene::new().with_hierarchy(Hierarchy::from_tree(tree).expect("a hierarchy"));
    let (camera, settings) = view(&scene);
    let settings = Settings { size: [400, 300], detail: Detail::Splats(3000), ..settings };
    // At 16 bytes per pixel, the second device draws 163 rows at a time.
    let pictures = [1 << 27, 1 << 20].map(|bytes| {
        let gpu = host_device(wgpu::Limits {
            max_storage_buffer_binding_size: bytes,
            ..wgpu::Limits::default()
        });
        let mut renderer = Renderer::new(&gpu);
        let mut prepared = renderer.prepare(&scene).expect("fits");
        renderer.render(&mut prepared, &camera, &settings).expect("draws")
    });
    let [(whole, whole_stats), (strips, strip_stats)] = &pictures;
    assert!(
        whole_stats.cut_pixels > 0.0
            && whole_stats.splats > 1500
            && whole_stats.splats > strip_stats.splats,
        "{whole_stats:?}\n{strip_stats:?}"
    );
    assert!(
        (whole_stats.cut_pixels / strip_stats.cut_pixels - 1.0).abs() < 1e-9,
        "{whole_stats:?}\n{strip_stats:?}"
    );
    let difference = difference(whole, strips);
    assert!(difference < MOST_DIFFERENCE, "the picture differs by {difference}");
}

/// Hierarchies and bricks that share too little memory look the same whatever was drawn before.
/// More memory never shows less.
#[test]
fn memory_is_shared_evenly() {
    let splats = Mesh::knot(600, 50).surfels(&SurfelOptions::default()).unwrap();
    let tree = Tree::build(&splats, &BuildOptions::default(), None).expect("a tree");
    let scene = scene(true).with_hierarchy(Hierarchy::from_tree(tree).expect("a hierarchy"));
    let (camera, settings) = view(&scene);
    let mut nearer = camera.clone();
    nearer.position = nearer.position.lerp(nearer.focal_point, 0.6);
    let settings = Settings { detail: Detail::Pixels(0.2), ..settings };
    let mut kinds = Vec::new();
    for mebibytes in 1..12u64 {
        let gpu = gpu().clone().with_memory(mebibytes << 20);
        let pictures = |cameras: &[&Camera]| {
            let mut renderer = Renderer::new(&gpu);
            let mut prepared = renderer.prepare(&scene)?;
            let draw = |camera: &&Camera| renderer.render(&mut prepared, *camera, &settings);
            cameras.iter().map(draw).collect::<splatkit::Result<Vec<_>>>()
        };
        let (alone, later) = (pictures(&[&camera]), pictures(&[&nearer, &camera]));
        kinds.push(match (alone, later) {
            (Ok(alone), Ok(later)) => {
                let ((alone, stats), (later, _)) = (&alone[0], &later[1]);
                assert!(
                    same(alone, later),
                    "{mebibytes} MiB: the picture depends on the view before"
                );
                Some((stats.lambda, stats.missing_pages))
            }
            (Err(_), Err(_)) => None,
            (alone, later) => panic!("{mebibytes} MiB: {:?} and {:?}", alone.err(), later.err()),
        });
    }
    println!("{kinds:?}");
    let drawn: Vec<_> = kinds.iter().skip_while(|kind| kind.is_none()).collect();
    let no_less = |pair: &[&Option<(f64, u64)>]| match (pair[0], pair[1]) {
        (Some(less), Some(more)) => more.0 <= less.0 && more.1 <= less.1,
        _ => false,
    };
    assert!(drawn.windows(2).all(no_less), "{kinds:?}");
    assert!(drawn[0].is_some_and(|(lambda, missing)| lambda > 0.0 && missing > 0), "{kinds:?}");
}

/// Draws a picture twice. The second is like the first; if the first was refused, so is the second.
fn drawn_twice(
    mut draw: impl FnMut() -> splatkit::Result<(Picture, FrameStats)>,
) -> splatkit::Result<(Picture, FrameStats)> {
    let first = draw().map_err(|error| error.to_string());
    let second = draw();
    match (&first, &second) {
        (Ok((first, _)), Ok((second, _))) => {
            assert!(same(first, second), "two pictures of one view");
        }
        (first, second) => {
            assert_eq!(
                first.as_ref().err(),
                second.as_ref().err().map(ToString::to_string).as_ref()
            );
        }
    }
    second
}

/// A scene that exceeds the memory limit is refused before its samples, or the lists of visible
/// samples, are uploaded. If coarser bricks fit, these are drawn instead.
#[test]
fn memory_is_kept_to() {
    for in_bricks in [false, true] {
        let scene = scene(in_bricks);
        let expected = drawn(gpu(), &scene).expect("draws");
        let mut outcomes = Vec::new();
        let mut coarsest = f64::INFINITY;
        for shift in 16..32 {
            let gpu = gpu().clone().with_memory(1 << shift);
            let mut renderer = Renderer::new(&gpu);
            let (camera, settings) = view(&scene);
            let outcome = match renderer.prepare(&scene) {
                Err(error) => Err(("prepared", error)),
                Ok(mut prepared) => {
                    let draw = || renderer.render(&mut prepared, &camera, &settings);
                    drawn_twice(draw).map_err(|error| ("drawn", error))
                }
            };
            let outcome = outcome.map(|(picture, stats)| {
                assert!(stats.lambda <= coarsest, "2^{shift} bytes: coarser than with less");
                coarsest = stats.lambda;
                picture
            });
            outcomes.push(match outcome {
                Ok(picture) if same(&picture, &expected) => "done",
                // Coarser bricks were drawn.
                Ok(picture) if in_bricks => {
                    let like = measured(&picture, &expected);
                    assert!(like > 15.0 && like.is_finite(), "2^{shift} bytes: {like:.1} dB");
                    "coarser"
                }
                Ok(_) => panic!("2^{shift} bytes: a different picture"),
                Err((when, Error::MemoryBound { limit, .. })) => {
                    assert_eq!(limit, 1 << shift, "2^{shift} bytes");
                    when
                }
                Err((_, other)) => panic!("2^{shift} bytes: {other}"),
            });
        }
        println!("{outcomes:?}");
        let mut kinds = outcomes.clone();
        kinds.dedup();
        let expected: &[&str] = if in_bricks {
            &["prepared", "coarser", "done"]
        } else {
            &["prepared", "drawn", "done"]
        };
        assert_eq!(kinds, expected, "{outcomes:?}");
    }
}
