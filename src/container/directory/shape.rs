//! The numbers of directory pages: all follow from the number of pages.

use super::{Kind, Place, RECORDS};

/// The shape of a directory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Shape {
    /// The number of pages.
    pub count: u32,
    /// The number of directory pages of each level, the lowest first. The last level has one.
    pub levels: Vec<u32>,
}

impl Shape {
    /// The shape of the directory of `count` pages.
    pub fn of(count: u32) -> Self {
        let above = |below: &u32| (*below > 1).then(|| below.div_ceil(RECORDS));
        let first = count.div_ceil(RECORDS).max(1);
        Self { count, levels: std::iter::successors(Some(first), above).collect() }
    }

    /// The level of the root.
    pub fn root(&self) -> usize {
        self.levels.len() - 1
    }

    /// The number of records of a directory page.
    pub fn records(&self, level: usize, number: u32) -> u32 {
        let below = level.checked_sub(1).map_or(self.count, |below| self.levels[below]);
        (below - number * RECORDS).min(RECORDS)
    }

    /// The bytes of a directory page.
    pub fn length<K: Kind>(&self, level: usize, number: u32) -> usize {
        let record = if level == 0 { K::ENTRY } else { Place::BYTES + K::BOUNDS };
        self.records(level, number) as usize * record
    }

    /// The bytes of the root, with its checksum.
    pub fn root_length<K: Kind>(&self) -> usize {
        self.length::<K>(self.root(), 0) + 4
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_level_has_one_page() {
        for (count, levels) in [
            (0, vec![1]),
            (1, vec![1]),
            (512, vec![1]),
            (513, vec![2, 1]),
            (512 * 512, vec![512, 1]),
            (512 * 512 + 1, vec![513, 2, 1]),
            (u32::MAX, vec![8_388_608, 16_384, 32, 1]),
        ] {
            let shape = Shape::of(count);
            assert_eq!(shape.levels, levels, "{count}");
            for (level, pages) in levels.iter().enumerate() {
                let below = if level == 0 { count } else { levels[level - 1] };
                assert_eq!(
                    shape.records(level, pages - 1),
                    below - (pages - 1) * RECORDS,
                    "{count}"
                );
                assert!(*pages < 2 || shape.records(level, 0) == RECORDS);
            }
        }
    }
}
