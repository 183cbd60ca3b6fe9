//! Samples classified before interpolation, axis-aligned sheets and single splats.

use super::*;
use crate::{scene::Order, volume::Arrangement};

fn before(mode: Mode) -> Settings {
    Settings { mode, classification: scene::Classification::Pre, ..unshaded([1, 1]) }
}

#[test]
fn classified_before_a_constant_field_is_as_dense_as_it_is() {
    // The kernels' sum over a lattice ripples; wide kernels show its mean. Fields reach half a cell
    // beyond the samples' box.
    let color = [0.3, 0.6, 0.9];
    let axes = DMat3::from_diagonal(DVec3::new(0.2, 0.25, 0.2));
    let cubic = centered([33, 33, 10], axes);
    let mixed = Lattice {
        arrangement: Arrangement::BodyCentred,
        origin: DVec3::new(-3.0, -3.0, -1.0),
        ..centered([24, 24, 16], DMat3::from_diagonal(DVec3::splat(0.25)))
    };
    let evenly = |count: usize, step: f64| {
        (0..count).map(|i| step * (i as f64 - 0.5 * (count as f64 - 1.0))).collect()
    };
    let uneven = Lattice {
        arrangement: Arrangement::Rectilinear(Arc::new([
            evenly(33, 0.2),
            evenly(33, 0.2),
            evenly(11, 0.2),
        ])),
        ..Lattice::with_spacing([33, 33, 11], DVec3::ONE)
    };
    for (lattice, length) in [(cubic, 2.0), (mixed, 2.0), (uneven, 2.2)] {
        for (kernel, tolerance) in
            [(Shape::gaussian(0.8, 3.2).unwrap(), 1e-3), (Shape::b_spline(3.0).unwrap(), 3e-3)]
        {
            let scene = Scene::new().with_volume(
                volume(lattice.clone(), |_| 5.0),
                kernel,
                uniform(color, 0.8),
            );
            for mode in [
                Mode::Sheets,
                Mode::AxisSheets,
                Mode::Splats(Order::FrontToBack),
                Mode::Splats(Order::BackToFront),
            ] {
                let picture = render(&scene, &from_above(5.0, 0.01), &before(mode)).unwrap();
                let opacity = 1.0 - (-0.8_f64 * length).exp();
                close(picture.color[0][3], opacity, tolerance);
                (0..3).for_each(|c| {
                    close(picture.color[0][c], f64::from(picture.color[0][3]) * color[c], 1e-6);
                });
                assert!(picture.depth[0] > 4.0 - 0.5 && picture.depth[0] < 5.0);
            }
        }
    }
}

#[test]
fn scattered_samples_know_what_they_add_up_to() {
    let heavy = Splat::sample(Vec3::ZERO, 7.0, [5.0, 0.0, 5.0, 0.0, 0.0, 0.5], 3.0, Vec3::ZERO);
    let samples = SampleSplats { overlap: 2.0, ..sample_splats(vec![heavy]) };
    let scene = Scene::new().with_samples(samples, uniform([1.0; 3], 0.8));
    let length = (2.0 * std::f64::consts::PI).sqrt() * 0.5;
    for mode in [Mode::Sheets, Mode::AxisSheets, Mode::Splats(Order::FrontToBack)] {
        let opacity = render(&scene, &from_above(9.0, 0.01), &before(mode)).unwrap().color[0][3];
        close(opacity, 1.0 - (-0.8 * length * 3.0 / 2.0).exp(), 5e-5);
    }
}

#[test]
fn both_orders_make_one_picture() {
    let mut random = Random(9);
    let splats = (0..200).map(|_| {
        let color = 0xff00_0000 | ((random.next() * 8e6) as i32 as u32 & 0x00ff_ffff);
        let normal = crate::splat::encode_normal(random.point().as_vec3());
        Splat { color, normal, ..round(random.point().as_vec3(), 0.8, 0.2) }
    });
    let scene = Scene::new().with_splats(surfels(splats.collect()));
    for projection in PROJECTIONS {
        let draw = |order| {
            let settings = Settings { mode: Mode::Splats(order), ..Settings::new([32, 24]) };
            render(&scene, &camera(projection), &settings).unwrap()
        };
        let [front, back] = [Order::FrontToBack, Order::BackToFront].map(draw);
        assert!(decibels(&front, &back) > 130.0);
        assert!(front.depth.iter().any(|depth| depth.is_finite()) && front.depth == back.depth);
    }
}

#[test]
fn single_splats_are_composited_by_distance() {
    let at = |z: f32, color: u32| Splat { color, ..round(Vec3::new(0.0, 0.0, z), 0.7, 1.0) };
    // Red is in front of blue, though they overlap; green is behind the eye.
    let splats = vec![at(-0.5, 0xffff_0000), at(0.5, 0xff00_00ff), at(9.0, 0xff00_ff00)];
    let scene = Scene::new().with_splats(surfels(splats));
    let camera =
        Camera { projection: Projection::Perspective { view_angle: 0.1 }, ..from_above(5.0, 1.0) };
    let alpha = 1.0 - (-0.7_f64).exp();
    for order in [Order::FrontToBack, Order::BackToFront] {
        let picture = render(&scene, &camera, &before(Mode::Splats(order))).unwrap();
        close(picture.color[0][0], alpha, 1e-6);
        close(picture.color[0][1], 0.0, 0.0);
        close(picture.color[0][2], alpha * (1.0 - alpha), 1e-6);
        close(picture.depth[0], 4.5, 1e-6);
    }
}

#[test]
fn samples_classified_before_are_lit_by_their_field() {
    // The slope is at 45° to the view: the cosine is √½.
    let lattice = centered([9; 3], DMat3::from_diagonal(DVec3::splat(0.25)));
    let shade = Shade { ambient: 0.1, diffuse: 0.4, specular: 0.0, power: 4.0, certain: None };
    let transfer = TransferFunction { shade: Some(shade), ..uniform([1.0; 3], 0.8) };
    for slope in [DVec3::new(1.0, 0.0, 1.0), DVec3::new(0.0, 1.0, -1.0)] {
        let field = volume(lattice.clone(), |p| 5.0 * slope.dot(p));
        let scene = Scene::new().with_volume(field, Shape::default(), transfer.clone());
        for mode in [Mode::Sheets, Mode::AxisSheets, Mode::Splats(Order::FrontToBack)] {
            let settings = Settings { volume_shade: None, ..before(mode) };
            let [red, .., opacity] =
                render(&scene, &from_above(5.0, 0.01), &settings).unwrap().color[0];
            close(red / opacity, 0.1 + 0.4 * 0.5_f64.sqrt(), 1e-3);
        }
    }
}

#[test]
fn the_near_side_of_a_wall_hides_its_far_side() {
    // Layers with the values 0, 0.6, 1, 0.4, 0 from below. The layer of 0.4 is the wall's upper
    // side. All of them lie in one sheet.
    let lattice = centered([9, 9, 5], DMat3::from_diagonal(DVec3::splat(0.25)));
    let layers = [0.0, 0.6, 1.0, 0.4, 0.0];
    let field = volume(lattice, |p| layers[(4.0 * p.z + 2.0).round() as usize]);
    let transfer = TransferFunction {
        color: vec![(0.4, [1.0, 0.0, 0.0]), (0.6, [0.0, 0.0, 1.0])],
        opacity: vec![(0.3, 0.0), (0.3, 0.5), (0.7, 0.5), (0.7, 0.0)],
        shade: Some(Shade { ambient: 1.0, diffuse: 0.0, specular: 0.0, power: 1.0, certain: None }),
        ..TransferFunction::default()
    };
    let scene = Scene::new().with_volume(field, Shape::default(), transfer);
    let settings =
        Settings { volume_shade: None, sheet_thickness: Some(50.0), ..before(Mode::Sheets) };
    let [red, _, blue, opacity] =
        render(&scene, &from_above(5.0, 0.01), &settings).unwrap().color[0];
    assert!(
        opacity > 0.1 && red > 0.99 * opacity && blue < 0.01 * opacity,
        "{red} {blue} {opacity}"
    );
}

#[test]
fn axis_sheets_follow_the_data() {
    let view = camera(PROJECTIONS[0]).view([8, 8]).unwrap();
    // The camera looks mostly along −x.
    let axis = whole::sheet_axis(&view, None);
    assert!((axis + view.rotation * DVec3::X).length() < 1e-12 && axis.z > 0.0);
    let axes = DMat3::from_cols(
        DVec3::new(0.0, 0.5, 0.0),
        DVec3::new(-0.2, 0.0, 0.0),
        DVec3::new(0.1, 0.0, 0.5),
    );
    let lattice = Lattice::cartesian([2; 3], DVec3::ZERO, axes);
    let axis = whole::sheet_axis(&view, Some(&lattice));
    // Perpendicular to the first and the third axis.
    assert!(
        (view.rotation.transpose() * axis).cross(DVec3::new(5.0, 0.0, -1.0).normalize()).length()
            < 1e-9,
        "{axis}"
    );
    // Two walls of different colours lie in one thick sheet, or in two thin ones.
    let at = |z: f32, color: u32| Splat { color, ..round(Vec3::new(0.0, 0.0, z), 2.0, 1.0) };
    let splats = vec![at(0.0, 0xff00_00ff), at(1.0, 0xffff_0000)];
    let scene = Scene::new().with_splats(surfels(splats));
    for (thickness, before, behind) in [(100.0, 0.5, 0.5), (0.1, (-2.0_f64).exp(), 1.0)] {
        let settings =
            Settings { sheet_thickness: Some(thickness), sheet_pixels: 1e9, ..before_alone() };
        let [red, _, blue, opacity] =
            render(&scene, &from_above(5.0, 0.01), &settings).unwrap().color[0];
        close(opacity, 1.0 - (-4.0_f64).exp(), 1e-6);
        let whole = if thickness > 1.0 { f64::from(opacity) } else { 1.0 - (-2.0_f64).exp() };
        close(red, whole * before, 1e-6);
        close(blue, whole * behind, 1e-6);
    }
}

fn before_alone() -> Settings {
    before(Mode::AxisSheets)
}
