// Slopes of fields from differences between neighbouring pixels of a tile.

// Values of each field on the plane behind the sheet that is being closed.
var<workgroup> neighbours: array<array<f32, 64>, FIELDS>;

// Finds the slopes on the plane behind the sheet being closed, from the values of the tile's
// neighbouring pixels. Both barriers are here, and the sheet is closed behind them: with a barrier
// behind the code that closes it, Mesa's software Vulkan loses the slopes once that code is long.
fn find_slopes(lane: vec2<u32>) {
    for (var r = 0u; r < ROWS; r++) {
        let at = (lane.y * ROWS + r) * 8u + lane.x;
        for (var f = 0u; f < FIELDS; f++) {
            let weight = pixels[r].fields[f].face_weight.x;
            neighbours[f][at] = select(
                NO_VALUE,
                pixels[r].fields[f].face_value.x / max(weight, 1e-37),
                weight > frame.fields[f].isotropic.w,
            );
        }
    }
    workgroupBarrier();
    for (var r = 0u; r < ROWS; r++) {
        for (var f = 0u; f < FIELDS; f++) {
            slopes[r][f] = difference(lane, r, f);
        }
    }
    workgroupBarrier();
}

// Returns the slopes of a field's values around a pixel: central differences, one-sided if a
// neighbour has no value.
fn difference(lane: vec2<u32>, r: u32, f: u32) -> vec2<f32> {
    let y = lane.y * ROWS + r;
    let middle = neighbours[f][y * 8u + lane.x];
    let before = vec2(
        neighbours[f][y * 8u + max(lane.x, 1u) - 1u],
        neighbours[f][(max(y, 1u) - 1u) * 8u + lane.x],
    );
    let after = vec2(
        neighbours[f][y * 8u + min(lane.x + 1u, 7u)],
        neighbours[f][min(y + 1u, 7u) * 8u + lane.x],
    );
    let has_before = before > vec2(NO_VALUE);
    let has_after = after > vec2(NO_VALUE);
    let span = vec2<f32>(vec2<u32>(has_before) + vec2<u32>(has_after));
    return (select(vec2(middle), after, has_after) - select(vec2(middle), before, has_before))
        / max(span, vec2(1.0));
}
