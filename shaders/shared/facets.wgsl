// Facets in march: the share of each pixel that a triangle fills, and what it adds to the open
// sheets. src/cpu/facets.rs does the same; src/reference/facets.rs has the definition.

// Vectors of a pixel that saved.wgsl saves.
const FACET_VECTORS: u32 = 11u;
// Of surfaces behind each other in one sheet, each counts less by e to the power of minus this for
// every pixel that another is nearer. In all, it counts less by this power at most.
const NEARER: f32 = 4.0;
const FARTHEST: f32 = 60.0;
// Smaller shares of a pixel are not added.
const LEAST_SHARE_ADDED: f32 = 1e-6;
// The sides of a facet.
const FRONT_SIDE: u32 = 0u;
const BACK_SIDE: u32 = 1u;
const ROD_SIDE: u32 = 2u;

// Sums of the facets in the four open sheets.
struct Cover {
    // The shares of the pixel that fronts and backs fill. Rods count as backs, and of several the
    // largest.
    front: vec4<f32>,
    back: vec4<f32>,
    // The shares of what is seen of their images.
    seen: vec4<f32>,
    // Lit colours times shares that are seen.
    red: vec4<f32>,
    green: vec4<f32>,
    blue: vec4<f32>,
    // Shares that count less the farther a facet is; distances and lit colours times these.
    weight: vec4<f32>,
    distance: vec4<f32>,
    near_red: vec4<f32>,
    near_green: vec4<f32>,
    near_blue: vec4<f32>,
}

var<private> covers: array<Cover, ROWS>;

fn perpendicular(a: vec2<f32>, b: vec2<f32>) -> f32 {
    return a.x * b.y - a.y * b.x;
}

// Returns the integral of the part of a pixel to the left of an edge, over the edge's rise inside
// the pixel: positive if the edge goes down. Added up over a polygon's edges it is the area of the
// pixel inside the polygon. Places are relative to the pixel's centre.
fn part_left(start: vec2<f32>, end: vec2<f32>) -> f32 {
    let y = clamp(vec2(start.y, end.y), vec2(-0.5), vec2(0.5));
    let rise = end.y - start.y;
    if !(abs(rise) > 1e-20) {
        return 0.0;
    }
    let part = clamp((y - start.y) / rise, vec2(0.0), vec2(1.0));
    let x = start.x + part * (end.x - start.x);
    let least = min(x.x, x.y);
    let most = max(x.x, x.y);
    let a = clamp(least, -0.5, 0.5);
    let b = clamp(most, -0.5, 0.5);
    let width = most - least;
    var mean = a + 0.5;
    if width >= 1e-5 {
        let sum = (b - a) * ((a + b) * 0.5 + 0.5) + max(most - max(least, 0.5), 0.0);
        mean = sum / width;
    }
    return (y.y - y.x) * mean;
}

fn add_facet(place: u32, front: u32, first_pixel: vec2<i32>) {
    let entry = entry_at(place);
    let index = first_word(entry);
    let first = records[index];
    let second = records[index + 1u];
    let third = records[index + 2u];
    if HAS_RODS && bitcast<u32>(third.w) == ROD {
        add_rod(entry, front, first_pixel);
        return;
    }
    let last = records[index + 3u];
    let a = first.xyz;
    let b = second.xyz;
    let c = third.xyz;
    let normals = mat3x3<f32>(
        normal_or_none(bitcast<u32>(first.w)),
        normal_or_none(bitcast<u32>(second.w)),
        normal_or_none(bitcast<u32>(third.w)),
    );
    let tints = mat3x3<f32>(
        unpack4x8unorm(bitcast<u32>(last.x)).xyz,
        unpack4x8unorm(bitcast<u32>(last.y)).xyz,
        unpack4x8unorm(bitcast<u32>(last.z)).xyz,
    );
    let z = vec3(a.z, b.z, c.z);
    var is_before = true;
    var nearness = vec3(1.0);
    let across = cross(b - a, c - a);
    var away = across.z;
    if PERSPECTIVE {
        is_before = all(z > vec3(frame.z_near));
        nearness = 1.0 / z;
        away = dot(across, a);
    }
    let turn = select(1.0, -1.0, away < 0.0);
    let place_a = frame.center + a.xy * (frame.scale * nearness.x);
    let place_b = frame.center + b.xy * (frame.scale * nearness.y);
    let place_c = frame.center + c.xy * (frame.scale * nearness.z);
    // The weights of the corners along a ray, up to a common factor (Olano & Greer 1997).
    let toward = select(vec3(1.0), z, PERSPECTIVE);
    let edges = mat3x3<f32>(
        cross(vec3(b.xy, toward.y), vec3(c.xy, toward.z)),
        cross(vec3(c.xy, toward.z), vec3(a.xy, toward.x)),
        cross(vec3(a.xy, toward.x), vec3(b.xy, toward.y)),
    );
    let continued = (entry & ENTRY_CONTINUED) != 0u;
    for (var r = 0u; r < ROWS; r++) {
        let pixel = vec2<f32>(first_pixel + vec2(0, i32(r))) + 0.5;
        var share = 0.0;
        var weights = vec3<f32>();
        if is_before {
            let to_a = place_a - pixel;
            let to_b = place_b - pixel;
            let to_c = place_c - pixel;
            share = turn
                * (part_left(to_a, to_b) + part_left(to_b, to_c) + part_left(to_c, to_a));
            weights = vec3(
                perpendicular(to_b, to_c),
                perpendicular(to_c, to_a),
                perpendicular(to_a, to_b),
            ) * nearness * turn;
        } else {
            // A corner beside or behind the eye has no place in the picture: whether the ray
            // through the pixel's centre meets the facet (Olano & Greer 1997).
            let ray = vec3(pixels[r].ray, 1.0);
            weights = vec3(dot(cross(b, c), ray), dot(cross(c, a), ray), dot(cross(a, b), ray))
                * turn;
            share = select(0.0, 1.0, all(weights >= vec3(0.0)));
        }
        weights = max(weights, vec3(0.0));
        let sum = weights.x + weights.y + weights.z;
        weights = select(vec3(1.0 / 3.0), weights / max(sum, 1e-30), sum > 1e-30);
        let distance = dot(z, weights) / pixels[r].cosine;
        var counts = share > LEAST_SHARE_ADDED;
        if CLIPS + HOLES > 0u {
            // Facets that were cut before end at the clips.
            counts = counts && (abs(last.w) < 1.0 || is_kept(r, distance));
        }
        var tint = vec4(1.0);
        // The share that is seen.
        var seen = share;
        if HAS_IMAGES && counts && abs(last.w) > 1.0 {
            // Only what lies in this window is needed.
            counts = distance < planes[front + 4u]
                && (!continued || distance >= planes[front + 1u]);
            if counts {
                let ray = vec3((pixel - frame.center) / frame.scale, 1.0);
                tint = facet_tint(
                    u32(abs(last.w)) - 2u,
                    (ray * edges) * turn,
                    vec3(edges[0].x, edges[1].x, edges[2].x) * (turn / frame.scale),
                    vec3(edges[0].y, edges[1].y, edges[2].y) * (turn / frame.scale),
                );
                seen *= tint.w;
                counts = seen > LEAST_SHARE_ADDED;
            }
        }
        if counts {
            var color = (tints * weights) * tint.xyz;
            // Facets without normals keep their colours.
            if SURFACE_SHADED && any(normals[0] != vec3(0.0)) {
                color = lit(r, color, normals * weights, distance);
            }
            let side = select(BACK_SIDE, FRONT_SIDE, last.w > 0.0);
            add_cover(r, front, continued, side, share, seen, distance, color);
        }
    }
}

// Adds what a facet or rod covers of a pixel to the open sheets. `seen` is the part of the share
// that is seen, if the facet shows an image.
fn add_cover(
    r: u32,
    front: u32,
    continued: bool,
    side: u32,
    share: f32,
    seen: f32,
    distance: f32,
    color: vec3<f32>,
) {
    let ahead = vec4(
        planes[front],
        planes[front + 1u],
        planes[front + 2u],
        planes[front + 3u],
    );
    let behind = vec4(ahead.yzw, planes[front + 4u]);
    let is_inside = vec4(distance) < behind;
    let is_past = vec4(distance) >= ahead;
    var lanes = select(vec4(0.0), vec4(1.0), is_inside & is_past);
    lanes.x = select(select(0.0, 1.0, is_inside.x), 0.0, continued);
    var start = ahead.x;
    start = select(start, ahead.y, is_past.y);
    start = select(start, ahead.z, is_past.z);
    start = select(start, ahead.w, is_past.w);
    var size = 1.0;
    if PERSPECTIVE {
        size = max(start, 1e-30);
    }
    let afar = clamp((distance - start) * (NEARER * frame.scale / size), 0.0, FARTHEST);
    // Of the share, what is seen.
    let visible = lanes * seen;
    let near = visible * exp(-afar);
    if HAS_RODS && side == ROD_SIDE {
        // Where rods meet, they fill the same part of a pixel.
        covers[r].back = max(covers[r].back, lanes * share);
    } else if side == FRONT_SIDE {
        covers[r].front += lanes * share;
    } else {
        covers[r].back += lanes * share;
    }
    if HAS_IMAGES || HAS_RODS {
        covers[r].seen += visible;
    }
    covers[r].red += visible * color.x;
    covers[r].green += visible * color.y;
    covers[r].blue += visible * color.z;
    covers[r].weight += near;
    covers[r].distance += near * distance;
    covers[r].near_red += near * color.x;
    covers[r].near_green += near * color.y;
    covers[r].near_blue += near * color.z;
}

// Composites the facets of the front lane's sheet, behind the rest of the sheet, and shifts the
// lane out.
fn cover(r: u32, sheet: u32) {
    let sums = covers[r];
    covers[r].front = shift(sums.front);
    covers[r].back = shift(sums.back);
    if HAS_IMAGES || HAS_RODS {
        covers[r].seen = shift(sums.seen);
    }
    covers[r].red = shift(sums.red);
    covers[r].green = shift(sums.green);
    covers[r].blue = shift(sums.blue);
    covers[r].weight = shift(sums.weight);
    covers[r].distance = shift(sums.distance);
    covers[r].near_red = shift(sums.near_red);
    covers[r].near_green = shift(sums.near_green);
    covers[r].near_blue = shift(sums.near_blue);
    var all = sums.front.x + sums.back.x;
    if !(all > 0.0) || sheet < stage.first_sheet || sheet >= stage.end_sheet {
        return;
    }
    let weight = max(sums.weight.x, 1e-37);
    let seen = select(all, max(sums.seen.x, 1e-37), HAS_IMAGES || HAS_RODS);
    if HAS_RODS {
        // Of rods, `back` has the largest share only.
        all = max(all, seen);
    }
    let hidden = clamp(all - 1.0, 0.0, 1.0);
    let mean = vec3(sums.red.x, sums.green.x, sums.blue.x) / seen;
    let nearest = vec3(sums.near_red.x, sums.near_green.x, sums.near_blue.x) / weight;
    let color = clamp(mix(mean, nearest, hidden * hidden), vec3(0.0), vec3(1.0));
    let before = pixels[r].transmittance;
    // At a fold, both sides fill the same part of a pixel.
    let filled = min(max(sums.front.x, sums.back.x), 1.0);
    let opacity = select(1.0, min(seen / filled, 1.0), HAS_IMAGES || HAS_RODS);
    let whole = opacity * opacity;
    let share = min(filled * mix(before, 1.0, whole * whole), before) * opacity;
    let left = before - share;
    pixels[r].color += share * color;
    if before > 0.5 && left <= 0.5 {
        pixels[r].hit = sums.distance.x / weight;
    }
    pixels[r].transmittance = left;
}

fn save_facets(r: u32, at: u32) {
    let sums = covers[r];
    colors[at] = sums.front;
    colors[at + 1u] = sums.back;
    colors[at + 2u] = sums.red;
    colors[at + 3u] = sums.green;
    colors[at + 4u] = sums.blue;
    colors[at + 5u] = sums.weight;
    colors[at + 6u] = sums.distance;
    colors[at + 7u] = sums.near_red;
    colors[at + 8u] = sums.near_green;
    colors[at + 9u] = sums.near_blue;
    colors[at + 10u] = sums.seen;
}

fn restore_facets(r: u32, at: u32) {
    covers[r].front = colors[at];
    covers[r].back = colors[at + 1u];
    covers[r].red = colors[at + 2u];
    covers[r].green = colors[at + 3u];
    covers[r].blue = colors[at + 4u];
    covers[r].weight = colors[at + 5u];
    covers[r].distance = colors[at + 6u];
    covers[r].near_red = colors[at + 7u];
    covers[r].near_green = colors[at + 8u];
    covers[r].near_blue = colors[at + 9u];
    covers[r].seen = colors[at + 10u];
}
