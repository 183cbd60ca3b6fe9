// Cull: finds the candidates that a depth pass draws: those that meet its sheets and rows, unless
// all tiles that they meet are opaque already. Batches of candidates are tested first, as a whole.

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> stage: Pass;
@group(0) @binding(2) var<storage, read> spans: array<vec2<u32>>;
@group(0) @binding(3) var<storage, read> run_spans: array<vec2<u32>>;
@group(0) @binding(4) var<storage, read> map: array<u32>;
// The batches with drawn candidates, see active.wgsl.
@group(0) @binding(5) var<storage, read_write> drawn: array<atomic<u32>>;
// The record words that each batch needs.
@group(0) @binding(6) var<storage, read_write> runs: array<u32>;
@group(0) @binding(7) var<storage, read_write> state: array<atomic<u32>>;

@group(1) @binding(0) var<uniform> source: Source;
// Nodes of a hierarchy; the element behind the last possible one is their number.
@group(1) @binding(1) var<storage, read> selected: array<u32>;

fn candidate_count() -> u32 {
    if (source.flags & NODES) != 0u {
        return selected[source.count];
    }
    return source.slices.w;
}

fn is_hidden(span: vec2<u32>) -> bool {
    if !OCCLUSION {
        return false;
    }
    let tiles = tiles_of(span);
    let opaque = map[map_index(tiles.z, tiles.w)] + map[map_index(tiles.x, tiles.y)]
        - map[map_index(tiles.x, tiles.w)] - map[map_index(tiles.z, tiles.y)];
    return opaque == (tiles.z - tiles.x) * (tiles.w - tiles.y);
}

// Whether a span starts in this pass. A span that started earlier has been drawn in part.
fn is_new(span: vec2<u32>) -> bool {
    return sheet_of_corner(span.x) >= stage.first_sheet || stage.first_sheet == 1u;
}

@compute @workgroup_size(64)
fn cull(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let count = candidate_count();
    let groups = (count + 64u * RUN - 1u) / (64u * RUN);
    // The dispatch is large enough for all nodes in memory, drawn or not.
    let number = dealt(group_number(group), groups) * 64u + lane;
    let start = number * RUN;
    if stage.groups == 0u || start >= count {
        return;
    }
    let run = source.first_run + number;
    let around = run_spans[run];
    var mask = 0u;
    var hidden = 0u;
    if in_pass(around, stage) {
        let run_hidden = is_hidden(around);
        for (var i = 0u; i < min(RUN, count - start); i++) {
            let span = spans[start + i];
            if in_pass(span, stage) {
                if run_hidden || is_hidden(span) {
                    hidden += u32(is_new(span));
                } else {
                    mask |= 1u << i;
                }
            }
        }
    }
    runs[run] = countOneBits(mask) * record_words(source.flags);
    if mask != 0u {
        // The list's order does not matter: the places of records follow from the batches' own
        // order.
        let at = active_run(
            source.first_run,
            atomicAdd(&drawn[active_count(source.first_run)], 1u),
        );
        atomicStore(&drawn[at], run);
        atomicStore(&drawn[at + 1u], mask);
    }
    if hidden > 0u {
        atomicAdd(&state[HIDDEN], hidden);
    }
}

// The workgroups of project.
@group(2) @binding(0) var<storage, read_write> workgroups: array<u32, 3>;

@compute @workgroup_size(1)
fn prepare() {
    let groups = (atomicLoad(&drawn[active_count(source.first_run)]) + 63u) / 64u;
    let rows = rows_of(groups);
    workgroups[0] = rows.x;
    workgroups[1] = rows.y;
    workgroups[2] = 1u;
}
