//! Other lights than that from the eye, and what keeps them away: both engines against the
//! reference, and against what light does.

use crate::{
    scenes::{self, Case, facets, fields, gaussians, methods},
    testing::{gpu::gpu, psnr::psnr},
};
use glam::DVec3;
use splatkit::{
    Device, Renderer,
    cpu::CpuRenderer,
    gpu::Budget,
    math::{Camera, Projection},
    picture::Picture,
    reference,
    scene::{
        Aside, Evaluate, KeyLight, Lighting, Mode, Occlusion, Optics, Order, Scene, Settings, Sky,
    },
    surface::Mesh,
    volume::{Shade, TransferFunction},
};

/// Minimum agreement with the reference, in dB.
const LEAST: f64 = 45.0;

/// A picture size at which the reference takes seconds.
const SIZE: [u32; 2] = [48, 40];

/// All lights at once, with small maps.
fn all_lights() -> Lighting {
    let key = KeyLight { direction: DVec3::new(-0.6, -0.7, -0.5), share: 0.6, shadows: 28 };
    let occlusion = Occlusion { strength: 0.9, radius: 0.3, axes: 2, resolution: 20 };
    Lighting {
        head: 0.25,
        aside: Some(Aside::default()),
        key: Some(key),
        sky: Some(Sky { up: DVec3::new(0.2, 1.0, 0.1), share: 0.4 }),
        occlusion: Some(occlusion),
    }
}

fn lit(case: Case, lighting: Lighting) -> Case {
    let settings = Settings { size: SIZE, lighting, ..case.settings };
    Case { settings, ..case }
}

fn by(device: &Device, case: &Case) -> Picture {
    let mut renderer = Renderer::new(device, &case.scene).expect(case.name);
    renderer.render(&case.camera, &case.settings).expect(case.name).0
}

/// Asserts that both engines draw the reference's picture, and that it is another than that of the
/// light from the eye.
fn check(case: &Case) {
    let truth = reference::render(&case.scene, &case.camera, &case.settings).expect(case.name);
    let plain = Settings { lighting: Lighting::default(), ..case.settings.clone() };
    let plain =
        CpuRenderer::new(&case.scene).and_then(|mut engine| engine.render(&case.camera, &plain));
    let apart = psnr(&truth, &plain.expect(case.name).0);
    assert!(apart < 32.0, "{}: the light changes little, {apart} dB", case.name);
    let mut devices = vec![("CPU", Device::Cpu)];
    if gpu().beyond(&case.scene).is_none() {
        devices.push(("GPU", Device::Gpu(gpu().clone(), Budget::default())));
    }
    for (name, device) in devices {
        let agreement = psnr(&by(&device, case), &truth);
        println!("{} on the {name}: {agreement:.1} dB", case.name);
        // In a medium, the GPU engine draws facets at the back of their sheets.
        let is_behind = name == "GPU" && case.name == "facets_in_a_volume";
        let least = if is_behind { LEAST - 1.0 } else { LEAST };
        assert!(agreement >= least, "{} on the {name}: {agreement} dB", case.name);
    }
}

#[test]
fn volumes() {
    check(&lit(scenes::blobs_analytic(), all_lights()));
    check(&lit(methods::orthographic(methods::isosurfaces_in_fog()), all_lights()));
}

#[test]
fn surfaces() {
    check(&lit(facets::gear(), all_lights()));
    check(&lit(facets::tubes_and_balls(), all_lights()));
    check(&lit(scenes::ellipsoids_in_perspective(), all_lights()));
}

#[test]
fn mixed() {
    check(&lit(facets::facets_in_a_volume(), all_lights()));
    // On the GPU, several fields are scattered.
    let mut two_volumes = lit(fields::two_volumes(), all_lights());
    two_volumes.settings.evaluate = Evaluate::Scatter;
    check(&two_volumes);
    check(&lit(methods::clipped_surface_in_a_volume(), all_lights()));
    let beside_gaussians = gaussians::all().into_iter().find(|case| case.scene.items.len() > 1);
    check(&lit(beside_gaussians.expect("Gaussians beside others"), all_lights()));
}

#[test]
fn one_light_at_a_time() {
    let Lighting { key, sky, occlusion, .. } = all_lights();
    let none = Lighting::head();
    for lighting in [
        Lighting { occlusion, ..none },
        Lighting { key, head: 0.2, ..none },
        Lighting { key: key.map(|key| KeyLight { shadows: 0, ..key }), head: 0.0, ..none },
        Lighting { sky, head: 0.1, ..none },
    ] {
        check(&lit(facets::gear(), lighting));
    }
}

/// A white square in the plane z = `height`, which counts for both of its sides.
fn square(side: f32, height: f32) -> Mesh {
    let corner = |x: f32, y: f32| glam::Vec3::new(x * side, y * side, height);
    Mesh {
        positions: vec![corner(-0.5, -0.5), corner(0.5, -0.5), corner(0.5, 0.5), corner(-0.5, 0.5)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        colors: vec![[255; 4]; 4],
        ..Mesh::default()
    }
}

/// A scene of white meshes.
fn scene(meshes: &[Mesh]) -> Scene {
    meshes.iter().fold(Scene::new(), |scene, mesh| {
        scene.with_facets(mesh.facets(&Default::default()).expect("facets").expect("a mesh"))
    })
}

/// Draws a scene from above, two units wide, in light that is diffuse only. +y is up.
fn from_above(scene: &Scene, lighting: Lighting) -> Picture {
    let camera = Camera {
        position: DVec3::new(0.0, 0.0, 5.0),
        focal_point: DVec3::ZERO,
        view_up: DVec3::Y,
        projection: Projection::Orthographic { height: 2.0 },
    };
    let shade = Shade { ambient: 0.0, diffuse: 1.0, specular: 0.0, power: 1.0, certain: None };
    let settings = Settings { surface_shade: Some(shade), lighting, ..Settings::new([64, 64]) };
    by(&Device::Cpu, &Case { name: "from above", scene: scene.clone(), camera, settings })
}

/// The brightness of a picture from above at a place.
fn at(picture: &Picture, [x, y]: [f64; 2]) -> f64 {
    let pixel = [32.0 + 32.0 * x, 32.0 - 32.0 * y].map(|at| at as usize);
    f64::from(picture.color[pixel[1] * 64 + pixel[0]][0])
}

/// A white prism around the y axis, as high as it is wide: its mesh, and the normal and the middle
/// of each of its sides and of its top.
fn prism(sides: u32, turn: f64) -> (Mesh, Vec<[DVec3; 2]>) {
    let at = |side: f64, y: f64| {
        let angle = std::f64::consts::TAU * side / f64::from(sides) + turn.to_radians();
        DVec3::new(angle.sin(), y, angle.cos())
    };
    let ring = |y: f64| (0..sides).map(move |side| at(f64::from(side), y).as_vec3());
    let mut mesh = Mesh { positions: ring(-1.0).chain(ring(1.0)).collect(), ..Mesh::default() };
    for a in 0..sides {
        let b = (a + 1) % sides;
        mesh.triangles.extend([[a, b, b + sides], [a, b + sides, a + sides]]);
    }
    for a in 1..sides - 1 {
        mesh.triangles.extend([[0, a + 1, a], [sides, sides + a, sides + a + 1]]);
    }
    mesh.colors = vec![[255; 4]; mesh.positions.len()];
    let inner = (0.5 * std::f64::consts::TAU / f64::from(sides)).cos();
    let middles = (0..sides).map(|side| at(f64::from(side) + 0.5, 0.0));
    let faces = middles.map(|normal| [normal, inner * normal]);
    (mesh, faces.chain([[DVec3::Y; 2]]).collect())
}

/// Returns the brightness of the faces of a prism in its usual picture, the top last; `None` for
/// those that are hidden, or nearly.
fn faces_of_prism(
    device: &Device,
    (sides, turn): (u32, f64),
    lighting: Lighting,
) -> Vec<Option<f64>> {
    let (mesh, faces) = prism(sides, turn);
    let scene = scene(&[mesh]);
    let settings = Settings { lighting, ..Settings::new([160, 120]) };
    let camera = Camera::fit(&scene, settings.size).expect("a camera");
    let view = camera.view(settings.size).expect("a view");
    let case = Case { name: "a prism", scene, camera, settings };
    let picture = by(device, &case);
    let brightness = |[normal, middle]: &[DVec3; 2]| {
        let place = view.rotation * (middle - view.position);
        let facing = -(view.rotation * *normal).dot(place.normalize());
        let pixel = (view.center + view.scale * place.truncate() / place.z).as_uvec2();
        let color = picture.color[(pixel.y * 160 + pixel.x) as usize];
        (facing > 0.1).then(|| f64::from(color[0]))
    };
    faces.iter().map(brightness).collect()
}

/// Returns the least difference between faces of a prism that meet, as a part of the brightest, and
/// how bright the darkest is.
fn contrast(faces: &[Option<f64>]) -> [f64; 2] {
    let sides = faces.len() - 1;
    let seen = || faces.iter().flatten().copied();
    let brightest = seen().fold(0.0, f64::max);
    let pairs = (0..sides).flat_map(|side| [[side, (side + 1) % sides], [side, sides]]);
    let difference = |[a, b]: [usize; 2]| Some((faces[a]? - faces[b]?).abs());
    let least = pairs.filter_map(difference).fold(f64::INFINITY, f64::min);
    [least, seen().fold(f64::INFINITY, f64::min)].map(|light| light / brightest)
}

#[test]
fn every_face_of_a_part_is_seen_in_its_usual_picture() {
    // The eye is at 30 degrees. The edge of a prism at 30 degrees is in front, between two sides
    // that are equally turned away from the eye.
    let turns = [(4, 45.0), (4, 30.0), (3, 0.0), (3, 30.0), (6, 0.0), (6, 30.0)];
    for device in [Device::Cpu, Device::Gpu(gpu().clone(), Budget::default())] {
        for prism in turns {
            let faces = faces_of_prism(&device, prism, Lighting::default());
            let [difference, darkest] = contrast(&faces);
            println!("{prism:?}: {difference:.2} {darkest:.2} {faces:.2?}");
            assert!(difference > 0.04 && darkest > 0.35, "{prism:?}: {faces:?}");
        }
    }
    let [difference, _] = contrast(&faces_of_prism(&Device::Cpu, (6, 30.0), Lighting::head()));
    assert!(difference < 0.02, "the eye's light shows an edge in front: {difference}");
}

#[test]
fn a_shadow_lies_where_the_light_leads() {
    // A lamp at 45° from the left: the small square, half a unit up, casts its shadow half a unit
    // to the right.
    let scene = scene(&[square(2.0, 0.0), square(0.4, 0.5)]);
    let key = KeyLight { direction: DVec3::new(-1.0, 0.0, -1.0), share: 1.0, shadows: 256 };
    let lighting = Lighting { head: 0.0, key: Some(key), ..Lighting::head() };
    let picture = from_above(&scene, lighting);
    let cosine = 0.5_f64.sqrt();
    for (place, expected) in [
        ([0.5, 0.0], 0.0),
        ([0.4, 0.1], 0.0),
        ([-0.5, 0.0], cosine),
        ([0.5, 0.35], cosine),
        ([0.85, 0.0], cosine),
        // The upper square itself.
        ([0.0, 0.0], cosine),
    ] {
        let brightness = at(&picture, place);
        assert!((brightness - expected).abs() < 0.02, "{place:?}: {brightness}, not {expected}");
    }
}

#[test]
fn a_plane_in_the_open_is_bright_and_a_corner_is_dimmed() {
    let occlusion = Occlusion { strength: 1.0, radius: 2.0, axes: 64, resolution: 64 };
    let lighting = Lighting { occlusion: Some(occlusion), ..Lighting::head() };
    let plane = from_above(&scene(&[square(2.0, 0.0)]), lighting);
    let brightness = at(&plane, [0.3, 0.1]);
    assert!((brightness - 1.0).abs() < 0.04, "{brightness}");
    // A wall takes half of the light at its foot, and less farther away.
    let mut wall = square(2.0, 0.0);
    for position in &mut wall.positions {
        *position = glam::Vec3::new(-0.5, position.y, position.x + 1.0);
    }
    let corner = from_above(&scene(&[square(2.0, 0.0), wall]), lighting);
    let [near, far] = [-0.42, 0.8].map(|x| at(&corner, [x, 0.0]));
    assert!((0.45..0.7).contains(&near), "{near}");
    assert!(far > near + 0.2 && far < 1.0, "{near} {far}");
}

#[test]
fn fog_dims_what_lies_behind_it() {
    // A slab of fog above the plane takes 1 − e^−τ of the light of a lamp at the zenith.
    let plane = scene(&[square(2.0, 0.0)]);
    let lattice = splatkit::volume::Lattice::cartesian(
        [24, 24, 8],
        DVec3::new(-0.5, -0.5, 0.4),
        glam::DMat3::from_diagonal(DVec3::new(1.0 / 23.0, 1.0 / 23.0, 0.3 / 7.0)),
    );
    let samples = splatkit::volume::Samples::U8(vec![100; lattice.len()]);
    let volume = splatkit::volume::Volume::new(lattice, samples).expect("a volume");
    let depth = 0.8_f64;
    let transfer = TransferFunction {
        color: vec![(0.0, [1.0; 3])],
        opacity: vec![(0.0, 1.0 - (-depth / 0.3).exp())],
        unit: 1.0,
        ..TransferFunction::default()
    };
    let scene = plane.with_volume(volume, Default::default(), transfer);
    // From the lower left, so that the shadow lies beside the fog in the picture.
    let key = KeyLight { direction: DVec3::new(-1.0, 0.0, -0.5), share: 1.0, shadows: 256 };
    let lighting = Lighting { head: 0.0, key: Some(key), ..Lighting::head() };
    let picture = from_above(&scene, lighting);
    let cosine = 0.5 / 1.25_f64.sqrt();
    // The way through the slab is longer by one over the cosine.
    let expected = cosine * (-depth / cosine).exp();
    let brightness = at(&picture, [0.85, 0.0]);
    assert!((brightness - expected).abs() < 0.02, "{brightness}, not {expected}");
}

#[test]
fn lights_stay_with_the_scene_and_follow_its_changes() {
    let scene = scene(&[square(2.0, 0.0), square(0.4, 0.5)]);
    let camera = Camera {
        position: DVec3::new(0.0, -3.0, 4.0),
        focal_point: DVec3::ZERO,
        view_up: DVec3::Y,
        projection: Projection::Perspective { view_angle: 30.0 },
    };
    let settings = Settings { lighting: all_lights(), ..Settings::new(SIZE) };
    for device in [Device::Cpu, Device::Gpu(gpu().clone(), Budget::default())] {
        let anew = |scene: &Scene| {
            let mut renderer = Renderer::new(&device, scene).expect("a renderer");
            renderer.render(&camera, &settings).expect("a picture").0
        };
        let mut renderer = Renderer::new(&device, &scene).expect("a renderer");
        let before = renderer.render(&camera, &settings).expect("a picture").0;
        assert_eq!(before.color, anew(&scene).color);
        let id = renderer.items().nth(1).expect("the upper square");
        renderer.remove(id).expect("removed");
        let after = renderer.render(&camera, &settings).expect("a picture").0;
        let lower = Scene::from(vec![scene.items[0].clone()]);
        assert_eq!(after.color, anew(&lower).color);
        assert_ne!(before.color, after.color);
    }
}

#[test]
fn lights_that_cannot_be_drawn_are_refused() {
    let Case { scene, camera, settings, .. } = facets::gear();
    let refused = |change: fn(&mut Settings)| {
        let mut settings = Settings { lighting: all_lights(), ..settings.clone() };
        change(&mut settings);
        let mut renderer = CpuRenderer::new(&scene).expect("a renderer");
        renderer.render(&camera, &settings).expect_err("an error").to_string()
    };
    for (change, says) in [
        ((|s| s.mode = Mode::Splats(Order::default())) as fn(&mut Settings), "sheets"),
        (|s| s.optics = Optics::XRay, "emission and absorption"),
        (|s| s.lighting.head = f64::NAN, "head"),
        (|s| s.lighting.aside.as_mut().expect("a lamp").share = 1.5, "not 0 to 1"),
        (|s| s.lighting.aside.as_mut().expect("a lamp").direction = DVec3::Z, "behind"),
        (|s| s.lighting.sky = Some(Sky { up: DVec3::ZERO, share: 0.5 }), "no length"),
        (
            |s| s.lighting.occlusion = Some(Occlusion { radius: 0.0, ..Default::default() }),
            "radius",
        ),
        (|s| s.lighting.key.as_mut().expect("a lamp").shadows = 4, "8 to 512 pixels"),
    ] {
        let message = refused(change);
        assert!(message.contains(says), "{message}");
    }
}
