// Values of a field. Once read, they are in entries of the transfer function's table (tables.wgsl),
// relative to a value within the data. So 32 bits resolve the function, wherever the data's zero is
// and whatever their unit.

// Converts a value of a field's data to entries; the result is clamped so that it stays finite.
fn counted(field: u32, value: f32) -> f32 {
    return counted_sum(field, value, 0.0);
}

// The same for the sum of two numbers.
fn counted_sum(field: u32, large: f32, small: f32) -> f32 {
    let transfer = frame.fields[field].transfer;
    return clamp(((large - transfer.x) + small) * transfer.y, -1e30, 1e30);
}

// The types of samples.
const SAMPLE_U8: u32 = 0u;
const SAMPLE_U16: u32 = 1u;
const SAMPLE_I16: u32 = 2u;
const SAMPLE_I32: u32 = 3u;
const SAMPLE_F32: u32 = 4u;
// Only for a gathered lattice: a word for each sample, with this byte and the three bytes behind
// it.
const SAMPLE_FOUR: u32 = 5u;
