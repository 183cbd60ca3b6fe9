// Rods in march: segments with a radius and round ends. src/cpu/rods.rs does the same;
// src/reference/rods.rs has the definition.

// The last normal of a facet that is a rod.
const ROD: u32 = 0x40008000u;
// Rays whose squared sine to a rod is smaller run along the rod.
const LEAST_SINE_SQUARED: f32 = 1e-10;
const HALF_PI: f32 = 1.5707963;
// How far rods reach beyond a joint where they have an outline, in pixels.
const OVERLAP: f32 = 0.25;

fn add_rod(entry: u32, front: u32, first_pixel: vec2<i32>) {
    let index = first_word(entry);
    let first = records[index];
    let second = records[index + 1u];
    let third = records[index + 2u];
    let last = records[index + 3u];
    let along = second.xyz - first.xyz;
    let length2 = dot(along, along);
    let radii = vec2(first.w, second.w);
    let least_pixels = third.x;
    // The normal of a flat rod, or the direction of the rod before a round one.
    let normal = normal_or_none(bitcast<u32>(third.y));
    let is_round = third.z > 0.5;
    // Another rod begins at the end.
    let is_joined = third.z > 1.5;
    let color_from = unpack4x8unorm(bitcast<u32>(last.x)).xyz;
    let color_to = unpack4x8unorm(bitcast<u32>(last.y)).xyz;
    let continued = (entry & ENTRY_CONTINUED) != 0u;
    for (var r = 0u; r < ROWS; r++) {
        let way = direction_of(r);
        // Everything across the ray is small, so that nothing cancels.
        var to = first.xyz - origin_of(r);
        let to_depth = dot(to, way);
        let depth = dot(along, way);
        to -= way * to_depth;
        let across = along - way * depth;
        let across2 = dot(across, across);
        let nearest = clamp(-dot(to, across) / max(across2, 1e-30), 0.0, 1.0);
        let aside = to + across * nearest;
        let away = length(aside);
        let before = to_depth + depth * nearest;
        // The size of a pixel there.
        var pixel = 1.0 / frame.scale;
        if PERSPECTIVE {
            pixel *= max(before * pixels[r].cosine, 1e-30);
        }
        let radius = max(mix(radii.x, radii.y, nearest), pixel * least_pixels);
        let inside = clamp((radius - away) / pixel + 0.5, 0.0, 1.0);
        let beyond = clamp((radius + away) / pixel + 0.5, 0.0, 1.0);
        let size = min((radius * HALF_PI + sqrt(across2)) / pixel, 1.0);
        let share = max(inside + beyond - 1.0, 0.0) * size;
        var counts = share > LEAST_SHARE_ADDED && (!PERSPECTIVE || before > 0.0);
        if !counts {
            continue;
        }
        var distance = before;
        var part = nearest;
        var surface_normal = normal;
        if is_round && share < 1.0 {
            // On the outline of round ends at joints, the outline is that of the other rod.
            let slack = pixel * OVERLAP;
            let is_beyond = is_joined && -dot(to + across, across) > slack * sqrt(across2);
            let is_before = dot(to, across) > 0.0 && dot(to, normal) > slack;
            if is_beyond || is_before {
                continue;
            }
        }
        if is_round {
            // The middle of what the pixel sees of the rod across: nearer than the outline.
            let middle = 0.5 * (min(away + 0.5 * pixel, radius) + max(away - 0.5 * pixel, -radius));
            if away > 1e-30 {
                to -= aside * (1.0 - middle / away);
            }
            part = 0.0;
            if length2 > 0.0 {
                let square = max(across2, LEAST_SINE_SQUARED * length2);
                let on_line = -dot(to, across) / square;
                let off = to + across * on_line;
                let chord = sqrt(max(radius * radius - dot(off, off), 0.0));
                part = on_line - chord * sqrt(length2) / sqrt(square) * depth / length2;
            }
            // The ball around that place of the segment touches the rod's surface where the ray
            // enters.
            part = clamp(part, 0.0, 1.0);
            let off = to + across * part;
            let height = sqrt(max(radius * radius - dot(off, off), 0.0));
            distance = to_depth + depth * part - height;
            surface_normal = -off - way * height;
        }
        if CLIPS + HOLES > 0u {
            counts = is_kept(r, distance);
        }
        if counts {
            var color = mix(color_from, color_to, part);
            if SURFACE_SHADED && any(surface_normal != vec3(0.0)) {
                color = lit(r, color, surface_normal, distance);
            }
            add_cover(r, front, continued, ROD_SIDE, share, share, distance, color);
        }
    }
}
