//! Trained Gaussians: seen in perspective and in parallel, as whole splats, clipped, from among
//! them, and beside other items.

use super::{
    Case, ORIGIN, ORTHOGRAPHIC, PERSPECTIVE, Random, SLANT, camera, facets::facets_in_a_volume,
    mixed_scene, settings,
};
use glam::{DVec3, Quat, Vec3};
use splatkit::{
    gaussians::{Gaussians, harmonics::terms},
    hierarchy::{BuildOptions, Detail, Hierarchy, Tree},
    math::Projection,
    scene::{Clip, ClipShape, Mode, Optics, Order, Scene, Settings},
};

/// Gaussians of every shape, round, flat and long, with opacities from 0 to 1, and colours of
/// degree 3, some brighter than 1.
pub fn trained(count: usize) -> Gaussians {
    let mut random = Random(11);
    let mut set = Gaussians { origin: ORIGIN, degree: 3, ..Gaussians::default() };
    for _ in 0..count {
        set.centers.push(random.point(0.9));
        let mut side = || 0.1 * random.within(-2.5, 0.0).exp();
        set.scales.push(Vec3::new(side(), side(), side()));
        let [x, y, z, w] = std::array::from_fn(|_| random.within(-1.0, 1.0));
        set.rotations.push(Quat::from_xyzw(x, y, z, w).normalize());
        set.opacities.push(random.within(0.0, 1.0));
        for term in 0..terms(set.degree) {
            let most = if term == 0 { 2.0 } else { 0.25 };
            set.harmonics.push(std::array::from_fn(|_| random.within(-0.8 * most, most)));
        }
    }
    set
}

fn case(name: &'static str, scene: Scene, projection: Projection) -> Case {
    Case { name, scene, camera: camera(SLANT, projection), settings: settings() }
}

fn alone() -> Scene {
    Scene::new().with_gaussians(trained(400))
}

/// A hierarchy of several blocks.
fn hierarchy(set: Gaussians) -> Hierarchy {
    let options = BuildOptions { block_splats: 100, ..BuildOptions::default() };
    let tree = Tree::of_gaussians(&set, &options, None).expect("a tree");
    Hierarchy::from_tree(tree).expect("a hierarchy")
}

/// A hierarchy of them, drawn at a cut of some pixels.
fn levels(name: &'static str, pixels: f64) -> Case {
    let scene = Scene::new().with_hierarchy(hierarchy(trained(400)));
    let mut case = case(name, scene, PERSPECTIVE);
    case.settings.detail = Detail::Pixels(pixels);
    case
}

pub fn all() -> Vec<Case> {
    let perspective = |name| case(name, alone(), PERSPECTIVE);
    let single = |order| Settings { mode: Mode::Splats(order), ..settings() };
    let clip = |shape, inside| Clip { shape, inside };
    let half = ClipShape::HalfSpace { normal: DVec3::new(0.4, 0.2, 1.0), offset: ORIGIN.z };
    let mut among = perspective("camera_among_gaussians");
    among.camera =
        camera(DVec3::new(0.15, -0.1, 0.05), Projection::Perspective { view_angle: 70.0 });
    let mut clipped = perspective("clipped_gaussians");
    clipped.settings.clips = vec![clip(half, false)];
    let mut thin = perspective("gaussians_in_thin_sheets");
    thin.settings.sheet_pixels = 0.5;
    let everything = facets_in_a_volume()
        .scene
        .with_gaussians(trained(200))
        .with_hierarchy(hierarchy(trained(100)));
    let xray = Settings { optics: Optics::XRay, ..settings() };
    vec![
        perspective("gaussians"),
        case("gaussians_orthographic", alone(), ORTHOGRAPHIC),
        thin,
        among,
        clipped,
        Case { settings: xray, ..perspective("gaussians_in_x_rays") },
        Case { settings: single(Order::FrontToBack), ..perspective("whole_gaussians") },
        Case { settings: single(Order::BackToFront), ..perspective("whole_gaussians_from_behind") },
        levels("levels_of_gaussians", 0.0),
        levels("coarse_levels_of_gaussians", 6.0),
        case("gaussians_in_a_volume", mixed_scene().with_gaussians(trained(200)), PERSPECTIVE),
        case("gaussians_among_everything", everything, PERSPECTIVE),
    ]
}
