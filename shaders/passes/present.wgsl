// Present: writes the rows of a finished strip into textures of the host application. While the
// strip is unfinished, the textures stay as they are. A triangle covers the strip.

struct Present {
    // Width of the picture, rows of the strip.
    size: vec2<u32>,
    // The first row of the strip in the textures.
    first_row: u32,
    // Whether colours are converted to linear light, because the texture converts them back.
    is_srgb: u32,
    // Pixel coordinates of the optical axis in the strip; focal length in pixels (perspective).
    center: vec2<f32>,
    scale: f32,
    perspective: u32,
    // The strip is finished if words[word] is `wanted`, and words[stalled] is 0 or there is no such
    // word.
    word: u32,
    wanted: u32,
    stalled: u32,
    // The depth of a pixel that has none.
    far: f32,
    // Whether pixels have depths.
    has_depth: u32,
    // Whether depths are distances along the rays; otherwise they are view-space z.
    are_distances: u32,
    // A depth buffer holds shift + factor / z in perspective, otherwise shift + factor · z.
    depth_shift: f32,
    depth_factor: f32,
}

@group(0) @binding(0) var<uniform> present: Present;
// The state of the frame, or the progress of gather.
@group(0) @binding(1) var<storage, read> words: array<u32>;
@group(0) @binding(2) var<storage, read> colors: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> depths: array<f32>;

const NONE: u32 = 0xffffffffu;

@vertex
fn corner(@builtin(vertex_index) number: u32) -> @builtin(position) vec4<f32> {
    return vec4(4.0 * vec2(f32(number & 1u), f32(number >> 1u)) - 1.0, 0.0, 1.0);
}

fn is_finished() -> bool {
    if words[present.word] != present.wanted {
        return false;
    }
    return present.stalled == NONE || words[min(present.stalled, NONE - 1u)] == 0u;
}

// The transfer curve of IEC 61966-2-1 (sRGB).
fn to_linear(color: vec3<f32>) -> vec3<f32> {
    let low = color / 12.92;
    let high = pow((max(color, vec3(0.0)) + 0.055) / 1.055, vec3(2.4));
    return select(high, low, color <= vec3(0.04045));
}

fn color_of(index: u32) -> vec4<f32> {
    let color = colors[index];
    if present.is_srgb == 0u || color.a <= 0.0 {
        return color;
    }
    return vec4(to_linear(color.rgb / color.a) * color.a, color.a);
}

// The view-space z at which half of the light is absorbed.
fn depth_of(index: u32, pixel: vec2<f32>) -> f32 {
    if present.has_depth == 0u || colors[index].a < 0.5 {
        return present.far;
    }
    if present.perspective == 0u || present.are_distances == 0u {
        return depths[index];
    }
    let slope = (pixel - present.center) / present.scale;
    return depths[index] / sqrt(1.0 + dot(slope, slope));
}

fn index_of(position: vec4<f32>) -> u32 {
    return (u32(position.y) - present.first_row) * present.size.x + u32(position.x);
}

fn pixel_of(position: vec4<f32>) -> vec2<f32> {
    return vec2(position.x, position.y - f32(present.first_row));
}

@fragment
fn color(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    if !is_finished() {
        discard;
    }
    return color_of(index_of(position));
}

struct Pixel {
    @location(0) color: vec4<f32>,
    @location(1) depth: f32,
}

@fragment
fn color_and_depth(@builtin(position) position: vec4<f32>) -> Pixel {
    if !is_finished() {
        discard;
    }
    let index = index_of(position);
    return Pixel(color_of(index), depth_of(index, pixel_of(position)));
}

struct BufferPixel {
    @location(0) color: vec4<f32>,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn color_and_depth_buffer(@builtin(position) position: vec4<f32>) -> BufferPixel {
    if !is_finished() {
        discard;
    }
    let index = index_of(position);
    let z = depth_of(index, pixel_of(position));
    if present.has_depth == 0u || colors[index].a < 0.5 {
        return BufferPixel(color_of(index), present.far);
    }
    let along = select(z, 1.0 / z, present.perspective != 0u);
    let depth = present.depth_shift + present.depth_factor * along;
    return BufferPixel(color_of(index), clamp(depth, 0.0, 1.0));
}
