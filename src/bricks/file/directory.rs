//! The directory: how each brick is stored, its size, and the range of its values.

use super::{HASH, Stored};
use crate::{
    bricks::{BRICK_BLOCKS, Level, SIDE, level},
    container::{Cursor, Put},
    volume::Scalar,
};

/// Bytes of an entry.
const ENTRY: usize = 16;

/// Bits of [`Entry::flags`]: all samples have one value, all blocks have the brick's range, the
/// rest is packed by zstd.
pub const CONSTANT: u8 = 1;
pub const UNIFORM: u8 = 2;
pub const PACKED: u8 = 4;

/// The directory's entry of a brick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Entry {
    /// Bytes in the file.
    pub bytes: u32,
    /// Checksum of these bytes.
    pub crc: u32,
    /// The value of all samples if they have only one, little-endian; else 0.
    pub value: [u8; 4],
    /// The range of all its blocks together.
    pub range: [u8; 2],
    pub flags: u8,
}

impl Entry {
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
        let bytes = self.bytes as usize;
        let fits = if self.has(PACKED) { (1..whole).contains(&bytes) } else { bytes == whole };
        let used = if self.has(CONSTANT) { scalar.bytes() } else { 0 };
        fits && self.flags < 8
            && self.range[0] <= self.range[1]
            && self.value[used..].iter().all(|&byte| byte == 0)
    }
}

/// The entries of all levels, finest first, and where their bricks are.
#[derive(Debug, Clone, Default)]
pub struct Directory {
    pub levels: Vec<Vec<Entry>>,
    /// The byte of the file at which each brick begins.
    pub offsets: Vec<Vec<u64>>,
}

impl Directory {
    /// Bytes of the directory of `bricks` bricks, with its checksum.
    pub fn length(bricks: u64) -> u64 {
        ENTRY as u64 * bricks + 4
    }

    /// Places bricks after a header of `header` bytes and the directory, coarse levels first.
    pub fn new(levels: Vec<Vec<Entry>>, header: usize) -> Self {
        let bricks = levels.iter().map(|level| level.len() as u64).sum();
        let mut at = header as u64 + Self::length(bricks);
        let mut offsets: Vec<Vec<u64>> =
            levels.iter().map(|level| Vec::with_capacity(level.len())).collect();
        for (entries, offsets) in levels.iter().zip(&mut offsets).rev() {
            for entry in entries {
                offsets.push(at);
                at += u64::from(entry.bytes);
            }
        }
        Self { levels, offsets }
    }

    /// Bytes of the directory in memory: entries, offsets and ranges.
    pub fn memory(&self) -> u64 {
        let bricks = self.levels.iter().map(|level| level.len() as u64).sum::<u64>();
        bricks * (size_of::<Entry>() + size_of::<u64>() + size_of::<[u8; 2]>()) as u64
    }

    /// Where the hash begins: after the last brick of level 0.
    pub fn end(&self) -> u64 {
        let last = |(entries, offsets): (&Vec<Entry>, &Vec<u64>)| {
            Some(offsets.last()? + u64::from(entries.last()?.bytes))
        };
        self.levels.iter().zip(&self.offsets).next().and_then(last).unwrap_or_default()
    }

    pub fn encode(&self) -> Vec<u8> {
        let mut out = Vec::new();
        for entry in self.levels.iter().rev().flatten() {
            out.u32(entry.bytes);
            out.u32(entry.crc);
            out.put(&entry.value);
            out.put(&entry.range);
            out.put(&[entry.flags, 0]);
        }
        out.u32(crc32fast::hash(&out));
        out
    }

    /// Reads the directory after a header. The error is a message. No memory is allocated that the
    /// file does not have bytes for.
    pub fn decode(bytes: &[u8], stored: &Stored) -> Result<Self, String> {
        let scalar = stored.header.scalar;
        let levels = level::levels(stored.header.lattice.dims);
        let bricks = levels.iter().map(|level| level.bricks() as u64).sum::<u64>();
        let start = stored.length();
        let short = || format!("the file is too short for the {bricks} bricks of its header");
        let end = usize::try_from(start as u64 + Self::length(bricks)).map_err(|_| short())?;
        let (text, crc) = bytes.get(start..end).ok_or_else(short)?.split_at(end - start - 4);
        if Cursor::new(crc).u32() != Some(crc32fast::hash(text)) {
            return Err("its checksum does not match".into());
        }
        let mut cursor = Cursor::new(text);
        let mut entries = vec![Vec::new(); levels.len()];
        for (number, level) in levels.iter().enumerate().rev() {
            entries[number] = read(&mut cursor, level, number, scalar)?;
        }
        let directory = Self::new(entries, start);
        if directory.end() + HASH as u64 != stored.file_bytes {
            let message =
                format!("its bricks end at byte {}, not {HASH} before the end", directory.end());
            return Err(message);
        }
        Ok(directory)
    }
}

fn read(
    cursor: &mut Cursor,
    level: &Level,
    number: usize,
    scalar: Scalar,
) -> Result<Vec<Entry>, String> {
    let mut entry = || {
        let [bytes, crc] = [cursor.u32()?, cursor.u32()?];
        let (value, range, [flags, 0]) = (cursor.array()?, cursor.array()?, cursor.array()?) else {
            return None;
        };
        Some(Entry { bytes, crc, value, range, flags }).filter(|entry| entry.is_sound(scalar))
    };
    let contradicts =
        |brick: usize| format!("the values of level {number}, brick {brick} contradict each other");
    (0..level.bricks()).map(|brick| entry().ok_or_else(|| contradicts(brick))).collect()
}
