// Plan: divides the frame into depth passes, front to back. `total` sums the results of measure,
// and `accumulate` prepares the counts of survey.wgsl. Before each pass, `advance` decides how far
// the pass reaches: as many sheets as fit the buffers and the share of a pass. If a single sheet
// needs too much, it is divided into bands. So the CPU need not wait inside a frame.
//
// A batch counts in full in every pass that it meets, which is more than its splats need there. So
// a pass that fits by these counts does fit.

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> needs: array<vec2<u32>>;
@group(0) @binding(2) var<uniform> run_count: vec4<u32>;
@group(0) @binding(3) var<storage, read_write> state: array<u32>;
@group(0) @binding(4) var<storage, read_write> census: array<u32>;
@group(0) @binding(5) var<storage, read_write> stage: Pass;
@group(0) @binding(6) var<storage, read_write> arguments: array<u32>;
// The number of elements of `bins` that a pass uses; the rest is unused.
@group(0) @binding(7) var<storage, read_write> bin_size: vec4<u32>;
@group(0) @binding(8) var<storage, read> map: array<u32>;

const SEGMENTS: u32 = 4096u;

// A pass that may hide what lies behind it takes one PASS_SHARE-th of the frame's entries, but at
// least LEAST_SHARE entries.
const PASS_SHARE: u32 = 3u;

var<workgroup> sums: array<vec3<u32>, 256>;

fn saturating_add(a: vec3<u32>, b: vec3<u32>) -> vec3<u32> {
    return a + min(b, vec3(0xffffffffu) - a);
}

@compute @workgroup_size(256)
fn total(@builtin(local_invocation_index) lane: u32) {
    var sum = vec3(0u);
    for (var i = lane; i < run_count.x; i += 256u) {
        let need = needs[i];
        sum = saturating_add(sum, vec3(need.x, need.y & (ONE_SPLAT - 1u), need.y / ONE_SPLAT));
    }
    sums[lane] = sum;
    workgroupBarrier();
    if lane == 0u {
        for (var i = 1u; i < 256u; i++) {
            sum = saturating_add(sum, sums[i]);
        }
        for (var i = 0u; i < STATE_WORDS; i++) {
            state[i] = 0u;
        }
        state[ENTRIES] = sum.x;
        state[WORDS] = sum.y;
        state[SPLATS] = sum.z;
        state[NEXT_SHEET] = 1u;
        state[TARGET] = select(
            frame.entry_capacity,
            max(sum.x / PASS_SHARE, LEAST_SHARE),
            OCCLUSION,
        );
    }
}

// Replaces the counts of each sheet by the sums over the sheets before it, band by band.
@compute @workgroup_size(64)
fn accumulate(@builtin(local_invocation_index) band: u32) {
    if band > BANDS {
        return;
    }
    var started = vec3(0u);
    var ended = vec3(0u);
    for (var sheet = 0u; sheet <= frame.sheet_count + 1u; sheet++) {
        let at = census_index(sheet, band);
        started = replace(at + STARTING, started);
        ended = replace(at + ENDING, ended);
    }
}

// Replaces counts by the sums before them. Returns the sums including them.
fn replace(at: u32, before: vec3<u32>) -> vec3<u32> {
    let counts = vec3(census[at], census[at + 1u], census[at + 2u]);
    census[at] = before.x;
    census[at + 1u] = before.y;
    census[at + 2u] = before.z;
    let entries = before.x + counts.x;
    return vec3(entries, before.y + counts.y + u32(entries < counts.x), before.z + counts.z);
}

// Returns the entries and record words of the batches that meet a band in the sheets first … end-1.
// The entries saturate at 32 bits.
fn needed(first: u32, end: u32, band: u32) -> vec2<u32> {
    let started = census_index(end, band) + STARTING;
    let ended = census_index(first, band) + ENDING;
    let entries = census[started] - census[ended];
    let passed = census[started + 1u] - census[ended + 1u] - u32(census[started] < census[ended]);
    return vec2(
        select(entries, 0xffffffffu, passed > 0u),
        census[started + 2u] - census[ended + 2u],
    );
}

fn is_room(need: vec2<u32>, target_entries: u32) -> bool {
    return need.x <= min(target_entries, frame.entry_capacity) && need.y <= frame.record_capacity;
}

fn opaque_tiles() -> u32 {
    return map[map_index(frame.tiles.x, frame.tiles.y)];
}

@compute @workgroup_size(1)
fn advance() {
    stage.groups = 0u;
    bin_size.x = 0u;
    state[TOUCHED] = max(state[TOUCHED], state[TILES]);
    for (var i = 0u; i < 20u; i++) {
        arguments[i] = select(1u, 0u, i % 4u == 0u);
    }
    if state[DONE] + state[STALLED] + state[OVERFLOW] > 0u {
        return;
    }
    let end = frame.sheet_count + 1u;
    let first = state[NEXT_SHEET];
    let tiles = frame.tiles.x * frame.tiles.y;
    if first >= end || (OCCLUSION && opaque_tiles() == tiles) {
        state[DONE] = 1u;
        return;
    }
    if OCCLUSION && state[PASSES] > 0u && 4u * opaque_tiles() < state[TOUCHED] {
        // Little becomes opaque, so everything that the map does not hide yet is better drawn at
        // once.
        state[TARGET] = frame.entry_capacity;
    }
    if state[NEXT_BAND] == 0u {
        let last = furthest(first, end, state[TARGET]);
        if last > first {
            state[NEXT_SHEET] = last;
            begin(first, last, 0u, BANDS, needed(first, last, BANDS).x);
            return;
        }
    }
    begin_bands(first);
}

// Returns the sheet before which a pass must end.
fn furthest(first: u32, end: u32, target_entries: u32) -> u32 {
    let least = needed(first, first + 1u, BANDS);
    if !is_room(least, frame.entry_capacity) {
        return first;
    }
    // Otherwise batches that reach through much of the scene would be counted and visited by many
    // thin passes.
    let most_entries = max(target_entries, 2u * min(least.x, 0x7fffffffu));
    var last = first + 1u;
    while last < end && is_room(needed(first, last + 1u, BANDS), most_entries) {
        last++;
    }
    return last;
}

// Begins a pass with as many bands as fit together, of a sheet that needs too much for one pass. A
// single band is tried whatever it needs, if its entries can be counted.
fn begin_bands(sheet: u32) {
    let band = state[NEXT_BAND];
    var last = band + 1u;
    var need = needed(sheet, sheet + 1u, band);
    while last < BANDS {
        let other = needed(sheet, sheet + 1u, last);
        let more = need + min(other, vec2(0xffffffffu) - need);
        if !is_room(more, frame.entry_capacity) {
            break;
        }
        need = more;
        last++;
    }
    if need.x == 0xffffffffu {
        // The number of entries exceeds 32 bits.
        state[OVERFLOW] = 1u;
        return;
    }
    state[NEXT_BAND] = last % BANDS;
    state[NEXT_SHEET] = sheet + last / BANDS;
    begin(sheet, sheet + 1u, band, last, need.x);
}

fn begin(first: u32, end: u32, first_band: u32, end_band: u32, entries: u32) {
    let first_row = band_start(first_band);
    let end_row = band_start(end_band);
    let tiles = (end_row - first_row) * frame.tiles.x;
    // One group more than the sheets fill: a pass starts one sheet early, and its groups count from
    // there. The number of bins is limited relative to the number of entries.
    var shift = 0u;
    var groups = end - first + 2u;
    while shift < MOST_GROUP_SHIFT
        && (groups * tiles > MOST_BINS
            || groups * tiles > 2u * min(entries, 0x7fffffffu) + tiles) {
        shift++;
        groups = ((end - first + 1u) >> shift) + 1u;
    }
    stage = Pass(first, end, first_row, end_row, select(0u, groups, tiles > 0u), shift, vec2(0u));
    state[PASSES] += 1u;
    state[ADVANCED] += 1u;
    if state[NEXT_SHEET] > frame.sheet_count {
        // Nothing is left for another pass.
        state[DONE] = 1u;
    }
    let bins = groups * tiles;
    bin_size.x = bins + 1u;
    arguments[SCAN_ARGUMENTS] = max(bins, progress_word(LISTED)) / SEGMENTS + 1u;
    arguments[TILE_ARGUMENTS] = (tiles + 63u) / 64u;
}
