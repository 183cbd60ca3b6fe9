// Cut: the list of the nodes that are drawn, each with its share. Two entry points around a prefix sum keep the list in the
// order of the nodes: count, which finds them, then write, which lays what each run found behind the runs before.

// How many nodes each run draws, later how many the runs before do; one more than runs.
@group(0) @binding(6) var<storage, read_write> runs: array<u32>;
// The drawn nodes: number in the chunk, share in the upper ten bits. The element behind the last possible one is how many.
@group(0) @binding(7) var<storage, read_write> selected: array<u32>;
// The workgroups that later passes need for them.
@group(0) @binding(8) var<storage, read_write> arguments: array<u32, 3>;
// What each run found, from its first place on.
@group(0) @binding(9) var<storage, read_write> found_nodes: array<u32>;

// Ten bits of share above the number of the node.
const SHARE_SHIFT: u32 = 22u;

@compute @workgroup_size(64)
fn count(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let id = invocation.x;
    if id * SELECT_RUN >= source.count {
        return;
    }
    let run = run_of(id);
    var found = 0u;
    for (var i = run.x; i < run.y; i++) {
        let own = share(i);
        if own > 0u {
            found_nodes[run.x + found] = i | (own << SHARE_SHIFT);
            found++;
        }
    }
    runs[id] = found;
    if (id + 1u) * SELECT_RUN >= source.count {
        runs[id + 1u] = 0u;
    }
}

@compute @workgroup_size(64)
fn write(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let id = invocation.x;
    if id * SELECT_RUN >= source.count {
        return;
    }
    let at = runs[id];
    let found = runs[id + 1u] - at;
    for (var i = 0u; i < found; i++) {
        selected[at + i] = found_nodes[id * SELECT_RUN + i];
    }
    if (id + 1u) * SELECT_RUN >= source.count {
        let all = at + found;
        selected[source.count] = all;
        arguments[0] = (all + 64u * RUN - 1u) / (64u * RUN);
        arguments[1] = 1u;
        arguments[2] = 1u;
    }
}
