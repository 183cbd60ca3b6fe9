// Measure: finds the tiles and sheets that each candidate meets, and those that its batch meets and
// the total that it needs.

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> planes: array<f32>;
// The span of each candidate of this chunk.
@group(0) @binding(2) var<storage, read_write> spans: array<vec2<u32>>;
// The span of each batch.
@group(0) @binding(3) var<storage, read_write> run_spans: array<vec2<u32>>;
// Per batch: entries, then record words and splats (16 bits each).
@group(0) @binding(4) var<storage, read_write> needs: array<vec2<u32>>;

fn pack_span(span: Span) -> vec2<u32> {
    return vec2(
        pack_corner(span.first_sheet, span.first_tile),
        pack_corner(span.last_sheet, span.last_tile),
    );
}

@compute @workgroup_size(64)
fn measure(@builtin(global_invocation_id) id: vec3<u32>) {
    let number = number_of(id);
    let start = number * RUN;
    let count = candidate_count();
    if start >= count {
        return;
    }
    let words = record_words(source.flags);
    var around = NO_SPAN;
    var need = vec2(0u);
    for (var i = start; i < min(start + RUN, count); i++) {
        let splat = candidate(i);
        let span = locate(splat);
        var packed = NO_SPAN;
        if span.visible {
            packed = pack_span(span);
            let across = span.last_tile - span.first_tile + 1u;
            let windows = window_count(span.first_sheet, span.last_sheet);
            need += vec2(across.x * across.y * windows, words | ONE_SPLAT);
            around = join(around, packed);
        }
        spans[i] = packed;
    }
    run_spans[source.first_run + number] = around;
    needs[source.first_run + number] = need;
}
