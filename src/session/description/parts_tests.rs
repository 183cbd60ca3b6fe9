//! Tests of scenes whose files come in parts.

use super::Description;
use crate::{
    Device, Error, Renderer, Result, bricks,
    compare::compare_pictures,
    gpu::{AdapterChoice, Budget, Gpu},
    hierarchy::{
        file::{WriteOptions, to_bytes},
        testing::{joined, surface},
    },
    input::{Parts, testing::Folder},
    picture::Picture,
    session::{Drawing, Loaded},
    volume::{Samples, Volume, phantoms::Phantom},
};
use std::{collections::BTreeMap, ops::Range};

/// The bytes of the first request of a viewer.
const FIRST: usize = 4 << 16;

/// A hierarchy with a directory of several levels.
fn hierarchy() -> (&'static str, Vec<u8>) {
    let mut splats = surface(20_000, 3);
    splats.iter_mut().for_each(|splat| splat.center[0] *= 4.0);
    let bytes = to_bytes(&joined(&splats, 2_000), &WriteOptions::default()).expect("a file");
    ("a.splk", bytes)
}

fn volume() -> (&'static str, Vec<u8>) {
    let mut volume = Phantom::Head.sample_bytes([170; 3]).expect("a volume");
    // Noise, which cannot be packed.
    let noise = |at: u32| {
        let mixed = (at ^ at >> 15).wrapping_mul(0x2c1b_3c6d);
        (mixed ^ mixed >> 12).wrapping_mul(0x297a_2d39) >> 27
    };
    let samples = volume.samples.bytes().iter().zip(0u32..);
    let noisy = samples.map(|(sample, at)| sample ^ noise(at) as u8);
    volume.samples = Samples::U8(noisy.collect());
    let volume = Volume::new(volume.lattice, volume.samples).expect("a volume");
    let folder = Folder::new();
    let path = folder.path("a.splv");
    bricks::write(&volume, &path, &bricks::WriteOptions::default(), None).expect("a file");
    ("a.splv", std::fs::read(path).expect("a file"))
}

/// A scene of one file, close enough that the view needs only a part of it.
fn scene(name: &str, more: &str) -> Description {
    scene_of(name, [160, 120], more)
}

fn scene_of(name: &str, size: [u32; 2], more: &str) -> Description {
    let size = format!("{size:?}");
    let text = format!(
        r#"{{"splatkit_scene": 2, "inputs": [{{"file": "{name}"}}], "framing": {{"zoom": 2}},
            "picture": {{"samples": 1, "size": {size} {more}}}}}"#
    );
    Description::parse(&text).expect("a scene")
}

/// Hands in bytes of a file, and counts them.
struct Server<'a> {
    bytes: &'a [u8],
    parts: Parts,
    sent: usize,
    /// How often what is asked for first is sent wrong, and where that is.
    wrong: usize,
    place: Option<usize>,
}

impl<'a> Server<'a> {
    fn new(bytes: &'a [u8], most: u64) -> Self {
        let mut server = Self {
            bytes,
            parts: Parts::new(bytes.len() as u64, most),
            sent: 0,
            wrong: 0,
            place: None,
        };
        server.send(0..FIRST.min(bytes.len()), false);
        server
    }

    fn send(&mut self, range: Range<usize>, may_be_wrong: bool) {
        let mut part = self.bytes[range.clone()].to_vec();
        if may_be_wrong && self.wrong > 0 && range.contains(self.place.get_or_insert(range.start)) {
            self.wrong -= 1;
            part.iter_mut().step_by(97).for_each(|byte| *byte ^= 1);
        }
        self.sent += part.len();
        self.parts.arrive(range.start as u64, &part).expect("blocks");
    }

    /// Answers the most important requests.
    fn answer(&mut self, count: usize) {
        let requests = self.parts.requests();
        let told = format!("{} bytes held, {} sent", self.parts.held(), self.sent);
        assert!(!requests.is_empty(), "what is missed is asked for: {told}");
        for range in requests.into_iter().take(count) {
            self.send(range.start as usize..range.end as usize, true);
        }
    }
}

/// What a viewer shows of a file in parts.
struct Shown {
    last: Picture,
    /// The bytes that were sent before the first picture, and in all.
    first: usize,
    all: usize,
    /// Pictures that were not exact.
    rough: usize,
    most: u64,
}

/// Reads the scene, and finds what is seen.
fn read(scene: &Description, parts: &Parts) -> Result<(Loaded, Drawing)> {
    let files = BTreeMap::from([(scene.inputs[0].file.clone(), parts.clone())]);
    let mut loaded = scene.load_in_parts(&BTreeMap::new(), &files, &|_| {})?;
    let drawing = loaded.drawing(&scene.picture)?;
    loaded.find_seen(&scene.framing()?, &drawing.settings)?;
    Ok((loaded, drawing))
}

/// Draws a scene as its parts come, until the picture is exact.
fn shown(scene: &Description, server: &mut Server) -> Result<Shown> {
    shown_on(&Device::Cpu, scene, server)
}

fn shown_on(device: &Device, scene: &Description, server: &mut Server) -> Result<Shown> {
    let parts = server.parts.clone();
    let (mut first, mut rough, mut most) = (None, 0, 0);
    for _ in 0..500 {
        parts.renew();
        parts.begin();
        let (loaded, drawing) = match read(scene, &parts) {
            Err(Error::Absent { .. }) => {
                server.answer(usize::MAX);
                continue;
            }
            read => read?,
        };
        if parts.lacks() && first.is_some() {
            server.answer(usize::MAX);
            continue;
        }
        let is_rough = parts.lacks();
        let camera = scene.framing()?.camera(&loaded.subject, drawing.free(0))?;
        let mut renderer = Renderer::new(device, &loaded.scene)?;
        for _ in 0..500 {
            let last = renderer.render(&camera, &drawing.settings)?.0;
            first.get_or_insert(server.sent);
            most = most.max(parts.held());
            if !parts.lacks() {
                let (all, first) = (server.sent, first.unwrap_or_default());
                return Ok(Shown { last, first, all, rough, most });
            }
            rough += 1;
            server.answer(1);
            if is_rough {
                break;
            }
            parts.begin();
        }
    }
    panic!("the picture never becomes exact");
}

/// The picture of the whole file.
fn whole(scene: &Description, bytes: &[u8]) -> Picture {
    whole_on(&Device::Cpu, scene, bytes)
}

fn whole_on(device: &Device, scene: &Description, bytes: &[u8]) -> Picture {
    let files = BTreeMap::from([(scene.inputs[0].file.clone(), bytes.to_vec())]);
    let mut loaded = scene.load_held(&files, &|_| {}).expect("a scene");
    let drawing = loaded.drawing(&scene.picture).expect("settings");
    let framing = scene.framing().expect("a framing");
    loaded.find_seen(&framing, &drawing.settings).expect("what is seen");
    let camera = framing.camera(&loaded.subject, drawing.free(0)).expect("a camera");
    let mut renderer = Renderer::new(device, &loaded.scene).expect("a renderer");
    renderer.render(&camera, &drawing.settings).expect("a picture").0
}

fn is_same(a: &Picture, b: &Picture) -> bool {
    let bits = |picture: &Picture| -> Vec<u32> {
        let color = picture.color.iter().flatten().map(|value| value.to_bits());
        color.chain(picture.depth.iter().map(|value| value.to_bits())).collect()
    };
    bits(a) == bits(b)
}

#[test]
fn parts_come_to_the_picture_of_the_whole_file() {
    let lit = r#", "light": "key""#;
    for ((name, bytes), most) in [(hierarchy(), 1 << 20), (volume(), 1 << 23)] {
        for more in ["", lit] {
            let told = comes_to_the_whole((name, &bytes), more, most);
            assert!(told.is_ok(), "{name}: {told:?}");
        }
    }
}

/// Compares the picture of a file in parts, of which at most `most` bytes are held, with that of
/// the whole file. An error says what is wrong.
fn comes_to_the_whole((name, bytes): (&str, &[u8]), more: &str, most: u64) -> Result<(), String> {
    let scene = scene(name, more);
    let mut server = Server::new(bytes, most);
    let shown = shown(&scene, &mut server).map_err(|error| error.to_string())?;
    let Shown { first, all, rough, most: held, .. } = shown;
    let told = format!("{first} of {all} of {} bytes, {rough} rough, {held} held", bytes.len());
    // The transfer function of a volume this small is made from all of its samples at once.
    let is_fine = rough >= 1 && first < all && first <= 1 << 20 && held <= most;
    match is_fine && is_same(&shown.last, &whole(&scene, bytes)) {
        true => Ok(()),
        false => Err(told),
    }
}

/// A GPU holds pages and bricks from picture to picture, and those that come later lie elsewhere.
#[test]
fn a_gpu_comes_to_the_picture_of_the_whole_file() {
    let gpu = Gpu::headless(&AdapterChoice::Automatic).expect("an adapter");
    let device = Device::Gpu(gpu, Budget::default());
    for ((name, bytes), most) in [(hierarchy(), 1 << 20), (volume(), 1 << 23)] {
        let scene = scene_of(name, [80, 60], "");
        let mut server = Server::new(&bytes, most);
        let shown = shown_on(&device, &scene, &mut server).expect("a picture");
        assert!(shown.rough >= 1 && shown.first < shown.all, "{name}");
        let whole = whole_on(&device, &scene, &bytes);
        let difference = compare_pictures(&shown.last, &whole).expect("one size");
        assert!(difference.psnr.is_none_or(|psnr| psnr > 80.0), "{name}: {difference:?}");
    }
}

#[test]
fn wrong_bytes_are_fetched_again_once() {
    for (name, bytes) in [hierarchy(), volume()] {
        let scene = scene(name, "");
        let mut server = Server::new(&bytes, 1 << 30);
        server.wrong = 1;
        let shown_once = shown(&scene, &mut server).expect("a picture");
        assert!(is_same(&shown_once.last, &whole(&scene, &bytes)), "{name}");
        assert_eq!(server.wrong, 0, "{name}: nothing was sent wrong");
        let mut server = Server::new(&bytes, 1 << 30);
        server.wrong = 9;
        let message = shown(&scene, &mut server).err().expect("damage").to_string();
        assert!(message.contains("also when it is fetched again"), "{message}");
        assert!(message.contains(name), "{message}");
    }
}

#[test]
fn other_files_are_refused() {
    let scene = scene("a.splk", "");
    let bytes = b"ply\nformat ascii 1.0\n".repeat(9);
    let server = Server::new(&bytes, 1 << 20);
    let error = read(&scene, &server.parts).err().expect("another file").to_string();
    assert!(error.contains("neither a hierarchy (.splk) nor a volume"), "{error}");
}
