//! Layers of a picture: normals, albedo and identifiers.

use crate::testing::gpu::gpu;
use glam::{DVec3, Vec3};
use splatkit::{
    Device, Renderer,
    facet::{FacetSet, Rod},
    gpu::Budget,
    math::{Bounds, Camera, Kernel},
    picture::{Layers, Picture},
    scene::{Scene, Settings},
    session::{Drawing, Layer},
    volume::{TransferFunction, phantoms::Phantom},
};
use std::ops::Range;

fn devices() -> [Device; 2] {
    [Device::Cpu, Device::Gpu(gpu().clone(), Budget::default())]
}

fn camera() -> Camera {
    let around = Bounds { min: DVec3::new(-2.0, -1.0, -1.0), max: DVec3::new(2.0, 1.0, 1.0) };
    Camera::framing(&around, DVec3::new(0.2, -0.3, -1.0).normalize(), DVec3::Y, 1.0)
}

/// Returns the layers of a picture of 48 × 48 pixels, and the picture.
fn layers_of(device: &Device, scene: &Scene, inputs: &[Range<usize>]) -> (Layers, Picture) {
    let (camera, settings) = (camera(), Settings::new([96, 96]));
    let drawing = Drawing { settings, factor: 2, edge_width: 1.0, eye_dome: 0.0, outlines: None };
    let mut draw = |part: Option<&Scene>, settings: &Settings| {
        let mut renderer = Renderer::new(device, part.unwrap_or(scene))?;
        Ok(renderer.render(&camera, settings)?.0)
    };
    let picture = draw(None, &drawing.settings).unwrap().reduced(2).unwrap();
    let layers = drawing.layers(&Layer::ALL, &camera, (scene, inputs), &mut draw).unwrap();
    (layers, picture)
}

/// Returns the place in the world that a pixel shows.
fn place(picture: &Picture, at: usize) -> DVec3 {
    let view = camera().view([48, 48]).unwrap();
    let pixel = glam::DVec2::new((at % 48) as f64 + 0.5, (at / 48) as f64 + 0.5);
    let z = f64::from(picture.depth[at]);
    let across = (pixel - view.center) / view.scale * z;
    view.position + view.rotation.transpose() * across.extend(z)
}

/// Whether the pixels around one show the same.
fn is_inside(identifiers: &[u32], at: usize) -> bool {
    let around = [at - 49, at - 48, at - 47, at - 1, at + 1, at + 47, at + 48, at + 49];
    around.iter().all(|other| identifiers[*other] == identifiers[at])
}

#[test]
fn balls_have_normals_albedo_and_numbers() {
    let ball = |x: f32, color| {
        FacetSet::of_rods(DVec3::ZERO, vec![Rod::ball(Vec3::X * x, 0.9, color).into()])
    };
    let colors = [[200, 100, 50], [20, 200, 20u8]];
    let scene = Scene::new().with_facets(ball(-1.0, colors[0])).with_facets(ball(1.0, colors[1]));
    for device in devices() {
        let (layers, picture) = layers_of(&device, &scene, &[0..1, 1..1, 1..2]);
        let (normals, albedo) = (layers.normals.unwrap(), layers.albedo.unwrap());
        let identifiers = layers.identifiers.unwrap();
        assert_eq!([normals.len(), albedo.len(), identifiers.len()], [48 * 48; 3]);
        assert_eq!((identifiers[0], normals[0], albedo[0]), (0, [0.0; 3], [0.0; 4]));
        for (number, x, color) in [(1, -1.0, colors[0]), (3, 1.0, colors[1])] {
            let shows = |at: &usize| identifiers[*at] == number && is_inside(&identifiers, *at);
            let inside: Vec<usize> = (49..48 * 47).filter(shows).collect();
            assert!(inside.len() > 100, "{}", inside.len());
            for at in inside {
                let wanted = (place(&picture, at) - DVec3::X * x).normalize();
                let normal = Vec3::from_array(normals[at]).as_dvec3();
                assert!(normal.dot(wanted) > 0.98, "{device:?}: {normal} {wanted}");
                for (part, wanted) in albedo[at].iter().zip(color) {
                    assert!((part * 255.0 - f32::from(wanted)).abs() < 2.0, "{:?}", albedo[at]);
                }
            }
        }
    }
}

/// Light on a field fades where its gradient may be noise; its normals do not.
#[test]
fn fields_have_normals() {
    let volume = Phantom::Ball.sample_bytes([24; 3]).unwrap();
    let center = volume.bounds().center();
    let transfer = TransferFunction::automatic(&volume);
    let scene = Scene::new().with_volume(volume, Kernel::default(), transfer);
    for device in devices() {
        let (layers, picture) = layers_of(&device, &scene, std::slice::from_ref(&(0..1)));
        let (normals, identifiers) = (layers.normals.unwrap(), layers.identifiers.unwrap());
        let is_solid = |at: &usize| picture.depth[*at].is_finite() && is_inside(&identifiers, *at);
        let solid: Vec<usize> = (49..48 * 47).filter(is_solid).collect();
        assert!(solid.len() > 50, "{}", solid.len());
        let of = |at: usize| Vec3::from_array(normals[at]).as_dvec3();
        let cosines =
            solid.iter().map(|&at| of(at).dot((place(&picture, at) - center).normalize()));
        let mean = cosines.sum::<f64>() / solid.len() as f64;
        assert!(mean > 0.95, "{device:?}: {mean}");
    }
}
