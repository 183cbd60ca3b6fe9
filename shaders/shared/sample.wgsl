// The samples of a lattice chunk, in the type of their file, packed in 32-bit words.

fn sample_value(index: u32, kind: u32) -> f32 {
    let field = source_field();
    if kind == SAMPLE_U8 {
        return counted(field, f32((samples[index >> 2u] >> (8u * (index & 3u))) & 0xffu));
    }
    if kind == SAMPLE_U16 {
        return counted(field, f32((samples[index >> 1u] >> (16u * (index & 1u))) & 0xffffu));
    }
    if kind == SAMPLE_I16 {
        // Shifted left and back right as a signed number, to extend the sign.
        let bits = samples[index >> 1u] >> (16u * (index & 1u));
        return counted(field, f32(i32(bits << 16u) >> 16u));
    }
    if kind == SAMPLE_I32 {
        // In two parts, because a 32-bit float cannot hold the whole integer.
        let low = samples[index] & 0xffffu;
        return counted_sum(field, f32(i32(samples[index] - low)), f32(low));
    }
    return counted(field, bitcast<f32>(samples[index]));
}
