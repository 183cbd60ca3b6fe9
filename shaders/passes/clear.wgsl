// Clear: empties the bins of a pass, and the progress of its tiles.

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> bin_size: vec4<u32>;
@group(0) @binding(2) var<storage, read_write> bins: array<u32>;
@group(0) @binding(3) var<storage, read_write> progress: array<u32>;

const SEGMENT: u32 = 64u;

@compute @workgroup_size(64)
fn clear(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    // Neighbouring invocations clear neighbouring elements.
    for (var i = 0u; i < SEGMENT; i++) {
        let at = (group.x * SEGMENT + i) * 64u + lane;
        if at < bin_size.x {
            bins[at] = 0u;
        }
        if at <= progress_word(LISTED) {
            progress[at] = 0u;
        }
    }
}
