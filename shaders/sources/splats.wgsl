// Candidates from explicit splats.

@group(1) @binding(0) var<uniform> source: Source;
@group(1) @binding(1) var<storage, read> splats: array<Splat>;

fn candidate_count() -> u32 {
    return source.count;
}

fn candidate(index: u32) -> Candidate {
    return splat_at(index);
}
