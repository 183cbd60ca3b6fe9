// Tally: counts how many nodes each possible cut would draw. A node is drawn by cuts between two
// sizes: below its parent's, and above its own, where it fades out. Counters hold differences from
// one cut to the next.

@group(0) @binding(6) var<storage, read_write> tally: array<atomic<i32>>;

// Eight counters an octave, the first for a cut of 2^-8 pixels.
const TALLY_STEPS: f32 = 8.0;
const TALLY_FIRST: f32 = -8.0;
const TALLY_COUNT: u32 = 256u;

fn step_of(wide: f32) -> f32 {
    return clamp(
        (log2(max(wide, 1e-30)) - TALLY_FIRST) * TALLY_STEPS,
        -1.0,
        f32(TALLY_COUNT) - 1.0,
    );
}

@compute @workgroup_size(64)
fn count(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let run = run_of(invocation.x / SHARERS);
    for (var i = run.x + invocation.x % SHARERS; i < run.y; i += SHARERS) {
        let node = nodes[i];
        if is_hidden(i, node) {
            continue;
        }
        var first = 0u;
        if has_children(node) {
            first = u32(
                floor(step_of(pixels(node.center, node.radius, node.size) / BLEND_BAND)) + 1.0,
            );
        }
        var end = TALLY_COUNT - 1u;
        if node.parent_size >= 0.0 {
            end = u32(max(
                ceil(step_of(pixels(node.parent_center, node.parent_radius, node.parent_size))),
                0.0,
            ));
        }
        if first < end {
            atomicAdd(&tally[first], 1);
            atomicSub(&tally[end], 1);
        }
    }
}
