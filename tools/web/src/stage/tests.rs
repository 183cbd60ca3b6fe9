//! A stage without a browser.

use super::*;
use splatkit::{
    compare::compare_pictures,
    gpu::{AdapterChoice, Budget, Gpu},
    wgpu,
};
use std::path::PathBuf;

mod parts;

const SIZE: [u32; 2] = [96, 72];

/// A ball of points that fills most of the picture.
fn stage() -> (Stage, Description, BTreeMap<PathBuf, Vec<u8>>) {
    stage_on(&Device::Cpu)
}

fn stage_on(device: &Device) -> (Stage, Description, BTreeMap<PathBuf, Vec<u8>>) {
    let mut points = String::new();
    for number in 0..600 {
        let (turn, height) =
            (f64::from(number) * 2.4, 1.0 - (2.0 * f64::from(number) + 1.0) / 600.0);
        let ring = (1.0 - height * height).sqrt();
        points += &format!("{} {} {height}\n", ring * turn.cos(), ring * turn.sin());
    }
    let text = r#"{"splatkit_scene": 2, "inputs": [{"file": "ball.xyz"}], "picture":
        {"size": [9, 9], "views": ["front", "left"], "samples": 1, "background": "white"}}"#;
    let files = BTreeMap::from([("ball.xyz".into(), points.into_bytes())]);
    let stage = Stage::open(text, held(&files), SIZE, device).expect("a scene");
    let mut scene = Description::parse(text).expect("a scene");
    scene.picture.views.clear();
    scene.picture.size = Some(SIZE);
    (stage, scene, files)
}

fn held(files: &BTreeMap<PathBuf, Vec<u8>>) -> Files {
    let mut held = Files::default();
    files.iter().for_each(|(name, bytes)| held.add(name, bytes.clone()));
    held
}

/// Draws until nothing is left to do. Returns how often there was a new frame.
fn rest(stage: &mut Stage) -> usize {
    rest_on(stage, || panic!("the processor draws at once"))
}

/// The same for a GPU, which `wait` waits for.
fn rest_on(stage: &mut Stage, wait: impl Fn()) -> usize {
    let mut frames = 0;
    loop {
        match stage.step().expect("a step") {
            Step::Rests => return frames,
            Step::Shows => frames += 1,
            Step::Waits(milliseconds) => {
                assert!(milliseconds > 0.0 && milliseconds <= 70.0, "{milliseconds}");
                std::thread::sleep(Duration::from_secs_f64(milliseconds / 1e3));
            }
            Step::Works => {}
            Step::Draws => wait(),
            Step::Lacks => panic!("nothing comes in parts"),
            Step::Lent => panic!("nobody helps"),
        }
    }
}

#[test]
fn a_resting_stage_shows_the_picture_of_a_description() {
    let (mut stage, scene, files) = stage();
    assert!(rest(&mut stage) >= 2, "coarse before exact");
    let frame = stage.frame().expect("a frame");
    assert!(frame.is_exact);
    let mut loaded = scene.load_held(&files, &|_| {}).expect("a scene");
    let (picture, _) = loaded.draw(&scene, &Device::Cpu).expect("a picture");
    let difference = compare_pictures(&frame.picture, &picture).expect("one size");
    assert!(difference.psnr.is_none_or(|psnr| psnr > 70.0), "{difference:?}");
    let pixels = stage.pixels();
    assert_eq!(pixels.len() as u32, 4 * SIZE[0] * SIZE[1]);
    assert_eq!(pixels[..4], [255; 4]);
}

#[test]
fn a_hand_changes_the_picture_and_comes_back() {
    let (mut stage, ..) = stage();
    rest(&mut stage);
    let (camera, before) = (stage.camera(), stage.pixels());
    stage.turn(DVec2::new(20.0, 5.0));
    assert!(rest(&mut stage) >= 1 && stage.camera() != camera);
    assert_ne!(stage.pixels(), before);
    let middle = DVec2::new(48.0, 36.0);
    let point = stage.point_at(middle).expect("the ball is under the cursor");
    assert!((point.length() - 1.0).abs() < 0.2, "{point}");
    stage.grab(middle);
    stage.zoom(1.5, middle);
    stage.pan(DVec2::new(3.0, 2.0));
    stage.fly(DVec3::new(0.1, 0.0, 0.1));
    stage.switch_perspective();
    assert!(stage.camera().height.is_some());
    stage.set_camera(&camera).expect("a camera");
    rest(&mut stage);
    assert!(stage.pixels() == before, "the same camera shows another picture");
    stage.resize([50, 40]).expect("a size");
    rest(&mut stage);
    assert_eq!(stage.pixels().len(), 4 * 50 * 40);
}

#[test]
fn what_cannot_be_is_an_error_and_changes_nothing() {
    let (mut stage, ..) = stage();
    rest(&mut stage);
    let before = stage.pixels();
    let nothing = serde_json::json!([{"side": {"axis": "x", "below": true, "at": -9}}]);
    let clips: Vec<ClipEntry> = serde_json::from_value(nothing).expect("a clip");
    assert!(matches!(stage.set_clips(clips), Err(Error::NothingToDraw(_))));
    let error = stage.set_transfer(0, &TransferFunction::default()).expect_err("no field");
    assert!(error.to_string().contains("the scene has 0"), "{error}");
    rest(&mut stage);
    assert!(stage.pixels() == before);
    let missing = Stage::open(
        r#"{"splatkit_scene": 2, "inputs": [{"file": "b.xyz"}]}"#,
        held(&BTreeMap::from([("a.xyz".into(), b"0 0 0\n".to_vec())])),
        SIZE,
        &Device::Cpu,
    );
    let error = missing.err().expect("a file that is not there").to_string();
    assert!(error.contains("b.xyz: file: is not among the files in memory"), "{error}");
}

/// Sheets of a label map are never thick, so its coarse frames have wide pixels alone.
#[test]
fn a_label_map_moves() {
    let text = r#"{"splatkit_scene": 2, "inputs": [{"file": "a.seg.nrrd"}]}"#;
    let header = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 8 8 8\nencoding: raw\n";
    let segments = "Segment0_ID:=one\nSegment0_LabelValue:=1\nSegment0_Name:=one\n\
                    Segment1_ID:=two\nSegment1_LabelValue:=2\nSegment1_Name:=two\n\n";
    let mut labels = format!("{header}{segments}").into_bytes();
    labels.extend((0..512u32).map(|at| (at % 8 / 4 + 1) as u8));
    let files = BTreeMap::from([("a.seg.nrrd".into(), labels)]);
    let mut stage = Stage::open(text, held(&files), SIZE, &Device::Cpu).expect("a label map");
    assert!(rest(&mut stage) >= 1);
    stage.turn(DVec2::new(9.0, 0.0));
    assert!(rest(&mut stage) >= 1 && stage.frame().is_some_and(|frame| frame.is_exact));
}

fn software() -> Gpu {
    Gpu::headless(&AdapterChoice::Automatic).expect("an adapter")
}

fn wait_for(gpu: &Gpu) {
    gpu.device.poll(wgpu::PollType::wait_indefinitely()).ok();
}

#[test]
fn a_gpu_draws_the_picture_of_a_description() {
    let gpu = software();
    let device = Device::Gpu(gpu.clone(), Budget::default());
    let (mut stage, scene, files) = stage_on(&device);
    let wait = || wait_for(&gpu);
    assert!(stage.is_gpu() && rest_on(&mut stage, wait) >= 2, "coarse before exact");
    assert!(stage.frame().is_some_and(|frame| frame.is_exact));
    let mut loaded = scene.load_held(&files, &|_| {}).expect("a scene");
    let (picture, _) = loaded.draw(&scene, &device).expect("a picture");
    let before = stage.frame().expect("a frame").picture.color.clone();
    assert!(before == picture.color, "the same engine draws the same");
    // A view that moves while the GPU draws: the exact frame of the old one is given up.
    let camera = stage.camera();
    stage.turn(DVec2::new(20.0, 5.0));
    for _ in 0..200 {
        if stage.step().expect("a step") == Step::Draws {
            stage.turn(DVec2::new(1.0, 0.0));
            wait();
        }
    }
    stage.set_camera(&camera).expect("a camera");
    rest_on(&mut stage, wait);
    assert!(stage.frame().expect("a frame").picture.color == before);
    assert!(stage.is_gpu() && stage.refusal().is_none());
}

#[test]
fn the_processor_goes_on_after_a_gpu_that_is_lost() {
    for while_drawing in [false, true] {
        let gpu = software();
        let (mut stage, ..) = stage_on(&Device::Gpu(gpu.clone(), Budget::default()));
        let wait = || wait_for(&gpu);
        if while_drawing {
            assert_eq!(stage.step().expect("a step"), Step::Draws);
        } else {
            rest_on(&mut stage, wait);
            stage.turn(DVec2::new(0.0, 0.0));
        }
        gpu.device.destroy();
        rest_on(&mut stage, wait);
        assert!(!stage.is_gpu() && stage.frame().is_some_and(|frame| frame.is_exact));
        assert!(stage.refusal().is_some());
        let (mut other, ..) = self::stage();
        rest(&mut other);
        assert!(stage.pixels() == other.pixels());
    }
}

#[test]
fn a_gpu_that_refuses_a_scene_leaves_it_to_the_processor() {
    let text = r#"{"splatkit_scene": 2, "inputs": [{"file": "a.nrrd"}],
        "appearance": {"kernel": "linear"}}"#;
    let header = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 8 8 8\nencoding: raw\n\n";
    let mut samples = header.to_owned().into_bytes();
    samples.extend((0..512u32).map(|at| (at % 8 * 30) as u8));
    let files = BTreeMap::from([("a.nrrd".into(), samples)]);
    let device = Device::Gpu(software(), Budget::default());
    let mut stage = Stage::open(text, held(&files), SIZE, &device).expect("a volume");
    assert!(!stage.is_gpu());
    assert!(stage.refusal().is_some_and(|why| why.contains("linear")), "{:?}", stage.refusal());
    assert!(rest(&mut stage) >= 1);
}

/// Draws until nothing is left to do, with a stage that helps. Returns the steps that waited.
fn rest_helped(stage: &mut Stage, helper: &mut Stage, mut fails: impl FnMut() -> bool) -> usize {
    let (mut waited, mut lent) = (0, None);
    for _ in 0..500 {
        let step = stage.step().expect("a step");
        lent = lent.or_else(|| stage.lend());
        let is_lent = step == Step::Lent;
        if let (true, Some(job)) = (is_lent, lent.take_if(|_| is_lent)) {
            waited += 1;
            let asked: serde_json::Value = serde_json::from_str(&job).expect("JSON");
            let [frame, band] = ["frame", "band"].map(|name| asked[name].as_u64().expect("one"));
            if fails() {
                stage.take_back(frame, band as usize);
                stage.set_helpers(0);
            } else {
                let drawn = helper.help(&job).expect("a band");
                stage.give_back(frame, band as usize, &drawn).expect("its numbers");
            }
        }
        match step {
            Step::Rests => return waited,
            Step::Waits(time) => std::thread::sleep(Duration::from_secs_f64(time / 1e3)),
            _ => {}
        }
    }
    panic!("the helper is waited for in vain");
}

#[test]
fn helpers_draw_the_same_pictures() {
    let ((mut alone, ..), (mut stage, ..), (mut helper, ..)) = (stage(), stage(), stage());
    stage.set_helpers(1);
    for turn in [0.0, 7.0] {
        let size = [96, 200];
        alone.resize(size).expect("a size");
        stage.resize(size).expect("a size");
        let clip = serde_json::json!([{"side": {"axis": "x", "below": true, "at": turn / 9.0}}]);
        let clips: Vec<ClipEntry> = serde_json::from_value(clip).expect("a clip");
        alone.set_clips(clips.clone()).expect("a clip");
        stage.set_clips(clips).expect("a clip");
        alone.turn(DVec2::new(turn, 3.0));
        stage.turn(DVec2::new(turn, 3.0));
        rest(&mut alone);
        assert!(rest_helped(&mut stage, &mut helper, || false) >= 2, "bands of several frames");
        assert!(stage.frame().is_some_and(|frame| frame.is_exact));
        let pictures = [&alone, &stage].map(|stage| &stage.frame().expect("a frame").picture);
        assert!(pictures[0].color == pictures[1].color && pictures[0].depth == pictures[1].depth);
    }
    // A helper that fails: the stage draws its band.
    stage.turn(DVec2::ZERO);
    assert_eq!(rest_helped(&mut stage, &mut helper, || true), 1);
    assert!(stage.pixels() == alone.pixels());
    // What is no band, or that of a frame that was given up.
    assert!(helper.help("{}").is_err() && helper.help("").is_err());
    stage.set_helpers(1);
    stage.turn(DVec2::ZERO);
    assert_eq!(stage.step().expect("a step"), Step::Works);
    let job = stage.lend().expect("a band of a moving frame");
    let asked: serde_json::Value = serde_json::from_str(&job).expect("JSON");
    let frame = asked["frame"].as_u64().expect("a number");
    assert!(stage.give_back(frame, 1, &[0.0; 5]).is_err());
    assert!(stage.give_back(frame - 1, 1, &[0.0; 5]).is_ok(), "it is not asked for any more");
}

/// A transfer function changes while a helper draws.
#[test]
fn helpers_follow_transfer_functions() {
    let text = r#"{"splatkit_scene": 2, "inputs": [{"file": "a.nrrd"}]}"#;
    let header = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 8 8 8\nencoding: raw\n\n";
    let mut samples = header.to_owned().into_bytes();
    samples.extend((0..512u32).map(|at| (at % 8 * 30) as u8));
    let files = BTreeMap::from([("a.nrrd".into(), samples)]);
    let open = || Stage::open(text, held(&files), SIZE, &Device::Cpu).expect("a volume");
    let [mut alone, mut stage, mut helper] = [open(), open(), open()];
    let transfer = TransferFunction {
        color: vec![(0.0, [1.0, 0.3, 0.1])],
        opacity: vec![(0.0, 0.0), (0.1 + 200.0, 1.0 / 3.0)],
        ..TransferFunction::default()
    };
    stage.set_helpers(1);
    rest_helped(&mut stage, &mut helper, || false);
    let before = stage.pixels();
    stage.turn(DVec2::new(1.0, 0.0));
    assert_eq!(stage.step().expect("a step"), Step::Works);
    let job = stage.lend().expect("a band");
    stage.set_transfer(0, &transfer).expect("a field");
    alone.turn(DVec2::new(1.0, 0.0));
    alone.set_transfer(0, &transfer).expect("a field");
    rest(&mut alone);
    rest_helped(&mut stage, &mut helper, || false);
    assert!(stage.pixels() == alone.pixels() && stage.pixels() != before);
    let drawn = helper.help(&job).expect("a band of before");
    stage.give_back(1, 1, &drawn).expect("nothing asks for it");
    assert!(stage.pixels() == alone.pixels());
}
