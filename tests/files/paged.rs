//! Directories in pages: pictures are those of the tree in memory, and damage is reported where it
//! is.

use crate::testing::folder::Folder;
use glam::DVec3;
use splatkit::{
    Device, Error, Renderer,
    hierarchy::{
        BuildOptions, Detail, Hierarchy, Tree,
        file::{self, WriteOptions, to_bytes},
    },
    input::Limits,
    math::Camera,
    scene::{Scene, Settings},
    surface::{Mesh, SurfelOptions},
};
use std::path::Path;

/// Bytes of a record of the root, if there are two levels.
const OF_DIRECTORY: usize = 36;
/// Records in a directory page.
const RECORDS: usize = 512;

/// Where the root begins: after the header and its checksum (docs/splk.md).
fn root(bytes: &[u8]) -> usize {
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
    164 + word(136) as usize + word(140) as usize
}

/// The number of directory pages of each level, the lowest first.
fn levels(pages: usize) -> Vec<usize> {
    let mut levels = vec![pages.div_ceil(RECORDS)];
    while let Some(&below) = levels.last().filter(|below| **below > 1) {
        levels.push(below.div_ceil(RECORDS));
    }
    levels
}

/// A knotted tube in many small blocks, so that the directory has two levels.
fn many_pages(lossless: bool) -> Vec<u8> {
    let splats = Mesh::knot(840, 70).surfels(&SurfelOptions::default()).expect("surfels");
    let options = BuildOptions { block_splats: 64, ..BuildOptions::default() };
    let tree = Tree::build(&splats, &options, None).expect("a tree");
    let bytes = to_bytes(&tree, &WriteOptions { lossless, ..WriteOptions::default() });
    let bytes = bytes.expect("a file");
    assert_eq!(levels(open(bytes.clone()).page_count() as usize).len(), 2);
    bytes
}

fn open(bytes: Vec<u8>) -> Hierarchy {
    Hierarchy::from_bytes(bytes, "a.splk", &Limits::default()).expect("a hierarchy")
}

fn long(bytes: &[u8], at: usize) -> usize {
    u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight bytes")) as usize
}

#[test]
fn pictures_are_those_of_the_tree_in_memory() {
    let file = open(many_pages(true));
    let tree = Hierarchy::from_tree(file.read_tree().expect("reads")).expect("a hierarchy");
    let [mut paged, mut in_memory] = [file, tree].map(|hierarchy| {
        let scene = Scene::new().with_hierarchy(hierarchy);
        (Renderer::new(&Device::Cpu, &scene).expect("a renderer"), scene.bounds())
    });
    let camera = Camera::framing(&paged.1, DVec3::new(1.0, -2.0, 0.7), DVec3::Z, 1.0);
    let away = camera.position - camera.focal_point;
    for (part, detail) in [
        (1.0, Detail::Pixels(2.0)),
        (1.0, Detail::Pixels(0.0)),
        (0.1, Detail::Pixels(0.0)),
        (20.0, Detail::Pixels(4.0)),
        (0.3, Detail::Splats(3000)),
    ] {
        let camera = Camera { position: camera.focal_point + away * part, ..camera };
        let settings = Settings { detail, ..Settings::new([80; 2]) };
        let draw = |renderer: &mut Renderer| renderer.render(&camera, &settings).expect("draws");
        let (actual, wanted) = (draw(&mut paged.0), draw(&mut in_memory.0));
        assert!(actual.0.color == wanted.0.color, "{part}, {detail:?}");
        assert!(actual.0.color.iter().any(|color| color[3] > 0.1), "{part}, {detail:?}");
    }
}

#[test]
fn a_file_with_a_directory_of_two_levels_is_sound() {
    let folder = Folder::new();
    let path = folder.write("a.splk", many_pages(true));
    assert_eq!(file::check(&path, &Limits::default()).findings, []);
}

/// Reads every page. Returns the first error.
fn read_all(bytes: Vec<u8>) -> Result<(), Error> {
    let hierarchy = Hierarchy::from_bytes(bytes, Path::new("a.splk"), &Limits::default())?;
    (0..hierarchy.page_count()).try_for_each(|page| hierarchy.read_page(page).map(|_| ()))
}

/// Corrects the checksum of the root, and the hash.
fn summed(mut bytes: Vec<u8>) -> Vec<u8> {
    let pages = u32::from_le_bytes(bytes[128..132].try_into().expect("four bytes")) as usize;
    let end = root(&bytes) + levels(pages)[0] * OF_DIRECTORY;
    let sum = crc32fast::hash(&bytes[root(&bytes)..end]);
    bytes[end..end + 4].copy_from_slice(&sum.to_le_bytes());
    let hash = bytes.len() - 32;
    let digest = *blake3::hash(&bytes[..hash]).as_bytes();
    bytes[hash..].copy_from_slice(&digest);
    bytes
}

fn message(result: Result<(), Error>) -> String {
    result.expect_err("damage").to_string()
}

#[test]
fn a_damaged_directory_page_is_named() {
    let folder = Folder::new();
    let bytes = many_pages(false);
    let check = |bytes: &[u8]| {
        let path = folder.write("broken.splk", bytes);
        file::check(&path, &Limits::default()).findings
    };
    // A bit of the second directory page: the pages of the first are still read.
    let place = long(&bytes, root(&bytes) + OF_DIRECTORY);
    let mut broken = bytes;
    broken[place + 100] ^= 4;
    let name = format!("directory page 1 of level 0 (byte {place})");
    let hierarchy = open(broken.clone());
    assert!(hierarchy.read_page(3).is_ok());
    let error = hierarchy.read_page(600).expect_err("damage").to_string();
    assert_eq!(error, format!("a.splk: {name}: its checksum does not match"));
    let scene = Scene::new().with_hierarchy(hierarchy);
    let camera = Camera::framing(&scene.bounds(), DVec3::Y, DVec3::Z, 1.0);
    let mut renderer = Renderer::new(&Device::Cpu, &scene).expect("a renderer");
    let settings = Settings { detail: Detail::Pixels(0.0), ..Settings::new([40; 2]) };
    let error = renderer.render(&camera, &settings).expect_err("damage").to_string();
    assert!(error.contains(&name), "{error}");
    let findings = check(&broken);
    assert!(findings.iter().any(|f| f.code == "directory" && f.place == name), "{findings:?}");
}

#[test]
fn records_that_lie_are_found() {
    let folder = Folder::new();
    let bytes = many_pages(false);
    let second = root(&bytes) + OF_DIRECTORY;
    let with = |at: usize, value: &[u8]| {
        let mut broken = bytes.clone();
        broken[at..at + value.len()].copy_from_slice(value);
        summed(broken)
    };
    // The root lists itself, with its own length and with that of a directory page.
    let itself = (root(&bytes) as u64).to_le_bytes();
    let error = message(read_all(with(second, &itself)));
    assert!(error.contains("it is not among the pages"), "{error}");
    // It lists the first directory page twice: the records there are of other pages.
    let first = bytes[second - OF_DIRECTORY..second].to_vec();
    assert!(message(read_all(with(second, &first))).contains("directory page 1 of level 0"));
    let error = message(read_all(with(second + 8, &7u32.to_le_bytes())));
    assert!(error.contains("it has 7 bytes, not those of its records"), "{error}");
    let error = message(read_all(with(second, &u64::MAX.to_le_bytes())));
    assert!(
        error.contains("directory page 1 of level 0")
            && error.contains("it is not among the pages")
    );
    // Bounds that are too small would hide pages.
    let small = with(second + 28, &1e-9f32.to_le_bytes());
    assert!(read_all(small.clone()).is_ok());
    let findings = file::check(folder.write("small.splk", small), &Limits::default()).findings;
    assert!(findings.iter().any(|f| f.code == "directory"), "{findings:?}");
    let error = message(read_all(with(second + 28, &f32::NAN.to_le_bytes())));
    assert!(error.contains("its bounds are not valid"), "{error}");
}
