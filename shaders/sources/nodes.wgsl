// Candidates from a hierarchy: the nodes that cut.wgsl found, each with its share of its optical
// depth.

@group(1) @binding(0) var<uniform> source: Source;
@group(1) @binding(1) var<storage, read> splats: array<Splat>;
// Number of the node, with its share in the upper ten bits; the element behind the last possible
// one is the count.
@group(1) @binding(2) var<storage, read> selected: array<u32>;

fn candidate_count() -> u32 {
    return selected[source.count];
}

fn candidate(order: u32) -> Candidate {
    let packed = selected[order];
    var splat = splat_at(packed & 0x3fffffu);
    let share = f32(packed >> 22u) / 1023.0;
    if TRAINED && splat.strength < 0.0 {
        // Of a trained Gaussian, too, the share is that of its optical depth.
        splat.strength = exp(share * log(1.0 + splat.strength)) - 1.0;
    } else {
        splat.strength = splat.strength * share;
    }
    return splat;
}
