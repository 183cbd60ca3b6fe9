// Bin: puts the entries of a pass into bins, one entry for every tile and window of every record.
// `count` finds the bins' sizes; after a scan, `fill` writes the entries. Then `bins` holds the end
// of each bin, which is the start of the next one.

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> stage: Pass;
@group(0) @binding(2) var<uniform> run_count: vec4<u32>;
@group(0) @binding(3) var<storage, read> boxes: array<Box>;
// Record words before each batch; the last element is the number of record words of the pass.
@group(0) @binding(4) var<storage, read> runs: array<u32>;
@group(0) @binding(5) var<storage, read_write> bins: array<atomic<u32>>;
@group(0) @binding(6) var<storage, read_write> entries: array<u32>;
// Records of splats that meet many bins, for large.wgsl; their number comes first.
@group(0) @binding(7) var<storage, read_write> large: array<atomic<u32>>;
@group(0) @binding(8) var<storage, read_write> state: array<atomic<u32>>;

// The workgroups of `count` and `fill`.
@group(1) @binding(0) var<storage, read_write> workgroups: array<u32, 3>;

// Returns the number of places for boxes, one for each RECORD_UNIT words of records.
fn box_count() -> u32 {
    return min(runs[run_count.x], frame.record_capacity) / RECORD_UNIT;
}

@compute @workgroup_size(1)
fn prepare() {
    let words = select(0u, runs[run_count.x], stage.groups > 0u);
    if words > frame.record_capacity {
        atomicStore(&state[OVERFLOW], 1u);
    }
    workgroups[0] = min((box_count() + 63u) / 64u, MOST_WORKGROUPS);
    workgroups[1] = 1u;
    workgroups[2] = 1u;
    atomicStore(&large[0], 0u);
}

// Neighbouring invocations handle neighbouring records, so that bins fill nearly in the order that
// `order` needs.
@compute @workgroup_size(64)
fn count(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let count = box_count();
    for (var at = id.x; at < count; at += groups.x * 64u) {
        let box = boxes[at];
        if box.sheets == NO_BOX {
            continue;
        }
        let walk = walk_of(box, stage);
        if is_large(walk) {
            atomicStore(&large[1u + atomicAdd(&large[0], 1u)], at);
            continue;
        }
        for (var window = 0u; window < walk.windows; window++) {
            for (var row = walk.first_row; row < walk.end_row; row++) {
                for (var column = walk.first_column; column <= walk.last_column; column++) {
                    atomicAdd(
                        &bins[bin_of(column, row, walk.first_window + 3u * window, stage)],
                        1u,
                    );
                }
            }
        }
    }
}

@compute @workgroup_size(64)
fn fill(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    if id.x == 0u {
        // The element behind the last bin is the number of entries.
        let binned = atomicLoad(
            &bins[(stage.end_row - stage.first_row) * frame.tiles.x * stage.groups],
        );
        atomicAdd(&state[BINNED], binned);
        if binned > frame.entry_capacity {
            atomicStore(&state[OVERFLOW], 1u);
        }
    }
    let count = box_count();
    for (var at = id.x; at < count; at += groups.x * 64u) {
        let box = boxes[at];
        if box.sheets == NO_BOX {
            continue;
        }
        let walk = walk_of(box, stage);
        if is_large(walk) {
            continue;
        }
        for (var window = 0u; window < walk.windows; window++) {
            let entry = entry_of(box, at, walk, window, stage);
            let sheet = walk.first_window + 3u * window;
            for (var row = walk.first_row; row < walk.end_row; row++) {
                for (var column = walk.first_column; column <= walk.last_column; column++) {
                    let slot = atomicAdd(&bins[bin_of(column, row, sheet, stage)], 1u);
                    if slot < frame.entry_capacity {
                        entries[slot] = entry;
                    }
                }
            }
        }
    }
}
