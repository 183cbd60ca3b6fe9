//! Volumes and kernels that were built by hand and are inconsistent: every function that takes one
//! returns an error.

use super::{
    Arrangement, Coefficients, Lattice, Reconstruction, Samples, TransferFunction, Volume,
    body_centred,
};
use crate::bricks::{self, Bricks};
use crate::{
    Error, Result,
    about::About,
    formats::nrrd,
    input::testing::Folder,
    math::{Kernel, Profile, Tensor},
    scene::Scene,
};
use glam::DVec3;
use std::{fmt::Debug, path::Path, sync::Arc};

fn good() -> Volume {
    let values = (0..125).map(|i| (i % 11) as f32 / 10.0).collect();
    Volume::new(Lattice::with_spacing([5; 3], DVec3::splat(0.5)), Samples::F32(values)).unwrap()
}

fn scene(volume: Volume, kernel: Kernel) -> Scene {
    let transfer = TransferFunction {
        color: vec![(0.0, [1.0; 3])],
        opacity: vec![(0.0, 0.0), (1.0, 1.0)],
        ..TransferFunction::default()
    };
    Scene::new().with_volume(volume, kernel, transfer)
}

#[track_caller]
fn refused<T: Debug>(name: &str, word: &str, result: Result<T>) {
    match result {
        Err(Error::Argument(message) | Error::Transfer(message)) => {
            assert!(message.contains(word), "{name}: {message}");
        }
        other => panic!("{name}: {other:?}"),
    }
}

/// Passes a volume to every function that takes one.
#[track_caller]
fn refused_by_all(name: &str, word: &str, volume: &Volume) {
    let kernel = Kernel::default();
    let folder = Folder::new();
    let path = |name: &str| folder.path(name);
    let none = |path: &Path| assert!(!path.exists(), "{name}: a file is left");
    refused(name, word, scene(volume.clone(), kernel.clone()).validate());
    refused(name, word, body_centred(volume));
    refused(name, word, Reconstruction::new(volume, &kernel));
    refused(name, word, Bricks::from_volume(Arc::new(volume.clone())));
    let options = bricks::WriteOptions::default();
    refused(name, word, bricks::write(volume, path("a.splv"), &options, None));
    none(&path("a.splv"));
    refused(name, word, nrrd::write(volume, path("a.nrrd")));
    none(&path("a.nrrd"));
    // This has no errors. Only the volume is wrong here, and the function derived from it is still
    // valid.
    TransferFunction::automatic(volume).validate().unwrap();
}

#[test]
fn volumes_are_refused_where_they_come_in() {
    let rectilinear = |places: [Vec<f64>; 3], dims| Lattice {
        arrangement: Arrangement::Rectilinear(Arc::new(places)),
        ..Lattice::with_spacing(dims, DVec3::ONE)
    };
    let two = || vec![0.0, 1.0];
    let spaced = |dims, z| Lattice::with_spacing(dims, DVec3::new(1.0, 1.0, z));
    for (word, lattice) in [
        ("coordinates along x", rectilinear([vec![], vec![], vec![]], [1; 3])),
        ("coordinates along x", rectilinear([vec![0.0], two(), two()], [2; 3])),
        ("must ascend", rectilinear([vec![0.0, f64::NAN], two(), two()], [2; 3])),
        ("must be finite", rectilinear([vec![f64::NAN], two(), two()], [1, 2, 2])),
        ("must ascend", rectilinear([vec![1.0, 0.0], two(), two()], [2; 3])),
        ("holds none", spaced([0, 2, 2], 1.0)),
        ("holds none", spaced([1 << 40, 1 << 40, 0], 1.0)),
        ("memory", spaced([usize::MAX, 2, 2], 1.0)),
        ("memory", spaced([usize::MAX, 1, 1], 1.0)),
        ("do not fill", spaced([2, 2, 3], 1.0)),
        ("needs a length", spaced([2; 3], 0.0)),
        ("must be finite", spaced([2; 3], f64::NAN)),
        ("must be finite", Lattice { origin: DVec3::INFINITY, ..spaced([2; 3], 1.0) }),
    ] {
        let samples = Samples::U8(vec![0, 1, 2, 3, 4, 5, 6, 7]);
        let volume = Volume {
            lattice,
            samples,
            range: [0.0, 7.0],
            coefficients: None,
            colors: None,
            more_channels: Vec::new(),
            opacities: None,
            about: About::default(),
        };
        refused_by_all(&format!("{:?}", volume.lattice), word, &volume);
        refused("sharpened", "", volume.sharpened(&Kernel::default()));
    }
    for (word, samples) in [
        ("3 samples do not fill a lattice of 125", Samples::F32(vec![0.0; 3])),
        ("do not fill", Samples::U16(Vec::new())),
        ("not finite", Samples::F32(vec![f32::NAN; 125])),
    ] {
        let volume = Volume { samples, ..good() };
        refused_by_all("samples", word, &volume);
        refused("sharpened", word, volume.sharpened(&Kernel::default()));
    }
    for range in [[f64::NAN; 2], [1.0, 0.0], [0.0, f64::INFINITY], [0.0, 0.5], [-1.7e308, 1.7e308]]
    {
        let volume = Volume { range, ..good() };
        refused_by_all(&format!("{range:?}"), "the range is", &volume);
        refused("sharpened", "the range is", volume.sharpened(&Kernel::default()));
    }
}

#[test]
fn coefficients_are_looked_at() {
    let kernel = Kernel::default();
    let sharp = good().sharpened(&kernel).unwrap();
    scene(sharp.clone(), kernel.clone()).validate().unwrap();
    let changed = |change: fn(&mut Coefficients)| {
        let mut coefficients = (**sharp.coefficients.as_ref().unwrap()).clone();
        change(&mut coefficients);
        Volume { coefficients: Some(Arc::new(coefficients)), ..sharp.clone() }
    };
    type Change = fn(&mut Coefficients);
    let wrong: [(&str, Change); 9] = [
        ("0 coefficients", |c| c.values.clear()),
        ("with 0 ranges", |c| c.ranges.clear()),
        ("coefficient 3 is NaN", |c| c.values[3] = f32::NAN),
        ("coefficient 5 is inf", |c| c.values[5] = f32::INFINITY),
        ("continued", |c| c.lattice.origin += DVec3::splat(0.5)),
        ("continued", |c| c.lattice.axes.x_axis = DVec3::NAN),
        ("continued", |c| c.lattice.dims = [1000; 3]),
        ("extent", |c| c.kernel.extent = f64::INFINITY),
        ("sigma", |c| c.kernel.profile = Profile::Gaussian(f64::NAN)),
    ];
    for (word, change) in wrong {
        refused_by_all(word, word, &changed(change));
    }
    // After the volume is moved, the coefficients no longer fit, until their lattice is moved too.
    let shift = DVec3::new(1e6, -3e5, 0.1);
    let mut moved = sharp.clone();
    moved.lattice.origin += shift;
    refused("moved", "continued", scene(moved.clone(), kernel.clone()).validate());
    let along = Volume {
        lattice: moved.lattice.clone(),
        ..changed(|c| c.lattice.origin += DVec3::new(1e6, -3e5, 0.1))
    };
    scene(along, kernel.clone()).validate().unwrap();
    // Sharpening again replaces the coefficients.
    let again = moved.sharpened(&kernel).unwrap();
    scene(again, kernel).validate().unwrap();
}

#[test]
fn kernels_are_refused_where_they_come_in() {
    let profiles = [
        Profile::Gaussian(0.6),
        Profile::BSpline,
        Profile::Hann,
        Profile::Table([1.0, 0.0].into()),
    ];
    let profiles = profiles.into_iter().chain(Tensor::ALL.map(Profile::Tensor));
    let extents = [0.0, -1.0, f64::NAN, f64::INFINITY, 1e9];
    let kernels = profiles
        .flat_map(|profile| extents.map(|extent| Kernel { profile: profile.clone(), extent }));
    let odd = [
        Profile::Gaussian(0.0),
        Profile::Gaussian(f64::NAN),
        Profile::Table([].into()),
        Profile::Table([1.0].into()),
        Profile::Table([f64::NAN, 0.0].into()),
    ];
    for kernel in kernels.chain(odd.map(|profile| Kernel { profile, extent: 2.0 })) {
        let volume = good();
        refused(&format!("{kernel:?}"), "", Reconstruction::new(&volume, &kernel));
        refused(&format!("{kernel:?}"), "", volume.clone().sharpened(&kernel));
        refused(&format!("{kernel:?}"), "", scene(volume, kernel.clone()).validate());
    }
}

/// Bricks cannot be built by hand, but the other parts of a scene's item can be wrong.
#[test]
fn bricks_in_a_scene_are_looked_at() {
    let validated = |volume: Volume, kernel: Kernel, change: fn(&mut TransferFunction)| {
        let mut transfer = TransferFunction::automatic(&good());
        change(&mut transfer);
        Scene::new()
            .with_bricks(Bricks::from_volume(Arc::new(volume)).unwrap(), kernel, transfer)
            .validate()
    };
    let far = |x: f64| {
        let mut volume = good();
        volume.lattice.origin.x = x;
        volume
    };
    validated(good(), Kernel::default(), |_| ()).unwrap();
    validated(far(1e6), Kernel::default(), |_| ()).unwrap();
    refused(
        "far",
        "beyond what 32-bit numbers hold",
        validated(far(1e39), Kernel::default(), |_| ()),
    );
    let wide = Kernel { extent: f64::INFINITY, ..Kernel::default() };
    refused("kernel", "extent", validated(good(), wide, |_| ()));
    refused(
        "unit",
        "transfer function",
        validated(good(), Kernel::default(), |transfer| transfer.unit = f64::NAN),
    );
    refused(
        "opacity",
        "transfer function",
        validated(good(), Kernel::default(), |t| t.opacity[0].1 = f64::NAN),
    );
    let steep: fn(&mut TransferFunction) = |transfer| {
        transfer.color = vec![(0.0, [1.0; 3])];
        transfer.opacity = vec![(0.0, 0.0), (1e-9, 1.0)];
    };
    refused("steep", "too close together", validated(good(), Kernel::default(), steep));
}
