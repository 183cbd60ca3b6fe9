// A host's own shaders: splatkit's picture as the background, then triangles before or behind it.

struct Host {
    // From the triangles' coordinates to clip space.
    clip_from_world: mat4x4<f32>,
    // A view-space z becomes the depth scale + shift / z.
    depth_scale: f32,
    depth_shift: f32,
}

@group(0) @binding(0) var<uniform> host: Host;
@group(0) @binding(1) var colors: texture_2d<f32>;
@group(0) @binding(2) var depths: texture_2d<f32>;

@vertex
fn corner(@builtin(vertex_index) number: u32) -> @builtin(position) vec4<f32> {
    return vec4(4.0 * vec2(f32(number & 1u), f32(number >> 1u)) - 1.0, 0.0, 1.0);
}

struct Pixel {
    @location(0) color: vec4<f32>,
    @builtin(frag_depth) depth: f32,
}

// splatkit's picture over a dark background, with its depth in the host's depth buffer.
@fragment
fn splats(@builtin(position) position: vec4<f32>) -> Pixel {
    let place = vec2<u32>(position.xy);
    let color = textureLoad(colors, place, 0);
    let behind = vec3(0.02, 0.03, 0.06);
    // Infinite where there is nothing opaque: the farthest depth.
    let z = textureLoad(depths, place, 0).r;
    let depth = clamp(host.depth_scale + host.depth_shift / z, 0.0, 1.0);
    return Pixel(vec4(color.rgb + (1.0 - color.a) * behind, 1.0), depth);
}

struct Vertex {
    @builtin(position) position: vec4<f32>,
    @location(0) color: vec3<f32>,
}

@vertex
fn vertex(@location(0) position: vec3<f32>, @location(1) color: vec3<f32>) -> Vertex {
    return Vertex(host.clip_from_world * vec4(position, 1.0), color);
}

@fragment
fn triangles(vertex: Vertex) -> @location(0) vec4<f32> {
    return vec4(vertex.color, 1.0);
}
