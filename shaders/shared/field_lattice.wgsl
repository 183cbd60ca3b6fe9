// The only field of a picture, gathered from its lattice: at a place it is the weighted mean of the
// samples within reach of the kernel. A Gaussian on a lattice is a product of Gaussians along its
// axes, so four weights an axis replace the 64 kernels in reach. The gradient follows from the
// first moments: ∂E[f]/∂p = (E[n·f] − E[n]·E[f])/σ², with n the sample's index along the axis.
//
// The shader that includes this file declares `visibility`. It has a bit for each sample: whether
// something may be visible at the places nearest to that sample. The bits of each block of 4³
// samples are two words. Behind them it has, for each entry of the transfer function's table, the
// number of visible entries before it. Then follow, for each tile, the sheets in which something
// may be visible, as bits (mark.wgsl).

// The samples in the type of their file. Each row along x is packed in 32-bit words, with padding
// behind its end. It is a texture, because Mesa's software Vulkan reads eight elements of a buffer
// one by one, but eight texels of 32 bits at once.
@group(1) @binding(0) var samples: texture_3d<u32>;

// How far outside the lattice a place may lie and still have a sample in reach, in steps.
const BEYOND_LATTICE: f32 = 1.999;

// Whether samples are bytes, or have 16 bits.
const BYTES: bool = SAMPLE_KIND == SAMPLE_U8 || SAMPLE_KIND == SAMPLE_FOUR;
const HALVES: bool = SAMPLE_KIND == SAMPLE_U16 || SAMPLE_KIND == SAMPLE_I16;

fn word_at(x: i32, y: i32, z: i32) -> u32 {
    return textureLoad(samples, vec3(x, y, z), 0).x;
}

// Returns a 32-bit sample as a value.
fn whole_at(x: i32, y: i32, z: i32) -> f32 {
    let word = word_at(x, y, z);
    if SAMPLE_KIND == SAMPLE_I32 {
        // In two parts, because a 32-bit float cannot hold the whole integer.
        let low = word & 0xffffu;
        return counted_sum(0u, f32(bitcast<i32>(word - low)), f32(low));
    }
    return counted(0u, bitcast<f32>(word));
}

// Returns the 32 bits that begin `shift` bits after the start of the first of two words.
fn joined(first: u32, second: u32, shift: u32) -> u32 {
    return (first >> shift) | ((second << (31u - shift)) << 1u);
}

// Returns four samples along x. Those behind the last sample have no weight, but must be finite
// numbers.
fn row_at(taps: Taps, y: i32, z: i32) -> vec4<f32> {
    let x = taps.word;
    if BYTES {
        var word = word_at(x, y, z);
        if SAMPLE_KIND == SAMPLE_U8 {
            word = joined(word, word_at(x + 1, y, z), taps.shift);
        }
        return vec4(
            f32(word & 0xffu),
            f32((word >> 8u) & 0xffu),
            f32((word >> 16u) & 0xffu),
            f32(word >> 24u),
        );
    }
    if HALVES {
        let middle = word_at(x + 1, y, z);
        let low = joined(word_at(x, y, z), middle, taps.shift);
        let high = joined(middle, word_at(x + 2, y, z), taps.shift);
        if SAMPLE_KIND == SAMPLE_U16 {
            return vec4(f32(low & 0xffffu), f32(low >> 16u), f32(high & 0xffffu), f32(high >> 16u))
                - frame.fields[0].transfer.x;
        }
        let a = bitcast<i32>(low);
        let b = bitcast<i32>(high);
        return vec4(f32((a << 16u) >> 16u), f32(a >> 16u), f32((b << 16u) >> 16u), f32(b >> 16u))
            - frame.fields[0].transfer.x;
    }
    return vec4(
        whole_at(x, y, z),
        whole_at(x + 1, y, z),
        whole_at(x + 2, y, z),
        whole_at(x + 3, y, z),
    );
}

// Converts a mean of row_at's samples to entries of the transfer function's table.
fn counted_mean(mean: f32) -> f32 {
    if BYTES {
        return (mean - frame.fields[0].transfer.x) * frame.fields[0].transfer.y;
    }
    if HALVES {
        return mean * frame.fields[0].transfer.y;
    }
    return mean;
}

// Larger exponents of weights are clamped. They occur only at places outside the lattice, where no
// ray is drawn.
const MOST_EXPONENT: f32 = 30.0;

// Returns the weights of four successive samples along an axis, which add up to 1. They are a
// geometric series times the weights at whole steps, so one exponential suffices.
fn weights_at(place: f32, first: f32, last: f32) -> vec4<f32> {
    // Relative to the second sample.
    let taps = frame.fields[0].taps;
    let q = exp(clamp((place - first - 1.0) * taps.x, -MOST_EXPONENT, MOST_EXPONENT));
    let all = vec4(taps.y / q, 1.0, taps.y * q, taps.z * q * q);
    let weights = select(vec4(0.0), all, first + vec4(0.0, 1.0, 2.0, 3.0) <= vec4(last));
    return weights * (1.0 / ((weights.x + weights.y) + (weights.z + weights.w)));
}

// The data to load and weight the samples around a place: the first sample; the first word along x
// and the shift in it; rows and slices; weights.
struct Taps {
    first: vec3<i32>,
    word: i32,
    shift: u32,
    rows: vec4<i32>,
    slices: vec4<i32>,
    x: vec4<f32>,
    y: vec4<f32>,
    z: vec4<f32>,
}

fn taps_at(r: u32, distance: f32) -> Taps {
    let last = vec3<f32>(frame.fields[0].lattice.xyz - 1u);
    let place = clamp(place_at(r, distance), vec3(-BEYOND_LATTICE), last + BEYOND_LATTICE);
    let first = clamp(floor(place) - 1.0, vec3(0.0), max(last - 3.0, vec3(0.0)));
    let at = vec3<i32>(first);
    let end = vec3<i32>(frame.fields[0].lattice.xyz) - 1;
    var taps: Taps;
    taps.first = at;
    taps.word = at.x;
    if SAMPLE_KIND == SAMPLE_U8 {
        taps.word = at.x >> 2u;
        taps.shift = 8u * (u32(at.x) & 3u);
    } else if HALVES {
        taps.word = at.x >> 1u;
        taps.shift = 16u * (u32(at.x) & 1u);
    }
    taps.rows = min(at.y + vec4(0, 1, 2, 3), vec4(end.y));
    taps.slices = min(at.z + vec4(0, 1, 2, 3), vec4(end.z));
    taps.x = weights_at(place.x, first.x, last.x);
    taps.y = weights_at(place.y, first.y, last.y);
    taps.z = weights_at(place.z, first.z, last.z);
    return taps;
}

// Returns a place on a pixel's ray, in steps of the lattice.
fn place_at(r: u32, distance: f32) -> vec3<f32> {
    return frame.fields[0].origin.xyz + in_steps(0u, origin_of(r))
        + in_steps(0u, direction_of(r)) * distance;
}

// Four rows of a slice, weighted along y, and their first moment.
struct Slice {
    sum: vec4<f32>,
    moment: vec4<f32>,
}

fn slice_with_moment(taps: Taps, z: i32) -> Slice {
    let a = taps.y.x * row_at(taps, taps.rows.x, z);
    let b = taps.y.y * row_at(taps, taps.rows.y, z);
    let c = taps.y.z * row_at(taps, taps.rows.z, z);
    let d = taps.y.w * row_at(taps, taps.rows.w, z);
    return Slice((a + b) + (c + d), (c - a) + 2.0 * d);
}

// Sample offsets for moments, relative to the second of four samples.
const OFFSETS: vec4<f32> = vec4(-1.0, 0.0, 1.0, 2.0);

// Returns the value and the gradient on a plane between two sheets. Labels are looked up within
// sheets, not between them.
fn face_at(r: u32, plane: u32) -> Face {
    if LABELS {
        return Face();
    }
    return field_at(r, planes[plane]);
}

// Returns the same at a distance.
fn field_at(r: u32, distance: f32) -> Face {
    let taps = taps_at(r, distance);
    let a = slice_with_moment(taps, taps.slices.x);
    let b = slice_with_moment(taps, taps.slices.y);
    let c = slice_with_moment(taps, taps.slices.z);
    let d = slice_with_moment(taps, taps.slices.w);
    let sum = (taps.z.x * a.sum + taps.z.y * b.sum) + (taps.z.z * c.sum + taps.z.w * d.sum);
    let sum_y = (taps.z.x * a.moment + taps.z.y * b.moment)
        + (taps.z.z * c.moment + taps.z.w * d.moment);
    let sum_z = 2.0 * taps.z.w * d.sum + (taps.z.z * c.sum - taps.z.x * a.sum);
    var face: Face;
    face.has_value = true;
    face.value = counted_mean(dot(taps.x, sum));
    var slopes = slopes_of_sums(taps, sum, sum_y, sum_z);
    if BYTES || HALVES {
        slopes *= frame.fields[0].transfer.y;
    }
    add_gradient(r, slopes, &face);
    return face;
}

// Returns the change of a field per step along each axis, from the weighted sum of the samples of
// all rows and its first moments along y and z.
fn slopes_of_sums(
    taps: Taps,
    sum: vec4<f32>,
    sum_y: vec4<f32>,
    sum_z: vec4<f32>,
) -> vec3<f32> {
    let moments = vec3(dot(taps.x * OFFSETS, sum), dot(taps.x, sum_y), dot(taps.x, sum_z));
    let means = vec3(dot(taps.x, OFFSETS), dot(taps.y, OFFSETS), dot(taps.z, OFFSETS));
    return (moments - means * dot(taps.x, sum)) * frame.fields[0].taps.x;
}

// Adds the gradient to a face, given the changes of the field per step along each axis.
fn add_gradient(r: u32, slopes: vec3<f32>, face: ptr<function, Face>) {
    let gradient = slopes.x * frame.fields[0].axis_x.xyz + slopes.y * frame.fields[0].axis_y.xyz
        + slopes.z * frame.fields[0].axis_z.xyz;
    let direction = direction_of(r);
    (*face).along = dot(gradient, direction);
    (*face).slope = (gradient - (*face).along * direction).xy * frame.fields[0].gradients.z;
}

// Sheets whose field differs from a straight line by fewer entries of the table have gradients that
// are linear across the ray, and along it the derivative of the parabola of the values.
const STRAIGHT: f32 = 64.0;

// Returns the mean of a sheet: that of the cubic with the values and slopes along the ray of both
// faces (Hermite). With the value in the middle it is exact to the fifth degree (Simpson's rule
// with slopes).
fn mean_of(r: u32, sheet: u32, field: ptr<function, Sheet>) -> f32 {
    let front = (*field).front;
    let back = (*field).back;
    let thickness = planes[sheet + 1u] - planes[sheet];
    let sum = front.value + back.value;
    let bend = (front.along - back.along) * thickness;
    let skew = back.value - front.value - 0.5 * (front.along + back.along) * thickness;
    // Slopes are per thickness of a sheet.
    let turn = abs(back.slope - front.slope);
    let bent = max(max(abs(bend), abs(skew)), max(turn.x, turn.y)) > STRAIGHT;
    if POST || (GRADIENTS && bent) {
        (*field).inside = field_at(r, 0.5 * (planes[sheet] + planes[sheet + 1u]));
        return (sum * 7.0 + (*field).inside.value * 16.0) * (1.0 / 30.0) + bend * (1.0 / 60.0);
    }
    let along = (back.value - front.value) / thickness;
    (*field).front.along = along + 0.5 * bend / thickness;
    (*field).back.along = along - 0.5 * bend / thickness;
    (*field).inside.along = along;
    (*field).inside.slope = 0.5 * (front.slope + back.slope);
    return 0.5 * sum + bend * (1.0 / 12.0);
}

fn sample_shows(place: vec3<f32>) -> bool {
    let dims = frame.fields[0].lattice.xyz;
    let at = vec3<u32>(clamp(floor(place + 0.5), vec3(0.0), vec3<f32>(dims - 1u)));
    let blocks = (dims + 3u) >> vec3(2u);
    let block = at >> vec3(2u);
    let word = 2u * ((block.z * blocks.y + block.y) * blocks.x + block.x) + ((at.z >> 1u) & 1u);
    let bit = ((at.z & 1u) << 4u) | ((at.y & 3u) << 2u) | (at.x & 3u);
    return ((visibility[word] >> bit) & 1u) != 0u;
}

// Whether something may be visible at a pixel in a sheet: around its front, its middle and its
// back.
fn may_show(r: u32, sheet: u32) -> bool {
    let start = planes[sheet];
    let end = planes[sheet + 1u];
    if !(max(pixels[r].fields[0].inside.x, start) < min(pixels[r].fields[0].inside.y, end)) {
        return false;
    }
    return sample_shows(place_at(r, start)) || sample_shows(place_at(r, 0.5 * (start + end)))
        || sample_shows(place_at(r, end));
}

// Whether any value that a sheet may have between the two planes that the pixel's invocation
// evaluated last is visible.
fn range_shows(sheet: u32) -> bool {
    if LABELS {
        return true;
    }
    let front = pixels[0].fields[0].front;
    let back = pixels[0].fields[0].behind;
    // Hermite interpolation: the mean of the ends, plus an eighth of the difference of the slopes
    // there.
    let bend = (front.along - back.along) * (planes[sheet + 1u] - planes[sheet]);
    let middle = 0.5 * (front.value + back.value) + 0.125 * bend;
    let low = min(middle, min(front.value, back.value));
    let high = max(middle, max(front.value, back.value));
    // A parabola exceeds the range of its values at both ends and the middle by at most an eighth
    // of that range. Integrals cover at least NARROW entries.
    let slack = 0.125 * (high - low) + 0.5 * NARROW + 1.0;
    let ends = clamp(
        vec2(low - slack, high + slack) + frame.fields[0].transfer.w,
        vec2(0.0),
        vec2(frame.fields[0].transfer.z),
    );
    let before = frame.fields[0].visibility.x;
    return visibility[before + u32(ends.y) + 1u] > visibility[before + u32(ends.x)];
}

// Returns the next sheet from `sheet` on in which something may be visible in a tile, or `end` if
// there is none before it.
fn next_marked(tile: u32, sheet: u32, end: u32) -> u32 {
    if sheet >= end {
        return end;
    }
    let marks = frame.fields[0].visibility.y + tile * frame.fields[0].visibility.z;
    var word = sheet >> 5u;
    var bits = visibility[marks + word] & (0xffffffffu << (sheet & 31u));
    loop {
        if bits != 0u || (word + 1u) * 32u >= end {
            break;
        }
        word++;
        bits = visibility[marks + word];
    }
    return select(end, min(word * 32u + firstTrailingBit(bits), end), bits != 0u);
}

// Resolves the field of the sheet between the two planes that were evaluated last. The shader that
// includes this file defines shows_field, which says whether the field is wanted there.
fn resolve_field(r: u32, f: u32, sheet: u32, field: ptr<function, Sheet>) {
    (*field).has_value = shows_field(r, sheet);
    (*field).filling = 1.0;
    if LABELS {
        resolve_label(r, sheet, field);
        return;
    }
    (*field).front = pixels[r].fields[0].front;
    (*field).back = pixels[r].fields[0].behind;
    (*field).value = mean_of(r, sheet, field);
}

// Adds a sheet that contains only the field to the picture.
fn composite_field(r: u32, sheet: u32) {
    var field: Sheet;
    resolve_field(r, 0u, sheet, &field);
    var mixture: Mixture;
    mixture.hit = NO_HIT;
    mix_field(r, 0u, sheet, field, &mixture);
    composite(r, sheet, mixture);
}
