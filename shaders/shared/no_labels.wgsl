// A gathered lattice whose samples are quantities: see labels.wgsl.

fn resolve_label(r: u32, sheet: u32, field: ptr<function, Sheet>) {}
