//! Pictures that can be worked out by hand.

use super::*;
use crate::{
    Error,
    math::{Kernel as Shape, Projection},
    splat::{NO_NORMAL, Payload, Splat, SplatSet, encode_normal},
    volume::{Samples, Volume},
};
use glam::{DMat3, Vec3};
use std::sync::Arc;

const PROJECTIONS: [Projection; 2] =
    [Projection::Perspective { view_angle: 40.0 }, Projection::Orthographic { height: 4.0 }];

/// Looks at the world's origin from a slant.
fn camera(projection: Projection) -> Camera {
    Camera { position: DVec3::new(4.0, -3.0, 2.0), focal_point: DVec3::ZERO, view_up: DVec3::Z, projection }
}

fn unshaded(size: [u32; 2]) -> Settings {
    Settings { surface_shade: None, volume_shade: Some(None), ..Settings::new(size) }
}

/// One colour and one extinction for all values.
fn uniform(color: [f64; 3], extinction: f64) -> TransferFunction {
    let opacity = -(-extinction).exp_m1();
    TransferFunction {
        color: vec![(0.0, color)],
        opacity: vec![(0.0, opacity)],
        unit: 1.0,
        ..TransferFunction::default()
    }
}

fn volume(lattice: Lattice, value: impl Fn(DVec3) -> f64) -> Arc<Volume> {
    let samples = (0..lattice.len()).map(|i| value(lattice.sample_position(i)) as f32).collect();
    Arc::new(Volume::new(lattice, Samples::F32(samples)).unwrap())
}

/// A lattice about the world's origin with given steps between its samples.
fn centered(dims: [usize; 3], axes: DMat3) -> Lattice {
    let last = DVec3::from(dims.map(|n| n as f64 - 1.0));
    Lattice::cartesian(dims, -0.5 * (axes * last), axes)
}

fn skewed_axes() -> DMat3 {
    DMat3::from_cols(DVec3::new(0.2, 0.05, 0.0), DVec3::new(-0.04, 0.25, 0.06), DVec3::new(0.05, 0.0, 0.3))
}

fn round(center: Vec3, strength: f32, deviation: f32) -> Splat {
    let factor = [deviation, 0.0, deviation, 0.0, 0.0, deviation];
    Splat { center: center.to_array(), strength, factor, color: 0xff_40_80_c0, normal: NO_NORMAL }
}

fn set(payload: Payload, splats: Vec<Splat>) -> SplatSet {
    SplatSet { origin: DVec3::ZERO, payload, splats, extent: 8.0, overlap: 1.0 }
}

fn close(found: impl Into<f64>, expected: f64, tolerance: f64) {
    let found = found.into();
    assert!((found - expected).abs() <= tolerance, "{found} is not {expected} ± {tolerance}");
}

#[test]
fn one_round_splat_is_its_projection() {
    for projection in PROJECTIONS {
        let camera = camera(projection);
        let (center, deviation, strength) = (DVec3::new(0.1, 0.2, -0.1), 0.3, 2.0);
        let scene =
            Scene::new().with_splats(set(Payload::Radiance, vec![round(center.as_vec3(), strength, deviation)]));
        let settings = unshaded([24, 20]);
        let picture = render(&scene, &camera, &settings).unwrap();
        let view = camera.view(settings.size).unwrap();
        let center = view.to_view(center);
        let pixel = if view.perspective { center.length() } else { 1.0 } / view.scale;
        let variance = f64::from(deviation).powi(2) + (0.35 * pixel).powi(2);
        let mut brightest: f32 = 0.0;
        for (i, color) in picture.color.iter().enumerate() {
            let at = DVec2::new((i % 24) as f64 + 0.5, (i / 24) as f64 + 0.5);
            let (origin, direction) = view.ray(at);
            // The distance of the centre from the ray.
            let distance = (center - origin).cross(direction).length();
            let opacity = 1.0 - (-f64::from(strength) * (-0.5 * distance * distance / variance).exp()).exp();
            // Sheets with an optical depth below 1e-5 are left out, up to three of them here.
            close(color[3], opacity, 3e-5);
            close(color[0], opacity * f64::from(0xc0) / 255.0, 3e-5);
            close(color[2], opacity * f64::from(0x40) / 255.0, 3e-5);
            brightest = brightest.max(color[3]);
        }
        assert!(brightest > 0.8);
    }
}

#[test]
fn opacity_scales_the_strength_and_normals_catch_the_light() {
    let camera = camera(PROJECTIONS[1]);
    let toward = (camera.position - camera.focal_point).normalize();
    let across = toward.cross(DVec3::Z).normalize();
    let slant = (toward + across).normalize();
    let splat = Splat { color: 0x80_ff_ff_ff, normal: encode_normal(slant.as_vec3()), ..round(Vec3::ZERO, 3.0, 5.0) };
    let scene = Scene::new().with_splats(set(Payload::Radiance, vec![splat]));
    let shade = Shade { ambient: 0.1, diffuse: 0.4, specular: 0.2, power: 4.0 };
    // A pixel in the middle: an odd number of them.
    let settings = Settings { surface_shade: Some(shade), ..Settings::new([1, 1]) };
    let [red, .., opacity] = render(&scene, &camera, &settings).unwrap().color[0];
    close(opacity, 1.0 - (-3.0_f64 * 128.0 / 255.0).exp(), 1e-5);
    // The cosine is √½, its fourth power ¼.
    close(red / opacity, 0.1 + 0.4 * 0.5_f64.sqrt() + 0.2 * 0.25, 1e-3);
}

#[test]
fn a_constant_field_lets_through_what_its_length_does() {
    let color = [0.3, 0.6, 0.9];
    for projection in PROJECTIONS {
        let lattice = centered([9, 8, 7], skewed_axes());
        let scene = Scene::new().with_volume(volume(lattice.clone(), |_| 5.0), Shape::default(), uniform(color, 0.8));
        let camera = camera(projection);
        let settings = unshaded([24, 20]);
        let picture = render(&scene, &camera, &settings).unwrap();
        let view = camera.view(settings.size).unwrap();
        let mut crossed = 0;
        for (i, found) in picture.color.iter().enumerate() {
            // The length inside the box by asking many points.
            let (origin, direction) = view.ray(DVec2::new((i % 24) as f64 + 0.5, (i / 24) as f64 + 0.5));
            let steps = 40_000;
            let inside = (0..steps).filter(|step| {
                let s = 10.0 * (f64::from(*step) + 0.5) / f64::from(steps);
                let world = view.rotation.transpose() * (origin + s * direction) + view.position;
                let index = lattice.axes.inverse() * (world - lattice.origin);
                index.cmpge(DVec3::ZERO).all() && index.cmple(DVec3::new(8.0, 7.0, 6.0)).all()
            });
            let length = 10.0 * inside.count() as f64 / f64::from(steps);
            let opacity = 1.0 - (-0.8 * length).exp();
            close(found[3], opacity, 1e-3);
            (0..3).for_each(|c| close(found[c], f64::from(found[3]) * color[c], 1e-6));
            crossed += usize::from(length > 0.5);
        }
        assert!(crossed > 50);
    }
}

#[test]
fn a_flat_lattice_is_one_step_thick() {
    let lattice = centered([9, 8, 1], DMat3::from_diagonal(DVec3::new(0.3, 0.3, 0.5)));
    let scene = Scene::new().with_volume(volume(lattice, |_| 5.0), Shape::default(), uniform([1.0; 3], 0.8));
    let camera = Camera { position: DVec3::new(0.0, 0.0, 9.0), view_up: DVec3::Y, ..camera(PROJECTIONS[1]) };
    let picture = render(&scene, &camera, &unshaded([1, 1])).unwrap();
    close(picture.color[0][3], 1.0 - (-0.8_f64 * 0.5).exp(), 1e-6);
}

#[test]
fn scattered_samples_fill_at_most_their_sheets() {
    let camera = camera(PROJECTIONS[1]);
    let settings = unshaded([1, 1]);
    let field = |splats: Vec<Splat>| {
        let scene = Scene::new().with_samples(set(Payload::Scalar, splats), uniform([1.0; 3], 0.8));
        render(&scene, &camera, &settings).unwrap().color[0][3]
    };
    // One sample: ∫ exp(−s²/2σ²) ds = √(2π)·σ, with σ² widened by (0.35 · 4)² (the only pixel is 4 units wide). The ends of
    // the splat's box cut its tails.
    let deviation = (0.8_f64.powi(2) + 1.4_f64.powi(2)).sqrt();
    let length = (2.0 * std::f64::consts::PI).sqrt() * deviation;
    close(field(vec![round(Vec3::ZERO, 7.0, 0.8)]), 1.0 - (-0.8 * length).exp(), 1e-4);
    // A hundred of them at one place: no sheet holds more of them than it is thick.
    let transfer = uniform([1.0; 3], 0.1);
    let scene = Scene::new().with_samples(set(Payload::Scalar, vec![round(Vec3::ZERO, 7.0, 0.8); 100]), transfer);
    let settings = Settings { sheet_thickness: Some(0.5), ..settings };
    let eye = camera.position.length();
    let planes = scene.sheets(&camera.view(settings.size).unwrap(), &settings).planes;
    let lengths = planes.windows(2).map(|plane| {
        let [from, to] = [0, 1].map(|i| (plane[i] - eye) / deviation);
        (100.0 * length * section::section(from, to)).min(plane[1] - plane[0])
    });
    let found = render(&scene, &camera, &settings).unwrap().color[0][3];
    // Sheets filled to less than a ten-thousandth, the tails, have no value.
    close(found, 1.0 - (-0.1 * lengths.sum::<f64>()).exp(), 5e-6);
}

/// The gradients of a linear field of given slope in the middle of a picture, in world space.
fn gradients_of(slope: DVec3, axes: DMat3, projection: Projection, gradient: Gradient) -> Vec<DVec3> {
    let lattice = centered([13, 13, 13], axes);
    // A wide kernel keeps the ripple of the lattice out of the test.
    let shape = Shape::gaussian(1.0, 4.5).unwrap();
    let shade = Some(Shade::default());
    let transfer = TransferFunction { shade, ..uniform([1.0; 3], 0.8) };
    let scene = Scene::new().with_volume(volume(lattice, |p| slope.dot(p)), shape, transfer);
    let settings = Settings { gradient, sheet_thickness: Some(0.2), ..Settings::new([32, 24]) };
    let view = camera(projection).view(settings.size).unwrap();
    let frame = Frame::new(&scene, view, &settings);
    let everywhere: Vec<&Kernel> = frame.kernels.iter().collect();
    let sheets = |column: i64, row: i64| frame.sheets(&frame.ray(column, row), &everywhere);
    let mut gradients = Vec::new();
    for (column, row) in [(15, 11), (17, 14), (14, 13)] {
        let ray = frame.ray(column, row);
        let here = sheets(column, row);
        let values = frame.values(&here);
        let around = [(-1, 0), (1, 0), (0, -1), (0, 1)].map(|(x, y)| frame.values(&sheets(column + x, row + y)));
        for k in 0..frame.count() {
            let world = frame.view.rotation.transpose() * ray.point(frame.middle(k)) + frame.view.position;
            if world.length() > 0.5 {
                continue;
            }
            let Some(value) = values[k] else { continue };
            let central = gradient == Gradient::Central;
            let across = here[k].across(value, central.then(|| around.each_ref().map(|values| values[k])));
            gradients.push(frame.view.rotation.transpose() * frame.gradient(&ray, &values, k, across));
        }
    }
    gradients
}

#[test]
fn the_gradient_of_a_linear_field_is_its_slope() {
    let sheared =
        DMat3::from_cols(DVec3::new(0.25, 0.05, 0.0), DVec3::new(-0.05, 0.2, 0.08), DVec3::new(0.0, 0.1, 0.3));
    let shapes = [DVec3::splat(0.25), DVec3::new(0.15, 0.15, 0.375)].map(DMat3::from_diagonal);
    for (axes, projection) in shapes.into_iter().chain([sheared]).flat_map(|a| PROJECTIONS.map(|p| (a, p))) {
        for gradient in [Gradient::Analytic, Gradient::Central] {
            for slope in [DVec3::X, DVec3::new(0.5, -1.0, 2.0), DVec3::new(4.0, -3.0, 2.0), DVec3::new(3.0, 4.0, 0.0)] {
                let found = gradients_of(slope, axes, projection, gradient);
                assert!(found.len() > 5);
                for g in found {
                    let error = (g - slope).length() / slope.length();
                    assert!(error < 0.03, "{projection:?} {gradient:?}: {g} for {slope}");
                }
            }
        }
    }
}

#[test]
fn the_depth_of_an_opaque_wall_is_where_it_stands() {
    for projection in PROJECTIONS {
        let camera = Camera { position: DVec3::new(0.0, 0.0, 5.0), view_up: DVec3::Y, ..camera(projection) };
        // A disc in the plane z = 0.25, thin against the sheets.
        let factor = [3.0, 0.0, 3.0, 0.0, 0.0, 1e-3];
        let wall = Splat { factor, ..round(Vec3::new(0.0, 0.0, 0.25), 80.0, 1.0) };
        let scene = Scene::new().with_splats(SplatSet { extent: 3.0, ..set(Payload::Radiance, vec![wall]) });
        let settings = Settings { sheet_thickness: Some(0.02), ..unshaded([24, 20]) };
        let picture = render(&scene, &camera, &settings).unwrap();
        let pixel = if matches!(projection, Projection::Perspective { .. }) { 5.0 / 27.0 } else { 0.2 };
        for (color, &z) in picture.color.iter().zip(&picture.depth) {
            assert!(color[3] > 0.9999);
            // The wall is widened by 0.35 pixels, and half of its light is taken in its near part.
            close(z, 4.75, pixel);
            assert!(z <= 4.75 + 0.02);
        }
        let background = Scene::new().with_splats(set(Payload::Radiance, vec![round(Vec3::ZERO, 0.5, 0.1)]));
        assert!(render(&background, &camera, &settings).unwrap().depth.iter().all(|z| *z == f32::INFINITY));
    }
}

#[test]
fn a_surface_in_a_translucent_volume_is_veiled_by_what_lies_before_it() {
    let (veil, extinction) = ([0.2, 0.9, 0.1], 0.6);
    let lattice = centered([7, 7, 9], DMat3::from_diagonal(DVec3::splat(0.5)));
    for projection in PROJECTIONS {
        let camera = Camera { position: DVec3::new(0.0, 0.0, 6.0), view_up: DVec3::Y, ..camera(projection) };
        for height in [-1.0_f32, 0.0, 1.5] {
            // Fine pixels, so that the wall is widened but little: only the middle of a large picture is drawn.
            let wall =
                Splat { factor: [9.0, 0.0, 9.0, 0.0, 0.0, 1e-3], ..round(Vec3::new(0.0, 0.0, height), 5e3, 1.0) };
            let scene = Scene::new()
                .with_volume(volume(lattice.clone(), |_| 5.0), Shape::default(), uniform(veil, extinction))
                .with_splats(SplatSet { extent: 3.0, ..set(Payload::Radiance, vec![wall]) });
            let settings = Settings { sheet_thickness: Some(0.01), ..unshaded([801, 801]) };
            let view = camera.view(settings.size).unwrap();
            let frame = Frame::new(&scene, view, &settings);
            let everywhere: Vec<&Kernel> = frame.kernels.iter().collect();
            for (column, row) in [(400, 400), (420, 370)] {
                let ray = frame.ray(column, row);
                let composite = frame.composite(&ray, &frame.sheets(&ray, &everywhere), None);
                // The samples' box begins at z = 2, 4 before the camera.
                let length = (2.0 - f64::from(height)) / ray.direction.z;
                let through = (-extinction * length).exp();
                close(composite.opacity, 1.0, 1e-6);
                for (c, wall) in [0xc0, 0x80, 0x40].into_iter().enumerate() {
                    let expected = (1.0 - through) * veil[c] + through * f64::from(wall) / 255.0;
                    // The sheet that holds the wall's near side mixes it with its own bit of the volume.
                    close(composite.color[c], expected, extinction * 0.02);
                }
            }
        }
    }
}

#[test]
fn what_cannot_be_drawn_is_told() {
    let camera = camera(PROJECTIONS[0]);
    let settings = unshaded([4, 4]);
    assert!(matches!(render(&Scene::new(), &camera, &settings), Err(Error::NothingToDraw(_))));
    let scene = Scene::new().with_splats(set(Payload::Scalar, vec![round(Vec3::ZERO, 1.0, 1.0)]));
    assert!(matches!(render(&scene, &camera, &settings), Err(Error::Argument(_))));
    let scene = Scene::new().with_splats(set(Payload::Radiance, vec![round(Vec3::ZERO, 1.0, 1.0)]));
    assert!(matches!(render(&scene, &camera, &unshaded([0, 4])), Err(Error::Argument(_))));
}
