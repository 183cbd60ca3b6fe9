//! The nearest neighbours of points: a balanced k-d tree over an index array, built and asked in parallel.
//!
//! Points are halved by rank, so coincident points and points on a line or a grid cost no more than others.

use glam::Vec3;

/// Ranges up to this long are searched through.
const LEAF: usize = 8;

/// `order` holds point indices; the middle of a range is the point that halves it, along `axes[middle]`. `sorted` are the
/// points in that order, so that those near to each other in space are near in memory.
pub(crate) struct Neighbours<'a> {
    points: &'a [Vec3],
    sorted: Vec<Vec3>,
    order: Vec<u32>,
    axes: Vec<u8>,
}

/// The `K` nearest found so far, as squared distance and index, nearest first.
pub(crate) struct Nearest<const K: usize> {
    found: [(f32, u32); K],
    count: usize,
    limit: usize,
}

impl<const K: usize> Nearest<K> {
    /// Distance and index of the neighbours, nearest first.
    pub fn iter(&self) -> impl Iterator<Item = (f32, u32)> + '_ {
        self.found[..self.count].iter().map(|&(squared, index)| (squared.sqrt(), index))
    }

    /// Beyond this squared distance nothing is of interest.
    fn reach(&self) -> f32 {
        if self.count < self.limit { f32::INFINITY } else { self.found[self.limit - 1].0 }
    }

    fn offer(&mut self, squared: f32, index: u32) {
        if squared >= self.reach() {
            return;
        }
        let mut at = self.count.min(self.limit - 1);
        while at > 0 && self.found[at - 1].0 > squared {
            self.found[at] = self.found[at - 1];
            at -= 1;
        }
        self.found[at] = (squared, index);
        self.count = (self.count + 1).min(self.limit);
    }
}

impl<'a> Neighbours<'a> {
    /// Takes at most `u32::MAX` points, all finite.
    pub fn new(points: &'a [Vec3]) -> Self {
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        let mut axes = vec![0; points.len()];
        build(points, &mut order, &mut axes);
        let sorted = order.iter().map(|&index| points[index as usize]).collect();
        Self { points, sorted, order, axes }
    }

    /// The points' indices in an order in which neighbours are near each other: asking in it is several times faster.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// The `K` points nearest to point `index`, itself left out.
    pub fn of<const K: usize>(&self, index: u32) -> Nearest<K> {
        self.first_of(index, K)
    }

    /// The `limit` points nearest to point `index`, itself left out; `limit` lies in 1 … `K`.
    pub fn first_of<const K: usize>(&self, index: u32, limit: usize) -> Nearest<K> {
        let mut nearest = Nearest { found: [(f32::INFINITY, 0); K], count: 0, limit: limit.clamp(1, K) };
        self.search(0, self.order.len(), index, self.points[index as usize], &mut nearest);
        nearest
    }

    fn search<const K: usize>(&self, from: usize, to: usize, own: u32, at: Vec3, nearest: &mut Nearest<K>) {
        let mut offer = |place: usize| {
            if self.order[place] != own {
                nearest.offer(self.sorted[place].distance_squared(at), self.order[place]);
            }
        };
        if to - from <= LEAF {
            (from..to).for_each(offer);
            return;
        }
        let middle = from.midpoint(to);
        offer(middle);
        let axis = usize::from(self.axes[middle]);
        let beyond = at[axis] - self.sorted[middle][axis];
        let (near, far) = ((from, middle), (middle + 1, to));
        let (near, far) = if beyond < 0.0 { (near, far) } else { (far, near) };
        self.search(near.0, near.1, own, at, nearest);
        if beyond * beyond < nearest.reach() {
            self.search(far.0, far.1, own, at, nearest);
        }
    }
}

fn build(points: &[Vec3], order: &mut [u32], axes: &mut [u8]) {
    if order.len() <= LEAF {
        return;
    }
    let point = |index: u32| points[index as usize];
    let start = point(order[0]);
    let (low, high) = order.iter().fold((start, start), |(low, high), &i| (low.min(point(i)), high.max(point(i))));
    let axis = (high - low).max_position();
    let middle = order.len() / 2;
    order.select_nth_unstable_by(middle, |&a, &b| point(a)[axis].total_cmp(&point(b)[axis]).then(a.cmp(&b)));
    axes[middle] = axis as u8;
    let (left, right) = order.split_at_mut(middle);
    let (left_axes, right_axes) = axes.split_at_mut(middle);
    let (right, right_axes) = (&mut right[1..], &mut right_axes[1..]);
    if left.len() > 1 << 12 {
        rayon::join(|| build(points, left, left_axes), || build(points, right, right_axes));
    } else {
        build(points, left, left_axes);
        build(points, right, right_axes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_what_a_search_through_all_finds() {
        let mut random = 7u32;
        let mut next = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (random >> 8) as f32 / (1 << 24) as f32
        };
        let points: Vec<Vec3> = (0..500).map(|_| Vec3::new(next(), next() * 0.1, next() * 3.0)).collect();
        let tree = Neighbours::new(&points);
        for index in 0..points.len() {
            let mut all: Vec<f32> = points.iter().map(|p| p.distance(points[index])).collect();
            all.sort_by(f32::total_cmp);
            let found: Vec<f32> = tree.of::<6>(index as u32).iter().map(|(distance, _)| distance).collect();
            assert_eq!(found, all[1..7]);
            let fewer: Vec<f32> = tree.first_of::<6>(index as u32, 4).iter().map(|(distance, _)| distance).collect();
            assert_eq!(fewer, all[1..5]);
        }
    }

    #[test]
    fn many_coincident_points_are_no_trouble() {
        let points = vec![Vec3::ONE; 20_000];
        let tree = Neighbours::new(&points);
        assert!((0..20_000).all(|index| tree.of::<8>(index).iter().count() == 8));
        assert_eq!(Neighbours::new(&points[..1]).of::<8>(0).iter().count(), 0);
    }
}
