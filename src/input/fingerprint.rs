//! Fingerprints of inputs, by which a later process sees that an input has changed.

use super::{Limits, address::is_remote, remote::Remote};
use crate::{Error, Result};
use std::{
    fs::File,
    io::{self, Read, Seek, SeekFrom},
    path::Path,
};

/// Bytes at the beginning and the end of an input that its fingerprint covers, and between these,
/// of each of some places at equal distances.
const ENDS: u64 = 1 << 16;
const BETWEEN: u64 = 1 << 12;
const PLACES: u64 = 64;

/// Returns the size of a file or of a remote object, and a hash of the size and of bytes throughout
/// it. Reading these takes milliseconds, whatever the size. Of an object, the hash covers the ends,
/// and the tag and the time that the server states; only if there are none, also the bytes between.
///
/// # Errors
/// [`Error::File`] for a file that cannot be read, and those of fetching an object.
pub(crate) fn fingerprint(path: &Path, limits: &Limits) -> Result<(u64, String)> {
    if !is_remote(path) {
        return of_file(path).map_err(|e| Error::file(path, "read", e));
    }
    let remote = Remote::open(path, limits)?;
    let (size, stamp) = (remote.len(), remote.stamp());
    let mut hash = begun(size);
    hash.update(stamp.as_deref().unwrap_or_default().as_bytes());
    let places = places(size).take(if stamp.is_some() { 2 } else { usize::MAX });
    let ranges: Vec<_> =
        places.map(|(at, length)| at..size.min(at + length)).filter(|r| !r.is_empty()).collect();
    remote.fetch(&ranges)?;
    for range in ranges {
        hash.update(&remote.read(range)?);
    }
    Ok((size, hash.finalize().to_hex().to_string()))
}

fn of_file(path: &Path) -> io::Result<(u64, String)> {
    let mut file = File::open(path)?;
    let size = file.metadata()?.len();
    let mut hash = begun(size);
    let mut bytes = Vec::new();
    for (at, length) in places(size) {
        bytes.clear();
        file.seek(SeekFrom::Start(at))?;
        (&file).take(length).read_to_end(&mut bytes)?;
        hash.update(&bytes);
    }
    Ok((size, hash.finalize().to_hex().to_string()))
}

fn begun(size: u64) -> blake3::Hasher {
    let mut hash = blake3::Hasher::new();
    hash.update(&size.to_le_bytes());
    hash
}

/// Returns the offsets and lengths of the bytes that count, the ends first.
fn places(size: u64) -> impl Iterator<Item = (u64, u64)> {
    let between = (1..PLACES).map(move |place| (size / PLACES * place, BETWEEN));
    [(0, ENDS), (size.saturating_sub(ENDS), ENDS)].into_iter().chain(between)
}
