// Plan: cuts the frame into depth passes, front to back, so that no pass needs more entries or records than there is room.
// `total` adds up what measure found; `plan` writes one pass if all fits, else cuts by the survey, which `accumulate` has
// prepared: as many sheets as fit, and where a single sheet is too much, bands of it.

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> needs: array<vec2<u32>>;
@group(0) @binding(2) var<storage, read_write> totals: Totals;
@group(0) @binding(3) var<storage, read_write> census: array<u32>;
// Each pass has 256 bytes, so that it can be bound on its own.
@group(0) @binding(4) var<storage, read_write> passes: array<PaddedPass>;
@group(0) @binding(5) var<storage, read_write> report: Report;
@group(0) @binding(6) var<uniform> runs: vec4<u32>;

struct PaddedPass {
    stage: Pass,
    padding: array<vec4<u32>, 12>,
}

struct Report {
    passes: u32,
    // Set when even one band of one sheet is more than there is room for, or there are more passes than can be listed.
    overflow: u32,
    entries: u32,
    splats: u32,
}

var<workgroup> sums: array<vec3<u32>, 256>;

fn saturating_add(a: vec2<u32>, b: vec2<u32>) -> vec2<u32> {
    return a + min(b, vec2(0xffffffffu) - a);
}

@compute @workgroup_size(256)
fn total(@builtin(local_invocation_index) lane: u32) {
    var sum = vec3(0u);
    for (var i = lane; i < runs.x; i += 256u) {
        let own = vec3(needs[i].x, needs[i].y & (ONE_SPLAT - 1u), needs[i].y / ONE_SPLAT);
        sum += min(own, vec3(0xffffffffu) - sum);
    }
    sums[lane] = sum;
    workgroupBarrier();
    if lane == 0u {
        for (var i = 1u; i < 256u; i++) {
            sum += min(sums[i], vec3(0xffffffffu) - sum);
        }
        totals = Totals(sum.x, sum.y, sum.z);
    }
}

// Turns the census into what passes are cut by. In every band: the tiles and record words of splats that reach into a sheet
// from before it take the place of those that start in it. Behind the bands: the sums over them.
@compute @workgroup_size(64)
fn accumulate(@builtin(local_invocation_index) lane: u32) {
    if !fits(totals) {
        if lane < BANDS {
            var open = vec2(0u);
            for (var sheet = 0u; sheet <= frame.sheet_count; sheet++) {
                let at = census_index(sheet, lane);
                let starting = vec2(census[at + FIRST_TILES], census[at + FIRST_WORDS]);
                let ending = vec2(census[at + LAST_TILES], census[at + LAST_WORDS]);
                census[at + OPEN_TILES] = open.x;
                census[at + OPEN_WORDS] = open.y;
                open = open + starting - ending;
            }
        }
        storageBarrier();
        for (var sheet = lane; sheet <= frame.sheet_count; sheet += 64u) {
            var starting = vec2(0u);
            var open = vec2(0u);
            for (var band = 0u; band < BANDS; band++) {
                starting = saturating_add(starting, starting_in(sheet, band));
                open = saturating_add(open, open_at(sheet, band));
            }
            let at = census_index(sheet, BANDS);
            census[at + WINDOW_TILES] = starting.x;
            census[at + FIRST_WORDS] = starting.y;
            census[at + OPEN_TILES] = open.x;
            census[at + OPEN_WORDS] = open.y;
        }
    }
}

// Entries and record words of the windows and splats that start in a sheet.
fn starting_in(sheet: u32, band: u32) -> vec2<u32> {
    let at = census_index(sheet, band);
    return vec2(census[at + WINDOW_TILES], census[at + FIRST_WORDS]);
}

// Those of the splats that reach into it from before: each has one window there.
fn open_at(sheet: u32, band: u32) -> vec2<u32> {
    let at = census_index(sheet, band);
    return vec2(census[at + OPEN_TILES], census[at + OPEN_WORDS]);
}

fn is_room(need: vec2<u32>) -> bool {
    return need.x <= frame.entry_capacity && need.y <= frame.record_capacity;
}

fn emit(first: u32, end: u32, first_band: u32, end_band: u32) {
    if report.passes >= MAX_PASSES {
        report.overflow = 1u;
        return;
    }
    let groups = ((end - first + 1u) >> frame.group_shift) + 1u;
    let first_row = band_start(first_band);
    let end_row = band_start(end_band);
    passes[report.passes].stage =
        Pass(first, end, first_row, end_row, first_band, end_band, groups, 0u);
    report.passes += 1u;
}

@compute @workgroup_size(1)
fn plan() {
    report.passes = 0u;
    report.overflow = 0u;
    report.entries = totals.entries;
    report.splats = totals.splats;
    for (var i = 0u; i < MAX_PASSES; i++) {
        passes[i].stage.groups = 0u;
    }
    let end = frame.sheet_count + 1u;
    if fits(totals) {
        emit(1u, end, 0u, BANDS);
        return;
    }
    // One walk over the sheets: the driver of a software adapter ends long loops (see docs/engine.md).
    var first = 1u;
    while first < end {
        var need = open_at(first, BANDS);
        var last = first;
        while last < end {
            let more = saturating_add(need, starting_in(last, BANDS));
            if !is_room(more) {
                break;
            }
            need = more;
            last++;
        }
        if last > first {
            emit(first, last, 0u, BANDS);
            first = last;
            continue;
        }
        emit_in_bands(first);
        first++;
    }
}

// What one band of a single sheet needs.
fn needed_in_band(sheet: u32, band: u32) -> vec2<u32> {
    return saturating_add(open_at(sheet, band), starting_in(sheet, band));
}

// A sheet that is too much for one pass, in as many bands together as fit.
fn emit_in_bands(sheet: u32) {
    var band = 0u;
    while band < BANDS {
        var need = needed_in_band(sheet, band);
        if !is_room(need) {
            report.overflow = 1u;
        }
        var last = band + 1u;
        while last < BANDS {
            need = saturating_add(need, needed_in_band(sheet, last));
            if !is_room(need) {
                break;
            }
            last++;
        }
        if band_start(band) < band_start(last) {
            emit(sheet, sheet + 1u, band, last);
        }
        band = last;
    }
}
