// Gather: draws the field of a lattice without splats. Each pixel follows its own ray through the
// sheets, front to back, and evaluates the field on the planes between them. It runs after the
// passes that scatter the splats of other items, and draws the rest of each tile that march has not
// drawn. A dispatch draws the sheets of `stage`, in all `stage.groups` tiles.

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> planes: array<f32>;
@group(0) @binding(2) var<uniform> stage: Pass;
@group(0) @binding(3) var<storage, read> visibility: array<u32>;
@group(0) @binding(4) var<storage, read_write> progress: array<atomic<u32>>;
@group(0) @binding(5) var<storage, read_write> depths: array<f32>;
// Binding 6: the tables of tables.wgsl.
@group(0) @binding(7) var<storage, read_write> colors: array<vec4<f32>>;

// Returns the next sheet in which something may be visible at a pixel, or at least in its tile.
fn next_sheet(tile: u32, sheet: u32, end: u32) -> u32 {
    var next = sheet;
    loop {
        next = next_marked(tile, next, end);
        if next >= end || !ASKS_FIRST || may_show(0u, next) {
            break;
        }
        next++;
    }
    return next;
}

// Only visible sheets are resolved.
fn shows_field(r: u32, sheet: u32) -> bool {
    return true;
}

@compute @workgroup_size(8, 8)
fn gather(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) lane: vec3<u32>) {
    let number = dealt(group_number(group), stage.groups);
    if number >= stage.groups {
        return;
    }
    if all(lane.xy == vec2(0u)) {
        atomicAdd(&progress[gathered_word()], 1u);
    }
    let tile = number;
    if next_marked(tile, stage.first_sheet, stage.end_sheet) >= stage.end_sheet {
        return;
    }
    let pixel = vec2(tile % frame.tiles.x, tile / frame.tiles.x) * 8u + lane.xy;
    if any(pixel >= frame.size) {
        return;
    }
    let index = pixel.y * frame.size.x + pixel.x;
    load_pixel(0u, index);
    aim(0u, vec2<i32>(pixel));
    var end = stage.end_sheet;
    if !MAXIMUM && pixels[0].transmittance < OPAQUE {
        end = 0u;
    }
    var sheet = max(stage.first_sheet, atomicLoad(&progress[next_of(tile)]));
    sheet = next_sheet(tile, sheet, end);
    // The plane that was evaluated last.
    var plane = 0u;
    // Evaluate one plane per iteration, whatever happens to the sheet in front of it. With a
    // separate loop that searches for the next visible sheet, pixels that share a vector of the
    // processor would wait for each other.
    if sheet < end {
        loop {
            let next = select(sheet, sheet + 1u, plane == sheet);
            pixels[0].fields[0].front = pixels[0].fields[0].behind;
            pixels[0].fields[0].behind = face_at(0u, next);
            plane = next;
            if plane > sheet {
                if MAXIMUM || range_shows(sheet) {
                    composite_field(0u, sheet);
                }
                if !MAXIMUM && pixels[0].transmittance < OPAQUE {
                    end = 0u;
                }
                sheet = next_sheet(tile, sheet + 1u, end);
            }
            if sheet >= end {
                break;
            }
        }
    }
    store_pixel(0u, index);
}
