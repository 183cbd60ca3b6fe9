//! Volumes that the CPU engine gathers by sums over samples: those with radial kernels, sharp
//! volumes, and body-centred and rectilinear lattices.

use crate::{
    scenes::{self, Case, methods},
    testing::psnr::measured,
};
use glam::{DMat3, DVec3};
use splatkit::{
    cpu::CpuRenderer,
    math::Kernel,
    picture::Picture,
    reference,
    scene::{Classification, Evaluate, Item, Optics, Scene, Settings},
    volume::{Arrangement, Lattice, Samples, Volume},
};
use std::sync::Arc;

/// Small pictures, because there are many.
const SIZE: [u32; 2] = [40, 32];

fn drawn(case: &Case) -> Picture {
    let settings = Settings { evaluate: Evaluate::Gather, size: SIZE, ..case.settings.clone() };
    CpuRenderer::new(&case.scene)
        .expect(case.name)
        .render(&case.camera, &settings)
        .expect(case.name)
        .0
}

fn truth(case: &Case) -> Picture {
    let settings = Settings { size: SIZE, ..case.settings.clone() };
    reference::render(&case.scene, &case.camera, &settings).expect(case.name)
}

/// The case with another kernel. Its volume is sharpened if `is_sharp`.
fn with_kernel(case: &Case, kernel: &Kernel, is_sharp: bool) -> Case {
    let items = case.scene.items.iter().map(|item| match item {
        Item::Volume(volume, _, transfer) => {
            let mut volume = Volume::clone(volume);
            volume.coefficients = None;
            if is_sharp {
                volume = volume.sharpened(kernel).expect("a sharp volume");
            }
            Item::Volume(volume.into(), kernel.clone(), transfer.clone())
        }
        other => other.clone(),
    });
    let scene = Scene::from(items.collect::<Vec<_>>());
    Case { name: case.name, scene, camera: case.camera.clone(), settings: case.settings.clone() }
}

/// The unlit blobs with random bytes on another lattice, whose border is visible.
fn random(lattice: Lattice) -> Case {
    let case = scenes::blobs_unshaded();
    let mut random = 7u64;
    let values = (0..lattice.len()).map(|_| {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        64 + (random >> 58) as u8 * 2
    });
    let mut volume = Volume::new(lattice, Samples::U8(values.collect())).expect("a volume");
    volume.lattice.origin += scenes::ORIGIN - volume.bounds().center();
    let items = case.scene.items.iter().map(|item| match item {
        Item::Volume(_, kernel, transfer) => {
            Item::Volume(volume.clone().into(), kernel.clone(), transfer.clone())
        }
        other => other.clone(),
    });
    Case { name: "random", scene: Scene::from(items.collect::<Vec<_>>()), ..case }
}

fn edges(dims: [usize; 3]) -> DMat3 {
    DMat3::from_diagonal(DVec3::splat(2.0 / dims.into_iter().max().expect("three axes") as f64))
}

fn cartesian(dims: [usize; 3]) -> Lattice {
    Lattice::cartesian(dims, DVec3::ZERO, edges(dims))
}

fn body_centred(dims: [usize; 3]) -> Lattice {
    Lattice::body_centred(dims, DVec3::ZERO, edges([dims[0], dims[1], dims[2] / 2]))
}

fn rectilinear(dims: [usize; 3], steps: &[f64]) -> Lattice {
    let axis = |count: usize| {
        let mut at = 0.0;
        let places = (0..count).map(|i| {
            at += steps[i % steps.len()];
            at
        });
        places.collect::<Vec<_>>()
    };
    let arrangement = Arrangement::Rectilinear(Arc::new(dims.map(axis)));
    Lattice { arrangement, ..cartesian(dims) }
}

/// Asserts that each gathered picture agrees with the reference to `least(name)` dB or better.
fn agree(cases: impl IntoIterator<Item = (String, Case)>, least: impl Fn(&str) -> f64) {
    let mut failed = Vec::new();
    for (name, case) in cases {
        let truth = truth(&case);
        assert!(truth.color.iter().any(|pixel| pixel[3] > 0.3), "{name}: an empty picture");
        let gathered = measured(&drawn(&case), &truth);
        let line = format!("{name}: {gathered:.1} dB");
        println!("{line}");
        if gathered < least(&name) {
            failed.push(line);
        }
    }
    assert!(failed.is_empty(), "{failed:#?}");
}

fn kernels() -> Vec<(&'static str, Kernel)> {
    let table = || Kernel::table((0..=32).map(|i| 1.0 - f64::from(i) / 32.0).collect(), 2.0);
    let kernels = [
        ("b-spline", Kernel::b_spline(2.0)),
        ("b-spline of 1.5", Kernel::b_spline(1.5)),
        ("b-spline of 3", Kernel::b_spline(3.0)),
        ("hann", Kernel::hann(3.0)),
        ("hann of 2", Kernel::hann(2.0)),
        ("hann of 4", Kernel::hann(4.0)),
        ("table", table()),
        ("gaussian of 1.5", Kernel::gaussian(0.6, 1.5)),
        ("gaussian of 1", Kernel::gaussian(0.6, 1.0)),
        ("wide gaussian", Kernel::gaussian(0.9, 3.0)),
        ("wide gaussian of 2", Kernel::gaussian(0.9, 2.0)),
    ];
    kernels.into_iter().map(|(name, kernel)| (name, kernel.expect(name))).collect()
}

/// Minimum agreement at borders, in dB. Kernels of both signs define no field where too few of them
/// reach. In a single layer of samples, the border of the field then lies inside sheets.
fn least_of_borders(name: &str) -> f64 {
    if name.starts_with("hann") && (name.contains(" 1,") || name.contains(" 1]")) {
        28.0
    } else {
        50.0
    }
}

#[test]
fn radial_kernels_agree_with_the_reference() {
    let named = |(name, kernel): (&'static str, Kernel)| {
        [scenes::blobs_analytic(), scenes::blobs_orthographic()]
            .map(|case| (format!("{name}, {}", case.name), with_kernel(&case, &kernel, false)))
    };
    agree(kernels().into_iter().flat_map(named), |_| 50.0);
}

#[test]
fn other_looks_agree_with_the_reference() {
    let mut post = scenes::blobs_analytic();
    post.settings.classification = Classification::Post;
    let mut maximum = scenes::blobs_unshaded();
    maximum.settings.optics = Optics::Maximum;
    let mut cases = Vec::new();
    for case in [scenes::camera_inside_a_volume(), scenes::sheared_lattice(), post, maximum] {
        for (name, kernel) in kernels() {
            if ["b-spline", "hann", "gaussian of 1.5"].contains(&name) {
                cases.push((format!("{name}, {}", case.name), with_kernel(&case, &kernel, false)));
            }
        }
    }
    agree(cases, |_| 50.0);
}

#[test]
fn borders_and_flat_lattices_agree_with_the_reference() {
    let dims = [[12, 9, 10], [2, 10, 8], [9, 1, 7], [3, 3, 3]];
    let named = |(name, kernel): (&'static str, Kernel)| {
        dims.map(|dims| {
            (format!("{name}, {dims:?}"), with_kernel(&random(cartesian(dims)), &kernel, false))
        })
    };
    agree(kernels().into_iter().flat_map(named), least_of_borders);
}

#[test]
fn body_centred_lattices_agree_with_the_reference() {
    let kernels = kernels().into_iter().chain([("gaussian", Kernel::default())]);
    let named = |(name, kernel): (&'static str, Kernel)| {
        let case = with_kernel(&methods::body_centred(), &kernel, false);
        let random = [[8, 2, 6], [5, 6, 1]].map(|dims| {
            (format!("{name}, {dims:?}"), with_kernel(&random(body_centred(dims)), &kernel, false))
        });
        [(name.to_string(), case)].into_iter().chain(random)
    };
    agree(kernels.flat_map(named), least_of_borders);
}

#[test]
fn rectilinear_lattices_agree_with_the_reference() {
    let steps = [&[1.0][..], &[1.0, 1.3, 1.8, 2.5, 2.0, 1.4], &[1.0, 2.0], &[1.0, 1.0, 1.0, 3.0]];
    let mut cases = vec![("growing steps".to_string(), methods::rectilinear())];
    for steps in steps {
        for dims in [[10, 11, 9], [2, 9, 8], [1, 8, 7]] {
            cases.push((format!("{steps:?}, {dims:?}"), random(rectilinear(dims, steps))));
        }
    }
    // Each long step is three times the one before it. In a single layer, scattering is no closer
    // to the reference.
    agree(cases, |name| if name.contains("3.0], [1,") { 41.0 } else { 50.0 });
}

#[test]
fn sharp_volumes_agree_with_the_reference() {
    let kernels = [
        ("gaussian", Ok(Kernel::default())),
        ("wide gaussian", Kernel::gaussian(0.7, 3.0)),
        ("b-spline", Kernel::b_spline(2.0)),
    ];
    let mut cases = Vec::new();
    for (name, kernel) in kernels {
        let kernel = kernel.expect(name);
        for case in
            [scenes::blobs_analytic(), scenes::blobs_orthographic(), random(cartesian([9, 6, 8]))]
        {
            cases.push((format!("{name}, {}", case.name), with_kernel(&case, &kernel, true)));
        }
        for case in [methods::body_centred(), random(body_centred([7, 6, 11]))] {
            cases.push((
                format!("{name}, body-centred, {}", case.name),
                with_kernel(&case, &kernel, true),
            ));
        }
    }
    agree(cases, |_| 50.0);
}
