// Cut: the list of the nodes that are drawn, each with its share. Two entry points around a prefix sum keep the list in the
// order of the nodes: count, then write.

@group(0) @binding(6) var<storage, read_write> runs: array<u32>;
// The drawn nodes: number in the chunk, share in the upper ten bits. The element behind the last possible one is how many.
@group(0) @binding(7) var<storage, read_write> selected: array<u32>;
// The workgroups that later passes need for them.
@group(0) @binding(8) var<storage, read_write> arguments: array<u32, 3>;

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
        found += u32(share(i) > 0u);
    }
    runs[id] = found;
}

@compute @workgroup_size(64)
fn write(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let id = invocation.x;
    if id * SELECT_RUN >= source.count {
        return;
    }
    let run = run_of(id);
    var at = runs[id];
    for (var i = run.x; i < run.y; i++) {
        let own = share(i);
        if own > 0u {
            selected[at] = i | (own << SHARE_SHIFT);
            at++;
        }
    }
    if (id + 1u) * SELECT_RUN >= source.count {
        selected[source.count] = at;
        arguments[0] = (at + 64u * RUN - 1u) / (64u * RUN);
        arguments[1] = 1u;
        arguments[2] = 1u;
    }
}
