// Measure: which sheets each candidate meets, and how many entries and records each run of candidates will need.

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> planes: array<f32>;
// What each candidate of this chunk meets, see pack_span.
@group(0) @binding(2) var<storage, read_write> spans: array<u32>;
// Entries per run; record words and splats, 16 bits each.
@group(0) @binding(3) var<storage, read_write> needs: array<vec2<u32>>;

@compute @workgroup_size(64)
fn measure(@builtin(global_invocation_id) id: vec3<u32>) {
    let start = id.x * RUN;
    let count = candidate_count();
    if start >= count {
        return;
    }
    let words = select(4u, 1u, (source.flags & ISOTROPIC) != 0u);
    var need = vec2(0u);
    for (var i = start; i < min(start + RUN, count); i++) {
        let splat = candidate(i);
        let span = locate(splat.center, splat.covariance, splat.extent);
        var packed = NO_SPAN;
        if span.visible {
            packed = pack_span(span.first_sheet, span.last_sheet, span.first_tile.y, span.last_tile.y);
            let across = span.last_tile - span.first_tile + 1u;
            let windows = window_count(span.first_sheet, span.last_sheet);
            need += vec2(across.x * across.y * windows, words | ONE_SPLAT);
        }
        spans[i] = packed;
    }
    needs[source.first_run + id.x] = need;
}
