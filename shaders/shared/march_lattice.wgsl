// March with a gathered lattice: its field is evaluated in each sheet that march closes, and in the
// sheets between.

@group(0) @binding(10) var<storage, read> visibility: array<u32>;

// The field of the sheets before this one is drawn already.
var<private> next_field: u32;
// The plane of pixels[r].fields[0].behind, and the current tile.
var<private> held_plane: u32;
var<private> current_tile: u32;

fn begin_field(tile: u32) {
    current_tile = tile;
    held_plane = 0u;
    next_field = max(atomicLoad(&progress[next_of(tile)]), 1u);
}

// Records how far the field is drawn, so that later dispatches do not draw it again.
fn end_field(tile: u32) {
    atomicStore(&progress[next_of(tile)], next_field);
}

// Evaluates the field on the planes of a sheet.
fn evaluate_sheet(sheet: u32) {
    var plane = select(sheet, sheet + 1u, held_plane == sheet);
    loop {
        for (var r = 0u; r < ROWS; r++) {
            pixels[r].fields[0].front = pixels[r].fields[0].behind;
            pixels[r].fields[0].behind = face_at(r, plane);
        }
        plane++;
        if plane > sheet + 1u {
            break;
        }
    }
    held_plane = sheet + 1u;
}

// Draws the visible sheets of the field before `end`. Returns their number.
fn pass_field_before(end: u32) -> u32 {
    var count = 0u;
    var sheet = next_marked(current_tile, next_field, end);
    loop {
        if sheet >= end {
            break;
        }
        evaluate_sheet(sheet);
        for (var r = 0u; r < ROWS; r++) {
            composite_field(r, sheet);
        }
        count++;
        sheet = next_marked(current_tile, sheet + 1u, end);
    }
    next_field = max(next_field, end);
    return count;
}

// Called once for each sheet, front to back, before its sums are resolved.
fn open_field(sheet: u32) -> u32 {
    if sheet < next_field {
        return 0u;
    }
    let count = pass_field_before(sheet);
    if next_marked(current_tile, sheet, sheet + 1u) == sheet {
        evaluate_sheet(sheet);
    }
    next_field = sheet + 1u;
    return count;
}

fn shows_field(r: u32, sheet: u32) -> bool {
    return held_plane == sheet + 1u && may_show(r, sheet);
}
