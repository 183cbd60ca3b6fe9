// Closes a sheet at one pixel: resolves its sums, classifies and shades it, and composites it.

// A sheet with less optical depth than this has no colour: such a small sum may be a rounding
// remainder of the sections that a splat's windows add and take back. The limit for fields is
// `isotropic.w`, with a margin for kernels of both signs.
const LEAST_DEPTH: f32 = 1e-5;
// Optical depth that counts as opaque.
const MOST_DEPTH: f32 = 20.0;

// The largest channel of a trained Gaussian: see splat.rs.
const BRIGHTEST_TRAINED: f32 = 65535.0 / 8192.0;

// Beside trained Gaussians, a sheet is fully lit from the inverse of this share of normals on.
const LIT_BY: f32 = 2.0;

// The light that reaches a place: the mean direction of that from all sides, in view space, its
// amount, and the share of the key lamp's light.
struct Reaching {
    side: vec3<f32>,
    open: f32,
    key: f32,
}

// From the smallest length on, a surface's normal is certain.
const CERTAIN: vec2<f32> = vec2(0.0, 1e30);

// Returns how far a normal counts: from the magnitude certain.x on, up to 1. certain.y is one over
// the magnitudes over which it comes to count in full.
fn certainty_of(normal: vec3<f32>, certain: vec2<f32>) -> f32 {
    let size = length(normal);
    return select(0.0, clamp((size - certain.x) * certain.y, 0.0, 1.0), size > 1e-20);
}

// Returns the normal towards the eye, as long as it is certain.
fn turned(normal: vec3<f32>, direction: vec3<f32>, certain: vec2<f32>) -> vec3<f32> {
    let size = select(1.0, -1.0, dot(normal, direction) > 0.0) / max(length(normal), 1e-20);
    return normal * (certainty_of(normal, certain) * size);
}

// Returns a gradient of any length, towards the eye.
fn towards_eye(r: u32, gradient: vec3<f32>) -> vec3<f32> {
    return select(gradient, -gradient, dot(gradient, direction_of(r)) > 0.0);
}

// Returns the share of the light from the eye that a surface gets, and the cosine of its highlight.
// They are the same.
fn from_the_eye(normal: vec3<f32>, direction: vec3<f32>) -> vec2<f32> {
    return vec2(min(abs(dot(normal, direction)) / max(length(normal), 1e-20), 1.0));
}

// The same with light from beside the eye.
fn from_sides(normal: vec3<f32>, direction: vec3<f32>) -> vec2<f32> {
    let facing = from_the_eye(normal, direction).x;
    let way = turned(normal, direction, CERTAIN);
    let half = frame.surface_half.xyz;
    // A surface that is seen from its edge may be turned to the eye by either side.
    let counts = min(10.0 * facing, 1.0);
    let towards = counts * max(dot(frame.surface_sides.xyz, way), 0.0);
    return vec2(
        min(frame.surface_sides.w * facing + towards, 1.0),
        select(facing, clamp(dot(half, way), 0.0, 1.0), any(half != vec3(0.0))),
    );
}

// Returns the factor on a colour, and the highlight that is added to it, by Blinn's model (1977) on
// both sides of a surface. `eye` has the share of the light from the eye, and the cosine of its
// highlight. `certain` also has how far the normal counts in all.
fn light_of(
    normal: vec3<f32>,
    direction: vec3<f32>,
    eye: vec2<f32>,
    shade: vec4<f32>,
    certain: vec3<f32>,
    reaching: Reaching,
) -> vec2<f32> {
    let size = length(normal);
    let share = certain.z * certainty_of(normal, certain.xy);
    let shown = 1.0 - share * (1.0 - eye.x);
    let gloss = share * shade.z * pow(max(eye.y, 1e-6), shade.w);
    // A field without light has a negative power.
    if !LAMPS || shade.w < 0.0 {
        return vec2(shade.x + shade.y * shown, gloss);
    }
    let way = select(normal, -normal, dot(normal, direction) > 0.0) / max(size, 1e-20);
    // In the open there is no more.
    let most = 1.0 + 2.0 * share * dot(frame.sky_side.xyz, way);
    let open = max(min(reaching.open + 2.0 * share * dot(reaching.side, way), most), 0.0);
    let head = frame.lamp_shares.x;
    let key = frame.lamp_shares.y * reaching.key;
    let towards = frame.key_direction.xyz;
    let cosine = clamp(dot(towards, way), 0.0, 1.0);
    let half = normalize(towards - direction);
    let lamp_gloss = share * shade.z * pow(clamp(dot(half, way), 1e-6, 1.0), shade.w);
    return vec2(
        open * (shade.x + shade.y * (head * shown + frame.lamp_shares.z))
            + key * shade.y * (1.0 - share * (1.0 - cosine)),
        open * head * gloss + select(0.0, key * lamp_gloss, cosine > 0.0),
    );
}

// Returns the lit colour of a surface at a distance along a pixel's ray. The normal may have any
// length.
fn lit(r: u32, color: vec3<f32>, normal: vec3<f32>, distance: f32) -> vec3<f32> {
    let direction = direction_of(r);
    let reaching = reaching_at(r, distance, turned(normal, direction, CERTAIN));
    let eye = from_sides(normal, direction);
    let shade = frame.surface_shade;
    let light = light_of(normal, direction, eye, shade, vec3(CERTAIN, 1.0), reaching);
    return min(color * light.x + light.y, vec3(1.0));
}

// Returns a lit colour of the field.
fn lit_field(
    r: u32,
    f: u32,
    color: vec3<f32>,
    gradient: vec3<f32>,
    counts: f32,
    reaching: Reaching,
) -> vec3<f32> {
    let direction = direction_of(r);
    let shade = frame.fields[f].shade;
    let certain = vec3(frame.fields[f].certain.xy, counts);
    let eye = from_the_eye(gradient, direction);
    let light = light_of(gradient, direction, eye, shade, certain, reaching);
    return min(color * light.x + light.y, vec3(1.0));
}

// The same for a part of a sheet, in its mean light: gradients change more within a part than
// values do. The light is taken at four places, without a loop, which march would pay for.
fn lit_piece(
    r: u32,
    f: u32,
    medium: Medium,
    color: vec3<f32>,
    place: f32,
    next_place: f32,
) -> vec3<f32> {
    let step = 0.125 * (next_place - place);
    let light = 0.25 * (light_at(r, f, medium, place + step)
        + light_at(r, f, medium, place + 3.0 * step)
        + light_at(r, f, medium, place + 5.0 * step)
        + light_at(r, f, medium, place + 7.0 * step));
    return min(color * light.x + light.y, vec3(1.0));
}

// Returns the light that reaches a place in a sheet.
fn reaching_in(medium: Medium, place: f32) -> Reaching {
    return Reaching(
        mix(medium.reaching.side, medium.beyond.side, place),
        mix(medium.reaching.open, medium.beyond.open, place),
        mix(medium.reaching.key, medium.beyond.key, place),
    );
}

// Returns the light of the field at a place in a sheet.
fn light_at(r: u32, f: u32, medium: Medium, place: f32) -> vec2<f32> {
    let gradient = gradient_at(r, f, medium, place);
    let direction = direction_of(r);
    let shade = frame.fields[f].shade;
    let certain = vec3(frame.fields[f].certain.xy, medium.share);
    let eye = from_the_eye(gradient, direction);
    return light_of(gradient, direction, eye, shade, certain, reaching_in(medium, place));
}

// Converts a slope per pixel to the slope across the picture on the plane at a distance. Gradients
// are in table entries per thickness of a sheet, approximately (`gradients`), so that their
// squares fit 32 bits in any units.
fn slope_on_plane(r: u32, f: u32, slope: vec2<f32>, distance: f32) -> vec2<f32> {
    let size = select(1.0, pixels[r].cosine * distance, PERSPECTIVE);
    return slope * frame.fields[f].gradients.w / size;
}

// Returns the gradient in view space, from the slope across the picture and the derivative along
// the ray.
fn gradient(r: u32, slope: vec2<f32>, along: f32) -> vec3<f32> {
    let d = direction_of(r);
    let g = slope + along * d.xy;
    return vec3(g, (along - dot(g, d.xy)) / d.z);
}

fn shift(sums: vec4<f32>) -> vec4<f32> {
    return vec4(sums.yzw, 0.0);
}

// Everything in a sheet, mixed.
struct Mixture {
    // Colour times optical depth, and optical depth.
    color: vec3<f32>,
    depth: f32,
    // The nearest distance at which an isosurface absorbed half of the light.
    hit: f32,
}

// The distance of an isosurface that is not met.
const NO_HIT: f32 = 3e38;

fn is_in_pass(sheet: u32) -> bool {
    return sheet >= stage.first_sheet && sheet < stage.end_sheet;
}

// Resolves the radiance of the front lane and shifts it out.
fn resolve_radiance(r: u32, sheet: u32) -> Mixture {
    var mixture: Mixture;
    mixture.hit = NO_HIT;
    if RADIANCE_PAYLOAD && !SINGLE_SPLATS {
        let depth = pixels[r].depth.x;
        let sum = vec3(pixels[r].red.x, pixels[r].green.x, pixels[r].blue.x);
        // If next to nothing faces the eye, rounding may have left a weight of any sign; the result
        // must stay a colour.
        let brightest = vec3(select(1.0, BRIGHTEST_TRAINED, TRAINED));
        var color = clamp(sum / max(pixels[r].facing.x, 1e-12), vec3(0.0), brightest);
        if SURFACE_SHADED {
            let normal = vec3(pixels[r].normal_x.x, pixels[r].normal_y.x, pixels[r].normal_z.x);
            // Splats without a normal keep their colours.
            if dot(normal, normal) > 0.0 {
                let middle = 0.5 * (planes[sheet] + planes[sheet + 1u]);
                let lit_color = lit(r, color, normal, middle);
                // The share of what is lit: Gaussians are not.
                let share = LIT_BY * length(normal) / max(pixels[r].facing.x, 1e-12);
                color = mix(color, lit_color, select(1.0, min(share, 1.0), TRAINED));
            }
            pixels[r].normal_x = shift(pixels[r].normal_x);
            pixels[r].normal_y = shift(pixels[r].normal_y);
            pixels[r].normal_z = shift(pixels[r].normal_z);
        }
        if depth >= LEAST_DEPTH && is_in_pass(sheet) {
            mixture.color = depth * color;
            mixture.depth = depth;
        }
        pixels[r].facing = shift(pixels[r].facing);
        pixels[r].depth = shift(pixels[r].depth);
        pixels[r].red = shift(pixels[r].red);
        pixels[r].green = shift(pixels[r].green);
        pixels[r].blue = shift(pixels[r].blue);
    }
    return mixture;
}

// The field of a sheet, composited front to back.
struct Medium {
    // Transmitted light, and the optical depth that absorbed the rest.
    through: f32,
    depth: f32,
    // Lit colour times opacity.
    color: vec3<f32>,
    // The field along the ray: values at the front, in the parabola's middle and at the back; the
    // sheet's thickness.
    curve: vec3<f32>,
    thickness: f32,
    // The slopes across the picture at both faces.
    front: vec2<f32>,
    back: vec2<f32>,
    // A gathered lattice: the slope across the picture in the middle, and the derivatives along the
    // ray at the front, in the middle and at the back.
    inside: vec2<f32>,
    along: vec3<f32>,
    // The light that reaches the front of the sheet, and its back.
    reaching: Reaching,
    beyond: Reaching,
    // How far gradients count behind a clip.
    share: f32,
    // The largest value.
    peak: f32,
    // The distance at which an isosurface absorbed half of the light.
    hit: f32,
}

const NO_VALUE: f32 = -3e38;

// Returns the gradient at a place. That of a gathered lattice is known at the faces and in the
// middle, and a parabola in between. Otherwise it is interpolated between the faces across the
// picture; along the ray it is the derivative of the values' parabola, which knows more of the
// inside.
fn gradient_at(r: u32, f: u32, medium: Medium, u: f32) -> vec3<f32> {
    if GATHER {
        let shares = vec3((1.0 - u) * (1.0 - 2.0 * u), 4.0 * u * (1.0 - u), u * (2.0 * u - 1.0));
        return gradient(
            r,
            shares.x * medium.front + shares.y * medium.inside + shares.z * medium.back,
            dot(shares, medium.along) * frame.fields[f].gradients.z,
        );
    }
    let curve = medium.curve;
    let along = curve.x * (4.0 * u - 3.0) + curve.y * (4.0 - 8.0 * u) + curve.z * (4.0 * u - 1.0);
    return gradient(
        r,
        mix(medium.front, medium.back, u),
        along * (frame.fields[f].gradients.z / medium.thickness),
    );
}

// Adds the part of a sheet between two distances. The field there is a parabola with the values of
// the faces at the ends and the sheet's mean.
fn pass_piece(
    r: u32,
    f: u32,
    sheet: u32,
    field: Sheet,
    begin: f32,
    end: f32,
    medium: ptr<function, Medium>,
) {
    let start = planes[sheet];
    let thickness = (*medium).thickness;
    let curve = (*medium).curve;
    let step = (end - begin) / f32(PARTS);
    var place = (begin - start) / thickness;
    var value = parabola(curve, place);
    for (var part = 0u; part < PARTS; part++) {
        let near = begin + f32(part) * step;
        let next_place = (near + step - start) / thickness;
        let next = parabola(curve, next_place);
        if MAXIMUM {
            (*medium).peak = max((*medium).peak, max(value, next));
        } else {
            var classified = vec4<f32>();
            if POST {
                classified = classify(f, field.value);
                classified = vec4(classified.xyz * classified.w, classified.w);
            } else {
                classified = classify_between(f, value, next);
            }
            var normal = vec3<f32>();
            if GRADIENT_OPACITY {
                normal = gradient_at(r, f, *medium, 0.5 * (place + next_place));
                classified *= gradient_factor(f, length(normal));
            }
            // Differences of integrals: rounding remainders, where nothing is visible, must stay a
            // colour.
            let depth = max(classified.w, 0.0) * step * field.filling;
            var color = clamp(classified.xyz / max(classified.w, 1e-20), vec3(0.0), vec3(1.0));
            if VOLUME_SHADED {
                color = lit_piece(r, f, *medium, color, place, next_place);
            }
            var done = 0.0;
            for (var i = 0u; i < ISOSURFACES; i++) {
                let number = select(ISOSURFACES - 1u - i, i, next > value);
                let surface = frame.fields[f].isosurfaces[number];
                let level = surface.value.x;
                if (value < level) != (next < level) {
                    let share = (level - value) / (next - value);
                    pass_part(depth * (share - done), color, medium);
                    done = share;
                    pass_surface(
                        r,
                        f,
                        surface,
                        mix(place, next_place, share),
                        near + step * share,
                        medium,
                    );
                }
            }
            pass_part(depth * (1.0 - done), color, medium);
        }
        place = next_place;
        value = next;
    }
}

fn parabola(curve: vec3<f32>, u: f32) -> f32 {
    if !PARABOLA {
        return (curve.x + 4.0 * curve.y + curve.z) / 6.0;
    }
    return curve.x * (1.0 - u) * (1.0 - 2.0 * u) + 4.0 * curve.y * u * (1.0 - u)
        + curve.z * u * (2.0 * u - 1.0);
}

// Returns the share of light that an optical depth absorbs, 1 − e^−τ. For small τ, subtracting from
// 1 would lose the result in rounding.
fn taken(depth: f32) -> f32 {
    return select(1.0 - exp(-depth), depth * (1.0 - 0.5 * depth), depth < 1e-3);
}

// Minimum optical depth that is divided by: far below what is visible, far above the smallest
// float.
const LEAST_DIVISOR: f32 = 1e-20;

fn pass_part(depth: f32, color: vec3<f32>, medium: ptr<function, Medium>) {
    let share = (*medium).through * taken(depth);
    (*medium).color += share * color;
    (*medium).through -= share;
    (*medium).depth += depth;
}

fn pass_surface(
    r: u32,
    f: u32,
    surface: Isosurface,
    place: f32,
    distance: f32,
    medium: ptr<function, Medium>,
) {
    let share = (*medium).through * surface.value.y;
    let before = pixels[r].transmittance * (*medium).through;
    (*medium).through -= share;
    (*medium).depth += surface.value.z;
    if before > 0.5 && pixels[r].transmittance * (*medium).through <= 0.5 {
        (*medium).hit = distance;
    }
    var color = surface.color.xyz;
    if VOLUME_SHADED {
        let gradient = gradient_at(r, f, *medium, place);
        let reaching = reaching_in(*medium, place);
        color = lit_field(r, f, color, gradient, (*medium).share, reaching);
    }
    (*medium).color += share * color;
}

// Returns how far the gradients of a sheet count behind the last clip before its end, by the depth
// of its middle.
fn behind_clips(r: u32, f: u32, sheet: u32) -> f32 {
    let middle = 0.5 * (planes[sheet] + planes[sheet + 1u]);
    var entered = pixels[r].kept.x;
    for (var i = 0u; i < HOLES; i++) {
        let hole = pixels[r].holes[i];
        let is_before = hole.x < hole.y && hole.y < planes[sheet + 1u];
        entered = select(entered, max(entered, hole.y), is_before);
    }
    return clamp((middle - entered) * frame.fields[f].certain.z, 0.0, 1.0);
}

// Returns a field's medium of a sheet, inside the box of the samples and what the clips leave.
fn pass_field(r: u32, f: u32, sheet: u32, field: Sheet) -> Medium {
    var medium: Medium;
    medium.through = 1.0;
    medium.peak = NO_VALUE;
    medium.hit = NO_HIT;
    let front = select(field.value, field.front.value, field.front.has_value);
    let back = select(field.value, field.back.value, field.back.has_value);
    medium.curve = vec3(front, 1.5 * field.value - 0.25 * (front + back), back);
    medium.thickness = planes[sheet + 1u] - planes[sheet];
    if GRADIENTS && (field.front.has_value || field.back.has_value) {
        medium.front = select(field.back.slope, field.front.slope, field.front.has_value);
        medium.back = select(field.front.slope, field.back.slope, field.back.has_value);
        if GATHER {
            medium.inside = field.inside.slope;
            medium.along = vec3(field.front.along, field.inside.along, field.back.along);
        }
    }
    medium.share = 1.0;
    if VOLUME_SHADED && CLIPS + HOLES > 0u {
        medium.share = behind_clips(r, f, sheet);
    }
    if VOLUME_SHADED && LAMPS {
        let certain = frame.fields[f].certain.xy;
        let mean = (towards_eye(r, gradient_at(r, f, medium, 0.0))
            + towards_eye(r, gradient_at(r, f, medium, 0.5))
            + towards_eye(r, gradient_at(r, f, medium, 1.0))) / 3.0;
        let normal = medium.share * turned(mean, direction_of(r), certain);
        medium.reaching = reaching_at(r, planes[sheet], normal);
        medium.beyond = reaching_at(r, planes[sheet + 1u], normal);
    }
    var begin = max(planes[sheet], pixels[r].fields[f].inside.x);
    let last = min(planes[sheet + 1u], pixels[r].fields[f].inside.y);
    if HOLES == 0u {
        if begin < last {
            pass_piece(r, f, sheet, field, begin, last, &medium);
        }
        return medium;
    }
    for (var piece = 0u; piece <= HOLES; piece++) {
        // Skip the holes that contain `begin`; leaving one may lead into another.
        for (var i = 0u; i < HOLES * HOLES; i++) {
            let hole = pixels[r].holes[i % HOLES_OR_ONE];
            begin = select(begin, hole.y, hole.x <= begin && begin < hole.y);
        }
        var end = last;
        for (var i = 0u; i < HOLES; i++) {
            let hole = pixels[r].holes[i];
            end = select(end, min(end, hole.x), hole.x > begin && hole.x < hole.y);
        }
        if begin < end {
            pass_piece(r, f, sheet, field, begin, end, &medium);
        }
        begin = max(begin, end);
    }
    return medium;
}

// Adds a field's medium of a sheet to the mixture.
fn mix_field(r: u32, f: u32, sheet: u32, field: Sheet, mixture: ptr<function, Mixture>) {
    // A gathered field may remain from sheets before the pass.
    if !field.has_value || !(GATHER || is_in_pass(sheet)) {
        return;
    }
    var medium = pass_field(r, f, sheet, field);
    if MAXIMUM {
        pixels[r].hit = max(pixels[r].hit, medium.peak);
        return;
    }
    // Converts opacity to optical depth: τ / (1 − e^−τ). For small τ that ratio would lose its
    // digits.
    let depth = min(medium.depth, MOST_DEPTH);
    let ratio = select(depth / (1.0 - exp(-depth)), 1.0 + 0.5 * depth, depth < 1e-2);
    (*mixture).color += ratio * medium.color;
    (*mixture).depth += depth;
    (*mixture).hit = min((*mixture).hit, medium.hit);
}

// Adds a sheet to the picture.
fn composite(r: u32, sheet: u32, mixture: Mixture) {
    let depth = mixture.depth;
    if MAXIMUM || !(depth > LEAST_DIVISOR) {
        return;
    }
    let premultiplied = select(mixture.color, vec3(depth), XRAY);
    let before = pixels[r].transmittance;
    let share = before * taken(depth);
    let left = before - share;
    pixels[r].color += share / depth * premultiplied;
    // Inside the sheet, optical depth counts as evenly spread; an isosurface counts at its exact
    // place.
    if mixture.hit < NO_HIT {
        pixels[r].hit = mixture.hit;
    } else if before > 0.5 && left <= 0.5 {
        pixels[r].hit = mix(planes[sheet], planes[sheet + 1u], log(2.0 * before) / depth);
    }
    pixels[r].transmittance = left;
}
