// Candidates from a lattice: the samples that select.wgsl selected. On a Cartesian or body-centred
// lattice, all share one covariance.

@group(1) @binding(0) var<uniform> source: Source;
@group(1) @binding(1) var<storage, read> samples: array<u32>;
// Indices of the selected samples.
@group(1) @binding(2) var<storage, read> selected: array<u32>;
// Rectilinear: the coordinate and the unit of every sample along x, then y, then z, two samples an
// element.
@group(1) @binding(3) var<uniform> places: array<vec4<f32>, 4096>;

// The arrangement of a single field is known when the shader is compiled. Several fields carry it
// in their flags.
fn is_body_centred() -> bool {
    return BODY_CENTRED && (FIELDS == 1u || (source.flags & BODY_CENTRED_FLAG) != 0u);
}

fn is_rectilinear() -> bool {
    return RECTILINEAR && (FIELDS == 1u || (source.flags & RECTILINEAR_FLAG) != 0u);
}

fn candidate_count() -> u32 {
    return source.slices.w;
}

// Returns coordinate and unit along an axis.
fn place_along(axis: u32, index: u32) -> vec2<f32> {
    var at = index;
    if axis > 0u {
        at += source.lattice.x;
    }
    if axis > 1u {
        at += source.lattice.y;
    }
    let pair = places[at / 2u];
    return select(pair.xy, pair.zw, (at & 1u) != 0u);
}

fn coordinate(axis: u32, index: u32) -> f32 {
    if is_rectilinear() {
        return place_along(axis, index).x;
    }
    return f32(index);
}

// Returns the value of a sample, from the chunk's slices or the neighbouring slices in its data.
fn value_at(index: vec3<u32>) -> f32 {
    let slice = index.z - source.slices.y;
    return sample_value(
        (slice * source.lattice.y + index.y) * source.lattice.x + index.x,
        source.lattice.w,
    );
}

// Returns the derivative along an axis per step (rectilinear: per coordinate): central if there are
// neighbours on both sides.
fn slope_along(axis: u32, index: vec3<u32>, value: f32) -> f32 {
    // Layers of the same cubic lattice of a body-centred lattice lie two apart.
    let stride = select(1u, 2u, is_body_centred() && axis == 2u);
    let first = select(0u, source.slices.y, axis == 2u);
    let last = select(source.lattice[axis] - 1u, source.slices.z, axis == 2u);
    let has_before = index[axis] >= first + stride;
    let has_after = index[axis] + stride <= last;
    var before = index;
    before[axis] -= select(0u, stride, has_before);
    var after = index;
    after[axis] += select(0u, stride, has_after);
    let scale = select(1.0, 0.5, stride == 2u);
    let here = coordinate(axis, index[axis]);
    let to_before = (here - coordinate(axis, before[axis])) * scale;
    let to_after = (coordinate(axis, after[axis]) - here) * scale;
    let slope_before = (value - value_at(before)) / max(to_before, 1e-30);
    let slope_after = (value_at(after) - value) / max(to_after, 1e-30);
    if has_before && has_after {
        return (slope_after * to_before + slope_before * to_after) / (to_before + to_after);
    }
    return select(select(0.0, slope_before, has_before), slope_after, has_after);
}

fn candidate(order: u32) -> Candidate {
    let number = selected[order];
    let row = number / source.lattice.x;
    let slice = row / source.lattice.y;
    let index = vec3(
        number - row * source.lattice.x,
        row - slice * source.lattice.y,
        slice + source.slices.x,
    );
    let value = value_at(index);
    var steps = vec3<f32>(index);
    if is_body_centred() {
        let displaced = 0.5 * f32(index.z & 1u);
        steps = vec3(steps.xy + displaced, 0.5 * steps.z);
    }
    let a = source.covariance_a;
    let b = source.covariance_b;
    var splat: Candidate;
    splat.covariance = Symmetric(a.x, a.y, a.z, a.w, b.x, b.y);
    if is_rectilinear() {
        let x = place_along(0u, index.x);
        let y = place_along(1u, index.y);
        let z = place_along(2u, index.z);
        steps = vec3(x.x, y.x, z.x);
        splat.covariance = covariance_of(x.y * b.w, y.y * b.w, z.y * b.w);
    }
    splat.center = source.origin.xyz + steps.x * source.axis_x.xyz + steps.y * source.axis_y.xyz
        + steps.z * source.axis_z.xyz;
    splat.extent = source.extent;
    splat.rim = source.extent;
    splat.strength = value;
    splat.color = 0u;
    splat.normal = NO_NORMAL;
    splat.weight = 1.0;
    if (SLOPES && is_rectilinear()) || SAMPLE_NORMALS {
        // Convert the derivatives along the axes to a gradient in view space.
        let slopes = vec3(
            slope_along(0u, index, value),
            slope_along(1u, index, value),
            slope_along(2u, index, value),
        );
        let field = source_field();
        splat.gradient = frame.fields[field].axis_x.xyz * slopes.x
            + frame.fields[field].axis_y.xyz * slopes.y
            + frame.fields[field].axis_z.xyz * slopes.z;
    }
    return splat;
}

// Returns the covariance of a kernel with given standard deviations along the axes, in steps.
fn covariance_of(x: f32, y: f32, z: f32) -> Symmetric {
    let p = x * source.axis_x.xyz;
    let q = y * source.axis_y.xyz;
    let r = z * source.axis_z.xyz;
    return Symmetric(
        p.x * p.x + q.x * q.x + r.x * r.x,
        p.x * p.y + q.x * q.y + r.x * r.y,
        p.x * p.z + q.x * q.z + r.x * r.z,
        p.y * p.y + q.y * q.y + r.y * r.y,
        p.y * p.z + q.y * q.z + r.y * r.z,
        p.z * p.z + q.z * q.z + r.z * r.z,
    );
}
