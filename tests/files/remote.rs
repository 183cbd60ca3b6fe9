//! Pictures of remote objects are those of the local files, whatever the server does wrong: the
//! same bytes, or a clear error.

use crate::testing::{
    folder::Folder,
    grid::grid,
    server::{Fault, Server},
};
use glam::DVec3;
use splatkit::{
    Device, Error, Renderer,
    bricks::{self, Bricks},
    formats::{self, Kind, ReadOptions},
    hierarchy::{
        BuildOptions, Detail, Hierarchy, Tree,
        external::{ExternalOptions, Plan, convert},
        file::{self, WriteOptions},
    },
    input::{
        Limits,
        remote::{Cache, set_cache, traffic},
    },
    math::{Camera, Kernel},
    picture::Picture,
    scene::{Scene, Settings},
    surface::{Mesh, SurfelOptions},
    volume::{Lattice, Samples, TransferFunction, Volume},
};
use std::{
    io::Cursor,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError},
    time::{Duration, Instant},
};

/// A knotted tube of about `count` vertices, as a file.
fn knot(count: u32) -> Vec<u8> {
    let around = f64::from(count / 12).sqrt() as u32;
    let mesh = Mesh::knot(12 * around, around);
    let splats = mesh.surfels(&SurfelOptions::default()).expect("surfels");
    let tree = Tree::build(&splats, &BuildOptions::default(), None).expect("a tree");
    file::to_bytes(&tree, &WriteOptions::default()).expect("a file")
}

/// Keeps the process's cache for one test as long as the result lives.
fn alone() -> MutexGuard<'static, ()> {
    static CACHE: Mutex<()> = Mutex::new(());
    CACHE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Keeps what tests fetch in one temporary folder, for one test at a time.
fn keep() -> MutexGuard<'static, ()> {
    static FOLDER: OnceLock<Folder> = OnceLock::new();
    let guard = alone();
    let folder = FOLDER.get_or_init(Folder::new);
    set_cache(Cache { folder: folder.path("cache"), bytes: 1 << 30 });
    guard
}

/// A LAZ file of 80,000 points along a bumpy strip, in chunks of 4,000 from one end to the other.
/// It has so many random bytes a point that a chunk has about 400 KiB.
fn strip() -> Vec<u8> {
    const MORE: usize = 100;
    let items = laz::LazItemRecordBuilder::default_for_point_format_id(0, MORE as u16).unwrap();
    let layout = laz::LazVlrBuilder::new(items).with_fixed_chunk_size(4_000).build();
    let mut described = Vec::new();
    layout.write_to(&mut described).unwrap();
    let mut before = vec![0; 227 + 54];
    let mut put = |at: usize, bytes: &[u8]| before[at..at + bytes.len()].copy_from_slice(bytes);
    let start = 227 + 54 + described.len();
    put(0, b"LASF");
    put(24, &[1, 2]);
    put(94, &227u16.to_le_bytes());
    put(96, &(start as u32).to_le_bytes());
    put(100, &1u32.to_le_bytes());
    put(104, &[0x80]);
    put(105, &(20 + MORE as u16).to_le_bytes());
    put(107, &80_000u32.to_le_bytes());
    (0..3).for_each(|axis| put(131 + 8 * axis, &0.001f64.to_le_bytes()));
    put(227 + 2, laz::LazVlr::USER_ID.as_bytes());
    put(227 + 18, &laz::LazVlr::RECORD_ID.to_le_bytes());
    put(227 + 20, &(described.len() as u16).to_le_bytes());
    let mut out = Cursor::new([before, described].concat());
    out.set_position(start as u64);
    let mut packer = laz::LasZipCompressor::new(&mut out, layout).unwrap();
    let mut random = 1u32;
    for point in 0..80_000 {
        let (row, column) = (point / 100, point % 100);
        let height = 30.0 * (f64::from(row) / 20.0).sin() * (f64::from(column) / 15.0).cos();
        let place = [10 * row, 10 * column, height as i32 * 10];
        let mut record: Vec<u8> = place.iter().flat_map(|axis| axis.to_le_bytes()).collect();
        record.resize(20, 0);
        record.resize_with(20 + MORE, || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (random >> 24) as u8
        });
        packer.compress_one(&record).unwrap();
    }
    packer.done().unwrap();
    drop(packer);
    out.into_inner()
}

#[test]
fn clouds_are_converted_piece_by_piece() {
    let (_cache, folder) = (alone(), Folder::new());
    // Too small for the object as a whole.
    let forget = || set_cache(Cache { folder: folder.path("kept"), bytes: 1 << 20 });
    let bytes = strip();
    let size = bytes.len() as u64;
    std::fs::write(folder.path("a.laz"), &bytes).unwrap();
    let server = Server::of(bytes);
    let options = ExternalOptions { parts: Some(8), ..ExternalOptions::default() };
    let write = WriteOptions::default();
    let converted = |input: PathBuf, out: &str| {
        let (out, limits) = (folder.path(out), Limits::default());
        convert(&[input], &limits, &out, &options, &write, None).unwrap();
        std::fs::read(out).unwrap()
    };
    let local = converted(folder.path("a.laz"), "local.splk");
    forget();
    server.fail(|number, _| if number % 5 == 2 { Fault::Cut(1000) } else { Fault::None });
    assert!(converted(server.address("a.laz").into(), "far.splk") == local);
    server.fail(|_, _| Fault::None);

    forget();
    let address = [PathBuf::from(server.address("a.laz"))];
    let limits = Limits::default();
    let plan =
        Plan::make(&address, &folder.path("parts"), &limits, &options, &write, None).unwrap();
    server.asked();
    for part in 0..plan.parts() {
        // As another process would, which has nothing of the object yet.
        forget();
        plan.part(part, &limits, None).unwrap();
        let asked: u64 = server.asked().iter().map(|range| range.end - range.start).sum();
        assert!((1..size * 2 / 3).contains(&asked), "part {part}: {asked} of {size} bytes");
    }
    plan.join(&folder.path("joined.splk"), None).unwrap();
    assert!(std::fs::read(folder.path("joined.splk")).unwrap() == local);

    // An object that changes makes the plan void.
    std::fs::remove_file(plan.part_path(0)).unwrap();
    server.tag(Some("\"second\""));
    forget();
    let error = plan.part(0, &limits, None).unwrap_err().to_string();
    assert!(error.contains("has changed since the plan was made"), "{error}");
}

fn draw(scene: &Scene, size: u32) -> splatkit::Result<Picture> {
    let mut renderer = Renderer::new(&Device::Cpu, scene)?;
    let camera = Camera::framing(&scene.bounds(), DVec3::new(1.0, -2.0, 0.7), DVec3::Z, 1.0);
    Ok(renderer.render(&camera, &Settings::new([size; 2]))?.0)
}

fn picture_of(hierarchy: splatkit::Result<Hierarchy>) -> splatkit::Result<Vec<[f32; 4]>> {
    Ok(draw(&Scene::new().with_hierarchy(Arc::new(hierarchy?)), 96)?.color)
}

fn limits() -> Limits {
    Limits::default()
}

#[test]
fn a_hierarchy_is_drawn_in_ranges() {
    let _cache = keep();
    let bytes = knot(60_000);
    let local = picture_of(Hierarchy::from_bytes(bytes.clone(), "a.splk", &limits())).unwrap();
    let server = Server::of(bytes.clone());
    let open = || Hierarchy::open(server.address("a.splk"), &limits());
    assert!(picture_of(open()).unwrap() == local);
    let asked = server.asked();
    assert!(asked[0] == (0..256 << 10) && asked.len() < 12, "{asked:?}");
    // Now it is in memory and on disk.
    assert!(picture_of(open()).unwrap() == local);
    assert!(server.asked().is_empty());
    let [local, remote] =
        [Hierarchy::from_bytes(bytes, "a", &limits()), open()].map(|one| one.unwrap());
    assert!(local.leaves().unwrap().splats == remote.leaves().unwrap().splats);
    assert!(file::check(server.address("a.splk"), &limits()).findings.is_empty());
}

#[test]
fn the_first_request_has_the_first_picture() {
    let _cache = keep();
    let bytes = file::to_bytes(&grid(4), &WriteOptions::default()).unwrap();
    assert!(bytes.len() > 3 * (256 << 10), "{}", bytes.len());
    let server = Server::of(bytes);
    let hierarchy = Hierarchy::open(server.address("many.splk"), &limits()).unwrap();
    assert!(hierarchy.page_count() > 8 * 512);
    let nodes = |page| hierarchy.read_page(page).unwrap().nodes.len();
    assert!(nodes(0) + nodes(1) > 250);
    let scene = Scene::new().with_hierarchy(Arc::new(hierarchy));
    let settings = Settings { detail: Detail::Pixels(8.0), ..Settings::new([32; 2]) };
    let mut renderer = Renderer::new(&Device::Cpu, &scene).unwrap();
    let camera = Camera::framing(&scene.bounds(), DVec3::X, DVec3::Z, 1.0);
    let picture = renderer.render(&camera, &settings).unwrap().0;
    assert!(picture.color.iter().any(|color| color[3] > 0.5));
    let asked = server.asked();
    assert!(matches!(&asked[..], [first] if *first == (0..256 << 10)), "{asked:?}");
}

/// Prints what the first picture of a file with many pages takes.
#[test]
#[ignore = "figures, not a check"]
fn first_picture_of_many_pages() {
    let bytes = file::to_bytes(&grid(6), &WriteOptions::default()).unwrap();
    let folder = Folder::new();
    set_cache(Cache { folder: folder.path("cache"), bytes: 1 << 30 });
    println!("a file of {} bytes", bytes.len());
    let server = Server::of(bytes);
    let before = traffic();
    let report = |what: &str, begun: Instant| {
        let (now, seconds) = (traffic(), begun.elapsed().as_secs_f64());
        let [requests, bytes] = [now.requests - before.requests, now.bytes - before.bytes];
        println!("{what}: {requests} requests, {bytes} bytes, {seconds:.3} s");
    };
    let begun = Instant::now();
    let hierarchy = Hierarchy::open(server.address("many.splk"), &limits()).unwrap();
    report("open", begun);
    println!("{} pages", hierarchy.page_count());
    let scene = Scene::new().with_hierarchy(Arc::new(hierarchy));
    let camera = Camera::framing(&scene.bounds(), DVec3::X, DVec3::Z, 1.0);
    let mut renderer = Renderer::new(&Device::Cpu, &scene).unwrap();
    for pixels in [8.0, 1.0, 0.25] {
        let settings = Settings { detail: Detail::Pixels(pixels), ..Settings::new([32; 2]) };
        renderer.render(&camera, &settings).unwrap();
        report(&format!("picture with a cut of {pixels} pixels"), begun);
    }
}

#[test]
fn a_hierarchy_is_never_drawn_wrong() {
    let _cache = keep();
    let bytes = knot(60_000);
    let local = picture_of(Hierarchy::from_bytes(bytes.clone(), "a.splk", &limits())).unwrap();
    for fault in [Fault::Cut(70_000), Fault::Status(500), Fault::Wrong] {
        // The second answer is wrong, or every second one if the answer itself shows it.
        let server = Server::of(bytes.clone());
        let is_hit = move |number| number == 1 || fault != Fault::Wrong && number % 2 == 1;
        server.fail(move |number, _| if is_hit(number) { fault } else { Fault::None });
        let drawn = picture_of(Hierarchy::open(server.address("a.splk"), &limits()));
        assert!(drawn.unwrap() == local, "{fault:?}");
    }
    for (fault, words) in [
        (Fault::Wrong, "its checksum does not match, also when it is fetched again"),
        (Fault::Whole, "200 instead of 206"),
        (Fault::Status(404), "404"),
        (Fault::Status(403), "403"),
        (Fault::Changed, "changed while it was read"),
    ] {
        let server = Server::of(bytes.clone());
        server.fail(move |number, _| if number > 0 { fault } else { Fault::None });
        let drawn = picture_of(Hierarchy::open(server.address("a.splk"), &limits()));
        let error = drawn.map(drop).expect_err("a fault").to_string();
        assert!(error.contains(words) && error.contains("a.splk: "), "{error}");
    }
    // Wrong from the first byte on: once, and always.
    let server = Server::of(bytes);
    server.fail(|number, _| if number == 0 { Fault::Wrong } else { Fault::None });
    let open = |name| Hierarchy::open(server.address(name), &limits());
    assert!(picture_of(open("b.splk")).unwrap() == local);
    server.fail(|_, _| Fault::Wrong);
    assert!(matches!(open("c.splk"), Err(Error::Input { .. })));
}

#[test]
fn volumes_in_bricks_are_drawn_in_ranges() {
    let _cache = keep();
    let folder = Folder::new();
    // Noise, which cannot be packed into the first request.
    let mixed = |at: u32| (at ^ at >> 7).wrapping_mul(2_654_435_761);
    let noise = (0..100 * 90 * 80).map(|at| (mixed(mixed(at)) >> 13) as u8);
    let lattice = Lattice::with_spacing([100, 90, 80], DVec3::ONE);
    let volume = Volume::new(lattice, Samples::U8(noise.collect())).unwrap();
    let (path, transfer) = (folder.path("a.splv"), TransferFunction::automatic(&volume));
    bricks::write(&volume, &path, &bricks::WriteOptions::default(), None).unwrap();
    let picture = |path: &Path| -> splatkit::Result<Vec<[f32; 4]>> {
        let bricks = Arc::new(Bricks::open(path, &limits())?);
        let scene = Scene::new().with_bricks(bricks, Kernel::default(), transfer.clone());
        Ok(draw(&scene, 64)?.color)
    };
    let local = picture(&path).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let server = Server::of(bytes.clone());
    let address = server.address("a.splv");
    assert_eq!(Kind::of(&address, &limits(), &ReadOptions::default()).unwrap(), Some(Kind::Bricks));
    assert!(picture(Path::new(&address)).unwrap() == local);
    assert!(server.asked().len() < 12);
    assert!(bricks::check(&address, &limits(), None).findings.is_empty());
    let server = Server::of(bytes);
    server.fail(|number, _| if number == 1 { Fault::Wrong } else { Fault::None });
    let finest = |name| Bricks::open(server.address(name), &limits())?.volume(0);
    assert!(finest("b.splv").unwrap().samples.bytes() == volume.samples.bytes());
    assert!(server.asked().len() < 20);
    server.fail(|number, _| if number > 0 { Fault::Wrong } else { Fault::None });
    let error = finest("c.splv").map(drop).expect_err("a fault").to_string();
    assert!(error.contains("its checksum does not match, also when"), "{error}");
}

#[test]
fn other_formats_are_fetched_as_a_whole() {
    let _cache = keep();
    let folder = Folder::new();
    formats::ply::write(&Mesh::sphere(4), folder.path("a.ply")).unwrap();
    let server = Server::of(std::fs::read(folder.path("a.ply")).unwrap());
    let mesh =
        formats::load_mesh(folder.path("a.ply"), &limits(), &ReadOptions::default()).unwrap();
    let load = |name: &str, limits: &Limits| {
        formats::load_mesh(server.address(name), limits, &ReadOptions::default())
    };
    assert_eq!(load("a.ply", &limits()).unwrap().positions, mesh.positions);
    let few = Limits { bytes: 1000, ..limits() };
    assert!(matches!(load("a.ply", &few), Err(Error::Limit { .. })));
    server.fail(|_, _| Fault::Whole);
    assert!(load("b.ply", &limits()).unwrap_err().to_string().contains("200 instead of 206"));
}

/// Prints the figures of docs/remote.md. SPLATKIT_SPLK names the file, else one is made.
#[test]
#[ignore = "figures, not a check"]
fn first_picture() {
    let bytes = match std::env::var_os("SPLATKIT_SPLK") {
        Some(path) => std::fs::read(path).unwrap(),
        None => knot(400_000),
    };
    println!("file: {} bytes", bytes.len());
    let begun = Instant::now();
    let local = picture_of(Hierarchy::from_bytes(bytes.clone(), "a", &limits())).unwrap();
    println!("local: {:.2} s", begun.elapsed().as_secs_f64());
    for (line, milliseconds, rate) in
        [("loopback", 0, None), ("50 ms", 50, None), ("50 ms, 10 MB/s", 50, Some(1e7))]
    {
        let folder = Folder::new();
        let server = Server::of(bytes.clone());
        server.slow(Duration::from_millis(milliseconds), rate);
        for state in ["first", "again"] {
            set_cache(Cache { folder: folder.path("cache"), bytes: 1 << 30 });
            let (before, begun) = (traffic(), Instant::now());
            let opened = Hierarchy::open(server.address("a.splk"), &limits()).unwrap();
            let open = begun.elapsed().as_secs_f64();
            let remote = picture_of(Ok(opened)).unwrap();
            let (now, seconds) = (traffic(), begun.elapsed().as_secs_f64());
            assert!(remote == local);
            println!(
                "{line}, {state}: open {open:.2} s, picture {seconds:.2} s, {} requests, {} bytes",
                now.requests - before.requests,
                now.bytes - before.bytes
            );
        }
    }
}
