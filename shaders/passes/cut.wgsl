// Cut: lists the drawn nodes, each with its share. Two entry points around a prefix sum make the
// list, in the same order every time. `count` finds the nodes; `write` puts each invocation's nodes
// behind those of the invocations before.

// Bounds of the nodes of each batch.
@group(1) @binding(0) var<storage, read> bounds: array<Bounds>;
// The number of nodes that each invocation found, later the number found before it. One element
// more than invocations.
@group(1) @binding(1) var<storage, read_write> counts: array<u32>;
// The nodes that each invocation found; each has as many places as it visits nodes.
@group(1) @binding(2) var<storage, read_write> cut_nodes: array<u32>;
// The drawn nodes: number in the chunk, share in the upper ten bits. The element behind the last
// possible one is their number.
@group(1) @binding(3) var<storage, read_write> selected: array<u32>;
// The workgroups that later passes need for them.
@group(1) @binding(4) var<storage, read_write> arguments: array<u32, 3>;

// A sphere around the parents of a batch's nodes, and the largest of the parents' sizes. The size
// is negative if a node is a root. Mirrors src/gpu/scene/nodes.rs.
struct Bounds {
    center: vec3<f32>,
    radius: f32,
    size: f32,
}

// Ten bits of share above the number of the node.
const SHARE_SHIFT: u32 = 22u;
const OWN_NODES: u32 = SELECT_RUN / SHARERS;

@compute @workgroup_size(64)
fn count(
    @builtin(global_invocation_id) invocation: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
) {
    let id = invocation.x;
    let run = run_of(id / SHARERS);
    let parents = bounds[run.x / SELECT_RUN];
    var end = run.y;
    // Allows for rounding on the way to the eye.
    let room = 1e-6 * (length(parents.center) + length(source.origin.xyz));
    if parents.size >= 0.0
        && refinement(pixels(parents.center, parents.radius + room, parents.size)) == 0u {
        end = 0u;
    }
    var listed = 0u;
    for (var i = run.x + id % SHARERS; i < end; i += SHARERS) {
        let node_share = share(i);
        if node_share > 0u {
            cut_nodes[id * OWN_NODES + listed] = i | (node_share << SHARE_SHIFT);
            listed++;
        }
    }
    counts[id] = listed;
    if id + 1u == 64u * workgroups.x {
        counts[id + 1u] = 0u;
    }
}

@compute @workgroup_size(64)
fn write(
    @builtin(global_invocation_id) invocation: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
) {
    let id = invocation.x;
    let at = counts[id];
    let listed = counts[id + 1u] - at;
    for (var i = 0u; i < listed; i++) {
        selected[at + i] = cut_nodes[id * OWN_NODES + i];
    }
    if id + 1u == 64u * workgroups.x {
        let all = at + listed;
        selected[source.count] = all;
        arguments[0] = (all + 64u * RUN - 1u) / (64u * RUN);
        arguments[1] = 1u;
        arguments[2] = 1u;
    }
}
