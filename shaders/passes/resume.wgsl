// Resume: march stops tiles with very many entries (see march.wgsl). `again` dispatches march once
// more if any tile is unfinished; `hold` stops the frame if even that was not enough; `resume`
// continues a pass that was held.

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read_write> state: array<u32>;
@group(0) @binding(2) var<storage, read_write> stage: Pass;
@group(0) @binding(3) var<storage, read_write> arguments: array<u32>;
@group(0) @binding(4) var<storage, read_write> progress: array<u32>;

// Whether march has left a tile unfinished since the last call.
fn take_unfinished() -> bool {
    let unfinished = progress[progress_word(UNFINISHED)] != 0u;
    progress[progress_word(UNFINISHED)] = 0u;
    state[ADVANCED] += progress[progress_word(STOPS)];
    progress[progress_word(STOPS)] = 0u;
    return unfinished;
}

@compute @workgroup_size(1)
fn again() {
    let factor = u32(take_unfinished());
    arguments[AGAIN_ARGUMENTS] = factor * arguments[MARCH_ARGUMENTS];
    arguments[AGAIN_ARGUMENTS + 1u] = arguments[MARCH_ARGUMENTS + 1u];
}

@compute @workgroup_size(1)
fn hold() {
    if !take_unfinished() {
        return;
    }
    state[STALLED] = 1u;
    state[HELD] = stage.first_sheet;
    state[HELD + 1u] = stage.end_sheet;
    state[HELD + 2u] = stage.first_row;
    state[HELD + 3u] = stage.end_row;
    state[HELD + 4u] = stage.groups;
    state[HELD + 5u] = stage.group_shift;
    state[HELD + 6u] = arguments[MARCH_ARGUMENTS];
    state[HELD + 7u] = arguments[MARCH_ARGUMENTS + 1u];
    for (var f = 0u; f < 8u; f++) {
        state[HELD + 8u + f] = frame.record_starts[f / 4u][f % 4u];
    }
}

@compute @workgroup_size(1)
fn resume() {
    stage = Pass(
        state[HELD],
        state[HELD + 1u],
        state[HELD + 2u],
        state[HELD + 3u],
        state[HELD + 4u],
        state[HELD + 5u],
        vec2(0u),
    );
    arguments[MARCH_ARGUMENTS] = state[HELD + 6u];
    arguments[MARCH_ARGUMENTS + 1u] = state[HELD + 7u];
    state[STALLED] = 0u;
}
