//! The nearest neighbours of points, by kiddo's k-d tree.
//!
//! kiddo splits along x, y and z in turn, to a depth fixed by the number of points. Across an
//! axis-parallel plane or line of points a split does nothing, so the points would end up in large
//! leaves. With kiddo 6.3, a million points on a plane take 3 to 4 times as long as with a tree
//! that chooses its axes. 200 000 on a line take 80 times as long. The tree is therefore built over
//! points rotated so that no axis is special. The rotation is in integers, which keeps equal
//! distances equal.

use super::weld::first_of;
use crate::parallel::prelude::*;
use glam::{DMat3, DVec3, Vec3};
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use std::num::NonZero;

/// Rotates space and scales it by `SCALE`.
const TURN: DMat3 = DMat3::from_cols(
    DVec3::new(2.0, 3.0, 6.0),
    DVec3::new(3.0, -6.0, 2.0),
    DVec3::new(6.0, 2.0, -3.0),
);
const SCALE: f64 = 7.0;

pub(crate) struct Neighbours<'a> {
    points: &'a [Vec3],
    tree: ImmutableKdTree<f64, 3>,
}

impl<'a> Neighbours<'a> {
    /// Takes at most `u32::MAX` points, all finite. Merge coincident points first. They are found,
    /// but each query at a position visits all points there (a second for 20 000 queries at a
    /// position of 20 000 points).
    pub fn new(points: &'a [Vec3]) -> Self {
        let turned: Vec<[f64; 3]> = points.par_iter().map(|&point| turned(point)).collect();
        let tree = ImmutableKdTree::new_from_slice(&turned).expect("an index of 32 bits");
        Self { points, tree }
    }

    /// Returns for each point the index of the first one at the same position, as far as the tree
    /// can distinguish positions. Points also count as equal if 64 bits cannot represent their
    /// difference at their distance from the origin.
    pub fn first_of_equals(points: &[Vec3]) -> Vec<u32> {
        first_of(points.len(), |index| {
            turned(points[index as usize]).map(|value| (value + 0.0).to_bits())
        })
    }

    /// Returns the points' indices in an order in which neighbours are close to each other.
    /// Querying in it is about twice as fast.
    pub fn order(&self) -> Vec<u32> {
        self.tree.iter().map(|(index, _)| index).collect()
    }

    /// Returns the distance of a position from the nearest point.
    pub fn distance(&self, at: Vec3) -> f64 {
        let at = turned(at);
        let query = self.tree.query(&at);
        let nearest = query.nearest_n::<SquaredEuclidean<f64>>(NonZero::<usize>::MIN).execute();
        nearest.iter().map(|point| point.distance.sqrt() / SCALE).fold(f64::INFINITY, f64::min)
    }

    /// Returns the distance of a position from the nearest point, and that point's index.
    pub fn nearest(&self, at: Vec3) -> (f64, u32) {
        let at = turned(at);
        let query = self.tree.query(&at);
        let nearest = query.nearest_n::<SquaredEuclidean<f64>>(NonZero::<usize>::MIN).execute();
        let nearest = nearest.iter().map(|point| (point.distance.sqrt() / SCALE, point.item));
        nearest.fold((f64::INFINITY, 0), |best, other| if other.0 < best.0 { other } else { best })
    }

    /// Returns distance and index of the `count` points nearest to point `index`, which is
    /// excluded, nearest first.
    pub fn of(&self, index: u32, count: usize) -> Vec<(f32, u32)> {
        let at = turned(self.points[index as usize]);
        let wanted = NonZero::<usize>::MIN.saturating_add(count);
        let nearest = self.tree.query(&at).nearest_n::<SquaredEuclidean<f64>>(wanted).execute();
        let others = nearest.iter().filter(|point| point.item != index).take(count);
        others.map(|point| ((point.distance.sqrt() / SCALE) as f32, point.item)).collect()
    }
}

fn turned(point: Vec3) -> [f64; 3] {
    (TURN * point.as_dvec3()).to_array()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Queries every `step`-th point for several numbers of neighbours, and compares with a search
    /// through all points.
    fn check(points: &[Vec3], step: usize) {
        let tree = Neighbours::new(points);
        for index in (0..points.len()).step_by(step) {
            let mut all: Vec<f64> =
                points.iter().map(|p| p.as_dvec3().distance(points[index].as_dvec3())).collect();
            all.sort_by(f64::total_cmp);
            for count in [1, 4, 16, 64] {
                let neighbours = tree.of(index as u32, count);
                assert_eq!(neighbours.len(), count.min(points.len() - 1));
                for (&(distance, neighbour), &expected) in neighbours.iter().zip(&all[1..]) {
                    assert!(
                        (f64::from(distance) - expected).abs() <= 1e-6 * expected,
                        "{distance} for {expected}"
                    );
                    let exact = points[neighbour as usize].distance(points[index]);
                    assert!(
                        (distance - exact).abs() <= 1e-6 * exact,
                        "{distance} to a point at {exact}"
                    );
                }
                let mut indices: Vec<u32> =
                    neighbours.iter().map(|&(_, index)| index).chain([index as u32]).collect();
                indices.sort_unstable();
                assert!(indices.array_windows().all(|[a, b]| a < b), "{indices:?}");
            }
        }
    }

    /// Positions whose differences vanish by rounding count as one.
    #[test]
    fn what_the_tree_cannot_tell_apart_is_one() {
        let near = |i: usize| Vec3::new(1e10, i as f32 * 1e-14, 0.0);
        let points: Vec<Vec3> = (0..1000)
            .map(near)
            .chain([Vec3::new(-1e10, 0.0, 0.0), Vec3::ZERO, -Vec3::ZERO])
            .collect();
        let first = Neighbours::first_of_equals(&points);
        assert!(first[..1000].iter().all(|&first| first == 0));
        assert_eq!(first[1000..], [1000, 1001, 1001]);
        let apart = random(500, Vec3::ONE);
        assert_eq!(
            Neighbours::first_of_equals(&apart),
            super::super::weld::first_of_equals(&apart)
        );
    }

    fn random(count: usize, extent: Vec3) -> Vec<Vec3> {
        let mut random = 7u32;
        let mut next = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (random >> 8) as f32 / (1 << 24) as f32
        };
        (0..count).map(|_| Vec3::new(next(), next(), next()) * extent).collect()
    }

    fn grid(x: usize, y: usize, z: usize) -> Vec<Vec3> {
        (0..x * y * z)
            .map(|i| Vec3::new((i % x) as f32, (i / x % y) as f32, (i / x / y) as f32))
            .collect()
    }

    #[test]
    fn finds_what_a_search_through_all_finds() {
        check(&random(3000, Vec3::new(1.0, 0.1, 3.0)), 7);
        check(
            &random(3000, Vec3::new(1.0, 1e-4, 1e4)).iter().map(|p| p + 100.0).collect::<Vec<_>>(),
            7,
        );
        // On a plane, on a line, on grids, and many at few positions.
        check(&random(3000, Vec3::new(1.0, 0.0, 1.0)), 7);
        check(&random(3000, Vec3::Y), 7);
        for points in [grid(14, 14, 14), grid(1, 50, 60), grid(3000, 1, 1)] {
            check(&points, 7);
        }
        check(&grid(3000, 1, 1).iter().map(|p| Vec3::splat(p.x)).collect::<Vec<_>>(), 7);
        check(&(0..3000).map(|i| Vec3::splat((i % 7) as f32)).collect::<Vec<_>>(), 7);
        (0..70).for_each(|count| check(&random(count, Vec3::ONE), 1));
    }

    #[test]
    fn many_coincident_points_are_no_trouble() {
        let points = vec![Vec3::ONE; 5000];
        let tree = Neighbours::new(&points);
        for index in 0..5000 {
            let neighbours = tree.of(index, 8);
            assert_eq!(neighbours.len(), 8);
            assert!(neighbours.iter().all(|&(distance, other)| distance == 0.0 && other != index));
        }
    }

    #[test]
    fn the_order_and_the_answers_are_the_same_each_time() {
        let points: Vec<Vec3> = grid(40, 40, 40);
        let ask = || {
            let tree = Neighbours::new(&points);
            let order = tree.order();
            let neighbours: Vec<_> = order.par_iter().map(|&index| tree.of(index, 10)).collect();
            (order, neighbours)
        };
        let (mut order, neighbours) = ask();
        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        assert!(alone.install(ask) == (order.clone(), neighbours));
        order.sort_unstable();
        assert!(order.iter().copied().eq(0..64_000));
    }
}
