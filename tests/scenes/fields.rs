//! Scenes of several fields: lattices, scattered samples and cells, beside surfels and facets.

use super::{
    Case, ORIGIN, ORTHOGRAPHIC, PERSPECTIVE, SLANT, blob_scene, camera, facets, methods,
    mixed_scene, sampled, scattered, transfer,
};
use glam::{DMat3, DVec3, Vec3};
use splatkit::{
    bricks::Bricks,
    cells::{CellKind, CellOptions, Cells, Place, Tetrahedra},
    hierarchy::Detail,
    math::{Kernel, Projection, Tensor},
    scene::{Classification, Evaluate, Gradient, Item, Optics, Scene, Settings},
    splat::SampleSplats,
    volume::{Isosurface, Lattice, Samples, Shade, TransferFunction, Volume},
};
use std::sync::Arc;

/// Smaller pictures than those of other scenes: the reference takes twice as long for two fields.
fn settings() -> Settings {
    Settings { size: [48, 40], ..super::settings() }
}

fn case(name: &'static str, scene: Scene, projection: Projection) -> Case {
    Case { name, scene, camera: camera(SLANT, projection), settings: settings() }
}

/// Green and violet, over values of 0 … 1, without light.
fn cool() -> TransferFunction {
    TransferFunction {
        color: vec![(0.0, [0.1, 0.5, 0.3]), (0.5, [0.2, 0.9, 0.4]), (1.0, [0.6, 0.2, 0.9])],
        opacity: vec![(0.15, 0.0), (0.7, 0.5), (1.0, 0.6)],
        unit: 0.4,
        ..TransferFunction::default()
    }
}

/// A smooth field of 0 … 1 that is largest beside the blobs.
fn wave(at: DVec3) -> f64 {
    let squared = (at - DVec3::new(-0.3, 0.3, 0.2)).length_squared();
    (-1.8 * squared).exp() * (0.8 + 0.2 * (3.0 * at.x - 2.0 * at.z).sin())
}

/// The wave on a sheared lattice that is coarser than that of the blobs, and reaches beyond it.
pub fn other_volume() -> Volume {
    let axes = DMat3::from_cols(
        DVec3::new(0.17, 0.0, 0.02),
        DVec3::new(-0.03, 0.16, 0.0),
        DVec3::new(0.0, 0.04, 0.18),
    );
    let (lattice, values) = sampled([14, 13, 12], axes, |at| wave(at) as f32);
    volume(lattice, values)
}

fn volume(lattice: Lattice, values: Vec<f32>) -> Volume {
    Volume::new(lattice, Samples::F32(values)).expect("the samples fill the lattice")
}

fn two() -> Scene {
    blob_scene().with_volume(other_volume(), Kernel::default(), cool())
}

/// A lit volume and an unlit one on another lattice.
pub fn two_volumes() -> Case {
    case("two_volumes", two(), PERSPECTIVE)
}

/// As many volumes as a picture shows, each moved aside and in a colour of its own.
pub fn most_volumes() -> Case {
    let mut scene = blob_scene();
    for number in 1..Scene::MAX_FIELDS {
        let mut volume = other_volume();
        let turn = DVec3::new(0.05, -0.04, 0.06) * number as f64;
        volume.lattice.origin += turn - DVec3::splat(0.1);
        let color = [1, 2, 4].map(|bit| if number & bit > 0 { 0.9 } else { 0.2 });
        let transfer = TransferFunction { color: vec![(0.0, color)], unit: 1.5, ..cool() };
        scene = scene.with_volume(volume, Kernel::default(), transfer);
    }
    let settings = Settings { size: [28, 22], ..settings() };
    Case { settings, ..case("most_volumes", scene, PERSPECTIVE) }
}

fn with_surfaces() -> TransferFunction {
    let surface = |value: f64, color: [f64; 3], opacity: f64| Isosurface { value, color, opacity };
    let isosurfaces = vec![surface(0.3, [0.9, 0.7, 0.3], 0.4), surface(0.6, [0.3, 0.6, 0.9], 0.7)];
    TransferFunction { isosurfaces, shade: Some(Shade::default()), ..cool() }
}

/// Tetrahedra of a bent tube around the centre of the scenes, with values of 0 … 100.
fn tube(place: Place) -> Tetrahedra {
    let mut cells = Cells::tube(CellKind::Hexahedron, 2).expect("a tube");
    let sum: Vec3 = cells.points.iter().sum();
    let middle = sum / cells.points.len() as f32;
    cells.points.iter_mut().for_each(|point| *point = (*point - middle) * 0.8);
    cells.origin = ORIGIN;
    if place == Place::Cells {
        cells.values = (0..cells.len()).map(|cell| ((cell * 37) % 101) as f32).collect();
        cells.place = place;
    }
    cells.tetrahedra(&CellOptions::default()).expect("tetrahedra")
}

fn of_tube() -> TransferFunction {
    TransferFunction {
        color: vec![(0.0, [0.2, 0.8, 0.9]), (100.0, [0.9, 0.9, 0.2])],
        opacity: vec![(10.0, 0.0), (90.0, 0.5)],
        unit: 0.4,
        shade: Some(Shade::default()),
        ..TransferFunction::default()
    }
}

/// A volume and scattered samples.
fn volume_and_samples() -> Scene {
    Scene::new().with_volume(other_volume(), Kernel::default(), cool()).with_samples(
        scattered(),
        TransferFunction { unit: 0.6, ..transfer(1.0, Some(Shade::default())) },
    )
}

/// Two sets of scattered samples, of which one is moved aside.
fn two_sample_sets() -> Scene {
    let mut moved = scattered();
    for splat in &mut moved.splats {
        splat.center[0] = 0.3 - splat.center[0];
        splat.strength = 1.0 - splat.strength;
    }
    Scene::new().with_samples(scattered(), transfer(1.0, None)).with_samples(moved, cool())
}

/// A volume, a volume in bricks, scattered samples and cells, beside surfels.
fn four() -> Scene {
    let bricks = Bricks::from_volume(Arc::new(other_volume())).expect("bricks");
    mixed_scene()
        .with_bricks(bricks, Kernel::default(), cool())
        .with_samples(scattered(), TransferFunction { unit: 1.2, ..transfer(1.0, None) })
        .with_cells(tube(Place::Points), of_tube())
}

/// A volume, samples on a rectilinear lattice, scattered samples, and a volume in bricks, beside
/// surfels.
fn four_lattices_and_samples() -> Scene {
    let bricks = Bricks::from_volume(Arc::new(other_volume())).expect("bricks");
    let rectilinear = methods::rectilinear().scene.items.remove(0);
    let mut scene = mixed_scene();
    scene.items.push(rectilinear);
    scene
        .with_samples(scattered(), TransferFunction { unit: 1.2, ..transfer(1.0, None) })
        .with_bricks(bricks, Kernel::default(), cool())
}

/// A body-centred and a Cartesian lattice, with kernels of different kinds.
fn two_arrangements() -> Scene {
    let mut scene = methods::body_centred().scene;
    let Item::Volume(volume, ..) = &methods::b_spline().scene.items[0] else { panic!("a volume") };
    let kernel = Kernel::b_spline(2.0).expect("a kernel");
    scene.items.push(Item::Volume(volume.clone(), kernel, with_surfaces()));
    scene
}

/// Two cubic lattices, of which the second is moved and has a factor on its gradients.
fn two_cubic() -> Scene {
    let mut scene = blob_scene();
    let Item::Volume(volume, kernel, transfer) = &scene.items[0] else { panic!("a volume") };
    let mut moved = (**volume).clone();
    moved.lattice.origin += DVec3::new(0.25, -0.15, 0.1);
    let high = moved.range[1];
    let transfer = TransferFunction {
        color: vec![(0.0, [0.2, 0.9, 0.4]), (high, [0.6, 0.2, 0.9])],
        gradient: vec![(0.0, 0.3), (1.5 * high, 1.0)],
        ..transfer.clone()
    };
    let other = Item::Volume(Arc::new(moved), kernel.clone(), transfer);
    scene.items.push(other);
    scene
}

/// Two volumes, with a set of samples between them that has none.
fn around_nothing() -> Scene {
    let nothing = SampleSplats { splats: Vec::new(), ..scattered() };
    blob_scene().with_samples(nothing, transfer(1.0, None)).with_volume(
        other_volume(),
        Kernel::default(),
        with_surfaces(),
    )
}

/// From far away, where sections of round kernels are the same for all pixels.
fn from_afar(mut case: Case) -> Case {
    case.camera.position = ORIGIN + 30.0 * SLANT;
    case.camera.projection = Projection::Perspective { view_angle: 1.0 };
    case
}

/// Pictures with fields that scatter their samples, because of the settings.
fn scattered_fields() -> Vec<Case> {
    let scatter = Settings { evaluate: Evaluate::Scatter, ..settings() };
    let central = Settings { gradient: Gradient::Central, size: [42, 36], ..settings() };
    vec![
        Case { settings: scatter, ..case("two_volumes_scattered", two(), PERSPECTIVE) },
        Case { settings: central, ..case("two_volumes_central", two(), PERSPECTIVE) },
        case("volume_and_samples", volume_and_samples(), PERSPECTIVE),
        case("volume_and_samples_orthographic", volume_and_samples(), ORTHOGRAPHIC),
        case("two_sample_sets", two_sample_sets(), PERSPECTIVE),
    ]
}

/// The reference draws the finest level of bricks.
fn finest() -> Settings {
    Settings { detail: Detail::Pixels(0.0), ..settings() }
}

pub fn four_without_cells() -> Case {
    let scene = four_lattices_and_samples();
    Case { settings: finest(), ..case("four_without_cells", scene, PERSPECTIVE) }
}

pub fn all() -> Vec<Case> {
    let clips = methods::clipped_volume().settings.clips;
    let clipped = Settings { clips, ..settings() };
    let xray = Settings { optics: Optics::XRay, ..settings() };
    let finest = finest();
    let post = Settings { classification: Classification::Post, ..settings() };
    let with_isosurfaces =
        || blob_scene().with_volume(other_volume(), Kernel::default(), with_surfaces());
    let kernels = blob_scene().with_volume(
        other_volume(),
        Kernel::tensor(Tensor::CubicBSpline),
        TransferFunction { gradient: vec![(0.0, 0.3), (1.5, 1.0)], ..cool() },
    );
    let beside_surfels =
        || mixed_scene().with_volume(other_volume(), Kernel::default(), with_surfaces());
    let beside_cells = |place| blob_scene().with_cells(tube(place), of_tube());
    let facets = facets::facets_in_a_volume().scene;
    let mut all = vec![
        two_volumes(),
        most_volumes(),
        case("two_volumes_orthographic", two(), ORTHOGRAPHIC),
        Case { settings: post, ..case("two_volumes_post", two(), PERSPECTIVE) },
        Case { settings: xray, ..case("two_volumes_in_x_rays", two(), PERSPECTIVE) },
        Case { settings: clipped.clone(), ..case("two_clipped_volumes", two(), PERSPECTIVE) },
        case("two_volumes_with_isosurfaces", with_isosurfaces(), PERSPECTIVE),
        case("two_volumes_of_two_kernels", kernels, PERSPECTIVE),
        case("surfels_in_two_volumes", beside_surfels(), PERSPECTIVE),
        Case {
            settings: clipped,
            ..case("clipped_surfels_in_two_volumes", beside_surfels(), PERSPECTIVE)
        },
        case(
            "facets_in_two_volumes",
            facets.with_volume(other_volume(), Kernel::default(), cool()),
            PERSPECTIVE,
        ),
        case("a_volume_and_cells", beside_cells(Place::Points), PERSPECTIVE),
        case("a_volume_and_values_of_cells", beside_cells(Place::Cells), ORTHOGRAPHIC),
        Case { settings: finest, ..case("four_fields", four(), PERSPECTIVE) },
        four_without_cells(),
        case("two_arrangements", two_arrangements(), PERSPECTIVE),
        case("two_cubic_volumes_orthographic", two_cubic(), ORTHOGRAPHIC),
        from_afar(case("two_cubic_volumes_from_afar", two_cubic(), PERSPECTIVE)),
        case("volumes_around_an_empty_set", around_nothing(), PERSPECTIVE),
        from_afar(case("two_volumes_from_afar", two(), PERSPECTIVE)),
        from_afar(case("two_arrangements_from_afar", two_arrangements(), PERSPECTIVE)),
    ];
    all.extend(scattered_fields());
    all
}
