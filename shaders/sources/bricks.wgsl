// Candidates from a volume in bricks: the samples of one level that select_bricks.wgsl selected.

@group(1) @binding(0) var<uniform> source: Source;
@group(1) @binding(1) var<storage, read> samples: array<u32>;
// Numbers of the selected samples: slot, then sample in its brick.
@group(1) @binding(2) var<storage, read> selected: array<u32>;
// For each slot, the place of its first sample in the level.
@group(1) @binding(3) var<uniform> slots: array<vec4<u32>, 512>;

fn candidate_count() -> u32 {
    return source.slices.w;
}

fn candidate(order: u32) -> Candidate {
    let number = selected[order];
    let within = vec3(number, number >> 5u, number >> 10u) & vec3(31u);
    let steps = vec3<f32>(slots[number >> 15u].xyz + within);
    let a = source.covariance_a;
    let b = source.covariance_b;
    var splat: Candidate;
    splat.covariance = Symmetric(a.x, a.y, a.z, a.w, b.x, b.y);
    splat.center = source.origin.xyz + steps.x * source.axis_x.xyz + steps.y * source.axis_y.xyz
        + steps.z * source.axis_z.xyz;
    splat.extent = source.extent;
    splat.rim = source.extent;
    splat.strength = sample_value(number, source.lattice.w);
    splat.color = 0u;
    splat.normal = NO_NORMAL;
    let levels = frame.fields[source_field()].levels;
    splat.weight = select(levels.x, levels.y, (source.flags & COARSE) != 0u);
    return splat;
}
