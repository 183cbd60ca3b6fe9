//! Splats of radiance, alone and inside fields, and scenes that cannot be drawn.

use super::*;
use crate::{Error, scene::Lighting, splat::encode_normal};

#[test]
fn one_round_splat_is_its_projection() {
    for projection in PROJECTIONS {
        let camera = camera(projection);
        let (center, deviation, strength) = (DVec3::new(0.1, 0.2, -0.1), 0.3, 2.0);
        let scene =
            Scene::new().with_splats(surfels(vec![round(center.as_vec3(), strength, deviation)]));
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
            let opacity =
                1.0 - (-f64::from(strength) * (-0.5 * distance * distance / variance).exp()).exp();
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
    let splat = Splat {
        color: 0x80_ff_ff_ff,
        normal: encode_normal(slant.as_vec3()),
        ..round(Vec3::ZERO, 3.0, 5.0)
    };
    let scene = Scene::new().with_splats(surfels(vec![splat]));
    let shade = Shade { ambient: 0.1, diffuse: 0.4, specular: 0.2, power: 4.0, certain: None };
    // An odd number of pixels: one lies in the middle.
    let lighting = Lighting::head();
    let settings = Settings { surface_shade: Some(shade), lighting, ..Settings::new([1, 1]) };
    let [red, .., opacity] = render(&scene, &camera, &settings).unwrap().color[0];
    // Widened by a pixel of this size, the translucent splat has lost depth as its area has grown.
    let view = camera.view([1, 1]).unwrap();
    let blur = 0.35 / view.scale * if view.perspective { 10.0 } else { 1.0 };
    let grown = (25.0 + blur * blur) / 25.0;
    let expected = 1.0 - (-3.0_f64 * 128.0 / 255.0 / grown).exp();
    close(opacity, expected, 2e-3);
    // The cosine is √½, its fourth power ¼.
    close(red / opacity, 0.1 + 0.4 * 0.5_f64.sqrt() + 0.2 * 0.25, 1e-3);
}

#[test]
fn the_depth_of_an_opaque_wall_is_where_it_stands() {
    for projection in PROJECTIONS {
        let camera =
            Camera { position: DVec3::new(0.0, 0.0, 5.0), view_up: DVec3::Y, ..camera(projection) };
        // A disc in the plane z = 0.25, much thinner than the sheets.
        let factor = [3.0, 0.0, 3.0, 0.0, 0.0, 1e-3];
        let wall = Splat { factor, ..round(Vec3::new(0.0, 0.0, 0.25), 80.0, 1.0) };
        let scene = Scene::new().with_splats(Surfels { extent: 3.0, ..surfels(vec![wall]) });
        let settings = Settings { sheet_thickness: Some(0.02), ..unshaded([24, 20]) };
        let picture = render(&scene, &camera, &settings).unwrap();
        let pixel =
            if matches!(projection, Projection::Perspective { .. }) { 5.0 / 27.0 } else { 0.2 };
        for (color, &z) in picture.color.iter().zip(&picture.depth) {
            assert!(color[3] > 0.9999);
            // The wall is widened by 0.35 pixels, and absorbs half of the light in its near part.
            close(z, 4.75, pixel);
            assert!(z <= 4.75 + 0.02);
        }
        let background = Scene::new().with_splats(surfels(vec![round(Vec3::ZERO, 0.5, 0.1)]));
        assert!(
            render(&background, &camera, &settings)
                .unwrap()
                .depth
                .iter()
                .all(|z| *z == f32::INFINITY)
        );
    }
}

#[test]
fn a_surface_in_a_translucent_volume_is_veiled_by_what_lies_before_it() {
    let (veil, extinction) = ([0.2, 0.9, 0.1], 0.6);
    let lattice = centered([7, 7, 9], DMat3::from_diagonal(DVec3::splat(0.5)));
    for projection in PROJECTIONS {
        let camera =
            Camera { position: DVec3::new(0.0, 0.0, 6.0), view_up: DVec3::Y, ..camera(projection) };
        for height in [-1.0_f32, 0.0, 1.5] {
            // Fine pixels, so that the wall is widened only slightly. Only the middle of a large
            // picture is drawn.
            let wall = Splat {
                factor: [9.0, 0.0, 9.0, 0.0, 0.0, 1e-3],
                ..round(Vec3::new(0.0, 0.0, height), 5e3, 1.0)
            };
            let scene = Scene::new()
                .with_volume(
                    volume(lattice.clone(), |_| 5.0),
                    Shape::default(),
                    uniform(veil, extinction),
                )
                .with_splats(Surfels { extent: 3.0, ..surfels(vec![wall]) });
            let settings = Settings { sheet_thickness: Some(0.01), ..unshaded([801, 801]) };
            let view = camera.view(settings.size).unwrap();
            let frame = Frame::new(&scene, &scene, &Trained::new(), view, &settings);
            for (column, row) in [(400, 400), (420, 370)] {
                let ray = frame.ray(column, row);
                let composite = pixel(&frame, column, row);
                // The samples' box begins at z = 2, 4 units in front of the camera.
                let length = (2.0 - f64::from(height)) / ray.direction.z;
                let through = (-extinction * length).exp();
                close(composite.opacity, 1.0, 1e-6);
                for (c, wall) in [0xc0, 0x80, 0x40].into_iter().enumerate() {
                    let expected = (1.0 - through) * veil[c] + through * f64::from(wall) / 255.0;
                    // The sheet with the wall's near side mixes the wall with the sheet's part of
                    // the volume.
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
    let scene = Scene::new().with_splats(surfels(vec![round(Vec3::ZERO, 1.0, 1.0)]));
    assert!(matches!(render(&scene, &camera, &unshaded([0, 4])), Err(Error::Argument(_))));
}
