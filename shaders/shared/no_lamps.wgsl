// A picture whose light comes from the eye: see lamps.wgsl.

fn reaching_at(r: u32, distance: f32, normal: vec3<f32>) -> Reaching {
    return Reaching(vec3(0.0), 1.0, 1.0);
}
