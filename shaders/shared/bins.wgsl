// The bins of a pass: one for each tile and group of sheets, tile by tile. Used by bin and large,
// so that counting and filling visit the same windows and tiles.

// The tiles and sheets of a record: first and last tile (column in the low 16 bits, row in the high
// ones), then first and last sheet. The top bits of the first tile mark an isotropic record, and
// one of the coarser of two levels, or a general record of a facet.
const BOX_ISOTROPIC: u32 = 0x80000000u;
const BOX_COARSE: u32 = 0x40000000u;
const BOX_MARKS: u32 = 0xc0000000u;
// The sheets of a place that begins no record.
const NO_BOX: u32 = 0xffffffffu;

struct Box {
    first_tile: u32,
    last_tile: u32,
    sheets: u32,
}

struct Walk {
    first_column: u32,
    last_column: u32,
    first_row: u32,
    end_row: u32,
    // Windows of four sheets each, starting at every third sheet.
    first_window: u32,
    windows: u32,
}

// Returns the part of a box that lies in a pass. A splat that reaches in from sheets before the
// pass gets a window that starts one sheet early. That sheet receives the splat's mass up to the
// pass and is not drawn.
fn walk_of(box: Box, stage: Pass) -> Walk {
    // Two pipelines locate a splat, and rounding may put its first sheet on either side of the
    // pass's end.
    let first = clamp(box.sheets & 0xffffu, stage.first_sheet - 1u, stage.end_sheet);
    let last = min(box.sheets >> 16u, stage.end_sheet);
    return Walk(
        box.first_tile & 0xffffu,
        box.last_tile & 0xffffu,
        max((box.first_tile & ~BOX_MARKS) >> 16u, stage.first_row),
        min((box.last_tile >> 16u) + 1u, stage.end_row),
        first,
        window_count(first, last),
    );
}

fn bin_of(column: u32, row: u32, window: u32, stage: Pass) -> u32 {
    let tile = (row - stage.first_row) * frame.tiles.x + column;
    return tile * stage.groups + ((window - (stage.first_sheet - 1u)) >> stage.group_shift);
}

// Returns the number of windows of four sheets from a first to a last sheet. Each window starts
// three sheets after the one before (see march.wgsl).
fn window_count(first: u32, last: u32) -> u32 {
    return max((last - min(first, last) + 2u) / 3u, 1u);
}

// Returns the number of bins that a splat meets.
fn bin_count(walk: Walk) -> u32 {
    if walk.first_row >= walk.end_row {
        return 0u;
    }
    return (walk.last_column - walk.first_column + 1u) * (walk.end_row - walk.first_row)
        * walk.windows;
}

// Splats that meet more bins than this are left to large.wgsl. That balances the work. It also
// keeps every invocation's loops short, because some drivers silently end long loops (see
// docs/engine.md).
const LARGE: u32 = 512u;

fn is_large(walk: Walk) -> bool {
    return bin_count(walk) > LARGE;
}

// Returns the entry of a record's window.
fn entry_of(box: Box, record: u32, walk: Walk, window: u32, stage: Pass) -> u32 {
    let sheet = walk.first_window + 3u * window - (stage.first_sheet - 1u);
    let in_group = sheet & ((1u << stage.group_shift) - 1u);
    let continued = select(0u, ENTRY_CONTINUED, window > 0u);
    let isotropic = select(0u, ENTRY_ISOTROPIC, (box.first_tile & BOX_ISOTROPIC) != 0u);
    let coarse = select(0u, ENTRY_COARSE, (box.first_tile & BOX_COARSE) != 0u);
    return (in_group << ENTRY_SHEET_SHIFT) | continued | isotropic | coarse | record;
}
