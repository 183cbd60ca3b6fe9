//! Label maps, drawn by both engines and the reference, and beside other items: each sample's label
//! is visible, and nothing has a colour between two labels.

use crate::testing::{gpu::gpu, psnr::measured};
use glam::{DMat3, DVec3};
use splatkit::{
    Device, Renderer,
    gpu::Budget,
    math::{Camera, Kernel, Projection},
    picture::Picture,
    reference,
    scene::{Clip, ClipShape, Evaluate, Gradient, Mode, Optics, Scene, Settings},
    surface::{Mesh, SurfelOptions},
    volume::{Isosurface, Lattice, Samples, TransferFunction, Volume},
};

const SIDE: usize = 20;
const SIZE: [u32; 2] = [72, 64];
const LABELS: [u16; 4] = [3, 17, 1003, 40_000];

/// Labels of any distance: a ball, two balls that touch it, and one sample alone.
fn labels() -> Volume {
    let lattice = Lattice::cartesian(
        [SIDE; 3],
        DVec3::new(3.0, -2.0, 7.0),
        DMat3::from_diagonal(DVec3::new(0.5, 0.5, 0.6)),
    );
    let value = |i: usize| {
        let [x, y, z] = lattice.index(i);
        let at = |center: [f64; 3]| {
            DVec3::new(x as f64, y as f64, z as f64).distance(DVec3::from(center))
        };
        match () {
            () if [x, y, z] == [17, 3, 16] => 40_000,
            () if at([5.0, 5.0, 13.0]) < 4.0 => 17,
            () if at([14.0, 6.0, 6.0]) < 4.5 => 1003,
            () if at([9.5, 11.0, 9.0]) < 6.0 => 3,
            () => 0,
        }
    };
    let values = (0..lattice.len()).map(value).collect();
    let volume = Volume::new(lattice, Samples::U16(values)).expect("a volume");
    volume.with_labels(Vec::new())
}

fn camera(projection: Projection) -> Camera {
    let middle = DVec3::new(7.75, 2.75, 12.7);
    Camera {
        position: middle + DVec3::new(-3.0, -22.0, 5.0),
        focal_point: middle,
        view_up: DVec3::Z,
        projection,
    }
}

fn settings() -> Settings {
    Settings::new(SIZE)
}

fn scene(transfer: Option<TransferFunction>) -> Scene {
    let volume = labels();
    let transfer = transfer.unwrap_or_else(|| TransferFunction::automatic(&volume));
    Scene::new().with_volume(volume, Kernel::default(), transfer)
}

/// The engines, by their names.
fn engines() -> [(&'static str, Device); 2] {
    [("CPU", Device::Cpu), ("GPU", Device::Gpu(gpu().clone(), Budget::default()))]
}

fn draw(device: &Device, scene: &Scene, camera: &Camera, settings: &Settings) -> Picture {
    let mut renderer = Renderer::new(device, scene).expect("a scene");
    renderer.render(camera, settings).expect("a picture").0
}

/// Draws a scene by both engines, which must agree with the reference. Single pixels at the border
/// of two labels may differ by rounding.
fn compare(name: &str, scene: &Scene, camera: &Camera, settings: &Settings) {
    let truth = reference::render(scene, camera, settings).expect("a reference");
    assert!(truth.color.iter().any(|pixel| pixel[3] > 0.3), "an empty picture");
    for (engine, device) in engines() {
        let near = measured(&draw(&device, scene, camera, settings), &truth);
        println!("{name}, {engine}: {near:.1} dB");
        assert!(near > 35.0, "{name}, {engine}: {near} dB");
    }
}

/// The labels whose colours a picture without light shows. Nothing else may be opaque in it.
fn visible_labels(picture: &Picture, transfer: &TransferFunction) -> Vec<u16> {
    let mut labels = Vec::new();
    for &[red, green, blue, opacity] in picture.color.iter().filter(|pixel| pixel[3] > 0.95) {
        let color = [red, green, blue].map(|channel| f64::from(channel / opacity));
        let is_of = |label: &u16| {
            let expected = transfer.color(f64::from(*label));
            expected.iter().zip(color).all(|(expected, channel)| (expected - channel).abs() < 0.02)
        };
        let label = LABELS.into_iter().find(is_of);
        let label = label.unwrap_or_else(|| panic!("{color:?} is no label's colour"));
        if !labels.contains(&label) {
            labels.push(label);
        }
    }
    labels.sort_unstable();
    labels
}

#[test]
fn label_maps_are_those_of_the_reference() {
    let shape = ClipShape::HalfSpace { normal: DVec3::NEG_Y, offset: -2.7 };
    let half = Clip { shape, inside: true };
    let wide = Projection::Perspective { view_angle: 30.0 };
    for (name, camera, settings) in [
        ("perspective", camera(wide), settings()),
        ("parallel", camera(Projection::Orthographic { height: 12.0 }), settings()),
        ("cut", camera(wide), Settings { clips: vec![half], ..settings() }),
        ("maximum", camera(wide), Settings { optics: Optics::Maximum, ..settings() }),
        ("x-ray", camera(wide), Settings { optics: Optics::XRay, ..settings() }),
    ] {
        compare(name, &scene(None), &camera, &settings);
    }
}

#[test]
fn each_label_is_seen_and_nothing_between() {
    let camera = camera(Projection::Perspective { view_angle: 30.0 });
    let settings = Settings { size: [360, 320], volume_shade: Some(None), ..settings() };
    let transfer = TransferFunction::automatic(&labels());
    // An isosurface shows the label of its value alone.
    let surface = Isosurface { value: 1003.0, color: transfer.color(1003.0), opacity: 1.0 };
    let iso = TransferFunction { isosurfaces: vec![surface], ..TransferFunction::default() };
    for (_, device) in engines() {
        let picture = draw(&device, &scene(None), &camera, &settings);
        assert_eq!(visible_labels(&picture, &transfer), LABELS);
        let picture = draw(&device, &scene(Some(iso.clone())), &camera, &settings);
        assert_eq!(visible_labels(&picture, &transfer), [1003]);
    }
}

/// All samples of all labels are framed, also the one far away.
#[test]
fn each_sample_is_framed() {
    let volume = labels();
    let bounds = volume.bounds();
    let seen = scene(None).seen(&[]).expect("points");
    let around = |point: DVec3| seen.iter().any(|seen| seen.distance(point) < 0.31);
    let lone = volume.lattice.sample_position((16 * SIDE + 3) * SIDE + 17);
    assert!(around(lone + DVec3::X * 0.25), "{lone} is not framed");
    assert!(
        seen.iter().all(|seen| seen.z < bounds.max.z - 0.5 && seen.z > bounds.min.z),
        "air is framed"
    );
}

#[test]
fn label_maps_are_drawn_beside_volumes() {
    let lattice = Lattice::cartesian(
        [10; 3],
        DVec3::new(3.0, -2.0, 7.0),
        DMat3::from_diagonal(DVec3::splat(1.0)),
    );
    let values = (0..lattice.len()).map(|i| (i * 37 % 101) as u8).collect();
    let volume = Volume::new(lattice, Samples::U8(values)).expect("a volume");
    let haze = TransferFunction {
        color: vec![(0.0, [0.2, 0.3, 0.9]), (100.0, [0.9, 0.9, 0.2])],
        opacity: vec![(0.0, 0.0), (100.0, 0.15)],
        ..TransferFunction::default()
    };
    let both = scene(None).with_volume(volume, Kernel::default(), haze);
    let camera = camera(Projection::Perspective { view_angle: 30.0 });
    let near = measured(
        &draw(&Device::Cpu, &both, &camera, &settings()),
        &reference::render(&both, &camera, &settings()).expect("a reference"),
    );
    assert!(near > 35.0, "{near} dB");
    assert_eq!(both.beyond_gpu().as_deref(), Some("a label map beside another field"));
}

/// Labels of every type of samples, among surfaces.
#[test]
fn label_maps_are_drawn_among_surfaces() {
    let mut ball = Mesh { origin: DVec3::new(6.0, 0.0, 12.0), ..Mesh::sphere(3) };
    ball.positions.iter_mut().for_each(|position| *position *= 1.5);
    let ball = ball.surfels(&SurfelOptions::default()).expect("surfels");
    let camera = camera(Projection::Perspective { view_angle: 30.0 });
    let few = labels();
    let value = |i: usize| {
        let label = few.value(i);
        LABELS.iter().position(|other| f64::from(*other) == label).map_or(0, |at| at + 1)
    };
    let values: Vec<usize> = (0..few.lattice.len()).map(value).collect();
    for samples in [
        Samples::U8(values.iter().map(|&value| value as u8).collect()),
        Samples::I16(values.iter().map(|&value| -(value as i16)).collect()),
        Samples::I32(values.iter().map(|&value| 2_000_000_000 + value as i32).collect()),
        Samples::F32(values.iter().map(|&value| value as f32).collect()),
    ] {
        let name = format!("{:?}", samples.scalar());
        let volume = Volume::new(few.lattice.clone(), samples).expect("a volume");
        let volume = volume.with_labels(Vec::new());
        let transfer = TransferFunction::automatic(&volume);
        let scene = Scene::new().with_splats(ball.clone());
        let scene = scene.with_volume(volume, Kernel::default(), transfer);
        compare(&name, &scene, &camera, &settings());
    }
}

/// Methods that mix samples before they are classified are refused.
#[test]
fn methods_that_mix_labels_are_refused() {
    let camera = camera(Projection::Perspective { view_angle: 30.0 });
    for settings in [
        Settings { mode: Mode::AxisSheets, ..settings() },
        Settings { evaluate: Evaluate::Scatter, ..settings() },
        Settings { gradient: Gradient::Central, ..settings() },
        Settings { sheet_thickness: Some(3.0), ..settings() },
    ] {
        for (engine, device) in engines() {
            let mut renderer = Renderer::new(&device, &scene(None)).expect("a scene");
            let error = renderer.render(&camera, &settings).unwrap_err().to_string();
            assert!(error.contains("label map"), "{engine}: {error}");
        }
    }
    assert_eq!(scene(None).beyond_gpu(), None);
}
