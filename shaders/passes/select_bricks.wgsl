// Select, for bricks: the samples of the used slots that can add to the picture under the current
// transfer function. Runs when the bricks or the transfer function change. A block of samples stays
// unless every value in it and around it is transparent.
//
// As in select.wgsl, an invocation handles a block, and the list is in one order: count, prefix
// sum, write.

@group(0) @binding(0) var<uniform> source: Source;
// Smallest and largest value in and around each block, 8 bits each over the volume's range, two
// blocks a word.
@group(0) @binding(1) var<storage, read> ranges: array<u32>;
// For each smallest level, the smallest largest level for which the range between them has a
// visible value.
@group(0) @binding(2) var<storage, read> first_visible: array<u32>;
// The number of selected samples in each block; later the number before the block.
@group(0) @binding(3) var<storage, read_write> blocks: array<u32>;
// The selected samples.
@group(0) @binding(4) var<storage, read_write> selected: array<u32>;
// For each slot, the place of its first sample in the level, and whether the level has a brick
// there.
@group(0) @binding(5) var<uniform> slots: array<vec4<u32>, 512>;

// Samples along each side of a block; number of bits of a block in its brick, and of a sample in
// its brick.
const SIDE: u32 = 4u;
const BLOCK_BITS: u32 = 9u;
const SAMPLE_BITS: u32 = 15u;

// The number of a block's first sample, and its samples along the axes: zero if the block is
// invisible.
struct Block {
    first: u32,
    size: vec3<u32>,
}

fn block_of(id: u32) -> Block {
    let slot = id >> BLOCK_BITS;
    let place = SIDE * (vec3(id, id >> 3u, id >> 6u) & vec3(7u));
    let first = (slot << SAMPLE_BITS) | (place.z << 10u) | (place.y << 5u) | place.x;
    let range = ranges[id >> 1u] >> (16u * (id & 1u));
    let shows = ((range >> 8u) & 0xffu) >= first_visible[range & 0xffu];
    let at = slots[slot];
    let in_level = at.xyz + place;
    // Beyond the level's border, bricks are padded with copies.
    let end = min(in_level + SIDE, source.lattice.xyz);
    return Block(first, select(vec3(0u), end - min(in_level, end), shows && at.w != 0u));
}

@compute @workgroup_size(64)
fn count(@builtin(global_invocation_id) id: vec3<u32>) {
    let number = number_of(id);
    if number >= source.count >> 6u {
        return;
    }
    let size = block_of(number).size;
    blocks[number] = size.x * size.y * size.z;
}

@compute @workgroup_size(64)
fn write(@builtin(global_invocation_id) id: vec3<u32>) {
    let number = number_of(id);
    if number >= source.count >> 6u {
        return;
    }
    let block = block_of(number);
    var at = blocks[number];
    for (var z = 0u; z < block.size.z; z++) {
        for (var y = 0u; y < block.size.y; y++) {
            for (var x = 0u; x < block.size.x; x++) {
                selected[at] = block.first | (z << 10u) | (y << 5u) | x;
                at++;
            }
        }
    }
}
