//! Rewrites hierarchies, and volumes in bricks, with the flat directory of older versions. It knows
//! the formats from docs/splk.md and docs/splv.md alone.

#![allow(dead_code, reason = "each user needs only a part")]

/// Records in a directory page.
const RECORDS: usize = 512;
/// Bytes of the record of a page, and of a directory page.
const OF_PAGE: usize = 68;
const OF_DIRECTORY: usize = 36;

fn word(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"))
}

fn long(bytes: &[u8], at: usize) -> usize {
    u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight bytes")) as usize
}

/// Where the root begins: after the header and its checksum.
pub fn root(bytes: &[u8]) -> usize {
    164 + word(bytes, 136) as usize + word(bytes, 140) as usize
}

/// The number of directory pages of each level, the lowest first.
pub fn levels(pages: usize) -> Vec<usize> {
    let mut levels = vec![pages.div_ceil(RECORDS)];
    while let Some(&below) = levels.last().filter(|below| **below > 1) {
        levels.push(below.div_ceil(RECORDS));
    }
    levels
}

/// The bytes of a directory page.
pub fn length(pages: usize, level: usize, number: usize) -> usize {
    let below = if level == 0 { pages } else { levels(pages)[level - 1] };
    let records = (below - number * RECORDS).min(RECORDS);
    records * if level == 0 { OF_PAGE } else { OF_DIRECTORY }
}

/// The records of all pages, by their numbers.
pub fn records(bytes: &[u8]) -> Vec<&[u8]> {
    let pages = word(bytes, 128) as usize;
    let top = levels(pages).len() - 1;
    let mut level = vec![&bytes[root(bytes)..][..length(pages, top, 0)]];
    for below in (0..top).rev() {
        let listed = level.iter().flat_map(|page| page.chunks(OF_DIRECTORY)).enumerate();
        let pages = listed.map(|(number, record)| {
            let (start, count) = (long(record, 0), word(record, 8) as usize);
            assert_eq!(count, length(pages, below, number));
            let page = &bytes[start..start + count];
            assert_eq!(crc32fast::hash(page), word(record, 12));
            page
        });
        level = pages.collect();
    }
    level.iter().flat_map(|page| page.chunks(OF_PAGE)).collect()
}

/// The bytes of a page.
fn content<'a>(bytes: &'a [u8], record: &[u8]) -> &'a [u8] {
    let page = &bytes[long(record, 0)..][..word(record, 8) as usize];
    assert_eq!(crc32fast::hash(page), word(record, 12));
    page
}

/// A page of nodes whose portals state no pages.
fn without_links(page: &[u8], count: usize) -> Vec<u8> {
    if page[0] == 2 {
        let end = 5 + word(page, 1) as usize;
        let nodes = without_links(&page[5..end], count);
        let length = (nodes.len() as u32).to_le_bytes();
        return [&[2], &length[..], &nodes, &page[end..]].concat();
    }
    assert_eq!(page[0], 0, "pages with portals are lossless");
    let mut planes = zstd::bulk::decompress(&page[1..], count * 80).expect("a page");
    for node in 0..count {
        // The number of children, and the first child.
        if (76..80).all(|plane| planes[plane * count + node] == 0) {
            (72..76).for_each(|plane| planes[plane * count + node] = 0);
        }
    }
    [vec![0], zstd::bulk::compress(&planes, 3).expect("bytes")].concat()
}

/// Returns the same hierarchy as a file of version 1, or 2 for trained Gaussians.
pub fn flat(bytes: &[u8]) -> Vec<u8> {
    assert_eq!(word(bytes, 8), 3);
    let records = records(bytes);
    let is_joined = word(bytes, 124) > 1;
    let mut blocks: Vec<[u32; 4]> = Vec::new();
    let mut sizes: Vec<f32> = Vec::new();
    let mut contents = Vec::new();
    for (page, record) in (0..).zip(&records) {
        let [block, first_node, nodes] = [16, 20, 24].map(|at| word(record, at));
        let page_bytes = content(bytes, record);
        contents.push(match is_joined && block == 0 {
            true => without_links(page_bytes, nodes as usize),
            false => page_bytes.to_vec(),
        });
        if first_node == 0 {
            blocks.push([page, 0, 0, word(record, 44)]);
        }
        let own = blocks.last_mut().expect("a block");
        (own[1], own[2]) = (own[1] + 1, own[2] + nodes);
        assert_eq!(blocks.len() as u32, block + 1);
        let above = word(record, 36)..word(record, 36) + word(record, 40);
        let own = f32::from_bits(word(record, 64));
        sizes.push(above.map(|above| sizes[above as usize]).fold(own, f32::min));
    }
    let mut order: Vec<usize> = (0..records.len()).collect();
    order.sort_by(|a, b| sizes[*b].total_cmp(&sizes[*a]));
    let start = root(bytes) + 16 * blocks.len() + 44 * records.len() + 4;
    let mut offsets = vec![0; records.len()];
    let mut end = start;
    for &page in &order {
        (offsets[page], end) = (end, end + contents[page].len());
    }
    let mut out = bytes[..root(bytes) - 4].to_vec();
    out[8..12].copy_from_slice(&(1 + (word(bytes, 12) >> 4 & 1)).to_le_bytes());
    out[16..24].copy_from_slice(&(end as u64 + 32).to_le_bytes());
    out.extend(crc32fast::hash(&out).to_le_bytes());
    let directory = out.len();
    out.extend(blocks.as_flattened().iter().flat_map(|word| word.to_le_bytes()));
    for ((record, content), offset) in records.iter().zip(&contents).zip(offsets) {
        out.extend((offset as u64).to_le_bytes());
        out.extend((content.len() as u32).to_le_bytes());
        out.extend(crc32fast::hash(content).to_le_bytes());
        // The number of nodes, the first child, and the bounds.
        out.extend([&record[24..32], &record[48..68]].concat());
    }
    out.extend(crc32fast::hash(&out[directory..]).to_le_bytes());
    order.iter().for_each(|page| out.extend(&contents[*page]));
    out.extend(blake3::hash(&out).as_bytes());
    out
}

/// The numbers of bricks along each axis, for each level of a volume, finest first.
fn brick_levels(bytes: &[u8]) -> Vec<[usize; 3]> {
    let mut dims = [24, 32, 40].map(|at| long(bytes, at));
    let mut levels = vec![dims.map(|n| n.div_ceil(32))];
    while levels.last().is_some_and(|bricks| bricks.iter().product::<usize>() > 1) {
        dims = dims.map(|n| n.div_ceil(2));
        levels.push(dims.map(|n| n.div_ceil(32)));
    }
    levels
}

/// The bricks of a level, group by group, each as its place in a list with the first axis fastest.
fn grouped([nx, ny, nz]: [usize; 3]) -> Vec<usize> {
    let group = |at: usize, end: usize| at..(at + 8).min(end);
    let mut order = Vec::new();
    for (z, y) in (0..nz).step_by(8).flat_map(|z| (0..ny).step_by(8).map(move |y| (z, y))) {
        for x in (0..nx).step_by(8) {
            for k in group(z, nz) {
                for j in group(y, ny) {
                    order.extend(group(x, nx).map(|i| (k * ny + j) * nx + i));
                }
            }
        }
    }
    order
}

/// Returns the same volume in bricks, of at most 512 bricks, as a file of version 1.
pub fn flat_bricks(bytes: &[u8]) -> Vec<u8> {
    assert_eq!(word(bytes, 8), 2);
    let root = 196 + word(bytes, 172) as usize + word(bytes, 176) as usize;
    let levels = brick_levels(bytes);
    let count = levels.iter().map(|bricks| bricks.iter().product::<usize>()).sum::<usize>();
    assert!(count <= RECORDS);
    let mut records = bytes[root..root + 24 * count].chunks(24);
    let mut sorted = Vec::new();
    for level in levels.into_iter().rev() {
        let order = grouped(level);
        let mut own = vec![&[][..]; order.len()];
        order.into_iter().for_each(|place| own[place] = records.next().expect("a record"));
        sorted.extend(own);
    }
    let contents: Vec<&[u8]> = sorted.iter().map(|record| content(bytes, record)).collect();
    let length = contents.iter().map(|content| content.len()).sum::<usize>();
    let mut out = bytes[..root - 4].to_vec();
    out[8..12].copy_from_slice(&1u32.to_le_bytes());
    out[16..24].copy_from_slice(&((root + 16 * count + 4 + length + 32) as u64).to_le_bytes());
    out.extend(crc32fast::hash(&out).to_le_bytes());
    // The length, the checksum and the rest of each record.
    out.extend(sorted.iter().flat_map(|record| &record[8..]));
    out.extend(crc32fast::hash(&out[root..]).to_le_bytes());
    out.extend(contents.concat());
    out.extend(blake3::hash(&out).as_bytes());
    out
}
