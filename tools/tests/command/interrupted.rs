//! Commands that are killed, interrupted, or find no disk space or memory, at any time. The output
//! file is then the old one, the new one or none, and what is left beside it is recognisable as a
//! leftover.

use crate::common::*;
use std::{
    path::Path,
    process::{Child, Command, ExitStatus, Stdio},
    time::{Duration, Instant},
};

/// Inputs and outputs of conversions: as a whole, in regions, slice by slice, and to Gaussians.
const CONVERSIONS: [[&str; 2]; 5] = [
    ["a.ply", "a.splk"],
    ["a.ply", "b.splk --memory 8MiB"],
    ["a.nrrd", "a.splv"],
    ["a.ply", "c.ply"],
    ["a.nrrd", "d.nrrd"],
];

fn folder() -> Folder {
    let folder = Folder::new();
    folder.put("a.ply", sheet(90));
    let samples: Vec<u8> = (0..64usize * 64 * 64).map(|i| (i * i / 77) as u8).collect();
    let header = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 64 64 64\nencoding: raw\n\n";
    folder.put("a.nrrd", [header.as_bytes(), &samples].concat());
    folder
}

/// Returns what is in a folder besides the inputs and one output.
fn left(folder: &Folder, output: &str) -> Vec<String> {
    let mut names = folder.names();
    names.retain(|name| !["a.ply", "a.nrrd", output].contains(&&**name));
    names
}

fn start(folder: &Folder, arguments: &str) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_splatkit"));
    command.args(arguments.split_whitespace()).current_dir(folder);
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

fn signal(child: &Child, name: &str) {
    Command::new("kill").args([&format!("-{name}"), &child.id().to_string()]).status().unwrap();
}

const OLD: &[u8] = b"what was there before";

/// Stops each conversion at `moments` moments, spread over the time that it takes. `check` gets the
/// exit status, the leftover files, the folder, and the output's name.
fn stop(
    name: &str,
    moments: u32,
    stop: impl Fn(u32, &mut Child),
    check: impl Fn(ExitStatus, &[String], &Folder, &str),
) -> [u32; 2] {
    let folder = folder();
    let (mut stopped, mut finished) = (0, 0);
    for [input, output] in CONVERSIONS {
        let arguments = format!("convert {input} --overwrite -o {output}");
        let file = output.split(' ').next().unwrap();
        let begin = Instant::now();
        folder.run(&arguments).ok();
        let mut whole = begin.elapsed();
        let new = std::fs::read(folder.path(file)).unwrap();
        for moment in 0..moments {
            let has_old = moment % 2 == 0;
            std::fs::remove_file(folder.path(file)).unwrap();
            if has_old {
                folder.put(file, OLD);
            }
            let begin = Instant::now();
            let mut child = start(&folder, &arguments);
            std::thread::sleep(whole * moment / moments);
            stop(moment, &mut child);
            let status = child.wait().unwrap();
            let took = begin.elapsed();
            let written = std::fs::read(folder.path(file)).ok();
            let is_old = written.as_deref() == has_old.then_some(OLD);
            assert!(
                is_old || written.as_ref() == Some(&new),
                "{output}, moment {moment}: neither old nor new"
            );
            finished += u32::from(!is_old);
            stopped += u32::from(is_old);
            if !is_old {
                // Faster than the first run: the machine was busy then.
                whole = whole.min(took);
            }
            check(status, &left(&folder, file), &folder, file);
            if !folder.path(file).exists() {
                folder.put(file, OLD);
            }
        }
        folder.run(&arguments).ok();
        assert!(
            std::fs::read(folder.path(file)).unwrap() == new,
            "{output}: not the same after all this"
        );
        assert_eq!(
            left(&folder, file),
            [""; 0],
            "{output}: nothing is left over after one that was not stopped"
        );
        std::fs::remove_file(folder.path(file)).unwrap();
    }
    println!("{name}: {stopped} stopped, {finished} finished before");
    [stopped, finished]
}

#[test]
fn who_is_killed_leaves_the_old_file_or_the_new_one() {
    let kill = |_, child: &mut Child| child.kill().unwrap();
    let [stopped, _] = stop("killed", 12, kill, |_, left, folder, file| {
        for name in left {
            assert!(
                name.starts_with(&format!(".{file}.")) && name.ends_with(".splatkit-part"),
                "{name}"
            );
            // A leftover cannot be mistaken: it is a file with all its checksums, or `check`
            // refuses it.
            if file.ends_with(".splk") || file.ends_with(".splv") {
                std::fs::copy(folder.path(name), folder.path(format!("copy.{file}"))).unwrap();
                let code = folder.run(&format!("check copy.{file}")).code();
                std::fs::remove_file(folder.path(format!("copy.{file}"))).unwrap();
                assert!([Some(0), Some(3)].contains(&code), "{name}: {code:?}");
            }
        }
    });
    assert!(stopped > 20, "{stopped}");
}

#[test]
fn who_is_interrupted_leaves_nothing() {
    let interrupt = |moment: u32, child: &mut Child| {
        signal(child, ["INT", "TERM", "INT", "HUP"][moment as usize % 4]);
    };
    let sent = [2, 15, 1].map(Some);
    let [stopped, _] = stop("interrupted", 12, interrupt, |status, left, _, file| {
        // In the first moments, neither the handler nor any file may exist yet.
        let by_signal = sent.contains(&std::os::unix::process::ExitStatusExt::signal(&status));
        assert!(matches!(status.code(), Some(0 | 130)) || by_signal, "{file}: {status}");
        assert_eq!(left, [""; 0], "{file}: {status}");
    });
    assert!(stopped > 20, "{stopped}");
}

#[test]
fn who_is_interrupted_while_drawing_ends_at_once() {
    let folder = folder();
    let arguments = "render a.nrrd -o a.png --overwrite --size 640x480";
    let begin = Instant::now();
    folder.run(arguments).ok();
    let whole = begin.elapsed();
    let mut answered = 0;
    for moment in 0..24 {
        std::fs::remove_file(folder.path("a.png")).ok();
        let mut child = start(&folder, arguments);
        std::thread::sleep(whole * moment / 24 + Duration::from_millis(10));
        signal(&child, "INT");
        let status = child.wait().unwrap();
        let picture = std::fs::read(folder.path("a.png")).ok();
        // On a busy machine the handler may not be installed yet, but not every time.
        let by_signal = std::os::unix::process::ExitStatusExt::signal(&status) == Some(2);
        answered += u32::from(!by_signal);
        assert!(matches!(status.code(), Some(0 | 130)) || by_signal, "moment {moment}: {status}");
        assert!(picture.is_none_or(|bytes| is_png(&bytes, 640, 480)), "moment {moment}");
        assert_eq!(left(&folder, "a.png"), [""; 0]);
    }
    assert!(answered > 0);
}

/// Runs a conversion that may write files of at most `blocks` blocks of 512 bytes. Writing more is
/// an error, as on a full disk.
fn with_room_for(folder: &Folder, blocks: u64, arguments: &str) -> (Option<i32>, String) {
    let command = env!("CARGO_BIN_EXE_splatkit");
    let script = format!("ulimit -f {blocks}; exec '{command}' {arguments}");
    let output = Command::new("sh").args(["-c", &script]).current_dir(folder).output().unwrap();
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn who_finds_no_room_says_so() {
    let folder = folder();
    for [input, output] in CONVERSIONS {
        let arguments = format!("convert {input} --overwrite -o {output}");
        let file = output.split(' ').next().unwrap();
        folder.run(&arguments).ok();
        let blocks = folder.path(file).metadata().unwrap().len() / 512;
        folder.put(file, OLD);
        for room in [0, 1, blocks / 2, blocks - 1] {
            let (code, stderr) = with_room_for(&folder, room, &arguments);
            assert!(
                code == Some(1) && stderr.contains(file) && stderr.contains("make room"),
                "{output}: {code:?} {stderr}"
            );
            assert_eq!(std::fs::read(folder.path(file)).unwrap(), OLD, "{output}");
            assert_eq!(left(&folder, file), [""; 0], "{output}");
        }
        std::fs::remove_file(folder.path(file)).unwrap();
    }
}

/// With more and more memory (Linux: `ulimit -v`), the command soon ends with an error or draws the
/// picture. Mesa's driver may end the process if it finds no memory itself.
#[cfg(target_os = "linux")]
#[test]
fn who_finds_no_memory_says_so_or_ends() {
    let folder = folder();
    // If the driver finds no memory, `--engine auto` would draw with the other engine.
    let arguments = "render a.nrrd --overwrite -o a.png --size 320x240 --engine gpu";
    folder.run(arguments).ok();
    let whole = std::fs::read(folder.path("a.png")).unwrap();
    let command = env!("CARGO_BIN_EXE_splatkit");
    let mut drawn = 0;
    for mebibytes in (200..2000).step_by(150) {
        std::fs::remove_file(folder.path("a.png")).ok();
        let kibibytes = mebibytes << 10;
        let script = format!("ulimit -v {kibibytes}; exec timeout 100 '{command}' {arguments}");
        let output =
            Command::new("sh").args(["-c", &script]).current_dir(&folder).output().unwrap();
        let code = output.status.code();
        let stderr = String::from_utf8_lossy(&output.stderr);
        let picture = std::fs::read(folder.path("a.png")).ok();
        println!("{mebibytes} MiB: {code:?} {}", stderr.lines().last().unwrap_or_default());
        match code {
            Some(0) => {
                assert!(picture.as_ref() == Some(&whole), "{mebibytes} MiB: another picture");
            }
            // The shell reports a signal as 128 plus its number; 124 is a process that did not end
            // in time.
            Some(3 | 4 | 134 | 135 | 139) | None => {
                assert!(picture.is_none(), "{mebibytes} MiB: {code:?}, with a picture");
            }
            _ => panic!("{mebibytes} MiB: {code:?}: {stderr}"),
        }
        drawn += u32::from(code == Some(0));
        assert_eq!(left(&folder, "a.png"), [""; 0], "{mebibytes} MiB");
    }
    assert!((1..12).contains(&drawn), "{drawn}");
}

#[test]
fn where_nothing_can_be_written_it_is_told() {
    let folder = folder();
    std::fs::create_dir(folder.path("folder.splk")).unwrap();
    let onto_itself = format!(
        "a.nrrd -o ../{}/a.nrrd --overwrite",
        folder.as_ref().file_name().unwrap().display()
    );
    for (arguments, words) in [
        ("a.ply -o none/a.splk", ["none/a.splk", "make the folder first"]),
        ("a.ply -o folder.splk --overwrite", ["folder.splk", "is a folder"]),
        ("a.ply -o a.ply --overwrite", ["a.ply: is an input too", "give another name"]),
        (&onto_itself, ["is an input too", "give another name"]),
    ] {
        folder.run(&format!("convert {arguments}")).fails(1, &words);
    }
    // A folder that nobody may write to, not even root.
    if cfg!(target_os = "linux") && Path::new("/sys/kernel").is_dir() {
        for output in ["/sys/kernel/a.splk", "/sys/kernel/a.splv"] {
            let input = if output.ends_with('k') { "a.ply" } else { "a.nrrd" };
            folder
                .run(&format!("convert {input} -o {output}"))
                .fails(1, &[output, "write to another folder"]);
        }
        folder
            .run("render a.nrrd -o /sys/kernel/a.png")
            .fails(1, &["/sys/kernel/a.png", "write to another folder"]);
        folder
            .run("generate ball -o /sys/kernel/a.nrrd")
            .fails(1, &["/sys/kernel/a.nrrd", "another folder"]);
    }
    assert_eq!(left(&folder, "folder.splk"), [""; 0]);
}

#[test]
fn inputs_that_are_cut_meanwhile_are_told() {
    let folder = Folder::new();
    let mesh = sheet(300);
    let samples = vec![7; 128 * 128 * 128];
    let header = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 128 128 128\nencoding: raw\n\n";
    let volume = [header.as_bytes(), &samples].concat();
    let (mut reported, mut codes) = (0, Vec::new());
    for (name, bytes, output) in [
        ("in.ply", &mesh, "a.splk --memory 8MiB"),
        ("in.nrrd", &volume, "a.splv"),
        ("in.ply", &mesh, "b.splk"),
    ] {
        let arguments = format!("convert {name} --overwrite -o {output}");
        folder.put(name, bytes);
        let begin = Instant::now();
        folder.run(&arguments).ok();
        let mut whole = begin.elapsed();
        // Ten moments, and more if all came too early or too late.
        let before = reported;
        for moment in (0..10).cycle().take(40) {
            if moment == 0 && reported > before + 1 {
                break;
            }
            folder.put(name, bytes);
            let begin = Instant::now();
            let mut command = Command::new(env!("CARGO_BIN_EXE_splatkit"));
            command
                .args(arguments.split(' '))
                .current_dir(&folder)
                .stdout(Stdio::null())
                .stderr(Stdio::piped());
            let child = command.spawn().unwrap();
            std::thread::sleep(whole * moment / 10 + Duration::from_millis(3));
            let file = std::fs::File::options().write(true).open(folder.path(name)).unwrap();
            file.set_len(bytes.len() as u64 * u64::from(moment) / 12).unwrap();
            let output = child.wait_with_output().unwrap();
            if output.status.success() {
                whole = whole.min(begin.elapsed());
            }
            let text = String::from_utf8_lossy(&output.stderr).into_owned();
            // Cut before it was opened, while it was read, or after.
            assert!(
                matches!(output.status.code(), Some(0 | 3)),
                "{arguments}, moment {moment}: {} {text}",
                output.status
            );
            reported += u32::from(text.contains("changed while it was"));
            codes.push(output.status.code());
        }
    }
    println!("cut: {reported} told of {}", codes.len());
    assert!(reported > 3, "{codes:?}");
}
