// March: one workgroup per tile processes the tile's entries front to back. Four sheets are open at
// once, one in each lane of a vec4; an entry adds its splat's sections to all four (kernels.wgsl).
// When the next entry lies behind a sheet, that sheet is closed (sheet.wgsl): its field is
// classified and shaded, its optical depth composited, and its lane shifted out. Nothing is sorted
// by depth, unless every splat is composited on its own.
//
// A window of four sheets from sheet k contains the planes k+1, k+2 and k+3, and adds everything
// behind the last of them to the fourth lane. A longer splat gets its next window three sheets
// further on. There, the first lane takes back the excess of the previous window. So each entry
// evaluates three planes, however long its splat is.
//
// A tile with very many entries stops among them and continues in another dispatch, because some
// drivers silently end long loops (see docs/engine.md). Its sums are saved meanwhile (saved.wgsl).
//
// An invocation has ROWS pixels, one below the other, which share the loads of an entry. On a GPU
// the whole tile shares them instead (STAGED): each of its 64 invocations loads one of the next 64
// entries into workgroup memory. So the tile waits for memory once for all of them (as the tiles of
// Kerbl et al. 2023 do).

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> planes: array<f32>;
@group(0) @binding(2) var<uniform> stage: Pass;
@group(0) @binding(3) var<storage, read> records: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> bins: array<u32>;
@group(0) @binding(5) var<storage, read> entries: array<u32>;
// Binding 6: the tables of tables.wgsl. Binding 7: premultiplied colour and opacity. Binding 8: the
// distance at which half of the light is absorbed, or the largest value. Both carry over from pass
// to pass. Behind the colours lie the slots of saved.wgsl.
@group(0) @binding(7) var<storage, read_write> colors: array<vec4<f32>>;
@group(0) @binding(8) var<storage, read_write> depths: array<f32>;
// See progress.wgsl.
@group(0) @binding(9) var<storage, read_write> progress: array<atomic<u32>>;

// The slopes of each field on the plane behind the sheet that is being closed, per pixel.
var<private> slopes: array<array<vec2<f32>, FIELDS>, ROWS>;
// The tile, and how far it is.
var<workgroup> begun: vec2<u32>;
// Whether an invocation of the tile stopped, and the tile's slot then.
var<workgroup> any_stopped: atomic<u32>;
var<workgroup> tile_slot: u32;

// The slot of a tile that did not stop.
const NOT_STOPPED: u32 = NO_SLOT - 1u;

@compute @workgroup_size(8, LANE_ROWS)
fn march(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) lane: vec3<u32>) {
    // One invocation asks for all, because browsers accept barriers only where the answers are
    // alike. It is also the only one that changes the tile's progress.
    let is_first = all(lane.xy == vec2(0u));
    if is_first {
        let tile_count = atomicLoad(&progress[progress_word(LISTED)]);
        let number = dealt(group_number(group), tile_count);
        begun = vec2(0u, FINISHED);
        if number < tile_count {
            let listed = atomicLoad(&progress[listed_tile(number)]);
            begun = vec2(listed, atomicLoad(&progress[listed]));
        }
        // Workgroup memory may hold anything at first.
        if CAN_STOP {
            atomicStore(&any_stopped, 0u);
        }
        begin_loads();
    }
    let found = workgroupUniformLoad(&begun);
    let tile = found.x;
    let resumed = found.y;
    if resumed == FINISHED {
        return;
    }
    let column = tile % frame.tiles.x;
    let row = tile / frame.tiles.x;
    begin_field(tile);
    // All lanes must read how far the field is before one of them changes it.
    storageBarrier();
    if is_first {
        atomicStore(&progress[tile], FINISHED);
    }
    let corner = vec2<i32>(vec2(column, row)) * TILE_STEP - APRON;
    let first_pixel = corner + vec2<i32>(i32(lane.x), i32(lane.y * ROWS));
    for (var r = 0u; r < ROWS; r++) {
        let at = first_pixel + vec2(0, i32(r));
        if all(at >= vec2(0)) && all(at < vec2<i32>(frame.size)) {
            load_pixel(r, u32(at.y) * frame.size.x + u32(at.x));
        } else {
            pixels[r].transmittance = select(0.0, 1.0, CENTRAL);
        }
        aim(r, at);
    }

    let tile_bins = ((row - stage.first_row) * frame.tiles.x + column) * stage.groups;
    let end = bin_end(tile_bins + stage.groups - 1u);
    var bin = tile_bins;
    var at = 0u;
    if bin > 0u {
        at = bin_end(bin - 1u);
    }
    // The tile's entries from `first` on are in workgroup memory up to `loaded`.
    var first = at;
    var loaded = end;
    var turn = 0u;
    var front = stage.first_sheet - 1u;
    // Number of sheets, from `front` on, that may have sums.
    var open = 0u;
    if CAN_STOP && resumed > 0u {
        let walk = restore(resumed - 1u, lane.xy);
        at = walk.x;
        bin = walk.y;
        front = walk.z;
        open = walk.w;
    }
    var group_end = bin_end(bin);
    var entries_left = MOST_ENTRIES;
    var stopped = false;
    loop {
        if STAGED {
            if first >= end {
                break;
            }
            // Lanes that are opaque have no entries left.
            let lights = load_entries(first, end, tile_bins, lane.y * 8u + lane.x, at < end, turn);
            if !lights {
                break;
            }
            loaded = min(first + STAGED_ENTRIES, end);
            turn = 1u - turn;
        }
        loop {
            if at >= loaded {
                break;
            }
            if CAN_STOP && entries_left == 0u {
                stopped = true;
                break;
            }
            if STAGED {
                bin = staged_bin(at);
                group_end = staged_end(at);
            } else {
                while group_end <= at {
                    bin++;
                    group_end = bin_end(bin);
                }
            }
            let entry_sheet = entry_at(at) >> ENTRY_SHEET_SHIFT;
            let sheet = sheet_of(entry_at(at), bin - tile_bins);
            if open > 0u {
                let closed = min(sheet - front, open);
                let sheets = closed + close(front, closed, lane.xy);
                entries_left -= min(entries_left, sheets * CLOSING_ENTRIES);
                open -= closed;
            }
            front = sheet;
            // With differences between pixels, all lanes must reach every barrier.
            if !CENTRAL && !BACK_TO_FRONT {
                var light = 0.0;
                for (var r = 0u; r < ROWS; r++) {
                    light = max(light, pixels[r].transmittance);
                }
                if light < OPAQUE {
                    at = end;
                    break;
                }
            }
            // On a GPU, MOST_ENTRIES is the largest u32: clamped before it is added, or the sum
            // wraps.
            let stop =
                min(min(group_end, loaded), at + clamp(entries_left, 1u, end - at));
            // One call for each field, so that the field's number is a constant in the code that
            // adds to it. Fields may alternate within a sheet; the next iterations add the rest.
            at = add_entries(0u, at, stop, entry_sheet, front, first_pixel, &entries_left);
            if FIELDS > 1u {
                at = add_entries(1u, at, stop, entry_sheet, front, first_pixel, &entries_left);
            }
            if FIELDS > 2u {
                at = add_entries(2u, at, stop, entry_sheet, front, first_pixel, &entries_left);
            }
            if FIELDS > 3u {
                at = add_entries(3u, at, stop, entry_sheet, front, first_pixel, &entries_left);
            }
            if FIELDS > 4u {
                at = add_entries(4u, at, stop, entry_sheet, front, first_pixel, &entries_left);
            }
            if FIELDS > 5u {
                at = add_entries(5u, at, stop, entry_sheet, front, first_pixel, &entries_left);
            }
            if FIELDS > 6u {
                at = add_entries(6u, at, stop, entry_sheet, front, first_pixel, &entries_left);
            }
            if FIELDS > 7u {
                at = add_entries(7u, at, stop, entry_sheet, front, first_pixel, &entries_left);
            }
            open = 4u;
        }
        if !STAGED {
            break;
        }
        first = loaded;
    }
    if !stopped {
        // Sheets behind the pass's last one belong to the next pass.
        close(front, min(open, stage.end_sheet - front), lane.xy);
        open = 0u;
        if GATHER {
            pass_field_before(stage.end_sheet);
        }
    }
    var tells = is_first;
    if CAN_STOP {
        if stopped {
            atomicStore(&any_stopped, 1u);
        }
        workgroupBarrier();
        if is_first {
            tile_slot = slot_after(tile, resumed);
        }
        let slot = workgroupUniformLoad(&tile_slot);
        if slot == NO_SLOT {
            // The tile starts again, from the pixels stored in the picture.
            return;
        }
        if slot != NOT_STOPPED {
            save(slot, lane.xy, vec4(at, bin, front, open));
            // The others are opaque, and see no more of the field.
            tells = stopped;
        }
    }
    if tells {
        end_field(tile);
    }
    for (var r = 0u; r < ROWS; r++) {
        let place = vec2<i32>(lane.xy) + vec2(0, i32(lane.y * (ROWS - 1u) + r));
        let pixel = first_pixel + vec2(0, i32(r));
        if all(place >= vec2(APRON)) && all(place < vec2(8 - APRON))
            && all(pixel < vec2<i32>(frame.size)) {
            store_pixel(r, u32(pixel.y) * frame.size.x + u32(pixel.x));
        }
    }
}

// Returns the slot of a tile, if an invocation stopped, and notes that the tile is not finished.
// Otherwise its slot is free again.
fn slot_after(tile: u32, resumed: u32) -> u32 {
    if atomicLoad(&any_stopped) == 0u {
        if resumed > 0u {
            free_slot(resumed - 1u);
        }
        return NOT_STOPPED;
    }
    var slot = resumed - 1u;
    if resumed == 0u {
        slot = claim_slot();
    }
    atomicStore(&progress[tile], slot + 1u);
    atomicStore(&progress[progress_word(UNFINISHED)], 1u);
    atomicAdd(&progress[progress_word(STOPS)], select(1u, 0u, slot == NO_SLOT));
    return slot;
}

// Adds the entries from `first` on that lie in sheet `entry_sheet` and belong to field `f`.
// Radiance belongs to field 0. Returns the index of the first entry that was not added.
fn add_entries(
    f: u32,
    first: u32,
    stop: u32,
    entry_sheet: u32,
    front: u32,
    first_pixel: vec2<i32>,
    entries_left: ptr<function, u32>,
) -> u32 {
    var at = first;
    if FIELDS > 1u && !(at < stop && is_of(entry_at(at), f, entry_sheet)) {
        return at;
    }
    loop {
        let entry = entry_at(at);
        var taken = 1u;
        if ISOTROPIC_RECORDS && (!GENERAL_RECORDS || (entry & ENTRY_ISOTROPIC) != 0u) {
            for (var i = 1u; i < TOGETHER; i++) {
                if taken == i && at + i < stop && is_alike(entry_at(at + i), entry) {
                    taken++;
                }
            }
            add_isotropic(f, at, taken, front, first_pixel);
        } else if HAS_FACETS && (entry & ENTRY_COARSE) != 0u {
            add_facet(at, front, first_pixel);
        } else if GENERAL_RECORDS {
            add_general(f, at, front, first_pixel);
        }
        at += taken;
        *entries_left -= min(*entries_left, 1u + image_entries());
        if at >= stop || !is_of(entry_at(at), f, entry_sheet) {
            break;
        }
        if CAN_STOP && HAS_IMAGES && *entries_left == 0u {
            break;
        }
    }
    return at;
}

// Whether an entry lies in a sheet and belongs to a field.
fn is_of(entry: u32, f: u32, entry_sheet: u32) -> bool {
    return (entry >> ENTRY_SHEET_SHIFT) == entry_sheet && field_of(entry) == f;
}

// Whether two entries of a group have the same sheet, the same field and the same kind of record.
fn is_alike(a: u32, b: u32) -> bool {
    let same = ((a ^ b) >> ENTRY_SHEET_SHIFT) == 0u
        && field_of(a) == field_of(b);
    return same && (!GENERAL_RECORDS || ((a ^ b) & ENTRY_ISOTROPIC) == 0u);
}

// Returns the sheet of an entry in a group of sheets.
fn sheet_of(entry: u32, group: u32) -> u32 {
    return stage.first_sheet - 1u + (group << stage.group_shift) + (entry >> ENTRY_SHEET_SHIFT);
}

fn bin_end(bin: u32) -> u32 {
    return min(bins[bin], frame.entry_capacity);
}

// Closes `count` sheets from `front` on. Returns the number of sheets in front of and between them
// that contain only a gathered field.
fn close(front: u32, count: u32, lane: vec2<u32>) -> u32 {
    if SINGLE_SPLATS {
        return 0u;
    }
    if count == 0u {
        return 0u;
    }
    var others = 0u;
    // The condition is at the end, because a driver that only masks inactive lanes (Mesa's software
    // Vulkan) runs a loop with its condition at the beginning once more than necessary.
    var sheet = front;
    loop {
        if CENTRAL {
            find_slopes(lane);
        }
        others += open_field(sheet);
        for (var r = 0u; r < ROWS; r++) {
            var mixture = resolve_radiance(r, sheet);
            if SCALAR {
                for (var f = 0u; f < FIELDS; f++) {
                    close_field(r, f, sheet, &mixture);
                }
            }
            composite(r, sheet, mixture);
            if HAS_FACETS {
                cover(r, sheet);
            }
        }
        sheet++;
        if sheet >= front + count {
            break;
        }
    }
    return others;
}

fn close_field(r: u32, f: u32, sheet: u32, mixture: ptr<function, Mixture>) {
    var field: Sheet;
    resolve_field(r, f, sheet, &field);
    if CENTRAL {
        field.back.slope = slope_on_plane(r, f, slopes[r][f], planes[sheet + 1u]);
    }
    if SUMS {
        pixels[r].fields[f].front = field.back;
    }
    mix_field(r, f, sheet, field, mixture);
}

// Composites one splat, without sheets, in front of or behind the pixels so far.
fn composite_single(r: u32, depth: f32, splat: Loaded) {
    var color = splat.color;
    if SURFACE_SHADED && any(splat.normal != vec3(0.0)) {
        // Other lights than that from the eye need sheets.
        color = lit(r, color, splat.normal, 0.0);
    }
    let left = exp(-depth);
    let before = pixels[r].transmittance;
    if BACK_TO_FRONT {
        pixels[r].color = pixels[r].color * left + (1.0 - left) * color;
    } else {
        pixels[r].color += before * (1.0 - left) * color;
    }
    pixels[r].transmittance = before * left;
    // Back to front, the absorption of the splats in front is not known yet. There, the nearest
    // splat that absorbs half of the light by itself counts.
    if select(before > 0.5 && before * left <= 0.5, left <= 0.5, BACK_TO_FRONT) {
        pixels[r].hit = splat.distance;
    }
}
