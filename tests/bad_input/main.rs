//! Bad files of every format. Each is refused with a message that says what is wrong and where.
//! None causes a panic, hangs or exceeds its memory limit.

#[path = "../inputs/mod.rs"]
mod inputs;
#[cfg(any(target_os = "linux", target_os = "macos"))]
mod overwritten;
#[path = "../testing/mod.rs"]
mod testing;

use inputs::*;
use splatkit::{
    Error, bricks,
    hierarchy::{Hierarchy, file},
    input::Limits,
};
use std::{
    path::Path,
    sync::{
        Once,
        atomic::{AtomicUsize, Ordering},
    },
    time::Instant,
};
use testing::folder::Folder;

/// Time limit for reading a bad input, in seconds.
const MOST_SECONDS: f64 = 2.0;

/// Number of panics that were printed, without those of the tests themselves. The library hides the
/// panics of decoders that it isolates, so none should be printed.
static PANICS: AtomicUsize = AtomicUsize::new(0);

/// Counts panics from now on. The library's own hook must come later, so tests call this first.
fn count_panics() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            // A failed test is reported anyway.
            let of_tests = info.location().is_some_and(|place| place.file().starts_with("tests"));
            PANICS.fetch_add(usize::from(!of_tests), Ordering::Relaxed);
            before(info);
        }));
    });
}

/// Asserts that the error has a message, and names a file of the folder and a place in it.
fn refused(path: &Path, error: &Error, context: &str) {
    match error {
        Error::Input { file, place, message, .. } => {
            assert!(file.starts_with(path.parent().expect("a folder")), "{context}: {file:?}");
            assert!(!place.is_empty() && !message.is_empty(), "{context}");
        }
        Error::Limit { what, .. } => assert!(!what.is_empty(), "{context}"),
        other => panic!("{context}: {other}"),
    }
}

#[test]
fn every_cut_of_every_format_is_told() {
    count_panics();
    let folder = Folder::new();
    let limits = Limits::default();
    for (name, bytes, may_load) in every_format(&folder) {
        let whole = folder.write(name, &bytes);
        let summary = load(&whole, &limits).unwrap_or_else(|error| panic!("{name}: {error}"));
        for at in 0..bytes.len() {
            let path = folder.write(name, &bytes[..at]);
            let context = format!("{name} ({summary}) cut at {at} of {}", bytes.len());
            match load(&path, &limits) {
                Err(error) => refused(&path, &error, &context),
                Ok(less) => assert!(may_load(&bytes, at), "{context}: loads as {less}"),
            }
        }
        folder.write(name, &bytes);
    }
    // Files that a model refers to may be cut as well. Buffers, samples and pictures must be whole.
    // A cut material file yields fewer materials.
    for (name, referring, may_load) in [
        ("beside.bin", "beside.gltf", false),
        ("beside.raw", "detached.nhdr", false),
        ("a.png", "a.obj", false),
        ("a.mtl", "a.obj", true),
    ] {
        let bytes = std::fs::read(folder.path(name)).expect("a file");
        for at in 0..bytes.len() {
            folder.write(name, &bytes[..at]);
            let context = format!("{referring} with {name} cut at {at} of {}", bytes.len());
            match load(&folder.path(referring), &limits) {
                Err(error) => refused(&folder.path(referring), &error, &context),
                // The last bytes of a PNG hold nothing that decoding needs.
                Ok(summary) => {
                    assert!(
                        may_load || name == "a.png" && at + 16 >= bytes.len(),
                        "{context}: loads as {summary}"
                    );
                }
            }
        }
        folder.write(name, &bytes);
    }
    assert_eq!(PANICS.load(Ordering::Relaxed), 0);
}

#[test]
fn every_flipped_byte_of_a_hierarchy_and_of_bricks_is_found() {
    count_panics();
    let folder = Folder::new();
    let limits = Limits::default();
    let bricks = splv(&folder);
    for (name, bytes) in
        [("lossless.splk", splk(true)), ("lossy.splk", splk(false)), ("a.splv", bricks)]
    {
        let check = |path: &Path| {
            if name.ends_with("splk") {
                file::check(path, &limits)
            } else {
                bricks::check(path, &limits, None)
            }
        };
        let path = folder.write(name, &bytes);
        assert_eq!(check(&path).findings, [], "{name}");
        for at in 0..bytes.len() {
            let mut flipped = bytes.clone();
            // Flip all bits, or a single bit at a varying position.
            flipped[at] ^= if at % 2 == 0 { 0xff } else { 1 << (at / 2 % 8) };
            let path = folder.write(name, &flipped);
            assert!(
                !check(&path).is_sound(),
                "{name}: byte {at} of {} is flipped, but check finds nothing",
                bytes.len()
            );
            // Reading finds the flip too, unless it does not use that byte.
            if let Err(error) = load(&path, &limits) {
                refused(&path, &error, name);
            }
        }
    }
    assert_eq!(PANICS.load(Ordering::Relaxed), 0);
}

/// Bad or unusual files: the name, the bytes, and the expected outcome of reading the file.
fn cases() -> Vec<(&'static str, Vec<u8>, &'static str)> {
    include!("../inputs/cases.rs")
}

#[test]
fn each_bad_input_has_its_message() {
    count_panics();
    let folder = Folder::new();
    every_format(&folder);
    folder.write("self.obj", "mtllib self.obj\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    folder.write("chain.mtl", "mtllib chain.mtl\nnewmtl m\nmap_Kd ../a.png\n");
    folder.write("beside.splv", "");
    std::fs::create_dir_all(folder.path("folder")).expect("a folder");
    let limits = Limits::default();
    let mut wrong = Vec::new();
    let mut slowest = (0.0, "");
    for (name, bytes, expected) in cases() {
        folder.write(name, &bytes);
        let mut outcome = String::new();
        let mut seconds = f64::INFINITY;
        // On a busy machine one attempt may be slow, but not all three.
        for _ in 0..3 {
            let begun = Instant::now();
            outcome = folder.outcome(name, &limits);
            seconds = begun.elapsed().as_secs_f64().min(seconds);
            if seconds < MOST_SECONDS {
                break;
            }
        }
        if seconds > slowest.0 {
            slowest = (seconds, name);
        }
        if outcome != expected {
            wrong.push(format!("{name}\n  expected: {expected}\n  found:    {outcome}"));
        }
        std::fs::remove_file(folder.path(name)).ok();
    }
    println!("slowest: {} in {:.3} s, of {} cases", slowest.1, slowest.0, cases().len());
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(slowest.0 < MOST_SECONDS, "{} takes {} s", slowest.1, slowest.0);
    assert_eq!(PANICS.load(Ordering::Relaxed), 0);
}

/// Measures the time and memory of reading an input in a process of its own. The process runs this
/// same test; an environment variable names the input.
#[test]
fn worst_inputs_stay_within_their_limits() {
    const NAME: &str = "SPLATKIT_WORST_INPUT";
    if let Some(path) = std::env::var_os(NAME) {
        let bytes = std::env::var("SPLATKIT_WORST_LIMIT")
            .ok()
            .and_then(|text| text.parse().ok())
            .expect("a limit");
        let limits = Limits { bytes, ..Limits::default() };
        let before = peak();
        let begun = Instant::now();
        let outcome = load(Path::new(&path), &limits).unwrap_or_else(|error| error.to_string());
        println!(
            "measured {} {} {outcome}",
            begun.elapsed().as_millis(),
            peak().saturating_sub(before)
        );
        return;
    }
    if peak() == 0 {
        return;
    }
    let folder = Folder::new();
    let mut worst = (0, 0);
    for (name, bytes) in worst_inputs() {
        let path = folder.write(name, &bytes);
        for limit in [24u64 << 20, 256 << 20] {
            let run = std::process::Command::new(std::env::current_exe().expect("this test"))
                .args(["--exact", "worst_inputs_stay_within_their_limits", "--nocapture"])
                .env(NAME, &path)
                .env("SPLATKIT_WORST_LIMIT", limit.to_string())
                .output()
                .expect("a run");
            let text = String::from_utf8_lossy(&run.stdout).into_owned();
            let line = text
                .lines()
                .find_map(|line| line.split_once("measured "))
                .map(|(_, rest)| rest.to_owned());
            let line = line.unwrap_or_else(|| {
                panic!("{name}: {text}{}", String::from_utf8_lossy(&run.stderr))
            });
            let mut words = line.splitn(3, ' ');
            let mut number =
                || words.next().and_then(|word| word.parse::<u64>().ok()).expect("a number");
            let (milliseconds, taken) = (number(), number());
            let outcome = folder.without_path(words.next().unwrap_or_default());
            let (size, taken_mib) = (bytes.len() as f64 / 1048576.0, taken as f64 / 1048576.0);
            println!(
                "{name}: {size:.2} MiB, limit {} MiB: {milliseconds} ms, {taken_mib:.1} MiB: \
                 {outcome}",
                limit >> 20
            );
            assert!(
                taken <= limit + PROGRAM,
                "{name}: takes {taken} bytes; the limit is {limit}: {outcome}"
            );
            worst = (worst.0.max(milliseconds), worst.1.max(taken));
        }
    }
    println!("longest {} ms, most {:.1} MiB", worst.0, worst.1 as f64 / 1048576.0);
}

/// Sparse files, which take no disk space. This test is for Unix only: other systems fill the gap
/// when a file is written beyond its end.
#[cfg(unix)]
#[test]
fn places_beyond_what_32_bits_count_are_found() {
    use splatkit::formats::{RawLayout, ReadOptions, load_volume};
    use std::io::{Seek, SeekFrom, Write};
    let folder = Folder::new();
    let header = (4u64 << 30) + 36;
    let samples: Vec<u8> = (0..64).collect();
    for (name, end) in [("far.raw", 64), ("far_cut.raw", 63)] {
        let mut file = std::fs::File::create(folder.path(name)).expect("a file");
        file.seek(SeekFrom::Start(header))
            .and_then(|_| file.write_all(&samples[..end]))
            .expect("room");
    }
    let layout = RawLayout { header, ..RAW };
    let read = |name: &str, limits: &Limits| match load_volume(
        folder.path(name),
        limits,
        &ReadOptions::raw(Some(&layout)),
    ) {
        Ok(volume) => format!("{:?} {}", volume.range, volume.value(63)),
        Err(error) => folder.without_path(&error.to_string()),
    };
    assert_eq!(read("far.raw", &Limits::default()), "[0.0, 63.0] 63");
    assert_eq!(
        read("far_cut.raw", &Limits::default()),
        "far_cut.raw: size: has 63 bytes after the header, but 4 × 4 × 4 samples of type u8 need 64"
    );
    let little = Limits { bytes: 1 << 30, ..Limits::default() };
    assert_eq!(
        read("far.raw", &little),
        "far.raw: the file's size in bytes is 4294967396, over the limit of 1073741824"
    );
    // A header that refers to data beyond 4 GiB.
    let text = String::from_utf8(nrrd("4 4 4", "encoding: raw", b"")).expect("text");
    let skip = format!("byte skip: {header}\ndata file: far.raw");
    folder.write("far.nhdr", text.replacen("encoding: raw", &format!("encoding: raw\n{skip}"), 1));
    assert_eq!(folder.outcome("far.nhdr", &Limits::default()), "volume [4, 4, 4] [0.0, 63.0]");
}

/// Memory that the program itself takes while it runs, in bytes, including its threads. The code of
/// the profile `checks` is about 1 MiB larger than that of `release`, and each reader adds some.
const PROGRAM: u64 = 10 << 20;

/// Peak resident memory of this process, in bytes; 0 if the system does not report it.
fn peak() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap_or_default();
    line.trim().trim_end_matches(" kB").parse::<u64>().unwrap_or_default() * 1024
}

/// A VTI file whose pieces all refer to the same bytes. Each piece spans the whole extent.
fn shared_pieces(count: usize, bytes: usize) -> Vec<u8> {
    let extent = format!("0 {} 0 0 0 0", bytes - 1);
    let piece = format!(
        "<Piece Extent='{extent}'><PointData><DataArray type='UInt8' Name='v' format='appended' \
         offset='0'/></PointData></Piece>"
    );
    let head = format!(
        "<VTKFile type='ImageData' byte_order='LittleEndian'><ImageData WholeExtent='{extent}'>\
         {}</ImageData><AppendedData encoding='raw'>_",
        piece.repeat(count)
    );
    let mut file = head.into_bytes();
    file.extend((bytes as u32).to_le_bytes());
    file.resize(file.len() + bytes, 7);
    file.extend(b"</AppendedData></VTKFile>");
    file
}

/// A hierarchy file of few bytes and many nodes stays within the limit, however it is read.
#[test]
fn equal_pages_are_read_within_limits() {
    let limits = Limits { bytes: 64 << 20, ..Limits::default() };
    let bytes = crafted::pages_of_one_node(56);
    let hierarchy =
        Hierarchy::from_bytes(bytes, Path::new("equal.splk"), &limits).expect("a directory");
    let errors = [
        hierarchy.read_tree().map(|_| ()).expect_err("too much").to_string(),
        hierarchy.leaves().map(|_| ()).expect_err("too much").to_string(),
    ];
    let is_refused = |error: &String| error.contains("over the limit of 67108864");
    assert!(errors.iter().all(is_refused), "{errors:?}");
    assert_eq!(hierarchy.read_page(0).expect("a page").nodes.len(), 4089);
}

/// A file name and its bytes.
type Input = (&'static str, Vec<u8>);

const MIB: usize = 1 << 20;

/// Small files that expand to many times their size.
fn worst_inputs() -> Vec<Input> {
    let mut inputs = worst_tables_and_meshes();
    inputs.extend(worst_trees());
    inputs.extend(worst_volumes());
    inputs.extend([
        ("bomb.png", png(8000, 8000)),
        ("large.png", png(2000, 2000)),
        ("bomb.splk", crafted::page_of_zeros(1 << 30)),
        ("equal.splk", crafted::pages_of_one_node(56)),
        ("bomb.splv", crafted::brick_of_zeros(1 << 30)),
        ("equal.splv", crafted::bricks_of_one_value([448, 448, 64])),
    ]);
    inputs
}

fn worst_tables_and_meshes() -> Vec<Input> {
    let wide = format!("{}\n{}", vec!["1"; 4096].join(" "), "1\n".repeat(MIB));
    let polygon = format!("{}\n", vec!["0"; 2 * MIB].join(" "));
    let list = ply(
        &format!(
            "element vertex 1\n{FLOATS}element face 1\nproperty list uint int vertex_indices\n"
        ),
        &format!("0 0 0\n{} {polygon}", 2 * MIB),
    );
    vec![
        ("lines.xyz", "1 2 3\n".repeat(MIB).into()),
        ("short.csv", "1\n".repeat(2 * MIB).into()),
        ("wide.txt", wide.into()),
        ("faces.obj", format!("v 0 0 0\n{}", "f 1 1 1\n".repeat(MIB / 2)).into()),
        ("corners.obj", format!("v 0 0 0\nf {polygon}").replace(" 0", " 1").into()),
        ("numbers.obj", format!("v {polygon}").replace(" 0", " 1").into()),
        ("vertices.obj", "v 0 0 0\n".repeat(MIB).into()),
        ("polygon.ply", list),
        ("lines.ply", ply(&format!("element vertex {MIB}\n{FLOATS}"), &"0 0 0\n".repeat(MIB))),
        (
            "corners.stl",
            format!(
                "solid\n{}",
                "facet\nouter loop\nvertex 0 0 0\nvertex 0 0 0\nvertex 0 0 0\nendloop\nendfacet\n"
                    .repeat(MIB / 24)
            )
            .into(),
        ),
        (
            "numbers.pcd",
            pcd(&MIB.to_string(), format!("DATA ascii\n{}", "1 2 3\n".repeat(MIB)).as_bytes()),
        ),
    ]
}

/// JSON, of glTF and others.
fn worst_trees() -> Vec<Input> {
    let nodes = vec![r#"{"mesh":0}"#; 100_000].join(",");
    let all: Vec<String> = (0..100_000).map(|node| node.to_string()).collect();
    let instances = gltf_with("none", &nodes)
        .replace(r#"{"nodes":[0]}"#, &format!(r#"{{"nodes":[{}]}}"#, all.join(",")));
    let (data, big) = ("data:;base64,", "A".repeat(MIB));
    let instances = instances
        .replace("none", &format!("{data}{big}"))
        .replace(r#""count":3,"type":"VEC3""#, r#""count":60000,"type":"VEC3""#)
        .replace(r#""byteLength":36"#, r#""byteLength":720000"#);
    vec![
        (
            "objects.gltf",
            format!(r#"{{"asset":{{"version":"2.0"}},"nodes":[{}]}}"#, vec!["{}"; MIB].join(","))
                .into(),
        ),
        (
            "numbers.gltf",
            format!(
                r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"children":[{}]}}]}}"#,
                vec!["9"; 2 * MIB].join(",")
            )
            .into(),
        ),
        ("instances.gltf", instances.into()),
        ("nested.gltf", "[".repeat(4 * MIB).into()),
        ("nested.json", "[".repeat(MIB).into()),
    ]
}

fn worst_volumes() -> Vec<Input> {
    let block = zlib(&vec![0; 200 * MIB]);
    let counts: Vec<u8> =
        [1, 200 * MIB as u32, 0, block.len() as u32].iter().flat_map(|n| n.to_le_bytes()).collect();
    let vti = "<VTKFile type='ImageData' byte_order='LittleEndian' \
         compressor='vtkZLibDataCompressor'><ImageData WholeExtent='0 1023 0 1023 0 199'><Piece \
         Extent='0 1023 0 1023 0 199'><PointData><DataArray type='UInt8' Name='v' \
         format='appended' offset='0'/></PointData></Piece></ImageData><AppendedData \
         encoding='raw'>_";
    let vti = [vti.as_bytes(), &counts, &block, b"</AppendedData></VTKFile>"].concat();
    vec![
        ("bomb.nrrd", nrrd("1024 1024 200", "encoding: gzip", &gzip(&vec![0; 200 * MIB]))),
        (
            "keys.nrrd",
            nrrd("1 1 1", &(0..200_000).map(|i| format!("{i}:=\n")).collect::<String>(), b""),
        ),
        ("bomb.vti", vti),
        ("pieces.vti", vtk_xml("ImageData", "", &"<Piece/>".repeat(MIB / 4)).into()),
        (
            "attributes.vti",
            vtk_xml("ImageData", "", &"<Piece a='' b='' c='' d=''/>".repeat(MIB / 8)).into(),
        ),
        (
            "attribute.vti",
            vtk_xml(
                "ImageData",
                &(0..MIB / 8).map(|i| format!(" a{i}=''")).collect::<String>(),
                "",
            )
            .into(),
        ),
        ("shared.vti", shared_pieces(20_000, MIB)),
        ("deep.vti", vtk_xml("ImageData", "", &"<a>".repeat(MIB)).into()),
    ]
}
