//! Points at the same position.

use crate::parallel::prelude::*;
use glam::Vec3;

/// Returns for each position the index of the first one that is equal to it (often itself).
pub(crate) fn first_of_equals(positions: &[Vec3]) -> Vec<u32> {
    // Adding zero turns −0 into 0.
    first_of(positions.len(), |index| {
        (positions[index as usize] + Vec3::ZERO).to_array().map(f32::to_bits)
    })
}

/// Returns for each of `count` items the index of the first one with the same key.
pub(crate) fn first_of<K: Ord>(count: usize, key: impl Fn(u32) -> K + Sync) -> Vec<u32> {
    let mut order: Vec<u32> = (0..count as u32).collect();
    order.par_sort_unstable_by_key(|&index| (key(index), index));
    let mut first = vec![0; count];
    for equals in order.chunk_by(|&a, &b| key(a) == key(b)) {
        for &index in equals {
            first[index as usize] = equals[0];
        }
    }
    first
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_of_each_place() {
        let positions = [Vec3::X, Vec3::Y, Vec3::X, Vec3::ZERO, -Vec3::ZERO, Vec3::Y];
        assert_eq!(first_of_equals(&positions), [0, 1, 0, 3, 3, 1]);
    }
}
