// Mark: finds the sheets of each tile in which a gathered lattice may be visible. An invocation
// looks at eight sheets of one tile. What the tile sees of a sheet lies in a box of samples. If
// something may be visible in any block of that box, the sheet is marked. Four invocations find a
// word.

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> planes: array<f32>;
// See field_lattice.wgsl.
@group(0) @binding(2) var<storage, read_write> visibility: array<u32>;
@group(0) @binding(3) var<storage, read_write> progress: array<atomic<u32>>;

// Rounding of places, in steps of the lattice.
const SLACK: f32 = 0.01;
// A box of more blocks counts as visible.
const MOST_BLOCKS: u32 = 512u;

// What a tile sees: the rays through its corners, in steps of the lattice.
struct Beam {
    starts: mat4x3<f32>,
    directions: mat4x3<f32>,
    // The smallest cosine between the ray of a corner and the middle ray. A sheet ends at one
    // distance from the eye, so it bulges out between the corners: by one over this at most.
    bulge: f32,
}

fn in_steps(v: vec3<f32>) -> vec3<f32> {
    let field = &frame.fields[0];
    return vec3(
        dot((*field).axis_x.xyz, v),
        dot((*field).axis_y.xyz, v),
        dot((*field).axis_z.xyz, v),
    );
}

// Returns the direction to a place of the picture, of unit length (perspective).
fn toward(place: vec2<f32>) -> vec3<f32> {
    return normalize(vec3((place - frame.center) / frame.scale, 1.0));
}

fn beam_of(tile: u32) -> Beam {
    let first = 8.0 * vec2<f32>(vec2(tile % frame.tiles.x, tile / frame.tiles.x));
    let origin = frame.fields[0].origin.xyz;
    let middle = toward(first + 4.0);
    var beam: Beam;
    beam.bulge = 1.0;
    for (var corner = 0u; corner < 4u; corner++) {
        let place = first + 8.0 * vec2<f32>(vec2(corner % 2u, corner / 2u));
        if frame.perspective != 0u {
            let direction = toward(place);
            beam.starts[corner] = origin;
            beam.directions[corner] = in_steps(direction);
            beam.bulge = min(beam.bulge, dot(direction, middle));
        } else {
            let start = vec3((place - frame.center) / frame.scale, 0.0);
            beam.starts[corner] = origin + in_steps(start);
            beam.directions[corner] = in_steps(vec3(0.0, 0.0, 1.0));
        }
    }
    return beam;
}

// Whether something may be visible between two distances.
fn may_show(beam: Beam, near: f32, far: f32) -> bool {
    var low = vec3(3e38);
    var high = vec3(-3e38);
    for (var corner = 0u; corner < 4u; corner++) {
        let a = beam.starts[corner] + beam.directions[corner] * near;
        let b = beam.starts[corner] + beam.directions[corner] * (far / max(beam.bulge, 1e-3));
        low = min(low, min(a, b));
        high = max(high, max(a, b));
    }
    let dims = vec3<f32>(frame.fields[0].lattice.xyz);
    low = floor(low + (0.5 - SLACK));
    high = floor(high + (0.5 + SLACK));
    if any(high < vec3(0.0)) || any(low >= dims) {
        return false;
    }
    let first = vec3<u32>(clamp(low, vec3(0.0), dims - 1.0)) / 4u;
    let last = vec3<u32>(clamp(high, vec3(0.0), dims - 1.0)) / 4u;
    let size = last - first + 1u;
    if size.x * size.y * size.z > MOST_BLOCKS {
        return true;
    }
    let blocks = (frame.fields[0].lattice.xyz + 3u) / 4u;
    for (var z = first.z; z <= last.z; z++) {
        for (var y = first.y; y <= last.y; y++) {
            for (var x = first.x; x <= last.x; x++) {
                let block = 2u * ((z * blocks.y + y) * blocks.x + x);
                if (visibility[block] | visibility[block + 1u]) != 0u {
                    return true;
                }
            }
        }
    }
    return false;
}

var<workgroup> parts: array<u32, 64>;

@compute @workgroup_size(64)
fn mark(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let words = frame.fields[0].visibility.z;
    let number = number_of(id) / 4u;
    let first = (number % words) * 32u + 8u * (lane % 4u);
    var bits = 0u;
    if number < frame.tiles.x * frame.tiles.y * words {
        let beam = beam_of(number / words);
        for (var bit = 0u; bit < 8u; bit++) {
            let sheet = first + bit;
            if sheet >= 1u && sheet <= frame.sheet_count {
                bits |= u32(may_show(beam, planes[sheet], planes[sheet + 1u])) << bit;
            }
        }
    }
    parts[lane] = bits;
    workgroupBarrier();
    if lane % 4u != 0u || number >= frame.tiles.x * frame.tiles.y * words {
        return;
    }
    let word = bits | (parts[lane + 1u] << 8u) | (parts[lane + 2u] << 16u)
        | (parts[lane + 3u] << 24u);
    visibility[frame.fields[0].visibility.y + number] = word;
    if word != 0u {
        atomicAdd(&progress[marked_word()], countOneBits(word));
    }
}
