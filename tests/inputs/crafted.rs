//! Hierarchies and bricks with correct checksums and wrong contents, made byte by byte after
//! docs/splk.md and docs/splv.md.

use super::*;

#[path = "../regressions/checksums.rs"]
mod checksums;

use checksums::{sum_bricks, sum_hierarchy};

/// Nodes in a full page.
const PAGE_NODES: u32 = 4096;
/// Bytes of the record of a page.
const OF_PAGE: usize = 68;
/// Bytes of the record of a brick.
const OF_BRICK: usize = 24;
/// The first byte of a lossless page.
const LOSSLESS: u8 = 0;

fn word(bytes: &[u8], at: usize) -> usize {
    u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes")) as usize
}

/// Byte offsets of a hierarchy's page entries and of its pages.
fn pages(bytes: &[u8]) -> [usize; 2] {
    let entries = 160 + word(bytes, 136) + word(bytes, 140) + 4;
    [entries, entries + OF_PAGE * word(bytes, 128) + 4]
}

fn summed(mut bytes: Vec<u8>) -> Vec<u8> {
    sum_hierarchy(&mut bytes).expect("a hierarchy");
    bytes
}

/// A hierarchy whose only page has the given content.
fn with_page(content: &[u8]) -> Vec<u8> {
    let bytes = splk(true);
    let [_, start] = pages(&bytes);
    summed([&bytes[..start], content, &[0; 32]].concat())
}

/// A page of `bytes` zeros, compressed and marked lossless.
pub fn page_of_zeros(bytes: usize) -> Vec<u8> {
    let packed = zstd::bulk::compress(&vec![0; bytes], 19).expect("bytes");
    with_page(&[vec![LOSSLESS], packed].concat())
}

/// A page with the given, unknown code.
pub fn page_of_code(code: u8) -> Vec<u8> {
    with_page(&[code, 0, 0])
}

/// A lossless hierarchy with bytes of its first node replaced by `value`, from byte `place` of the
/// 80 bytes of a node.
pub fn with_node_bytes(place: usize, value: &[u8]) -> Vec<u8> {
    let bytes = splk(true);
    let [entries, start] = pages(&bytes);
    let count = word(&bytes, entries + 24);
    let content = &bytes[start + 1..start + word(&bytes, entries + 8)];
    let mut planes = zstd::bulk::decompress(content, count * 80).expect("a page");
    for (plane, byte) in value.iter().enumerate() {
        planes[(place + plane) * count] = *byte;
    }
    with_page(&[vec![LOSSLESS], zstd::bulk::compress(&planes, 3).expect("bytes")].concat())
}

/// A lossless hierarchy of three pages or more.
pub fn long_splk() -> Vec<u8> {
    let positions = (0..100 * 100)
        .map(|i| Vec3::new((i % 100) as f32, (i / 100) as f32, (i % 7) as f32))
        .collect();
    let mesh = Mesh { positions, ..Mesh::default() };
    let splats = mesh.surfels(&SurfelOptions::default()).expect("surfels");
    let tree = Tree::build(&splats, &BuildOptions::default(), None).expect("a tree");
    let options = file::WriteOptions { lossless: true, ..file::WriteOptions::default() };
    file::to_bytes(&tree, &options).expect("bytes")
}

/// The same hierarchy with its last two pages swapped. If `with_directory`, lengths and checksums
/// in the directory are swapped with them; otherwise the directory stays as it was.
pub fn swapped(with_directory: bool) -> Vec<u8> {
    let bytes = long_splk();
    let [entries, _] = pages(&bytes);
    let count = word(&bytes, 128);
    let [first, second] = [count - 2, count - 1].map(|page| entries + OF_PAGE * page);
    let mut places = [first, second].map(|entry| {
        let start = word(&bytes, entry);
        (start, bytes[start..start + word(&bytes, entry + 8)].to_vec())
    });
    places.sort();
    let [(start, before), (_, behind)] = places;
    let mut out = bytes.clone();
    out[start..start + before.len() + behind.len()]
        .copy_from_slice(&[&behind[..], &before].concat());
    if !with_directory {
        return out;
    }
    // Swap the lengths with the pages. `summed` then sets checksums and offsets.
    let [a, b] = [first, second].map(|entry| bytes[entry + 8..entry + 12].to_vec());
    out[first + 8..first + 12].copy_from_slice(&b);
    out[second + 8..second + 12].copy_from_slice(&a);
    summed(out)
}

/// A hierarchy whose directory places a page beyond 4 GiB.
pub fn far_page() -> Vec<u8> {
    let mut bytes = splk(true);
    let [entries, start] = pages(&bytes);
    bytes[entries..entries + 8].copy_from_slice(&(start as u64 + (1 << 32)).to_le_bytes());
    let sum = crc32fast::hash(&bytes[164 + word(&bytes, 136) + word(&bytes, 140)..start - 4]);
    bytes[start - 4..start].copy_from_slice(&sum.to_le_bytes());
    bytes
}

/// A tree of equal nodes with eight children each: `full` pages of inner nodes, and eight times as
/// many pages of leaves below them; at most 512 in all. Each page takes 120 bytes in the file and
/// 320 KiB in memory.
pub fn pages_of_one_node(full: u32) -> Vec<u8> {
    // 45 columns of one number each, and no symbols: the four states as they begin.
    let page = |children: u8| {
        let mut heads = vec![0; 90];
        // The column of child counts: −1, folded, stands for 8.
        heads[1] = children;
        let mut page = vec![1];
        page.extend([1f32, 0.0, 0.0, 0.0].iter().flat_map(|v| v.to_le_bytes()));
        page.extend(0i32.to_le_bytes());
        page.extend((heads.len() as u32).to_le_bytes());
        page.extend(heads);
        page.extend(16u32.to_le_bytes());
        page.extend([1u32 << 16; 4].iter().flat_map(|v| v.to_le_bytes()));
        page
    };
    // Siblings share a page, and the root has none.
    let first_page = PAGE_NODES - 7;
    let inner = first_page + (full - 1) * PAGE_NODES;
    let nodes = 1 + 8 * inner;
    let count = 1 + (nodes - first_page).div_ceil(PAGE_NODES);
    let mut head = splk(false)[..160].to_vec();
    head[104..112].copy_from_slice(&u64::from(nodes - inner).to_le_bytes());
    head[112..120].copy_from_slice(&u64::from(nodes).to_le_bytes());
    head[128..132].copy_from_slice(&count.to_le_bytes());
    head[136..144].fill(0);
    let page_of = |node: u32| node.checked_sub(first_page).map_or(0, |at| 1 + at / PAGE_NODES);
    let (mut directory, mut contents) = (Vec::new(), Vec::new());
    let mut begin = 0;
    for number in 0..count {
        let content = page(u8::from(number < full));
        let size = if number == 0 { first_page } else { PAGE_NODES.min(nodes - begin) };
        let first_child = nodes.min(1 + 8 * begin);
        let child_page = if number < full { page_of(first_child) } else { u32::MAX };
        let parents = match number {
            0 => [0, 0],
            _ => {
                let [first, last] = [begin - 1, begin + size - 2].map(|node| page_of(node / 8));
                [first, last - first + 1]
            }
        };
        // Records in the order of the file.
        directory.extend(u64::from(number).to_le_bytes());
        let [parent, parents] = parents;
        directory.extend(
            [content.len() as u32, 0, 0, begin, size, first_child, child_page, parent, parents]
                .iter()
                .chain(&[u32::MAX])
                .flat_map(|v| v.to_le_bytes()),
        );
        let around = if number == 0 { f32::INFINITY } else { 1.0 };
        directory.extend([0f32, 0.0, 0.0, around, around].iter().flat_map(|v| v.to_le_bytes()));
        contents.extend(content);
        begin += size;
    }
    summed([&head[..], &[0; 4], &directory, &[0; 4], &contents, &[0; 32]].concat())
}

/// Numbers of bricks and of levels of a volume of `dims` samples.
fn bricks_and_levels(dims: [u64; 3]) -> [u64; 2] {
    let (mut level, mut bricks, mut levels) = (dims, 0, 0);
    loop {
        let count: u64 = level.iter().map(|n| n.div_ceil(32)).product();
        (bricks, levels) = (bricks + count, levels + 1);
        if count == 1 {
            return [bricks, levels];
        }
        level = level.map(|n| n.div_ceil(2));
    }
}

/// A bricked volume of bytes that all have one value: 24 bytes in the file for each brick of 32
/// KiB, of which there are at most 512.
pub fn bricks_of_one_value(dims: [u64; 3]) -> Vec<u8> {
    let [bricks, levels] = bricks_and_levels(dims);
    let mut head = splv(&Folder::new())[..192].to_vec();
    head[24..48].copy_from_slice(&dims.map(u64::to_le_bytes).concat());
    head[144..160].fill(0);
    head[160..164].copy_from_slice(&(levels as u32).to_le_bytes());
    head[172..180].fill(0);
    let mut entry = [0; OF_BRICK];
    entry[22] = 3;
    let mut bytes = [&head[..], &[0; 4], &entry.repeat(bricks as usize), &[0; 4 + 32]].concat();
    sum_bricks(&mut bytes).expect("bricks");
    bytes
}

/// A bricked volume whose header claims `dims` samples, with a correct checksum of the header.
pub fn with_dims(dims: [u64; 3]) -> Vec<u8> {
    let mut bytes = splv(&Folder::new());
    let end = 192 + word(&bytes, 172) + word(&bytes, 176);
    bytes[24..48].copy_from_slice(&dims.map(u64::to_le_bytes).concat());
    let levels = 1 + dims
        .map(|n| n.div_ceil(32))
        .into_iter()
        .max()
        .map_or(0, |most| most.next_power_of_two().ilog2());
    bytes[160..164].copy_from_slice(&levels.to_le_bytes());
    let sum = crc32fast::hash(&bytes[..end]);
    bytes[end..end + 4].copy_from_slice(&sum.to_le_bytes());
    bytes
}

/// A `.splv` whose last brick, one of level 0, is replaced by `bytes` compressed zeros.
pub fn brick_of_zeros(bytes: usize) -> Vec<u8> {
    let mut file = splv(&Folder::new());
    let header = 192 + word(&file, 172) + word(&file, 176) + 4;
    let packed = zstd::bulk::compress(&vec![0; bytes], 19).expect("bytes");
    let [bricks, _] = bricks_and_levels([24, 32, 40].map(|at| word(&file, at) as u64));
    let entry = header + OF_BRICK * (bricks as usize - 1);
    let start = file.len() - 32 - word(&file, entry + 8);
    file.splice(start..file.len() - 32, packed);
    // The code of a compressed brick of differing values.
    file[entry + 22] = 4;
    sum_bricks(&mut file).expect("bricks");
    file
}
