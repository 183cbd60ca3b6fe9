// Select: the samples of a lattice chunk that can add to the picture under the current transfer function. Runs when the
// transfer function changes, not when the camera moves. A sample stays unless every value in the box of samples around
// it, as far as its kernel reaches, is transparent: then no reconstructed value near it can be seen.
//
// Two entry points around a prefix sum keep the list in lattice order: count, then write.

@group(0) @binding(0) var<uniform> source: Source;
// Smallest and largest value around each sample, 8 bits each over the volume's range, two samples a word.
@group(0) @binding(1) var<storage, read> ranges: array<u32>;
// For each smallest level, the largest level from which on the range between them holds a visible value.
@group(0) @binding(2) var<storage, read> first_visible: array<u32>;
@group(0) @binding(3) var<storage, read_write> runs: array<u32>;
// The selected samples; the element behind the last possible one is their number.
@group(0) @binding(4) var<storage, read_write> selected: array<u32>;
// The workgroups that later passes need for them.
@group(0) @binding(5) var<storage, read_write> arguments: array<u32, 3>;

const SELECT_RUN: u32 = 64u;

fn is_visible(index: u32) -> bool {
    let range = ranges[index >> 1u] >> (16u * (index & 1u));
    let low = range & 0xffu;
    let high = (range >> 8u) & 0xffu;
    return high >= first_visible[low];
}

@compute @workgroup_size(64)
fn count(@builtin(global_invocation_id) id: vec3<u32>) {
    let start = id.x * SELECT_RUN;
    if start >= source.count {
        return;
    }
    var found = 0u;
    let end = min(start + SELECT_RUN, source.count);
    for (var i = start; i < end; i++) {
        found += u32(is_visible(i));
    }
    runs[id.x] = found;
}

@compute @workgroup_size(64)
fn write(@builtin(global_invocation_id) id: vec3<u32>) {
    let start = id.x * SELECT_RUN;
    if start >= source.count {
        return;
    }
    var at = runs[id.x];
    let end = min(start + SELECT_RUN, source.count);
    for (var i = start; i < end; i++) {
        if is_visible(i) {
            selected[at] = i;
            at++;
        }
    }
    if end == source.count {
        selected[source.count] = at;
        arguments[0] = (at + 64u * RUN - 1u) / (64u * RUN);
        arguments[1] = 1u;
        arguments[2] = 1u;
    }
}
