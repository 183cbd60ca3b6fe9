// An explicit splat as it is stored. Mirrors src/splat.rs.
struct Splat {
    center: vec3<f32>,
    strength: f32,
    // B row by row: b00, b10, b11, b20 and b21, b22.
    factor_a: vec4<f32>,
    factor_b: vec2<f32>,
    color: u32,
    normal: u32,
}
