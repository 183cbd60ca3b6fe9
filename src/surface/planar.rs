//! Which points of a cloud lie on a surface, and which fill space or lie on curves.
//!
//! The neighbours of a point on a surface lie near a plane: the smallest eigenvalue of their
//! covariance is far below the middle one. Noise hides that from the nearest ones, so points that
//! are undecided are judged by more neighbours: 32 nearest, then the 32 nearest among every 8th and
//! every 64th point. The neighbours vote, so that edges and strays do not become islands.

use crate::{
    Deadline, Result,
    deadline::Clock,
    math::{eigen, neighbours::Neighbours},
    parallel::prelude::*,
};
use glam::{DMat3, DVec3, Vec3};

/// Neighbours that a point's plane and spacing are computed from.
pub(super) const COUNT: usize = 10;

/// The neighbours of a point; filled up with the point itself if there are fewer.
pub(super) type Nearest = [u32; COUNT];

/// Neighbours that undecided points are judged by.
const MORE: usize = 32;
/// Of so many points one is looked at, level by level.
const STRIDES: [usize; 3] = [1, 8, 64];
/// A neighbourhood may hold one in so many points of a cloud: a larger one shows the shape of the
/// whole.
const MOST_OF_CLOUD: usize = 128;
/// Largest ratio of the smallest eigenvalue to the middle one on a surface, for few neighbours and
/// for more. Of points that fill space by chance, 1 in 100 is below that.
const FLAT_OF_FEW: f64 = 0.1;
const FLAT_OF_MORE: f64 = 0.35;
/// Smallest ratio of the middle eigenvalue to the largest on a surface. Below, they are a line.
const LINE: f64 = 0.05;
/// Clouds of fewer points show too little to decide: they count as surfaces.
const FEWEST: usize = 50;
/// If the points on surfaces are a smaller part of the cloud, none counts, else all. Noise may make
/// a third of a scan look like points in space, and it must stay closed.
const LEAST_SURFACE: f64 = 0.35;
/// Rounds in which points between others on a surface join them.
const ROUNDS: usize = 6;

/// Returns whether the points that these eigenvalues of a covariance belong to, the largest first,
/// lie on a plane.
fn is_flat([large, middle, small]: [f64; 3], most: f64) -> bool {
    small <= most * middle && middle >= LINE * large
}

/// Returns whether a point and its nearest neighbours lie on a plane, by the eigenvalues of their
/// covariance.
pub(super) fn is_flat_of_few(values: [f64; 3]) -> bool {
    is_flat(values, FLAT_OF_FEW)
}

/// Returns for each point whether it lies on no surface. The points are in an order in which
/// neighbours are close to each other. `is_flat` says which ones are on a plane with their
/// `nearest`. `is_known` says which ones are on a surface in any case.
pub(super) fn off_surface(
    points: &[Vec3],
    nearest: &[Nearest],
    is_flat: &[bool],
    is_known: impl Fn(usize) -> bool + Sync,
    deadline: Deadline,
    work: &'static str,
) -> Result<Vec<bool>> {
    let all = points.len();
    let none = || vec![false; all];
    if all < FEWEST {
        return Ok(none());
    }
    let mut on = vote(nearest, is_flat, MORE_THAN_HALF);
    on.par_iter_mut().enumerate().for_each(|(at, on)| *on |= is_known(at));
    // Later answers only add points.
    let is_surface = |on: &[bool]| {
        let count = on.par_iter().filter(|on| **on).count() as f64;
        count / (all as f64) >= LEAST_SURFACE
    };
    for stride in STRIDES {
        if is_surface(&on) {
            return Ok(none());
        }
        if stride > 1 && MORE * stride * MOST_OF_CLOUD > all {
            break;
        }
        let flat = flat_of_more(points, &on, stride, deadline, work)?;
        let more = vote(nearest, &flat, MORE_THAN_HALF);
        on.par_iter_mut().zip(more).for_each(|(on, more)| *on |= more);
    }
    for _ in 0..ROUNDS {
        let joined = vote(nearest, &on, HALF);
        on.par_iter_mut().zip(joined).for_each(|(on, joined)| *on |= joined);
    }
    Ok(match is_surface(&on) {
        true => none(),
        false => (0..all).into_par_iter().map(|at| !is_known(at)).collect(),
    })
}

/// Of a point and its ten neighbours, so many are a majority, or half of the neighbours.
const MORE_THAN_HALF: usize = 6;
const HALF: usize = 5;

/// Returns for each point whether at least `most` of the point and its neighbours are chosen.
fn vote(nearest: &[Nearest], is_chosen: &[bool], most: usize) -> Vec<bool> {
    let chosen = |(at, nearest): (usize, &Nearest)| {
        let count = nearest.iter().filter(|&&other| is_chosen[other as usize]).count();
        count + usize::from(is_chosen[at]) >= most
    };
    nearest.par_iter().enumerate().map(chosen).collect()
}

/// Returns for each undecided point whether it lies on a plane with many neighbours, of which one
/// in `stride` is looked at. Points next to each other in the order share the answer of one.
fn flat_of_more(
    points: &[Vec3],
    is_decided: &[bool],
    stride: usize,
    deadline: Deadline,
    work: &'static str,
) -> Result<Vec<bool>> {
    let some: Vec<Vec3> = points.iter().copied().step_by(stride).collect();
    let tree = Neighbours::new(&some);
    let clock = Clock::new(deadline);
    let flat: Vec<bool> = (0..some.len())
        .into_par_iter()
        .map(|at| {
            let range = at * stride..((at + 1) * stride).min(points.len());
            if clock.is_over(at) || is_decided[range].iter().all(|decided| *decided) {
                return true;
            }
            let neighbours = tree.of(at as u32, MORE);
            let center = some[at];
            let offsets =
                || neighbours.iter().map(|&(_, other)| (some[other as usize] - center).as_dvec3());
            is_flat(eigen(scatter(offsets)).0, FLAT_OF_MORE)
        })
        .collect();
    clock.finish(work)?;
    Ok((0..points.len()).into_par_iter().map(|at| flat[at / stride]).collect())
}

/// Returns the sum of the squares of places, and of the one that they are relative to, around their
/// mean.
pub(super) fn scatter<I: Iterator<Item = DVec3>>(offsets: impl Fn() -> I) -> DMat3 {
    let (count, sum) =
        offsets().fold((1.0, DVec3::ZERO), |(n, sum), offset| (n + 1.0, sum + offset));
    let mean = sum / count;
    let mut scatter = DMat3::ZERO;
    for offset in offsets().chain([DVec3::ZERO]) {
        let d = offset - mean;
        scatter += DMat3::from_cols(d * d.x, d * d.y, d * d.z);
    }
    scatter
}

#[cfg(test)]
mod tests {
    use super::super::{Mesh, PointStyle, SurfelOptions};
    use glam::{Vec2, Vec3};

    /// Numbers from 0 to 1, evenly spread by chance.
    fn random() -> impl FnMut() -> f32 {
        let mut state = 7u32;
        move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        }
    }

    /// About normally distributed numbers.
    fn normal(random: &mut impl FnMut() -> f32) -> f32 {
        ((0..12).map(|_| random()).sum::<f32>() - 6.0).clamp(-3.0, 3.0)
    }

    /// Returns the share of the points that are balls.
    fn off(positions: Vec<Vec3>) -> f64 {
        let mesh = Mesh { positions, ..Mesh::default() };
        let options = SurfelOptions { points: PointStyle::Auto, ..SurfelOptions::default() };
        let (surfels, dots) = mesh.points(&options).unwrap();
        let dots = dots.map_or(0, |dots| dots.facets.len());
        assert_eq!(surfels.map_or(0, |set| set.splats.len()) + dots, mesh.positions.len());
        dots as f64 / mesh.positions.len() as f64
    }

    /// A sphere whose points lie beside it by chance, in mean distances between points.
    fn noisy_sphere(count: usize, noise: f32) -> Vec<Vec3> {
        let mut random = random();
        let spacing = (12.57 / count as f32).sqrt();
        let mut place = || {
            let place = Vec3::from([0, 1, 2].map(|_| normal(&mut random))).normalize_or(Vec3::X);
            place * (1.0 + noise * spacing * normal(&mut random))
        };
        (0..count).map(|_| place()).collect()
    }

    /// A scan with noise stays a closed surface.
    #[test]
    fn surfaces_have_no_balls() {
        for (count, noise) in
            [(300, 0.0), (2000, 0.0), (5000, 0.3), (20_000, 0.5), (20_000, 1.0), (40_000, 2.0)]
        {
            assert_eq!(off(noisy_sphere(count, noise)), 0.0, "{count} {noise}");
        }
        let mut random = random();
        // A cube, with its edges and corners, and lines of a scanner: dense along, sparse across.
        let cube = (0..8000).map(|i| {
            let mut place = [random(), random(), random()];
            place[i % 3] = (i / 3 % 2) as f32;
            Vec3::from(place)
        });
        assert_eq!(off(cube.collect()), 0.0);
        let lines = (0..40_000).map(|i| {
            let place = Vec2::new((i % 1000) as f32, 12.0 * (i / 1000) as f32);
            place.extend((place.x * 0.01).sin() * 20.0)
        });
        assert_eq!(off(lines.collect()), 0.0);
    }

    #[test]
    fn what_fills_space_and_curves_are_balls() {
        let mut random = random();
        let in_box: Vec<Vec3> =
            (0..3000).map(|_| Vec3::new(random(), random(), random())).collect();
        assert_eq!(off(in_box.clone()), 1.0);
        let mut at = Vec3::ZERO;
        let walk = (0..2000).map(|_| {
            at += Vec3::from([0, 1, 2].map(|_| normal(&mut random)));
            at
        });
        assert!(off(walk.collect()) > 0.9);
        let helix = (0..2000).map(|i| {
            let turn = i as f32 * 0.02;
            Vec3::new(turn.cos(), turn.sin(), turn * 0.1)
        });
        assert!(off(helix.collect()) > 0.9);
        let lattice =
            (0..512).map(|i| Vec3::new((i % 8) as f32, (i / 8 % 8) as f32, (i / 64) as f32));
        assert_eq!(off(lattice.collect()), 1.0);
        // A surface with a crowd beside it stays closed.
        let crowd = in_box.iter().map(|place| *place + Vec3::X * 2.0);
        let both: Vec<Vec3> = noisy_sphere(3000, 0.2).into_iter().chain(crowd).collect();
        assert_eq!(off(both), 0.0);
    }
}
