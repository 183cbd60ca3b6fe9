// Spans: the tiles and sheets that a candidate or a batch of candidates meets, as two corners of a
// box, 32 bits each.

// Packs a corner: sheet (12 bits), column and row of a tile (10 bits each, in units of 2^tile_shift
// tiles).
fn pack_corner(sheet: u32, tile: vec2<u32>) -> u32 {
    let place = tile >> vec2(frame.tile_shift);
    return sheet | (place.x << 12u) | (place.y << 22u);
}

fn sheet_of_corner(corner: u32) -> u32 {
    return corner & 0xfffu;
}

fn tile_of_corner(corner: u32) -> vec2<u32> {
    return vec2((corner >> 12u) & 0x3ffu, corner >> 22u);
}

// Meets nothing; joined with another span, the result is the other span.
const NO_SPAN: vec2<u32> = vec2(0xffffffffu, 0u);

// Returns the span around two spans.
fn join(a: vec2<u32>, b: vec2<u32>) -> vec2<u32> {
    let low = min(tile_of_corner(a.x), tile_of_corner(b.x));
    let high = max(tile_of_corner(a.y), tile_of_corner(b.y));
    return vec2(
        min(sheet_of_corner(a.x), sheet_of_corner(b.x)) | (low.x << 12u) | (low.y << 22u),
        max(sheet_of_corner(a.y), sheet_of_corner(b.y)) | (high.x << 12u) | (high.y << 22u),
    );
}

// Returns the tiles of a span: first column and row, and those behind the last.
fn tiles_of(span: vec2<u32>) -> vec4<u32> {
    let shift = vec2(frame.tile_shift);
    let end = (tile_of_corner(span.y) + 1u) << shift;
    return vec4(tile_of_corner(span.x) << shift, min(end, frame.tiles));
}

fn in_pass(span: vec2<u32>, stage: Pass) -> bool {
    let tiles = tiles_of(span);
    return sheet_of_corner(span.x) < stage.end_sheet && sheet_of_corner(span.y) >= stage.first_sheet
        && tiles.y < stage.end_row && tiles.w > stage.first_row;
}
