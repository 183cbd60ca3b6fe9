//! Sums of a field's samples.

use super::*;
use crate::volume::{Arrangement, Coefficients};

#[test]
fn a_constant_field_lets_through_what_its_length_does() {
    let color = [0.3, 0.6, 0.9];
    for projection in PROJECTIONS {
        let lattice = centered([9, 8, 7], skewed_axes());
        let scene = Scene::new().with_volume(
            volume(lattice.clone(), |_| 5.0),
            Shape::default(),
            uniform(color, 0.8),
        );
        let camera = camera(projection);
        let settings = unshaded([24, 20]);
        let picture = render(&scene, &camera, &settings).unwrap();
        let view = camera.view(settings.size).unwrap();
        let mut crossed = 0;
        for (i, pixel) in picture.color.iter().enumerate() {
            // The length inside the box, by testing many points.
            let (origin, direction) =
                view.ray(DVec2::new((i % 24) as f64 + 0.5, (i / 24) as f64 + 0.5));
            let steps = 40_000;
            let inside = (0..steps).filter(|step| {
                let s = 10.0 * (f64::from(*step) + 0.5) / f64::from(steps);
                let world = view.rotation.transpose() * (origin + s * direction) + view.position;
                let index = lattice.axes.inverse() * (world - lattice.origin);
                index.cmpge(DVec3::ZERO).all() && index.cmple(DVec3::new(8.0, 7.0, 6.0)).all()
            });
            let length = 10.0 * inside.count() as f64 / f64::from(steps);
            let opacity = 1.0 - (-0.8 * length).exp();
            close(pixel[3], opacity, 1e-3);
            (0..3).for_each(|c| close(pixel[c], f64::from(pixel[3]) * color[c], 1e-6));
            crossed += usize::from(length > 0.5);
        }
        assert!(crossed > 50);
    }
}

#[test]
fn a_flat_lattice_is_one_step_thick() {
    let lattice = centered([9, 8, 1], DMat3::from_diagonal(DVec3::new(0.3, 0.3, 0.5)));
    let scene = Scene::new().with_volume(
        volume(lattice, |_| 5.0),
        Shape::default(),
        uniform([1.0; 3], 0.8),
    );
    let camera =
        Camera { position: DVec3::new(0.0, 0.0, 9.0), view_up: DVec3::Y, ..camera(PROJECTIONS[1]) };
    let picture = render(&scene, &camera, &unshaded([1, 1])).unwrap();
    close(picture.color[0][3], 1.0 - (-0.8_f64 * 0.5).exp(), 1e-6);
}

#[test]
fn scattered_samples_fill_at_most_their_sheets() {
    let camera = camera(PROJECTIONS[1]);
    let settings = unshaded([1, 1]);
    let field = |splats: Vec<Splat>| {
        let scene = Scene::new().with_samples(sample_splats(splats), uniform([1.0; 3], 0.8));
        render(&scene, &camera, &settings).unwrap().color[0][3]
    };
    // One sample: ∫ exp(−s²/2σ²) ds = √(2π)·σ, with σ² widened by (0.35 · 4)² (the only pixel is 4
    // units wide). Its weight shrinks by the factor by which its volume grows. The ends of the
    // splat's box cut its tails.
    let deviation = (0.8_f64.powi(2) + 1.4_f64.powi(2)).sqrt();
    let weight = (0.8 / deviation).powi(3);
    let length = weight * (2.0 * std::f64::consts::PI).sqrt() * deviation;
    close(field(vec![sample(Vec3::ZERO, 7.0, 0.8)]), 1.0 - (-0.8 * length).exp(), 1e-4);
    // A hundred samples at one place: a sheet's W counts up to the sheet's thickness.
    let transfer = uniform([1.0; 3], 0.1);
    let many = vec![sample(Vec3::ZERO, 7.0, 0.8); 100];
    let scene = Scene::new().with_samples(sample_splats(many), transfer);
    let settings = Settings { sheet_thickness: Some(0.5), ..settings };
    let eye = camera.position.length();
    let planes = scene.sheets(&camera.view(settings.size).unwrap(), &settings).planes;
    let lengths = planes.windows(2).map(|plane| {
        let [from, to] = [0, 1].map(|i| (plane[i] - eye) / deviation);
        (100.0 * weight * deviation * profile::Profile::Gaussian.moments(0.0, [from, to])[0])
            .min(plane[1] - plane[0])
    });
    let opacity = render(&scene, &camera, &settings).unwrap().color[0][3];
    // Sheets filled to less than a ten-thousandth (the tails) have no value.
    close(opacity, 1.0 - (-0.1 * lengths.sum::<f64>()).exp(), 5e-6);
}

/// Asserts that a field is `constant` + `slope`·x at the faces of a few pixels, within `reach` of
/// the origin.
fn assert_linear(
    scene: &Scene,
    projection: Projection,
    slope: DVec3,
    constant: f64,
    reach: f64,
    tolerance: f64,
) {
    let settings = Settings { sheet_thickness: Some(0.2), ..Settings::new([32, 24]) };
    let view = camera(projection).view(settings.size).unwrap();
    let frame = Frame::new(scene, scene, &Trained::new(), view, &settings);
    let field = &frame.fields[0];
    let everywhere: Vec<&Kernel> = field.kernels.iter().collect();
    let mut met = 0;
    for (column, row) in [(15, 11), (17, 14), (14, 13)] {
        let ray = frame.ray(column, row);
        let faces = |column, row| field.faces(&frame.ray(column, row), &everywhere, &frame.planes);
        let around = [(-1, 0), (1, 0), (0, -1), (0, 1)].map(|(x, y)| faces(column + x, row + y));
        for (k, (face, &plane)) in faces(column, row).iter().zip(&frame.planes).enumerate() {
            let world = frame.view.rotation.transpose() * ray.point(plane) + frame.view.position;
            if world.length() > reach {
                continue;
            }
            close(face.value(1e-4).unwrap(), constant + slope.dot(world), tolerance);
            let to_world = |gradient: DVec3| frame.view.rotation.transpose() * gradient;
            let analytic = to_world(face.gradient(1e-4).unwrap());
            assert!(
                (analytic - slope).length() < 10.0 * tolerance * slope.length().max(1.0),
                "{analytic} for {slope}"
            );
            let values = around.each_ref().map(|faces| faces[k].value(1e-4));
            let central = to_world(face.central_gradient(1e-4, &ray, plane, values).unwrap());
            assert!(
                (central - slope).length() < (10.0 * tolerance + 1e-3) * slope.length().max(1.0),
                "{central} for {slope}"
            );
            met += 1;
        }
    }
    assert!(met > 8);
}

#[test]
fn a_linear_field_has_its_values_and_its_gradient() {
    let sheared = DMat3::from_cols(
        DVec3::new(0.25, 0.05, 0.0),
        DVec3::new(-0.05, 0.2, 0.08),
        DVec3::new(0.0, 0.1, 0.3),
    );
    let shapes = [DVec3::splat(0.25), DVec3::new(0.2, 0.2, 0.375)].map(DMat3::from_diagonal);
    for (axes, projection) in
        shapes.into_iter().chain([sheared]).flat_map(|a| PROJECTIONS.map(|p| (a, p)))
    {
        for slope in [DVec3::X, DVec3::new(0.5, -1.0, 2.0), DVec3::ZERO] {
            // Wide kernels have no ripple, which would disturb the test.
            for (kernel, tolerance) in
                [(Shape::gaussian(0.9, 5.5).unwrap(), 1e-5), (Shape::b_spline(4.0).unwrap(), 3e-4)]
            {
                let transfer =
                    TransferFunction { shade: Some(Shade::default()), ..uniform([1.0; 3], 0.8) };
                let lattice = centered([21, 21, 21], axes);
                let scene = Scene::new().with_volume(
                    volume(lattice, |p| 3.0 + slope.dot(p)),
                    kernel,
                    transfer.clone(),
                );
                assert_linear(&scene, projection, slope, 3.0, 0.5, tolerance);
            }
        }
    }
}

#[test]
fn a_linear_field_on_a_body_centred_lattice_is_linear() {
    for projection in PROJECTIONS {
        for slope in [DVec3::ZERO, DVec3::new(0.5, -1.0, 2.0)] {
            let axes = DMat3::from_diagonal(DVec3::splat(0.3));
            let lattice =
                Lattice { arrangement: Arrangement::BodyCentred, ..centered([17, 17, 34], axes) };
            let lattice = Lattice { origin: DVec3::splat(-2.4), ..lattice };
            let values = volume(lattice, |p| 3.0 + slope.dot(p));
            let transfer = uniform([1.0; 3], 0.8);
            let scene =
                Scene::new().with_volume(values, Shape::gaussian(0.9, 5.5).unwrap(), transfer);
            assert_linear(&scene, projection, slope, 3.0, 0.5, 1e-5);
        }
    }
}

#[test]
fn a_linear_field_on_a_rectilinear_lattice_is_linear() {
    let mut random = Random(5);
    let mut uneven = || {
        let mut place = -1.6;
        let next = |_| {
            place += 0.4 + 0.25 * random.next();
            place
        };
        (0..9).map(next).collect()
    };
    let places: [Vec<f64>; 3] = [uneven(), uneven(), uneven()];
    let lattice = Lattice {
        arrangement: Arrangement::Rectilinear(Arc::new(places)),
        ..Lattice::cartesian([9; 3], DVec3::ZERO, DMat3::from_diagonal(DVec3::new(1.0, 0.8, 1.2)))
    };
    let slope = DVec3::new(0.5, -1.0, 2.0);
    for (kernel, projection) in
        [(Shape::default(), PROJECTIONS[0]), (Shape::b_spline(2.0).unwrap(), PROJECTIONS[1])]
    {
        let values = volume(lattice.clone(), |p| 3.0 + slope.dot(p));
        let scene = Scene::new().with_volume(values, kernel, uniform([1.0; 3], 0.8));
        // The only error is the rounding of samples to 32 bits.
        assert_linear(&scene, projection, slope, 3.0, 0.7, 1e-5);
    }
}

#[test]
fn a_linear_field_of_scattered_samples_with_slopes_is_linear() {
    let mut random = Random(3);
    let slope = DVec3::new(0.5, -1.0, 2.0);
    let samples = (0..600).map(|_| {
        let center = random.point().as_vec3();
        let side = |r: &mut Random| 0.25 + 0.1 * r.next() as f32;
        let lean = |r: &mut Random| 0.1 * r.next() as f32;
        let factor = [
            side(&mut random),
            lean(&mut random),
            side(&mut random),
            lean(&mut random),
            lean(&mut random),
            side(&mut random),
        ];
        let [b00, b10, b11, b20, b21, b22] = factor.map(f64::from);
        // The place is c + B·x′, so the slope over x′ is Bᵀ times the gradient.
        let in_kernel = DVec3::new(
            b00 * slope.x + b10 * slope.y + b20 * slope.z,
            b11 * slope.y + b21 * slope.z,
            b22 * slope.z,
        );
        let value = 3.0 + slope.dot(center.as_dvec3());
        Splat::sample(
            center,
            value as f32,
            factor,
            1.0 + 0.5 * random.next() as f32,
            in_kernel.as_vec3(),
        )
    });
    let set = SampleSplats { extent: 3.0, ..sample_splats(samples.collect()) };
    let scene = Scene::new().with_samples(set, uniform([1.0; 3], 0.8));
    for projection in PROJECTIONS {
        // Slopes have 11 bits.
        assert_linear(&scene, projection, slope, 3.0, 0.5, 1e-3);
    }
}

#[test]
fn heavier_samples_count_more() {
    let at = |x: f32, value: f32, weight: f32| {
        Splat::sample(
            Vec3::new(x, 0.0, 0.0),
            value,
            [0.5, 0.0, 0.5, 0.0, 0.0, 0.5],
            weight,
            Vec3::ZERO,
        )
    };
    let scene = Scene::new().with_samples(
        sample_splats(vec![at(-0.2, 1.0, 3.0), at(0.2, 5.0, 1.0)]),
        uniform([1.0; 3], 0.8),
    );
    let settings = unshaded([1, 1]);
    let frame = Frame::new(
        &scene,
        &scene,
        &Trained::new(),
        from_above(5.0, 0.1).view([1, 1]).unwrap(),
        &settings,
    );
    let field = &frame.fields[0];
    let everywhere: Vec<&Kernel> = field.kernels.iter().collect();
    let faces = field.faces(&frame.ray(0, 0), &everywhere, &frame.planes);
    close(faces[faces.len() / 2].value(1e-4).unwrap(), 2.0, 1e-9);
}

#[test]
fn the_mean_of_a_sample_with_a_slope_is_that_of_many_points() {
    let (center, slope) = (DVec3::new(0.1, -0.2, 0.1), DVec3::new(0.5, 1.0, 2.0));
    let factor = [0.5, 0.1, 0.3, -0.2, 0.1, 0.4];
    let splats = vec![Splat::sample(center.as_vec3(), 3.0, factor, 2.0, slope.as_vec3())];
    let scene = Scene::new().with_samples(sample_splats(splats), uniform([1.0; 3], 0.8));
    // With so many pixels, widening is negligible.
    let settings = unshaded([4001, 4001]);
    for projection in PROJECTIONS {
        let view = camera(projection).view(settings.size).unwrap();
        let frame = Frame::new(&scene, &scene, &Trained::new(), view, &settings);
        let ray = frame.ray(2000, 2000);
        let kernel = &frame.fields[0].kernels[0];
        let kernel::Load::Sample(carried) = &kernel.load else { panic!("a sample is no radiance") };
        let crossing = kernel.cross(&ray).unwrap();
        let part = [crossing.closest - 0.1, crossing.closest + 0.5];
        let mut mean = sheet::Mean::default();
        mean.add(carried, kernel.center, &crossing, &ray, part);
        let [b00, b10, b11, b20, b21, b22] = factor.map(f64::from);
        let factor = DMat3::from_cols_array(&[b00, b10, b20, 0.0, b11, b21, 0.0, 0.0, b22]);
        let (mut weight, mut value) = (0.0, 0.0);
        for step in 0..10_000 {
            let s = part[0] + 0.6 * (f64::from(step) + 0.5) / 10_000.0;
            let world = frame.view.rotation.transpose() * ray.point(s) + frame.view.position;
            let place = factor.inverse() * (world - center);
            let h = (-0.5 * place.length_squared()).exp() * 0.6 / 10_000.0;
            (weight, value) = (weight + 2.0 * h, value + 2.0 * h * (3.0 + slope.dot(place)));
        }
        close(mean.weight, weight, 1e-5);
        close(mean.value(1e-4, 0.6).unwrap(), value / weight, 1e-5);
    }
}

#[test]
fn what_makes_a_volume_sharp_is_drawn_in_its_own_box() {
    // Coefficients on a lattice with two more samples on all sides; they differ from the volume's
    // values.
    let lattice = centered([5; 3], DMat3::from_diagonal(DVec3::splat(0.25)));
    let mut sharp = (*volume(lattice, |_| 1.0)).clone();
    let wide = centered([9; 3], DMat3::from_diagonal(DVec3::splat(0.25)));
    sharp.coefficients = Some(Arc::new(Coefficients {
        values: vec![2.0; wide.len()],
        ranges: vec![[0, 255]; wide.len()],
        lattice: wide,
        kernel: Shape::default(),
    }));
    let transfer = TransferFunction {
        opacity: vec![(1.5, 0.0), (1.5, 1.0 - (-0.8_f64).exp())],
        ..uniform([1.0; 3], 1.0)
    };
    let scene = Scene::new().with_volume(sharp, Shape::default(), transfer);
    let picture = render(&scene, &from_above(5.0, 0.1), &unshaded([1, 1])).unwrap();
    close(picture.color[0][3], 1.0 - (-0.8_f64).exp(), 1e-6);
}
