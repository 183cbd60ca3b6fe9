// A picture whose facets show no images: see images.wgsl.

fn image_entries() -> u32 {
    return 0u;
}

fn facet_tint(
    number: u32,
    weights: vec3<f32>,
    right: vec3<f32>,
    down: vec3<f32>,
) -> vec4<f32> {
    return vec4(1.0);
}
