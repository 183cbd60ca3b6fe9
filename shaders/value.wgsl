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
