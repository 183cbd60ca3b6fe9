//! Isosurfaces.

use super::*;
use crate::volume::{Isosurface, phantoms::Phantom};

/// The ball of radius 0.6 in a sampled [`Phantom::Ball`].
fn ball(opacity: f64, shade: Option<Shade>) -> Scene {
    let value = (1.0_f64 - 0.36 / 0.81).powi(2);
    let transfer = TransferFunction {
        opacity: vec![(0.0, 0.0)],
        isosurfaces: vec![Isosurface { value, color: [0.8, 0.4, 0.2], opacity }],
        shade,
        ..TransferFunction::default()
    };
    Scene::new().with_volume(Phantom::Ball.sample([40; 3]).unwrap(), Shape::default(), transfer)
}

#[test]
fn a_ball_has_its_depth_and_its_normals() {
    let shade = Shade { ambient: 0.0, diffuse: 1.0, specular: 0.0, power: 1.0, certain: None };
    let scene = ball(1.0, Some(shade));
    for projection in PROJECTIONS {
        for classification in [scene::Classification::PreIntegrated, scene::Classification::Post] {
            let settings = Settings { classification, ..Settings::new([41, 31]) };
            let view = camera(projection).view(settings.size).unwrap();
            let frame = Frame::new(&scene, &scene, &Trained::new(), view, &settings);
            for (column, row) in [(20, 15), (22, 12), (17, 17), (2, 2)] {
                let ray = frame.ray(column, row);
                let composite = pixel(&frame, column, row);
                let center = frame.view.to_view(DVec3::ZERO);
                let closest = (center - ray.origin).dot(ray.direction);
                let past = (ray.point(closest) - center).length();
                if past > 0.7 {
                    close(composite.opacity, 0.0, 0.0);
                    continue;
                }
                let s = closest - (0.36 - past * past).sqrt();
                // Sheets are 0.07 thick.
                close(composite.half, s, 0.003);
                close(composite.opacity, 1.0, 1e-8);
                let cosine = ((ray.point(s) - center) / 0.6).dot(ray.direction).abs();
                // The kernels' sum ripples by 1.3 %, and so do the gradients.
                close(composite.color.x, 0.8 * cosine, 0.012);
                close(composite.color.y, 0.4 * cosine, 0.006);
            }
        }
    }
}

#[test]
fn a_translucent_ball_is_met_twice() {
    let scene = ball(0.5, None);
    let settings = unshaded([31, 31]);
    let view = camera(PROJECTIONS[1]).view(settings.size).unwrap();
    let composite = pixel(&Frame::new(&scene, &scene, &Trained::new(), view, &settings), 15, 15);
    close(composite.opacity, 0.75, 1e-9);
    let xray = Settings { optics: Optics::XRay, ..settings };
    let view = camera(PROJECTIONS[1]).view(xray.size).unwrap();
    close(
        pixel(&Frame::new(&scene, &scene, &Trained::new(), view, &xray), 15, 15).opacity,
        0.0,
        0.0,
    );
}
