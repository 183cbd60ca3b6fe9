//! Ways to show a field: lattices, kernels, modes, classification, optics, isosurfaces, clips.

use super::*;
use splatkit::{
    math::Bounds,
    scene::{Classification, Clip, ClipShape, Mode, Optics, Order},
    volume::{Arrangement, Isosurface},
};
use std::sync::Arc;

/// A case with the usual camera.
fn case(name: &'static str, scene: Scene, settings: Settings) -> Case {
    Case { name, scene, camera: camera(SLANT, PERSPECTIVE), settings }
}

fn volume_scene(volume: Volume, kernel: Kernel, transfer: TransferFunction) -> Scene {
    Scene::new().with_volume(volume, kernel, transfer)
}

/// The blobs on a lattice of any kind around the centre of the scenes, as floats of 0 … 1.
fn blobs_on(dims: [usize; 3], axes: DMat3, arrangement: Arrangement) -> Volume {
    let mut lattice = Lattice { dims, origin: DVec3::ZERO, axes, arrangement };
    lattice.origin = ORIGIN - axes * lattice.step_range().center();
    let values =
        (0..lattice.len()).map(|i| blobs(lattice.sample_position(i) - ORIGIN) as f32).collect();
    Volume::new(lattice, Samples::F32(values)).expect("the samples fill the lattice")
}

fn cubic() -> Volume {
    blobs_on([20, 20, 20], DMat3::from_diagonal(DVec3::splat(0.1)), Arrangement::Cartesian)
}

/// A transfer function with a step, and a shell thinner than a sheet.
fn steep() -> TransferFunction {
    TransferFunction {
        opacity: vec![(0.1, 0.0), (0.12, 0.6), (0.14, 0.0), (0.5, 0.0), (0.5, 0.9)],
        ..transfer(1.0, Some(Shade::default()))
    }
}

fn surfaces(list: &[(f64, [f64; 3], f64)]) -> TransferFunction {
    let isosurfaces =
        list.iter().map(|&(value, color, opacity)| Isosurface { value, color, opacity }).collect();
    TransferFunction { shade: Some(Shade::default()), isosurfaces, ..TransferFunction::default() }
}

fn body_centred_volume() -> Volume {
    blobs_on([14, 14, 28], DMat3::from_diagonal(DVec3::splat(0.14)), Arrangement::BodyCentred)
}

pub fn body_centred() -> Case {
    let scene = volume_scene(
        body_centred_volume(),
        Kernel::default(),
        transfer(1.0, Some(Shade::default())),
    );
    case("body_centred", scene, settings())
}

/// From far away, where sections are the same for all pixels. Sheets are classified by their mean
/// values.
pub fn body_centred_from_afar() -> Case {
    let mut case = body_centred();
    case.camera.position = ORIGIN + 30.0 * SLANT;
    case.camera.projection = Projection::Perspective { view_angle: 1.0 };
    case.settings.classification = Classification::Post;
    Case { name: "body_centred_from_afar", ..case }
}

/// Steps that grow from 0.06 to 0.25, on axes that are turned and sheared.
pub fn rectilinear() -> Case {
    let places = |n: usize, grow: f64| {
        let mut at = 0.0;
        let mut step = 0.06;
        let mut all = vec![0.0];
        for _ in 1..n {
            at += step;
            step *= grow;
            all.push(at);
        }
        all
    };
    let coordinates = Arc::new([places(16, 1.09), places(18, 1.06), places(14, 1.1)]);
    let axes = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.4)
        * DMat3::from_cols(DVec3::X, DVec3::new(0.2, 1.0, 0.0), DVec3::Z);
    let volume = blobs_on([16, 18, 14], axes, Arrangement::Rectilinear(coordinates));
    case(
        "rectilinear",
        volume_scene(volume, Kernel::default(), transfer(1.0, Some(Shade::default()))),
        settings(),
    )
}

pub fn b_spline() -> Case {
    let kernel = Kernel::b_spline(2.0).expect("a kernel");
    case(
        "b_spline",
        volume_scene(cubic(), kernel, transfer(1.0, Some(Shade::default()))),
        settings(),
    )
}

/// A tabulated Gaussian, cut off so far out that it equals the closed form.
pub fn table_of_a_gaussian() -> Case {
    let values =
        (0..=256).map(|i| (-0.5 * (f64::from(i) / 256.0 * 2.7 / 0.6).powi(2)).exp()).collect();
    let kernel = Kernel::table(values, 2.7).expect("a kernel");
    case(
        "table_of_a_gaussian",
        volume_scene(cubic(), kernel, transfer(1.0, Some(Shade::default()))),
        settings(),
    )
}

/// The same Gaussian in closed form.
pub fn closed_form_of_that_gaussian() -> Case {
    let kernel = Kernel::gaussian(0.6, 2.7).expect("a kernel");
    let scene = volume_scene(cubic(), kernel, transfer(1.0, Some(Shade::default())));
    case("closed_form_of_that_gaussian", scene, settings())
}

pub fn thin_shells() -> Case {
    case("thin_shells", volume_scene(cubic(), Kernel::default(), steep()), settings())
}

/// Thin shells with a corner sample of a broken sensor. The transfer function covers only a small
/// part of the range of values.
pub fn one_value_far_off() -> Case {
    let mut volume = cubic();
    let values = (0..volume.len())
        .map(|i| if i == 0 { -20_000.0 } else { volume.value(i) as f32 })
        .collect();
    volume = Volume::new(volume.lattice, Samples::F32(values)).expect("as many samples");
    case("one_value_far_off", volume_scene(volume, Kernel::default(), steep()), settings())
}

/// Thin shells whose colour, opacity and gradient functions have points far off. Nothing visible
/// changes up to there.
pub fn points_far_off() -> Case {
    let mut transfer =
        TransferFunction { gradient: vec![(0.2, 0.0), (1.5, 1.0), (3e5, 1.0)], ..steep() };
    let last = transfer.opacity[transfer.opacity.len() - 1].1;
    transfer.opacity.push((4e5, last));
    transfer.color.push((2e5, transfer.color[transfer.color.len() - 1].1));
    transfer.color.insert(0, (-3e5, [0.0; 3]));
    let mut volume = cubic();
    let values =
        (0..volume.len()).map(|i| if i == 0 { 1e5 } else { volume.value(i) as f32 }).collect();
    volume = Volume::new(volume.lattice, Samples::F32(values)).expect("as many samples");
    case("points_far_off", volume_scene(volume, Kernel::default(), transfer), settings())
}

pub fn post_classified() -> Case {
    let settings = Settings { classification: Classification::Post, ..settings() };
    case("post_classified", volume_scene(cubic(), Kernel::default(), steep()), settings)
}

pub fn pre_classified() -> Case {
    let settings = Settings { classification: Classification::Pre, ..settings() };
    case(
        "pre_classified",
        volume_scene(cubic(), Kernel::default(), transfer(1.0, Some(Shade::default()))),
        settings,
    )
}

pub fn axis_sheets() -> Case {
    let settings = Settings { mode: Mode::AxisSheets, ..settings() };
    case(
        "axis_sheets",
        volume_scene(cubic(), Kernel::default(), transfer(1.0, Some(Shade::default()))),
        settings,
    )
}

pub fn axis_sheets_body_centred_orthographic() -> Case {
    let settings = Settings { mode: Mode::AxisSheets, ..settings() };
    let scene = volume_scene(body_centred_volume(), Kernel::default(), transfer(1.0, None));
    let camera = camera(SLANT, ORTHOGRAPHIC);
    Case { name: "axis_sheets_body_centred_orthographic", scene, camera, settings }
}

pub fn single_splats(order: Order) -> Case {
    let settings = Settings { mode: Mode::Splats(order), ..settings() };
    case(
        "single_splats",
        volume_scene(cubic(), Kernel::default(), transfer(1.0, Some(Shade::default()))),
        settings,
    )
}

pub fn single_ellipsoids() -> Case {
    let settings = Settings { mode: Mode::Splats(Order::BackToFront), ..settings() };
    case("single_ellipsoids", Scene::new().with_splats(ellipsoids()), settings)
}

/// The case along parallel rays.
pub fn orthographic(case: Case) -> Case {
    Case { camera: camera(SLANT, ORTHOGRAPHIC), ..case }
}

/// The case from within the scene.
pub fn from_inside(case: Case) -> Case {
    Case {
        camera: camera(DVec3::new(0.5, -0.4, 0.35), Projection::Perspective { view_angle: 75.0 }),
        ..case
    }
}

/// Scattered samples with slopes and different weights.
pub fn samples_with_slopes(classification: Classification) -> Case {
    let mut random = Random(16);
    let mut set = scattered();
    for splat in &mut set.splats {
        let slope = random.point(0.05);
        *splat = Splat::sample(
            splat.center.into(),
            splat.strength,
            splat.factor,
            random.within(0.3, 2.0),
            slope,
        );
    }
    set.overlap = 3.0;
    let scene = Scene::new().with_samples(set, transfer(1.0, Some(Shade::default())));
    case("samples_with_slopes", scene, Settings { classification, ..settings() })
}

pub fn gradient_opacity() -> Case {
    let transfer =
        TransferFunction { gradient: vec![(0.2, 0.0), (1.5, 1.0)], ..transfer(1.0, None) };
    case("gradient_opacity", volume_scene(cubic(), Kernel::default(), transfer), settings())
}

/// Light fades in over most of the field's gradients. A clip cuts through it, and an isosurface is
/// lit as the rest.
pub fn uncertain_light() -> Case {
    let shade = Shade { certain: Some([0.3, 1.6]), ..Shade::default() };
    let isosurfaces = surfaces(&[(0.7, [0.2, 0.3, 0.9], 0.5)]).isosurfaces;
    let transfer = TransferFunction { isosurfaces, ..transfer(1.0, Some(shade)) };
    let shape = ClipShape::HalfSpace { normal: -DVec3::Y, offset: 0.2 - ORIGIN.y };
    let settings = Settings { clips: vec![Clip { shape, inside: true }], ..settings() };
    case("uncertain_light", volume_scene(cubic(), Kernel::default(), transfer), settings)
}

pub fn one_isosurface() -> Case {
    let transfer = surfaces(&[(0.3, [0.9, 0.7, 0.4], 1.0)]);
    case("one_isosurface", volume_scene(cubic(), Kernel::default(), transfer), settings())
}

/// Two translucent isosurfaces and an opaque one inside what the transfer function shows.
pub fn isosurfaces_in_fog() -> Case {
    let list =
        [(0.5, [0.2, 0.9, 0.3], 0.5), (0.2, [0.9, 0.3, 0.2], 0.3), (0.7, [0.2, 0.3, 0.9], 1.0)];
    let transfer = TransferFunction {
        isosurfaces: surfaces(&list).isosurfaces,
        ..transfer(1.0, Some(Shade::default()))
    };
    let scene = volume_scene(cubic(), Kernel::default(), transfer);
    Case {
        name: "isosurfaces_in_fog",
        scene,
        camera: camera(SLANT, ORTHOGRAPHIC),
        settings: settings(),
    }
}

pub fn maximum() -> Case {
    let settings = Settings { optics: Optics::Maximum, ..settings() };
    case(
        "maximum",
        volume_scene(cubic(), Kernel::default(), transfer(1.0, Some(Shade::default()))),
        settings,
    )
}

pub fn x_ray() -> Case {
    let settings = Settings { optics: Optics::XRay, ..settings() };
    case(
        "x_ray",
        volume_scene(cubic(), Kernel::default(), transfer(1.0, Some(Shade::default()))),
        settings,
    )
}

fn clips() -> Vec<Clip> {
    let box_of =
        |low: DVec3, high: DVec3| ClipShape::Box(Bounds { min: ORIGIN + low, max: ORIGIN + high });
    let normal = DVec3::new(1.0, -1.0, 0.5);
    vec![
        Clip {
            shape: ClipShape::HalfSpace { normal, offset: normal.dot(ORIGIN) + 0.4 },
            inside: true,
        },
        Clip { shape: box_of(DVec3::splat(-0.8), DVec3::new(0.8, 0.75, 0.7)), inside: true },
        Clip {
            shape: box_of(DVec3::new(-0.2, -0.9, -0.3), DVec3::new(0.5, 0.1, 0.4)),
            inside: false,
        },
        Clip {
            shape: box_of(DVec3::new(0.3, -0.5, 0.1), DVec3::new(0.9, 0.3, 0.9)),
            inside: false,
        },
    ]
}

pub fn clipped_volume() -> Case {
    let scene = volume_scene(cubic(), Kernel::default(), transfer(1.0, Some(Shade::default())));
    case("clipped_volume", scene, Settings { clips: clips(), ..settings() })
}

pub fn clipped_surface_in_a_volume() -> Case {
    case("clipped_surface_in_a_volume", mixed_scene(), Settings { clips: clips(), ..settings() })
}

/// A volume that carries coefficients instead of samples.
pub fn sharp() -> Case {
    let kernel = Kernel::gaussian(0.7, 3.0).expect("a kernel");
    let volume = cubic().sharpened(&kernel).expect("a volume that can be made sharp");
    case("sharp", volume_scene(volume, kernel, transfer(1.0, Some(Shade::default()))), settings())
}

pub fn sharp_body_centred() -> Case {
    let kernel = Kernel::gaussian(0.7, 3.0).expect("a kernel");
    let volume = body_centred_volume().sharpened(&kernel).expect("a volume that can be made sharp");
    case("sharp_body_centred", volume_scene(volume, kernel, transfer(1.0, None)), settings())
}
