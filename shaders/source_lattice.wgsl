// Candidates from a lattice: the samples that select.wgsl found worth drawing. All share one covariance.

@group(1) @binding(0) var<uniform> source: Source;
@group(1) @binding(1) var<storage, read> samples: array<u32>;
// Indices of the selected samples, and behind the last possible one how many there are.
@group(1) @binding(2) var<storage, read> selected: array<u32>;

fn candidate_count() -> u32 {
    return selected[source.count];
}

fn candidate(order: u32) -> Candidate {
    let index = selected[order];
    let row = index / source.lattice.x;
    let slice = row / source.lattice.y;
    let i = f32(index - row * source.lattice.x);
    let j = f32(row - slice * source.lattice.y);
    let k = f32(slice + source.lattice.z);
    var splat: Candidate;
    splat.center = source.origin.xyz + i * source.axis_x.xyz + j * source.axis_y.xyz + k * source.axis_z.xyz;
    let a = source.covariance_a;
    let b = source.covariance_b;
    splat.covariance = Symmetric(a.x, a.y, a.z, a.w, b.x, b.y);
    splat.extent = source.extent;
    splat.strength = sample_value(index, source.lattice.w);
    splat.color = 0u;
    splat.normal = 0u;
    return splat;
}
