//! The connected parts of a closed surface. Triangles that share an edge belong to one part; those
//! that only share a vertex need not.
//!
//! Neighbours are usually close in the file. Batches of a few thousand triangles are therefore
//! joined separately, in tables that fit in a core's cache. Few edges have only one side in their
//! batch. These are collected and sorted, and the triangles that meet there are joined. If more
//! than two triangles meet at an edge, they belong to one part, or to several parts that are each
//! closed.

use crate::parallel::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// Triangles per batch, and bits of the number of slots of its table: a third more slots than the
/// triangles have edges.
const FEW: usize = 1 << 13;
const PLACE_BITS: u32 = 15;

/// An edge in the table. An empty slot is all zeros.
#[derive(Debug, Clone, Copy, Default)]
struct Place {
    /// The smaller vertex in the high half, the larger in the low half.
    edge: u64,
    /// The first triangle at the edge, counted within the batch.
    triangle: u32,
    /// Triangles that run towards the larger vertex, minus those that run towards the smaller.
    balance: i32,
}

/// An edge with one side only, in the high half, and its triangle in the low half.
type Open = u128;

/// Joins triangles into parts, from any number of threads. Any vertex numbers will do, if vertices
/// where the surface is connected have the same number.
pub(crate) struct Joining(Sets);

impl Joining {
    /// Prepares this many triangles, at most `u32::MAX`.
    pub fn new(triangles: usize) -> Self {
        Self(Sets::new(triangles))
    }

    /// Bytes needed to join this many triangles, with this many edges from [`add`](Self::add).
    pub fn memory(triangles: u64, open: u64) -> u64 {
        // Lists grow by doubling.
        triangles * size_of::<u32>() as u64 + 2 * open * size_of::<Open>() as u64
    }

    /// Joins a batch of triangles, the first of which has number `first`. Returns the edges at
    /// which triangles of other batches are expected.
    pub fn add(&self, first: u32, triangles: &[[u32; 3]], name: impl Fn(u32) -> u32) -> Vec<Open> {
        let mut open = Vec::new();
        let mut table = vec![Place::default(); 1 << PLACE_BITS];
        let mut parents: Vec<u32> = Vec::with_capacity(FEW);
        for (few, first) in triangles.chunks(FEW).zip((first..).step_by(FEW)) {
            table.fill(Place::default());
            parents.clear();
            parents.extend(0..few.len() as u32);
            for (triangle, corners) in (0..).zip(few) {
                let [a, b, c] = corners.map(&name);
                for [from, to] in [[a, b], [b, c], [c, a]] {
                    if from != to {
                        let other = at_edge(&mut table, triangle, [from, to]);
                        join(&mut parents, other, triangle);
                    }
                }
            }
            for triangle in 0..few.len() as u32 {
                self.0.0[(first + triangle) as usize]
                    .store(first + root(&mut parents, triangle), Relaxed);
            }
            // An edge with equally many triangles of both directions is closed here, whatever other
            // batches contain.
            let left = table.iter().filter(|place| place.balance != 0);
            open.extend(
                left.map(|place| Open::from(place.edge) << 32 | Open::from(first + place.triangle)),
            );
        }
        open
    }

    /// Returns the parts, from all edges that [`add`](Self::add) returned.
    pub fn parts(self, mut open: Vec<Open>) -> Parts {
        open.par_sort_unstable();
        let same = open.par_windows(2).filter(|pair| pair[0] >> 32 == pair[1] >> 32);
        same.for_each(|pair| self.0.join(pair[0] as u32, pair[1] as u32));
        self.0.parts()
    }
}

/// Puts an edge of a triangle in the table, and returns the first triangle at that edge.
fn at_edge(table: &mut [Place], triangle: u32, [from, to]: [u32; 2]) -> u32 {
    let edge = u64::from(from.min(to)) << 32 | u64::from(from.max(to));
    // Hashes by the golden ratio (Knuth 1973).
    let mut at = (edge.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> (u64::BITS - PLACE_BITS)) as usize;
    while table[at].edge != edge && table[at].edge != 0 {
        at = (at + 1) % table.len();
    }
    let place = &mut table[at];
    if place.edge == 0 {
        *place = Place { edge, triangle, balance: 0 };
    }
    place.balance += if from < to { 1 } else { -1 };
    place.triangle
}

/// Like [`Sets::root`], for a single thread.
fn root(above: &mut [u32], mut member: u32) -> u32 {
    while above[member as usize] != member {
        let higher = above[above[member as usize] as usize];
        above[member as usize] = higher;
        member = higher;
    }
    member
}

fn join(above: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(above, a), root(above, b));
    above[a.max(b) as usize] = a.min(b);
}

/// The part of each triangle.
pub(crate) struct Parts {
    of: Vec<u32>,
    count: usize,
}

impl Parts {
    /// Number of parts. Triangles that are a single point are parts of their own.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Returns the part of a triangle. Parts are numbered in the order of their first triangles.
    pub fn of(&self, number: usize) -> u32 {
        self.of[number]
    }
}

/// Disjoint sets that any number of threads can join at once. Each member links to itself or to one
/// of a smaller index. A link is only set if the member is still a root at that moment (Anderson &
/// Woll 1991).
struct Sets(Vec<AtomicU32>);

impl Sets {
    fn new(count: usize) -> Self {
        Self((0..count as u32).into_par_iter().map(AtomicU32::new).collect())
    }

    fn root(&self, mut member: u32) -> u32 {
        loop {
            let above = self.0[member as usize].load(Relaxed);
            if above == member {
                return member;
            }
            let higher = self.0[above as usize].load(Relaxed);
            if higher < above {
                // Halves the path for the next time. It does no harm if another thread has done so
                // already.
                self.0[member as usize].store(higher, Relaxed);
            }
            member = higher;
        }
    }

    fn join(&self, mut a: u32, mut b: u32) {
        loop {
            (a, b) = (self.root(a), self.root(b));
            if a == b {
                return;
            }
            let (low, high) = (a.min(b), a.max(b));
            if self.0[high as usize].compare_exchange(high, low, Relaxed, Relaxed).is_ok() {
                return;
            }
        }
    }

    fn parts(self) -> Parts {
        let mut of: Vec<u32> = self.0.into_iter().map(AtomicU32::into_inner).collect();
        let mut count = 0;
        for member in 0..of.len() {
            // The member it links to comes earlier and already has its number.
            let above = of[member] as usize;
            of[member] = if above < member { of[above] } else { count };
            count += u32::from(above == member);
        }
        Parts { of, count: count as usize }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Joins batches of `few` triangles, each batch on its own.
    fn parts(triangles: &[[u32; 3]], few: usize) -> Parts {
        let joining = Joining::new(triangles.len());
        let mut chunks: Vec<_> = triangles.chunks(few).enumerate().collect();
        chunks.reverse();
        let open = chunks.into_par_iter().flat_map_iter(|(chunk, triangles)| {
            joining.add((chunk * few) as u32, triangles, |vertex| vertex)
        });
        let open = open.collect();
        joining.parts(open)
    }

    #[test]
    fn parts_are_those_of_one_thread() {
        let sphere = crate::surface::Mesh::sphere(2);
        let per_sphere = sphere.positions.len() as u32;
        // Each shares one vertex with the one before.
        let shifted = |i: u32| {
            sphere.triangles.iter().map(move |t| t.map(|vertex| vertex + i * (per_sphere - 1)))
        };
        let triangles: Vec<[u32; 3]> = (0..40).flat_map(shifted).collect();
        for few in [1, 7, 500, triangles.len()] {
            let parts = parts(&triangles, few);
            assert_eq!(parts.count(), 40, "{few}");
            assert!(
                (0..triangles.len())
                    .all(|number| parts.of(number) as usize == number / sphere.triangles.len())
            );
        }
    }

    #[test]
    fn triangles_without_area_are_of_the_parts_around() {
        let sheet = [[0, 1, 2], [0, 2, 1], [1, 1, 2], [5, 5, 5]];
        assert_eq!(parts(&sheet, 4).of, [0, 0, 0, 1]);
        // Alone in its batch, a triangle without area belongs to no other part.
        assert_eq!(parts(&sheet, 1).of, [0, 0, 1, 2]);
    }

    /// Two tetrahedra at one edge, which four triangles share.
    #[test]
    fn all_triangles_at_an_edge_are_of_one_part() {
        let tetrahedron = |[a, b, c, d]: [u32; 4]| [[a, c, b], [a, b, d], [b, c, d], [c, a, d]];
        let both = [tetrahedron([0, 1, 2, 3]), tetrahedron([0, 1, 4, 5])].concat();
        assert_eq!([1, 8].map(|few| parts(&both, few).count()), [1; 2]);
        // If each is closed before the other follows, they may be two parts.
        assert_eq!(parts(&both, 4).count(), 2);
        let by_a_vertex = [tetrahedron([0, 1, 2, 3]), tetrahedron([0, 6, 4, 5])].concat();
        assert_eq!([1, 3, 8].map(|few| parts(&by_a_vertex, few).count()), [2; 3]);
    }
}
