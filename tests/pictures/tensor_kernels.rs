//! Kernels that are products along the axes of a lattice, drawn by the CPU engine and compared to
//! the reference in double precision.

use crate::{
    scenes::{self, Case, methods},
    testing::psnr::measured,
};
use glam::{DMat3, DVec3};
use splatkit::{
    cpu::CpuRenderer,
    math::{Kernel, Tensor},
    picture::Picture,
    reference,
    scene::{Classification, Item, Mode, Order, Scene, Settings},
    volume::{Lattice, Reconstruction, Samples, Volume},
};

/// Small pictures, because there are many.
const SIZE: [u32; 2] = [40, 32];

/// The kernels, and whether the volume is sharpened.
const KERNELS: [(Tensor, bool); 4] = [
    (Tensor::Linear, false),
    (Tensor::CatmullRom, false),
    (Tensor::CubicBSpline, false),
    (Tensor::CubicBSpline, true),
];

/// The case with another kernel. Its volume is sharpened if `is_sharp`.
fn with_kernel(case: &Case, tensor: Tensor, is_sharp: bool) -> Case {
    let kernel = Kernel::tensor(tensor);
    let items = case.scene.items.iter().map(|item| match item {
        Item::Volume(volume, _, transfer) => {
            let mut volume = Volume::clone(volume);
            volume.coefficients = None;
            if is_sharp {
                volume = volume.sharpened(&kernel).expect("a sharp volume");
            }
            Item::Volume(volume.into(), kernel.clone(), transfer.clone())
        }
        other => other.clone(),
    });
    let scene = Scene::from(items.collect::<Vec<_>>());
    let settings = Settings { size: SIZE, ..case.settings.clone() };
    Case { name: case.name, scene, camera: case.camera.clone(), settings }
}

/// A case with random bytes on a lattice of `dims` samples, whose border is visible.
fn border(dims: [usize; 3]) -> Case {
    let case = scenes::blobs_analytic();
    let edge = 2.0 / dims.into_iter().max().expect("three axes") as f64;
    let axes = DMat3::from_diagonal(DVec3::splat(edge));
    let mut random = 7u64;
    let values = (0..dims.iter().product()).map(|_| {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        64 + (random >> 58) as u8 * 2
    });
    let first = scenes::ORIGIN - 0.5 * (axes * DVec3::from(dims.map(|n| n as f64 - 1.0)));
    let volume = Volume::new(Lattice::cartesian(dims, first, axes), Samples::U8(values.collect()))
        .expect("a volume");
    let items = case.scene.items.iter().map(|item| match item {
        Item::Volume(_, kernel, transfer) => {
            Item::Volume(volume.clone().into(), kernel.clone(), transfer.clone())
        }
        other => other.clone(),
    });
    let settings = Settings { volume_shade: Some(None), ..case.settings.clone() };
    Case { name: "border", scene: Scene::from(items.collect::<Vec<_>>()), settings, ..case }
}

fn drawn(case: &Case) -> splatkit::Result<Picture> {
    Ok(CpuRenderer::new(&case.scene)?.render(&case.camera, &case.settings)?.0)
}

/// Agreement of the CPU engine with the reference, in dB.
fn agreement(case: &Case) -> f64 {
    let picture = drawn(case).expect(case.name);
    let truth = reference::render(&case.scene, &case.camera, &case.settings).expect(case.name);
    assert!(truth.color.iter().any(|pixel| pixel[3] > 0.3), "{}: an empty picture", case.name);
    measured(&picture, &truth)
}

fn agree(cases: impl Iterator<Item = Case>, least: impl Fn(&str, Tensor) -> f64) {
    let mut failed = Vec::new();
    for case in cases {
        for (tensor, is_sharp) in KERNELS {
            let case = with_kernel(&case, tensor, is_sharp);
            let agreement = agreement(&case);
            let line = format!(
                "{} {}{}: {agreement:.1} dB",
                case.name,
                tensor.name(),
                ["", " sharp"][usize::from(is_sharp)]
            );
            println!("{line}");
            if agreement < least(case.name, tensor) {
                failed.push(line);
            }
        }
    }
    assert!(failed.is_empty(), "{failed:?}");
}

#[test]
fn pictures_agree_with_the_reference() {
    let mut kept = methods::clipped_volume();
    kept.settings.clips.retain(|clip| clip.inside);
    let cases = [
        scenes::blobs_analytic(),
        scenes::blobs_orthographic(),
        scenes::blobs_unshaded(),
        scenes::camera_inside_a_volume(),
        scenes::marschner_lobb(),
        scenes::sheared_lattice(),
        scenes::constant_field(),
        methods::thin_shells(),
        methods::post_classified(),
        methods::gradient_opacity(),
        methods::isosurfaces_in_fog(),
        methods::maximum(),
        methods::x_ray(),
        kept,
    ];
    agree(cases.into_iter(), |_, _| 50.0);
}

#[test]
fn borders_and_flat_lattices_agree_with_the_reference() {
    let dims = [[12, 9, 10], [2, 10, 8], [8, 2, 2], [9, 1, 7], [1, 6, 1], [1, 1, 1], [3, 3, 3]];
    agree(dims.into_iter().map(border), |_, _| 50.0);
}

/// The field passes through the samples, also at the border.
#[test]
fn fields_pass_through_the_samples() {
    for dims in [[6, 5, 7], [2, 4, 1]] {
        let case = border(dims);
        for (tensor, is_sharp) in
            KERNELS.into_iter().filter(|(tensor, is_sharp)| *is_sharp || tensor.interpolates())
        {
            let case = with_kernel(&case, tensor, is_sharp);
            let [Item::Volume(volume, kernel, _)] = case.scene.items.as_slice() else {
                panic!("no volume")
            };
            let field = Reconstruction::new(volume, kernel).expect("a field");
            for at in 0..volume.len() {
                let value = field.value_at(volume.lattice.sample_position(at)).expect("a value");
                assert!(
                    (value - volume.value(at)).abs() < 1e-4,
                    "{tensor:?} {dims:?} at {at}: {value}"
                );
            }
        }
    }
}

/// If a setting or lattice cannot be drawn with tensor products, the error names it.
#[test]
fn what_does_not_go_with_them_is_told() {
    let refused = |case: &Case, what: &str| {
        let case = with_kernel(case, Tensor::CatmullRom, false);
        let by_reference = reference::render(&case.scene, &case.camera, &case.settings);
        for error in [drawn(&case).map(|_| ()), by_reference.map(|_| ())]
            .map(|result| result.expect_err(case.name))
        {
            assert!(error.to_string().contains(what), "{}: {error}", case.name);
        }
    };
    let with = |change: fn(&mut Settings)| {
        let mut case = scenes::blobs_analytic();
        change(&mut case.settings);
        case
    };
    refused(
        &with(|settings| settings.classification = Classification::Pre),
        "classified after interpolation",
    );
    refused(&with(|settings| settings.mode = Mode::AxisSheets), "classified after interpolation");
    refused(
        &with(|settings| settings.mode = Mode::Splats(Order::FrontToBack)),
        "classified after interpolation",
    );
    for case in [methods::rectilinear(), methods::body_centred()] {
        let case = with_kernel(&case, Tensor::Linear, false);
        let [Item::Volume(volume, kernel, _)] = case.scene.items.as_slice() else {
            panic!("no volume")
        };
        let error =
            reference::render(&case.scene, &case.camera, &case.settings).expect_err(case.name);
        assert!(error.to_string().contains("Cartesian"), "{error}");
        assert!(Reconstruction::new(volume, kernel).is_err() && drawn(&case).is_err());
        assert!(Volume::clone(volume).sharpened(kernel).is_err());
    }
}
