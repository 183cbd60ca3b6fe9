//! Unpacks streams of single codecs to at most a number of bytes. Errors are messages.

use crate::container::pack;
use flate2::read::ZlibDecoder;
use std::io::Read;

/// Reads a stream that holds at most `most` bytes. Memory grows with the bytes that are there.
pub fn read_all(stream: impl Read, most: usize) -> Result<Vec<u8>, String> {
    let mut out = Vec::new();
    let read = stream.take(most as u64 + 1).read_to_end(&mut out);
    read.map_err(|error| format!("cannot be unpacked after {} bytes: {error}", out.len()))?;
    if out.len() > most {
        return Err(format!("unpacks to more than {most} bytes"));
    }
    Ok(out)
}

pub fn unzlib(packed: &[u8], most: usize) -> Result<Vec<u8>, String> {
    read_all(ZlibDecoder::new(packed), most)
}

pub fn unzstd(packed: &[u8], most: usize) -> Result<Vec<u8>, String> {
    let unpacked = pack::decompress(packed, most);
    unpacked.map_err(|error| format!("cannot be unpacked by zstd: {error}"))
}

pub fn unlz4(packed: &[u8], most: usize) -> Result<Vec<u8>, String> {
    let mut out = vec![0; most];
    let size = lz4_flex::block::decompress_into(packed, &mut out);
    out.truncate(size.map_err(|error| format!("cannot be unpacked by LZ4: {error}"))?);
    Ok(out)
}
