// Select: the samples of a lattice chunk that can add to the picture under the current transfer
// function. Runs when the transfer function changes, not when the camera moves. A sample stays
// unless every value in the box of samples around it, as far as its kernel reaches, is transparent:
// then no reconstructed value near it is visible.
//
// An invocation handles a block of samples, so that neighbours in the list are neighbours in space:
// they meet the same tiles and sheets, and are hidden together. Two entry points around a prefix
// sum keep the list in one order: count, then write.

@group(0) @binding(0) var<uniform> source: Source;
// Smallest and largest value around each sample, 8 bits each over the volume's range, two samples a
// word.
@group(0) @binding(1) var<storage, read> ranges: array<u32>;
// For each smallest level, the smallest largest level for which the range between them has a
// visible value.
@group(0) @binding(2) var<storage, read> first_visible: array<u32>;
// The number of selected samples in each block; later the number before the block.
@group(0) @binding(3) var<storage, read_write> blocks: array<u32>;
// The selected samples.
@group(0) @binding(4) var<storage, read_write> selected: array<u32>;

// Samples of a block along each side.
const SIDE: u32 = 4u;

fn is_visible(index: u32) -> bool {
    let range = ranges[index >> 1u] >> (16u * (index & 1u));
    let low = range & 0xffu;
    let high = (range >> 8u) & 0xffu;
    return high >= first_visible[low];
}

// The first sample of a block, and the one behind its last. If there is no such block, the end lies
// before the first.
struct Block {
    first: vec3<u32>,
    end: vec3<u32>,
}

fn block_of(id: u32) -> Block {
    let dims = vec3(source.lattice.xy, source.count / (source.lattice.x * source.lattice.y));
    let blocks_along = (dims + SIDE - 1u) / SIDE;
    let row = id / blocks_along.x;
    let first = SIDE * vec3(id % blocks_along.x, row % blocks_along.y, row / blocks_along.y);
    return Block(first, min(first + SIDE, dims));
}

fn index_of(place: vec3<u32>) -> u32 {
    return (place.z * source.lattice.y + place.y) * source.lattice.x + place.x;
}

@compute @workgroup_size(64)
fn count(@builtin(global_invocation_id) id: vec3<u32>) {
    let number = number_of(id);
    let block = block_of(number);
    if block.first.z >= block.end.z {
        return;
    }
    var visible = 0u;
    for (var z = block.first.z; z < block.end.z; z++) {
        for (var y = block.first.y; y < block.end.y; y++) {
            for (var x = block.first.x; x < block.end.x; x++) {
                visible += u32(is_visible(index_of(vec3(x, y, z))));
            }
        }
    }
    blocks[number] = visible;
}

@compute @workgroup_size(64)
fn write(@builtin(global_invocation_id) id: vec3<u32>) {
    let number = number_of(id);
    let block = block_of(number);
    if block.first.z >= block.end.z {
        return;
    }
    var at = blocks[number];
    for (var z = block.first.z; z < block.end.z; z++) {
        for (var y = block.first.y; y < block.end.y; y++) {
            for (var x = block.first.x; x < block.end.x; x++) {
                let index = index_of(vec3(x, y, z));
                if is_visible(index) {
                    selected[at] = index;
                    at++;
                }
            }
        }
    }
}
