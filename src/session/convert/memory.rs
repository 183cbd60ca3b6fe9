//! How much memory a conversion may use, and how much it needs.

use super::wrong;
use crate::{
    Result,
    formats::Stream,
    hierarchy::external::{BLOCKS, memory_between, memory_of_stream},
    input::{self, Limits},
    surface::SurfelOptions,
};
use std::path::{Path, PathBuf};

/// The memory for converting files as a whole.
#[derive(Debug)]
pub struct Need {
    /// Approximate number of bytes. If a file's header has no counts, the file's size decides.
    pub bytes: u64,
    /// The first file that cannot be read in pieces, or the error of a file that cannot be opened.
    pub whole: Result<Option<PathBuf>>,
}

/// Memory for each byte of a file whose header has no counts: the byte and what is made from it.
const OF_BYTE: u64 = 4;
/// The same for a hierarchy, whose splats are packed.
const OF_PACKED_BYTE: u64 = 24;

/// Estimates the memory for converting files that are all in memory at once. The estimate is only
/// as exact as a comparison with `enough` requires. It includes the subdivision of triangles if
/// that decides the comparison. In that case, files are scanned one after another until it is known
/// whether all of them together need more than `enough` bytes.
pub fn need(files: &[PathBuf], limits: &Limits, options: &SurfelOptions, enough: u64) -> Need {
    let mut whole = Ok(None);
    let mut is_stream = false;
    let mut between = Vec::new();
    for file in files {
        let size = file_bytes(file);
        match Stream::open(file, limits) {
            Ok(Some(stream)) => {
                is_stream = true;
                between.push(
                    memory_between(stream.counts(), options)
                        .map(|bytes| bytes.saturating_add(size)),
                );
                continue;
            }
            Ok(None) => whole = whole.map(|first: Option<PathBuf>| first.or(Some(file.clone()))),
            // If the file fits into memory, its reader reports what is wrong with it.
            Err(error) => whole = whole.and(Err(error)),
        }
        let is_packed =
            file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("splk"));
        between.push([size.saturating_mul(if is_packed { OF_PACKED_BYTE } else { OF_BYTE }); 2]);
    }
    let blocks = if is_stream { BLOCKS } else { 0 };
    for (index, file) in files.iter().enumerate() {
        let [least, most] = sums(&between, blocks);
        if least > enough || most <= enough {
            break;
        }
        let [least_of_this, most_of_this] = between[index];
        if least_of_this < most_of_this {
            match scanned(file, limits, options, enough - (least - least_of_this)) {
                Ok(bytes) => between[index] = [bytes; 2],
                // As above, the reader reports this error.
                Err(error) => {
                    between[index] = [least_of_this; 2];
                    whole = whole.and(Err(error));
                }
            }
        }
    }
    Need { bytes: sums(&between, blocks)[0], whole }
}

/// Returns the lower and upper bound for all files together.
fn sums(between: &[[u64; 2]], blocks: u64) -> [u64; 2] {
    [0, 1].map(|side| between.iter().map(|bytes| bytes[side]).fold(blocks, u64::saturating_add))
}

/// Scans a file that is read in pieces and returns the memory that it needs. A need above `enough`
/// may be larger than the result.
fn scanned(file: &Path, limits: &Limits, options: &SurfelOptions, enough: u64) -> Result<u64> {
    let size = file_bytes(file);
    let Some(mut stream) = Stream::open(file, limits)? else { return Ok(size) };
    Ok(memory_of_stream(&mut stream, options, enough.saturating_sub(size))?.saturating_add(size))
}

/// Refuses an input that needs more than `most` bytes of memory, together with the bytes that
/// earlier inputs have `taken`.
pub fn check(file: &Path, need: u64, taken: u64, most: u64) -> Result<()> {
    if need.saturating_add(taken) <= most {
        return Ok(());
    }
    let [need, taken, most] = [need, taken, most].map(|bytes| bytes.div_ceil(1 << 20));
    let before = if taken > 0 {
        format!(" in addition to {taken} MiB for the inputs before")
    } else {
        String::new()
    };
    Err(wrong(format!(
        "{}: this takes about {need} MiB{before}, but only {most} MiB may be used; --memory allows \
         more",
        file.display()
    )))
}

fn file_bytes(file: &Path) -> u64 {
    input::size(file).unwrap_or(0)
}
