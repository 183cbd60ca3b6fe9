//! Skips the times of packed points. No result depends on them, but in formats below 6 the other
//! values of a point follow them in the same stream.
//!
//! The `laz` crate recurses each time that a code means “another sequence”. A file may repeat that
//! code without limit, so the stack overflows and the process dies. This module does the same in a
//! loop (LASzip, Isenburg 2013, version 2 of the field).

use laz::{
    decoders::ArithmeticDecoder,
    decompressors::{IntegerDecompressor, IntegerDecompressorBuilder},
    models::{ArithmeticModel, ArithmeticModelBuilder},
    record::FieldDecompressor,
};
use std::io::{Read, Result};

/// The largest and smallest multiple of the last difference that have a code.
const MOST: i32 = 500;
const LEAST: i32 = -10;
/// Codes after these: the same time again, a 64-bit time, and from there on another sequence.
const SAME: i32 = MOST - LEAST + 1;
const WHOLE: i32 = SAME + 1;
const CODES: u32 = WHOLE as u32 + 4;
/// Codes after a difference of 0: the same time, a difference, a 64-bit time, and three other
/// sequences.
const CODES_AFTER_NONE: u32 = 6;
/// The context of the upper half of a 64-bit time, out of nine contexts.
const UPPER: u32 = 8;

/// A sequence of consecutive times; a stream interleaves four.
#[derive(Clone, Copy, Default)]
struct Sequence {
    time: i64,
    difference: i32,
    /// Number of consecutive differences that were far from a small multiple of the last one.
    jumps: u32,
}

/// Decodes and discards the times of a stream, each a 64-bit number.
pub struct Times {
    after_none: ArithmeticModel,
    multiple: ArithmeticModel,
    differences: IntegerDecompressor,
    sequences: [Sequence; 4],
    current: usize,
    newest: usize,
}

impl Times {
    pub fn new() -> Self {
        Self {
            after_none: ArithmeticModelBuilder::new(CODES_AFTER_NONE).build(),
            multiple: ArithmeticModelBuilder::new(CODES).build(),
            differences: IntegerDecompressorBuilder::new().bits(32).contexts(9).build_initialized(),
            sequences: [Sequence::default(); 4],
            current: 0,
            newest: 0,
        }
    }

    /// Advances the time by a difference that is expected to be near `near`.
    fn step<R: Read>(
        &mut self,
        decoder: &mut ArithmeticDecoder<R>,
        near: i32,
        context: u32,
    ) -> Result<i32> {
        let difference = self.differences.decompress(decoder, near, context)?;
        let sequence = &mut self.sequences[self.current];
        sequence.time = sequence.time.wrapping_add(difference.into());
        Ok(difference)
    }

    /// As `step`, for a difference far from the expected one. The fourth such difference in a row
    /// becomes the expected one.
    fn jump<R: Read>(
        &mut self,
        decoder: &mut ArithmeticDecoder<R>,
        near: i32,
        context: u32,
    ) -> Result<()> {
        let difference = self.step(decoder, near, context)?;
        let sequence = &mut self.sequences[self.current];
        sequence.jumps += 1;
        if sequence.jumps > 3 {
            (sequence.difference, sequence.jumps) = (difference, 0);
        }
        Ok(())
    }

    /// Starts a sequence in place of the oldest.
    fn begin<R: Read>(&mut self, decoder: &mut ArithmeticDecoder<R>) -> Result<()> {
        let before = (self.sequences[self.current].time >> 32) as i32;
        let upper = self.differences.decompress(decoder, before, UPPER)?;
        let lower = decoder.read_int()?;
        self.newest = (self.newest + 1) % 4;
        self.current = self.newest;
        self.sequences[self.current] =
            Sequence { time: i64::from(upper) << 32 | i64::from(lower), ..Sequence::default() };
        Ok(())
    }

    fn next<R: Read>(&mut self, decoder: &mut ArithmeticDecoder<R>) -> Result<()> {
        loop {
            let last = self.sequences[self.current].difference;
            // Number of sequences to advance from the current one.
            let onward;
            if last == 0 {
                match decoder.decode_symbol(&mut self.after_none)? {
                    0 => return Ok(()),
                    1 => {
                        let difference = self.step(decoder, 0, 0)?;
                        let sequence = &mut self.sequences[self.current];
                        (sequence.difference, sequence.jumps) = (difference, 0);
                        return Ok(());
                    }
                    2 => return self.begin(decoder),
                    code => onward = code - 2,
                }
            } else {
                let code = decoder.decode_symbol(&mut self.multiple)? as i32;
                let times = |multiple: i32| multiple.wrapping_mul(last);
                match code {
                    1 => {
                        self.step(decoder, last, 1)?;
                        self.sequences[self.current].jumps = 0;
                        return Ok(());
                    }
                    0 => return self.jump(decoder, 0, 7),
                    2..10 => return self.step(decoder, times(code), 2).map(drop),
                    10..MOST => return self.step(decoder, times(code), 3).map(drop),
                    MOST => return self.jump(decoder, times(MOST), 4),
                    SAME => return Ok(()),
                    WHOLE => return self.begin(decoder),
                    code if code > WHOLE => onward = (code - WHOLE) as u32,
                    code if MOST - code > LEAST => {
                        return self.step(decoder, times(MOST - code), 5).map(drop);
                    }
                    _ => return self.jump(decoder, times(LEAST), 6),
                }
            }
            self.current = (self.current + onward as usize) % 4;
        }
    }
}

impl<R: Read> FieldDecompressor<R> for Times {
    fn size_of_field(&self) -> usize {
        size_of::<i64>()
    }

    fn decompress_first(&mut self, source: &mut R, first: &mut [u8]) -> Result<()> {
        let mut time = [0; 8];
        source.read_exact(&mut time)?;
        self.sequences[0].time = i64::from_le_bytes(time);
        first.copy_from_slice(&time);
        Ok(())
    }

    fn decompress_with(
        &mut self,
        decoder: &mut ArithmeticDecoder<R>,
        out: &mut [u8],
    ) -> Result<()> {
        self.next(decoder)?;
        out.copy_from_slice(&self.sequences[self.current].time.to_le_bytes());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use laz::{
        LasZipCompressor, LazItemRecordBuilder, LazVlrBuilder,
        record::{RecordDecompressor, SequentialPointRecordDecompressor},
    };
    use std::io::Cursor;

    /// Times that use every kind of code, packed by the crate's writer.
    #[test]
    fn all_times_come_back() {
        let mut random = 9u64;
        let mut next = |below: u64| {
            random = random
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (random >> 33) % below
        };
        let mut bases = [1i64 << 60, 1 << 50, (1 << 40) + 5, 77];
        let mut current = 0;
        let mut times = Vec::new();
        for _ in 0..60_000 {
            if next(20) == 0 {
                current = next(4) as usize;
            }
            let unit = 1000 * (current as i64 + 1);
            bases[current] += match next(12) {
                0 => 0,
                1 => next(1 << 31) as i64,
                2 => -(next(1 << 30) as i64),
                3 => unit * next(600) as i64 + next(50) as i64,
                4 => -unit * next(20) as i64,
                5 => (next(1 << 30) as i64) << 20,
                _ => unit,
            };
            times.push(bases[current]);
        }
        let mut items = LazItemRecordBuilder::default_for_point_format_id(1, 0).expect("a format");
        assert_eq!((items[1].size(), items[1].version()), (8, 2));
        let layout = LazVlrBuilder::default()
            .with_laz_items(std::mem::take(&mut items))
            .with_fixed_chunk_size(u32::MAX - 1)
            .build();
        let mut packed = Cursor::new(Vec::new());
        let mut writer = LasZipCompressor::new(&mut packed, layout.clone()).expect("a writer");
        for time in &times {
            let mut record = [7u8; 28];
            record[20..].copy_from_slice(&time.to_le_bytes());
            writer.compress_one(&record).expect("room");
        }
        writer.done().expect("room");
        drop(writer);
        // After the offset of the chunk table.
        let bytes = packed.into_inner();
        let mut reader = SequentialPointRecordDecompressor::new(&bytes[8..]);
        reader.set_fields_from(&vec![layout.items()[0]]).expect("known fields");
        reader.add_field_decompressor(Times::new());
        let mut record = [0; 28];
        for (index, &time) in times.iter().enumerate() {
            reader.decompress_next(&mut record).expect("bytes");
            assert_eq!(
                i64::from_le_bytes(*record.last_chunk().expect("a time")),
                time,
                "time {index}"
            );
            assert_eq!(record[..20], [7; 20], "point {index}");
        }
    }
}
