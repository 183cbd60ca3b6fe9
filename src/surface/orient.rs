//! Consistent orientation of the normals of a point cloud.
//!
//! Planes fitted to neighbours have no side. Neighbouring normals that are nearly parallel are the
//! most reliable to orient by each other. Orientation therefore spreads along the minimum spanning
//! tree of the neighbour graph with weight 1 − |n·m| (Hoppe, DeRose, Duchamp, McDonald and
//! Stuetzle, Surface Reconstruction from Unorganized Points, 1992). The tree is never traversed:
//! Kruskal's algorithm joins sets whose members know their side relative to the set's root.
//!
//! Then every connected part is turned as a whole. By the divergence theorem, the sum of area · n·p
//! over a closed surface is three times its volume if the normals point outward. Its sign therefore
//! gives the outside, whatever the shape. An open part is turned away from the centre of the point
//! cloud. If the sum is indecisive, as on flat ground, the part faces up (+z).

use crate::parallel::prelude::*;
use glam::{DVec3, Vec3};

/// A sum below this fraction of the largest possible one is indecisive.
const LEAST_VOTE: f64 = 0.03;
/// A part counts as closed if its mean normal is shorter than this.
const CLOSED: f64 = 0.2;

/// The least cosine of the angle between the planes of a normal and of the same one as it was
/// decided elsewhere, if that is to count.
const SAME_PLANE: f64 = 0.5;
/// The least part of those normals, more of one side than of the other, that decides.
const AGREEING: f64 = 0.25;

/// What the caller knows about points that are a part of a point cloud.
#[derive(Default)]
pub(crate) struct Known {
    /// The approximate median distance of neighbours in the whole cloud; that of these points if
    /// `None`.
    pub spacing: Option<f32>,
    /// The centre of the whole cloud; that of these points if `None`.
    pub center: Option<DVec3>,
    /// Normals of some points whose sides were decided by more of the cloud than these points. The
    /// connected parts that contain them follow, if most of them agree.
    pub normals: Vec<(u32, Vec3)>,
}

/// Gives the normals a consistent side. Zero normals have none and connect nothing. Normals that
/// are not `free` connect nothing either and stay as they are. A point may be among its own
/// `neighbours`. The area that a point stands for is its `spacing` squared.
pub(super) fn orient<const N: usize>(
    points: &[Vec3],
    spacing: &[f32],
    neighbours: &[[u32; N]],
    free: &[bool],
    known: &Known,
    normals: &mut [Vec3],
) {
    let mut sets = Sets::new(points.len());
    for edge in edges(neighbours, free, normals) {
        let (from, to) = ends(edge, neighbours);
        sets.join(from as u32, to as u32, normals[from].dot(normals[to]) < 0.0);
    }
    let taking_part: Vec<usize> = (0..points.len()).filter(|&index| free[index]).collect();
    let own_center =
        || points.iter().map(|p| p.as_dvec3()).sum::<DVec3>() / points.len().max(1) as f64;
    let center = known.center.unwrap_or_else(own_center);
    let mut parts = vec![0u32; points.len()];
    let mut votes: Vec<Votes> = Vec::new();
    for &index in &taking_part {
        let (root, turned) = sets.find(index as u32);
        if turned {
            normals[index] = -normals[index];
        }
        // The part's number is stored at its root, counted from 1.
        let root = root as usize;
        if parts[root] == 0 {
            votes.push(Votes::default());
            parts[root] = votes.len() as u32;
        }
        let area = f64::from(spacing[index]).powi(2);
        votes[parts[root] as usize - 1].add(
            points[index].as_dvec3() - center,
            normals[index].as_dvec3(),
            area,
        );
    }
    for &(index, settled) in known.normals.iter().filter(|(index, _)| free[*index as usize]) {
        let (root, _) = sets.find(index);
        let agreement = f64::from(normals[index as usize].dot(settled));
        votes[parts[root as usize] as usize - 1].follow(agreement);
    }
    let inward: Vec<bool> = votes.iter().map(Votes::face_inward).collect();
    for index in taking_part {
        let (root, _) = sets.find(index as u32);
        if inward[parts[root as usize] as usize - 1] {
            normals[index] = -normals[index];
        }
    }
}

/// Bits of an edge below its weight: the number of its slot among all neighbours.
const PLACE: u32 = 40;

/// Returns the edges of the neighbour graph, lightest first, each once.
fn edges<const N: usize>(neighbours: &[[u32; N]], free: &[bool], normals: &[Vec3]) -> Vec<u64> {
    let takes_part = |index: usize| free[index] && normals[index] != Vec3::ZERO;
    let mut edges: Vec<u64> = (0..neighbours.len())
        .into_par_iter()
        .filter(|&from| takes_part(from))
        .flat_map_iter(|from| {
            neighbours[from].iter().enumerate().filter_map(move |(slot, &to)| {
                let to = to as usize;
                // If both points list each other, the edge of the one with the smaller index is
                // kept.
                let again = to < from && neighbours[to].contains(&(from as u32));
                if again || to == from || !takes_part(to) {
                    return None;
                }
                let weight = (1.0 - normals[from].dot(normals[to]).abs()).clamp(0.0, 1.0);
                let weight = (f64::from(weight) * f64::from((1 << (u64::BITS - PLACE)) - 1)) as u64;
                Some(weight << PLACE | (from * N + slot) as u64)
            })
        })
        .collect();
    edges.par_sort_unstable();
    edges
}

fn ends<const N: usize>(edge: u64, neighbours: &[[u32; N]]) -> (usize, usize) {
    let place = (edge & ((1 << PLACE) - 1)) as usize;
    (place / N, neighbours[place / N][place % N] as usize)
}

/// Disjoint sets of points. Each point knows whether it is flipped relative to its set's root.
struct Sets {
    parent: Vec<u32>,
    /// Relative to the parent.
    turned: Vec<bool>,
    size: Vec<u32>,
}

impl Sets {
    fn new(count: usize) -> Self {
        Self {
            parent: (0..count as u32).collect(),
            turned: vec![false; count],
            size: vec![1; count],
        }
    }

    /// Returns the root of a point's set, and whether the point is flipped relative to it.
    fn find(&mut self, point: u32) -> (u32, bool) {
        let mut at = point as usize;
        let mut turned = false;
        loop {
            let parent = self.parent[at] as usize;
            let above = self.parent[parent];
            if above as usize == parent {
                return (above, turned ^ self.turned[at]);
            }
            // Halves the path for the next time.
            self.parent[at] = above;
            self.turned[at] ^= self.turned[parent];
            turned ^= self.turned[at];
            at = above as usize;
        }
    }

    /// Joins two sets. `opposed`: the original normals of the two points are opposed.
    fn join(&mut self, a: u32, b: u32, opposed: bool) {
        let ((a, a_turned), (b, b_turned)) = (self.find(a), self.find(b));
        if a == b {
            return;
        }
        let (root, child) =
            if self.size[a as usize] >= self.size[b as usize] { (a, b) } else { (b, a) };
        self.parent[child as usize] = root;
        self.turned[child as usize] = opposed ^ a_turned ^ b_turned;
        self.size[root as usize] += self.size[child as usize];
    }
}

/// Sums over a connected part: area, area · p, area · p², area · n and area · n·p.
#[derive(Default)]
struct Votes {
    area: f64,
    positions: DVec3,
    squares: f64,
    normals: DVec3,
    fluxes: f64,
    /// How far the normals agree with those already decided, and how far they might.
    settled: [f64; 2],
}

impl Votes {
    /// Adds a point. Its position is relative to the centre of the point cloud.
    fn add(&mut self, position: DVec3, normal: DVec3, area: f64) {
        self.area += area;
        self.positions += position * area;
        self.squares += position.length_squared() * area;
        self.normals += normal * area;
        self.fluxes += position.dot(normal) * area;
    }

    /// Counts the cosine between a normal and the same one as already decided. If their planes
    /// differ, its sign means little.
    fn follow(&mut self, cosine: f64) {
        if cosine.abs() >= SAME_PLANE {
            self.settled[0] += cosine;
            self.settled[1] += cosine.abs();
        }
    }

    fn face_inward(&self) -> bool {
        let [sum, most] = self.settled;
        if most > 0.0 && sum.abs() >= AGREEING * most {
            return sum < 0.0;
        }
        let own_center = self.positions / self.area.max(f64::MIN_POSITIVE);
        // Over a closed part the sum is the same around any centre, but most precise around its
        // own.
        let closed = self.normals.length() < CLOSED * self.area;
        let center = if closed { own_center } else { DVec3::ZERO };
        let flux = self.fluxes - center.dot(self.normals);
        let squares =
            self.squares - 2.0 * center.dot(self.positions) + center.length_squared() * self.area;
        let largest = (squares.max(0.0) * self.area).sqrt();
        if flux.abs() > LEAST_VOTE * largest { flux < 0.0 } else { self.normals.z < 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_know_their_sides() {
        // A ring of 100 points of random sides, joined in an order of strides.
        let side = |point: u32| point.wrapping_mul(2_654_435_761) >> 31 == 1;
        let mut sets = Sets::new(100);
        for step in 0..100 {
            let (a, b) = (step * 37 % 100, (step * 37 + 1) % 100);
            sets.join(a, b, side(a) != side(b));
        }
        let (root, _) = sets.find(0);
        for point in 0..100 {
            assert_eq!(sets.find(point), (root, side(point) != side(root)), "{point}");
        }
    }
}
