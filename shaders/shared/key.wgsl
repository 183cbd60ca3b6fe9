// The order of splats that are composited one by one, for the passes that know the variant.

// Returns what splats are sorted by if they are composited one by one: the distance of their
// centre, or its depth along the view's axis in scenes with trained Gaussians.
fn single_key(center: vec3<f32>) -> f32 {
    return select(center.z, length(center), PERSPECTIVE && !TRAINED);
}
