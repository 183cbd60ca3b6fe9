//! How much memory a conversion may take, and would take.

use crate::failure::Failure;
use splatkit::{
    hierarchy::external::memory_of_stream,
    io::{Limits, Stream},
    surface::SurfelOptions,
};
use std::path::{Path, PathBuf};

/// What converting files as a whole takes.
#[derive(Debug)]
pub struct Need {
    /// Bytes, about; of a file whose header tells no counts by its size.
    pub bytes: u64,
    /// Whether all files can be read in pieces, or what is wrong with one.
    pub in_pieces: splatkit::Result<bool>,
}

/// Of a file that tells no counts: what is made of it for each of its bytes, and with them.
const OF_BYTE: u64 = 4;
/// The same of a hierarchy, whose splats are packed.
const OF_PACKED_BYTE: u64 = 24;

/// About what converting files takes where all of them are in memory, as far as it matters where so much is `enough`.
pub fn need(files: &[PathBuf], limits: &Limits, options: &SurfelOptions, enough: u64) -> Need {
    let mut need = Need { bytes: 0, in_pieces: Ok(true) };
    for file in files {
        let is_packed = file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("splk"));
        let guess = file_bytes(file) * if is_packed { OF_PACKED_BYTE } else { OF_BYTE };
        let of_stream = |mut stream: Stream| memory_of_stream(&mut stream, options, enough.saturating_sub(need.bytes));
        match Stream::open(file, limits).and_then(|stream| stream.map(of_stream).transpose()) {
            Ok(Some(bytes)) => need.bytes += bytes + file_bytes(file),
            Ok(None) => {
                need.bytes += guess;
                need.in_pieces = need.in_pieces.map(|_| false);
            }
            // Where the file fits, its reader tells what is wrong with it.
            Err(error) => {
                need.bytes += guess;
                need.in_pieces = need.in_pieces.and(Err(error));
            }
        }
    }
    need
}

/// Refuses what needs more memory than `most`.
pub fn check(file: &Path, need: u64, most: u64) -> Result<(), Failure> {
    if need <= most {
        return Ok(());
    }
    let [wanted, most] = [need, most].map(|bytes| bytes.div_ceil(1 << 20));
    Err(Failure::Usage(format!(
        "{}: this takes about {wanted} MiB, but only {most} MiB may be taken; --memory allows more",
        file.display()
    )))
}

fn file_bytes(file: &Path) -> u64 {
    file.metadata().map_or(0, |meta| meta.len())
}
