// Large: the entries of splats that meet many bins, each spread over the invocations of a
// workgroup. bin.wgsl lists these splats; `count` adds them to the bins' sizes, `fill` writes their
// entries.

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> stage: Pass;
@group(0) @binding(2) var<storage, read> boxes: array<Box>;
@group(0) @binding(3) var<storage, read_write> bins: array<atomic<u32>>;
@group(0) @binding(4) var<storage, read_write> entries: array<u32>;
// The number of large splats, then their records.
@group(0) @binding(5) var<storage, read> large: array<u32>;
// The workgroups of `count` and `fill`.
@group(1) @binding(0) var<storage, read_write> workgroups: array<u32, 3>;

@compute @workgroup_size(1)
fn prepare() {
    workgroups[0] = min(large[0], MOST_WORKGROUPS);
    workgroups[1] = 1u;
    workgroups[2] = 1u;
}

fn nth_bin(walk: Walk, i: u32) -> u32 {
    let columns = walk.last_column - walk.first_column + 1u;
    let rows = walk.end_row - walk.first_row;
    let column = walk.first_column + i % columns;
    let row = walk.first_row + (i / columns) % rows;
    return bin_of(column, row, walk.first_window + 3u * (i / (columns * rows)), stage);
}

@compute @workgroup_size(256)
fn count(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    for (var number = group.x; number < large[0]; number += groups.x) {
        let walk = walk_of(boxes[large[1u + number]], stage);
        for (var i = lane; i < bin_count(walk); i += 256u) {
            atomicAdd(&bins[nth_bin(walk, i)], 1u);
        }
    }
}

@compute @workgroup_size(256)
fn fill(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    for (var number = group.x; number < large[0]; number += groups.x) {
        let at = large[1u + number];
        let box = boxes[at];
        let walk = walk_of(box, stage);
        let tiles = bin_count(walk) / walk.windows;
        for (var i = lane; i < bin_count(walk); i += 256u) {
            let slot = atomicAdd(&bins[nth_bin(walk, i)], 1u);
            if slot < frame.entry_capacity {
                entries[slot] = entry_of(box, at, walk, i / tiles, stage);
            }
        }
    }
}
