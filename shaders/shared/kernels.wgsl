// Adds a splat to the pixels of an invocation: its sections in the four open sheets, and its kernel
// on the three planes between them.

const SQRT_TAU: f32 = 2.5066283;

// The normal distribution function, within 2e-7 (Abramowitz & Stegun 1964, 26.2.19). Its tails must
// be right: their error is multiplied by the strength of an opaque splat, and lies in front of the
// splat.
fn normal_cdf(t: vec3<f32>) -> vec3<f32> {
    let x = min(abs(t), vec3(8.0));
    var p = 1.0 + x * (0.049867347 + x * (0.0211410061 + x * (0.00327762632
        + x * (3.8003575e-05 + x * (4.88906356e-05 + x * (5.382975e-06))))));
    p *= p;
    p *= p;
    p *= p;
    p *= p;
    let tail = 0.5 / p;
    return select(tail, 1.0 - tail, t >= vec3(0.0));
}

// The same within 2.3e-4, without a division: an odd polynomial with value 0.5 and slope 0 at 3.55
// (least squares, weighted to even errors). Only for surfaces. There an error moves optical depth
// from one sheet to the next, both with the same splat's colour, and removes none.
fn near_normal_cdf(t: vec3<f32>) -> vec3<f32> {
    let x = clamp(t, vec3(-3.55), vec3(3.55));
    let y = x * x;
    let p = 0.39808504 + y * (-0.064429414 + y * (0.0085235118 + y * (-0.00072436168
        + y * (3.4515190e-05 - y * 6.9134990e-07))));
    return 0.5 + x * p;
}

// Maximum distance of a plane from a kernel, in standard deviations. Further planes count as this
// far: nothing of the kernel is left there, and the list of planes ends with numbers that would
// overflow.
const FAR: vec3<f32> = vec3(12.0);

// Returns the four sections of a window, from the distribution function at its three inner planes.
fn sections(t: vec3<f32>, base: f32) -> vec4<f32> {
    var f: vec3<f32>;
    if SUMS || CLASSIFIED {
        f = normal_cdf(t);
    } else {
        f = near_normal_cdf(t);
    }
    return vec4(f.x - base, f.y - f.x, f.z - f.y, 1.0 - f.z);
}

// Returns the place of an entry's record.
fn first_word(entry: u32) -> u32 {
    return (entry & ENTRY_RECORD) * RECORD_UNIT;
}

// Returns the number of the field to which an entry belongs.
fn field_of(entry: u32) -> u32 {
    if FIELDS == 1u {
        return 0u;
    }
    let word = first_word(entry);
    let starts = frame.record_starts;
    var field = dot(vec3<u32>(vec3(word) >= starts[0].yzw), vec3(1u));
    if FIELDS > 4u {
        field += dot(vec4<u32>(vec4(word) >= starts[1]), vec4(1u));
    }
    return field;
}

// What samples add to the open sheets of a field.
struct Added {
    weight: vec4<f32>,
    value: vec4<f32>,
    face_weight: vec3<f32>,
    face_value: vec3<f32>,
    weight_x: vec3<f32>,
    weight_y: vec3<f32>,
    value_x: vec3<f32>,
    value_y: vec3<f32>,
}

fn add_to_field(r: u32, f: u32, added: Added) {
    pixels[r].fields[f].weight += added.weight;
    pixels[r].fields[f].value += added.value;
    pixels[r].fields[f].face_weight += added.face_weight;
    pixels[r].fields[f].face_value += added.face_value;
    if GRADIENTS && !CENTRAL {
        pixels[r].fields[f].weight_x += added.weight_x;
        pixels[r].fields[f].weight_y += added.weight_y;
        pixels[r].fields[f].value_x += added.value_x;
        pixels[r].fields[f].value_y += added.value_y;
    }
}

// An isotropic lattice sample in the picture. Far from the eye, the shells of the sheets are flat
// across its footprint, so its values along the ray are the same for all pixels.
struct Round {
    // The projected centre; ρ² as a quadratic form of the offset from there: xx, xy, yy.
    at: vec2<f32>,
    form: vec3<f32>,
    // The sections, and the kernel on the planes between them.
    along: vec4<f32>,
    on_plane: vec3<f32>,
    value: f32,
    // Negative for an unused sample.
    extent2: f32,
}

// Returns the sample of an entry. `near` has the distances of the window's inner planes.
fn round_of(f: u32, entry: u32, near: vec3<f32>) -> Round {
    let record = records[first_word(entry)];
    let c = record.xyz;
    let isotropic = frame.fields[f].isotropic;
    var sigma = isotropic.x;
    var inverse_sigma = isotropic.y;
    var share = 1.0;
    if TWO_LEVELS {
        let coarse = (entry & ENTRY_COARSE) != 0u;
        sigma *= select(1.0, 2.0, coarse);
        inverse_sigma *= select(1.0, 0.5, coarse);
        let levels = frame.fields[f].levels;
        share = select(levels.x, levels.y, coarse);
    }
    let per_pixel = inverse_sigma / frame.scale;
    var sample: Round;
    var distance = c.z;
    sample.at = frame.center + frame.scale * c.xy;
    sample.form = vec3(1.0, 0.0, 1.0) * (per_pixel * per_pixel);
    if PERSPECTIVE {
        distance = length(c);
        let p = c.xy / c.z;
        sample.at = frame.center + frame.scale * p;
        let k = c.z * per_pixel;
        sample.form = vec3(1.0 + p.y * p.y, -p.x * p.y, 1.0 + p.x * p.x) * (k * k);
    }
    let base = select(0.0, 1.0, (entry & ENTRY_CONTINUED) != 0u);
    let t = clamp((near - distance) * inverse_sigma, -FAR, FAR);
    sample.along = sections(t, base) * (SQRT_TAU * sigma * share);
    sample.on_plane = exp(-0.5 * t * t) * share;
    sample.value = record.w;
    sample.extent2 = isotropic.z;
    return sample;
}

// Number of isotropic samples that are added together: a pixel's sums are then read and written
// once for all of them. Two measure best on software drivers, where the sums lie in memory
// (docs/performance.md).
const TOGETHER: u32 = 2u;

// Returns the distances of the three planes inside a window, or what takes their place.
fn inner_planes(front: u32) -> vec3<f32> {
    let inner = vec3(planes[front + 1u], planes[front + 2u], planes[front + 3u]);
    if BY_CENTERS {
        // The middles of the first two sheets.
        return 0.5 * (vec3(planes[front], inner.xy) + inner);
    }
    return inner;
}

// Adds `count` entries of a field from `at` on to all pixels.
fn add_isotropic(f: u32, at: u32, count: u32, front: u32, first_pixel: vec2<i32>) {
    let near = inner_planes(front);
    var samples: array<Round, TOGETHER>;
    for (var i = 0u; i < TOGETHER; i++) {
        let place = at + min(i, count - 1u);
        if STAGED {
            samples[i] = staged_round(place);
        } else {
            samples[i] = round_of(f, entries[place], near);
        }
        if i >= count {
            samples[i].extent2 = -1.0;
        }
    }
    for (var r = 0u; r < ROWS; r++) {
        let cosine2 = pixels[r].cosine * pixels[r].cosine;
        var sum = Added();
        for (var i = 0u; i < TOGETHER; i++) {
            let sample = samples[i];
            let d = vec2<f32>(first_pixel + vec2(0, i32(r))) + 0.5 - sample.at;
            let turned = vec2(
                sample.form.x * d.x + sample.form.y * d.y,
                sample.form.y * d.x + sample.form.z * d.y,
            );
            let rho2 = dot(d, turned) * cosine2;
            let e = select(0.0, exp(-0.5 * rho2), rho2 <= sample.extent2);
            let v = e * sample.value;
            sum.weight += sample.along * e;
            sum.value += sample.along * v;
            sum.face_weight += sample.on_plane * e;
            sum.face_value += sample.on_plane * v;
            if GRADIENTS && !CENTRAL {
                let slope = turned * cosine2;
                sum.weight_x += sample.on_plane * (e * slope.x);
                sum.weight_y += sample.on_plane * (e * slope.y);
                sum.value_x += sample.on_plane * (v * slope.x);
                sum.value_y += sample.on_plane * (v * slope.y);
            }
        }
        add_to_field(r, f, sum);
    }
}

// Returns the facing weight. Within a sheet, splats that face the eye hide those that face away. If
// an object is thinner than a sheet, its far side must not mix into the colour and light of its
// near side. Far sides keep a small weight, so that they have a colour when alone.
fn facing_weight(normal: vec3<f32>, center: vec3<f32>) -> f32 {
    var away = normal.z;
    if PERSPECTIVE {
        away = dot(normal, center) / max(length(center), 1e-30);
    }
    return clamp(0.5 - 4.0 * away, 1.0 / 255.0, 1.0);
}

// The colours of trained Gaussians are in this unit; what they cover of a pixel is at least the
// first share, and at most the second: see splat.rs.
const TRAINED_COLOR: f32 = 1.0 / 8192.0;
const TRAINED_OPACITIES: vec2<f32> = vec2(1.0 / 255.0, 0.99);

// Returns the optical depth with which a trained Gaussian covers a share of a pixel: −ln(1 − α) =
// 2·artanh(α/(2 − α)). For small shares its series is more precise than a logarithm.
fn trained_depth(share: f32) -> f32 {
    let alpha = min(share, TRAINED_OPACITIES.y);
    let y = alpha / (2.0 - alpha);
    let y2 = y * y;
    let series = y * (2.0 + y2 * (2.0 / 3.0 + y2 * (0.4 + y2 * (2.0 / 7.0 + y2 * (2.0 / 9.0)))));
    let depth = select(-log(1.0 - alpha), series, alpha < 0.5);
    return select(0.0, depth, alpha >= TRAINED_OPACITIES.x);
}

// A general record, unpacked: what it adds, and what all pixels share of where it adds it.
struct Loaded {
    // The distance of the centre from the eye, or from its plane in parallel views.
    distance: f32,
    strength: f32,
    extent2: f32,
    // Whether the payload is radiance. That includes samples classified before interpolation.
    is_radiance: bool,
    color: vec3<f32>,
    normal: vec3<f32>,
    facing: f32,
    // Scalars.
    weight: f32,
    slope: vec3<f32>,
    // The projected centre, and the centre in whitened space.
    at: vec2<f32>,
    whitened: vec3<f32>,
    // The whitened ray: its change per pixel to the right and down, and its constant part. The
    // second has no x, the third only z.
    m0: vec3<f32>,
    m1: vec3<f32>,
    m2: vec3<f32>,
    // The cross products of the centre with the first two.
    v0: vec3<f32>,
    v1: vec3<f32>,
    // The distances of the window's inner planes, and the sections in front of the window: 0 or 1.
    near: vec3<f32>,
    base: f32,
}

fn payload_of(a: vec4<f32>, c: vec4<f32>, d: vec4<f32>) -> Loaded {
    var splat: Loaded;
    splat.distance = select(a.z, length(a.xyz), PERSPECTIVE);
    splat.strength = a.w;
    splat.extent2 = abs(c.z);
    splat.weight = 1.0;
    splat.facing = 1.0;
    // The sign of the squared extent says which payload it is.
    splat.is_radiance = RADIANCE_PAYLOAD && (!(SUMS || CLASSIFIED) || c.z > 0.0);
    if TRAINED && c.w > 0.0 {
        let first = bitcast<u32>(d.x);
        let second = bitcast<u32>(d.y);
        let green = (((first >> 16u) & 255u) << 8u) | ((second >> 16u) & 255u);
        splat.color = vec3<f32>(vec3(first & 65535u, green, second & 65535u)) * TRAINED_COLOR;
    } else if RADIANCE_PAYLOAD {
        splat.color = unpack4x8unorm(bitcast<u32>(d.x)).xyz;
        let packed = bitcast<u32>(d.y);
        if packed != NO_NORMAL {
            splat.normal = decode_normal(packed);
        }
    }
    if CLASSIFIED && !splat.is_radiance {
        let classified = classify(0u, a.w);
        splat.color = classified.xyz;
        splat.strength = classified.w * d.w * frame.fields[0].kernel.z;
    }
    if RADIANCE_PAYLOAD && any(splat.normal != vec3(0.0)) {
        splat.facing = facing_weight(splat.normal, a.xyz);
    }
    if SUMS && WEIGHTS {
        splat.weight = d.w;
    }
    if SUMS && SLOPES {
        splat.slope = d.xyz;
    }
    return splat;
}

// Adds any ellipsoid, with centre c and whitening M. Along a pixel's ray direction b: β = M·b; v =
// M·c × β, which is zero at the projected centre and grows linearly from there. ρ² = |v|²/|β|²; the
// closest approach is where |β|²·z = L, at v × β / |β|² in whitened space. All of these are exact
// in perspective. They are computed from vectors, not from expanded polynomials, which cancel
// beside the eye. See docs/engine.md.
fn add_general(f: u32, place: u32, front: u32, first_pixel: vec2<i32>) {
    if STAGED {
        add_loaded(f, staged_general(place), first_pixel);
    } else {
        add_loaded(f, general_of(entries[place], inner_planes(front)), first_pixel);
    }
}

// Returns the splat of an entry.
fn general_of(entry: u32, near: vec3<f32>) -> Loaded {
    let index = first_word(entry);
    let a = records[index];
    let b = records[index + 1u];
    let c = records[index + 2u];
    var splat = payload_of(a, c, records[index + 3u]);
    splat.near = near;
    splat.base = select(0.0, 1.0, (entry & ENTRY_CONTINUED) != 0u);
    if BY_CENTERS {
        // The part that belongs to the second sheet.
        splat.base = clamp((a.z - near.x) / (near.y - near.x), 0.0, 1.0);
    }
    splat.m0 = b.xyz / frame.scale;
    splat.m1 = vec3(0.0, b.w, c.x) / frame.scale;
    splat.m2 = vec3(0.0, 0.0, c.y);
    splat.at = frame.center + frame.scale * a.xy;
    splat.whitened = splat.m2 * a.z;
    splat.v0 = cross(splat.m2, splat.m0);
    splat.v1 = cross(splat.m2, splat.m1);
    if PERSPECTIVE {
        // A centre beside the eye projects to infinity. Moving it by a thousandth of its distance
        // is invisible.
        let least = 1e-3 * length(a.xyz);
        let z = select(a.z, select(-least, least, a.z >= 0.0), abs(a.z) < least);
        splat.at = frame.center + frame.scale * a.xy / z;
        splat.whitened = (splat.m0 * a.x + splat.m1 * a.y) * frame.scale + splat.m2 * z;
        splat.v0 = cross(splat.whitened, splat.m0);
        splat.v1 = cross(splat.whitened, splat.m1);
    }
    return splat;
}

fn add_loaded(f: u32, splat: Loaded, first_pixel: vec2<i32>) {
    // With several fields, high.w marks those whose kernel is in tables.
    let is_table = TABLE_KERNEL && !splat.is_radiance
        && (FIELDS == 1u || frame.fields[f].high.w > 0.0);
    let near = splat.near;
    let base = splat.base;
    let at = splat.at;
    let whitened = splat.whitened;
    let m0 = splat.m0;
    let m1 = splat.m1;
    let m2 = splat.m2;
    let v1 = splat.v1;
    let dx = f32(first_pixel.x) + 0.5 - at.x;
    let v_column = splat.v0 * dx;
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
        // A small splat meets few pixels. Lanes of a GPU that all miss it go on at once; where a
        // driver only masks them, that would save nothing.
        if STAGED && !is_table && rho2 > splat.extent2 {
            continue;
        }
        let t = clamp((size2 * (near * pixels[r].cosine) - l) * inverse, -FAR, FAR);
        // The kernel at the closest approach and on the planes, −h′/r on the planes, and the
        // sections.
        var e = select(0.0, exp(-0.5 * rho2), rho2 <= splat.extent2);
        var on_plane = vec3<f32>();
        var steep = vec3<f32>();
        var along = vec4<f32>();
        if is_table {
            let rho = sqrt(rho2);
            let half = kernel_integral(f, rho, 3e38);
            let inner = vec3(
                kernel_integral(f, rho, t.x),
                kernel_integral(f, rho, t.y),
                kernel_integral(f, rho, t.z),
            );
            along = vec4(
                inner.x + half - 2.0 * half * base,
                inner.y - inner.x,
                inner.z - inner.y,
                half - inner.z,
            );
            let k0 = kernel_at(f, sqrt(rho2 + t.x * t.x));
            let k1 = kernel_at(f, sqrt(rho2 + t.y * t.y));
            let k2 = kernel_at(f, sqrt(rho2 + t.z * t.z));
            on_plane = vec3(k0.x, k1.x, k2.x);
            steep = vec3(k0.y, k1.y, k2.y);
            e = select(0.0, 1.0, rho2 <= splat.extent2);
            along *= e;
        } else {
            along = sections(t, base) * (e * select(SQRT_TAU, 1.0, splat.is_radiance));
            on_plane = exp(-0.5 * t * t) * e;
            steep = on_plane;
        }
        if BY_CENTERS {
            along = vec4(1.0 - base, base, 0.0, 0.0) * e;
            if PERSPECTIVE && l <= 0.0 {
                // The kernel's middle is behind the eye.
                along = vec4(0.0);
            }
        }
        if WHOLE {
            along = vec4(e, 0.0, 0.0, 0.0);
            if is_table {
                along.x = 2.0 * kernel_integral(f, sqrt(rho2), 3e38) * e;
            } else if CLASSIFIED && !splat.is_radiance {
                along.x = e * SQRT_TAU;
            }
            if PERSPECTIVE && l <= 0.0 {
                // The kernel's middle is behind the eye.
                along.x = 0.0;
            }
        }
        // Whitened length to world length along the ray.
        let length_of = inverse / pixels[r].cosine;
        if RADIANCE_PAYLOAD && (splat.is_radiance || CLASSIFIED) {
            var strength = splat.strength;
            if TRAINED && strength < 0.0 {
                strength = trained_depth(-strength * e) / max(e, 1e-30);
            }
            if CLASSIFIED && !splat.is_radiance {
                strength *= length_of;
            }
            if CLIPS + HOLES > 0u && !is_kept(r, l * inverse * length_of) {
                strength = 0.0;
            }
            add_radiance(r, along * strength, splat);
        } else if SUMS {
            var value = vec3(splat.strength);
            let section = along * (length_of * splat.weight);
            on_plane *= splat.weight;
            steep *= splat.weight;
            let nearest = cross(v, beta) * (inverse * inverse);
            let unit = beta * inverse;
            var added = Added();
            added.weight = section;
            added.value = section * splat.strength;
            if SLOPES {
                let slope_along = dot(splat.slope, unit);
                value += dot(splat.slope, nearest) + t * slope_along;
                let g = on_plane;
                let carried = vec4(-g.x, g.x - g.y, g.y - g.z, g.z) * slope_along;
                added.value += section * dot(splat.slope, nearest) + carried * length_of;
            }
            added.face_weight = on_plane;
            added.face_value = on_plane * value;
            if GRADIENTS && !CENTRAL {
                // The change of x′ on a plane per pixel to the right and down.
                var across = array<vec3<f32>, 2>(m0, m1);
                var size = vec3(1.0);
                if PERSPECTIVE {
                    let k = pixels[r].cosine * pixels[r].cosine / frame.scale;
                    across[0] -= beta * (pixels[r].ray.x * k);
                    across[1] -= beta * (pixels[r].ray.y * k);
                    size = near * pixels[r].cosine;
                }
                let x = size * (dot(nearest, across[0]) + t * dot(unit, across[0]));
                let y = size * (dot(nearest, across[1]) + t * dot(unit, across[1]));
                added.weight_x = steep * x;
                added.weight_y = steep * y;
                added.value_x = steep * x * value;
                added.value_y = steep * y * value;
                if SLOPES {
                    added.value_x -= on_plane * size * dot(splat.slope, across[0]);
                    added.value_y -= on_plane * size * dot(splat.slope, across[1]);
                }
            }
            add_to_field(r, f, added);
        }
    }
}

fn add_radiance(r: u32, w: vec4<f32>, splat: Loaded) {
    if SINGLE_SPLATS {
        composite_single(r, w.x, splat);
        return;
    }
    let w_facing = w * splat.facing;
    pixels[r].depth += w;
    pixels[r].facing += w_facing;
    pixels[r].red += w_facing * splat.color.x;
    pixels[r].green += w_facing * splat.color.y;
    pixels[r].blue += w_facing * splat.color.z;
    if SURFACE_SHADED {
        pixels[r].normal_x += w_facing * splat.normal.x;
        pixels[r].normal_y += w_facing * splat.normal.y;
        pixels[r].normal_z += w_facing * splat.normal.z;
    }
}
