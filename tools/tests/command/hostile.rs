//! Inputs of a few kilobytes that ask for minutes of work, limits that hold after reading, two
//! commands that write one file, and systems that start no threads.

use crate::common::*;
use std::{
    os::unix::fs::{MetadataExt, PermissionsExt, symlink},
    process::{Command, Output, Stdio},
    time::{Duration, Instant},
};

/// Longest time for small inputs, on a slow machine that does other work too.
const SOON: Duration = Duration::from_secs(20);

/// Writes a sheet of `side`² squares with a texture, as OBJ. Vertex 7 has these texture
/// coordinates.
fn textured(folder: &Folder, name: &str, side: usize, coordinates: &str) {
    let picture = splatkit::picture::Picture {
        width: 8,
        height: 8,
        color: vec![[0.5, 0.2, 0.1, 1.0]; 64],
        depth: vec![],
    };
    folder.put(
        "t.png",
        picture
            .encode(&splatkit::picture::Encoding::new(splatkit::picture::PictureFormat::Png))
            .unwrap(),
    );
    folder.put("m.mtl", "newmtl a\nmap_Kd t.png\n");
    let mut out = "mtllib m.mtl\nusemtl a\n".to_owned();
    let at = |vertex: usize| {
        [(vertex % (side + 1)) as f64, (vertex / (side + 1)) as f64].map(|v| v / side as f64)
    };
    for vertex in 0..(side + 1).pow(2) {
        let [x, y] = at(vertex);
        out += &format!("v {x} {y} {}\n", 0.05 * (x + y).sin());
    }
    for vertex in 0..(side + 1).pow(2) {
        let [x, y] = at(vertex);
        out += &if vertex == 7 { format!("vt {coordinates}\n") } else { format!("vt {x} {y}\n") };
    }
    for square in 0..side * side {
        let a = square / side * (side + 1) + square % side + 1;
        let [b, c, d] = [a + 1, a + side + 1, a + side + 2];
        out += &format!("f {a}/{a} {b}/{b} {d}/{d}\nf {a}/{a} {d}/{d} {c}/{c}\n");
    }
    folder.put(name, out);
}

/// Returns a sheet as binary PLY, with vertex 5 moved along x.
fn with_far_vertex(x: f32) -> Vec<u8> {
    let mut out = sheet(40);
    let start = out.windows(11).position(|bytes| bytes == b"end_header\n").unwrap() + 11;
    let header = String::from_utf8(out[..start].to_vec()).unwrap();
    let row = 4 * header.lines().filter(|line| line.starts_with("property float")).count()
        + header.lines().filter(|line| line.starts_with("property uchar")).count();
    out[start + 5 * row..][..4].copy_from_slice(&x.to_le_bytes());
    out
}

#[test]
fn texture_coordinates_do_not_keep_it_busy() {
    let folder = Folder::new();
    for [coordinates, printed] in
        [["inf 0.5", "[inf"], ["nan 0.5", "[NaN"], ["0.5 -1e39", "inf]"], ["1e400 0", "[inf"]]
    {
        textured(&folder, "a.obj", 12, coordinates);
        // The first line of coordinates comes after 2 others and 169 vertices.
        let words = ["a.obj", "line 179", "texture coordinates", "are not finite", "are expected"];
        for command in [
            "check a.obj",
            "convert a.obj -o a.splk --dry-run",
            "render a.obj -o a.png --reference",
        ] {
            let begin = Instant::now();
            let run = folder.run(command);
            assert!(run.stderr().contains(printed), "{coordinates}: {}", run.stderr());
            run.fails(3, &words);
            assert!(begin.elapsed() < SOON, "{command}, {coordinates}: {:?}", begin.elapsed());
        }
    }
    for coordinates in ["1.8e19 0.5", "1e30 1e30", "3e38 -3e38", "1e6 0.5", "1e3 0.5"] {
        textured(&folder, "a.obj", 12, coordinates);
        let begin = Instant::now();
        folder.run("check a.obj").ok();
        folder.run("convert a.obj -o a.splk --overwrite").ok();
        assert!(begin.elapsed() < SOON, "{coordinates}: {:?}", begin.elapsed());
    }
    // Without a texture, the coordinates are not used.
    textured(&folder, "a.obj", 12, "nan nan");
    std::fs::remove_file(folder.path("m.mtl")).unwrap();
    folder.run("check a.obj").ok();
}

#[test]
fn a_far_vertex_is_named_at_once() {
    let folder = Folder::new();
    for x in [1e13, 1e15, 1e17] {
        folder.put("a.ply", with_far_vertex(x));
        let begin = Instant::now();
        let words = ["a.ply", &format!("vertex 5 at ({x:e}, "), "remove it"];
        folder.run("convert a.ply -o a.splk").fails(3, &words);
        folder.run("convert a.ply -o a.splk --dry-run").fails(3, &words);
        folder.run("render a.ply -o a.png --reference --size 32x32").fails(3, &words);
        let run = folder.run("check a.ply");
        assert!(run.code() == Some(3) && run.stdout().contains(words[1]), "{}", run.stdout());
        assert!(begin.elapsed() < SOON, "{x}: {:?}", begin.elapsed());
    }
    folder.put("a.ply", with_far_vertex(1e3));
    folder.run("check a.ply").ok();
}

/// Subdividing into millions of triangles, and a cloud of 400,000 points, take longer than a second
/// after reading.
#[test]
fn seconds_are_limited_after_reading() {
    let folder = Folder::new();
    textured(&folder, "fine.obj", 300, "0.5 0.5");
    let fine = std::fs::read_to_string(folder.path("fine.obj")).unwrap().replace("\nvt ", "\nvt 9");
    folder.put("fine.obj", fine);
    let points: String = (0..400_000u32)
        .map(|i| format!("{} {} {}\n", i % 1009, i.wrapping_mul(2_654_435_761) >> 20, i % 757))
        .collect();
    folder.put("cloud.xyz", points);
    for command in [
        "convert cloud.xyz -o a.splk --limit-seconds 0",
        "check fine.obj --limit-seconds 1",
        "convert fine.obj -o a.splk --dry-run --limit-seconds 1",
        "convert fine.obj -o b.splk --limit-seconds 1",
        "render fine.obj -o a.png --reference --size 16x16 --limit-seconds 1",
        "check cloud.xyz --limit-seconds 1",
        "convert cloud.xyz -o c.splk --limit-seconds 1",
    ] {
        let begin = Instant::now();
        let run = folder.run(command);
        // A fast machine may finish before the limit.
        if run.code() == Some(0) {
            continue;
        }
        let file = if command.contains("cloud") { "cloud.xyz" } else { "fine.obj" };
        run.fails(3, &[file, "limit of", "--limit-seconds"]);
        assert!(begin.elapsed() < Duration::from_secs(6), "{command}: {:?}", begin.elapsed());
    }
}

/// Commands that write the same file at once all succeed, and the file is the whole result of one
/// of them.
#[test]
fn two_commands_write_one_file() {
    let folder = Folder::new();
    folder.put("a.ply", sheet(60));
    folder.put("b.ply", sheet(90));
    let whole = ["a", "b"].map(|name| {
        folder.run(&format!("convert {name}.ply -o {name}.splk")).ok();
        std::fs::read(folder.path(format!("{name}.splk"))).unwrap()
    });
    let start = |name: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_splatkit"));
        command
            .args(["convert", &format!("{name}.ply"), "--overwrite", "-o", "out.splk"])
            .current_dir(&folder);
        command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
    };
    for round in 0..12 {
        // One is killed, so that the next ones find its leftover.
        let mut killed = start("b");
        std::thread::sleep(Duration::from_millis(3 * round));
        killed.kill().unwrap();
        killed.wait().unwrap();
        let running = ["a", "b", "a"].map(start);
        for child in running {
            let output = child.wait_with_output().unwrap();
            let stderr = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "round {round}: {:?} {stderr}", output.status);
        }
        let written = std::fs::read(folder.path("out.splk")).unwrap();
        // The file contains its source's name, so the results of a and b differ.
        assert!(whole.contains(&written), "round {round}: neither of them");
    }
    let mut left = folder.names();
    left.retain(|name| name.ends_with("part"));
    assert_eq!(left, [""; 0]);
}

#[test]
fn links_and_permissions_stay() {
    let folder = Folder::new();
    folder.put("a.ply", PLY);
    std::fs::create_dir(folder.path("other")).unwrap();
    folder.put("other/real.splk", "old");
    std::fs::set_permissions(
        folder.path("other/real.splk"),
        std::fs::Permissions::from_mode(0o600),
    )
    .unwrap();
    symlink("other/real.splk", folder.path("link.splk")).unwrap();
    folder.run("convert a.ply -o link.splk").fails(1, &["link.splk", "exists already"]);
    folder.run("convert a.ply -o link.splk --overwrite").ok();
    assert!(folder.path("link.splk").is_symlink());
    let real = folder.path("other/real.splk").metadata().unwrap();
    assert!(real.len() > 100 && real.mode() & 0o777 == 0o600);
    symlink("other/none.splk", folder.path("nowhere.splk")).unwrap();
    let words = ["nowhere.splk", "symbolic link to a file that does not exist"];
    folder.run("convert a.ply -o nowhere.splk --overwrite").fails(1, &words);
    assert!(folder.path("nowhere.splk").is_symlink() && !folder.path("other/none.splk").exists());
}

/// Runs a command in a shell, with `before` in front of it.
fn run_by(folder: &Folder, before: &str, arguments: &str) -> Output {
    let script = format!("{before} '{}' {arguments}", env!("CARGO_BIN_EXE_splatkit"));
    Command::new("sh")
        .args(["-c", &script])
        .current_dir(folder)
        .env("NO_COLOR", "1")
        .output()
        .unwrap()
}

#[test]
fn without_threads_one_does_the_work() {
    let folder = Folder::new();
    folder.put("a.ply", sheet(60));
    folder.run("convert a.ply -o a.splk").ok();
    let whole = std::fs::read(folder.path("a.splk")).unwrap();
    // Stacks that no address space holds, so that no thread can start; many threads for few
    // processors; another user, who may have only one process.
    let mut cases =
        vec!["RUST_MIN_STACK=70368744177664", "RAYON_NUM_THREADS=100000", "RAYON_NUM_THREADS=0"];
    let limited = "setpriv --reuid 65534 --regid 65534 --clear-groups prlimit --nproc=1";
    if run_by(&folder, "setpriv --reuid 65534 --regid 65534 --clear-groups", "--version")
        .status
        .success()
    {
        std::fs::set_permissions(&folder, std::fs::Permissions::from_mode(0o777)).unwrap();
        cases.push(limited);
    }
    for case in cases {
        let begin = Instant::now();
        let output = run_by(&folder, case, "convert a.ply -o b.splk --overwrite");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{case}: {:?} {stderr}", output.status);
        assert!(!stderr.contains("panicked"), "{case}: {stderr}");
        let word = match case {
            "RAYON_NUM_THREADS=100000" => "RAYON_NUM_THREADS=100000 is more than",
            "RAYON_NUM_THREADS=0" => "",
            _ => "one thread does all the work",
        };
        assert!(stderr.contains(word), "{case}: {stderr}");
        assert!(begin.elapsed() < SOON, "{case}: {:?}", begin.elapsed());
        assert!(std::fs::read(folder.path("b.splk")).unwrap() == whole, "{case}: another file");
        std::fs::remove_file(folder.path("b.splk")).unwrap();
    }
}
