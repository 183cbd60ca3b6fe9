// Scan: exclusive prefix sum in place, over up to 2^24 numbers. Each invocation sums a segment, one
// workgroup scans the sums, and each invocation then adds them to its segment.

@group(0) @binding(0) var<uniform> size: vec4<u32>;
@group(0) @binding(1) var<storage, read_write> numbers: array<u32>;
@group(0) @binding(2) var<storage, read_write> segments: array<u32>;

const SEGMENT: u32 = 64u;

var<workgroup> lane_sums: array<u32, 256>;

@compute @workgroup_size(64)
fn sum(@builtin(global_invocation_id) id: vec3<u32>) {
    let start = id.x * SEGMENT;
    if start >= size.x {
        return;
    }
    var total = 0u;
    for (var i = start; i < min(start + SEGMENT, size.x); i++) {
        total += numbers[i];
    }
    segments[id.x] = total;
}

@compute @workgroup_size(256)
fn spine(@builtin(local_invocation_index) lane: u32) {
    let count = (size.x + SEGMENT - 1u) / SEGMENT;
    let share = (count + 255u) / 256u;
    var total = 0u;
    for (var i = lane * share; i < min((lane + 1u) * share, count); i++) {
        total += segments[i];
    }
    lane_sums[lane] = total;
    workgroupBarrier();
    if lane == 0u {
        var before = 0u;
        for (var i = 0u; i < 256u; i++) {
            let lane_sum = lane_sums[i];
            lane_sums[i] = before;
            before += lane_sum;
        }
    }
    workgroupBarrier();
    var before = lane_sums[lane];
    for (var i = lane * share; i < min((lane + 1u) * share, count); i++) {
        let segment_sum = segments[i];
        segments[i] = before;
        before += segment_sum;
    }
}

@compute @workgroup_size(64)
fn spread(@builtin(global_invocation_id) id: vec3<u32>) {
    let start = id.x * SEGMENT;
    if start >= size.x {
        return;
    }
    var before = segments[id.x];
    for (var i = start; i < min(start + SEGMENT, size.x); i++) {
        let value = numbers[i];
        numbers[i] = before;
        before += value;
    }
}
