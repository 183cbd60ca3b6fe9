//! Converts, draws and drops many varied scenes, one after the other in one process. The memory
//! that the process and the GPU hold stays the same.
//!
//! The default run is short. For a long one:
//! `SPLATKIT_LOAD_SECONDS=3600 cargo test --release --test load -- --nocapture`

mod testing;

use glam::DVec3;
use splatkit::{
    bricks::{self, Bricks},
    formats,
    gpu::{AdapterChoice, Gpu, Renderer},
    hierarchy::{self, BuildOptions, Detail, Hierarchy, Tree},
    input::{Limits, Source},
    math::{Camera, Kernel},
    scattered::SampleOptions,
    scene::{Mode, Optics, Order, Scene, Settings},
    surface::{Mesh, SurfelOptions},
    volume::{TransferFunction, phantoms::Phantom},
};
use std::{
    path::Path,
    sync::Arc,
    time::{Duration, Instant},
};
use testing::folder::Folder;

/// Rounds of the default run, and how many rounds differ. A round draws one scene of each kind.
/// Each kind of scene and settings has shaders that a driver keeps. So memory settles only after
/// every differing round was drawn once.
const ROUNDS: u32 = 9;
const CYCLE: u32 = 3;
const LONG_CYCLE: u32 = 20;
/// How much memory the last third of all rounds may hold beyond the first third, in bytes. A
/// twentieth of the first third is allowed in addition. Allocators keep freed memory.
const SLACK: u64 = 24 << 20;

/// A number below `below` that varies from round to round.
fn varied(round: u32, salt: u32, below: u32) -> u32 {
    // Knuth's multiplier (1973) spreads neighbours far apart.
    ((round + 1).wrapping_mul(salt + 17).wrapping_mul(2_654_435_761) >> 8) % below
}

fn specimen(side: usize) -> splatkit::volume::Volume {
    Phantom::Specimen.sample_bytes([side; 3]).unwrap()
}

fn knot(round: u32) -> Mesh {
    Mesh::knot(200 + varied(round, 1, 400), 12 + varied(round, 2, 12))
}

/// Scenes of each kind, whose sizes vary from round to round. Their files are written to `folder`
/// and replaced in every round.
fn scenes(round: u32, folder: &Path) -> Vec<(&'static str, Scene)> {
    let limits = Limits::default();
    let side = 24 + varied(round, 3, 40) as usize;
    let volume = Arc::new(specimen(side));
    let transfer = TransferFunction::automatic(&volume);
    let surfels = knot(round).surfels(&SurfelOptions::default()).unwrap();

    let splk = folder.join("a.splk");
    let tree = Tree::build(&surfels, &BuildOptions::default(), None).unwrap();
    hierarchy::file::write(&tree, &splk, &hierarchy::file::WriteOptions::default()).unwrap();
    let report = hierarchy::file::check(&splk, &limits);
    assert!(report.findings.is_empty(), "{:?}", report.findings);
    let read = Hierarchy::open(&splk, &limits).unwrap();

    let splv = folder.join("a.splv");
    bricks::write(&volume, &splv, &bricks::WriteOptions::default(), None).unwrap();
    let cut = Bricks::open(&splv, &limits).unwrap();

    // A table like those that other programs write.
    let mut table = String::from("x,y,z,value\n");
    for index in 0..600 + varied(round, 4, 600) {
        let [x, y, z] =
            [5, 6, 7].map(|salt| f64::from(varied(index + 7919 * round, salt, 1000)) / 1000.0);
        table += &format!("{x},{y},{z},{}\n", x * y + z);
    }
    let name = Path::new("a.csv");
    let points = formats::read_samples(
        &Source::from_bytes(name, table.as_bytes(), &limits).unwrap(),
        &formats::ReadOptions::default(),
    )
    .unwrap();
    let scattered = points.to_splats(&SampleOptions::default()).unwrap();
    let range = points.range();
    let points_transfer = TransferFunction {
        color: vec![(range[0], [0.1, 0.3, 0.9]), (range[1], [0.9, 0.7, 0.1])],
        opacity: vec![(range[0], 0.0), (range[1], 0.5)],
        unit: 0.1,
        ..TransferFunction::default()
    };
    vec![
        ("volume", Scene::new().with_volume(volume.clone(), Kernel::default(), transfer.clone())),
        ("bricks", Scene::new().with_bricks(cut, Kernel::default(), transfer.clone())),
        ("surfels", Scene::new().with_splats(surfels.clone())),
        ("hierarchy", Scene::new().with_hierarchy(read)),
        ("scattered", Scene::new().with_samples(scattered, points_transfer)),
        (
            "mixed",
            Scene::new().with_volume(volume, Kernel::default(), transfer).with_splats(surfels),
        ),
    ]
}

/// Settings that vary from round to round. Bricks are drawn in sheets only.
fn settings(round: u32, name: &str) -> Settings {
    let mut settings = Settings::new([64 + varied(round, 8, 200), 64 + varied(round, 9, 200)]);
    settings.detail = Detail::Pixels(f64::from(varied(round, 10, 3)));
    settings.occlusion = !round.is_multiple_of(3);
    match round % 5 {
        3 if name != "bricks" => settings.mode = Mode::Splats(Order::FrontToBack),
        4 => settings.optics = Optics::XRay,
        _ => {}
    }
    settings
}

/// Resident memory of the process in bytes; 0 if the system does not report it.
fn resident() -> u64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let kib = text.lines().find_map(|line| {
        line.strip_prefix("VmRSS:")?.trim().strip_suffix(" kB")?.parse::<u64>().ok()
    });
    1024 * kib.unwrap_or(0)
}

/// Number of buffers on the GPU and their bytes; 0 if the backend does not report them.
fn on_the_gpu(gpu: &Gpu) -> (usize, u64) {
    gpu.wait().unwrap();
    let report = gpu.device.generate_allocator_report();
    report.map_or((0, 0), |report| (report.allocations.len(), report.total_allocated_bytes))
}

#[test]
fn nothing_grows() {
    let seconds =
        std::env::var("SPLATKIT_LOAD_SECONDS").ok().map(|text| text.parse().expect("seconds"));
    let end = seconds.map(|seconds| Instant::now() + Duration::from_secs(seconds));
    let gpu = Gpu::headless(&AdapterChoice::Automatic).expect("an adapter");
    let folder = Folder::new();
    let (mut held, mut pictures, mut buffers) = (Vec::new(), 0, None);
    let start = Instant::now();
    for number in 0.. {
        if end.map_or(number >= ROUNDS, |end| Instant::now() >= end) {
            break;
        }
        let round = number % if end.is_some() { LONG_CYCLE } else { CYCLE };
        {
            let mut renderer = Renderer::new(&gpu);
            for (name, scene) in scenes(round, folder.as_ref()) {
                let mut prepared = renderer.prepare(&scene).unwrap();
                let mut camera =
                    Camera::framing(&scene.bounds(), DVec3::new(0.4, -0.7, -1.0), DVec3::Y, 1.2);
                for step in 0..2 {
                    let drawn =
                        renderer.render(&mut prepared, &camera, &settings(round + step, name));
                    let picture =
                        drawn.unwrap_or_else(|error| panic!("round {round}, {name}: {error}")).0;
                    assert!(
                        picture.color.iter().any(|pixel| pixel[3] > 0.0),
                        "round {round}, {name}: an empty picture"
                    );
                    camera.position =
                        camera.focal_point + 1.3 * (camera.position - camera.focal_point);
                    pictures += 1;
                }
            }
        }
        let usage = on_the_gpu(&gpu);
        // Everything that the round created is freed.
        let first = *buffers.get_or_insert(usage);
        assert_eq!(first, usage, "round {round}: buffers and bytes on the GPU");
        assert_eq!(folder.names().len(), 2, "files are replaced, and nothing else is left");
        held.push(resident());
        if end.is_some() && number % 50 == 0 {
            let [mib, gpu_mib] = [resident() >> 20, usage.1 >> 20];
            println!(
                "{:7.0} s, round {number}: {mib} MiB, {} buffers of {gpu_mib} MiB",
                start.elapsed().as_secs_f64(),
                usage.0
            );
        }
    }
    let early = held[..held.len().div_ceil(3)].iter().max().unwrap();
    let last = held[held.len() - held.len().div_ceil(3)..].iter().max().unwrap();
    println!(
        "{pictures} pictures in {} rounds, {:.0} s; at most {} MiB in the first third, {} MiB in \
         the last; {} buffers on the GPU",
        held.len(),
        start.elapsed().as_secs_f64(),
        early >> 20,
        last >> 20,
        buffers.unwrap().0
    );
    assert!(*last <= early + early / 20 + SLACK, "{early} bytes grew to {last}");
}
