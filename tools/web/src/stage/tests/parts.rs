//! A GPU draws files in parts while they come.

use super::*;
use splatkit::{
    bricks,
    hierarchy::{BuildOptions, Tree, file},
    input::Parts,
    splat::{NO_NORMAL, Splat, Surfels},
    volume::{Lattice, Samples, Volume},
};

/// The bytes of the first request.
const FIRST: usize = 1 << 18;

/// A ball of splats, too many for one page.
fn hierarchy() -> (&'static str, Vec<u8>) {
    let count = 60_000u32;
    let splat = |number: u32| {
        let (turn, height) = (number as f32 * 2.4, 1.0 - (2 * number + 1) as f32 / count as f32);
        let ring = (1.0 - height * height).sqrt();
        let size = 0.006 + 0.001 * (number * 7919 % 13) as f32;
        Splat {
            center: [ring * turn.cos(), ring * turn.sin(), height],
            strength: 2.0,
            factor: [size, 0.0, size, 0.0, 0.0, size],
            color: 0xff00_0000 | number.wrapping_mul(2_654_435_761) >> 8,
            normal: NO_NORMAL,
        }
    };
    let splats = (0..count).map(splat).collect();
    let set = Surfels { origin: DVec3::ZERO, splats, extent: 3.0 };
    let tree = Tree::build(&set, &BuildOptions::default(), None).expect("a tree");
    ("a.splk", file::to_bytes(&tree, &file::WriteOptions::default()).expect("a file"))
}

/// A ball of noise, which cannot be packed.
fn volume() -> (&'static str, Vec<u8>) {
    const SIDE: usize = 72;
    let sample = |at: usize| {
        let place = [at % SIDE, at / SIDE % SIDE, at / SIDE / SIDE];
        let far: f64 = place.iter().map(|at| (*at as f64 / SIDE as f64 - 0.5).powi(2)).sum();
        let noise = (at as u32 ^ 0x9e37).wrapping_mul(0x2c1b_3c6d) >> 27;
        (250.0 * (1.0 - 2.0 * far.sqrt()).max(0.0)) as u8 ^ noise as u8
    };
    let samples = Samples::U8((0..SIDE.pow(3)).map(sample).collect());
    let lattice = Lattice::with_spacing([SIDE; 3], DVec3::ONE);
    let volume = Volume::new(lattice, samples).expect("a volume");
    let name = format!("splatkit-parts-{}.splv", std::process::id());
    let path = std::env::temp_dir().join(name);
    bricks::write(&volume, &path, &bricks::WriteOptions::default(), None).expect("a file");
    let bytes = std::fs::read(&path).expect("a file");
    std::fs::remove_file(path).expect("a file");
    ("a.splv", bytes)
}

fn text(name: &str) -> String {
    format!(r#"{{"splatkit_scene": 2, "inputs": [{{"file": "{name}"}}]}}"#)
}

/// Returns the exact frame of a file in parts, and the frames before it.
fn in_parts(gpu: &Gpu, name: &str, bytes: &[u8]) -> (Picture, usize) {
    let device = Device::Gpu(gpu.clone(), Budget::default());
    let mut files = Files::default();
    files.add_parts(name, Parts::new(bytes.len() as u64, 1 << 28));
    files.arrive(0, 0, &bytes[..FIRST.min(bytes.len())]).expect("blocks");
    let part = |(_, range): &Request| &bytes[range.start as usize..range.end as usize];
    let mut stage = loop {
        match Stage::open(&text(name), files.clone(), SIZE, &device) {
            Ok(stage) => break stage,
            Err(error) => {
                let requests = files.requests();
                assert!(!requests.is_empty(), "{error}");
                let mut all = requests.iter();
                all.try_for_each(|one| files.arrive(0, one.1.start, part(one))).expect("blocks");
            }
        }
    };
    let mut frames = 0;
    for _ in 0..500 {
        match stage.step().expect("a step") {
            Step::Rests => {
                assert!(stage.is_gpu(), "{:?}", stage.refusal());
                let frame = stage.frame().expect("a frame");
                assert!(frame.is_exact && files.requests().is_empty());
                return (frame.picture.clone(), frames);
            }
            Step::Shows => {
                frames += 1;
                let lacks = !files.requests().is_empty();
                assert!(!lacks || stage.frame().is_some_and(|frame| !frame.is_exact));
            }
            Step::Lacks => {
                let one = stage.requests().into_iter().next().expect("a request");
                stage.arrive(0, one.1.start, part(&one)).expect("blocks");
            }
            Step::Waits(time) => std::thread::sleep(Duration::from_secs_f64(time / 1e3)),
            Step::Draws => wait_for(gpu),
            Step::Works | Step::Lent => {}
        }
    }
    panic!("the picture never becomes exact");
}

#[test]
fn a_gpu_comes_to_the_picture_of_the_whole_file() {
    let gpu = software();
    for (name, bytes) in [hierarchy(), volume()] {
        assert!(bytes.len() > FIRST, "{name}: {}", bytes.len());
        let (picture, frames) = in_parts(&gpu, name, &bytes);
        let files = held(&BTreeMap::from([(name.into(), bytes)]));
        let device = Device::Gpu(gpu.clone(), Budget::default());
        let mut stage = Stage::open(&text(name), files, SIZE, &device).expect("a scene");
        let fewest = rest_on(&mut stage, || wait_for(&gpu));
        assert!(frames > fewest, "{name}: {frames} frames, {fewest} of the whole file");
        let whole = &stage.frame().expect("a frame").picture;
        let difference = compare_pictures(&picture, whole).expect("one size");
        assert!(difference.psnr.is_none_or(|psnr| psnr > 80.0), "{name}: {difference:?}");
    }
}

/// A machine with next to no memory shows a view coarser, and does not call it exact.
#[test]
fn views_without_room_are_not_exact() {
    let (name, bytes) = hierarchy();
    let mut files = held(&BTreeMap::from([(name.into(), bytes)]));
    let mut stages = [false, true].map(|is_small| {
        if is_small {
            files.set_machine(1e-3);
        }
        Stage::open(&text(name), files.clone(), [400, 300], &Device::Cpu).expect("a scene")
    });
    stages.iter_mut().for_each(|stage| assert!(rest(stage) > 0));
    let said = stages.map(|stage| (stage.is_full(), stage.frame().map(|frame| frame.is_exact)));
    assert_eq!(said, [(false, Some(true)), (true, Some(false))]);
}
