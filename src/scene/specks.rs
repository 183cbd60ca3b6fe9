//! Specks: small parts of a volume apart from the rest.

/// A part is a speck if it has less than this share of what the largest part has.
const SMALL: f64 = 0.01;

/// Takes the specks from the blocks of a grid that are seen, the smallest first, as long as they
/// have no more than a `share` of the `weights` of all of them. Blocks that touch, even at a
/// corner, belong to one part.
pub(super) fn take_specks(seen: &mut [bool], dims: [usize; 3], weights: &[f32], share: f64) {
    let parts = parts(seen, dims);
    let weight_of = |part: &Vec<usize>| part.iter().map(|&at| f64::from(weights[at])).sum::<f64>();
    let mut parts: Vec<(f64, Vec<usize>)> =
        parts.into_iter().map(|part| (weight_of(&part), part)).collect();
    parts.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let all: f64 = parts.iter().map(|(weight, _)| weight).sum();
    let largest = parts.last().map_or(0.0, |(weight, _)| *weight);
    let mut taken = 0.0;
    for (weight, part) in parts {
        taken += weight;
        let is_speck = weight < SMALL * largest && taken <= share * all;
        if !is_speck {
            return;
        }
        part.into_iter().for_each(|at| seen[at] = false);
    }
}

/// Returns for each block of a grid the mean of those up to `reach` blocks away along each axis.
/// Beyond the grid there is nothing.
pub(super) fn means_around(means: &[f32], dims: [usize; 3], reach: usize) -> Vec<f32> {
    let mut sums = means.to_vec();
    let strides = [1, dims[0], dims[0] * dims[1]];
    for (count, stride) in dims.into_iter().zip(strides) {
        let before = sums.clone();
        for (at, sum) in sums.iter_mut().enumerate() {
            let place = at / stride % count;
            let first = at - place.min(reach) * stride;
            let last = at + (count - 1 - place).min(reach) * stride;
            *sum = (first..=last).step_by(stride).map(|other| before[other]).sum();
        }
    }
    let count = (2 * reach + 1).pow(3) as f32;
    sums.iter().map(|sum| sum / count).collect()
}

/// Returns the parts of the grid, each as the blocks that it consists of.
fn parts(seen: &[bool], [nx, ny, nz]: [usize; 3]) -> Vec<Vec<usize>> {
    let mut is_visited: Vec<bool> = seen.iter().map(|is_seen| !is_seen).collect();
    let mut parts = Vec::new();
    for first in 0..seen.len() {
        if is_visited[first] {
            continue;
        }
        is_visited[first] = true;
        let mut part = vec![first];
        let mut next = 0;
        while let Some(&at) = part.get(next) {
            let [x, y, z] = [at % nx, at / nx % ny, at / nx / ny];
            let around = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
            for k in around(z, nz) {
                for j in around(y, ny) {
                    for i in around(x, nx) {
                        let other = i + nx * (j + ny * k);
                        if !std::mem::replace(&mut is_visited[other], true) {
                            part.push(other);
                        }
                    }
                }
            }
            next += 1;
        }
        parts.push(part);
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube of 5 blocks a side in a grid of 16, and single blocks elsewhere.
    fn grid(others: &[[usize; 3]]) -> Vec<bool> {
        let mut seen: Vec<bool> = (0..16 * 16 * 16)
            .map(|at: usize| [at % 16, at / 16 % 16, at / 256].iter().all(|i| (8..13).contains(i)))
            .collect();
        others.iter().for_each(|[x, y, z]| seen[x + 16 * (y + 16 * z)] = true);
        seen
    }

    #[test]
    fn specks_are_taken_and_parts_stay() {
        let left = |others: &[[usize; 3]], share: f64| {
            let mut seen = grid(others);
            take_specks(&mut seen, [16; 3], &[1.0; 4096], share);
            seen.iter().filter(|is_seen| **is_seen).count()
        };
        assert_eq!(left(&[[0; 3]], 0.01), 125);
        // Together they are more than the share: the last one stays.
        assert_eq!(left(&[[0; 3], [3, 0, 0], [0, 6, 0]], 0.02), 126);
        // Too large a part, and a block that touches the cube at a corner.
        assert_eq!(left(&[[0; 3], [1, 0, 0]], 0.1), 127);
        assert_eq!(left(&[[7; 3]], 0.1), 126);
    }

    #[test]
    fn means_around_blocks_by_hand() {
        let mut means = vec![0.0; 4 * 3 * 2];
        (means[1 + 4], means[3]) = (27.0, 2.7);
        let around = means_around(&means, [4, 3, 2], 1);
        let at = |x: usize, y: usize, z: usize| around[x + 4 * (y + 3 * z)];
        for (place, expected) in [(at(0, 0, 1), 1.0), (at(2, 1, 0), 1.1), (at(3, 1, 1), 0.1)] {
            assert!((place - expected).abs() < 1e-6, "{place} {expected}");
        }
        assert_eq!(at(3, 2, 0), 0.0);
        assert_eq!(means_around(&means, [4, 3, 2], 0), means);
    }

    #[test]
    fn equal_parts_all_stay() {
        let mut seen = vec![false; 4096];
        seen.iter_mut().step_by(3).for_each(|is_seen| *is_seen = true);
        let before = seen.clone();
        take_specks(&mut seen, [4096, 1, 1], &[1.0; 4096], 0.5);
        assert_eq!(seen, before);
    }
}
