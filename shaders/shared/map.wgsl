// The map of opaque tiles so far, made by occlusion.wgsl: a summed-area table (Crow 1984) of the
// opaque tiles, with a row and a column of zeros in front. Behind it comes a flag for each tile:
// whether it is opaque.

fn map_index(column: u32, row: u32) -> u32 {
    return row * (frame.tiles.x + 1u) + column;
}

fn flag_index(column: u32, row: u32) -> u32 {
    return (frame.tiles.x + 1u) * (frame.tiles.y + 1u) + row * frame.tiles.x + column;
}
