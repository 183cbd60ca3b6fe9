//! The directory: how each brick is stored, its size, and the range of its values. Bricks are
//! numbered from the coarsest level to the finest, in each level group by group.

use crate::{
    bricks::{BRICK_BLOCKS, Level, SIDE, joined},
    container::{
        Cursor, Put,
        directory::{Kind, Place},
    },
    volume::Scalar,
};

/// Bits of [`Entry::flags`]: all samples have one value, all blocks have the brick's range, the
/// rest is packed by zstd.
pub const CONSTANT: u8 = 1;
pub const UNIFORM: u8 = 2;
pub const PACKED: u8 = 4;

/// The directory's entry of a brick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Entry {
    pub place: Place,
    /// The value of all samples if they have only one, little-endian; else 0.
    pub value: [u8; 4],
    /// The range of all its blocks together.
    pub range: [u8; 2],
    pub flags: u8,
}

impl Entry {
    /// The entry of a brick in memory.
    pub fn in_memory(range: [u8; 2]) -> Self {
        Self { place: Place::default(), value: [0; 4], range, flags: 0 }
    }

    pub fn has(&self, flag: u8) -> bool {
        self.flags & flag != 0
    }

    /// Bytes of the samples and of the blocks that are stored, unpacked.
    pub fn contents(&self, scalar: Scalar) -> [usize; 2] {
        let samples = if self.has(CONSTANT) { 0 } else { SIDE * SIDE * SIDE * scalar.bytes() };
        [samples, if self.has(UNIFORM) { 0 } else { 2 * BRICK_BLOCKS }]
    }

    fn is_sound(&self, scalar: Scalar) -> bool {
        let whole: usize = self.contents(scalar).iter().sum();
        let bytes = self.place.bytes as usize;
        let fits = if self.has(PACKED) { (1..whole).contains(&bytes) } else { bytes == whole };
        let used = if self.has(CONSTANT) { scalar.bytes() } else { 0 };
        fits && self.flags < 8
            && self.range[0] <= self.range[1]
            && self.value[used..].iter().all(|&byte| byte == 0)
    }

    /// Appends the record of the entry.
    pub fn put(&self, out: &mut Vec<u8>) {
        self.place.put(out);
        out.put(&self.value);
        out.put(&self.range);
        out.put(&[self.flags, 0]);
    }

    /// Reads a record.
    pub fn read(record: &mut Cursor) -> Option<Self> {
        let place = Place::read(record)?;
        let (value, range, [flags, 0]) = (record.array()?, record.array()?, record.array()?) else {
            return None;
        };
        Some(Self { place, value, range, flags })
    }
}

/// The numbers of all bricks of a volume.
#[derive(Debug, Clone)]
pub struct Numbers {
    pub levels: Vec<Level>,
    /// The number of the first brick of each level.
    firsts: Vec<u32>,
    pub count: u32,
}

impl Numbers {
    pub fn new(levels: Vec<Level>) -> Self {
        let mut firsts = vec![0; levels.len()];
        let mut count = 0;
        for (first, level) in firsts.iter_mut().zip(&levels).rev() {
            *first = count;
            count += level.bricks() as u32;
        }
        Self { levels, firsts, count }
    }

    /// Returns the number of a brick of a level.
    pub fn number(&self, level: usize, brick: u32) -> u32 {
        self.firsts[level] + self.levels[level].rank(brick)
    }

    /// Returns the level of a number, and the brick in it.
    pub fn brick(&self, number: u32) -> (usize, u32) {
        // The first numbers descend.
        let level = self.firsts.partition_point(|first| *first > number);
        (level, self.levels[level].brick(number - self.firsts[level]))
    }
}

/// The directory of a volume's bricks.
pub struct Listing {
    pub numbers: Numbers,
    pub scalar: Scalar,
    /// Where the bricks of the file begin, after the root, and where they end.
    pub start: u64,
    pub end: u64,
}

impl Kind for Listing {
    type Entry = Entry;
    type Bounds = [u8; 2];
    const ENTRY: usize = Place::BYTES + 8;
    const BOUNDS: usize = 4;

    fn entry(&self, page: u32, record: &[u8]) -> Result<Entry, String> {
        let entry = Entry::read(&mut Cursor::new(record));
        let entry = entry.filter(|entry| entry.is_sound(self.scalar));
        let (level, brick) = self.numbers.brick(page);
        let entry = entry.ok_or_else(|| contradicts(level, brick))?;
        if entry.place.offset < self.start || entry.place.range().end > self.end {
            let Self { start, end, .. } = self;
            return Err(format!(
                "level {level}, brick {brick} begins at byte {}, but the bricks are from byte \
                 {start} to {end}",
                entry.place.offset
            ));
        }
        Ok(entry)
    }

    fn follows(_: &Entry, _: &Entry) -> Result<(), String> {
        Ok(())
    }

    fn place(entry: &Entry) -> Place {
        entry.place
    }

    fn bounds(entry: &Entry) -> [u8; 2] {
        entry.range
    }

    fn read_bounds(bytes: &mut Cursor) -> Option<[u8; 2]> {
        let [low, high, 0, 0] = bytes.array()? else { return None };
        (low <= high).then_some([low, high])
    }

    fn put_bounds(&[low, high]: &[u8; 2], out: &mut Vec<u8>) {
        out.put(&[low, high, 0, 0]);
    }

    fn around(bounds: &[[u8; 2]]) -> [u8; 2] {
        bounds.iter().fold(crate::bricks::EMPTY, |all, range| joined(all, *range))
    }
}

fn contradicts(level: usize, brick: u32) -> String {
    format!("the values of level {level}, brick {brick} contradict each other")
}

/// The message for a file that has no room for its bricks' entries.
pub fn too_short(bricks: u32) -> String {
    format!("the file is too short for the {bricks} bricks of its header")
}
