// Values of a field. From where they are read on they are counted in entries of the transfer function's table (tables.wgsl), from
// a value among the data's on, so that 32 bits tell apart what the function does, wherever the data's zero and whatever their unit
// is.

// A value of the data in entries; finite, however far.
fn counted(value: f32) -> f32 {
    return counted_sum(value, 0.0);
}

// The same of the sum of two numbers.
fn counted_sum(large: f32, small: f32) -> f32 {
    return clamp(((large - frame.transfer.x) + small) * frame.transfer.y, -1e30, 1e30);
}

// The types of samples.
const SAMPLE_U8: u32 = 0u;
const SAMPLE_U16: u32 = 1u;
const SAMPLE_I16: u32 = 2u;
const SAMPLE_I32: u32 = 3u;
const SAMPLE_F32: u32 = 4u;
// Of a gathered lattice alone: a word for each sample, of this byte and the three behind it.
const SAMPLE_FOUR: u32 = 5u;
