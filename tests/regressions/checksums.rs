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
    put(bytes, 0, b"SPLK\r\n\x1a\n")?;
    put(bytes, 8, &3u32.to_le_bytes())?;
    let length = bytes.len() as u64;
    put(bytes, 16, &length.to_le_bytes())?;
    let header_end = word(bytes, 136)?.checked_add(word(bytes, 140)?)?.checked_add(160)?;
    let pages = word(bytes, 128)?;
    sum(bytes, 0, header_end)?;
    let start = header_end + 4;
    match pages > RECORDS {
        true => sum_directory(bytes, start, pages, [68, 36])?,
        false => sum_pages(bytes, start, 68, pages)?,
    }
    hash(bytes)
}

/// Corrects a directory at byte `start`, of `pages` records of `stride` bytes each, and the places
/// of the pages behind it.
fn sum_pages(bytes: &mut [u8], start: usize, stride: usize, pages: usize) -> Option<()> {
    let directory_end = start + stride * pages;
    let mut at = directory_end + 4;
    let end = bytes.len().checked_sub(32).filter(|&end| end >= at)?;
    let mut order: Vec<(u64, usize)> = Vec::new();
    for page in 0..pages {
        let entry = start + stride * page;
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
    sum(bytes, start, directory_end)
}

/// Records in a directory page.
const RECORDS: usize = 512;

/// Corrects the checksums of a directory with several levels, and of the pages that it lists. The
/// root begins at byte `start`. `strides` are the bytes of the records of pages and of directory
/// pages.
fn sum_directory(bytes: &mut [u8], start: usize, pages: usize, strides: [usize; 2]) -> Option<()> {
    let mut levels = vec![pages];
    while let Some(&below) = levels.last().filter(|below| **below > 1) {
        levels.push(below.div_ceil(RECORDS));
    }
    let root = levels.len() - 2;
    sum_below(bytes, start, &levels, [root, 0], strides)?;
    sum(bytes, start, start + strides[1] * levels[root])
}

/// Corrects the records of a directory page at byte `at`, and all below.
fn sum_below(
    bytes: &mut [u8],
    at: usize,
    levels: &[usize],
    [level, number]: [usize; 2],
    strides: [usize; 2],
) -> Option<()> {
    let records = (levels[level] - number * RECORDS).min(RECORDS);
    let stride = strides[level.min(1)];
    for record in 0..records {
        let entry = at + stride * record;
        let offset = u64::from_le_bytes(*bytes.get(entry..)?.first_chunk()?);
        let offset = usize::try_from(offset).ok()?;
        if level > 0 {
            sum_below(bytes, offset, levels, [level - 1, number * RECORDS + record], strides)?;
        }
        let end = offset.checked_add(word(bytes, entry + 8)?)?;
        let crc = crc32fast::hash(bytes.get(offset..end)?);
        put(bytes, entry + 12, &crc.to_le_bytes())?;
    }
    Some(())
}

/// Corrects a `.splv`; docs/splv.md describes its layout. Returns `None` if there are fewer bytes
/// than the file claims.
pub fn sum_bricks(bytes: &mut [u8]) -> Option<()> {
    put(bytes, 0, b"SPLV\r\n\x1a\n")?;
    put(bytes, 8, &2u32.to_le_bytes())?;
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
    let start = header_end + 4;
    match count > RECORDS {
        true => sum_directory(bytes, start, count, [24, 20])?,
        false => sum_pages(bytes, start, 24, count)?,
    }
    hash(bytes)
}
