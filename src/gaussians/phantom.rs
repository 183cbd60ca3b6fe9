//! A made scene, to try things on without a captured one.

use super::{
    Gaussians,
    harmonics::{MOST_TERMS, basis, constant_of, terms},
};
use crate::{about::Orientation, parallel::prelude::*};
use glam::{Quat, Vec3};
use std::f32::consts::{PI, TAU};

/// The degree of its colours.
const DEGREE: u32 = 3;

/// Directions over which colours are fitted.
const DIRECTIONS: usize = 96;

/// Where the light comes from. Up is −y.
const LIGHT: Vec3 = Vec3::new(-0.48, -0.72, -0.5);

/// A Gaussian of the scene, its colour without light, and how much it shines.
struct Made {
    center: Vec3,
    normal: Vec3,
    scale: Vec3,
    opacity: f32,
    color: Vec3,
    shine: f32,
}

/// Returns a scene of about `count` Gaussians of degree 3, as a trainer might have left it: a
/// chequered floor, a ball and a ring that shine, and a bush of translucent needles. It stands with
/// −y up, and reaches 3 from the middle. The same count gives the same scene.
pub fn phantom(count: usize) -> Gaussians {
    let quarter = count.div_ceil(4).max(1);
    let of_part = |part: fn(usize, usize) -> Made| -> Vec<Made> {
        (0..quarter).into_par_iter().map(|index| part(index, quarter)).collect()
    };
    let made = [of_part(floor), of_part(ball), of_part(ring), of_part(needle)];
    let made: Vec<Made> = made.into_iter().flatten().collect();
    let mut set = Gaussians { degree: DEGREE, ..Gaussians::default() };
    set.centers = made.iter().map(|gaussian| gaussian.center).collect();
    set.scales = made.iter().map(|gaussian| gaussian.scale).collect();
    set.rotations = made
        .iter()
        .map(|gaussian| Quat::from_rotation_arc(Vec3::Z, gaussian.normal).normalize())
        .collect();
    set.opacities = made.iter().map(|gaussian| gaussian.opacity).collect();
    set.harmonics = made.par_iter().flat_map_iter(colors).collect();
    set.about.orientation = Some(Orientation::Y_DOWN);
    set
}

/// Numbers from 0 to 1 that look random (SplitMix64: Steele, Lea & Flood 2014).
fn random<const N: usize>(index: usize) -> [f32; N] {
    std::array::from_fn(|place| {
        let mut z = ((index * N + place) as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    })
}

/// A point of a spiral that covers the sphere evenly.
fn on_sphere(index: usize, count: usize) -> Vec3 {
    let z = 1.0 - (2 * index + 1) as f32 / count as f32;
    let (r, turn) = ((1.0 - z * z).max(0.0).sqrt(), golden(index));
    Vec3::new(r * turn.cos(), r * turn.sin(), z)
}

/// The turn of the golden angle, in 64 bits so that large numbers keep their digits.
fn golden(index: usize) -> f32 {
    (index as f64 * 2.399_963_229_728_653).rem_euclid(f64::from(TAU)) as f32
}

/// A flat Gaussian as wide as its share of an area.
fn flat(area: f32, count: usize) -> Vec3 {
    let side = 0.7 * (area / count as f32).sqrt();
    Vec3::new(side, side, 0.1 * side)
}

fn floor(index: usize, count: usize) -> Made {
    const RADIUS: f32 = 3.0;
    let (r, turn) = (RADIUS * ((index as f32 + 0.5) / count as f32).sqrt(), golden(index));
    let center = Vec3::new(r * turn.cos(), 0.8, r * turn.sin());
    let tile = (center.x * 2.0).floor() + (center.z * 2.0).floor();
    let is_dark = tile.rem_euclid(2.0) < 0.5;
    let color = if is_dark { Vec3::new(0.25, 0.2, 0.18) } else { Vec3::new(0.85, 0.8, 0.7) };
    let scale = flat(PI * RADIUS * RADIUS, count);
    Made { center, normal: Vec3::NEG_Y, scale, opacity: 0.97, color, shine: 0.1 }
}

fn ball(index: usize, count: usize) -> Made {
    const RADIUS: f32 = 0.6;
    let normal = on_sphere(index, count);
    let center = Vec3::new(-0.9, 0.2, 0.2) + RADIUS * normal;
    let color = Vec3::new(0.15, 0.35, 0.75);
    let scale = flat(4.0 * PI * RADIUS * RADIUS, count);
    Made { center, normal, scale, opacity: 0.95, color, shine: 0.9 }
}

fn ring(index: usize, count: usize) -> Made {
    const RADII: [f32; 2] = [0.55, 0.2];
    let (u, v) = (golden(index), TAU * (index as f32 + 0.5) / count as f32);
    let outward = Vec3::new(u.cos(), 0.0, u.sin());
    let normal = outward * v.cos() + Vec3::Y * v.sin();
    let middle = Vec3::new(0.9, 0.6, -0.2) + RADII[0] * outward;
    let hue = [0.0, 1.0 / 3.0, 2.0 / 3.0].map(|shift| 0.5 + 0.45 * (u + TAU * shift).cos());
    let scale = 1.1 * flat(TAU * TAU * RADII[0] * RADII[1], count);
    let center = middle + RADII[1] * normal;
    Made { center, normal, scale, opacity: 0.9, color: Vec3::from(hue), shine: 0.5 }
}

fn needle(index: usize, count: usize) -> Made {
    let [size, shade, height, opacity] = random::<4>(index);
    let outward = on_sphere(index, count);
    let radius = size.cbrt();
    let center = Vec3::new(0.3, 0.1, 1.1) + outward * radius * Vec3::new(0.8, 0.7, 0.6);
    let normal = (outward + Vec3::NEG_Y * height).normalize();
    let side = 0.35 / (count as f32).cbrt();
    let color = Vec3::new(0.1 + 0.2 * shade, 0.35 + 0.3 * shade, 0.1);
    let scale = side * Vec3::new(0.3, 0.3, 1.6);
    Made { center, normal, scale, opacity: 0.15 + 0.5 * opacity, color, shine: 0.05 }
}

/// Returns the harmonics of a Gaussian's colour: lit from one side, with a highlight that moves
/// with the eye.
fn colors(gaussian: &Made) -> Vec<[f32; 3]> {
    let light = LIGHT.normalize();
    let lit = gaussian.color * (0.45 + 0.55 * gaussian.normal.dot(light).max(0.0));
    let mut shine = [0.0; MOST_TERMS];
    for index in 0..DIRECTIONS {
        let seen = on_sphere(index, DIRECTIONS);
        let reflected = seen - 2.0 * seen.dot(gaussian.normal) * gaussian.normal;
        let value = gaussian.shine * reflected.dot(light).max(0.0).powi(6);
        let share = value * 4.0 * PI / DIRECTIONS as f32;
        shine.iter_mut().zip(basis(DEGREE, seen)).for_each(|(sum, term)| *sum += share * term);
    }
    let mut harmonics: Vec<[f32; 3]> =
        shine[..terms(DEGREE)].iter().map(|term| [*term; 3]).collect();
    let constant = lit.to_array().map(constant_of);
    harmonics[0].iter_mut().zip(constant).for_each(|(sum, part)| *sum += part);
    harmonics
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scene_is_sound_and_the_same_each_time() {
        let set = phantom(1000);
        assert_eq!((set.len(), set.validate()), (1000, Ok(())));
        assert_eq!(phantom(1000).harmonics, set.harmonics);
        assert_eq!(phantom(0).len(), 4);
        assert!(set.bounds().diagonal() < 12.0);
    }
}
