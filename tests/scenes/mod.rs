//! Small scenes of every kind, to compare renderers with each other. They are the same in every
//! run, and the reference draws each in about a second.

pub mod facets;
#[allow(dead_code, reason = "the GPU engine draws one field")]
pub mod fields;
pub mod gaussians;
pub mod methods;

use glam::{DMat3, DVec3, Vec3};
use splatkit::{
    math::{Camera, Kernel, Projection},
    scene::{Gradient, Scene, Settings},
    splat::{NO_NORMAL, SampleSplats, Splat, Surfels, encode_normal},
    volume::{Lattice, Samples, Shade, TransferFunction, Volume},
};

/// A scene, its camera and its settings.
pub struct Case {
    pub name: &'static str,
    pub scene: Scene,
    pub camera: Camera,
    pub settings: Settings,
}

/// Numbers that look random and are the same in every run (SplitMix64: Steele, Lea & Flood 2014).
struct Random(u64);

impl Random {
    /// Evenly distributed in `low` … `high`.
    fn within(&mut self, low: f32, high: f32) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        low + (high - low) * ((z >> 40) as f32 / (1 << 24) as f32)
    }

    fn point(&mut self, reach: f32) -> Vec3 {
        Vec3::from_array(std::array::from_fn(|_| self.within(-reach, reach)))
    }

    fn color(&mut self) -> u32 {
        let [red, green, blue] = std::array::from_fn(|_| self.within(30.0, 255.0) as u8);
        u32::from_le_bytes([red, green, blue, 255])
    }

    /// A skewed ellipsoid of about `size`, with a colour and a normal.
    fn ellipsoid(&mut self, center: Vec3, size: f32) -> Splat {
        let mut side = || size * self.within(0.4, 1.2);
        let [b00, b11, b22] = [side(), side(), side()];
        let mut lean = || size * self.within(-0.5, 0.5);
        let [b10, b20, b21] = [lean(), lean(), lean()];
        Splat {
            center: center.to_array(),
            strength: self.within(0.5, 6.0),
            factor: [b00, b10, b11, b20, b21, b22],
            color: self.color(),
            normal: encode_normal(self.point(1.0)),
        }
    }
}

/// Splats around `ORIGIN`, away from the origin of the world. Their coordinates are relative to
/// it.
fn surfels(splats: Vec<Splat>) -> Surfels {
    Surfels { origin: ORIGIN, splats, extent: 3.0 }
}

pub const ORIGIN: DVec3 = DVec3::new(10.0, -20.0, 30.0);

/// A camera that looks at the centre of the scenes from `from`, which is relative to it.
fn camera(from: DVec3, projection: Projection) -> Camera {
    Camera { position: ORIGIN + from, focal_point: ORIGIN, view_up: DVec3::Z, projection }
}

const SLANT: DVec3 = DVec3::new(3.0, -4.0, 2.0);
const PERSPECTIVE: Projection = Projection::Perspective { view_angle: 30.0 };
const ORTHOGRAPHIC: Projection = Projection::Orthographic { height: 2.9 };

fn settings() -> Settings {
    Settings::new([80, 64])
}

fn unshaded() -> Settings {
    Settings { surface_shade: None, volume_shade: Some(None), ..settings() }
}

fn ellipsoids() -> Surfels {
    let mut random = Random(1);
    let splats = (0..300).map(|_| {
        let center = random.point(1.0);
        random.ellipsoid(center, 0.08)
    });
    surfels(splats.collect())
}

/// Skewed ellipsoids with normals.
pub fn ellipsoids_in_perspective() -> Case {
    let scene = Scene::new().with_splats(ellipsoids());
    Case {
        name: "ellipsoids_in_perspective",
        scene,
        camera: camera(SLANT, PERSPECTIVE),
        settings: settings(),
    }
}

pub fn ellipsoids_orthographic() -> Case {
    let scene = Scene::new().with_splats(ellipsoids());
    Case {
        name: "ellipsoids_orthographic",
        scene,
        camera: camera(SLANT, ORTHOGRAPHIC),
        settings: settings(),
    }
}

pub fn ellipsoids_unlit() -> Case {
    let scene = Scene::new().with_splats(ellipsoids());
    Case {
        name: "ellipsoids_unlit",
        scene,
        camera: camera(SLANT, PERSPECTIVE),
        settings: unshaded(),
    }
}

/// Splats without normals, half of them translucent, in sheets of one pixel.
pub fn ellipsoids_without_normals() -> Case {
    let mut splats = ellipsoids();
    for (i, splat) in splats.splats.iter_mut().enumerate() {
        splat.normal = NO_NORMAL;
        splat.color =
            splat.color & 0x00ff_ffff | if i % 2 == 0 { 0x4000_0000 } else { 0xff00_0000 };
    }
    let settings = Settings { sheet_pixels: 1.0, ..settings() };
    let scene = Scene::new().with_splats(splats);
    Case {
        name: "ellipsoids_without_normals",
        scene,
        camera: camera(SLANT, ORTHOGRAPHIC),
        settings,
    }
}

/// Ellipsoids as large as the scene among small ones. The large ones lie in most sheets.
pub fn huge_among_small() -> Case {
    let mut random = Random(2);
    let mut splats = ellipsoids();
    splats.splats.truncate(100);
    for _ in 0..5 {
        let center = random.point(0.6);
        let huge = random.ellipsoid(center, 0.7);
        splats.splats.push(Splat { strength: 0.2 * huge.strength, ..huge });
    }
    let scene = Scene::new().with_splats(splats);
    Case {
        name: "huge_among_small",
        scene,
        camera: camera(SLANT, PERSPECTIVE),
        settings: settings(),
    }
}

/// Splats far smaller than a pixel.
pub fn splats_below_a_pixel() -> Case {
    let mut random = Random(3);
    let splats = (0..2000).map(|_| {
        let center = random.point(1.0).normalize();
        let splat = random.ellipsoid(center, 0.002);
        Splat { strength: 1.5, normal: encode_normal(center), ..splat }
    });
    let scene = Scene::new().with_splats(surfels(splats.collect()));
    Case {
        name: "splats_below_a_pixel",
        scene,
        camera: camera(SLANT, PERSPECTIVE),
        settings: settings(),
    }
}

/// A wall of flat discs that face the camera.
pub fn flat_discs_head_on() -> Case {
    let mut random = Random(4);
    let splats = (0..400).map(|i| {
        let center = Vec3::new(0.1 * (i % 20) as f32 - 0.95, 0.1 * (i / 20) as f32 - 0.95, 0.0);
        let (factor, normal) = ([0.06, 0.0, 0.06, 0.0, 0.0, 0.001], encode_normal(Vec3::Z));
        Splat { center: center.to_array(), strength: 3.0, factor, color: random.color(), normal }
    });
    let scene = Scene::new().with_splats(surfels(splats.collect()));
    let camera = Camera { view_up: DVec3::Y, ..camera(DVec3::new(0.0, 0.0, 6.0), ORTHOGRAPHIC) };
    Case { name: "flat_discs_head_on", scene, camera, settings: settings() }
}

/// Seen from among the splats. Some lie behind the camera, and some reach across the near bound and
/// around the eye.
pub fn camera_among_ellipsoids() -> Case {
    let mut splats = ellipsoids();
    let mut random = Random(5);
    for _ in 0..10 {
        let center = random.point(0.2) + Vec3::new(0.1, -0.1, 0.1);
        let near = random.ellipsoid(center, 0.15);
        splats.splats.push(Splat { strength: 0.1 * near.strength, ..near });
    }
    let scene = Scene::new().with_splats(splats);
    let camera = camera(DVec3::new(0.15, -0.1, 0.05), Projection::Perspective { view_angle: 70.0 });
    Case { name: "camera_among_ellipsoids", scene, camera, settings: settings() }
}

/// A vertical view angle of 90 degrees; the horizontal one is much larger.
pub fn wide_angle() -> Case {
    let scene = Scene::new().with_splats(ellipsoids());
    let camera = camera(DVec3::new(0.9, -1.2, 0.7), Projection::Perspective { view_angle: 90.0 });
    Case { name: "wide_angle", scene, camera, settings: Settings::new([96, 48]) }
}

/// Colours from blue to red and a growing opacity, over values of 0 … `scale`.
fn transfer(scale: f64, shade: Option<Shade>) -> TransferFunction {
    TransferFunction {
        color: vec![
            (0.0, [0.1, 0.2, 0.9]),
            (0.5 * scale, [0.9, 0.8, 0.3]),
            (scale, [0.9, 0.1, 0.1]),
        ],
        opacity: vec![(0.1 * scale, 0.0), (0.6 * scale, 0.7), (scale, 0.95)],
        unit: 0.3,
        shade,
        ..TransferFunction::default()
    }
}

/// A field of blobs of height 0 … 1, and 0 far from them. `at` is relative to the centre of the
/// scenes.
fn blobs(at: DVec3) -> f64 {
    let blob = |x: f64, y: f64, z: f64, size: f64| {
        let squared = (at - DVec3::new(x, y, z)).length_squared() / (size * size);
        (1.0 - squared).max(0.0).powi(2)
    };
    (blob(0.2, 0.1, -0.1, 1.0) + 0.9 * blob(-0.5, -0.3, 0.4, 0.8) + 0.7 * blob(0.1, 0.6, -0.5, 0.8))
        .min(1.0)
}

/// Samples scattered where the blobs are.
fn scattered() -> SampleSplats {
    let mut random = Random(6);
    let splats = (0..600).map(|_| {
        let center = random.point(0.8);
        let splat = random.ellipsoid(center, 0.12);
        Splat::sample(center, blobs(center.as_dvec3()) as f32, splat.factor, 1.0, Vec3::ZERO)
    });
    SampleSplats { origin: ORIGIN, splats: splats.collect(), extent: 3.0, overlap: 1.0 }
}

pub fn scattered_samples() -> Case {
    let scene = Scene::new().with_samples(scattered(), transfer(1.0, Some(Shade::default())));
    Case {
        name: "scattered_samples",
        scene,
        camera: camera(SLANT, PERSPECTIVE),
        settings: settings(),
    }
}

pub fn scattered_samples_orthographic() -> Case {
    let scene = Scene::new().with_samples(scattered(), transfer(1.0, None));
    Case {
        name: "scattered_samples_orthographic",
        scene,
        camera: camera(SLANT, ORTHOGRAPHIC),
        settings: settings(),
    }
}

/// A lattice around the centre of the scenes with the given steps, and the values of a function of
/// position on it.
fn sampled<T>(dims: [usize; 3], axes: DMat3, value: impl Fn(DVec3) -> T) -> (Lattice, Vec<T>) {
    let start = -0.5 * (axes * DVec3::from(dims.map(|n| n as f64 - 1.0)));
    let index = |i: usize| {
        DVec3::new(
            (i % dims[0]) as f64,
            (i / dims[0] % dims[1]) as f64,
            (i / dims[0] / dims[1]) as f64,
        )
    };
    let values = (0..dims.iter().product()).map(|i| value(start + axes * index(i))).collect();
    (Lattice::cartesian(dims, ORIGIN + start, axes), values)
}

/// Blobs as bytes on a cubic lattice of 20³ samples, lit.
fn blob_scene() -> Scene {
    let axes = DMat3::from_diagonal(DVec3::splat(0.1));
    let (lattice, values) = sampled([20, 20, 20], axes, |at| (255.0 * blobs(at)).round() as u8);
    let volume = Volume::new(lattice, Samples::U8(values)).expect("the samples fill the lattice");
    Scene::new().with_volume(volume, Kernel::default(), transfer(255.0, Some(Shade::default())))
}

pub fn blobs_analytic() -> Case {
    Case {
        name: "blobs_analytic",
        scene: blob_scene(),
        camera: camera(SLANT, PERSPECTIVE),
        settings: settings(),
    }
}

pub fn blobs_central() -> Case {
    let settings = Settings { gradient: Gradient::Central, size: [60, 48], ..settings() };
    Case {
        name: "blobs_central",
        scene: blob_scene(),
        camera: camera(SLANT, PERSPECTIVE),
        settings,
    }
}

pub fn blobs_orthographic() -> Case {
    Case {
        name: "blobs_orthographic",
        scene: blob_scene(),
        camera: camera(SLANT, ORTHOGRAPHIC),
        settings: settings(),
    }
}

pub fn blobs_unshaded() -> Case {
    Case {
        name: "blobs_unshaded",
        scene: blob_scene(),
        camera: camera(SLANT, PERSPECTIVE),
        settings: unshaded(),
    }
}

/// Seen from inside the lattice.
pub fn camera_inside_a_volume() -> Case {
    let camera = camera(DVec3::new(0.5, -0.4, 0.35), Projection::Perspective { view_angle: 75.0 });
    Case { name: "camera_inside_a_volume", scene: blob_scene(), camera, settings: settings() }
}

/// Marschner and Lobb's test signal (1994) as floats, on axes that are turned against those of the
/// world.
pub fn marschner_lobb() -> Case {
    let axes = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.6) * (2.0 / 23.0);
    let signal = |at: DVec3| {
        let at = at / (2.0 / 23.0 * 11.5);
        let tau = std::f64::consts::TAU;
        let wave = (tau * 6.0 * (0.25 * tau * at.truncate().length()).cos()).cos();
        ((1.0 - (0.5 * std::f64::consts::PI * at.z).sin() + 0.25 * (1.0 + wave)) / 2.5) as f32
    };
    let (lattice, values) = sampled([24, 24, 24], axes, signal);
    let volume = Volume::new(lattice, Samples::F32(values)).expect("the samples fill the lattice");
    let scene =
        Scene::new().with_volume(volume, Kernel::default(), transfer(1.0, Some(Shade::default())));
    Case { name: "marschner_lobb", scene, camera: camera(SLANT, PERSPECTIVE), settings: settings() }
}

/// Blobs as floats on a sheared lattice of unequal steps.
fn sheared_scene() -> Scene {
    let axes = DMat3::from_cols(
        DVec3::new(0.11, 0.02, 0.0),
        DVec3::new(-0.02, 0.08, 0.03),
        DVec3::new(0.0, 0.04, 0.17),
    );
    let (lattice, values) = sampled([18, 22, 12], axes, |at| blobs(at) as f32);
    let volume = Volume::new(lattice, Samples::F32(values)).expect("the samples fill the lattice");
    let kernel = Kernel::gaussian(0.7, 2.5).expect("a kernel");
    Scene::new().with_volume(volume, kernel, transfer(1.0, Some(Shade::default())))
}

pub fn sheared_lattice() -> Case {
    Case {
        name: "sheared_lattice",
        scene: sheared_scene(),
        camera: camera(SLANT, PERSPECTIVE),
        settings: settings(),
    }
}

pub fn sheared_lattice_central() -> Case {
    let settings = Settings { gradient: Gradient::Central, size: [60, 48], ..settings() };
    Case {
        name: "sheared_lattice_central",
        scene: sheared_scene(),
        camera: camera(SLANT, ORTHOGRAPHIC),
        settings,
    }
}

/// One value everywhere. Unlit, as the gradient of a constant is nothing but rounding.
pub fn constant_field() -> Case {
    let axes = DMat3::from_axis_angle(DVec3::Y, 0.3) * 0.1;
    let (lattice, values) = sampled([16, 14, 12], axes, |_| 180);
    let volume = Volume::new(lattice, Samples::U8(values)).expect("the samples fill the lattice");
    let scene = Scene::new().with_volume(volume, Kernel::default(), transfer(255.0, None));
    Case { name: "constant_field", scene, camera: camera(SLANT, PERSPECTIVE), settings: settings() }
}

/// A sphere of small balls inside translucent blobs.
fn mixed_scene() -> Scene {
    let mut random = Random(7);
    let balls = (0..400).map(|_| {
        let outward = random.point(1.0).normalize();
        let splat = Splat {
            factor: [0.05, 0.0, 0.05, 0.0, 0.0, 0.05],
            ..random.ellipsoid(0.5 * outward, 0.05)
        };
        Splat { strength: 4.0, normal: encode_normal(outward), ..splat }
    });
    blob_scene().with_splats(surfels(balls.collect()))
}

pub fn surface_in_a_volume() -> Case {
    Case {
        name: "surface_in_a_volume",
        scene: mixed_scene(),
        camera: camera(SLANT, PERSPECTIVE),
        settings: settings(),
    }
}

pub fn surface_in_a_volume_orthographic() -> Case {
    let camera = camera(SLANT, ORTHOGRAPHIC);
    Case {
        name: "surface_in_a_volume_orthographic",
        scene: mixed_scene(),
        camera,
        settings: settings(),
    }
}
