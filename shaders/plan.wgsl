// Plan: cuts the frame into depth passes, front to back, so that no pass needs more entries or records than there is room.
// `total` adds up what measure found; `plan` writes one pass if all fits, else cuts by the survey: as many sheets as fit,
// and where a single sheet is too much, bands of it.

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> needs: array<vec2<u32>>;
@group(0) @binding(2) var<storage, read_write> totals: Totals;
@group(0) @binding(3) var<storage, read> census: array<u32>;
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
    words: u32,
}

var<workgroup> sums: array<vec2<u32>, 256>;

fn saturating_add(a: vec2<u32>, b: vec2<u32>) -> vec2<u32> {
    return a + min(b, vec2(0xffffffffu) - a);
}

@compute @workgroup_size(256)
fn total(@builtin(local_invocation_index) lane: u32) {
    var sum = vec2(0u);
    for (var i = lane; i < runs.x; i += 256u) {
        sum = saturating_add(sum, needs[i]);
    }
    sums[lane] = sum;
    workgroupBarrier();
    if lane == 0u {
        for (var i = 1u; i < 256u; i++) {
            sum = saturating_add(sum, sums[i]);
        }
        totals = Totals(sum.x, sum.y);
    }
}

fn counted(sheet: u32, band: u32, what: u32) -> u32 {
    return census[(sheet * BANDS + band) * CENSUS_KINDS + what];
}

// What a pass over the sheets first … end-1 and some bands needs: the windows that start there, and one window and one
// record for each splat that reaches in from before.
fn needed(first: u32, end: u32, first_band: u32, end_band: u32) -> vec2<u32> {
    var sum = vec2(0u);
    for (var band = first_band; band < end_band; band++) {
        var open = vec2(0u);
        for (var sheet = 0u; sheet < end; sheet++) {
            let starting = vec2(counted(sheet, band, FIRST_TILES), counted(sheet, band, FIRST_WORDS));
            let ending = vec2(counted(sheet, band, LAST_TILES), counted(sheet, band, LAST_WORDS));
            if sheet < first {
                open = open + starting - ending;
            } else {
                sum = saturating_add(sum, vec2(counted(sheet, band, WINDOW_TILES), starting.y));
            }
        }
        sum = saturating_add(sum, open);
    }
    return sum;
}

fn is_room(need: vec2<u32>) -> bool {
    return need.x <= frame.entry_capacity && need.y <= frame.record_capacity;
}

fn collected(first: u32, end: u32) -> vec2<u32> {
    return vec2(max(first, 1u + MARGIN) - MARGIN, min(end + MARGIN, frame.sheet_count + 1u));
}

fn emit(first: u32, end: u32, first_band: u32, end_band: u32) {
    if report.passes >= MAX_PASSES {
        report.overflow = 1u;
        return;
    }
    let range = collected(first, end);
    let groups = ((range.y - range.x + 1u) >> frame.group_shift) + 1u;
    let first_row = band_start(first_band);
    let end_row = band_start(end_band);
    passes[report.passes].stage =
        Pass(first, end, range.x, range.y, first_row, end_row, first_band, end_band, groups, vec3(0u));
    report.passes += 1u;
}

@compute @workgroup_size(1)
fn plan() {
    report.passes = 0u;
    report.overflow = 0u;
    report.entries = totals.entries;
    report.words = totals.words;
    for (var i = 0u; i < MAX_PASSES; i++) {
        passes[i].stage.groups = 0u;
    }
    let end = frame.sheet_count + 1u;
    if fits(totals) {
        emit(1u, end, 0u, BANDS);
        return;
    }
    var first = 1u;
    while first < end {
        // The most sheets that fit, by bisection: what a pass needs grows with its end.
        var fitting = first;
        var too_many = end + 1u;
        while too_many - fitting > 1u {
            let middle = (fitting + too_many) / 2u;
            let range = collected(first, middle);
            if is_room(needed(range.x, range.y, 0u, BANDS)) {
                fitting = middle;
            } else {
                too_many = middle;
            }
        }
        if fitting > first {
            emit(first, fitting, 0u, BANDS);
            first = fitting;
            continue;
        }
        let range = collected(first, first + 1u);
        var band = 0u;
        while band < BANDS {
            var last = band + 1u;
            while last < BANDS && is_room(needed(range.x, range.y, band, last + 1u)) {
                last++;
            }
            if !is_room(needed(range.x, range.y, band, last)) {
                report.overflow = 1u;
            }
            if band_start(band) < band_start(last) {
                emit(first, first + 1u, band, last);
            }
            band = last;
        }
        first++;
    }
}
