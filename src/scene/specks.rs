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
    fn equal_parts_all_stay() {
        let mut seen = vec![false; 4096];
        seen.iter_mut().step_by(3).for_each(|is_seen| *is_seen = true);
        let before = seen.clone();
        take_specks(&mut seen, [4096, 1, 1], &[1.0; 4096], 0.5);
        assert_eq!(seen, before);
    }
}
