// Occlusion: finds the opaque tiles of the picture and sums them in a summed-area table. With it,
// four corners show whether a rectangle of tiles is opaque. Runs between depth passes.

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> colors: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> progress: array<u32>;
@group(0) @binding(3) var<storage, read_write> map: array<u32>;

// A tile is opaque if march would not read another entry for any of its pixels. Only tiles that the
// pass has drawn in may have become opaque.
@compute @workgroup_size(64)
fn find_opaque(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let number = id.x + id.y * groups.x * 64u;
    if number >= progress[progress_word(LISTED)] {
        return;
    }
    let index = progress[listed_tile(number)];
    let tile = vec2(index % frame.tiles.x, index / frame.tiles.x);
    let first = tile * u32(TILE_STEP);
    let end = min(first + u32(TILE_STEP), frame.size);
    var least = 1.0;
    for (var y = first.y; y < end.y; y++) {
        for (var x = first.x; x < end.x; x++) {
            least = min(least, colors[y * frame.size.x + x].w);
        }
    }
    map[flag_index(tile.x, tile.y)] = u32(1.0 - least < OPAQUE);
}

@compute @workgroup_size(64)
fn sum_rows(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= frame.tiles.y {
        return;
    }
    var sum = 0u;
    for (var column = 0u; column < frame.tiles.x; column++) {
        sum += map[flag_index(column, id.x)];
        map[map_index(column + 1u, id.x + 1u)] = sum;
    }
}

@compute @workgroup_size(64)
fn sum_columns(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= frame.tiles.x {
        return;
    }
    var sum = 0u;
    for (var row = 1u; row <= frame.tiles.y; row++) {
        let at = map_index(id.x + 1u, row);
        sum += map[at];
        map[at] = sum;
    }
}
