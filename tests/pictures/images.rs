//! Textures on facets: how far both engines are from many rays a pixel.

use crate::{
    scenes::facets::textured,
    testing::{gpu::gpu, psnr::psnr},
};
use glam::{DVec3, Vec2, Vec3};
use splatkit::{
    cpu::CpuRenderer,
    facet::FacetSet,
    gpu::{Budget, Renderer},
    math::{Camera, Projection},
    reference,
    scene::{Scene, Settings},
    surface::{Material, Mesh, SurfelOptions, Texture},
};
use std::sync::Arc;

/// A picture of waves, a grid of thin lines, and holes if it is a mask.
fn texture(is_mask: bool) -> Texture {
    let (width, height) = (200, 300);
    let wave = |at: u32, by: f32| 128.0 + 90.0 * (at as f32 / by).sin();
    let texel = |i: u32| {
        let (x, y) = (i % width, i / width);
        if x % 20 == 0 || y % 25 < 2 {
            return [20, 30, 60, 255];
        }
        let alpha = if is_mask && (x / 17 + y / 19) % 3 == 0 { 0 } else { 255 };
        [wave(x, 7.0) as u8, wave(y, 11.0) as u8, wave(x + y, 40.0) as u8, alpha]
    };
    Texture { width, height, texels: (0..width * height).map(texel).collect() }
}

/// A square from −1 to 1 of few triangles, on which the picture is repeated.
fn floor(is_mask: bool, repeats: f32) -> Mesh {
    let count = 5u32;
    let place = |i: u32| Vec2::new((i % count) as f32, (i / count) as f32) / 2.0 - 1.0;
    let corners = (0..count - 1).flat_map(|y| (0..count - 1).map(move |x| y * count + x));
    let triangles: Vec<[u32; 3]> =
        corners.flat_map(|a| [[a, a + 1, a + count + 1], [a, a + count + 1, a + count]]).collect();
    let positions: Vec<Vec3> = (0..count * count).map(|i| place(i).extend(0.0)).collect();
    Mesh {
        uvs: positions.iter().map(|at| repeats * (at.truncate() * 0.5 + 0.5)).collect(),
        triangle_materials: vec![0; triangles.len()],
        materials: vec![Material {
            color: [1.0, 0.9, 0.8, 1.0],
            texture: Some(Arc::new(texture(is_mask))),
            ..Material::default()
        }],
        positions,
        triangles,
        ..Mesh::default()
    }
}

fn facets(mesh: &Mesh) -> FacetSet {
    mesh.facets(&SurfelOptions::default()).expect("facets").expect("a textured mesh has facets")
}

/// The views: how the camera looks at the middle, from where, and whether in perspective.
fn views() -> [(&'static str, Camera); 4] {
    let camera = |position: [f64; 3], projection| Camera {
        position: DVec3::from(position),
        focal_point: DVec3::ZERO,
        view_up: DVec3::Z,
        projection,
    };
    let near = Projection::Perspective { view_angle: 40.0 };
    let inside = camera([0.9, -0.5, 0.2], Projection::Perspective { view_angle: 70.0 });
    [
        ("from above", camera([0.2, -1.1, 2.4], near)),
        ("at a slant", camera([1.7, -2.0, 0.5], near)),
        ("without perspective", camera([2.0, 1.0, 1.4], Projection::Orthographic { height: 1.9 })),
        // Some corners lie behind the eye.
        ("among the corners", inside),
    ]
}

#[test]
fn textures_look_as_many_rays_see_them() {
    for (is_mask, repeats) in [(false, 1.0), (true, 1.5), (false, 6.0)] {
        let scene = Scene::new().with_facets(facets(&floor(is_mask, repeats)));
        let mut cpu = CpuRenderer::new(&scene).expect("a scene");
        let gpu = gpu();
        let mut renderer = Renderer::new(gpu);
        let mut prepared = renderer.prepare(&scene).expect("a scene");
        for (name, camera) in views() {
            let settings = Settings::new([72, 48]);
            let truth = reference::render(&scene, &camera, &settings).expect(name);
            let by_cpu = cpu.render(&camera, &settings).expect(name).0;
            let by_gpu = renderer.render(&mut prepared, &camera, &settings).expect(name).0;
            let both = psnr(&by_cpu, &by_gpu);
            let [by_cpu, by_gpu] = [by_cpu, by_gpu].map(|picture| psnr(&picture, &truth));
            println!(
                "{name}, mask {is_mask}, {repeats}×: CPU {by_cpu:.1} dB, GPU {by_gpu:.1} dB, \
                 {both:.1}"
            );
            assert!(by_cpu > 36.0, "{name}, mask {is_mask}, {repeats}×: {by_cpu:.1} dB");
            assert!(by_gpu > 36.0, "{name}, mask {is_mask}, {repeats}×, GPU: {by_gpu:.1} dB");
            assert!(both > 60.0, "{name}, mask {is_mask}, {repeats}×: the engines {both:.1} dB");
        }
    }
}

/// The way that GPUs go, tried on this driver.
#[test]
fn tiles_that_load_together_show_images() {
    let case = textured();
    let budget = Budget { staged: Some(true), ..Budget::default() };
    let mut renderer = Renderer::with_budget(gpu(), budget);
    let mut prepared = renderer.prepare(&case.scene).expect("a scene");
    let by_gpu = renderer.render(&mut prepared, &case.camera, &case.settings).expect("a picture").0;
    let mut cpu = CpuRenderer::new(&case.scene).expect("a scene");
    let by_cpu = cpu.render(&case.camera, &case.settings).expect("a picture").0;
    let truth = reference::render(&case.scene, &case.camera, &case.settings).expect("a picture");
    let ratios = [psnr(&by_cpu, &truth), psnr(&by_gpu, &truth), psnr(&by_cpu, &by_gpu)];
    println!("CPU, GPU, both: {ratios:.1?} dB");
    assert!(ratios[0] > 37.0 && ratios[1] > 37.0 && ratios[2] > 60.0, "{ratios:?}");
}

/// The picture decides how much of a texture is seen: facets are cut for no texel.
#[test]
fn textured_triangles_stay_whole() {
    let mesh = floor(true, 1.0);
    let plain = Mesh { materials: Vec::new(), triangle_materials: Vec::new(), ..mesh.clone() };
    let (set, plain) = (facets(&mesh), facets(&plain));
    assert_eq!(set.facets.len(), plain.facets.len());
    assert_eq!((set.texture_coordinates.len(), set.images.len()), (set.facets.len(), 1));
    assert!(plain.texture_coordinates.is_empty() && plain.images.is_empty());
    let levels: u64 = set.images.iter().map(|image| image.bytes()).sum();
    assert!(levels < 4 * 200 * 300 / 2, "{levels}");
}

/// What shows no part of an image that there is cannot be drawn.
#[test]
fn images_are_checked() {
    let set = facets(&floor(false, 1.0));
    let refused = |change: fn(&mut FacetSet)| {
        let mut set = set.clone();
        change(&mut set);
        Scene::new().with_facets(set).validate().expect_err("an error").to_string()
    };
    assert!(refused(|set| set.texture_coordinates[3].image = 1).contains("facet 3 shows no part"));
    assert!(
        refused(|set| set.texture_coordinates[0].places[1].x = f32::NAN)
            .contains("facet 0 shows no part")
    );
    assert!(refused(|set| set.texture_coordinates.truncate(1)).contains("facets show images"));
}
