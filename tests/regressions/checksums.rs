//! Corrects the checksums, the hash and the lengths of a changed file, so that tests reach the code
//! behind these checks.

/// The 32-bit number at byte `at`.
fn word(bytes: &[u8], at: usize) -> Option<usize> {
    Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?) as usize)
}

fn put(bytes: &mut [u8], at: usize, value: &[u8]) -> Option<()> {
    bytes.get_mut(at..at + value.len())?.copy_from_slice(value);
    Some(())
}

/// Writes the checksum of a range right behind it.
fn sum(bytes: &mut [u8], start: usize, end: usize) -> Option<()> {
    let sum = crc32fast::hash(bytes.get(start..end)?);
    put(bytes, end, &sum.to_le_bytes())
}

/// Writes the hash of all bytes before it to the end.
fn hash(bytes: &mut [u8]) -> Option<()> {
    let end = bytes.len().checked_sub(32)?;
    let hash = *blake3::hash(&bytes[..end]).as_bytes();
    put(bytes, end, &hash)
}

/// Corrects a `.splk`; docs/splk.md describes its layout. Returns `None` if there are fewer bytes
/// than the file claims.
pub fn sum_hierarchy(bytes: &mut [u8]) -> Option<()> {
    put(bytes, 0, b"SPLK\r\n\x1a\n\x01\0\0\0")?;
    let length = bytes.len() as u64;
    put(bytes, 16, &length.to_le_bytes())?;
    let header_end = word(bytes, 136)?.checked_add(word(bytes, 140)?)?.checked_add(160)?;
    let (blocks, pages) = (word(bytes, 124)?, word(bytes, 128)?);
    let entries = header_end + 4 + 16 * blocks;
    let directory_end = entries + 44 * pages;
    sum(bytes, 0, header_end)?;
    let mut at = directory_end + 4;
    let end = bytes.len().checked_sub(32).filter(|&end| end >= at)?;
    let mut order: Vec<(u64, usize)> = Vec::new();
    for page in 0..pages {
        let entry = entries + 44 * page;
        order.push((u64::from_le_bytes(*bytes.get(entry..)?.first_chunk()?), entry));
    }
    order.sort_unstable();
    for (index, &(_, entry)) in order.iter().enumerate() {
        let rest = end - at;
        let length = if index + 1 == pages { rest } else { word(bytes, entry + 8)?.min(rest) };
        let crc = crc32fast::hash(&bytes[at..at + length]);
        put(bytes, entry, &(at as u64).to_le_bytes())?;
        put(bytes, entry + 8, &(length as u32).to_le_bytes())?;
        put(bytes, entry + 12, &crc.to_le_bytes())?;
        at += length;
    }
    sum(bytes, header_end + 4, directory_end)?;
    hash(bytes)
}

/// Corrects a `.splv`; docs/splv.md describes its layout. Returns `None` if there are fewer bytes
/// than the file claims.
pub fn sum_bricks(bytes: &mut [u8]) -> Option<()> {
    put(bytes, 0, b"SPLV\r\n\x1a\n\x01\0\0\0")?;
    let length = bytes.len() as u64;
    put(bytes, 16, &length.to_le_bytes())?;
    let header_end = word(bytes, 172)?.checked_add(word(bytes, 176)?)?.checked_add(192)?;
    sum(bytes, 0, header_end)?;
    let mut dims = [24, 32, 40].map(|at| word(bytes, at).unwrap_or(0));
    let mut count = 0usize;
    loop {
        let bricks = dims.iter().try_fold(1usize, |all, n| all.checked_mul(n.div_ceil(32)))?;
        count = count.checked_add(bricks)?;
        if bricks <= 1 {
            break;
        }
        dims = dims.map(|n| n.div_ceil(2));
    }
    let directory_end = count.checked_mul(16)?.checked_add(header_end + 4)?;
    let mut at = directory_end.checked_add(4)?;
    let end = bytes.len().checked_sub(32).filter(|&end| end >= at)?;
    for brick in 0..count {
        let entry = header_end + 4 + 16 * brick;
        let rest = end - at;
        let length = if brick + 1 == count { rest } else { word(bytes, entry)?.min(rest) };
        let crc = crc32fast::hash(&bytes[at..at + length]);
        put(bytes, entry, &(length as u32).to_le_bytes())?;
        put(bytes, entry + 4, &crc.to_le_bytes())?;
        at += length;
    }
    sum(bytes, header_end + 4, directory_end)?;
    hash(bytes)
}
