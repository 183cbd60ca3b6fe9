//! Clips, X-rays, maxima and the gradient factor.

use super::*;
use crate::{
    math::Bounds,
    scene::{Clip, ClipShape},
};

/// A constant field of extinction 0.8 in the cube from −1 to 1.
fn cube(color: [f64; 3]) -> Scene {
    let lattice = centered([9; 3], DMat3::from_diagonal(DVec3::splat(0.25)));
    Scene::new().with_volume(volume(lattice, |_| 5.0), Shape::default(), uniform(color, 0.8))
}

fn opacity(length: f64) -> f64 {
    1.0 - (-0.8 * length).exp()
}

#[test]
fn clips_cut_where_they_are() {
    let scene = cube([0.5; 3]);
    let shape = |normal: DVec3, offset: f64| ClipShape::HalfSpace { normal, offset };
    let hole = ClipShape::Box(Bounds {
        min: DVec3::new(-9.0, -9.0, -0.3),
        max: DVec3::new(9.0, 9.0, 0.13),
    });
    let slope = shape(DVec3::new(3.0, 0.0, 4.0), 1.0);
    let cases = [
        (vec![Clip { shape: shape(DVec3::Z, 0.37), inside: true }], 1.37),
        (vec![Clip { shape: shape(DVec3::Z, 0.37), inside: false }], 0.63),
        (vec![Clip { shape: hole, inside: true }], 0.43),
        // Two pieces are left.
        (vec![Clip { shape: hole, inside: false }], 1.57),
        (
            vec![
                Clip { shape: hole, inside: false },
                Clip { shape: shape(DVec3::Z, 0.37), inside: true },
            ],
            0.94,
        ),
        // On the axis 4z ≤ 1.
        (vec![Clip { shape: slope, inside: true }], 1.25),
        (vec![Clip { shape: slope, inside: true }, Clip { shape: slope, inside: false }], 0.0),
    ];
    for (clips, length) in cases {
        for classification in [scene::Classification::PreIntegrated, scene::Classification::Post] {
            let settings = Settings { clips: clips.clone(), classification, ..unshaded([1, 1]) };
            let camera = from_above(5.0, 0.01);
            let sheets = render(&scene, &camera, &settings).unwrap();
            let truth = integrate(&scene, &camera, &settings, 0.05).unwrap();
            close(sheets.color[0][3], opacity(length), 1e-6);
            close(truth.color[0][3], opacity(length), 2e-6);
        }
    }
}

#[test]
fn splats_are_clipped_by_their_closest_approach() {
    let splats = surfels(vec![round(Vec3::new(0.0, 0.0, 0.5), 3.0, 0.4)]);
    let scene = Scene::new().with_splats(splats);
    let camera = from_above(5.0, 0.01);
    for mode in [Mode::Sheets, Mode::AxisSheets, Mode::Splats(scene::Order::FrontToBack)] {
        for (offset, expected) in [(0.51, 1.0 - (-3.0_f64).exp()), (0.49, 0.0)] {
            let shape = ClipShape::HalfSpace { normal: DVec3::Z, offset };
            let settings =
                Settings { mode, clips: vec![Clip { shape, inside: true }], ..unshaded([1, 1]) };
            close(render(&scene, &camera, &settings).unwrap().color[0][3], expected, 2e-5);
        }
    }
}

#[test]
fn an_x_ray_is_what_a_field_takes_from_white() {
    let lattice = centered([9; 3], DMat3::from_diagonal(DVec3::splat(0.25)));
    let transfer =
        TransferFunction { shade: Some(Shade::default()), ..uniform([0.1, 0.5, 0.2], 0.8) };
    let scene = Scene::new().with_volume(volume(lattice, |_| 5.0), Shape::default(), transfer);
    let splats = vec![round(Vec3::ZERO, 0.6, 0.3)];
    let both = scene.clone().with_splats(surfels(splats));
    let settings = Settings { optics: Optics::XRay, ..Settings::new([1, 1]) };
    let camera = from_above(5.0, 0.01);
    let picture = render(&scene, &camera, &settings).unwrap();
    picture.color[0].iter().for_each(|channel| close(*channel, opacity(2.0), 1e-6));
    // Half of the light is absorbed over a length of ln 2 / 0.8, from z = 1 on.
    close(picture.depth[0], 4.0 + 2.0_f64.ln() / 0.8, 1e-5);
    let all = render(&both, &camera, &settings).unwrap().color[0];
    all.iter().for_each(|channel| close(*channel, 1.0 - (-1.6_f64 - 0.6).exp(), 1e-4));
}

#[test]
fn the_maximum_is_the_largest_value_on_the_ray() {
    // A hill of height 1, with its top at the sample in the origin.
    let lattice = centered([17; 3], DMat3::from_diagonal(DVec3::splat(0.125)));
    let hill = volume(lattice, |p| 1.0 - p.length_squared());
    let transfer = TransferFunction {
        color: vec![(0.0, [0.0, 1.0, 0.0]), (1.0, [1.0, 0.0, 0.0])],
        opacity: vec![(0.0, 0.0), (1.0, 0.8)],
        ..TransferFunction::default()
    };
    let scene = Scene::new().with_volume(hill, Shape::default(), transfer);
    // Pixels 0.2 apart.
    let camera = from_above(5.0, 1.0);
    for classification in [scene::Classification::PreIntegrated, scene::Classification::Post] {
        let settings = Settings { optics: Optics::Maximum, classification, ..unshaded([5, 5]) };
        let picture = render(&scene, &camera, &settings).unwrap();
        for (i, color) in picture.color.iter().enumerate() {
            let [x, y] = [i % 5, i / 5].map(|at| 0.2 * (at as f64 - 2.0));
            let value = 1.0 - x * x - y * y;
            // Kernels blur the hill by 3σ² = 0.017. The mean of a sheet lies slightly further below
            // the top.
            close(color[3], 0.8 * value, 0.02);
            close(color[0], f64::from(color[3] * color[3]) / 0.8, 1e-6);
        }
        assert!(picture.depth.iter().all(|depth| depth.is_infinite()));
    }
    // A clip leaves only the slope of the hill.
    let shape = ClipShape::HalfSpace { normal: DVec3::Z, offset: -0.5 };
    let settings = Settings {
        optics: Optics::Maximum,
        clips: vec![Clip { shape, inside: true }],
        ..unshaded([1, 1])
    };
    close(render(&scene, &from_above(5.0, 0.01), &settings).unwrap().color[0][3], 0.8 * 0.75, 0.02);
}

#[test]
fn steep_places_hold_back_more() {
    let lattice = centered([13; 3], DMat3::from_diagonal(DVec3::splat(0.25)));
    for (slope, factor) in [(0.5, 0.0), (2.0, 0.5), (9.0, 1.0)] {
        let transfer =
            TransferFunction { gradient: vec![(1.0, 0.0), (3.0, 1.0)], ..uniform([1.0; 3], 0.8) };
        let field = volume(lattice.clone(), |p| slope * p.x);
        let scene = Scene::new().with_volume(field, Shape::gaussian(0.9, 4.0).unwrap(), transfer);
        for classification in [scene::Classification::PreIntegrated, scene::Classification::Post] {
            for gradient in [Gradient::Analytic, Gradient::Central] {
                let settings = Settings { classification, gradient, ..unshaded([1, 1]) };
                let drawn_opacity =
                    render(&scene, &from_above(5.0, 0.01), &settings).unwrap().color[0][3];
                close(drawn_opacity, 1.0 - (-0.8_f64 * factor * 3.0).exp(), 2e-3);
            }
        }
    }
}
