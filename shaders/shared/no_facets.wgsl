// A picture without facets: see facets.wgsl.

const FACET_VECTORS: u32 = 0u;

fn add_facet(entry: u32, front: u32, first_pixel: vec2<i32>) {}

fn cover(r: u32, sheet: u32) {}

fn save_facets(r: u32, at: u32) {}

fn restore_facets(r: u32, at: u32) {}
