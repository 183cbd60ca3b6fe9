//! Files that another program writes to while they are read. The outcome is a result or an error,
//! never a panic or a signal.
//!
//! Every file ends at the end of a memory page, so reading a character beyond the end of the text
//! accesses unmapped memory.

use crate::{inputs, testing::folder::Folder};
use splatkit::input::Limits;
use std::{
    fs::File,
    os::unix::fs::FileExt,
    sync::atomic::{AtomicBool, Ordering::Relaxed},
    time::{Duration, Instant},
};

/// How long each file is read, over and over.
const TIME: Duration = Duration::from_millis(150);
const PAGE: usize = 1 << 14;

fn lines(count: usize, line: impl Fn(usize) -> String) -> String {
    (0..count).map(line).collect()
}

/// Replaces the mark `@` by copies of `letter`, so that the text ends at the end of a page.
fn padded(text: &str, letter: &str) -> Vec<u8> {
    let missing = (PAGE - (text.len() - 1) % PAGE) % PAGE;
    text.replacen('@', &letter.repeat(missing), 1).into_bytes()
}

fn files() -> Vec<(&'static str, Vec<u8>)> {
    let points = lines(1500, |i| format!("{} {} {}\n", i % 60, i / 60, i % 7));
    let faces = lines(900, |i| format!("f {} {} {}\n", i + 1, i + 2, i + 62));
    let values = lines(4096, |i| format!("{} ", i % 200));
    let header =
        "element vertex 1500\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    let pcd =
        "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1500\nHEIGHT 1\nPOINTS 1500\nDATA ascii\n";
    let facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n\
         endloop\nendfacet\n";
    let vti = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"0.1\" \
         byte_order=\"LittleEndian\">\n<ImageData WholeExtent=\"0 15 0 15 0 15\" Origin=\"0 0 0\" \
         Spacing=\"1 1 1\">\n<Piece Extent=\"0 15 0 15 0 15\"><PointData Scalars=\"v\">\n\
         <DataArray type=\"UInt8\" Name=\"v\" format=\"ascii\">{values}@</DataArray>\n\
         </PointData></Piece></ImageData></VTKFile>\n"
    );
    let vtk = format!(
        "# vtk DataFile Version 3.0\n@\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 16 16 16\n\
         POINT_DATA 4096\nSCALARS s int\nLOOKUP_TABLE d\n{values}"
    );
    let nrrd = format!(
        "NRRD0004\n# @\ntype: uint8\ndimension: 3\nsizes: 16 16 16\nencoding: ascii\n\n{values}"
    );
    vec![
        (
            "a.obj",
            padded(
                &(lines(1500, |i| format!("v {} {} {}\n", i % 60, i / 60, i % 7))
                    + "# @\n"
                    + &faces),
                "x",
            ),
        ),
        ("a.xyz", padded(&format!("# @\n{points}"), "x")),
        (
            "a.csv",
            padded(
                &format!("# @\nx,y,z,value\n{}", lines(1500, |i| format!("{i},{},1,{i}\n", i % 7))),
                "x",
            ),
        ),
        ("a.ply", padded(&format!("ply\nformat ascii 1.0\ncomment @\n{header}{points}"), "x")),
        ("a.pcd", padded(&format!("# @\n{pcd}{points}"), "x")),
        ("a.stl", padded(&format!("solid @\n{}endsolid\n", facet.repeat(200)), "x")),
        ("a.vti", padded(&vti, " ")),
        ("a.vtk", padded(&vtk, "x")),
        ("a.nrrd", padded(&nrrd, "x")),
        ("a.gltf", padded("{\"asset\":{\"version\":\"2.0\",\"generator\":\"@\"}}", "x")),
    ]
}

/// Overwrites bytes of a file with lead bytes of long UTF-8 characters and other bytes, and
/// restores them, again and again.
fn overwrite(file: &File, sound: &[u8], stop: &AtomicBool) {
    let mut state = 1u64;
    while !stop.load(Relaxed) {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let byte = [0xf0, 0xe2, 0xc3, 0x80, b'9', b' ', b'\n', 0][(state >> 32) as usize % 8];
        let anywhere = (state >> 35) as usize % sound.len();
        for at in [sound.len() - 1, sound.len() - 2, anywhere] {
            file.write_all_at(&[byte], at as u64).unwrap();
        }
        for at in [sound.len() - 1, sound.len() - 2, anywhere] {
            file.write_all_at(&sound[at..=at], at as u64).unwrap();
        }
    }
}

/// Stops the writing thread, also if a reader panics. Otherwise the scope would wait for the thread
/// forever.
struct StopAtEnd<'a>(&'a AtomicBool);

impl Drop for StopAtEnd<'_> {
    fn drop(&mut self) {
        self.0.store(true, Relaxed);
    }
}

#[test]
fn files_that_are_written_to_while_they_are_read() {
    crate::count_panics();
    let (folder, limits) = (Folder::new(), Limits::default());
    for (name, bytes) in files() {
        assert!(bytes.len().is_multiple_of(PAGE), "{name}: {}", bytes.len());
        let path = folder.write(name, &bytes);
        let sound = inputs::load(&path, &limits);
        assert!(name == "a.gltf" || sound.is_ok(), "{name}: {sound:?}");
        let file = File::options().write(true).open(&path).unwrap();
        let (stop, begun, mut refused) = (AtomicBool::new(false), Instant::now(), 0);
        std::thread::scope(|scope| {
            let _stop = StopAtEnd(&stop);
            scope.spawn(|| overwrite(&file, &bytes, &stop));
            while begun.elapsed() < TIME {
                refused += usize::from(inputs::load(&path, &limits).is_err());
            }
        });
        assert!(refused > 0, "{name}: no changed file was ever refused");
    }
}
