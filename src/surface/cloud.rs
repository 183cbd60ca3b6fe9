//! Surfels of a point cloud: the plane and the spacing of each point from its nearest neighbours.

use super::{
    Mesh, SurfelOptions,
    ellipse::{Tensor, factor, lower},
    paint::{pack, point_color},
};
use crate::{
    math::{eigen, neighbours::Neighbours, weld::first_of_equals},
    splat::{NO_NORMAL, Splat, encode_normal},
};
use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;

/// Neighbours that a point is judged by.
const COUNT: usize = 10;
/// Standard deviation of a surfel, in the median distance to the neighbours (1.2 spacings on a square grid of points,
/// of which 0.39 are needed there; the rest is for irregular ones).
const SPREAD: f64 = 0.45;
/// A point far from all others is drawn at most this many times as wide as the median one.
const LARGEST: f64 = 4.0;

/// The neighbourhood of a point.
struct Surroundings {
    /// Median distance to the neighbours; 0 without any.
    distance: f64,
    /// Axes by falling variance, and the variances.
    axes: [DVec3; 3],
    variances: [f64; 3],
}

pub(super) fn surfels(mesh: &Mesh, options: &SurfelOptions) -> Vec<Splat> {
    let first = first_of_equals(&mesh.positions);
    let kept: Vec<u32> = (0..).zip(first).filter(|&(index, first)| index == first).map(|(index, _)| index).collect();
    let points: Vec<Vec3> = kept.par_iter().map(|&index| mesh.positions[index as usize]).collect();
    let tree = Neighbours::new(&points);
    let around: Vec<Surroundings> =
        (0..points.len()).into_par_iter().map(|index| surroundings(&points, &tree, index as u32)).collect();
    let mut distances: Vec<f64> = around.par_iter().map(|s| s.distance).collect();
    let middle = distances.len() / 2;
    let typical = if distances.is_empty() { 0.0 } else { *distances.select_nth_unstable_by(middle, f64::total_cmp).1 };
    // A single point has no scale of its own; it becomes a ball of about unit diameter.
    let typical = if typical > 0.0 { typical } else { 0.5 };
    kept.par_iter()
        .zip(around)
        .map(|(&index, around)| {
            let distance = if around.distance > 0.0 { around.distance.min(typical * LARGEST) } else { typical };
            let width = distance * SPREAD * f64::from(options.radius_scale);
            let given = mesh.normals.get(index as usize).filter(|normal| normal.length_squared() > 0.25);
            let (factor, normal) = shape(&around, width, given.map(|normal| normal.as_dvec3().normalize()));
            Splat {
                center: mesh.positions[index as usize].to_array(),
                strength: options.optical_depth,
                factor,
                color: pack(point_color(mesh, index as usize)),
                normal: normal.map_or(NO_NORMAL, |normal| encode_normal(normal.as_vec3())),
            }
        })
        .collect()
}

/// The factor and the normal of a point's surfel: a disc in the plane of its normal, drawn out to at most 1 : 2 where
/// the neighbours lie further apart in one direction; a ball where they show no plane.
fn shape(around: &Surroundings, width: f64, given: Option<DVec3>) -> ([f32; 6], Option<DVec3>) {
    let [large, middle, _] = around.variances;
    let is_plane = middle > large * 1e-4;
    let normal = given.or(is_plane.then_some(around.axes[2]));
    let Some(normal) = normal else { return (lower([DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * width)), None) };
    let long = (around.axes[0] - normal * normal.dot(around.axes[0])).try_normalize();
    let x = long.unwrap_or_else(|| normal.any_orthonormal_vector());
    let stretch = if is_plane { (large / middle).sqrt().min(2.0) } else { 1.0 };
    let variance = width * width;
    let tensor = Tensor { xx: variance * stretch, xy: 0.0, yy: variance / stretch };
    (factor(tensor, x, normal.cross(x), normal), Some(normal))
}

fn surroundings(points: &[Vec3], tree: &Neighbours, index: u32) -> Surroundings {
    let nearest = tree.of(index, COUNT);
    let center = points[index as usize];
    let offsets = || nearest.iter().map(|&(_, index)| (points[index as usize] - center).as_dvec3());
    let distance = nearest.get(nearest.len() / 2).map_or(0.0, |&(distance, _)| f64::from(distance));
    let mean = offsets().sum::<DVec3>() / (nearest.len() + 1) as f64;
    let mut scatter = DMat3::ZERO;
    for offset in offsets().chain([DVec3::ZERO]) {
        let d = offset - mean;
        scatter += DMat3::from_cols(d * d.x, d * d.y, d * d.z);
    }
    let (variances, axes) = eigen(scatter);
    Surroundings { distance, axes, variances }
}
