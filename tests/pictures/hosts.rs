//! A host application that owns the frame: it encodes splatkit's passes among its own, polls, and
//! composites by depth. The pictures are those that `render` reads back.

#[path = "../../examples/host/frame.rs"]
mod frame;
#[path = "../../examples/host/target.rs"]
mod target;
#[path = "../../examples/host/triangles.rs"]
mod triangles;

use crate::testing::gpu::gpu;
use frame::Host;
use splatkit::{
    Device, Error, Renderer,
    glam::{DMat4, DVec2, DVec3, DVec4, dcamera::rh},
    gpu::{Budget, Depth, Gpu, Output, Progress},
    hierarchy::{BuildOptions, Detail, Hierarchy, Tree, file},
    input::Limits,
    math::{Camera, Kernel, View, Viewpoint},
    scene::{Evaluate, Scene, Settings},
    surface::{Mesh, SurfelOptions},
    volume::{TransferFunction, phantoms::Phantom},
    wgpu::{self, TextureFormat, TextureUsages},
};
use std::sync::atomic::{AtomicBool, Ordering};
use triangles::Corner;

const SIZE: [u32; 2] = [90, 70];

fn knot() -> splatkit::splat::Surfels {
    Mesh::knot(200, 24).surfels(&SurfelOptions::default()).expect("surfels")
}

fn with_volume(scene: Scene) -> Scene {
    let volume = Phantom::Specimen.sample_bytes([40; 3]).expect("a volume");
    let transfer = TransferFunction::automatic(&volume);
    scene.with_volume(volume, Kernel::default(), transfer)
}

fn hierarchy() -> Scene {
    let tree = Tree::build(&knot(), &BuildOptions::default(), None).expect("a tree");
    let bytes = file::to_bytes(&tree, &file::WriteOptions::default()).expect("the file");
    let hierarchy = Hierarchy::from_bytes(bytes, "knot", &Limits::default()).expect("a hierarchy");
    Scene::new().with_hierarchy(hierarchy)
}

fn camera(scene: &Scene) -> Camera {
    let mut camera = Camera::framing(&scene.bounds(), DVec3::NEG_Z, DVec3::Y, 9.0 / 7.0);
    camera.azimuth(35.0);
    camera
}

/// A texture to draw into and to read.
fn texture(gpu: &Gpu, format: TextureFormat, [width, height]: [u32; 2]) -> wgpu::TextureView {
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("test"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

fn buffer(gpu: &Gpu, bytes: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("test"),
        size: bytes,
        usage: usage | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// Returns the bytes that `copy` brings to a buffer.
fn bytes(
    gpu: &Gpu,
    count: u64,
    copy: impl FnOnce(&mut wgpu::CommandEncoder, &wgpu::Buffer),
) -> Vec<u8> {
    let staging = buffer(gpu, count, wgpu::BufferUsages::MAP_READ);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    copy(&mut encoder, &staging);
    gpu.queue.submit([encoder.finish()]);
    staging.map_async(wgpu::MapMode::Read, .., |mapped| mapped.expect("mapped"));
    gpu.wait().expect("a sound device");
    staging.get_mapped_range(..).expect("mapped").to_vec()
}

/// Returns the texels of a texture, row by row.
fn texels(gpu: &Gpu, view: &wgpu::TextureView, bytes_each: u32) -> Vec<u8> {
    let size = view.texture().size();
    let (packed, row) = (size.width * bytes_each, (size.width * bytes_each).next_multiple_of(256));
    let rows = bytes(gpu, u64::from(row * size.height), |encoder, staging| {
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(row),
            rows_per_image: None,
        };
        encoder.copy_texture_to_buffer(
            view.texture().as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: staging, layout },
            size,
        );
    });
    rows.chunks(row as usize).flat_map(|row| row[..packed as usize].to_vec()).collect()
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(4).map(|word| f32::from_le_bytes(word.try_into().unwrap())).collect()
}

/// Draws a picture as a host does. Returns the number of its batches.
fn drawn(
    gpu: &Gpu,
    renderer: &mut Renderer,
    (viewpoint, settings): (&impl Viewpoint, &Settings),
    output: Output,
) -> splatkit::Result<u32> {
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut frame = renderer.encode(&mut encoder, viewpoint, settings, output)?;
    assert!(!matches!(renderer.poll(&mut frame)?, Progress::Done(_)), "not submitted");
    gpu.queue.submit([encoder.finish()]);
    let mut batches = 1;
    loop {
        match renderer.poll(&mut frame)? {
            Progress::Done(stats) => {
                assert!(stats.splats + stats.gathered > 0);
                return Ok(batches);
            }
            Progress::NextBatch => {
                batches += 1;
                let mut encoder = gpu.device.create_command_encoder(&Default::default());
                renderer.encode_next(&mut encoder, &mut frame)?;
                gpu.queue.submit([encoder.finish()]);
            }
            _ => std::thread::yield_now(),
        }
    }
}

fn same_depths(depths: &[f32], expected: &[f32]) {
    for (at, (depth, expected)) in depths.iter().zip(expected).enumerate() {
        let is_near = depth == expected || (depth - expected).abs() <= 1e-6 * expected.abs();
        assert!(is_near, "depth of pixel {at}: {depth}, not {expected}");
    }
}

/// Draws a scene into textures and into buffers, and compares them with the picture of `render`.
/// Returns the number of batches.
fn check(name: &str, scene: &Scene, settings: &Settings, device: &Device) -> u32 {
    let gpu = gpu();
    let mut renderer = Renderer::new(device, scene).expect(name);
    let camera = camera(scene);
    let view = (&camera, settings);
    let color = texture(gpu, TextureFormat::Rgba32Float, SIZE);
    let depth = texture(gpu, TextureFormat::R32Float, SIZE);
    let output = Output::Textures {
        color: color.clone(),
        format: TextureFormat::Rgba32Float,
        depth: Some(Depth::Linear(depth.clone())),
        over: false,
    };
    // First of all, so that nothing is left of another picture.
    let batches = drawn(gpu, &mut renderer, view, output).expect(name);
    let (expected, _) = renderer.render(&camera, settings).expect(name);
    assert!(expected.color.iter().any(|pixel| pixel[3] > 0.3), "{name}: an empty picture");
    assert_eq!(floats(&texels(gpu, &color, 16)), expected.color.as_flattened(), "{name}");
    same_depths(&floats(&texels(gpu, &depth, 4)), &expected.depth);

    let pixels = u64::from(SIZE[0] * SIZE[1]);
    let source = |bytes| buffer(gpu, bytes, wgpu::BufferUsages::COPY_SRC);
    let (colors, distances) = (source(16 * pixels), source(4 * pixels));
    let output = Output::Buffers { color: colors.clone(), distance: Some(distances.clone()) };
    drawn(gpu, &mut renderer, view, output).expect(name);
    let read = |from: &wgpu::Buffer| {
        let all = bytes(gpu, from.size(), |encoder, to| {
            encoder.copy_buffer_to_buffer(from, 0, to, 0, from.size());
        });
        floats(&all)
    };
    assert_eq!(read(&colors), expected.color.as_flattened(), "{name}");
    let rays = camera.view(SIZE).unwrap();
    let depths = read(&distances).into_iter().enumerate().map(|(at, distance)| {
        let [x, y] = [at as u32 % SIZE[0], at as u32 / SIZE[0]].map(|n| f64::from(n) + 0.5);
        match expected.color[at][3] < 0.5 {
            true => f32::INFINITY,
            false => distance * rays.ray(DVec2::new(x, y)).1.z as f32,
        }
    });
    same_depths(&depths.collect::<Vec<_>>(), &expected.depth);
    batches
}

fn gpu_engine() -> Device {
    Device::Gpu(gpu().clone(), Budget::default())
}

fn cpu_engine() -> Device {
    Device::CpuFor(gpu().clone())
}

#[test]
fn a_host_gets_the_picture_that_is_read_back() {
    let settings = Settings::new(SIZE);
    let scatter = Settings { evaluate: Evaluate::Scatter, ..settings.clone() };
    let few = Settings { detail: Detail::Splats(500), ..settings.clone() };
    for device in [gpu_engine(), cpu_engine()] {
        check("surfels", &Scene::new().with_splats(knot()), &settings, &device);
        check("a volume", &with_volume(Scene::new()), &settings, &device);
        check("a scattered volume", &with_volume(Scene::new()), &scatter, &device);
        check("both", &with_volume(Scene::new().with_splats(knot())), &settings, &device);
        check("a hierarchy", &hierarchy(), &settings, &device);
        let batches = check("a hierarchy in few splats", &hierarchy(), &few, &device);
        assert!(batches > 1, "the cut is counted first, or a thread draws");
    }
}

/// A picture that does not fit a pass takes several batches. The textures stay as they are until
/// the last.
#[test]
fn small_passes_take_several_batches() {
    let scene = with_volume(Scene::new());
    let settings = Settings { evaluate: Evaluate::Scatter, ..Settings::new(SIZE) };
    let budget = Budget { entries: 1 << 14, record_words: 1 << 13, ..Budget::default() };
    let device = Device::Gpu(gpu().clone(), budget);
    assert!(check("small passes", &scene, &settings, &device) > 1);
}

#[test]
fn srgb_textures_display_the_same_colours() {
    let gpu = gpu();
    let scene = Scene::new().with_splats(knot());
    let (camera, settings) = (camera(&scene), Settings::new(SIZE));
    for device in [gpu_engine(), cpu_engine()] {
        let mut renderer = Renderer::new(&device, &scene).unwrap();
        let mut displayed = |format| {
            let view = texture(gpu, format, SIZE);
            drawn(gpu, &mut renderer, (&camera, &settings), (&view).into()).unwrap();
            texels(gpu, &view, 4)
        };
        // Both hold the bytes that are displayed. Where pixels are translucent, they differ:
        // colours are multiplied by opacity before they are encoded.
        let [plain, srgb] =
            [TextureFormat::Rgba8Unorm, TextureFormat::Rgba8UnormSrgb].map(&mut displayed);
        let mut opaque = 0;
        for (plain, srgb) in plain.chunks_exact(4).zip(srgb.chunks_exact(4)) {
            // Where an opacity lies between two bytes, devices round by the format.
            assert!(plain[3].abs_diff(srgb[3]) <= 1, "{plain:?} is displayed as {srgb:?}");
            if plain[3] == 255 && srgb[3] == 255 {
                opaque += 1;
                let far = plain.iter().zip(srgb).map(|(a, b)| a.abs_diff(*b)).max();
                assert!(far <= Some(1), "{plain:?} is displayed as {srgb:?}");
            }
        }
        assert!(opaque > 500);
    }
}

/// A depth buffer gets the depths that the host's projection gives: usual, reversed, with the far
/// plane at infinity, and without perspective.
#[test]
fn depth_buffers_get_the_depths_of_the_hosts_projection() {
    let gpu = gpu();
    let scene = Scene::new().with_splats(knot());
    let settings = Settings::new(SIZE);
    let perspective = camera(&scene);
    let mut flat = perspective.clone();
    flat.make_orthographic();
    let size = scene.bounds().diagonal();
    let (near, far) = (0.5 * size, 6.0 * size);
    let (forward, infinite) = ([near, far], [near, f64::INFINITY]);
    let [reversed, to_infinity] = [forward, infinite].map(|[near, far]| [far, near]);
    for (camera, [near, far]) in [
        (&perspective, forward),
        (&perspective, reversed),
        (&perspective, infinite),
        (&perspective, to_infinity),
        (&flat, forward),
        (&flat, reversed),
    ] {
        let clip = |z: f64| match (camera == &flat, near.is_infinite(), far.is_infinite()) {
            (true, ..) => (z - near) / (far - near),
            (_, true, _) => far / z,
            (_, _, true) => 1.0 - near / z,
            _ => far / (far - near) * (1.0 - near / z),
        };
        for device in [gpu_engine(), cpu_engine()] {
            let mut renderer = Renderer::new(&device, &scene).unwrap();
            let color = texture(gpu, TextureFormat::Rgba8Unorm, SIZE);
            let buffer = texture(gpu, TextureFormat::Depth32Float, SIZE);
            let output = Output::Textures {
                color,
                format: TextureFormat::Rgba8Unorm,
                depth: Some(Depth::Buffer { view: buffer.clone(), near, far }),
                over: false,
            };
            drawn(gpu, &mut renderer, (camera, &settings), output).unwrap();
            let (picture, _) = renderer.render(camera, &settings).unwrap();
            let expected: Vec<f32> = picture
                .depth
                .iter()
                .map(|&z| match z.is_finite() {
                    true => clip(f64::from(z)) as f32,
                    false => f32::from(near < far),
                })
                .collect();
            assert!(expected.iter().filter(|&&depth| depth > 0.0 && depth < 1.0).count() > 500);
            let depths = floats(&texels(gpu, &buffer, 4));
            for (depth, expected) in depths.iter().zip(&expected) {
                assert!((depth - expected).abs() < 2e-6, "{depth}, not {expected}");
            }
        }
    }
}

#[test]
fn a_picture_can_be_awaited() {
    let gpu = gpu();
    let scene = with_volume(Scene::new().with_splats(knot()));
    let (camera, settings) = (camera(&scene), Settings::new(SIZE));
    for device in [gpu_engine(), cpu_engine(), Device::Cpu] {
        let mut renderer = Renderer::new(&device, &scene).unwrap();
        let is_done = AtomicBool::new(false);
        let (picture, stats) = std::thread::scope(|threads| {
            // The event loop of the host.
            threads.spawn(|| {
                while !is_done.load(Ordering::Relaxed) {
                    gpu.device.poll(wgpu::PollType::Poll).expect("a sound device");
                    std::thread::yield_now();
                }
            });
            let drawn = pollster::block_on(renderer.render_async(&camera, &settings));
            is_done.store(true, Ordering::Relaxed);
            drawn
        })
        .unwrap();
        assert!(stats.splats > 0);
        let (expected, _) = renderer.render(&camera, &settings).unwrap();
        assert_eq!(picture.color, expected.color);
        assert_eq!(picture.depth, expected.depth);
    }
}

/// A frame of the CPU engine that another one follows, or that is stopped, ends soon.
#[test]
fn frames_of_a_thread_can_be_abandoned_and_stopped() {
    let gpu = gpu();
    let scene = with_volume(Scene::new());
    let camera = camera(&scene);
    let large = Settings { sheet_thickness: Some(1e-3), ..Settings::new([600, 400]) };
    let color = texture(gpu, TextureFormat::Rgba8Unorm, large.size);
    let mut renderer = Renderer::new(&cpu_engine(), &scene).unwrap();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut slow = renderer.encode(&mut encoder, &camera, &large, &color).unwrap();
    let small = Settings::new(SIZE);
    let (picture, _) = renderer.render(&camera, &small).unwrap();
    assert!(picture.color.iter().any(|pixel| pixel[3] > 0.3));
    let refused = renderer.poll(&mut slow).unwrap_err().to_string();
    assert!(refused.contains("another frame was begun"), "{refused}");
    let mut stopped = renderer.encode(&mut encoder, &camera, &large, &color).unwrap();
    large.controls.stop.request();
    let error = loop {
        match renderer.poll(&mut stopped) {
            Ok(Progress::Working) => std::thread::yield_now(),
            other => break other,
        }
    };
    assert!(matches!(error, Err(Error::Stopped)), "{error:?}");
}

#[test]
fn misuse_is_refused_with_what_to_do() {
    let gpu = gpu();
    let scene = Scene::new().with_splats(knot());
    let (camera, settings) = (camera(&scene), Settings::new(SIZE));
    let usual = texture(gpu, TextureFormat::Rgba8Unorm, SIZE);
    let textures = |color: &wgpu::TextureView, depth: Option<Depth>| {
        let format = color.texture().format();
        Output::Textures { color: color.clone(), format, depth, over: false }
    };
    let small = buffer(gpu, 100, wgpu::BufferUsages::COPY_SRC);
    let narrow = texture(gpu, TextureFormat::Rgba8Unorm, [80, 70]);
    let stencil = texture(gpu, TextureFormat::Depth24PlusStencil8, SIZE);
    let planes =
        |view: &wgpu::TextureView, near, far| Some(Depth::Buffer { view: view.clone(), near, far });
    let float = texture(gpu, TextureFormat::Depth32Float, SIZE);
    let outputs = [
        (textures(&narrow, None), "the texture of the colours is 80x70, the picture 90x70"),
        (
            textures(&usual, Some(Depth::Linear(usual.clone()))),
            "linear depths need the format R32Float, not Rgba8Unorm",
        ),
        (
            textures(&usual, planes(&stencil, 1.0, 2.0)),
            "a depth buffer needs a format such as Depth32Float, not Depth24PlusStencil8",
        ),
        (
            textures(&usual, planes(&float, 0.0, 2.0)),
            "a depth buffer needs two different planes in front of the eye, at most one at \
             infinity; near is 0, far 2",
        ),
        ((&small).into(), "the buffer of the colours has 100 bytes; 100800 are needed"),
    ];
    let said = |error: Error| match error {
        Error::Argument(message) => message,
        other => panic!("{other}"),
    };
    for device in [gpu_engine(), cpu_engine()] {
        let mut renderer = Renderer::new(&device, &scene).unwrap();
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        for (output, message) in &outputs {
            let refused = renderer.encode(&mut encoder, &camera, &settings, output.clone());
            assert_eq!(said(refused.expect_err(message)), *message);
        }
        let other = camera.view([30, 30]).unwrap();
        let refused = renderer.encode(&mut encoder, &other, &settings, &usual).unwrap_err();
        assert!(said(refused).contains("the view is that of a picture of 30x30 pixels"));

        let mut begin =
            |encoder: &mut _| renderer.encode(encoder, &camera, &settings, &usual).unwrap();
        let mut older = begin(&mut encoder);
        let mut newer = begin(&mut encoder);
        gpu.queue.submit([encoder.finish()]);
        let refused = said(renderer.poll(&mut older).unwrap_err());
        assert!(refused.contains("was begun with this renderer"), "{refused}");
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let refused = renderer.encode_next(&mut encoder, &mut newer).unwrap_err();
        assert!(said(refused).contains("the last batch of the picture is not done"));
    }
    let mut alone = Renderer::new(&Device::Cpu, &scene).unwrap();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let refused = alone.encode(&mut encoder, &camera, &settings, &usual).unwrap_err();
    assert!(said(refused).contains("use Device::CpuFor"));
}

/// An opaque picture of the triangles alone, and their view-space z.
fn triangles_alone(corners: &[Corner], clip: DMat4) -> Vec<Option<(f64, [f32; 3])>> {
    let mut pixels = vec![None; (SIZE[0] * SIZE[1]) as usize];
    for triangle in corners.chunks_exact(3) {
        let points = [0, 1, 2].map(|at| {
            let p = clip * DVec3::from(triangle[at].position.map(f64::from)).extend(1.0);
            let (DVec4 { x, y, .. }, [width, height]) = (p / p.w, SIZE.map(f64::from));
            (DVec2::new(0.5 * (x + 1.0) * width, 0.5 * (1.0 - y) * height), p.w)
        });
        let area = |a: DVec2, b: DVec2, c: DVec2| (b - a).perp_dot(c - a);
        let whole = area(points[0].0, points[1].0, points[2].0);
        for (at, pixel) in pixels.iter_mut().enumerate() {
            let [x, y] = [at as u32 % SIZE[0], at as u32 / SIZE[0]].map(|n| f64::from(n) + 0.5);
            let place = DVec2::new(x, y);
            let weights = [0, 1, 2]
                .map(|at| area(points[(at + 1) % 3].0, points[(at + 2) % 3].0, place) / whole);
            if weights.iter().any(|&weight| weight < 0.0) {
                continue;
            }
            let z = 1.0 / (0..3).map(|at| weights[at] / points[at].1).sum::<f64>();
            if pixel.is_none_or(|(nearest, _)| z < nearest) {
                *pixel = Some((z, triangle[0].color));
            }
        }
    }
    pixels
}

/// The composite of the example's host is the two pictures put together by depth.
#[test]
fn a_host_composites_its_triangles_by_depth() {
    let scene = with_volume(Scene::new().with_splats(knot()));
    let camera = camera(&scene);
    let (center, size) = (scene.bounds().center(), 0.5 * scene.bounds().diagonal());
    let corner = |x: f64, y: f64, z: f64, color| Corner {
        position: (center + size * DVec3::new(x, y, z)).as_vec3().to_array(),
        color,
    };
    let (red, blue) = ([0.9, 0.2, 0.1], [0.1, 0.4, 0.9]);
    let corners = [
        corner(-0.9, -0.1, -0.5, red),
        corner(0.9, -0.2, -0.3, red),
        corner(0.0, 0.3, 0.7, red),
        corner(0.1, -0.7, 0.6, blue),
        corner(-0.1, 0.7, 0.5, blue),
        corner(0.0, 0.0, -0.8, blue),
    ];
    // An eye beside the middle of a screen: the axis of the frustum is not that of the picture.
    let [near, far] = [0.3 * size, 20.0 * size];
    let center = camera.focal_point;
    let matrix = rh::view::look_at_mat4(camera.position, center, camera.view_up);
    let usual = rh::proj::directx::perspective(0.5, 9.0 / 7.0, near, far);
    let shift = DMat4::from_translation(DVec3::new(0.2, -0.1, 0.0));
    for (projection, device) in
        [(usual, gpu_engine()), (shift * usual, gpu_engine()), (shift * usual, cpu_engine())]
    {
        composites(&device, &scene, &corners, [matrix, projection], [near, far]);
    }
}

fn composites(
    device: &Device,
    scene: &Scene,
    corners: &[Corner],
    [matrix, projection]: [DMat4; 2],
    planes: [f64; 2],
) {
    let mut host = Host::new(gpu(), device, scene, corners, SIZE).unwrap();
    host.draw([matrix, projection], planes).unwrap();
    let composite = host.picture().unwrap();
    let view = View::from_matrices(matrix, projection, SIZE).unwrap();
    let settings = Settings::new(SIZE);
    let picture = Renderer::new(device, scene).unwrap().render(&view, &settings).unwrap().0;
    let triangles = triangles_alone(corners, projection * matrix);
    let (mut before, mut behind, mut edges) = (0, 0, 0);
    for (at, pixel) in composite.color.iter().enumerate() {
        let depth = f64::from(picture.depth[at]);
        let triangle_z = triangles[at].map(|(z, _)| z);
        let expected = put_together(picture.color[at], depth, triangles[at]);
        let differs = pixel
            .iter()
            .zip(&expected)
            .any(|(color, expected)| (color - expected).abs() > 1.01 / 255.0);
        match triangle_z {
            // Rounding decides where the two cross.
            _ if differs => {
                edges += usize::from(triangle_z.is_none_or(|z| (z / depth - 1.0).abs() > 1e-4));
            }
            Some(z) if z < depth => before += usize::from(depth.is_finite()),
            Some(_) => behind += 1,
            None => {}
        }
    }
    // Pixels on the edges of triangles.
    assert!(edges <= 12, "{edges} pixels differ");
    assert!(before > 100 && behind > 100, "{before} pixels before splats, {behind} behind");
}

/// Returns the colour of a pixel: the triangle's if it is nearer, or splatkit's over the host's
/// background.
fn put_together([r, g, b, a]: [f32; 4], depth: f64, triangle: Option<(f64, [f32; 3])>) -> Vec<f32> {
    match triangle {
        Some((z, color)) if z < depth => color.to_vec(),
        _ => {
            let background = [0.02, 0.03, 0.06];
            let both = [r, g, b].into_iter().zip(background);
            both.map(|(color, under)| color + (1.0 - a) * under).collect()
        }
    }
}
