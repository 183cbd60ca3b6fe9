//! Items that are moved, hidden, added and removed after a scene is prepared.

use crate::{
    scenes::{self, Case, facets, fields, gaussians, methods},
    testing::{gpu::gpu, psnr::psnr},
};
use glam::{DQuat, DVec3};
use splatkit::{
    Device, ItemId, Renderer,
    gpu::Budget,
    hierarchy::{BuildOptions, Hierarchy, Tree, file},
    input::Limits,
    math::{Bounds, Camera, Clip, ClipShape, Pose, View},
    picture::Picture,
    reference,
    scene::{Item, Scene, Settings},
    splat::Surfels,
    surface::{Mesh, SurfelOptions},
};

/// A turn about a place, and a shift.
fn pose(about: DVec3) -> Pose {
    let rotation = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.8);
    Pose { rotation, translation: DVec3::new(0.1, -0.2, 0.1) + about - rotation * about }
}

fn moved(scene: &Scene, pose: Pose) -> Scene {
    let mut moved = scene.clone();
    for number in 0..scene.items.len() {
        moved.set_pose(number, pose).expect("a pose");
    }
    moved
}

/// Returns a camera that is moved with a scene.
fn along(camera: &Camera, pose: &Pose) -> Camera {
    Camera {
        position: pose.apply(camera.position),
        focal_point: pose.apply(camera.focal_point),
        view_up: pose.rotation * camera.view_up,
        projection: camera.projection,
    }
}

fn devices() -> [Device; 2] {
    [Device::Cpu, Device::Gpu(gpu().clone(), Budget::default())]
}

fn draw(device: &Device, scene: &Scene, camera: &Camera, settings: &Settings) -> Picture {
    let mut renderer = Renderer::new(device, scene).expect("a renderer");
    renderer.render(camera, settings).expect("a picture").0
}

fn hierarchy() -> Case {
    let surfels = Mesh::knot(200, 24).surfels(&SurfelOptions::default()).expect("surfels");
    let tree = Tree::build(&surfels, &BuildOptions::default(), None).expect("a tree");
    let bytes = file::to_bytes(&tree, &file::WriteOptions::default()).expect("the file");
    let hierarchy = Hierarchy::from_bytes(bytes, "knot", &Limits::default()).expect("a hierarchy");
    let scene = Scene::new().with_hierarchy(hierarchy);
    let camera = Camera::fit(&scene, [64, 48]).expect("a camera");
    Case { name: "a hierarchy", scene, camera, settings: Settings::new([64, 48]) }
}

fn cases() -> Vec<Case> {
    vec![
        scenes::ellipsoids_in_perspective(),
        scenes::scattered_samples(),
        scenes::blobs_analytic(),
        scenes::sheared_lattice(),
        scenes::surface_in_a_volume_orthographic(),
        methods::sharp(),
        methods::rectilinear(),
        methods::body_centred(),
        facets::gear(),
        facets::textured(),
        facets::solid(),
        facets::tubes_and_balls(),
        fields::two_volumes(),
        hierarchy(),
        gaussians::all().swap_remove(0),
    ]
}

/// The devices that draw a scene.
fn devices_for(scene: &Scene) -> impl Iterator<Item = Device> {
    let draws = |device: &Device| matches!(device, Device::Cpu) || scene.beyond_gpu().is_none();
    devices().into_iter().filter(draws)
}

/// A scene that is moved looks the same from a camera that is moved along.
#[test]
fn a_scene_and_its_camera_can_be_moved_together() {
    for Case { name, scene, camera, settings } in cases() {
        // A turned box is larger, and so the sheets begin elsewhere: only the shift is exact.
        let shift = Pose { rotation: DQuat::IDENTITY, translation: DVec3::new(1.5, -0.25, 3.0) };
        for device in devices_for(&scene) {
            let expected = draw(&device, &scene, &camera, &settings);
            assert!(expected.color.iter().any(|pixel| pixel[3] > 0.2), "{name}");
            let camera = along(&camera, &shift);
            let picture = draw(&device, &moved(&scene, shift), &camera, &settings);
            let agreement = psnr(&picture, &expected);
            assert!(agreement > 60.0, "{name} on {}: {agreement:.1} dB", device.name());
        }
    }
}

/// Both engines draw a moved scene as the reference defines it.
#[test]
fn moved_items_agree_with_the_reference() {
    for Case { name, scene, camera, settings } in cases() {
        let scene = moved(&scene, pose(scene.bounds().center()));
        let expected = reference::render(&scene, &camera, &settings).expect(name);
        assert!(expected.color.iter().any(|pixel| pixel[3] > 0.2), "{name}");
        for device in devices_for(&scene) {
            let agreement = psnr(&draw(&device, &scene, &camera, &settings), &expected);
            // Textures are sums of texels in the reference, and parallelograms in the engines.
            let least = if name == "textured" { 40.0 } else { 45.0 };
            assert!(agreement > least, "{name} on {}: {agreement:.1} dB", device.name());
        }
    }
}

/// Clips are in the world, wherever a solid is moved to.
#[test]
fn clips_cut_a_moved_solid_where_they_are() {
    let Case { mut scene, camera, settings, .. } = facets::solid();
    let bounds = scene.bounds();
    let normal = DVec3::new(1.0, 0.2, -0.3);
    let offset = normal.dot(bounds.center());
    let plane = Clip { shape: ClipShape::HalfSpace { normal, offset }, inside: true };
    let half = 0.3 * (bounds.max - bounds.min);
    let middle = Bounds { min: bounds.center() - half, max: bounds.center() + half };
    let kept = Clip { shape: ClipShape::Box(middle), inside: true };
    let hole = Clip { inside: false, ..kept };
    scene.set_pose(0, pose(bounds.center())).unwrap();
    for clip in [plane, kept] {
        let settings = Settings { clips: vec![clip], ..settings.clone() };
        let expected = reference::render(&scene, &camera, &settings).unwrap();
        for device in devices() {
            let picture = draw(&device, &scene, &camera, &settings);
            assert!(picture.color.iter().any(|pixel| pixel[3] > 0.9), "{clip:?}");
            let agreement = psnr(&picture, &expected);
            assert!(agreement > 45.0, "{clip:?} on {}: {agreement:.1} dB", device.name());
        }
    }
    let settings = Settings { clips: vec![hole], ..settings };
    for device in devices() {
        let mut renderer = Renderer::new(&device, &scene).unwrap();
        let refused = renderer.render(&camera, &settings).unwrap_err().to_string();
        assert!(refused.contains("cannot be cut out of solid cells that are turned"), "{refused}");
    }
}

/// Items of every kind that both engines draw together, beside each other.
fn every_kind() -> (Vec<(Item, Pose)>, Camera, Settings) {
    let cases = [
        scenes::ellipsoids_in_perspective(),
        facets::gear(),
        facets::textured(),
        facets::solid(),
        scenes::blobs_analytic(),
        hierarchy(),
        gaussians::all().swap_remove(0),
        scenes::scattered_samples(),
    ];
    let (mut items, mut scene) = (Vec::new(), Scene::new());
    for (number, case) in cases.into_iter().enumerate() {
        let bounds = case.scene.bounds();
        let place = DVec3::new((number % 4) as f64, (number / 4) as f64, 0.0);
        let translation = 2.5 * place - bounds.center();
        let pose = Pose { rotation: DQuat::IDENTITY, translation };
        for item in case.scene.items {
            scene.items.push(item.clone());
            scene.set_pose(scene.items.len() - 1, pose).unwrap();
            items.push((item, pose));
        }
    }
    let camera = Camera::fit(&scene, [48, 32]).unwrap();
    (items, camera, Settings::new([48, 32]))
}

fn same(name: &str, device: &Device, renderer: &mut Renderer, view: &View, settings: &Settings) {
    let picture = renderer.render(view, settings).expect(name).0;
    let fresh = Renderer::new(device, &renderer.scene().clone())
        .expect(name)
        .render(view, settings)
        .expect(name)
        .0;
    assert_eq!(picture.color, fresh.color, "{name} on {}", device.name());
    assert_eq!(picture.depth, fresh.depth, "{name} on {}", device.name());
}

/// After each change, the picture has the bytes of a scene that is prepared anew.
#[test]
fn changed_scenes_are_drawn_as_fresh_ones() {
    let (items, camera, settings) = every_kind();
    let view = &camera.view(settings.size).unwrap();
    for device in devices() {
        let mut renderer = Renderer::new(&device, &Scene::new()).unwrap();
        let blank = renderer.render(&camera, &settings).unwrap().0;
        assert!(blank.color.iter().all(|pixel| *pixel == [0.0; 4]));
        let mut ids: Vec<ItemId> = Vec::new();
        for (item, pose) in &items {
            ids.push(renderer.add(item.clone()).unwrap());
            renderer.set_pose(ids[ids.len() - 1], *pose).unwrap();
            renderer.draw(view, &settings).unwrap();
        }
        same("added", &device, &mut renderer, view, &settings);
        let before = renderer.render(view, &settings).unwrap().0;
        for (&id, (_, place)) in ids.iter().zip(&items) {
            renderer.set_visible(id, false).unwrap();
            assert!(!renderer.is_visible(id).unwrap());
            assert!(before.color != renderer.render(view, &settings).unwrap().0.color, "{id:?}");
            // Moved while it is hidden.
            renderer.set_pose(id, pose(DVec3::ZERO).after(place)).unwrap();
            renderer.set_visible(id, true).unwrap();
            renderer.draw(view, &settings).unwrap();
            renderer.set_pose(id, *place).unwrap();
            let back = renderer.render(view, &settings).unwrap().0;
            assert_eq!(back.color, before.color, "{id:?} on {}", device.name());
        }
        for id in [ids[4], ids[0], ids[6], ids[5]] {
            renderer.remove(id).unwrap();
            renderer.draw(view, &settings).unwrap();
            assert!(renderer.remove(id).unwrap_err().to_string().contains("has no item"));
        }
        same("removed", &device, &mut renderer, view, &settings);
        let again = renderer.add(items[4].0.clone()).unwrap();
        renderer.set_pose(again, items[4].1).unwrap();
        assert!(!ids.contains(&again), "names are not used again");
        same("added again", &device, &mut renderer, view, &settings);
        assert_eq!(renderer.items().count(), items.len() - 3);
    }
}

/// What cannot be drawn is refused, and the scene stays as it was.
#[test]
fn what_cannot_be_added_leaves_the_scene_as_it_was() {
    let (items, camera, settings) = every_kind();
    let cells = fields::all().into_iter().flat_map(|case| case.scene.items);
    let cells = cells.into_iter().find(|item| matches!(item, Item::Cells(..))).unwrap();
    let Item::Radiance(surfels) = &items[0].0 else { panic!("surfels") };
    let endless = Surfels { extent: f32::INFINITY, ..Surfels::clone(surfels) };
    for device in devices() {
        let scene =
            Scene::from(items[..2].iter().map(|(item, _)| item.clone()).collect::<Vec<_>>());
        let mut renderer = Renderer::new(&device, &scene).unwrap();
        let before = renderer.render(&camera, &settings).unwrap().0;
        let refused = renderer.add(Item::Radiance(endless.clone().into()));
        let refused = refused.unwrap_err().to_string();
        assert!(refused.contains("extent must lie in 0 … 8, is inf"), "{refused}");
        if let Device::Gpu(..) = device {
            let refused = renderer.add(cells.clone()).unwrap_err().to_string();
            assert!(refused.contains("does not draw cells"), "{refused}");
        }
        let id = ItemId::from(0);
        let wrong = Pose { rotation: DQuat::from_xyzw(1.0, 1.0, 0.0, 0.0), ..Pose::IDENTITY };
        assert!(renderer.set_pose(id, wrong).unwrap_err().to_string().contains("unit length"));
        assert!(renderer.set_transfer(id, items[4].0.transfer().unwrap()).is_err());
        assert_eq!(renderer.render(&camera, &settings).unwrap().0.color, before.color);
        assert_eq!(renderer.items().count(), 2);
    }
}
