// Images on facets, and their means over pixels. src/facet/image.rs and src/cpu/facets.rs do the
// same.

// The texels of all levels of all images, one after another, row by row: red, green, blue, opacity.
@group(0) @binding(11) var image_texels: texture_2d<u32>;
// What each facet shows, in three words of four: the places of its corners as 32-bit floats; the
// first texel of the image, its width and height, and how many coarser levels follow.
@group(0) @binding(12) var facet_images: texture_2d<u32>;

// Most means along the longer side of a pixel's part of an image.
const MOST_ALONG: f32 = 32.0;

// Iterations of loops since they were last asked for.
var<private> image_iterations: u32;

// Returns what the images of an entry cost, in entries of six iterations, against a driver's limit.
// The driver counts together what eight lanes do, and each may see other facets.
fn image_entries() -> u32 {
    let iterations = image_iterations;
    image_iterations = 0u;
    return iterations * 8u / 6u;
}

fn facet_word(at: u32) -> vec4<u32> {
    let width = textureDimensions(facet_images).x;
    return textureLoad(facet_images, vec2(at % width, at / width), 0);
}

// Returns a texel: its colour times its opacity, and its opacity.
fn image_texel(at: u32) -> vec4<f32> {
    let width = textureDimensions(image_texels).x;
    let texel = unpack4x8unorm(textureLoad(image_texels, vec2(at % width, at / width), 0).x);
    return vec4(texel.xyz * texel.w, texel.w);
}

// Returns the colour of a level at a place, interpolated between four texels.
fn sampled(first: u32, size: vec2<u32>, uv: vec2<f32>) -> vec4<f32> {
    let at = fract(uv) * vec2<f32>(size) - 0.5;
    let start = floor(at);
    let part = at - start;
    let last = size - 1u;
    let low = select(min(vec2<u32>(max(start, vec2(0.0))), last), last, start < vec2(0.0));
    let high = select(low + 1u, vec2(0u), low == last);
    let above = first + low.y * size.x;
    let below = first + high.y * size.x;
    return mix(
        mix(image_texel(above + low.x), image_texel(above + high.x), part.x),
        mix(image_texel(below + low.x), image_texel(below + high.x), part.x),
        part.y,
    );
}

// Returns what a facet shows of its image at a pixel: red, green, blue, and the share that is seen.
// `weights` are those of its corners at the pixel's centre, up to a common factor, `right` and
// `down` their changes per pixel.
fn facet_tint(
    number: u32,
    weights: vec3<f32>,
    right: vec3<f32>,
    down: vec3<f32>,
) -> vec4<f32> {
    let places = bitcast<vec4<f32>>(facet_word(3u * number));
    let more = facet_word(3u * number + 1u);
    let image = facet_word(3u * number + 2u);
    var size = image.yz;
    if size.x == 0u {
        return vec4(1.0);
    }
    let corners = mat3x2<f32>(places.xy, places.zw, bitcast<vec2<f32>>(more.xy));
    // Beside the facet, its nearest place counts.
    let inside = max(weights, vec3(0.0));
    let sum = inside.x + inside.y + inside.z;
    let all = select(1.0, sum, sum > 1e-30);
    let uv = corners * select(vec3(1.0 / 3.0), inside / all, sum > 1e-30);
    let across = (corners * right - uv * (right.x + right.y + right.z)) / all;
    let along = (corners * down - uv * (down.x + down.y + down.z)) / all;
    let wide = length(across * vec2<f32>(size));
    let high = length(along * vec2<f32>(size));
    let coarse = max(min(wide, high) / 3.0, max(wide, high) / MOST_ALONG);
    let level = min(u32(log2(clamp(coarse, 1.0, 1e9))), image.w);
    var first = image.x;
    for (var i = 0u; i < level; i++) {
        first += size.x * size.y;
        size = (size + 1u) / 2u;
    }
    let texel = exp2(f32(level));
    let columns = u32(clamp(ceil(wide / texel), 1.0, MOST_ALONG));
    let rows = u32(clamp(ceil(high / texel), 1.0, MOST_ALONG));
    let to_right = across / f32(columns);
    let to_below = along / f32(rows);
    var seen = vec4(0.0);
    // A single part is the pixel's centre.
    let start = uv - 0.5 * (across + along) + 0.5 * (to_right + to_below);
    for (var row = 0u; row < rows; row++) {
        for (var column = 0u; column < columns; column++) {
            seen += sampled(first, size, start + f32(column) * to_right + f32(row) * to_below);
        }
    }
    if CAN_STOP {
        image_iterations += level + (columns + 2u) * rows;
    }
    if !(seen.w > 0.0) {
        return vec4(0.0);
    }
    return vec4(seen.xyz / seen.w, seen.w / f32(columns * rows));
}
