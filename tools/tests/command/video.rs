//! Films: animations in one file, the camera's path, and raw frames. Decoders of other people read
//! the films back.

use crate::common::*;
use std::{fs, io::Read, path::Path, process::Stdio};

const SMALL: &str = "--size 64x48 --engine cpu";
const PIXELS: usize = 64 * 48;

/// A film as it was read: RGBA of each frame, and how long each is shown, in milliseconds.
struct Decoded {
    frames: Vec<Vec<u8>>,
    delays: Vec<u32>,
}

fn folder() -> Folder {
    let folder = Folder::new();
    folder.put("a.ply", PLY);
    folder
}

fn rgba(bytes: &[u8], channels: usize) -> Vec<u8> {
    let pixel = |pixel: &[u8]| [pixel[0], pixel[1], pixel[2], *pixel.get(3).unwrap_or(&255)];
    bytes.chunks_exact(channels).flat_map(pixel).collect()
}

/// Reads a PNG, animated or not. Each frame fills the picture.
fn png(path: &Path) -> Decoded {
    let file = std::io::BufReader::new(fs::File::open(path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let control = reader.info().animation_control;
    let count = control.map_or(1, |control| control.num_frames);
    // An animation repeats for ever.
    assert!(control.is_none_or(|control| control.num_plays == 0));
    let (mut frames, mut delays) = (Vec::new(), Vec::new());
    for _ in 0..count {
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let frame = reader.next_frame(&mut bytes).unwrap();
        assert_eq!((frame.width, frame.height), (64, 48));
        frames.push(rgba(&bytes[..frame.buffer_size()], frame.color_type.samples()));
        if let Some(frame) = reader.info().frame_control() {
            delays.push(1000 * u32::from(frame.delay_num) / u32::from(frame.delay_den));
            assert_eq!(frame.blend_op, png::BlendOp::Source);
        }
    }
    Decoded { frames, delays }
}

fn webp(path: &Path) -> Decoded {
    let file = std::io::BufReader::new(fs::File::open(path).unwrap());
    let mut decoder = image_webp::WebPDecoder::new(file).unwrap();
    assert!(decoder.is_animated() && decoder.dimensions() == (64, 48));
    assert_eq!(decoder.loop_count(), image_webp::LoopCount::Forever);
    let (mut frames, mut delays) = (Vec::new(), Vec::new());
    let channels = if decoder.has_alpha() { 4 } else { 3 };
    for _ in 0..decoder.num_frames() {
        let mut bytes = vec![0; decoder.output_buffer_size().unwrap()];
        delays.push(decoder.read_frame(&mut bytes).unwrap());
        frames.push(rgba(&bytes, channels));
    }
    Decoded { frames, delays }
}

fn gif(path: &Path) -> Decoded {
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(fs::File::open(path).unwrap()).unwrap();
    let (mut frames, mut delays) = (Vec::new(), Vec::new());
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        assert_eq!((frame.width, frame.height, frame.left, frame.top), (64, 48, 0, 0));
        delays.push(10 * u32::from(frame.delay));
        frames.push(frame.buffer.to_vec());
    }
    assert_eq!(decoder.repeat(), gif::Repeat::Infinite);
    Decoded { frames, delays }
}

/// The mean square difference of two pictures as decibels below white.
fn psnr(a: &[u8], b: &[u8]) -> f64 {
    let square = |(a, b): (&u8, &u8)| (f64::from(*a) - f64::from(*b)).powi(2);
    let mean = a.iter().zip(b).map(square).sum::<f64>() / a.len() as f64;
    10.0 * (255.0 * 255.0 / mean).log10()
}

#[test]
fn a_film_has_the_frames_of_the_numbered_pictures() {
    for background in ["#203040", "none"] {
        let back = format!("--background {background}");
        let folder = folder();
        let turn = format!("--turntable 5 {back} {SMALL}");
        folder.run(&format!("render a.ply -o still.png {turn}")).ok();
        let stills: Vec<Vec<u8>> = (0..5)
            .map(|frame| png(&folder.path(format!("still_000{frame}.png"))).frames.remove(0))
            .collect();
        assert!(stills.windows(2).all(|pair| pair[0] != pair[1]));
        for name in ["film.apng", "film.webp", "film.gif", "slow.gif"] {
            let fps = if name == "slow.gif" { "--fps 10" } else { "" };
            folder.run(&format!("render a.ply -o {name} {turn} {fps}")).ok();
        }
        let films = [
            png(&folder.path("film.apng")),
            webp(&folder.path("film.webp")),
            gif(&folder.path("film.gif")),
        ];
        for film in &films {
            assert_eq!((film.frames.len(), film.delays.len()), (5, 5));
        }
        // Five thirtieths of a second.
        assert_eq!(films[0].delays, [33, 34, 33, 33, 34]);
        assert_eq!(films[1].delays, films[0].delays);
        assert_eq!(films[2].delays, [30, 40, 30, 30, 40]);
        assert_eq!(gif(&folder.path("slow.gif")).delays, [100; 5]);
        assert!(films[0].frames == stills, "{back}: APNG loses nothing");
        assert!(films[1].frames == stills, "{back}: WebP loses nothing");
        for (frame, still) in films[2].frames.iter().zip(&stills) {
            // GIF has pixels that are opaque and pixels that are transparent.
            let seen = |picture: &[u8]| -> Vec<bool> {
                picture.chunks_exact(4).map(|pixel| pixel[3] >= 128).collect()
            };
            assert_eq!(seen(frame), seen(still), "{back}");
            let colors = |picture: &[u8]| -> Vec<u8> {
                let drawn =
                    picture.chunks_exact(4).zip(seen(still)).filter(|(_, is_seen)| *is_seen);
                drawn.flat_map(|(pixel, _)| pixel[..3].to_vec()).collect()
            };
            let quality = psnr(&colors(frame), &colors(still));
            // Every pixel of the tetrahedron has a colour of its own, and 256 must do for all.
            assert!(quality > 32.0, "{back}: {quality} dB");
        }
        let clear = stills[0].chunks_exact(4).filter(|pixel| pixel[3] == 0).count();
        assert_eq!(clear > PIXELS / 10, background == "none", "{clear}");
    }
}

/// Three keyframes around the tetrahedron, and the flags of their cameras.
const CAMERAS: [([f64; 3], [f64; 3], f64); 3] = [
    ([2.0, 3.0, 30.0], [2.0, 2.0, 2.0], 30.0),
    ([25.0, 4.0, -5.0], [2.0, 2.0, 2.0], 40.0),
    ([-8.0, 9.0, -30.0], [3.0, 2.0, 1.0], 25.0),
];

fn path_of(times: [f64; 3]) -> String {
    let keyframes = times.iter().zip(CAMERAS).map(|(time, (position, focal_point, angle))| {
        format!(
            r#"{{"time": {time}, "camera": {{"position": {position:?}, "focal_point":
            {focal_point:?}, "view_up": [0, 1, 0], "view_angle": {angle}}}}}"#
        )
    });
    let keyframes: Vec<String> = keyframes.collect();
    format!(r#"{{"splatkit_path": 1, "keyframes": [{}]}}"#, keyframes.join(",\n"))
}

#[test]
fn a_path_passes_through_its_keyframes() {
    let folder = folder();
    folder.put("path.json", path_of([0.5, 1.5, 2.0]));
    let report =
        folder.json(&format!("render a.ply -o out.png --path path.json --fps 4 {SMALL} --json"));
    assert_eq!(report["frames"], 7);
    assert_eq!(report["camera"]["position"], serde_json::json!(CAMERAS[2].0));
    for (frame, (position, focal_point, angle)) in [0, 4, 6].into_iter().zip(CAMERAS) {
        let text = |numbers: [f64; 3]| numbers.map(|number| number.to_string()).join(",");
        folder
            .run(&format!(
                "render a.ply -o key.png --overwrite --camera-position {} --focal-point {} \
                 --view-up 0,1,0 --view-angle {angle} {SMALL}",
                text(position),
                text(focal_point)
            ))
            .ok();
        folder.run(&format!("compare key.png out_000{frame}.png --threshold 60")).ok();
        // A frame later, the camera is elsewhere.
        let next = if frame == 6 { 5 } else { frame + 1 };
        folder.run(&format!("compare key.png out_000{next}.png --threshold 60")).fails(5, &["dB"]);
    }
    let film = format!("render a.ply -o film.apng --path path.json --fps 4 {SMALL}");
    folder.run(&film).ok();
    let pictures = (0..7).map(|frame| png(&folder.path(format!("out_000{frame}.png"))).frames);
    assert!(png(&folder.path("film.apng")).frames == pictures.flatten().collect::<Vec<_>>());

    // A camera may look past the scene, but not all the time.
    folder.put(
        "away.json",
        path_of([0.0, 1.0, 2.0]).replace("[3.0, 2.0, 1.0]", "[-9.0, 9.0, -60.0]"),
    );
    folder.run(&format!("render a.ply -o away.gif --path away.json --fps 2 {SMALL}")).ok();
    assert_eq!(gif(&folder.path("away.gif")).frames.len(), 5);
    let always = r#"{"splatkit_path": 1, "keyframes": [{"time": 0, "camera": {
        "position": [0, 0, 90], "focal_point": [0, 0, 99], "view_up": [0, 1, 0],
        "view_angle": 30}}]}"#;
    folder.put("always.json", always);
    folder
        .run(&format!("render a.ply -o always.gif --path always.json {SMALL}"))
        .fails(3, &["nothing to draw"]);
    assert!(!folder.path("always.gif").exists());
}

#[test]
fn raw_frames_go_to_stdout() {
    let folder = folder();
    for (flags, count) in [("", 1), ("--turntable 3", 3)] {
        folder.run(&format!("render a.ply -o out{count}.png {flags} {SMALL}")).ok();
        let raw = folder.run(&format!("render a.ply -o - --raw {flags} {SMALL}")).ok().stdout;
        assert_eq!(raw.len(), count * PIXELS * 4);
        for (frame, pixels) in raw.chunks_exact(PIXELS * 4).enumerate() {
            let name = if count == 1 { "out1.png".into() } else { format!("out3_000{frame}.png") };
            assert!(png(&folder.path(name)).frames[0] == pixels, "{flags} {frame}");
        }
    }
    // A reader that leaves ends the work, and is no error.
    let mut command = folder.command();
    let turn = format!("render a.ply -o - --raw --turntable 2000 {SMALL}");
    command.args(turn.split_whitespace()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let mut first = vec![0; PIXELS * 4];
    let mut stdout = child.stdout.take().unwrap();
    stdout.read_exact(&mut first).unwrap();
    drop(stdout);
    let begun = std::time::Instant::now();
    let end = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&end.stderr);
    assert!(end.status.success() && !said.contains("rror"), "{said}");
    assert!(begun.elapsed().as_secs() < 10, "all frames were drawn");
}

#[test]
fn wrong_films_are_refused() {
    let folder = folder();
    folder.put("path.json", path_of([0.0, 1.0, 2.0]));
    folder.put("typo.json", path_of([0.0, 1.0, 2.0]).replacen("view_up", "viewup", 1));
    folder.put("late.json", path_of([0.0, 1.0, 1.0]));
    folder.put("long.json", path_of([0.0, 1.0, 1e9]));
    folder.put("old.gif", "mine");
    for (arguments, code, words) in [
        ("-o out.gif", 2, &["out.gif", "--turntable", "--path"][..]),
        ("-o out.avi --turntable 3", 2, &["out.avi", ".gif", ".mp4", ".png"]),
        ("-o - --turntable 3", 2, &["--raw"]),
        ("-o out.png --raw", 2, &["-o -"]),
        ("--raw", 2, &["--output"]),
        ("-o - --raw --json", 2, &["stdout"]),
        ("-o old.gif --turntable 3", 1, &["old.gif", "exists", "--overwrite"]),
        ("-o none/out.gif --turntable 3", 1, &["folder"]),
        ("-o out.webp --turntable 3 --size 16385x2", 2, &["out.webp", "16384"]),
        ("-o out.gif --path path.json --turntable 3", 2, &["cannot be used with"]),
        ("-o out.gif --path path.json --azimuth 3", 2, &["--azimuth", "--path"]),
        ("-o out.gif --path path.json --up +Z", 2, &["--up", "--path"]),
        ("-o out.png --path path.json --depth d.png", 2, &["--depth", "--path"]),
        ("-o out.gif --path typo.json", 3, &["typo.json", "viewup", "line 2"]),
        ("-o out.gif --path late.json", 3, &["late.json", "keyframe 3"]),
        ("-o out.gif --path long.json", 3, &["long.json", "too many frames"]),
        ("-o out.gif --path gone.json", 3, &["gone.json"]),
        ("-o out.gif --turntable 3 --fps 0", 2, &["0.1"]),
    ] {
        let small = if arguments.contains("--size") { "--engine cpu" } else { SMALL };
        folder.run(&format!("render a.ply {arguments} {small}")).fails(code, words);
    }
    assert_eq!(fs::read(folder.path("old.gif")).unwrap(), b"mine");
    folder.run(&format!("render a.ply -o path.json.png --path path.json --fps 0.5 {SMALL}")).ok();
    let mut names = folder.names();
    names.retain(|name| name.contains("out.") || name.contains("part"));
    assert_eq!(names, [""; 0]);

    for (arguments, says) in [
        ("-o a.png --fps 10", "--fps has no effect"),
        ("-o b.png --turntable 2 --fps 10", "--fps has no effect"),
        ("-o c.gif --turntable 2 --fps 60", "50 frames a second"),
    ] {
        let said = folder.run(&format!("render a.ply {arguments} {SMALL}"));
        assert!(said.stderr().contains(says), "{}", said.stderr());
        said.ok();
    }
    let said = folder.run(&format!("render a.ply -o d.gif --turntable 2 --fps 10 {SMALL}"));
    assert!(!said.stderr().contains("warning"), "{}", said.stderr());
}

#[cfg(unix)]
mod ffmpeg {
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    /// Puts a program of this name into the folder `bin`, and returns the folder.
    fn fake(folder: &Folder, script: &str) -> std::path::PathBuf {
        let bin = folder.path("bin");
        fs::create_dir_all(&bin).unwrap();
        let program = bin.join("ffmpeg");
        fs::write(&program, format!("#!/bin/sh\nPATH=/usr/bin:/bin\n{script}")).unwrap();
        fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
        bin
    }

    fn run(folder: &Folder, path: &Path, arguments: &str) -> Run {
        let arguments = format!("render a.ply {arguments} {SMALL}");
        let arguments: Vec<&str> = arguments.split_whitespace().collect();
        Run::of(folder.command().env("PATH", path), &arguments)
    }

    /// Records its arguments and its input, and writes a film.
    const RECORDING: &str = "[ \"$1\" = -version ] && exit\n\
        for word; do echo \"$word\"; last=$word; done > arguments\n\
        cat > frames\necho film > \"${last#file:}\"\n";

    #[test]
    fn without_it_the_other_ways_are_named() {
        let folder = folder();
        let empty = folder.path("empty");
        fs::create_dir(&empty).unwrap();
        for name in ["out.mp4", "out.webm", "out.mov"] {
            run(&folder, &empty, &format!("-o {name} --turntable 3"))
                .fails(1, &[name, "ffmpeg", "not installed", ".gif", ".webp", "out.png", "--raw"]);
        }
        assert_eq!(folder.names().len(), 2, "{:?}", folder.names());
    }

    #[test]
    fn it_gets_every_frame() {
        let folder = folder();
        let bin = fake(&folder, RECORDING);
        let raw = folder.run(&format!("render a.ply -o - --raw --turntable 3 {SMALL}")).ok().stdout;
        for (name, flags, words) in [
            ("out.mp4", "", &["libx264", "yuv420p", "pad=", "mp4", "30"][..]),
            ("out.mov", "--fps 24", &["libx264", "yuv420p", "pad=", "mov", "24"]),
            ("out.webm", "--fps 29.97", &["libvpx-vp9", "yuv420p", "webm", "29.97"]),
            ("clear.webm", "--background none", &["libvpx-vp9", "yuva420p"]),
            ("clear.mov", "--background none", &["prores_ks", "yuva444p10le"]),
        ] {
            run(&folder, &bin, &format!("-o {name} --turntable 3 {flags}")).ok();
            assert_eq!(fs::read(folder.path(name)).unwrap(), b"film\n", "{name}");
            let arguments = fs::read_to_string(folder.path("arguments")).unwrap();
            for word in words.iter().chain(&["rawvideo", "rgba", "64x48"]) {
                assert!(arguments.contains(word), "{name}: no {word} in {arguments}");
            }
            let frames = fs::read(folder.path("frames")).unwrap();
            assert_eq!(frames.len(), 3 * PIXELS * 4, "{name}");
            if flags.contains("none") {
                assert!(frames.chunks_exact(4).any(|pixel| pixel[3] == 0), "{name}");
            } else {
                assert!(frames == raw, "{name}");
            }
        }
        // MP4 has no opacity: a warning says so, and the background is black.
        let said = run(&folder, &bin, "-o clear.mp4 --turntable 3 --background none");
        assert!(said.stderr().contains("MP4 has no opacity"), "{}", said.stderr());
        said.ok();
        assert!(fs::read(folder.path("frames")).unwrap() == raw);
    }

    #[test]
    fn its_failure_is_told_and_leaves_nothing() {
        let folder = folder();
        folder.put("old.mp4", "mine");
        let failures = [
            ("echo first >&2\necho 'Unknown encoder' >&2\nexit 3", "Unknown encoder"),
            (
                "cat > frames\necho half > \"${last#file:}\"\necho 'No space' >&2\nexit 1",
                "No space",
            ),
            ("exit 0", "before the last frame"),
        ];
        for (script, says) in failures {
            let bin = fake(
                &folder,
                &format!("[ \"$1\" = -version ] && exit\nfor last; do :; done\n{script}\n"),
            );
            for name in ["out.mp4", "old.mp4"] {
                // Enough frames that the pipe cannot hold them all.
                run(&folder, &bin, &format!("-o {name} --turntable 20 --overwrite"))
                    .fails(1, &[name, "ffmpeg", says]);
            }
        }
        assert_eq!(fs::read(folder.path("old.mp4")).unwrap(), b"mine");
        let mut names = folder.names();
        names.retain(|name| name.contains("out") || name.contains("part"));
        assert_eq!(names, [""; 0]);
        // A scene that cannot be drawn stops it.
        let bin = fake(&folder, RECORDING);
        let away = "--camera-position 0,0,100 --focal-point 0,0,200 --view-up 0,1,0";
        run(&folder, &bin, &format!("-o out.mp4 --turntable 3 {away}"))
            .fails(3, &["nothing to draw"]);
        assert!(!folder.path("out.mp4").exists());
    }
}

/// A ball in a volume of three times, in which it becomes brighter and smaller.
fn ball_of_times() -> Vec<u8> {
    const SIDE: i32 = 12;
    let mut content = format!(
        "NRRD0004\ntype: uint8\ndimension: 4\nsizes: {SIDE} {SIDE} {SIDE} 3\nencoding: raw\n\
         kinds: domain domain domain time\n\n"
    )
    .into_bytes();
    for time in 0..3 {
        let value = |at: i32| {
            let square = |axis: i32| (2 * (at / SIDE.pow(axis as u32) % SIDE) - SIDE + 1).pow(2);
            let radius2 = square(0) + square(1) + square(2);
            if radius2 < 90 - 30 * time { (60 + 60 * time) as u8 } else { 0 }
        };
        content.extend((0..SIDE.pow(3)).map(value));
    }
    content
}

#[test]
fn times_become_frames() {
    let folder = folder();
    folder.put("t.nrrd", ball_of_times());
    let times = format!("--times all {SMALL}");
    folder.run(&format!("render t.nrrd -o t.png {times}")).ok();
    let still = |name: &str| png(&folder.path(name)).frames.remove(0);
    let stills = [0, 1, 2].map(|time| still(&format!("t_000{time}.png")));
    folder.run(&format!("render t.nrrd -o first.png --time 0 {SMALL}")).ok();
    assert_eq!(stills[0], still("first.png"));
    // The camera is that of the first time, so the ball becomes smaller.
    let drawn = |picture: &[u8]| picture.chunks(4).filter(|pixel| pixel[..3] != [0; 3]).count();
    let counts = [&stills[0], &stills[1], &stills[2]].map(|picture| drawn(picture));
    assert!(counts[0] > counts[1] + 50 && counts[1] > counts[2] + 50, "{counts:?}");
    folder.run(&format!("render t.nrrd -o t.apng {times}")).ok();
    let film = png(&folder.path("t.apng"));
    assert_eq!((film.frames, film.delays), (stills.to_vec(), vec![100; 3]));
    // Captions name the time, in any order.
    let facts = folder.json(&format!(
        "render t.nrrd -o turn.png --times 2,0 --caption t={{time}} --json {SMALL}"
    ));
    assert_eq!((&facts["frames"], &facts["overlay"]["caption"]), (&2.into(), &"t=0".into()));
}

#[test]
fn times_stand_beside_each_other() {
    let folder = folder();
    folder.put("t.nrrd", ball_of_times());
    folder.run(&format!("render t.nrrd -o all.png --times 0..2 --columns 3 {SMALL}")).ok();
    let whole = png(&folder.path("all.png")).frames.remove(0);
    // The labels are above.
    let panel = |number: usize| {
        let rows = whole.chunks(64 * 4).skip(15);
        let pixels = rows.flat_map(|row| row[number * 84..][..84].chunks(4));
        pixels.filter(|pixel| pixel[..3] != [0; 3]).count()
    };
    let counts = [0, 1, 2].map(panel);
    assert!(counts[0] > counts[1] && counts[1] > counts[2] && counts[2] > 0, "{counts:?}");
}

#[test]
fn wrong_times_are_named() {
    let folder = folder();
    folder.put("t.nrrd", ball_of_times());
    for (flags, words) in [
        ("t.nrrd -o t.gif --times 1..3", "--times: there is no time 3: choose from 0 to 2"),
        ("a.ply -o t.gif --times all", "--times: no input has several times"),
        ("t.nrrd -o t.gif --times 3..1", "“3..1” is no time"),
        ("t.nrrd -o t.gif --times all --views front,top", "one view"),
        ("t.nrrd -o t.gif --times all --time 1", "cannot be used with"),
        ("t.nrrd -o t.gif --times all --columns 2", "animation"),
    ] {
        folder.run(&format!("render {flags} {SMALL}")).fails(2, &[words]);
    }
}
