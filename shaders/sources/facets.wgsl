// Candidates from facets.

@group(1) @binding(0) var<uniform> source: Source;
@group(1) @binding(1) var<storage, read> facets: array<Facet>;

// A facet as it is stored. Mirrors src/facet/mod.rs.
struct Facet {
    // The corners one after another.
    corners: array<f32, 9>,
    normals: array<u32, 3>,
    colors: array<u32, 3>,
}

fn candidate_count() -> u32 {
    return source.count;
}

// Returns a corner in view space.
fn corner_of(index: u32, corner: u32) -> vec3<f32> {
    let at = 3u * corner;
    let place = vec3(
        facets[index].corners[at],
        facets[index].corners[at + 1u],
        facets[index].corners[at + 2u],
    );
    return source.axis_x.xyz * place.x + source.axis_y.xyz * place.y + source.axis_z.xyz * place.z
        + source.origin.xyz;
}

// Positive if the back of a facet is seen.
fn away_of(a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> f32 {
    let across = cross(b - a, c - a);
    return select(across.z, dot(across, a), frame.perspective != 0u);
}

// The last normal of a facet that is a rod (src/facet/rod.rs).
const ROD_NORMAL: u32 = 0x40008000u;

fn is_rod(index: u32) -> bool {
    return facets[index].normals[2] == ROD_NORMAL;
}

// Returns the radii at the ends of a rod, and the least radius in pixels.
fn radii_of(index: u32) -> vec3<f32> {
    return vec3(facets[index].corners[6], facets[index].corners[7], facets[index].corners[8]);
}

// Returns an ellipsoid around a rod, widened by a pixel.
fn around_rod(index: u32) -> Candidate {
    let a = corner_of(index, 0u);
    let b = corner_of(index, 1u);
    let radii = radii_of(index);
    var splat: Candidate;
    splat.center = 0.5 * (a + b);
    splat.extent = 1.0;
    splat.rim = 1.0;
    splat.normal = NO_NORMAL;
    let f = 0.5 * (b - a);
    let half = length(f);
    var pixel = 1.0 / frame.scale;
    if frame.perspective != 0u {
        pixel *= length(splat.center) + half;
    }
    let radius = max(max(radii.x, radii.y), radii.z * pixel) + pixel;
    // Reaches x along and y across add up to at most √((1 + e)·x² + (1 + 1/e)·y²), for any e.
    let e = max(radius / max(half, 1e-30), 0.5);
    let along = 1.0 + e;
    let across = radius * radius * (1.0 + 1.0 / e);
    splat.covariance.xx = along * f.x * f.x + across;
    splat.covariance.xy = along * f.x * f.y;
    splat.covariance.xz = along * f.x * f.z;
    splat.covariance.yy = along * f.y * f.y + across;
    splat.covariance.yz = along * f.y * f.z;
    splat.covariance.zz = along * f.z * f.z + across;
    return splat;
}

// Returns a flat ellipsoid around a facet: the ellipse through its corners with the same centroid
// (Steiner), widened by a pixel.
fn candidate(index: u32) -> Candidate {
    if is_rod(index) {
        return around_rod(index);
    }
    let a = corner_of(index, 0u);
    let b = corner_of(index, 1u);
    let c = corner_of(index, 2u);
    var splat: Candidate;
    splat.center = (a + b + c) / 3.0;
    splat.extent = 1.0;
    splat.rim = 1.0;
    let f = a - splat.center;
    let g = (b - c) * 0.57735027;
    var pixel = 1.0 / frame.scale;
    if frame.perspective != 0u {
        pixel = pixel * (length(splat.center) + length(f) + length(g));
    }
    splat.covariance.xx = f.x * f.x + g.x * g.x + pixel * pixel;
    splat.covariance.xy = f.x * f.y + g.x * g.y;
    splat.covariance.xz = f.x * f.z + g.x * g.z;
    splat.covariance.yy = f.y * f.y + g.y * g.y + pixel * pixel;
    splat.covariance.yz = f.y * f.z + g.y * g.z;
    splat.covariance.zz = f.z * f.z + g.z * g.z + pixel * pixel;
    splat.normal = NO_NORMAL;
    if (source.flags & CULLED) != 0u && away_of(a, b, c) >= 0.0 {
        // Behind everything that is drawn.
        splat.center = vec3(0.0, 0.0, -1e18);
    }
    return splat;
}

// Returns the four vectors of a facet's record, which add_facet reads: the corners with their
// normals, then the colours and the side. Of a rod they are the ends with the radii there, then the
// least radius, the normal and whether the rod is round, then the colours (add_rod).
fn facet_record(index: u32) -> array<vec4<f32>, 4> {
    let a = corner_of(index, 0u);
    let b = corner_of(index, 1u);
    let c = corner_of(index, 2u);
    let to_view = mat3x3<f32>(source.axis_x.xyz, source.axis_y.xyz, source.axis_z.xyz);
    if is_rod(index) {
        let radii = radii_of(index);
        let packed = facets[index].normals[0];
        let turned = encode_normal(to_view * decode_normal(packed));
        let normal = bitcast<f32>(select(turned, NO_NORMAL, packed == NO_NORMAL));
        return array<vec4<f32>, 4>(
            vec4(a, radii.x),
            vec4(b, radii.y),
            vec4(radii.z, normal, f32(facets[index].normals[1]), bitcast<f32>(ROD_NORMAL)),
            vec4(
                bitcast<f32>(facets[index].colors[0]),
                bitcast<f32>(facets[index].colors[1]),
                0.0,
                1.0,
            ),
        );
    }
    var normals: array<f32, 3>;
    for (var i = 0u; i < 3u; i++) {
        let packed = facets[index].normals[i];
        let turned = encode_normal(to_view * decode_normal(packed));
        normals[i] = bitcast<f32>(select(turned, NO_NORMAL, packed == NO_NORMAL));
    }
    // On a set that winds in any way, all facets count as fronts.
    let is_front = away_of(a, b, c) < 0.0 || (source.flags & MIXED) != 0u;
    // 1, or 1 more than the facet's number among those that show images, counted from 1; a half if
    // the facet ends at the clips already.
    var number = f32(select(1u, 1u + source.lattice.x + index, source.lattice.x > 0u));
    if (source.flags & CUT) != 0u {
        number = 0.5;
    }
    return array<vec4<f32>, 4>(
        vec4(a, normals[0]),
        vec4(b, normals[1]),
        vec4(c, normals[2]),
        vec4(
            bitcast<f32>(facets[index].colors[0]),
            bitcast<f32>(facets[index].colors[1]),
            bitcast<f32>(facets[index].colors[2]),
            select(-number, number, is_front),
        ),
    );
}
