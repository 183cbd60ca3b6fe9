//! Opacities that files define: the share of the light that a surface absorbs, at any size of its
//! splats against the pixel.

use crate::{
    scenes::Case,
    testing::{gpu::gpu, psnr::psnr},
};
use glam::{DVec3, Vec2};
use splatkit::{
    cpu::CpuRenderer,
    gpu::Renderer,
    hierarchy::{BuildOptions, Detail, Hierarchy, Tree},
    math::{Camera, Projection},
    picture::Picture,
    reference,
    scene::{Scene, Settings},
    surface::{Material, Mesh, SurfelOptions, Texture},
};
use std::sync::Arc;

/// The opacity of the surfaces, and how far the mean of a picture may be from it.
const OPACITY: f64 = 0.5;
const TOLERANCE: f64 = 0.03;

/// Pixels along each side of a picture.
const SIDE: u32 = 12;

/// The distances between splats, in pixels.
const PITCHES: [f64; 4] = [8.0, 2.0, 0.5, 0.1];

/// A square from −1 to 1 of `count`² vertices, moved by up to a third of their distance.
fn square(count: u32) -> Mesh {
    let step = 2.0 / (count - 1) as f32;
    let noise = |i: u32, factor: f64| ((f64::from(i) * factor).fract() - 0.5) as f32 * 0.67 * step;
    let place = |i: u32| {
        let (column, row) = (i % count, i / count);
        let is_inside = |at: u32| at > 0 && at < count - 1;
        let moved = if is_inside(column) && is_inside(row) {
            Vec2::new(noise(i, 0.754_877_7), noise(i, 0.569_840_3))
        } else {
            Vec2::ZERO
        };
        (Vec2::new(column as f32, row as f32) * step + moved - 1.0).extend(0.0)
    };
    let corners = (0..count - 1).flat_map(|y| (0..count - 1).map(move |x| y * count + x));
    Mesh {
        positions: (0..count * count).map(place).collect(),
        triangles: corners
            .flat_map(|a| [[a, a + 1, a + count + 1], [a, a + count + 1, a + count]])
            .collect(),
        ..Mesh::default()
    }
}

fn material(opacity: f32, texture: Option<Texture>) -> Material {
    Material {
        name: String::new(),
        color: [1.0, 0.5, 0.2, opacity],
        texture: texture.map(Arc::new),
        ..Material::default()
    }
}

/// The ways in which a file defines an opacity of a half.
fn surfaces(count: u32) -> [(&'static str, Mesh, SurfelOptions); 6] {
    let usual = SurfelOptions::default;
    let plain = square(count);
    let colors = vec![[200, 100, 50, 128]; plain.positions.len()];
    let vertices = Mesh { colors: colors.clone(), ..plain.clone() };
    let cloud = Mesh { triangles: Vec::new(), ..vertices.clone() };
    let of_material = Mesh {
        triangle_materials: vec![0; plain.triangles.len()],
        materials: vec![material(0.5, None)],
        ..plain.clone()
    };
    let texture = Texture { width: 4, height: 4, texels: vec![[255, 255, 255, 128]; 16] };
    let textured = Mesh {
        uvs: plain.positions.iter().map(|place| place.truncate() * 0.5 + 0.5).collect(),
        materials: vec![material(1.0, Some(texture))],
        ..of_material.clone()
    };
    // What a file says, and what the options say, multiply.
    let opaque = (2f32.sqrt() / 2.0 * 255.0).round() as u8;
    let both = Mesh { colors: vec![[255, 255, 255, opaque]; colors.len()], ..plain.clone() };
    let thin = |opacity: f32| SurfelOptions {
        optical_depth: -(1.0 - opacity).ln(),
        most_facets: 0,
        ..SurfelOptions::default()
    };
    [
        ("vertices", vertices, usual()),
        ("cloud", cloud, usual()),
        ("material", of_material, usual()),
        ("texture", textured, usual()),
        ("options", plain, thin(0.5)),
        ("options and vertices", both, thin(0.5f32.sqrt())),
    ]
}

/// A camera that sees the middle of the square, in which splats are `pitch` pixels apart.
fn camera(count: u32, pitch: f64, is_oblique: bool) -> Camera {
    let height = 2.0 / f64::from(count - 1) / pitch * f64::from(SIDE);
    let direction = if is_oblique { DVec3::new(0.7, 0.3, 0.65).normalize() } else { DVec3::Z };
    let distance = 3.0;
    let view_angle = 2.0 * (0.5 * height / distance).atan().to_degrees();
    Camera {
        position: distance * direction,
        focal_point: DVec3::ZERO,
        view_up: DVec3::Y,
        projection: match is_oblique {
            true => Projection::Orthographic { height },
            false => Projection::Perspective { view_angle },
        },
    }
}

/// Draws a case by the reference and by both engines. The engines agree with the reference.
fn drawn(case: &Case) -> [Picture; 3] {
    let Case { scene, camera, settings, name } = case;
    let truth = reference::render(scene, camera, settings).expect(name);
    let by_cpu = CpuRenderer::new(scene).expect(name).render(camera, settings).expect(name).0;
    let mut renderer = Renderer::new(gpu());
    let mut prepared = renderer.prepare(scene).expect(name);
    let by_gpu = renderer.render(&mut prepared, camera, settings).expect(name).0;
    for (engine, picture) in [("cpu", &by_cpu), ("gpu", &by_gpu)] {
        let ratio = psnr(picture, &truth);
        assert!(ratio > 50.0, "{name}, {engine}: {ratio} dB");
    }
    [truth, by_cpu, by_gpu]
}

fn mean_opacity(picture: &Picture) -> f64 {
    let sum: f64 = picture.color.iter().map(|color| f64::from(color[3])).sum();
    sum / picture.color.len() as f64
}

#[test]
fn opacities_hold_at_any_size_of_splat() {
    for pitch in PITCHES {
        // More than the picture shows, and no fewer than make a surface.
        let count = ((f64::from(SIDE) / pitch * 1.6) as u32).max(12);
        for (name, mesh, options) in surfaces(count) {
            let is_oblique = name == "vertices";
            let scene = Scene::new().with_splats(mesh.surfels(&options).expect(name));
            let settings = Settings { detail: Detail::Pixels(0.0), ..Settings::new([SIDE; 2]) };
            let case = Case { name, scene, camera: camera(count, pitch, is_oblique), settings };
            for picture in drawn(&case) {
                let mean = mean_opacity(&picture);
                println!("{name}, {pitch} px: {mean:.3}");
                // The area of a point is estimated from its neighbours: less exactly without a
                // grid, and of a few points there is no mean.
                let tolerance = match name {
                    "cloud" if pitch > 1.0 => 0.1,
                    "cloud" => 0.06,
                    _ => TOLERANCE,
                };
                let is_right = (mean - OPACITY).abs() < tolerance;
                assert!(is_right, "{name}, splats {pitch} pixels apart: {mean}");
            }
        }
    }
}

/// Coarse nodes of a hierarchy absorb as much as the splats that they stand for.
#[test]
fn opacities_hold_at_any_level_of_a_hierarchy() {
    let count = 200;
    let (name, mesh, options) = surfaces(count).into_iter().next().expect("a surface");
    let splats = mesh.surfels(&options).expect(name);
    let tree = Tree::build(&splats, &BuildOptions::default(), None).expect(name);
    let scene = Scene::new().with_hierarchy(Hierarchy::from_tree(tree).expect(name));
    for pixels in [0.0, 1.0, 4.0] {
        let settings = Settings { detail: Detail::Pixels(pixels), ..Settings::new([SIDE; 2]) };
        let case = Case { name, scene: scene.clone(), camera: camera(count, 0.1, false), settings };
        for picture in drawn(&case) {
            let mean = mean_opacity(&picture);
            assert!((mean - OPACITY).abs() < TOLERANCE, "cut at {pixels}: {mean}");
        }
    }
}

/// What a mask hides tints nothing, and leaves a hole.
#[test]
fn masks_cut_holes_and_leave_no_fringe() {
    let texels: Vec<[u8; 4]> = (0..64 * 64)
        .map(|at: i32| {
            let (x, y) = (f64::from(at % 64) - 31.5, f64::from(at / 64) - 31.5);
            // The hidden texels are green.
            if x.hypot(y) < 20.0 { [255, 0, 0, 255] } else { [0, 255, 0, 0] }
        })
        .collect();
    let mut mesh = square(2);
    mesh.uvs = mesh.positions.iter().map(|place| place.truncate() * 0.5 + 0.5).collect();
    mesh.triangle_materials = vec![0; 2];
    let texture = Texture { width: 64, height: 64, texels };
    mesh.materials = vec![Material { color: [1.0; 4], ..material(1.0, Some(texture)) }];
    let scene = Scene::new().with_splats(mesh.surfels(&SurfelOptions::default()).expect("surfels"));
    let camera = Camera {
        position: DVec3::Z * 3.0,
        focal_point: DVec3::ZERO,
        view_up: DVec3::Y,
        projection: Projection::Orthographic { height: 2.0 },
    };
    let settings = Settings { surface_shade: None, ..Settings::new([48; 2]) };
    let picture = CpuRenderer::new(&scene).expect("prepares").render(&camera, &settings).unwrap().0;
    let at = |x: usize, y: usize| picture.color[y * 48 + x];
    assert!(at(24, 24)[3] > 0.99 && at(1, 1)[3] < 0.01, "{:?} {:?}", at(24, 24), at(1, 1));
    // A fringe would be half green. Colours of splats are bytes.
    let greenest = picture.color.iter().map(|color| color[1]).fold(0.0, f32::max);
    assert!(greenest < 0.02, "{greenest}");
    // The area of the disc, in squares of the picture's side. Opaque splats at its rim are widened,
    // by less than a pixel.
    let area = |radius: f64| std::f64::consts::PI * radius.powi(2);
    let mean = mean_opacity(&picture);
    let radius = 20.0 / 64.0;
    assert!(area(radius) < mean && mean < area(radius + 1.0 / 48.0), "{mean}");
}
