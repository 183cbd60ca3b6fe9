//! A brick as stored: parts that have a single value are omitted, and the rest is packed if that is
//! shorter.

use super::directory::{CONSTANT, Entry, PACKED, UNIFORM};
use crate::{
    bricks::{BRICK_BLOCKS, Brick, SIDE},
    container::{
        directory::Place,
        pack::{self, Compressor},
    },
    volume::Scalar,
};

/// Returns the bytes of a brick, and its entry in the directory.
pub fn encode(
    brick: &Brick,
    scalar: Scalar,
    packer: &mut Compressor,
) -> std::io::Result<(Entry, Vec<u8>)> {
    let mut entry = Entry::in_memory(brick.range());
    let mut samples = brick.samples.clone();
    turn(&mut samples, scalar);
    let first = &samples[..scalar.bytes()];
    if samples.chunks_exact(scalar.bytes()).all(|sample| sample == first) {
        entry.flags |= CONSTANT;
        entry.value[..scalar.bytes()].copy_from_slice(first);
        samples.clear();
    }
    if brick.blocks.iter().all(|block| *block == entry.range) {
        entry.flags |= UNIFORM;
    } else {
        samples.extend_from_slice(brick.blocks.as_flattened());
    }
    let mut bytes = samples;
    if !bytes.is_empty() {
        let packed = packer.compress(&bytes)?;
        if packed.len() < bytes.len() {
            entry.flags |= PACKED;
            bytes = packed;
        }
    }
    entry.place = Place::of(0, &bytes);
    Ok((entry, bytes))
}

/// Decodes a brick from its bytes in the file. The error is a message.
pub fn decode(entry: &Entry, bytes: &[u8], scalar: Scalar) -> Result<Brick, String> {
    if crc32fast::hash(bytes) != entry.place.crc {
        return Err("its checksum does not match".into());
    }
    let [samples, blocks] = entry.contents(scalar);
    let mut contents = if entry.has(PACKED) {
        pack::decompress(bytes, samples + blocks)
            .map_err(|e| format!("it cannot be unpacked: {e}"))?
    } else {
        bytes.to_vec()
    };
    if contents.len() != samples + blocks {
        return Err(format!(
            "it has {} bytes where {} were expected",
            contents.len(),
            samples + blocks
        ));
    }
    let ranges = contents.split_off(samples);
    let mut samples = contents;
    if entry.has(CONSTANT) {
        samples = entry.value[..scalar.bytes()].repeat(SIDE * SIDE * SIDE);
    }
    turn(&mut samples, scalar);
    if scalar == Scalar::F32
        && let Some(odd) =
            samples.chunks_exact(4).position(|bytes| !scalar.value(bytes).is_finite())
    {
        return Err(format!("its sample {odd} is not finite"));
    }
    let mut blocks = Box::new([entry.range; BRICK_BLOCKS]);
    blocks.iter_mut().zip(ranges.as_chunks::<2>().0).for_each(|(block, range)| *block = *range);
    let brick = Brick { samples, blocks };
    if brick.range() == entry.range {
        Ok(brick)
    } else {
        Err("its range is not that of its blocks".into())
    }
}

/// Converts between native byte order and the file's.
fn turn(samples: &mut [u8], scalar: Scalar) {
    if cfg!(target_endian = "big") {
        samples.chunks_exact_mut(scalar.bytes()).for_each(<[u8]>::reverse);
    }
}
