//! Runs every step from a file to a hierarchy while large allocations fail. Each failure is an
//! error that names the file, and none ends the process.
//!
//! The allocator of this test refuses single allocations above a bound. In the second test it
//! refuses allocations whose sum would exceed a bound.

mod testing;

use splatkit::{
    Error, Result,
    formats::{ReadOptions, load_mesh},
    hierarchy::{BuildOptions, Hierarchy, Preset, Tree, build_file, file::WriteOptions},
    input::Limits,
    surface::SurfelOptions,
};
use std::{
    alloc::{GlobalAlloc, Layout, System},
    path::Path,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering::Relaxed},
    },
};
use testing::folder::Folder;

/// The most bytes of one allocation, the most bytes of all together, and the bytes allocated now.
static LARGEST: AtomicUsize = AtomicUsize::new(usize::MAX);
static MOST: AtomicUsize = AtomicUsize::new(usize::MAX);
static HELD: AtomicUsize = AtomicUsize::new(0);

/// One test at a time sets the bounds.
static BOUNDS: Mutex<()> = Mutex::new(());

struct Bounded;

/// Allocations up to this size are never refused. They are lists of single tasks, whose memory the
/// library reserves together.
const SMALL: usize = 1 << 20;

fn refuses(more: usize) -> bool {
    more > SMALL
        && (more > LARGEST.load(Relaxed)
            || HELD.load(Relaxed).saturating_add(more) > MOST.load(Relaxed))
}

#[global_allocator]
static ALLOCATOR: Bounded = Bounded;

#[expect(
    unsafe_code,
    reason = "this test needs an allocator that fails; it forwards to the system's"
)]
// SAFETY: all memory comes from the system's allocator, and an allocator may return null.
unsafe impl GlobalAlloc for Bounded {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if refuses(layout.size()) {
            return std::ptr::null_mut();
        }
        HELD.fetch_add(layout.size(), Relaxed);
        // SAFETY: the caller keeps the promises that the system's allocator asks for.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        if refuses(layout.size()) {
            return std::ptr::null_mut();
        }
        HELD.fetch_add(layout.size(), Relaxed);
        // SAFETY: as above.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        HELD.fetch_sub(layout.size(), Relaxed);
        // SAFETY: as above.
        unsafe { System.dealloc(memory, layout) }
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // Both blocks are held while the content moves.
        if size > layout.size() && refuses(size) {
            return std::ptr::null_mut();
        }
        HELD.fetch_add(size, Relaxed);
        HELD.fetch_sub(layout.size(), Relaxed);
        // SAFETY: as above.
        unsafe { System.realloc(memory, layout, size) }
    }
}

/// A binary PLY file of a wavy sheet of `side`² vertices, with triangles or without.
fn ply(side: u32, has_triangles: bool) -> Vec<u8> {
    let triangles = if has_triangles { 2 * (side - 1) * (side - 1) } else { 0 };
    let mut out = format!("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", side * side);
    ["x", "y", "z"].iter().for_each(|axis| out += &format!("property float {axis}\n"));
    if has_triangles {
        out += &format!("element face {triangles}\nproperty list uchar int vertex_indices\n");
    }
    let mut out = (out + "end_header\n").into_bytes();
    for vertex in 0..side * side {
        let (x, y) = ((vertex % side) as f32, (vertex / side) as f32);
        [x, y, (x * 0.3).sin() + (y * 0.2).cos()]
            .iter()
            .for_each(|value| out.extend(value.to_le_bytes()));
    }
    for corner in (0..(side - 1) * (side - 1) * u32::from(has_triangles))
        .map(|at| at % (side - 1) + at / (side - 1) * side)
    {
        for triangle in
            [[corner, corner + 1, corner + side], [corner + 1, corner + side + 1, corner + side]]
        {
            out.push(3);
            triangle.iter().for_each(|vertex| out.extend(vertex.to_le_bytes()));
        }
    }
    out
}

/// A sheet of `side`² vertices in quads, as OBJ text.
fn obj(side: u32) -> Vec<u8> {
    let mut out = String::new();
    for vertex in 0..side * side {
        out += &format!("v {} {} {}\n", vertex % side, vertex / side, vertex % 7);
    }
    for corner in
        (0..(side - 1) * (side - 1)).map(|at| at % (side - 1) + at / (side - 1) * side + 1)
    {
        out += &format!("f {} {} {} {}\n", corner, corner + 1, corner + side + 1, corner + side);
    }
    out.into_bytes()
}

/// Converts a file to a hierarchy, reads the hierarchy back and returns its number of splats.
fn convert(input: &Path, output: &Path) -> Result<usize> {
    let mesh = load_mesh(input, &Limits::default(), &ReadOptions::default())?;
    mesh.is_solid();
    let set = mesh.surfels(&SurfelOptions::default()).map_err(|error| error.in_file(input))?;
    drop(mesh);
    let build =
        BuildOptions { preset: Preset::Fastest, block_splats: 1 << 10, ..BuildOptions::default() };
    let write = WriteOptions::default();
    build_file(&set, output, &build, &write, None).map_err(|error| error.in_file(input))?;
    let tree = Tree::build(&set, &build, None).map_err(|error| error.in_file(input))?;
    drop((set, tree));
    Ok(Hierarchy::open(output, &Limits::default())?.leaves()?.splats.len())
}

/// Converts under ever larger bounds until a conversion succeeds. Returns how many bounds were too
/// small.
fn walk(name: &str, content: Vec<u8>, mut bound: impl FnMut(usize), first: usize) -> usize {
    let _held = BOUNDS.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = Folder::new();
    let (input, output) = (folder.path(format!("in.{name}")), folder.path("out.splk"));
    std::fs::write(&input, content).unwrap();
    let whole = convert(&input, &output).unwrap();
    let mut refused = 0;
    let mut bytes = first;
    loop {
        std::fs::remove_file(&output).ok();
        bound(bytes);
        let result = convert(&input, &output);
        bound(usize::MAX);
        match result {
            Ok(splats) => {
                assert_eq!(splats, whole, "{name}: {bytes} bytes");
                return refused;
            }
            Err(Error::Memory { what, bytes: asked }) => {
                assert!(what.contains(&format!("in.{name}: ")), "{name}: {what}");
                assert!(asked > SMALL as u64, "{name}: {what}: {asked} bytes");
                println!("{name}: {} KiB: {what} needs {} KiB", bytes >> 10, asked >> 10);
                refused += 1;
            }
            Err(error) => panic!("{name}: {bytes} bytes: {error}"),
        }
        bytes += bytes / 8;
    }
}

/// A sheet, a point cloud, a text file, and few triangles that are subdivided into many.
fn inputs() -> [(&'static str, Vec<u8>); 4] {
    [
        ("sheet.ply", ply(600, true)),
        ("cloud.ply", ply(200, false)),
        ("text.obj", obj(150)),
        ("coarse.ply", ply(6, true)),
    ]
}

#[test]
fn no_single_allocation_that_fails_ends_the_process() {
    for (name, content) in inputs() {
        let refused = walk(name, content, |bytes| LARGEST.store(bytes, Relaxed), SMALL);
        assert!(refused > 3, "{name}: {refused}");
    }
}

#[test]
fn no_sum_of_allocations_that_fails_ends_the_process() {
    for (name, content) in inputs() {
        let bound = |bytes: usize| {
            MOST.store(
                if bytes == usize::MAX { bytes } else { HELD.load(Relaxed).saturating_add(bytes) },
                Relaxed,
            );
        };
        let refused = walk(name, content, bound, SMALL);
        assert!(refused > 3, "{name}: {refused}");
    }
}
