// March: one workgroup per tile walks the tile's entries front to back. Four sheets are open at once, one in each lane of
// a vec4; an entry adds its splat's sections to all four. When the walk passes a sheet, the sheet is closed: its density
// is classified and shaded, its optical depth composited, and its lane shifted out. Nothing is sorted by depth.
//
// A window of four sheets from sheet k sees the planes k+1, k+2 and k+3 inside it, and gives what lies behind the last of
// them to the fourth lane. A splat that is longer gets its next window three sheets on: there, the first lane takes back
// what the window before gave it too much. So each entry evaluates three planes, however long its splat is.
//
// A tile with very many entries stops between two sheets and goes on in another dispatch, because some drivers end long
// loops without a word (see docs/engine.md). It then collects again what reaches into the sheets to come from before.
//
// An invocation holds ROWS pixels, one below the other, so that they share the loads of an entry.

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> planes: array<f32>;
@group(0) @binding(2) var<uniform> stage: Pass;
@group(0) @binding(3) var<storage, read> records: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> bins: array<u32>;
@group(0) @binding(5) var<storage, read> entries: array<u32>;
// Colour and extinction per value.
@group(0) @binding(6) var<storage, read> transfer: array<vec4<f32>>;
// Premultiplied colour and opacity; view-space depth. Both carry over from pass to pass.
@group(0) @binding(7) var<storage, read_write> colors: array<vec4<f32>>;
@group(0) @binding(8) var<storage, read_write> depths: array<f32>;
// For each tile the sheet that it goes on from; behind the tiles: whether any is unfinished, whether one can't be finished.
@group(0) @binding(9) var<storage, read_write> progress: array<atomic<u32>>;

// A pixel that lets less light through than this is finished.
const OPAQUE: f32 = 0.0005;
// A sheet that is filled less than this has no value, one with less optical depth no colour: such small sums may be what
// rounding left of the sections that windows of one splat give each other.
const LEAST_FILLING: f32 = 1e-4;
const LEAST_DEPTH: f32 = 1e-5;
// The progress of a tile that needs no more work.
const FINISHED: u32 = 0xffffffffu;
const SQRT_TAU: f32 = 2.5066283;

// Everything that one pixel keeps while its tile is walked.
struct Pixel {
    // Whole sums of the four open sheets: weights, weighted values, and their derivatives to the right and down.
    weight: vec4<f32>,
    value: vec4<f32>,
    weight_x: vec4<f32>,
    weight_y: vec4<f32>,
    value_x: vec4<f32>,
    value_y: vec4<f32>,
    // Optical depth; and colour and normal, weighted by how much of it faces the eye, with that weight.
    depth: vec4<f32>,
    facing: vec4<f32>,
    red: vec4<f32>,
    green: vec4<f32>,
    blue: vec4<f32>,
    normal_x: vec4<f32>,
    normal_y: vec4<f32>,
    normal_z: vec4<f32>,
    // The sheet closed last, which waits for the value behind it before it is shaded, and the value before it.
    waiting: Sheet,
    value_before: f32,
    has_before: bool,
    // The picture so far.
    color: vec3<f32>,
    transmittance: f32,
    hit: f32,
    // The ray: image-plane position, cosine to the optical axis, and the part of it inside the sampled box.
    ray: vec2<f32>,
    cosine: f32,
    inside: vec2<f32>,
}

// First sheet that this invocation composites: the pass's own, or where its tile stopped.
var<private> first_composited: u32;

// One sheet at one pixel.
struct Sheet {
    has_value: bool,
    value: f32,
    // Weight, for sets of scattered samples: how much of the sheet is filled.
    weight: f32,
    // Derivative of the value per pixel to the right and down.
    slope: vec2<f32>,
    // Radiance payload: colour times optical depth, and optical depth.
    radiance: vec4<f32>,
}

// An invocation's pixels, one below the other.
var<private> pixels: array<Pixel, ROWS>;

// Values of the sheet that is being closed, for differences between neighbouring pixels.
var<workgroup> neighbours: array<f32, 64>;
const NO_VALUE: f32 = 3e38;

// Normal distribution function, within 2e-7 (Abramowitz & Stegun 1964, 26.2.19). Its tails must be right: what they get
// wrong is multiplied by the strength of an opaque splat and lies in front of it.
fn normal_cdf(t: vec3<f32>) -> vec3<f32> {
    let x = min(abs(t), vec3(8.0));
    var p = 1.0 + x * (0.049867347 + x * (0.0211410061 + x * (0.00327762632 + x * (3.8003575e-05 + x * (4.88906356e-05 + x * (5.382975e-06))))));
    p *= p;
    p *= p;
    p *= p;
    p *= p;
    let tail = 0.5 / p;
    return select(tail, 1.0 - tail, t >= vec3(0.0));
}

// The four sections of a window, from the distribution function at its three inner planes.
fn sections(t: vec3<f32>, base: f32) -> vec4<f32> {
    let f = normal_cdf(t);
    return vec4(f.x - base, f.y - f.x, f.z - f.y, 1.0 - f.z);
}

fn table(value: f32) -> vec4<f32> {
    let at = clamp((value - frame.transfer.x) * frame.transfer.y, 0.0, frame.transfer.z);
    let low = u32(at);
    return mix(transfer[low], transfer[low + 1u], at - f32(low));
}

fn lit(color: vec3<f32>, normal: vec3<f32>, direction: vec3<f32>, shade: vec4<f32>) -> vec3<f32> {
    let size = length(normal);
    if !(size > 1e-20) {
        return color * (shade.x + shade.y);
    }
    let facing = min(abs(dot(normal, direction)) / size, 1.0);
    return min(color * (shade.x + shade.y * facing) + shade.z * pow(facing, shade.w), vec3(1.0));
}

fn direction_of(r: u32) -> vec3<f32> {
    if PERSPECTIVE {
        return vec3(pixels[r].ray, 1.0) * pixels[r].cosine;
    }
    return vec3(0.0, 0.0, 1.0);
}

// A view-space direction in steps of the lattice, in which its kernels are round.
fn in_steps(v: vec3<f32>) -> vec3<f32> {
    return vec3(dot(frame.field_axis_x.xyz, v), dot(frame.field_axis_y.xyz, v), dot(frame.field_axis_z.xyz, v));
}

// Gradient in view space from the slope across the picture and the derivative along the ray, at a distance.
fn gradient(r: u32, own_slope: vec2<f32>, along: f32, distance: f32) -> vec3<f32> {
    var slope = own_slope;
    let d = direction_of(r);
    if LATTICE && !ISOTROPIC_RECORDS && !CENTRAL {
        // The footprints' derivatives hold the sections fixed, so where steps are unequal or not at right angles they are
        // taken along a line that leans towards the ray; what that leaning picks up of the derivative along it goes back.
        var steps = mat2x3<f32>(vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0)) * (1.0 / frame.scale);
        if PERSPECTIVE {
            let size = distance * pixels[r].cosine;
            steps = mat2x3<f32>(size * (steps[0] - d * dot(d, steps[0])), size * (steps[1] - d * dot(d, steps[1])));
        }
        let ray = in_steps(d);
        slope += along / dot(ray, ray) * vec2(dot(in_steps(steps[0]), ray), dot(in_steps(steps[1]), ray));
    }
    if PERSPECTIVE {
        let g = slope * frame.scale / (pixels[r].cosine * distance) + along * d.xy;
        return vec3(g, (along - dot(g, d.xy)) / d.z);
    }
    return vec3(slope * frame.scale, along);
}

fn middle(sheet: u32) -> f32 {
    return 0.5 * (planes[sheet] + planes[sheet + 1u]);
}

// Adds a sheet to the picture. `has_after` and `after`: the value of the sheet behind it.
fn composite(r: u32, sheet: u32, own: Sheet, has_after: bool, after: f32) {
    if sheet < first_composited || sheet >= stage.end_sheet {
        return;
    }
    var premultiplied = own.radiance.xyz;
    var depth = own.radiance.w;
    if SCALAR && own.has_value {
        let shown = table(own.value);
        var length = max(min(planes[sheet + 1u], pixels[r].inside.y) - max(planes[sheet], pixels[r].inside.x), 0.0);
        if !LATTICE {
            length = min(planes[sheet + 1u] - planes[sheet], own.weight);
        }
        var color = shown.xyz;
        if VOLUME_SHADED {
            // One-sided where a neighbouring sheet has no value.
            let value_before = select(own.value, pixels[r].value_before, pixels[r].has_before);
            let value_after = select(own.value, after, has_after);
            let start = middle(sheet - u32(pixels[r].has_before));
            let stop = middle(sheet + u32(has_after));
            let along = select(0.0, (value_after - value_before) / (stop - start), stop > start);
            let normal = gradient(r, own.slope, along, middle(sheet));
            color = lit(color, normal, direction_of(r), frame.volume_shade);
        }
        let own_depth = shown.w * length;
        premultiplied += own_depth * color;
        depth += own_depth;
    }
    if depth > 0.0 {
        let through = pixels[r].transmittance;
        let left = through * exp(-depth);
        pixels[r].color += (through - left) / depth * premultiplied;
        if through > 0.5 && left <= 0.5 {
            let part = log(2.0 * through) / depth;
            pixels[r].hit = mix(planes[sheet], planes[sheet + 1u], part);
        }
        pixels[r].transmittance = left;
    }
}

fn shift(sums: vec4<f32>) -> vec4<f32> {
    return vec4(sums.yzw, 0.0);
}

// Resolves the front lane to a sheet and shifts it out.
fn resolve(r: u32, sheet: u32) -> Sheet {
    var own: Sheet;
    if SCALAR {
        let weight = pixels[r].weight.x;
        own.has_value = weight > LEAST_FILLING * (planes[sheet + 1u] - planes[sheet]);
        let inverse = 1.0 / max(weight, 1e-37);
        own.value = pixels[r].value.x * inverse;
        own.weight = weight;
        if VOLUME_SHADED && !CENTRAL {
            let weight_slope = vec2(pixels[r].weight_x.x, pixels[r].weight_y.x);
            let value_slope = vec2(pixels[r].value_x.x, pixels[r].value_y.x);
            own.slope = (own.value * weight_slope - value_slope) * inverse;
            pixels[r].weight_x = shift(pixels[r].weight_x);
            pixels[r].weight_y = shift(pixels[r].weight_y);
            pixels[r].value_x = shift(pixels[r].value_x);
            pixels[r].value_y = shift(pixels[r].value_y);
        }
        pixels[r].weight = shift(pixels[r].weight);
        pixels[r].value = shift(pixels[r].value);
    }
    if RADIANCE_PAYLOAD {
        let depth = pixels[r].depth.x;
        let sum = vec3(pixels[r].red.x, pixels[r].green.x, pixels[r].blue.x);
        // Where next to nothing faces the eye, rounding may have left a weight of any sign; its colour must stay a colour.
        var color = clamp(sum / max(pixels[r].facing.x, 1e-12), vec3(0.0), vec3(1.0));
        if SURFACE_SHADED {
            let normal = vec3(pixels[r].normal_x.x, pixels[r].normal_y.x, pixels[r].normal_z.x);
            // Colours of splats without a normal stay as they are.
            if dot(normal, normal) > 0.0 {
                color = lit(color, normal, direction_of(r), frame.surface_shade);
            }
            pixels[r].normal_x = shift(pixels[r].normal_x);
            pixels[r].normal_y = shift(pixels[r].normal_y);
            pixels[r].normal_z = shift(pixels[r].normal_z);
        }
        own.radiance = select(vec4(0.0), vec4(depth * color, depth), depth >= LEAST_DEPTH);
        pixels[r].facing = shift(pixels[r].facing);
        pixels[r].depth = shift(pixels[r].depth);
        pixels[r].red = shift(pixels[r].red);
        pixels[r].green = shift(pixels[r].green);
        pixels[r].blue = shift(pixels[r].blue);
    }
    return own;
}

// Adds the sections of a splat to a pixel. `slope`: half the derivative of ρ² per pixel.
fn add(r: u32, w: vec4<f32>, slope: vec2<f32>, strength: f32) {
    let v = w * strength;
    pixels[r].weight += w;
    pixels[r].value += v;
    if VOLUME_SHADED && !CENTRAL {
        pixels[r].weight_x += w * slope.x;
        pixels[r].weight_y += w * slope.y;
        pixels[r].value_x += v * slope.x;
        pixels[r].value_y += v * slope.y;
    }
}

@compute @workgroup_size(8, LANE_ROWS)
fn march(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) lane: vec3<u32>) {
    let number = group.x + group.y * 65535u;
    let column = number % frame.tiles.x;
    let row = stage.first_row + number / frame.tiles.x;
    if stage.groups == 0u || row >= stage.end_row {
        return;
    }
    let tile = row * frame.tiles.x + column;
    let resumed = atomicLoad(&progress[tile]);
    if resumed == FINISHED {
        return;
    }
    first_composited = max(resumed, stage.first_sheet);
    let corner = vec2<i32>(vec2(column, row)) * TILE_STEP - APRON;
    let first_pixel = corner + vec2<i32>(i32(lane.x), i32(lane.y * ROWS));
    for (var r = 0u; r < ROWS; r++) {
        let at = first_pixel + vec2(0, i32(r));
        if all(at >= vec2(0)) && all(at < vec2<i32>(frame.size)) {
            let stored = colors[u32(at.y) * frame.size.x + u32(at.x)];
            pixels[r].color = stored.xyz;
            pixels[r].transmittance = 1.0 - stored.w;
            pixels[r].hit = depths[u32(at.y) * frame.size.x + u32(at.x)];
        } else {
            pixels[r].transmittance = select(0.0, 1.0, CENTRAL);
        }
        pixels[r].ray = (vec2<f32>(at) + 0.5 - frame.center) / frame.scale;
        pixels[r].cosine = 1.0;
        if PERSPECTIVE {
            pixels[r].cosine = inverseSqrt(1.0 + dot(pixels[r].ray, pixels[r].ray));
        }
        if SCALAR && LATTICE {
            pixels[r].inside = inside_field(r);
        }
    }

    let tile_bins = ((row - stage.first_row) * frame.tiles.x + column) * stage.groups;
    var group_end = bin_end(tile_bins);
    var bin = tile_bins;
    let last_bin = tile_bins + stage.groups - 1u;
    // The first window that reaches into the sheets to come, or into the one before them, which gradients need.
    let origin = stage.first_collected - 1u;
    let first_window = first_composited - min(first_composited, 3u + WAITING);
    bin += (max(first_window, origin) - origin) >> frame.group_shift;
    var at = 0u;
    if bin > 0u {
        at = bin_end(bin - 1u);
    }
    group_end = bin_end(bin);
    let end = bin_end(last_bin);
    var entries_left = MOST_ENTRIES;
    var stopped = 0u;
    var front = origin;
    // Sheets from `front` on that may hold something, the one that waits to be shaded included.
    var open = 0u;
    loop {
        if at >= end {
            break;
        }
        while group_end <= at {
            bin++;
            group_end = bin_end(bin);
        }
        let entry_sheet = entries[at] >> ENTRY_SHEET_SHIFT;
        let sheet = origin + ((bin - tile_bins) << frame.group_shift) + entry_sheet;
        if open > 0u {
            close(front, min(sheet - front, open), lane.xy);
            open -= min(sheet - front, open);
        }
        front = sheet;
        // All sheets before this one are closed, and composited but for the one that waits. A tile stops only when it has
        // got further than where it started.
        if entries_left == 0u && front > first_composited + WAITING + 1u {
            stopped = front - WAITING;
            break;
        }
        // With differences between pixels, all lanes must reach every barrier.
        if !CENTRAL {
            var light = 0.0;
            for (var r = 0u; r < ROWS; r++) {
                light = max(light, pixels[r].transmittance);
            }
            if light < OPAQUE {
                break;
            }
        }
        let run_end = at + min(LONGEST_RUN, end - at);
        loop {
            let entry = entries[at];
            if ISOTROPIC_RECORDS && (!GENERAL_RECORDS || (entry & ENTRY_ISOTROPIC) != 0u) {
                add_isotropic(entry, front, first_pixel);
            } else if GENERAL_RECORDS {
                add_general(entry, front, first_pixel);
            }
            at++;
            entries_left -= min(entries_left, 1u);
            if at >= group_end || (entries[at] >> ENTRY_SHEET_SHIFT) != entry_sheet {
                break;
            }
            if at >= run_end {
                atomicStore(&progress[frame.tiles.x * frame.tiles.y + 1u], 1u);
                break;
            }
        }
        open = 4u + WAITING;
    }
    if stopped == 0u {
        close(front, open, lane.xy);
    }
    if all(lane.xy == vec2(0u)) {
        atomicStore(&progress[tile], FINISHED);
    }
    if stopped > 0u {
        atomicStore(&progress[tile], stopped);
        atomicStore(&progress[frame.tiles.x * frame.tiles.y], 1u);
    }

    for (var r = 0u; r < ROWS; r++) {
        let own = vec2<i32>(lane.xy) + vec2(0, i32(lane.y * (ROWS - 1u) + r));
        let pixel = first_pixel + vec2(0, i32(r));
        if all(own >= vec2(APRON)) && all(own < vec2(8 - APRON)) && all(pixel < vec2<i32>(frame.size)) {
            let index = u32(pixel.y) * frame.size.x + u32(pixel.x);
            colors[index] = vec4(pixels[r].color, 1.0 - pixels[r].transmittance);
            depths[index] = pixels[r].hit;
        }
    }
}

fn bin_end(bin: u32) -> u32 {
    return min(bins[bin], frame.entry_capacity);
}

// The distances between which a pixel's ray is inside the sampled box.
fn inside_field(r: u32) -> vec2<f32> {
    var origin = frame.field_origin.xyz;
    var direction = direction_of(r);
    direction = in_steps(direction);
    if !PERSPECTIVE {
        let start = vec3(pixels[r].ray, 0.0);
        origin += in_steps(start);
    }
    // A ray along a face would divide 0 by 0; this direction misses no box that the exact one meets visibly.
    direction = select(direction, vec3(1e-20), abs(direction) < vec3(1e-20));
    let a = (frame.field_low.xyz - origin) / direction;
    let b = (frame.field_high.xyz - origin) / direction;
    let enter = min(a, b);
    let leave = max(a, b);
    return vec2(max(enter.x, max(enter.y, enter.z)), min(leave.x, min(leave.y, leave.z)));
}

// Closes `count` sheets from `front` on.
fn close(front: u32, count: u32, lane: vec2<u32>) {
    for (var sheet = front; sheet < front + count; sheet++) {
        for (var r = 0u; r < ROWS; r++) {
            let own = resolve(r, sheet);
            if WAITING > 0u {
                composite(r, sheet - 1u, pixels[r].waiting, own.has_value, own.value);
                pixels[r].value_before = pixels[r].waiting.value;
                pixels[r].has_before = pixels[r].waiting.has_value;
                pixels[r].waiting = own;
            } else {
                composite(r, sheet, own, false, 0.0);
            }
        }
        if CENTRAL {
            take_differences(lane);
        }
    }
}

// Slopes of the sheet that waits, from its values at the neighbouring pixels of the tile.
fn take_differences(lane: vec2<u32>) {
    for (var r = 0u; r < ROWS; r++) {
        let at = (lane.y * ROWS + r) * 8u + lane.x;
        neighbours[at] = select(NO_VALUE, pixels[r].waiting.value, pixels[r].waiting.has_value);
    }
    workgroupBarrier();
    for (var r = 0u; r < ROWS; r++) {
        let y = lane.y * ROWS + r;
        let own = pixels[r].waiting.value;
        let left = neighbours[y * 8u + max(lane.x, 1u) - 1u];
        let right = neighbours[y * 8u + min(lane.x + 1u, 7u)];
        let above = neighbours[(max(y, 1u) - 1u) * 8u + lane.x];
        let below = neighbours[min(y + 1u, 7u) * 8u + lane.x];
        pixels[r].waiting.slope = vec2(difference(left, own, right), difference(above, own, below));
    }
    workgroupBarrier();
}

// Central difference, one-sided where a neighbour has no value.
fn difference(before: f32, own: f32, after: f32) -> f32 {
    let has_before = before < NO_VALUE;
    let has_after = after < NO_VALUE;
    let span = f32(u32(has_before) + u32(has_after));
    return (select(own, after, has_after) - select(own, before, has_before)) / max(span, 1.0);
}

// An isotropic lattice sample: view-space centre and value. Far from the eye the shells of the sheets are flat across its
// footprint, so its sections are four numbers for all pixels.
fn add_isotropic(entry: u32, front: u32, first_pixel: vec2<i32>) {
    let record = records[entry & ENTRY_RECORD];
    let c = record.xyz;
    let inverse_sigma = frame.isotropic.y;
    var distance = c.z;
    var at = frame.center + frame.scale * c.xy;
    let per_pixel = inverse_sigma / frame.scale;
    var q = vec3(1.0, 0.0, 1.0) * (per_pixel * per_pixel);
    if PERSPECTIVE {
        distance = length(c);
        let p = c.xy / c.z;
        at = frame.center + frame.scale * p;
        let k = c.z * per_pixel;
        q = vec3(1.0 + p.y * p.y, -p.x * p.y, 1.0 + p.x * p.x) * (k * k);
    }
    let near = vec3(planes[front + 1u], planes[front + 2u], planes[front + 3u]);
    let base = select(0.0, 1.0, (entry & ENTRY_CONTINUED) != 0u);
    let s = sections((near - distance) * inverse_sigma, base) * (SQRT_TAU * frame.isotropic.x);
    let extent2 = frame.isotropic.z;
    let dx = f32(first_pixel.x) + 0.5 - at.x;
    let nx = q.x * dx * dx;
    let mixed = 2.0 * q.y * dx;
    for (var r = 0u; r < ROWS; r++) {
        let dy = f32(first_pixel.y) + (f32(r) + 0.5 - at.y);
        let flat2 = nx + dy * (mixed + dy * q.z);
        let cosine2 = pixels[r].cosine * pixels[r].cosine;
        let rho2 = flat2 * cosine2;
        let e = select(0.0, exp(-0.5 * rho2), rho2 <= extent2);
        let slope = vec2(q.x * dx + q.y * dy, q.y * dx + q.z * dy) * cosine2;
        add(r, s * e, slope, record.w);
    }
}

// Within a sheet, what faces the eye hides what faces away: where a part is thinner than a sheet, its far side must not
// mix into the colour and light of its near side. Far sides alone keep a little weight, so that they still have a colour.
fn facing_weight(normal: vec3<f32>, center: vec3<f32>) -> f32 {
    var away = normal.z;
    if PERSPECTIVE {
        away = dot(normal, center) / max(length(center), 1e-30);
    }
    return clamp(0.5 - 4.0 * away, 1.0 / 255.0, 1.0);
}

// Any ellipsoid, with centre c and whitening M. Along a pixel's ray direction b: β = M·b; v = M·c × β, which is zero at the
// projected centre and grows evenly from there; ρ² = |v|²/|β|²; the closest approach is where |β|²·z = L. All are exact in
// perspective, and taken from vectors, not from expanded polynomials, which cancel beside the eye. See docs/engine.md.
fn add_general(entry: u32, front: u32, first_pixel: vec2<i32>) {
    let index = entry & ENTRY_RECORD;
    let a = records[index];
    let b = records[index + 1u];
    let c = records[index + 2u];
    let d = records[index + 3u];
    let near = vec3(planes[front + 1u], planes[front + 2u], planes[front + 3u]);
    let base = select(0.0, 1.0, (entry & ENTRY_CONTINUED) != 0u);
    var color: vec3<f32>;
    var normal: vec3<f32>;
    var facing = 1.0;
    // The sign of the squared extent tells the payloads apart.
    let is_radiance = RADIANCE_PAYLOAD && (!SCALAR || c.z > 0.0);
    if RADIANCE_PAYLOAD {
        color = unpack4x8unorm(bitcast<u32>(d.x)).xyz;
        let packed = bitcast<u32>(d.y);
        if packed != NO_NORMAL {
            normal = decode_normal(packed);
            facing = facing_weight(normal, a.xyz);
        }
    }
    // Change of the whitened ray per pixel to the right and down, and its constant part.
    let m0 = b.xyz / frame.scale;
    let m1 = vec3(0.0, b.w, c.x) / frame.scale;
    let m2 = vec3(0.0, 0.0, c.y);
    var at = frame.center + frame.scale * a.xy;
    var whitened = m2 * a.z;
    var v0 = cross(m0, m2);
    var v1 = cross(m1, m2);
    if PERSPECTIVE {
        // A centre beside the eye projects to infinity; moving it by a thousandth of its distance cannot be seen.
        let least = 1e-3 * length(a.xyz);
        let z = select(a.z, select(-least, least, a.z >= 0.0), abs(a.z) < least);
        at = frame.center + frame.scale * a.xy / z;
        whitened = (m0 * a.x + m1 * a.y) * frame.scale + m2 * z;
        v0 = cross(whitened, m0);
        v1 = cross(whitened, m1);
    }
    let dx = f32(first_pixel.x) + 0.5 - at.x;
    let v_column = v0 * dx;
    let beta_column = m2 + m0 * (f32(first_pixel.x) + 0.5 - frame.center.x);
    for (var r = 0u; r < ROWS; r++) {
        let y = f32(first_pixel.y) + (f32(r) + 0.5);
        let v = v_column + v1 * (y - at.y);
        var beta = m2;
        var l = 0.0;
        if PERSPECTIVE {
            beta = beta_column + m1 * (y - frame.center.y);
            l = dot(whitened, beta);
        } else {
            l = dot(whitened - m0 * dx - m1 * (y - at.y), beta);
        }
        let size2 = dot(beta, beta);
        let inverse = inverseSqrt(max(size2, 1e-37));
        let rho2 = dot(v, v) * inverse * inverse;
        let e = select(0.0, exp(-0.5 * rho2), rho2 <= abs(c.z));
        let t = (size2 * (near * pixels[r].cosine) - l) * inverse;
        let s = sections(t, base) * e;
        if is_radiance {
            let w = s * a.w;
            let w_facing = w * facing;
            pixels[r].depth += w;
            pixels[r].facing += w_facing;
            pixels[r].red += w_facing * color.x;
            pixels[r].green += w_facing * color.y;
            pixels[r].blue += w_facing * color.z;
            if SURFACE_SHADED {
                pixels[r].normal_x += w_facing * normal.x;
                pixels[r].normal_y += w_facing * normal.y;
                pixels[r].normal_z += w_facing * normal.z;
            }
        } else if SCALAR {
            var change = vec2(dot(v, v0), dot(v, v1));
            if PERSPECTIVE {
                change -= rho2 * vec2(dot(beta, m0), dot(beta, m1));
            }
            add(r, s * (SQRT_TAU * inverse / pixels[r].cosine), change * (inverse * inverse), a.w);
        }
    }
}
