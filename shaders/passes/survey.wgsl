// Survey: counts the needs of batches of candidates, by sheet and by band of the picture. plan.wgsl
// divides the frame into passes by these counts.

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> run_spans: array<vec2<u32>>;
@group(0) @binding(2) var<storage, read> needs: array<vec2<u32>>;
@group(0) @binding(3) var<uniform> run_count: vec4<u32>;
@group(0) @binding(4) var<storage, read_write> census: array<atomic<u32>>;

fn add(sheet: u32, band: u32, what: u32, need: vec2<u32>) {
    let at = census_index(sheet, band) + what;
    let before = atomicAdd(&census[at], need.x);
    if before > 0xffffffffu - need.x {
        atomicAdd(&census[at + 1u], 1u);
    }
    atomicAdd(&census[at + 2u], need.y);
}

@compute @workgroup_size(64)
fn survey(@builtin(global_invocation_id) id: vec3<u32>) {
    let number = number_of(id);
    if number >= run_count.x {
        return;
    }
    let packed = needs[number];
    if packed.y == 0u {
        return;
    }
    let need = vec2(packed.x, packed.y & (ONE_SPLAT - 1u));
    let span = run_spans[number];
    let first = sheet_of_corner(span.x);
    let last = sheet_of_corner(span.y);
    let tiles = tiles_of(span);
    let last_band = band_of(tiles.w - 1u);
    for (var band = band_of(tiles.y); band <= last_band; band++) {
        add(first, band, STARTING, need);
        add(last, band, ENDING, need);
    }
    add(first, BANDS, STARTING, need);
    add(last, BANDS, ENDING, need);
}
