// A picture without rods: see rods.wgsl.

const ROD: u32 = 0x40008000u;

fn add_rod(entry: u32, front: u32, first_pixel: vec2<i32>) {}
