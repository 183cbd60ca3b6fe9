// The field of a label map: the label of the nearest sample, and the gradient of that label's mask.
// At a sample of the label, the mask is the share of the label around that sample; at another, it
// is what that sample's own label leaves. Mirrors src/cpu/field/labels.rs.

// The share of each sample's own label around it, 255 for all. Rows are packed as those of bytes.
@group(1) @binding(1) var shares: texture_3d<u32>;

// Returns the shares of four samples along x.
fn shares_at(first: i32, y: i32, z: i32) -> vec4<f32> {
    let at = vec3(first >> 2u, y, z);
    let word = joined(
        textureLoad(shares, at, 0).x,
        textureLoad(shares, at + vec3(1, 0, 0), 0).x,
        8u * (u32(first) & 3u),
    );
    return vec4(
        f32(word & 0xffu),
        f32((word >> 8u) & 0xffu),
        f32((word >> 16u) & 0xffu),
        f32(word >> 24u),
    );
}

// Returns four samples of the mask of a label, as row_at has it.
fn mask_at(taps: Taps, label: f32, y: i32, z: i32) -> vec4<f32> {
    let share = shares_at(taps.first.x, y, z);
    return select(255.0 - share, share, row_at(taps, y, z) == vec4(label));
}

// Returns the change of a label's mask per step along each axis. In loops, because Mesa's software
// Vulkan takes ten times as long to compile the sixteen rows one by one.
fn mask_slopes(taps: Taps, label: f32) -> vec3<f32> {
    var sum = vec4(0.0);
    var sum_y = vec4(0.0);
    var sum_z = vec4(0.0);
    for (var k = 0; k < 4; k++) {
        for (var j = 0; j < 4; j++) {
            let row = taps.z[k] * taps.y[j] * mask_at(taps, label, taps.rows[j], taps.slices[k]);
            sum += row;
            sum_y += OFFSETS[j] * row;
            sum_z += OFFSETS[k] * row;
        }
    }
    return slopes_of_sums(taps, sum, sum_y, sum_z) * (1.0 / 255.0);
}

// Returns the label of the sample nearest to a place.
fn label_at(taps: Taps, place: vec3<f32>) -> f32 {
    let last = vec3<f32>(frame.fields[0].lattice.xyz - 1u);
    let nearest = vec3<i32>(clamp(floor(place + 0.5), vec3(0.0), last));
    let row = row_at(taps, nearest.y, nearest.z);
    let is_nearest = vec4(0, 1, 2, 3) == vec4(nearest.x - taps.first.x);
    return dot(select(vec4(0.0), row, is_nearest), vec4(1.0));
}

// Resolves a sheet: the label in the middle of the part of the ray that counts.
fn resolve_label(r: u32, sheet: u32, field: ptr<function, Sheet>) {
    let begin = max(planes[sheet], pixels[r].fields[0].inside.x);
    let end = min(planes[sheet + 1u], pixels[r].fields[0].inside.y);
    let distance = 0.5 * (begin + end);
    let taps = taps_at(r, distance);
    let label = label_at(taps, place_at(r, distance));
    var face: Face;
    face.has_value = true;
    face.value = counted_mean(label);
    // What is not seen needs no light.
    if GRADIENTS && (*field).has_value && classify(0u, face.value).w > 0.0 {
        add_gradient(r, mask_slopes(taps, label), &face);
    }
    (*field).front = face;
    (*field).inside = face;
    (*field).back = face;
    (*field).value = face.value;
}
