//! A scene shows the same picture in any unit of length or value, and wherever the zero of its
//! values lies.

use crate::testing::{
    gpu::{gpu, own_gpu},
    psnr,
};
use glam::DVec3;
use splatkit::{
    gpu::{PreparedScene, Renderer},
    math::{Camera, Kernel, Projection},
    picture::Picture,
    reference,
    scattered::{Points, SampleOptions},
    scene::{Clip, ClipShape, Evaluate, Scene, Settings},
    splat::{Splat, Surfels, encode_normal},
    volume::{Isosurface, Lattice, Samples, Shade, TransferFunction, Volume},
};

/// World length of one usual unit of length, value of one usual unit of values, and the value that
/// stands for the usual 0.
#[derive(Debug, Clone, Copy)]
struct Units {
    length: f64,
    value: f64,
    zero: f64,
}

const USUAL: Units = Units { length: 1.0, value: 1.0, zero: 0.0 };

impl Units {
    fn to_value(self, value: f64) -> f64 {
        self.zero + self.value * value
    }

    /// A camera outside the scene, or inside.
    fn camera(self, projection: Projection, is_inside: bool) -> Camera {
        let position =
            if is_inside { DVec3::new(0.3, -0.2, 0.1) } else { DVec3::new(2.0, -3.0, 1.5) }
                * self.length;
        let projection = match projection {
            Projection::Orthographic { height } => {
                Projection::Orthographic { height: height * self.length }
            }
            other => other,
        };
        Camera {
            position,
            focal_point: DVec3::new(-0.1, 0.1, 0.0) * self.length,
            view_up: DVec3::Z,
            projection,
        }
    }

    fn transfer(self) -> TransferFunction {
        let point = |value: f64, opacity: f64| (self.to_value(value), opacity);
        let color = |value: f64, color: [f64; 3]| (self.to_value(value), color);
        let slope = |magnitude: f64, factor: f64| (magnitude * self.value / self.length, factor);
        TransferFunction {
            color: vec![color(20.0, [0.9, 0.3, 0.1]), color(180.0, [0.2, 0.5, 0.9])],
            opacity: vec![point(20.0, 0.0), point(90.0, 0.5), point(140.0, 0.1), point(200.0, 0.6)],
            unit: 0.2 * self.length,
            shade: Some(Shade::default()),
            gradient: vec![slope(20.0, 0.2), slope(200.0, 1.0)],
            isosurfaces: vec![Isosurface {
                value: self.to_value(150.0),
                color: [0.4, 0.9, 0.4],
                opacity: 0.5,
            }],
        }
    }

    fn lattice(self) -> Lattice {
        const SIDE: usize = 24;
        let step = 2.0 / (SIDE - 1) as f64 * self.length;
        Lattice {
            origin: DVec3::splat(-self.length),
            ..Lattice::with_spacing([SIDE; 3], DVec3::splat(step))
        }
    }

    /// Whole values from 0 to 255 of the usual unit, in this unit.
    fn samples(self) -> Vec<f64> {
        let lattice = USUAL.lattice();
        let value = |sample: usize| {
            let at = lattice.sample_position(sample);
            (255.0
                * (1.0 - at.length_squared() / 1.5).max(0.0)
                * (0.75 + 0.25 * (5.0 * at.x).sin()))
            .round()
        };
        (0..lattice.len()).map(|sample| self.to_value(value(sample))).collect()
    }

    fn volume(self, samples: Samples) -> Scene {
        let volume = Volume::new(self.lattice(), samples).expect("the samples fill the lattice");
        Scene::new().with_volume(volume, Kernel::default(), self.transfer())
    }

    /// The same field at scattered places.
    fn scattered(self) -> Scene {
        let lattice = self.lattice();
        let values = self.samples();
        let kept = (0..lattice.len()).filter(|sample| sample % 5 == 0);
        let (positions, values) =
            kept.map(|i| (lattice.sample_position(i).as_vec3(), values[i] as f32)).unzip();
        let points = Points { positions, values, ..Points::default() };
        let splats = points.to_splats(&SampleOptions::default()).expect("splats");
        Scene::new().with_samples(splats, self.transfer())
    }

    fn splats(self) -> Scene {
        let splats = (0..300u16).map(|i| {
            let angle = f64::from(i) * 2.4;
            let normal =
                DVec3::new(angle.cos(), angle.sin(), f64::from(i) / 150.0 - 1.0).normalize();
            let size = (0.08 * self.length) as f32;
            Splat {
                center: (normal * self.length).as_vec3().to_array(),
                strength: 3.0,
                factor: [size, 0.0, size, 0.0, 0.0, 0.5 * size],
                color: u32::from_le_bytes([i as u8, 200, 90, 255]),
                normal: encode_normal(normal.as_vec3()),
            }
        });
        Scene::new().with_splats(Surfels {
            origin: DVec3::ZERO,
            extent: 3.0,
            splats: splats.collect(),
        })
    }
}

const PERSPECTIVE: Projection = Projection::Perspective { view_angle: 40.0 };
const WIDE: Projection = Projection::Perspective { view_angle: 80.0 };
const ORTHOGRAPHIC: Projection = Projection::Orthographic { height: 2.6 };

fn drawn(scene: &Scene, camera: &Camera, settings: &Settings) -> Picture {
    let mut renderer = Renderer::new(gpu());
    let mut prepared = renderer.prepare(scene).expect("a scene");
    renderer.render(&mut prepared, camera, settings).expect("a picture").0
}

fn drawn_on_cpu(scene: &Scene, camera: &Camera, settings: &Settings) -> Picture {
    let mut renderer = splatkit::Renderer::new(&splatkit::Device::Cpu, scene).expect("a scene");
    renderer.render(camera, settings).expect("a picture").0
}

/// Peak signal-to-noise ratio of colour and opacity, in dB. Panics if picture `a` is nearly empty.
fn psnr(a: &Picture, b: &Picture) -> f64 {
    assert!(
        a.color.iter().filter(|color| color[3] > 0.1).count() > a.color.len() / 8,
        "an empty picture"
    );
    psnr::psnr(a, b)
}

fn settings() -> Settings {
    Settings::new([48, 40])
}

#[test]
fn values_of_any_unit_and_zero() {
    let camera = USUAL.camera(PERSPECTIVE, false);
    let floats = |units: Units| Samples::F32(units.samples().iter().map(|v| *v as f32).collect());
    let expected = drawn(&USUAL.volume(floats(USUAL)), &camera, &settings());
    for (value, zero) in [(1e25, 0.0), (1e-25, 0.0), (1.0, 1e6), (1.0, 1.6e7)] {
        let units = Units { value, zero, ..USUAL };
        let agreement = psnr(&expected, &drawn(&units.volume(floats(units)), &camera, &settings()));
        println!("values times {value:e}, from {zero:e} on: {agreement:.1} dB");
        assert!(agreement > 70.0, "{units:?}: {agreement:.1} dB");
    }
    // Values with more bits than a float holds.
    let units = Units { zero: 2e9 - 77.0, ..USUAL };
    let samples = Samples::I32(units.samples().iter().map(|v| *v as i32).collect());
    let agreement = psnr(&expected, &drawn(&units.volume(samples), &camera, &settings()));
    println!("whole values from 2e9 on: {agreement:.1} dB");
    // Rounding decides whether the middle of a sheet counts as bent.
    assert!(agreement > 60.0, "{agreement:.1} dB");
}

/// Neither engine has a limit on the values of scattered samples, nor on their slopes.
#[test]
fn scattered_values_of_any_unit() {
    let camera = USUAL.camera(PERSPECTIVE, false);
    let pictures = |units: Units| {
        let scene = units.scattered();
        [drawn(&scene, &camera, &settings()), drawn_on_cpu(&scene, &camera, &settings())]
    };
    let expected = pictures(USUAL);
    for (value, zero) in [(1e12, 0.0), (1e-12, 0.0), (1e25, 0.0), (1e-25, 0.0), (1.0, 1e5)] {
        let others = pictures(Units { value, zero, ..USUAL });
        for (engine, (expected, picture)) in ["GPU", "CPU"].iter().zip(expected.iter().zip(&others))
        {
            let agreement = psnr(expected, picture);
            println!("{engine}, values times {value:e}, from {zero:e} on: {agreement:.1} dB");
            assert!(agreement > 50.0, "{engine}, {value:e}, {zero:e}: {agreement:.1} dB");
        }
    }
}

/// The automatic function draws the same picture in any unit. Light is that of the noise, which has
/// the same unit.
#[test]
fn automatic_functions_in_any_unit() {
    let picture = |units: Units| {
        let values = units.samples().iter().map(|v| *v as f32).collect();
        let volume = Volume::new(units.lattice(), Samples::F32(values)).expect("a volume");
        let transfer = TransferFunction::automatic(&volume);
        let scene = Scene::new().with_volume(volume, Kernel::default(), transfer);
        drawn_on_cpu(&scene, &units.camera(PERSPECTIVE, false), &settings())
    };
    let expected = picture(USUAL);
    for (length, value, zero) in
        [(1e-6, 1.0, 0.0), (1e6, 1.0, 0.0), (1.0, 1e12, 0.0), (1.0, 1e-12, 0.0), (1e-3, 1.0, 1e5)]
    {
        let agreement = psnr(&expected, &picture(Units { length, value, zero }));
        println!("lengths times {length:e}, values times {value:e}, {zero:e}: {agreement:.1} dB");
        assert!(agreement > 45.0, "{length:e}, {value:e}, {zero:e}: {agreement:.1} dB");
    }
}

/// The cut face of a noisy ball has next to no grain with the light that the automatic function
/// gives, and much with light from every gradient.
#[test]
fn cut_faces_of_noise_have_no_grain() {
    let lattice = USUAL.lattice();
    // From 0 to 12 (SplitMix64: Steele, Lea & Flood 2014).
    let noise = |sample: usize| {
        let z = (sample as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        12.0 * ((z ^ (z >> 31)) >> 40) as f64 / f64::from(1u32 << 24)
    };
    let inside = |sample: usize| lattice.sample_position(sample).length() < 0.8;
    let value = |sample| (if inside(sample) { 200.0 } else { 20.0 } + noise(sample)) as u8;
    let volume = Volume::new(USUAL.lattice(), Samples::U8((0..lattice.len()).map(value).collect()))
        .expect("the samples fill the lattice");
    let automatic = TransferFunction::automatic(&volume);
    let shape = ClipShape::HalfSpace { normal: -DVec3::Y, offset: 0.1 };
    let settings = Settings { clips: vec![Clip { shape, inside: true }], ..settings() };
    let camera = Camera {
        position: DVec3::new(0.0, -4.0, 0.0),
        focal_point: DVec3::ZERO,
        view_up: DVec3::Z,
        projection: ORTHOGRAPHIC,
    };
    let grain = |certain: Option<[f64; 2]>| {
        let shade = automatic.shade.map(|shade| Shade { certain, ..shade });
        let transfer = TransferFunction { shade, ..automatic.clone() };
        let scene = Scene::new().with_volume(volume.clone(), Kernel::default(), transfer);
        let picture = drawn_on_cpu(&scene, &camera, &settings);
        let red = |row: usize, column: usize| f64::from(picture.color[row * 48 + column][0]);
        let beside = (15..25).flat_map(|row| (19..29).map(move |column| (row, column)));
        let steps = beside.map(|(row, column)| (red(row, column) - red(row, column + 1)).abs());
        steps.sum::<f64>() / 100.0
    };
    let (none, all) =
        (grain(automatic.shade.and_then(|shade| shade.certain)), grain(Some([0.0; 2])));
    println!("mean step between pixels: {none:.4}; with light from every gradient {all:.4}");
    assert!(none < 0.01 && all > 4.0 * none, "{none} {all}");
}

/// Constant surroundings have no slope that rounding could leave and light could show.
#[test]
fn flat_surroundings_are_flat() {
    let inside = |sample: usize| USUAL.lattice().sample_position(sample).length() < 0.6;
    let transfer = TransferFunction {
        color: vec![(0.0, [0.9, 0.5, 0.2]), (255.0, [0.3, 0.6, 0.9])],
        opacity: vec![(0.0, 0.03), (255.0, 0.5)],
        unit: 0.1,
        shade: Some(Shade::default()),
        ..TransferFunction::default()
    };
    let samples =
        (0..USUAL.lattice().len()).map(|sample| if inside(sample) { 255 } else { 0 }).collect();
    let volume =
        Volume::new(USUAL.lattice(), Samples::U8(samples)).expect("the samples fill the lattice");
    let scene = Scene::new().with_volume(volume, Kernel::default(), transfer);
    let camera = USUAL.camera(PERSPECTIVE, false);
    // Gathering cuts kernels off at a cube of four samples a side, not at the ball inside it. The
    // edge of this ball of samples is as hard as can be, so that costs 2 dB.
    for (evaluate, least) in [(Evaluate::Scatter, 40.0), (Evaluate::Gather, 38.0)] {
        let settings = Settings { evaluate, ..settings() };
        let expected = reference::render(&scene, &camera, &settings).expect("a picture");
        let agreement = psnr(&expected, &drawn(&scene, &camera, &settings));
        println!("flat surroundings, {evaluate:?}: {agreement:.1} dB");
        assert!(agreement > least, "{evaluate:?}: {agreement:.1} dB");
    }
}

#[test]
fn lengths_of_any_unit() {
    let floats = Samples::F32(USUAL.samples().iter().map(|v| *v as f32).collect());
    for (projection, is_inside) in [(PERSPECTIVE, false), (ORTHOGRAPHIC, false), (WIDE, true)] {
        let pictures = |units: Units| {
            let camera = units.camera(projection, is_inside);
            [units.volume(floats.clone()), units.splats()]
                .map(|scene| drawn(&scene, &camera, &settings()))
        };
        let expected = pictures(USUAL);
        for length in [1e-14, 1e-9, 1e9, 1e15] {
            let others = pictures(Units { length, ..USUAL });
            for (what, (picture, expected)) in
                ["volume", "splats"].iter().zip(others.iter().zip(&expected))
            {
                let agreement = psnr(expected, picture);
                println!("{projection:?}, lengths times {length:e}, {what}: {agreement:.1} dB");
                assert!(
                    agreement > 60.0,
                    "{projection:?}, lengths times {length:e}, {what}: {agreement:.1} dB"
                );
            }
        }
    }
}

/// From within a scene, everything in front of the eye is drawn in order, whatever `near` is.
/// Sheets may have any thickness.
#[test]
fn from_the_eye_on() {
    let camera = USUAL.camera(WIDE, true);
    let scene = USUAL.splats();
    let expected = drawn(&scene, &camera, &settings());
    for near in [0.0, 1e-30, 1e-4] {
        let agreement =
            psnr(&expected, &drawn(&scene, &camera, &Settings { near: Some(near), ..settings() }));
        println!("from {near:e} on: {agreement:.1} dB");
        assert!(agreement > 40.0, "from {near} on: {agreement:.1} dB");
    }
    let thick = |thickness: Option<f64>, pixels: f64| {
        let settings = Settings { sheet_thickness: thickness, sheet_pixels: pixels, ..settings() };
        drawn(&scene, &camera, &settings)
    };
    let expected = thick(None, 1e3);
    for (thickness, pixels) in [(None, 1e5), (None, 1e30), (Some(1e7), 1e30), (Some(1e30), 1e30)] {
        let agreement = psnr(&expected, &thick(thickness, pixels));
        println!("{thickness:?}, {pixels:e} pixels: {agreement:.1} dB");
        assert!(agreement > 20.0, "{thickness:?}, {pixels} pixels: {agreement:.1} dB");
    }
}

#[test]
fn a_scene_belongs_to_its_device() {
    let other = own_gpu();
    let mut prepared: PreparedScene =
        Renderer::new(&other).prepare(&USUAL.splats()).expect("a scene");
    let result =
        Renderer::new(gpu()).render(&mut prepared, &USUAL.camera(PERSPECTIVE, false), &settings());
    let message = result.expect_err("another device").to_string();
    assert!(message.contains("prepared on another device"), "{message}");
}

#[test]
fn transfer_functions_are_checked_when_they_change() {
    let floats = Samples::F32(USUAL.samples().iter().map(|v| *v as f32).collect());
    let mut prepared = Renderer::new(gpu()).prepare(&USUAL.volume(floats)).expect("a scene");
    let narrow = TransferFunction {
        opacity: vec![(10.0, 0.0), (10.0 + 1e-9, 0.5)],
        color: vec![(10.0, [1.0; 3])],
        ..USUAL.transfer()
    };
    let message = prepared.set_transfer(0, &narrow).expect_err("too narrow").to_string();
    assert!(message.contains("too close together"), "{message}");
    prepared.set_transfer(0, &USUAL.transfer()).expect("as before");
}
