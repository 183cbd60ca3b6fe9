// The footprint of an ellipsoidal Gaussian: the pixels and sheets that it covers. Used by measure
// and project.

// A symmetric 3×3 matrix.
struct Symmetric {
    xx: f32,
    xy: f32,
    xz: f32,
    yy: f32,
    yz: f32,
    zz: f32,
}

// A splat in view space, ready to be projected.
struct Candidate {
    center: vec3<f32>,
    covariance: Symmetric,
    extent: f32,
    // The radius beyond which it covers nothing of a pixel. A faint trained Gaussian ends before
    // its extent.
    rim: f32,
    // Value (scalar), or optical depth at the centre (radiance).
    strength: f32,
    color: u32,
    normal: u32,
    // Scalars: the weight, and the change of the value (entries per world unit) in view space.
    weight: f32,
    gradient: vec3<f32>,
}

// The tiles (inclusive) and sheets (inclusive) that a footprint meets.
struct Span {
    visible: bool,
    first_tile: vec2<u32>,
    last_tile: vec2<u32>,
    first_sheet: u32,
    last_sheet: u32,
}

fn quadratic_form(m: Symmetric, v: vec3<f32>) -> f32 {
    return m.xx * v.x * v.x + m.yy * v.y * v.y + m.zz * v.z * v.z
        + 2.0 * (m.xy * v.x * v.y + m.xz * v.x * v.z + m.yz * v.y * v.z);
}

// Returns the number of the field whose samples the candidates are.
fn source_field() -> u32 {
    if FIELDS == 1u {
        return 0u;
    }
    return source.flags >> FIELD_SHIFT;
}

fn middle_of(sheet: u32) -> f32 {
    return 0.5 * (planes[sheet] + planes[sheet + 1u]);
}

// Returns the sheet that contains a distance; 0 in front of the first plane.
fn sheet_of(distance: f32) -> u32 {
    let near = planes[1];
    if distance < near {
        return 0u;
    }
    let turn = planes[1u + frame.geometric_sheets];
    var estimate: f32;
    if distance < turn {
        estimate = 1.0 + floor(log2(distance / near) * frame.ratio_log2_inverse);
    } else {
        estimate = 1.0 + f32(frame.geometric_sheets)
            + floor((distance - turn) * frame.step_inverse);
    }
    var sheet = u32(clamp(estimate, 1.0, f32(frame.sheet_count)));
    // The closed form may be off by one where rounding meets a plane; the list decides.
    if distance < planes[sheet] {
        sheet = sheet - 1u;
    } else if distance >= planes[sheet + 1u] && sheet < frame.sheet_count {
        sheet = sheet + 1u;
    }
    return sheet;
}

// Bounds x/z over an ellipsoid in front of the eye, by the tangents to its silhouette (dual conic);
// exact in perspective. The expanded discriminant has no cancellation for small, distant splats.
// Everything is in units of z, whose fourth power may overflow or underflow 32 bits.
fn tangent_bounds(x: f32, z: f32, xx: f32, xz: f32, zz: f32) -> vec2<f32> {
    let p = x / z;
    let a = xx / z / z;
    let b = xz / z / z;
    let c = zz / z / z;
    let denominator = 1.0 / (1.0 - c);
    let middle = (p - b) * denominator;
    let square = a - 2.0 * b * p + c * p * p - (a * c - b * b);
    let half_width = sqrt(max(square, 0.0)) * abs(denominator);
    return vec2(middle - half_width, middle + half_width);
}

// Bounds x/z conservatively over the part of a box beyond the nearest visible z.
fn box_bounds(x: f32, reach: f32, z_low: f32, z_high: f32) -> vec2<f32> {
    let low = x - reach;
    let high = x + reach;
    return vec2(low / select(z_high, z_low, low < 0.0), high / select(z_low, z_high, high < 0.0));
}

// Factor by which a splat's windows reach beyond the ellipsoid. Mass further away is added to the
// splat's first or last sheet. With 1.25 the pictures of tests/pictures/cases.rs agree to 69 dB or
// better, with 1 to 49 dB; bunny's entries grow by 5 %. An isotropic lattice kernel, wide compared
// with its sheets, does not need this.
const SECTION_OVERREACH: f32 = 1.25;

fn locate(splat: Candidate) -> Span {
    var span: Span;
    span.visible = false;
    if splat.rim <= 0.0 {
        return span;
    }
    let c = splat.center;
    let covariance = splat.covariance;
    let extent = splat.extent;
    let rim = splat.rim;
    let reach_z = extent * sqrt(covariance.zz);
    var distance = c.z;
    var reach = reach_z;
    var far = c.z + reach_z;
    var bounds_x: vec2<f32>;
    var bounds_y: vec2<f32>;
    if frame.perspective != 0u {
        if c.z + reach_z <= frame.z_near {
            return span;
        }
        distance = length(c);
        let toward = c / max(distance, 1e-30);
        reach = extent * sqrt(quadratic_form(covariance, toward));
        let across = extent * extent * (covariance.xx + covariance.yy + covariance.zz);
        far = sqrt((distance + reach) * (distance + reach) + across);
        let rim_z = rim * sqrt(covariance.zz);
        let e2 = rim * rim;
        if c.z - rim_z > frame.z_near {
            bounds_x = tangent_bounds(
                c.x,
                c.z,
                e2 * covariance.xx,
                e2 * covariance.xz,
                e2 * covariance.zz,
            );
            bounds_y = tangent_bounds(
                c.y,
                c.z,
                e2 * covariance.yy,
                e2 * covariance.yz,
                e2 * covariance.zz,
            );
        } else {
            bounds_x = box_bounds(c.x, rim * sqrt(covariance.xx), frame.z_near, c.z + rim_z);
            bounds_y = box_bounds(c.y, rim * sqrt(covariance.yy), frame.z_near, c.z + rim_z);
        }
    } else {
        let reach_x = rim * sqrt(covariance.xx);
        let reach_y = rim * sqrt(covariance.yy);
        bounds_x = vec2(c.x - reach_x, c.x + reach_x);
        bounds_y = vec2(c.y - reach_y, c.y + reach_y);
    }
    // Kernels are not cut along a ray, so near the rim of a footprint the sections reach beyond the
    // ellipsoid. A kernel from a table ends.
    let ends = (source.flags & (ISOTROPIC | ENDS)) != 0u;
    let overreach = select(SECTION_OVERREACH, 1.0, ends);
    far = distance + overreach * (far - distance);
    let near = distance - overreach * reach;
    let last_plane = planes[frame.sheet_count + 1u];
    // Written so that NaN fails.
    if !WHOLE && (!(far > planes[1]) || !(near < last_plane)) {
        return span;
    }
    // Pixels whose centres lie in the box, with a margin for rounding; clamped as floats, so that
    // no infinity is cast.
    let limit = vec2<f32>(frame.size) + f32(APRON);
    // A facet fills parts of pixels whose centres lie beside it.
    let margin = select(0.51, 1.01, (source.flags & FACETS) != 0u);
    let low = frame.center + frame.scale * vec2(bounds_x.x, bounds_y.x) - margin;
    let high = frame.center + frame.scale * vec2(bounds_x.y, bounds_y.y) + margin - 1.0;
    let first = vec2<i32>(ceil(clamp(low, vec2(-f32(APRON)), limit)));
    let last = vec2<i32>(floor(clamp(high, vec2(-f32(APRON) - 1.0), limit - 1.0)));
    if !(first.x <= last.x) || !(first.y <= last.y) {
        return span;
    }
    let top = vec2<i32>(frame.tiles) - 1;
    span.first_tile = vec2<u32>(clamp((first - APRON + TILE_STEP) / TILE_STEP - 1, vec2(0), top));
    span.last_tile = vec2<u32>(clamp((last + APRON) / TILE_STEP, vec2(0), top));
    span.visible = true;
    if WHOLE {
        // A whole splat belongs to the sheet of its centre.
        var place = distance;
        if AXIS_SHEETS {
            place = dot(frame.sheet_normal.xyz, c);
            place = select(place, abs(place), frame.perspective != 0u);
        }
        span.visible = place >= planes[1] && place < last_plane;
        // A depth may be smaller than the distance of the first plane.
        let key = select(place, single_key(c), SINGLE_SPLATS);
        span.first_sheet = clamp(sheet_of(key), 1u, frame.sheet_count);
        if BACK_TO_FRONT {
            span.first_sheet = frame.sheet_count + 1u - span.first_sheet;
        }
        span.last_sheet = span.first_sheet;
        return span;
    }
    if BY_CENTERS {
        span.visible = c.z >= planes[1] && c.z < last_plane;
        var sheet = sheet_of(c.z);
        sheet -= select(0u, 1u, sheet > 0u && c.z < middle_of(sheet));
        span.first_sheet = clamp(sheet, 1u, max(frame.sheet_count, 2u) - 1u);
        span.last_sheet = min(span.first_sheet + 1u, frame.sheet_count);
        return span;
    }
    // Beside the eye, a kernel's middle lies behind the ray's start: the part in front of the first
    // plane must be cut off.
    span.first_sheet = select(
        sheet_of(near),
        0u,
        frame.perspective != 0u && distance < 2.0 * reach,
    );
    span.last_sheet = max(sheet_of(far), 1u);
    return span;
}
