// Survey: the entries and records by sheet and by band of the picture. Runs in earnest only when a frame does not fit in
// one pass; plan.wgsl cuts the frame into passes by it.

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> planes: array<f32>;
@group(0) @binding(2) var<storage, read> spans: array<u32>;
@group(0) @binding(3) var<storage, read> totals: Totals;
@group(0) @binding(4) var<storage, read_write> census: array<atomic<u32>>;

fn add(sheet: u32, band: u32, what: u32, amount: u32) {
    atomicAdd(&census[census_index(sheet, band) + what], amount);
}

@compute @workgroup_size(64)
fn survey(@builtin(global_invocation_id) id: vec3<u32>) {
    let start = id.x * RUN;
    let count = candidate_count();
    if start >= count || fits(totals) {
        return;
    }
    let words = select(4u, 1u, (source.flags & ISOTROPIC) != 0u);
    for (var i = start; i < min(start + RUN, count); i++) {
        if spans[i] == NO_SPAN {
            continue;
        }
        let splat = candidate(i);
        let span = locate(splat.center, splat.covariance, splat.extent);
        let across = span.last_tile.x - span.first_tile.x + 1u;
        for (var band = band_of(span.first_tile.y); band <= band_of(span.last_tile.y); band++) {
            let first_row = max(span.first_tile.y, band_start(band));
            let end_row = min(span.last_tile.y + 1u, band_start(band + 1u));
            let tiles = across * (end_row - first_row);
            add(span.first_sheet, band, FIRST_TILES, tiles);
            add(span.last_sheet, band, LAST_TILES, tiles);
            add(span.first_sheet, band, FIRST_WORDS, words);
            add(span.last_sheet, band, LAST_WORDS, words);
            let windows = window_count(span.first_sheet, span.last_sheet);
            for (var window = 0u; window < windows; window++) {
                add(span.first_sheet + 3u * window, band, WINDOW_TILES, tiles);
            }
        }
    }
}
