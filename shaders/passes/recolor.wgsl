// Recolor: gives trained Gaussians the colours that an eye sees. Their harmonics lie in blocks of
// 64 Gaussians, number by number, so that neighbouring invocations read neighbouring words.
// src/gaussians/harmonics.rs has the same sum.

struct Eye {
    // The eye relative to the origin of the centres, and 1; or the direction of parallel rays,
    // and 0.
    place: vec4<f32>,
    count: u32,
    // (degree + 1)².
    terms: u32,
    unused: vec2<u32>,
}

@group(0) @binding(0) var<uniform> eye: Eye;
@group(0) @binding(1) var<storage, read> harmonics: array<f32>;
@group(0) @binding(2) var<storage, read_write> splats: array<Splat>;

// See splat.rs.
const TRAINED_UNITS: f32 = 8192.0;
const MOST_UNITS: f32 = 65535.0;
const AS_FLOAT: u32 = 0x40000000u;

const DEGREE_0: f32 = 0.2820948;
const DEGREE_1: f32 = 0.4886025;
const DEGREE_2: vec3<f32> = vec3(1.0925484, 0.31539157, 0.5462742);
const DEGREE_3: array<f32, 5> =
    array<f32, 5>(0.5900436, 2.8906114, 0.4570458, 0.37317634, 1.4453057);

fn harmonic(block: u32, lane: u32, term: u32) -> vec3<f32> {
    let at = (block * 3u * eye.terms + 3u * term) * 64u + lane;
    return vec3(harmonics[at], harmonics[at + 64u], harmonics[at + 128u]);
}

@compute @workgroup_size(64)
fn recolor(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let block = group.x + group.y * MOST_WORKGROUPS;
    let index = block * 64u + lane;
    if index >= eye.count {
        return;
    }
    var d = eye.place.xyz;
    if eye.place.w > 0.0 {
        d = splats[index].center - eye.place.xyz;
        // An eye at the centre sees no direction.
        d *= select(0.0, inverseSqrt(max(dot(d, d), 1e-37)), dot(d, d) > 0.0);
    }
    var sum = vec3(0.5) + DEGREE_0 * harmonic(block, lane, 0u);
    if eye.terms >= 4u {
        sum += DEGREE_1 * (d.z * harmonic(block, lane, 2u) - d.y * harmonic(block, lane, 1u)
            - d.x * harmonic(block, lane, 3u));
    }
    let square = d * d;
    if eye.terms >= 9u {
        sum += DEGREE_2.x * (d.x * d.y * harmonic(block, lane, 4u)
            - d.y * d.z * harmonic(block, lane, 5u) - d.x * d.z * harmonic(block, lane, 7u));
        sum += DEGREE_2.y * (2.0 * square.z - square.x - square.y) * harmonic(block, lane, 6u);
        sum += DEGREE_2.z * (square.x - square.y) * harmonic(block, lane, 8u);
    }
    if eye.terms >= 16u {
        let across = 4.0 * square.z - square.x - square.y;
        sum -= DEGREE_3[0] * d.y * (3.0 * square.x - square.y) * harmonic(block, lane, 9u);
        sum += DEGREE_3[1] * d.x * d.y * d.z * harmonic(block, lane, 10u);
        sum -= DEGREE_3[2] * d.y * across * harmonic(block, lane, 11u);
        sum += DEGREE_3[3] * d.z * (2.0 * square.z - 3.0 * (square.x + square.y))
            * harmonic(block, lane, 12u);
        sum -= DEGREE_3[2] * d.x * across * harmonic(block, lane, 13u);
        sum += DEGREE_3[4] * d.z * (square.x - square.y) * harmonic(block, lane, 14u);
        sum -= DEGREE_3[0] * d.x * (square.x - 3.0 * square.y) * harmonic(block, lane, 15u);
    }
    let units = vec3<u32>(round(clamp(sum * TRAINED_UNITS, vec3(0.0), vec3(MOST_UNITS))));
    splats[index].color = AS_FLOAT | ((units.y >> 8u) << 16u) | units.x;
    splats[index].normal = AS_FLOAT | ((units.y & 255u) << 16u) | units.z;
}
