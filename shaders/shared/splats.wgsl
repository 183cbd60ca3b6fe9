// Explicit splats, for sources/splats.wgsl and sources/nodes.wgsl, which bind them.

// The picture is sampled at pixel centres. A blur of this many pixels keeps small splats from
// falling between them.
const FOOTPRINT_BLUR: f32 = 0.35;
// Trained Gaussians are widened by their trainer's √0.3 pixels across the view's axis, and by this
// share of it along the axis.
const TRAINED_BLUR: f32 = 0.54772256;
const TRAINED_BLUR_ALONG: f32 = 0.1;
// The least share of a pixel that a trained Gaussian covers, 1/255, less what rounding may take.
const LEAST_TRAINED: f32 = 0.00391765;
// Opaque surfaces must not grow through the blur: see splat.rs.
const STEP_BACK: f32 = 2.4;

// The exponents of slopes begin at −SLOPE_BIAS: see splat.rs.
const SLOPE_BIAS: i32 = 200;

// Returns the slope of a sample, in its own whitened space: three integers of 13 bits, and their
// common exponent in the highest bits (Splat::sample in splat.rs).
fn slope_of(color: u32, normal: u32) -> vec3<f32> {
    let exponent = i32(((color >> 29u) << 6u) | (normal >> 26u)) - SLOPE_BIAS;
    // Shifted to the top and back as signed numbers, to extend the signs.
    let parts = vec3<i32>(vec3(color >> 16u, normal, normal >> 13u) << vec3(19u)) >> vec3(19u);
    // In two steps, so that no power of two leaves 32 bits before the product does.
    let half = exponent / 2;
    return vec3<f32>(parts) * exp2(f32(half)) * exp2(f32(exponent - half));
}

// Returns the area of a splat with these axes, seen from the eye, over its area once it is widened:
// the factor on the optical depth of translucent splats. All lengths are in units of the splat's
// own size, so that their fourth powers fit 32 bits.
fn thinned(a: vec3<f32>, b: vec3<f32>, c: vec3<f32>, center: vec3<f32>, blur2: f32) -> f32 {
    var toward = vec3(0.0, 0.0, 1.0);
    if frame.perspective != 0u {
        toward = center * inverseSqrt(max(dot(center, center), 1e-37));
    }
    let trace = dot(a, a) + dot(b, b) + dot(c, c);
    let unit = 1.0 / max(trace + blur2, 1e-37);
    let shadow = unit * vec3(
        dot(cross(b, c), toward),
        dot(cross(c, a), toward),
        dot(cross(a, b), toward),
    );
    let along = vec3(dot(a, toward), dot(b, toward), dot(c, toward));
    let before = dot(shadow, shadow);
    let widened = blur2 * unit;
    let after = before + widened * ((trace - dot(along, along)) * unit) + widened * widened;
    return sqrt(before / max(after, 1e-37));
}

// Returns a splat in view space, widened.
fn splat_at(index: u32) -> Candidate {
    let packed = splats[index];
    let b = packed.factor_a;
    let d = packed.factor_b;
    let to_view = mat3x3<f32>(source.axis_x.xyz, source.axis_y.xyz, source.axis_z.xyz);
    var splat: Candidate;
    splat.center = to_view * packed.center + source.origin.xyz;
    // Columns of B, rotated into view space; B = (b00 0 0, b10 b11 0, b20 b21 b22) row by row.
    let c0 = to_view * vec3(b.x, b.y, b.w);
    let c1 = to_view * vec3(0.0, b.z, d.x);
    let c2 = to_view * vec3(0.0, 0.0, d.y);
    let is_trained = TRAINED && (source.flags & TRAINED_FLAG) != 0u;
    var pixel = 1.0 / frame.scale;
    if frame.perspective != 0u {
        pixel = pixel * select(length(splat.center), abs(splat.center.z), is_trained);
    }
    let blur = select(FOOTPRINT_BLUR, TRAINED_BLUR, is_trained) * pixel;
    let blur2 = blur * blur;
    let along = select(1.0, TRAINED_BLUR_ALONG, is_trained) * blur;
    splat.covariance.xx = c0.x * c0.x + c1.x * c1.x + c2.x * c2.x + blur2;
    splat.covariance.xy = c0.x * c0.y + c1.x * c1.y + c2.x * c2.y;
    splat.covariance.xz = c0.x * c0.z + c1.x * c1.z + c2.x * c2.z;
    splat.covariance.yy = c0.y * c0.y + c1.y * c1.y + c2.y * c2.y + blur2;
    splat.covariance.yz = c0.y * c0.z + c1.y * c1.z + c2.y * c2.z;
    splat.covariance.zz = c0.z * c0.z + c1.z * c1.z + c2.z * c2.z + along * along;
    splat.extent = source.extent;
    splat.rim = source.extent;
    if is_trained && packed.strength < 0.0 {
        // Where its opacity falls to the least share. A merged node has an optical depth.
        let rim2 = 2.0 * log(max(-packed.strength / LEAST_TRAINED, 1.0));
        splat.rim = min(sqrt(rim2), source.extent);
    }
    splat.strength = packed.strength;
    splat.color = packed.color;
    splat.normal = packed.normal;
    if SAMPLES && (source.flags & RADIANCE) == 0u {
        // The slope is in the splat's own whitened space; B⁻ᵀ maps it to the set's space.
        let weight = unpack2x16float(splat.color).x;
        let slope = slope_of(splat.color, splat.normal);
        // A widened sample keeps its weight over space. Otherwise a sample far smaller than a pixel
        // would drown its surroundings. Both determinants are in units of the splat's own size, so
        // that they fit 32 bits.
        let s = splat.covariance;
        let unit = inverseSqrt(max(s.xx + s.yy + s.zz, 1e-37));
        let x = vec3(s.xx, s.xy, s.xz) * unit * unit;
        let y = vec3(s.xy, s.yy, s.yz) * unit * unit;
        let z = vec3(s.xz, s.yz, s.zz) * unit * unit;
        let before = abs(b.x * unit * b.z * unit * d.y * unit);
        splat.weight = weight * before * inverseSqrt(max(dot(x, cross(y, z)), 1e-37));
        let slope_z = slope.z / d.y;
        let slope_y = (slope.y - d.x * slope_z) / b.z;
        let slope_x = (slope.x - b.y * slope_y - b.w * slope_z) / b.x;
        let field = source_field();
        splat.gradient = to_view * vec3(slope_x, slope_y, slope_z)
            * frame.fields[field].transfer.y;
        splat.strength = counted(field, splat.strength);
    }
    if !is_trained && (source.flags & RADIANCE) != 0u {
        splat.strength = splat.strength * f32(splat.color >> 24u) / 255.0;
        if splat.color < 0xff000000u {
            splat.strength *= thinned(c0, c1, c2, splat.center, blur2);
        }
        if splat.normal != NO_NORMAL {
            let normal = to_view * decode_normal(splat.normal);
            splat.normal = encode_normal(normal);
            let across = vec3(dot(c0, normal), dot(c1, normal), dot(c2, normal));
            let variance = dot(across, across);
            splat.center -= normal * (STEP_BACK * (sqrt(variance + blur2) - sqrt(variance)));
        }
    }
    return splat;
}
