// Unit vectors in 32 bits, octahedral (Meyer et al. 2010). Mirrors encode_normal and decode_normal
// in splat.rs.

const NO_NORMAL: u32 = 0x80008000u;

fn decode_normal(packed: u32) -> vec3<f32> {
    let p = unpack2x16snorm(packed);
    let z = 1.0 - abs(p.x) - abs(p.y);
    let fold = max(-z, 0.0);
    return normalize(vec3(p - select(vec2(-fold), vec2(fold), p >= vec2(0.0)), z));
}

// The same, but a vector without length for NO_NORMAL.
fn normal_or_none(packed: u32) -> vec3<f32> {
    return select(decode_normal(packed), vec3(0.0), packed == NO_NORMAL);
}

fn encode_normal(n: vec3<f32>) -> u32 {
    var p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    if n.z < 0.0 {
        p = (1.0 - abs(p.yx)) * select(vec2(-1.0), vec2(1.0), p >= vec2(0.0));
    }
    return pack2x16snorm(p);
}
