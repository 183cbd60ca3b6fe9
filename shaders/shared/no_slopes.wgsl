// No slopes from neighbouring pixels, and so no barriers among a tile's entries.

fn find_slopes(lane: vec2<u32>) {}
