//! Whether pages fill a file without gaps.

use super::Place;

/// Ranges of bytes, as sums of a hash of where they begin and where they end. If ranges follow one
/// another without gaps, in whatever order they are added, all but the first beginning and the last
/// end occur in both sums.
#[derive(Debug, Clone, Copy, Default)]
pub struct Tiles {
    starts: u64,
    ends: u64,
}

impl Tiles {
    pub fn add(&mut self, place: Place) {
        let range = place.range();
        self.starts = self.starts.wrapping_add(mixed(range.start));
        self.ends = self.ends.wrapping_add(mixed(range.end));
    }

    /// Returns whether the ranges fill those bytes.
    pub fn fill(self, start: u64, end: u64) -> bool {
        self.starts.wrapping_add(mixed(end)) == self.ends.wrapping_add(mixed(start))
    }
}

/// Mixes the bits of a number (Steele, Lea & Flood 2014).
fn mixed(number: u64) -> u64 {
    let mixed = number.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ mixed >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    mixed ^ mixed >> 31
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_and_overlaps_are_found() {
        let fill = |ranges: &[[u64; 2]]| {
            let mut tiles = Tiles::default();
            for [offset, bytes] in ranges {
                tiles.add(Place { offset: *offset, bytes: *bytes as u32, crc: 0 });
            }
            tiles.fill(10, 40)
        };
        assert!(fill(&[[10, 30]]) && fill(&[[20, 5], [10, 10], [25, 15], [25, 0]]));
        for wrong in [
            &[[10, 10], [25, 15]][..],
            &[[10, 15], [20, 20]],
            &[[10, 15], [20, 5], [25, 15]],
            &[[11, 29]],
            &[[10, 29]],
            &[],
        ] {
            assert!(!fill(wrong), "{wrong:?}");
        }
    }
}
