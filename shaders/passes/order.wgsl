// Order: sorts each bin's entries, by sheet and then by record, or single splats by sheet and then
// by their key. Bins are filled in the arbitrary order in which invocations run. After sorting, the
// same input is added in the same order and gives the same bytes every time.

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> stage: Pass;
@group(0) @binding(2) var<storage, read> bins: array<u32>;
@group(0) @binding(3) var<storage, read_write> entries: array<u32>;
// Bins too long for one invocation.
@group(0) @binding(4) var<storage, read_write> long_bins: array<u32>;
// The number of long bins.
@group(0) @binding(5) var<storage, read_write> long_count: atomic<u32>;
// The workgroups of `order_long`.
@group(1) @binding(0) var<storage, read_write> long_arguments: array<u32, 3>;
@group(0) @binding(6) var<storage, read> records: array<vec4<f32>>;
@group(0) @binding(7) var<storage, read> progress: array<u32>;

// The most entries of a bin that one invocation sorts; few on a GPU, where one alone is slow.
const SHORT: u32 = select(2048u, 12u, STAGED);
// Entries that a workgroup sorts in its own memory.
const ROOM: u32 = select(1u, 1024u, STAGED);

var<workgroup> held: array<u32, ROOM>;
var<workgroup> held_keys: array<f32, select(1u, ROOM, SINGLE_SPLATS)>;

var<workgroup> shared_number: u32;

fn key_of(entry: u32) -> f32 {
    let key = single_key(records[(entry & ENTRY_RECORD) * RECORD_UNIT].xyz);
    return select(key, -key, BACK_TO_FRONT);
}

fn goes_before(a: u32, b: u32) -> bool {
    if is_of_one_sheet(a, b) {
        return is_nearer(a, key_of(a), b, key_of(b));
    }
    return a < b;
}

// Whether the keys of two entries decide.
fn is_of_one_sheet(a: u32, b: u32) -> bool {
    return SINGLE_SPLATS && (a >> ENTRY_SHEET_SHIFT) == (b >> ENTRY_SHEET_SHIFT);
}

fn is_nearer(a: u32, key_of_a: f32, b: u32, key_of_b: f32) -> bool {
    // Splats with equal keys keep the order of the scene, in either direction.
    return key_of_a < key_of_b || (key_of_a == key_of_b && (a < b) != BACK_TO_FRONT);
}

// The same of two entries that the workgroup holds.
fn held_goes_before(i: u32, j: u32) -> bool {
    let a = held[i];
    let b = held[j];
    if is_of_one_sheet(a, b) {
        return is_nearer(a, held_keys[i], b, held_keys[j]);
    }
    return a < b;
}

fn bin_start(bin: u32) -> u32 {
    if bin == 0u {
        return 0u;
    }
    return min(bins[bin - 1u], frame.entry_capacity);
}

fn bin_end(bin: u32) -> u32 {
    return min(bins[bin], frame.entry_capacity);
}

@compute @workgroup_size(64)
fn order(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let bins = progress[progress_word(LISTED)] * stage.groups;
    let groups = (bins + 63u) / 64u;
    let number = dealt(group_number(group), groups) * 64u + lane;
    if number >= bins {
        return;
    }
    let tile = progress[listed_tile(number / stage.groups)] - stage.first_row * frame.tiles.x;
    let bin = tile * stage.groups + number % stage.groups;
    let start = bin_start(bin);
    let end = bin_end(bin);
    if end - start > SHORT {
        long_bins[atomicAdd(&long_count, 1u)] = bin;
        return;
    }
    // Insertion sort over shrinking distances (Shell 1959, with Knuth's distances), which suits
    // nearly sorted bins.
    var gap = 1u;
    while 3u * gap + 1u < (end - start) / 8u {
        gap = 3u * gap + 1u;
    }
    loop {
        for (var i = start + gap; i < end; i++) {
            let entry = entries[i];
            var at = i;
            while at >= start + gap && goes_before(entry, entries[at - gap]) {
                entries[at] = entries[at - gap];
                at -= gap;
            }
            entries[at] = entry;
        }
        if gap == 1u {
            break;
        }
        gap /= 3u;
    }
}

// Maximum number of workgroups that share the long bins.
const LONG_WORKGROUPS: u32 = select(4096u, 32768u, STAGED);

@compute @workgroup_size(1)
fn count_long() {
    long_arguments[0] = min(atomicLoad(&long_count), min(LONG_WORKGROUPS, MOST_WORKGROUPS));
    long_arguments[1] = 1u;
    long_arguments[2] = 1u;
}

// A bitonic network (Batcher 1968) in the form with a flipped first step. There every comparison
// puts the smaller entry first, so missing entries behind the last one count as largest and need no
// memory.
@compute @workgroup_size(64)
fn order_long(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    if lane == 0u {
        shared_number = atomicLoad(&long_count);
    }
    let long = workgroupUniformLoad(&shared_number);
    for (var i = group.x; i < long; i += groups.x) {
        if lane == 0u {
            shared_number = long_bins[i];
        }
        let bin = workgroupUniformLoad(&shared_number);
        sort_bin(bin_start(bin), bin_end(bin), lane);
    }
}

// Returns the two places that a pair of a step of the network compares.
fn compared(pair: u32, half: u32, block: u32) -> vec2<u32> {
    let within = pair % half;
    let low = (pair / half) * 2u * half + within;
    return vec2(low, select(low + half, low + block - 1u - 2u * within, half == block / 2u));
}

fn sort_bin(start: u32, end: u32, lane: u32) {
    let count = end - start;
    if STAGED && count <= ROOM {
        sort_held(start, count, lane);
        return;
    }
    for (var block = 2u; block < 2u * count; block *= 2u) {
        for (var half = block / 2u; half > 0u; half /= 2u) {
            for (var pair = lane; pair < count; pair += 64u) {
                let at = compared(pair, half, block);
                let low = at.x;
                let high = at.y;
                if high < count {
                    let a = entries[start + low];
                    let b = entries[start + high];
                    if goes_before(b, a) {
                        entries[start + low] = b;
                        entries[start + high] = a;
                    }
                }
            }
            storageBarrier();
        }
    }
}

// Sorts a bin that the workgroup's memory holds.
fn sort_held(start: u32, count: u32, lane: u32) {
    for (var i = lane; i < count; i += 64u) {
        let entry = entries[start + i];
        held[i] = entry;
        if SINGLE_SPLATS {
            held_keys[i] = key_of(entry);
        }
    }
    workgroupBarrier();
    for (var block = 2u; block < 2u * count; block *= 2u) {
        for (var half = block / 2u; half > 0u; half /= 2u) {
            for (var pair = lane; pair < count; pair += 64u) {
                let at = compared(pair, half, block);
                if at.y < count && held_goes_before(at.y, at.x) {
                    let entry = held[at.x];
                    held[at.x] = held[at.y];
                    held[at.y] = entry;
                    if SINGLE_SPLATS {
                        let key = held_keys[at.x];
                        held_keys[at.x] = held_keys[at.y];
                        held_keys[at.y] = key;
                    }
                }
            }
            workgroupBarrier();
        }
    }
    for (var i = lane; i < count; i += 64u) {
        entries[start + i] = held[i];
    }
    workgroupBarrier();
}
