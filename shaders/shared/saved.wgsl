// The saved state of tiles that march stops among their entries: the position of each invocation,
// and the sums of its pixels. It lies in slots behind the colours of the picture. A tile takes a
// slot when it first stops, and frees the slot when it is finished. The sums are saved exactly, so
// a tile that stops draws the same as without a stop.

// Vectors of a pixel: the position of its invocation, then 8 of radiance, then 8 of each field,
// then those of facets.
const FIRST_FIELD_VECTOR: u32 = 9u;
const FIRST_FACET_VECTOR: u32 = FIRST_FIELD_VECTOR + 8u * FIELDS;
const SAVED_VECTORS: u32 = FIRST_FACET_VECTOR + FACET_VECTORS;
const NO_SLOT: u32 = 0xffffffffu;

fn saved_at(slot: u32, lane: vec2<u32>, r: u32) -> u32 {
    let pixel = (lane.y * ROWS + r) * 8u + lane.x;
    return frame.size.x * frame.size.y + (slot * 64u + pixel) * SAVED_VECTORS;
}

// Takes a free slot. If there is none, the tile starts again once other tiles are done.
fn claim_slot() -> u32 {
    let slots = (arrayLength(&colors) - frame.size.x * frame.size.y) / (64u * SAVED_VECTORS);
    for (var word = 0u; word < SLOT_WORDS; word++) {
        let at = progress_word(SLOTS + word);
        let free = ~atomicLoad(&progress[at]);
        if free != 0u {
            let bit = firstTrailingBit(free);
            if 32u * word + bit >= slots {
                return NO_SLOT;
            }
            if (atomicOr(&progress[at], 1u << bit) & (1u << bit)) == 0u {
                return 32u * word + bit;
            }
        }
    }
    return NO_SLOT;
}

fn free_slot(slot: u32) {
    atomicAnd(&progress[progress_word(SLOTS + slot / 32u)], ~(1u << (slot % 32u)));
}

fn save(slot: u32, lane: vec2<u32>, walk: vec4<u32>) {
    for (var r = 0u; r < ROWS; r++) {
        let at = saved_at(slot, lane, r);
        colors[at] = bitcast<vec4<f32>>(walk);
        for (var f = 0u; f < FIELDS; f++) {
            save_field(r, f, at + FIRST_FIELD_VECTOR + 8u * f);
        }
        if RADIANCE_PAYLOAD {
            colors[at + 1u] = pixels[r].depth;
            colors[at + 2u] = pixels[r].facing;
            colors[at + 3u] = pixels[r].red;
            colors[at + 4u] = pixels[r].green;
            colors[at + 5u] = pixels[r].blue;
        }
        if SURFACE_SHADED {
            colors[at + 6u] = pixels[r].normal_x;
            colors[at + 7u] = pixels[r].normal_y;
            colors[at + 8u] = pixels[r].normal_z;
        }
        save_facets(r, at + FIRST_FACET_VECTOR);
    }
}

fn restore(slot: u32, lane: vec2<u32>) -> vec4<u32> {
    for (var r = 0u; r < ROWS; r++) {
        let at = saved_at(slot, lane, r);
        for (var f = 0u; f < FIELDS; f++) {
            restore_field(r, f, at + FIRST_FIELD_VECTOR + 8u * f);
        }
        if RADIANCE_PAYLOAD {
            pixels[r].depth = colors[at + 1u];
            pixels[r].facing = colors[at + 2u];
            pixels[r].red = colors[at + 3u];
            pixels[r].green = colors[at + 4u];
            pixels[r].blue = colors[at + 5u];
        }
        if SURFACE_SHADED {
            pixels[r].normal_x = colors[at + 6u];
            pixels[r].normal_y = colors[at + 7u];
            pixels[r].normal_z = colors[at + 8u];
        }
        restore_facets(r, at + FIRST_FACET_VECTOR);
    }
    return bitcast<vec4<u32>>(colors[saved_at(slot, lane, 0u)]);
}

fn save_field(r: u32, f: u32, at: u32) {
    let field = pixels[r].fields[f];
    let front = field.front;
    if SUMS {
        colors[at] = field.weight;
        colors[at + 1u] = field.value;
        colors[at + 2u] = vec4(field.face_weight, front.value);
        colors[at + 3u] = vec4(field.face_value, select(0.0, 1.0, front.has_value));
    }
    if SUMS && GRADIENTS {
        colors[at + 4u] = vec4(field.weight_x, front.slope.x);
        colors[at + 5u] = vec4(field.weight_y, front.slope.y);
        colors[at + 6u] = vec4(field.value_x, 0.0);
        colors[at + 7u] = vec4(field.value_y, 0.0);
    }
}

fn restore_field(r: u32, f: u32, at: u32) {
    if SUMS {
        let face_weight = colors[at + 2u];
        let face_value = colors[at + 3u];
        pixels[r].fields[f].weight = colors[at];
        pixels[r].fields[f].value = colors[at + 1u];
        pixels[r].fields[f].face_weight = face_weight.xyz;
        pixels[r].fields[f].face_value = face_value.xyz;
        pixels[r].fields[f].front.value = face_weight.w;
        pixels[r].fields[f].front.has_value = face_value.w > 0.0;
    }
    if SUMS && GRADIENTS {
        let weight_x = colors[at + 4u];
        let weight_y = colors[at + 5u];
        pixels[r].fields[f].weight_x = weight_x.xyz;
        pixels[r].fields[f].weight_y = weight_y.xyz;
        pixels[r].fields[f].front.slope = vec2(weight_x.w, weight_y.w);
        pixels[r].fields[f].value_x = colors[at + 6u].xyz;
        pixels[r].fields[f].value_y = colors[at + 7u].xyz;
    }
}
