//! Every kind of scene, drawn. So far by the reference alone: what is checked is that the scenes show something.

mod scenes;

use scenes::Case;
use splatkit::reference;

/// Fails unless the picture is one of numbers that are neither all the same nor nearly all empty, with depths that fit
/// its opacities.
fn assert_shows_something(Case { name, scene, camera, settings }: Case) {
    let picture = reference::render(&scene, &camera, &settings).expect(name);
    let [width, height] = settings.size;
    assert_eq!((picture.color.len(), picture.depth.len()), ((width * height) as usize, (width * height) as usize));
    let range = f32::EPSILON..=1.0 + 4.0 * f32::EPSILON;
    let mut covered = 0;
    let mut deep = 0;
    for (color, &depth) in picture.color.iter().zip(&picture.depth) {
        assert!(color.iter().all(|v| *v == 0.0 || range.contains(v) || v.abs() < 1e-6), "{name}: {color:?}");
        assert!((color[3] > 0.500_001) <= depth.is_finite(), "{name}: depth {depth} at opacity {}", color[3]);
        assert!((color[3] < 0.499_999) <= (depth == f32::INFINITY), "{name}: depth {depth} at opacity {}", color[3]);
        covered += usize::from(color[3] > 0.05);
        deep += usize::from(depth.is_finite());
    }
    let mut greens: Vec<u8> = picture.color.iter().map(|color| (color[1] * 255.0) as u8).collect();
    greens.sort_unstable();
    greens.dedup();
    let share = covered as f64 / picture.color.len() as f64;
    assert!(share > 0.2, "{name}: only {share:.2} of the picture shows something");
    assert!(deep > 0, "{name}: nothing is opaque");
    assert!(greens.len() > 30, "{name}: only {} shades", greens.len());
}

#[test]
fn ellipsoids_in_perspective() {
    assert_shows_something(scenes::ellipsoids_in_perspective());
}

#[test]
fn ellipsoids_orthographic() {
    assert_shows_something(scenes::ellipsoids_orthographic());
}

#[test]
fn ellipsoids_unlit() {
    assert_shows_something(scenes::ellipsoids_unlit());
}

#[test]
fn ellipsoids_without_normals() {
    assert_shows_something(scenes::ellipsoids_without_normals());
}

#[test]
fn huge_among_small() {
    assert_shows_something(scenes::huge_among_small());
}

#[test]
fn splats_below_a_pixel() {
    assert_shows_something(scenes::splats_below_a_pixel());
}

#[test]
fn flat_discs_head_on() {
    assert_shows_something(scenes::flat_discs_head_on());
}

#[test]
fn camera_among_ellipsoids() {
    assert_shows_something(scenes::camera_among_ellipsoids());
}

#[test]
fn wide_angle() {
    assert_shows_something(scenes::wide_angle());
}

#[test]
fn scattered_samples() {
    assert_shows_something(scenes::scattered_samples());
}

#[test]
fn scattered_samples_orthographic() {
    assert_shows_something(scenes::scattered_samples_orthographic());
}

#[test]
fn blobs_analytic() {
    assert_shows_something(scenes::blobs_analytic());
}

#[test]
fn blobs_central() {
    assert_shows_something(scenes::blobs_central());
}

#[test]
fn blobs_orthographic() {
    assert_shows_something(scenes::blobs_orthographic());
}

#[test]
fn blobs_unshaded() {
    assert_shows_something(scenes::blobs_unshaded());
}

#[test]
fn camera_inside_a_volume() {
    assert_shows_something(scenes::camera_inside_a_volume());
}

#[test]
fn marschner_lobb() {
    assert_shows_something(scenes::marschner_lobb());
}

#[test]
fn sheared_lattice() {
    assert_shows_something(scenes::sheared_lattice());
}

#[test]
fn sheared_lattice_central() {
    assert_shows_something(scenes::sheared_lattice_central());
}

#[test]
fn constant_field() {
    assert_shows_something(scenes::constant_field());
}

#[test]
fn surface_in_a_volume() {
    assert_shows_something(scenes::surface_in_a_volume());
}

#[test]
fn surface_in_a_volume_orthographic() {
    assert_shows_something(scenes::surface_in_a_volume_orthographic());
}
