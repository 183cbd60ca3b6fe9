// Project: writes the records of a pass's splats, which contain all data that march needs, and the
// tiles and sheets of each.

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> planes: array<f32>;
// Record words before each batch of candidates.
@group(0) @binding(2) var<storage, read> runs: array<u32>;
// The candidates that cull.wgsl found to draw, see active.wgsl.
@group(0) @binding(3) var<storage, read> drawn: array<u32>;
@group(0) @binding(4) var<storage, read_write> records: array<vec4<f32>>;
// The tiles and sheets of each record, for bin.
@group(0) @binding(5) var<storage, read_write> boxes: array<Box>;

fn box_of(span: Span) -> Box {
    return Box(
        span.first_tile.x | (span.first_tile.y << 16u),
        span.last_tile.x | (span.last_tile.y << 16u),
        span.first_sheet | (span.last_sheet << 16u),
    );
}

// Writes the four vec4 of a general record, which add_general in kernels.wgsl reads.
fn write_general(at: u32, splat: Candidate) {
    // Whitening M = L⁻¹ of the covariance L·Lᵀ. The minimum keeps discs much thinner than wide
    // invertible in 32 bits.
    let s = splat.covariance;
    let least = 1e-7 * max(s.xx, max(s.yy, s.zz)) + 1e-37;
    let l00 = sqrt(max(s.xx, least));
    let l10 = s.xy / l00;
    let l20 = s.xz / l00;
    let l11 = sqrt(max(s.yy - l10 * l10, least));
    let l21 = (s.yz - l10 * l20) / l11;
    let l22 = sqrt(max(s.zz - l20 * l20 - l21 * l21, least));
    let i00 = 1.0 / l00;
    let i11 = 1.0 / l11;
    let i22 = 1.0 / l22;
    let i10 = -l10 * i00 * i11;
    let i21 = -l21 * i11 * i22;
    let i20 = -(l20 * i00 + l21 * i10) * i22;
    // The sign of the squared extent tells march which payload it is.
    let extent2 = splat.rim * splat.rim * select(-1.0, 1.0, (source.flags & RADIANCE) != 0u);
    records[at] = vec4(splat.center, splat.strength);
    records[at + 1u] = vec4(i00, i10, i20, i11);
    let is_trained = TRAINED && (source.flags & TRAINED_FLAG) != 0u;
    records[at + 2u] = vec4(i21, i22, extent2, select(0.0, 1.0, is_trained));
    var payload = vec4(bitcast<f32>(splat.color), bitcast<f32>(splat.normal), 0.0, splat.weight);
    if (source.flags & RADIANCE) == 0u {
        if SAMPLE_NORMALS {
            let size = length(splat.gradient);
            payload.y = bitcast<f32>(NO_NORMAL);
            if size > 1e-20 {
                // The normal points to smaller values: outward.
                payload.y = bitcast<f32>(encode_normal(-splat.gradient / size));
            }
        } else if CLASSIFIED {
            payload.y = bitcast<f32>(NO_NORMAL);
        } else if SLOPES {
            // Lᵀ·g: the slope in whitened space.
            let g = splat.gradient;
            payload = vec4(
                l00 * g.x + l10 * g.y + l20 * g.z,
                l11 * g.y + l21 * g.z,
                l22 * g.z,
                splat.weight,
            );
        }
    }
    records[at + 3u] = payload;
}

@compute @workgroup_size(64)
fn project(@builtin(global_invocation_id) id: vec3<u32>) {
    let number = number_of(id);
    if number >= drawn[active_count(source.first_run)] {
        return;
    }
    let place = active_run(source.first_run, number);
    let run = drawn[place];
    var mask = drawn[place + 1u];
    var at = runs[run];
    let start = (run - source.first_run) * RUN;
    let words = record_words(source.flags);
    while mask != 0u {
        let bit = firstTrailingBit(mask);
        mask &= mask - 1u;
        // plan.wgsl makes passes that fit, except for single bands. If a band is too much, bin.wgsl
        // reports it.
        if at + words > frame.record_capacity {
            return;
        }
        let splat = candidate(start + bit);
        if words == 1u {
            records[at] = vec4(splat.center, splat.strength);
        } else if (source.flags & FACETS) != 0u {
            var parts = facet_record(start + bit);
            for (var word = 0u; word < 4u; word++) {
                records[at + word] = parts[word];
            }
        } else {
            write_general(at, splat);
        }
        var box = box_of(locate(splat));
        box.first_tile |= select(0u, BOX_ISOTROPIC, words == 1u);
        if TWO_LEVELS {
            let is_coarse = words == 1u && (source.flags & COARSE) != 0u;
            box.first_tile |= select(0u, BOX_COARSE, is_coarse);
        }
        box.first_tile |= select(0u, BOX_COARSE, (source.flags & FACETS) != 0u);
        boxes[at / RECORD_UNIT] = box;
        // If other records have one word, this one has places where no record begins.
        for (var word = RECORD_UNIT; word < words; word++) {
            boxes[at + word].sheets = NO_BOX;
        }
        at += words;
    }
}
