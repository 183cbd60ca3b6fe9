// Sources whose candidates are no facets.

fn facet_record(index: u32) -> array<vec4<f32>, 4> {
    return array<vec4<f32>, 4>();
}
