// The data of a pixel that persists from one dispatch to the next.

// The stored largest value of a pixel that has none, and of a pixel whose largest value is 0.
const STORED_NONE: f32 = 0.0;
const STORED_ZERO: f32 = 1e-37;

fn load_pixel(r: u32, index: u32) {
    let stored = colors[index];
    pixels[r].color = stored.xyz;
    pixels[r].transmittance = 1.0 - stored.w;
    pixels[r].hit = depths[index];
    if MAXIMUM && pixels[r].hit == STORED_NONE {
        pixels[r].hit = NO_VALUE;
    }
}

fn store_pixel(r: u32, index: u32) {
    var color = vec4(pixels[r].color, 1.0 - pixels[r].transmittance);
    var hit = pixels[r].hit;
    if MAXIMUM {
        color = vec4(0.0);
        if hit == NO_VALUE {
            hit = STORED_NONE;
        } else {
            let classified = classify(0u, hit);
            // The opacity of a unit of length, as in the transfer function.
            color = vec4(classified.xyz, 1.0)
                * (1.0 - exp(-classified.w * frame.fields[0].kernel.w));
            hit = select(hit, STORED_ZERO, hit == 0.0);
        }
    } else if AXIS_SHEETS && hit != depths[index] {
        hit = distance_at(r, hit);
    } else if BY_CENTERS && PERSPECTIVE && hit != depths[index] {
        // These sheets lie along the view's axis.
        hit = hit / pixels[r].cosine;
    }
    colors[index] = color;
    depths[index] = hit;
}

// Converts a place along the normal of axis-aligned sheets to the distance along a pixel's ray.
fn distance_at(r: u32, place: f32) -> f32 {
    let slope = dot(frame.sheet_normal.xyz, direction_of(r));
    let start = dot(frame.sheet_normal.xyz, origin_of(r));
    return select((place - start) / slope, place / max(abs(slope), 1e-6), PERSPECTIVE);
}
