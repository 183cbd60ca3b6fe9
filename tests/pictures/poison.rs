//! Numbers that make no picture (not finite, negative, tiny, huge) in every part of a scene. Each
//! is refused by an error that names the problem, or drawn as the reference in double precision
//! draws it. No picture is spoilt silently.

use crate::testing::{gpu::gpu, psnr::psnr};
use glam::{DMat3, DVec3, Vec3};
use splatkit::{
    Error, Result,
    gpu::Renderer,
    hierarchy::Detail,
    math::{Bounds, Camera, Kernel, Profile, Projection},
    picture::Picture,
    reference,
    scattered::{Points, SampleOptions},
    scene::{Clip, ClipShape, Item, Scene, Settings},
    splat::{NO_NORMAL, SampleSplats, Splat, Surfels, encode_normal},
    surface::{Mesh, SurfelOptions},
    volume::{Lattice, Samples, Shade, TransferFunction, Volume},
};
use std::sync::Arc;

const NOT_FINITE: [f32; 3] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
/// Numbers near both ends of the range of 32-bit floats; the last two are denormal.
const ODD: [f32; 10] = [3e38, -3e38, 1e30, 1e18, 1e10, -1e10, 0.0, 1e-18, 1e-40, -1e-44];

/// Index of the splat or sample that is poisoned.
const POISONED: usize = 17;

fn settings() -> Settings {
    Settings::new([24, 20])
}

fn camera() -> Camera {
    Camera {
        position: DVec3::new(3.0, -4.0, 2.0),
        focal_point: DVec3::ZERO,
        view_up: DVec3::Z,
        projection: Projection::Perspective { view_angle: 30.0 },
    }
}

fn drawn(scene: &Scene, camera: &Camera, settings: &Settings) -> Result<Picture> {
    let mut renderer = Renderer::new(gpu());
    let mut prepared = renderer.prepare(scene)?;
    Ok(renderer.render(&mut prepared, camera, settings)?.0)
}

/// A ball of 64 splats.
fn ball() -> Surfels {
    let splat = |i: u32| {
        let z = 1.0 - (2.0 * i as f32 + 1.0) / 64.0;
        let turn = 2.4 * i as f32;
        let normal =
            Vec3::new((1.0 - z * z).sqrt() * turn.cos(), (1.0 - z * z).sqrt() * turn.sin(), z);
        Splat {
            center: (0.8 * normal).to_array(),
            strength: 3.0,
            factor: [0.2, 0.0, 0.2, 0.0, 0.0, 0.2],
            color: u32::from_le_bytes([40 + 3 * i as u8, 200 - 2 * i as u8, 90, 255]),
            normal: if i.is_multiple_of(2) { encode_normal(normal) } else { NO_NORMAL },
        }
    };
    let splats = (0..64).map(splat).collect();
    Surfels { origin: DVec3::ZERO, splats, extent: 3.0 }
}

fn samples() -> SampleSplats {
    let Surfels { origin, splats, extent } = ball();
    let mut set = SampleSplats { origin, splats, extent, overlap: 1.0 };
    for (i, splat) in set.splats.iter_mut().enumerate() {
        *splat =
            Splat::sample(Vec3::from(splat.center), i as f32 / 64.0, splat.factor, 1.0, Vec3::ZERO);
    }
    set
}

fn transfer() -> TransferFunction {
    TransferFunction {
        color: vec![(0.0, [0.2, 0.4, 1.0]), (1.0, [1.0, 0.6, 0.1])],
        opacity: vec![(0.0, 0.1), (1.0, 0.8)],
        unit: 0.5,
        ..TransferFunction::default()
    }
}

fn lattice() -> Lattice {
    Lattice { origin: DVec3::splat(-1.0), ..Lattice::with_spacing([5; 3], DVec3::splat(0.5)) }
}

fn volume() -> Volume {
    Volume::new(lattice(), Samples::F32((0..125).map(|i| (i % 11) as f32 / 10.0).collect()))
        .expect("a volume")
}

fn with_volume(volume: Volume) -> Scene {
    Scene::new().with_volume(volume, Kernel::default(), transfer())
}

/// Asserts that both renderers refuse with the same message, which contains all `words`.
fn assert_refused(scene: &Scene, camera: &Camera, settings: &Settings, words: &[&str]) {
    let message = drawn(scene, camera, settings).expect_err(&format!("{words:?}")).to_string();
    let expected =
        reference::render(scene, camera, settings).expect_err(&format!("{words:?}")).to_string();
    assert_eq!(message, expected);
    words
        .iter()
        .for_each(|word| assert!(message.contains(word), "“{message}” does not say “{word}”"));
}

/// What was drawn wrongly; a test reports all of it at its end.
#[derive(Default)]
struct Faults(Vec<String>);

impl Faults {
    /// Records a fault unless both refuse, or the engine draws what the reference draws.
    fn inspect(&mut self, what: &str, scene: &Scene, camera: &Camera, settings: &Settings) {
        let fault =
            match (drawn(scene, camera, settings), reference::render(scene, camera, settings)) {
                (Ok(picture), Ok(expected)) => difference(&picture, &expected),
                (
                    Err(Error::Argument(_) | Error::Transfer(_) | Error::NothingToDraw(_)),
                    Err(_),
                ) => None,
                (Err(error), _) => Some(format!("the engine refuses: {error}")),
                (Ok(_), Err(error)) => Some(format!("only the reference refuses: {error}")),
            };
        self.0.extend(fault.map(|fault| format!("{what}: {fault}")));
    }

    fn tell(self) {
        assert!(self.0.is_empty(), "{}", self.0.join("\n"));
    }
}

fn difference(actual: &Picture, expected: &Picture) -> Option<String> {
    for (name, picture) in [("reference", expected), ("engine", actual)] {
        if let Some(odd) =
            picture.color.iter().find(|color| !color.iter().all(|v| (-1e-4..=1.0001).contains(v)))
        {
            return Some(format!("the {name} draws the colour {odd:?}"));
        }
        if picture.depth.iter().any(|depth| depth.is_nan()) {
            return Some(format!("a depth of the {name} is not a number"));
        }
    }
    let agreement = psnr(actual, expected);
    let mean_opacity = |picture: &Picture| {
        picture.color.iter().map(|color| color[3]).sum::<f32>() / picture.color.len() as f32
    };
    let share = [actual, expected].map(mean_opacity);
    (agreement < 40.0).then(|| {
        format!("the engine is at {agreement:.1} dB from the reference, opacities {share:?}")
    })
}

/// The numbers of a splat one by one, each with its name in errors.
fn numbers_of(splat: &mut Splat) -> [(&'static str, &mut f32); 10] {
    let Splat { center: [x, y, z], strength, factor: [a, b, c, d, e, f], .. } = splat;
    let (center, factor) = ("the centre", "the factor");
    [(center, x), (center, y), (center, z), ("", strength)]
        .into_iter()
        .chain([a, b, c, d, e, f].map(|v| (factor, v)))
        .collect::<Vec<_>>()
        .try_into()
        .unwrap_or_else(|_| unreachable!("ten numbers"))
}

/// A ball of surfels and one of samples, each with its name.
fn sets() -> [(&'static str, Item); 2] {
    let samples = Item::Scalar(samples().into(), transfer());
    [("surfels", Item::Radiance(ball().into())), ("samples", samples)]
}

/// The splats of a set.
fn splats_of(item: &mut Item) -> &mut [Splat] {
    match item {
        Item::Radiance(set) => &mut Arc::make_mut(set).splats,
        Item::Scalar(set, _) => &mut Arc::make_mut(set).splats,
        other => panic!("{other:?}"),
    }
}

/// So far from the origin, the midpoint of an edge rounds to one of its ends.
#[test]
fn triangles_far_from_the_origin_come_to_an_end() {
    let mesh = Mesh {
        positions: [(0.0, 0.0), (80.0, 0.0), (0.0, 80.0)]
            .map(|(x, y)| Vec3::new(1e8 + x, 1e8 + y, 0.0))
            .to_vec(),
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    let set = mesh.surfels(&SurfelOptions::default()).expect("surfels");
    assert!((1..1000).contains(&set.splats.len()), "{}", set.splats.len());
}

/// An empty set of samples has no range of values.
#[test]
fn no_samples_beside_a_surface_are_nothing() {
    let none = SampleSplats { splats: Vec::new(), ..samples() };
    let mut faults = Faults::default();
    let scene = Scene::new().with_splats(ball()).with_samples(none, transfer());
    faults.inspect("no samples", &scene, &camera(), &settings());
    faults.tell();
}

#[test]
fn splats_that_are_not_finite_are_named() {
    for (_, set) in sets() {
        for number in 0..10 {
            for poison in NOT_FINITE {
                let mut set = set.clone();
                let (name, value) = numbers_of(&mut splats_of(&mut set)[POISONED])
                    .into_iter()
                    .nth(number)
                    .expect("a number");
                *value = poison;
                // The first item is sound, so the error names the second.
                let scene = Scene::from(vec![Item::Radiance(ball().into()), set]);
                assert_refused(&scene, &camera(), &settings(), &["item 1", "splat 17", name]);
            }
        }
    }
    let mut negative = ball();
    negative.splats[POISONED].strength = -1.0;
    let scene = Scene::new().with_splats(negative);
    assert_refused(&scene, &camera(), &settings(), &["item 0", "splat 17", "-1"]);
    let mut weightless = samples();
    let splat = &mut weightless.splats[POISONED];
    *splat = Splat::sample(Vec3::ZERO, 0.5, splat.factor, f32::NAN, Vec3::ZERO);
    let scene = Scene::new().with_samples(weightless, transfer());
    assert_refused(&scene, &camera(), &settings(), &["item 0", "splat 17", "weight"]);
}

#[test]
fn sets_that_are_not_finite_are_named() {
    let refused = |change: &dyn Fn(&mut Surfels), word: &str| {
        let mut set = ball();
        change(&mut set);
        assert_refused(&Scene::new().with_splats(set), &camera(), &settings(), &[word]);
    };
    let overlap_refused = |overlap: f32| {
        let scene = Scene::new().with_samples(SampleSplats { overlap, ..samples() }, transfer());
        assert_refused(&scene, &camera(), &settings(), &["overlap"]);
    };
    for poison in NOT_FINITE {
        refused(&|set| set.origin.y = poison.into(), "origin");
        refused(&|set| set.extent = poison, "extent");
        overlap_refused(poison);
    }
    refused(&|set| set.extent = -1.0, "extent");
    overlap_refused(1e-45);
    refused(&|set| set.origin = DVec3::splat(1e300), "beyond");
}

#[test]
fn odd_splats_are_drawn_or_refused() {
    let mut faults = Faults::default();
    for (kind, set) in sets() {
        for number in 0..10 {
            for odd in ODD {
                let mut set = set.clone();
                *numbers_of(&mut splats_of(&mut set)[POISONED])
                    .into_iter()
                    .nth(number)
                    .expect("a number")
                    .1 = odd;
                let what = format!("{kind} with number {number} {odd:e}");
                faults.inspect(&what, &Scene::from(vec![set]), &camera(), &settings());
            }
        }
        for odd in ODD {
            let mut set = set.clone();
            splats_of(&mut set)[POISONED].factor = [odd, 0.0, odd, 0.0, 0.0, odd];
            let what = format!("{kind} of size {odd:e}");
            faults.inspect(&what, &Scene::from(vec![set]), &camera(), &settings());
        }
    }
    faults.tell();
}

#[test]
fn volumes_that_are_not_finite_are_named() {
    for poison in NOT_FINITE {
        let mut values = vec![0.5f32; 125];
        values[POISONED] = poison;
        let error = Volume::new(lattice(), Samples::F32(values.clone())).unwrap_err();
        assert!(error.to_string().contains("sample 17"), "{error}");
        let poisoned = Volume { samples: Samples::F32(values), ..volume() };
        assert_refused(&with_volume(poisoned), &camera(), &settings(), &["item 0", "sample 17"]);
        let poison = f64::from(poison);
        let moved = Lattice { origin: DVec3::splat(poison), ..lattice() };
        assert!(Volume::new(moved.clone(), volume().samples).is_err());
        assert_refused(
            &with_volume(Volume { lattice: moved, ..volume() }),
            &camera(),
            &settings(),
            &["item 0", "origin"],
        );
        let range = [0.0, poison];
        assert_refused(
            &with_volume(Volume { range, ..volume() }),
            &camera(),
            &settings(),
            &["item 0", "range"],
        );
        let kernel = |profile, extent| {
            let scene = Scene::new().with_volume(volume(), Kernel { profile, extent }, transfer());
            assert_refused(&scene, &camera(), &settings(), &["item 0", "kernel"]);
        };
        kernel(Profile::Gaussian(poison), 2.0);
        kernel(Profile::BSpline, poison);
        kernel(Profile::Table(Arc::new([1.0, poison])), 2.0);
    }
}

#[test]
fn odd_volumes_are_drawn_or_refused() {
    let mut faults = Faults::default();
    for odd in ODD {
        let mut values: Vec<f32> = (0..125).map(|i| (i % 11) as f32 / 10.0).collect();
        values[62] = odd;
        let odd_volume = Volume::new(lattice(), Samples::F32(values)).expect("a volume");
        faults.inspect(
            &format!("a sample of {odd:e}"),
            &with_volume(odd_volume),
            &camera(),
            &settings(),
        );
        let all = Volume::new(lattice(), Samples::F32(vec![odd; 125])).expect("a volume");
        faults.inspect(
            &format!("all samples of {odd:e}"),
            &with_volume(all),
            &camera(),
            &settings(),
        );
        let wide =
            Lattice { axes: DMat3::from_diagonal(DVec3::new(0.5, 0.5, odd.into())), ..lattice() };
        if let Ok(wide) = Volume::new(wide, volume().samples) {
            faults.inspect(
                &format!("a spacing of {odd:e}"),
                &with_volume(wide),
                &camera(),
                &settings(),
            );
        }
        let far = Volume {
            lattice: Lattice { origin: DVec3::splat(odd.into()), ..lattice() },
            ..volume()
        };
        faults.inspect(&format!("a lattice at {odd:e}"), &with_volume(far), &camera(), &settings());
    }
    faults.tell();
}

#[test]
fn scattered_samples_are_drawn_or_refused() {
    let mut faults = Faults::default();
    let points = || Points {
        origin: DVec3::ZERO,
        positions: ball().splats.iter().map(|splat| Vec3::from(splat.center)).collect(),
        values: (0..64).map(|i| i as f32 / 64.0).collect(),
        radii: Vec::new(),
        covariances: Vec::new(),
        ..Points::default()
    };
    let refused = |points: Points, word: &str| {
        let error = points.to_splats(&SampleOptions::default()).unwrap_err().to_string();
        assert!(error.contains(word), "“{error}” does not say “{word}”");
    };
    let with = |change: &dyn Fn(&mut Points)| {
        let mut points = points();
        change(&mut points);
        points
    };
    for poison in NOT_FINITE {
        refused(with(&|points| points.positions[POISONED].y = poison), "sample 17");
        refused(with(&|points| points.values[POISONED] = poison), "sample 17");
        refused(
            with(&|points| {
                points.radii = [vec![0.1; POISONED], vec![poison; 64 - POISONED]].concat();
            }),
            "sample 17",
        );
        refused(with(&|points| points.origin.x = poison.into()), "origin");
    }
    for odd in ODD {
        for (what, points) in [
            ("position", with(&|points| points.positions[POISONED].y = odd)),
            ("value", with(&|points| points.values[POISONED] = odd)),
            (
                "radius",
                with(&|points| {
                    points.radii = [vec![0.3; POISONED], vec![odd; 64 - POISONED]].concat();
                }),
            ),
        ] {
            match points.to_splats(&SampleOptions::default()) {
                Ok(set) => {
                    let what = format!("a sample with {what} {odd:e}");
                    let scene = Scene::new().with_samples(set, transfer());
                    faults.inspect(&what, &scene, &camera(), &settings());
                }
                Err(error) => {
                    assert!(
                        matches!(error, Error::Argument(_) | Error::Transfer(_)),
                        "{what} {odd:e}: {error}"
                    );
                }
            }
        }
    }
    faults.tell();
}

#[test]
fn transfer_functions_are_named() {
    let mut faults = Faults::default();
    let refused = |change: &dyn Fn(&mut TransferFunction), word: &str| {
        let mut poisoned = transfer();
        change(&mut poisoned);
        for scene in [
            Scene::new().with_volume(volume(), Kernel::default(), poisoned.clone()),
            Scene::new().with_samples(samples(), poisoned),
        ] {
            assert_refused(&scene, &camera(), &settings(), &["item 0", "transfer function", word]);
        }
    };
    for poison in NOT_FINITE.map(f64::from) {
        refused(&|transfer| transfer.color[1].0 = poison, "color point 1");
        refused(&|transfer| transfer.color[1].1[2] = poison, "color point 1");
        refused(&|transfer| transfer.opacity[0].0 = poison, "opacity point 0");
        refused(&|transfer| transfer.opacity[0].1 = poison, "opacity point 0");
        refused(&|transfer| transfer.unit = poison, "unit");
        refused(
            &|transfer| transfer.shade = Some(Shade { power: poison, ..Shade::default() }),
            "shade",
        );
        refused(&|transfer| transfer.gradient = vec![(0.0, poison)], "gradient point 0");
    }
    refused(&|transfer| transfer.color.clear(), "no color points");
    refused(&|transfer| transfer.unit = 1e-310, "unit");
    for unit in [1e-37, 1e-28, 1e-10, 1e10, 1e20, 1e24, 1e30, 1e300] {
        let scene = Scene::new().with_volume(
            volume(),
            Kernel::default(),
            TransferFunction { unit, ..transfer() },
        );
        faults.inspect(&format!("a unit of {unit:e}"), &scene, &camera(), &settings());
    }
    for far in [1e30, 1e38, 1e300, f64::MAX] {
        let wide = TransferFunction {
            opacity: vec![(-far, 0.0), (far, 1.0)],
            color: vec![(-far, [0.0; 3]), (far, [1.0; 3])],
            ..transfer()
        };
        let scene = Scene::new().with_volume(volume(), Kernel::default(), wide);
        faults.inspect(&format!("a transfer function to {far:e}"), &scene, &camera(), &settings());
    }
    faults.tell();
}

#[test]
fn cameras_are_refused_or_draw() {
    let mut faults = Faults::default();
    let scene = Scene::new().with_splats(ball());
    for poison in NOT_FINITE.map(f64::from) {
        for change in [
            &(|camera: &mut Camera| camera.position.y = poison) as &dyn Fn(&mut Camera),
            &|camera| camera.focal_point.x = poison,
            &|camera| camera.view_up.z = poison,
            &|camera| camera.projection = Projection::Perspective { view_angle: poison },
            &|camera| camera.projection = Projection::Orthographic { height: poison },
        ] {
            let mut camera = camera();
            change(&mut camera);
            assert_refused(&scene, &camera, &settings(), &["camera"]);
        }
    }
    for scene in [scene, with_volume(volume())] {
        for odd in [1e-310, 1e-200, 1e-30, 1e-6, 1e6, 1e20, 1e38, 1e200, 1e308] {
            for (what, camera) in [
                ("distance", Camera { position: DVec3::new(0.6, -0.8, 0.0) * odd, ..camera() }),
                (
                    "angle",
                    Camera { projection: Projection::Perspective { view_angle: odd }, ..camera() },
                ),
                (
                    "height",
                    Camera { projection: Projection::Orthographic { height: odd }, ..camera() },
                ),
                ("up", Camera { view_up: DVec3::Z * odd, ..camera() }),
            ] {
                faults.inspect(
                    &format!("a camera's {what} of {odd:e}"),
                    &scene,
                    &camera,
                    &settings(),
                );
            }
        }
    }
    faults.tell();
}

#[test]
fn settings_are_named() {
    let scene = Scene::new().with_splats(ball());
    for poison in NOT_FINITE.map(f64::from).into_iter().chain([-1.0]) {
        let refused =
            |settings: Settings, word| assert_refused(&scene, &camera(), &settings, &[word]);
        let shade = Some(Shade { diffuse: poison, ..Shade::default() });
        refused(Settings { sheet_thickness: Some(poison), ..settings() }, "thickness");
        refused(Settings { sheet_pixels: poison, ..settings() }, "thickness");
        refused(Settings { near: Some(poison), ..settings() }, "nearest");
        refused(Settings { detail: Detail::Pixels(poison), ..settings() }, "detail");
        refused(Settings { surface_shade: shade, ..settings() }, "light");
        refused(Settings { volume_shade: Some(shade), ..settings() }, "light");
    }
    for poison in NOT_FINITE.map(f64::from) {
        for shape in [
            ClipShape::HalfSpace { normal: DVec3::new(poison, 0.0, 1.0), offset: 0.0 },
            ClipShape::HalfSpace { normal: DVec3::Z, offset: poison },
            ClipShape::Box(Bounds { min: DVec3::splat(poison), max: DVec3::ONE }),
        ] {
            let settings = Settings { clips: vec![Clip { shape, inside: true }], ..settings() };
            assert_refused(&scene, &camera(), &settings, &["clip"]);
        }
    }
}
