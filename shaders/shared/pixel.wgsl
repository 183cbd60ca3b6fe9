// The state of each pixel of an invocation of march while it processes a tile, and the pixel's ray.

// The value on the plane between two sheets, and its change across the picture (slope_on_plane in
// sheet.wgsl).
struct Face {
    has_value: bool,
    value: f32,
    slope: vec2<f32>,
    // A gathered lattice: the change along the ray, per world unit.
    along: f32,
}

// A field in one sheet at one pixel.
struct Sheet {
    has_value: bool,
    // The mean, and the filled fraction of the sheet (1 on a lattice).
    value: f32,
    filling: f32,
    front: Face,
    back: Face,
    // A gathered lattice: the field in the middle.
    inside: Face,
}

// A field in the open sheets.
struct OpenField {
    // Sums of the four open sheets: weights, weighted values.
    weight: vec4<f32>,
    value: vec4<f32>,
    // Sums at the three planes between them: kernels and values times kernels, and the negated
    // derivatives of both per pixel to the right and down.
    face_weight: vec3<f32>,
    face_value: vec3<f32>,
    weight_x: vec3<f32>,
    weight_y: vec3<f32>,
    value_x: vec3<f32>,
    value_y: vec3<f32>,
    // The plane in front of the first open sheet.
    front: Face,
    // A gathered lattice: the plane behind the sheet that was evaluated last.
    behind: Face,
    // The part of the ray that clips keep inside the samples' box.
    inside: vec2<f32>,
}

struct Pixel {
    fields: array<OpenField, FIELDS>,
    // Optical depth; then the sums of facing weights, colours and normals, each weighted by optical
    // depth.
    depth: vec4<f32>,
    facing: vec4<f32>,
    red: vec4<f32>,
    green: vec4<f32>,
    blue: vec4<f32>,
    normal_x: vec4<f32>,
    normal_y: vec4<f32>,
    normal_z: vec4<f32>,
    // The picture so far. `hit` is the distance at which half of the light is absorbed, or the
    // largest value.
    color: vec3<f32>,
    transmittance: f32,
    hit: f32,
    // The ray: image-plane position, cosine to the optical axis.
    ray: vec2<f32>,
    cosine: f32,
    // The part of the ray that clips keep.
    kept: vec2<f32>,
    // The parts that boxes cut out.
    holes: array<vec2<f32>, HOLES + 1u>,
}

// An invocation's pixels, one below the other.
var<private> pixels: array<Pixel, ROWS>;

fn direction_of(r: u32) -> vec3<f32> {
    if PERSPECTIVE {
        return vec3(pixels[r].ray, 1.0) * pixels[r].cosine;
    }
    return vec3(0.0, 0.0, 1.0);
}

fn origin_of(r: u32) -> vec3<f32> {
    if PERSPECTIVE {
        return vec3(0.0);
    }
    return vec3(pixels[r].ray, 0.0);
}

// Sets up a pixel's ray.
fn aim(r: u32, pixel: vec2<i32>) {
    pixels[r].ray = (vec2<f32>(pixel) + 0.5 - frame.center) / frame.scale;
    pixels[r].cosine = 1.0;
    if PERSPECTIVE {
        pixels[r].cosine = inverseSqrt(1.0 + dot(pixels[r].ray, pixels[r].ray));
    }
    pixels[r].kept = vec2(-3e38, 3e38);
    let origin = in_world(origin_of(r));
    let direction = in_world(direction_of(r));
    for (var i = 0u; i < CLIPS; i++) {
        let clip = frame.clips[i];
        var part = half_space(clip.low.xyz, clip.high.x, origin, direction);
        if clip.high.w > 0.0 {
            part = box_part(clip.low.xyz, clip.high.xyz, origin, direction);
        }
        pixels[r].kept = vec2(max(pixels[r].kept.x, part.x), min(pixels[r].kept.y, part.y));
    }
    for (var i = 0u; i < HOLES; i++) {
        let hole = frame.holes[i];
        pixels[r].holes[i] = box_part(hole.low.xyz, hole.high.xyz, origin, direction);
    }
    for (var f = 0u; f < FIELDS; f++) {
        pixels[r].fields[f].inside = pixels[r].kept;
        if SCALAR && LATTICE {
            let start = frame.fields[f].origin.xyz + in_steps(f, origin_of(r));
            let part = box_part(
                frame.fields[f].low.xyz,
                frame.fields[f].high.xyz,
                start,
                in_steps(f, direction_of(r)),
            );
            pixels[r].fields[f].inside =
                vec2(max(pixels[r].kept.x, part.x), min(pixels[r].kept.y, part.y));
        }
    }
}

// Converts a view-space direction to steps of a field's lattice.
fn in_steps(f: u32, v: vec3<f32>) -> vec3<f32> {
    return vec3(
        dot(frame.fields[f].axis_x.xyz, v),
        dot(frame.fields[f].axis_y.xyz, v),
        dot(frame.fields[f].axis_z.xyz, v),
    );
}

// Returns the distances between which a ray is inside a box. If the ray misses, the first is
// larger.
fn box_part(low: vec3<f32>, high: vec3<f32>, origin: vec3<f32>, direction: vec3<f32>) -> vec2<f32> {
    // A ray along a face would divide 0 by 0. This direction misses no box that the exact one
    // visibly meets.
    let safe = select(direction, vec3(1e-20), abs(direction) < vec3(1e-20));
    let a = (low - origin) / safe;
    let b = (high - origin) / safe;
    let enter = min(a, b);
    let leave = max(a, b);
    return vec2(max(enter.x, max(enter.y, enter.z)), min(leave.x, min(leave.y, leave.z)));
}

// Returns the distances between which a ray has normal·x ≤ offset.
fn half_space(
    normal: vec3<f32>,
    offset: f32,
    origin: vec3<f32>,
    direction: vec3<f32>,
) -> vec2<f32> {
    let slope = dot(normal, direction);
    let safe = select(slope, 1e-20, abs(slope) < 1e-20);
    let at = clamp((offset - dot(normal, origin)) / safe, -3e38, 3e38);
    return select(vec2(at, 3e38), vec2(-3e38, at), safe > 0.0);
}

// Whether the clips keep a place of the ray.
fn is_kept(r: u32, distance: f32) -> bool {
    var kept = distance >= pixels[r].kept.x && distance <= pixels[r].kept.y;
    for (var i = 0u; i < HOLES; i++) {
        let hole = pixels[r].holes[i];
        kept = kept && !(distance > hole.x && distance < hole.y);
    }
    return kept;
}

// Rotates a view-space direction to the world's axes, along which clips are given (relative to the
// eye).
fn in_world(v: vec3<f32>) -> vec3<f32> {
    return frame.world_x.xyz * v.x + frame.world_y.xyz * v.y + frame.world_z.xyz * v.z;
}
