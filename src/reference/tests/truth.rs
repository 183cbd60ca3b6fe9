//! Sheets compared with densely sampled rays, and with other sheets.

use super::*;
use crate::{
    math::Tensor,
    scene::Classification,
    volume::{Arrangement, Isosurface, phantoms::Phantom},
};

/// A transfer function whose extinction changes fast, with a step.
fn steep() -> TransferFunction {
    TransferFunction {
        color: vec![(0.0, [0.1, 0.2, 0.9]), (0.5, [0.9, 0.8, 0.2]), (1.0, [0.9, 0.1, 0.1])],
        opacity: vec![(0.45, 0.0), (0.5, 0.9), (0.55, 0.1), (0.7, 0.1), (0.7, 0.6)],
        unit: 0.1,
        ..TransferFunction::default()
    }
}

/// Shells of the Marschner–Lobb signal.
fn shells(lattice_size: usize, kernel: Shape, shade: Option<Shade>) -> Scene {
    let transfer = TransferFunction { shade, ..steep() };
    Scene::new().with_volume(
        Phantom::MarschnerLobb.sample([lattice_size; 3]).unwrap(),
        kernel,
        transfer,
    )
}

fn small(classification: Classification, thickness: Option<f64>) -> Settings {
    Settings { classification, sheet_thickness: thickness, ..Settings::new([24, 20]) }
}

#[test]
fn a_step_on_a_ramp_is_as_long_as_it_is() {
    // The extinction is 2 where the value exceeds 0.137, over a depth of 0.863.
    let lattice = centered([17; 3], DMat3::from_diagonal(DVec3::splat(0.125)));
    let opaque = 1.0 - (-2.0_f64).exp();
    let transfer =
        TransferFunction { opacity: vec![(0.137, 0.0), (0.137, opaque)], ..uniform([1.0; 3], 1.0) };
    let kernel = Shape::gaussian(0.9, 5.0).unwrap();
    let field = volume(lattice, |p| p.z);
    let scene = Scene::new().with_volume(field, kernel, transfer);
    let camera = from_above(5.0, 0.01);
    // Inside, away from the border, where missing samples bend the field.
    let error = |classification, thickness| {
        let settings =
            Settings { classification, sheet_thickness: Some(thickness), ..unshaded([1, 1]) };
        let opacity = f64::from(render(&scene, &camera, &settings).unwrap().color[0][3]);
        (opacity - (1.0 - (-2.0_f64 * 0.863).exp())).abs()
    };
    for thickness in [0.4, 0.37, 0.3, 0.21] {
        assert!(error(Classification::PreIntegrated, thickness) < 1e-4);
    }
    assert!(
        [0.4, 0.37, 0.3, 0.21]
            .iter()
            .any(|thickness| error(Classification::Post, *thickness) > 0.01)
    );
}

#[test]
fn thinner_sheets_change_little() {
    let scene = shells(24, Shape::default(), None);
    let camera = camera(PROJECTIONS[0]);
    let usual =
        scene.sheets(&camera.view([24, 20]).unwrap(), &small(Classification::Post, None)).step;
    for (classification, least) in
        [(Classification::PreIntegrated, 50.0), (Classification::Post, 35.0)]
    {
        let [thick, thin] = [usual, 0.5 * usual].map(|thickness| {
            render(&scene, &camera, &small(classification, Some(thickness))).unwrap()
        });
        let agreement = decibels(&thick, &thin);
        println!("{classification:?}: halving {agreement:.1} dB");
        assert!(agreement > least, "{classification:?}: {agreement} dB");
    }
}

/// Three balls that touch.
fn blobs(kernel: Shape, shade: Option<Shade>) -> Scene {
    let lattice = centered([24; 3], DMat3::from_diagonal(DVec3::splat(2.0 / 23.0)));
    let centers =
        [DVec3::new(0.4, 0.1, 0.0), DVec3::new(-0.4, 0.2, 0.3), DVec3::new(0.0, -0.4, -0.3)];
    let field =
        volume(lattice, |p| centers.iter().map(|c| (-8.0 * (p - *c).length_squared()).exp()).sum());
    Scene::new().with_volume(field, kernel, TransferFunction { shade, ..steep() })
}

#[test]
fn sheets_converge_to_the_rays() {
    let lit = Some(Shade::default());
    let spline = Shape::b_spline(2.0).unwrap();
    for (name, scene, better) in [
        ("shells", shells(24, Shape::default(), None), 10.0),
        ("blobs", blobs(Shape::default(), None), 10.0),
        ("spline", blobs(spline, None), 10.0),
        // Lit shells gain less: each part of a sheet is lit once.
        ("shells, lit", shells(24, Shape::default(), lit), 0.0),
        ("blobs, lit", blobs(Shape::default(), lit), 4.0),
    ] {
        for projection in PROJECTIONS {
            let camera = camera(projection);
            let usual = scene
                .sheets(&camera.view([24, 20]).unwrap(), &small(Classification::Post, None))
                .step;
            let truth =
                integrate(&scene, &camera, &small(Classification::Post, None), 0.0005).unwrap();
            let agreement = |classification, share: f64| {
                let picture =
                    render(&scene, &camera, &small(classification, Some(usual * share))).unwrap();
                decibels(&picture, &truth)
            };
            let [post, post_thin] =
                [1.0, 0.125].map(|share| agreement(Classification::Post, share));
            let [inside, inside_thin] =
                [1.0, 0.125].map(|share| agreement(Classification::PreIntegrated, share));
            println!(
                "{name}: post {post:.1} → {post_thin:.1} dB, \
                 inside {inside:.1} → {inside_thin:.1} dB"
            );
            assert!(post_thin > post + 15.0 && inside_thin > inside + 15.0);
            assert!(inside > post + better);
        }
    }
}

#[test]
fn sheets_of_tensor_products_converge_too() {
    for tensor in Tensor::ALL {
        for shade in [None, Some(Shade::default())] {
            let scene = blobs(Shape::tensor(tensor), shade);
            for projection in PROJECTIONS {
                let camera = camera(projection);
                let usual = scene
                    .sheets(&camera.view([24, 20]).unwrap(), &small(Classification::Post, None))
                    .step;
                let truth =
                    integrate(&scene, &camera, &small(Classification::Post, None), 0.0005).unwrap();
                let [usual, thin] = [1.0, 0.125].map(|share| {
                    let settings = small(Classification::PreIntegrated, Some(usual * share));
                    decibels(&render(&scene, &camera, &settings).unwrap(), &truth)
                });
                println!("{tensor:?}, lit {}: {usual:.1} → {thin:.1} dB", shade.is_some());
                assert!(usual > 40.0 && thin > usual + 15.0);
            }
        }
    }
}

#[test]
fn body_centred_samples_and_isosurfaces_converge_too() {
    let axes = DMat3::from_diagonal(DVec3::splat(0.12));
    let lattice = Lattice {
        arrangement: Arrangement::BodyCentred,
        origin: DVec3::splat(-1.0),
        ..centered([17, 17, 34], axes)
    };
    let field = volume(lattice, |p| Phantom::Ball.value(p - DVec3::new(0.1, 0.0, -0.1)));
    let surface = |value: f64, opacity: f64| Isosurface { value, color: [0.9, 0.5, 0.1], opacity };
    let transfer = TransferFunction {
        opacity: vec![(0.1, 0.0), (0.5, 0.1)],
        unit: 0.1,
        shade: Some(Shade::default()),
        gradient: vec![(0.5, 0.0), (1.5, 1.0)],
        isosurfaces: vec![surface(0.2, 0.4), surface(0.6, 1.0)],
        ..TransferFunction::default()
    };
    let scene = Scene::new().with_volume(field, Shape::default(), transfer);
    for projection in PROJECTIONS {
        let camera = camera(projection);
        let truth = integrate(&scene, &camera, &small(Classification::Post, None), 0.002).unwrap();
        for (share, least) in [(0.1, 55.0), (0.02, 70.0)] {
            let picture =
                render(&scene, &camera, &small(Classification::PreIntegrated, Some(share)))
                    .unwrap();
            let agreement = decibels(&picture, &truth);
            println!("sheets of {share}: {agreement:.1} dB");
            assert!(agreement > least);
        }
    }
}

#[test]
fn rays_are_refused_where_they_cannot_be_followed() {
    let scene = shells(4, Shape::default(), None);
    let camera = camera(PROJECTIONS[0]);
    let settings = unshaded([2, 2]);
    let refused = |scene: &Scene, settings: &Settings, step: f64| {
        matches!(integrate(scene, &camera, settings, step), Err(crate::Error::Argument(_)))
    };
    assert!(!refused(&scene, &settings, 0.1));
    assert!(refused(&scene, &settings, 0.0) && refused(&scene, &settings, f64::NAN));
    assert!([1e-12, 1e-300, 5e-324].iter().all(|&step| refused(&scene, &settings, step)));
    assert!(refused(&scene, &Settings { optics: Optics::XRay, ..settings.clone() }, 0.1));
    let splats = surfels(vec![round(Vec3::ZERO, 1.0, 1.0)]);
    assert!(refused(&scene.with_splats(splats), &settings, 0.1));
}

/// Prints the time of 256³ samples at 256 × 256 pixels; run it by name.
#[test]
#[ignore = "a minute"]
fn rays_through_a_large_volume() {
    let volume = Phantom::MarschnerLobb.sample_bytes([256; 3]).unwrap();
    let step = 0.1 * 2.0 / 255.0;
    let volume = Arc::new(volume);
    for (name, opacity, shade) in [
        ("thin", vec![(0.0, 0.001)], None),
        ("dense", vec![(100.0, 0.0), (140.0, 0.1)], None),
        ("thin, lit", vec![(0.0, 0.001)], Some(Shade::default())),
        ("dense, lit", vec![(100.0, 0.0), (140.0, 0.1)], Some(Shade::default())),
    ] {
        let transfer =
            TransferFunction { opacity, unit: 0.01, shade, ..TransferFunction::default() };
        let scene = Scene::new().with_volume(volume.clone(), Shape::default(), transfer);
        let start = std::time::Instant::now();
        integrate(&scene, &camera(PROJECTIONS[0]), &Settings::new([256, 256]), step).unwrap();
        println!("{name}: {:.1} s", start.elapsed().as_secs_f64());
    }
}
