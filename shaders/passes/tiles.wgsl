// Tiles: lists the tiles that have entries in a pass, in any order. march and occlusion skip the
// others.

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> stage: Pass;
@group(0) @binding(2) var<storage, read> bins: array<u32>;
@group(0) @binding(3) var<storage, read_write> progress: array<atomic<u32>>;
@group(1) @binding(0) var<storage, read_write> arguments: array<u32>;
@group(1) @binding(1) var<storage, read_write> state: array<u32>;

@compute @workgroup_size(64)
fn list(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= (stage.end_row - stage.first_row) * frame.tiles.x || stage.groups == 0u {
        return;
    }
    let first = id.x * stage.groups;
    var start = 0u;
    if first > 0u {
        start = bins[first - 1u];
    }
    if bins[first + stage.groups - 1u] > start {
        let at = atomicAdd(&progress[progress_word(LISTED)], 1u);
        atomicStore(&progress[listed_tile(at)], stage.first_row * frame.tiles.x + id.x);
    }
}

@compute @workgroup_size(1)
fn prepare() {
    let tiles = select(0u, atomicLoad(&progress[progress_word(LISTED)]), stage.groups > 0u);
    let order = rows_of(dealt_count((tiles * stage.groups + 63u) / 64u));
    let march = rows_of(dealt_count(tiles));
    state[TILES] = tiles;
    arguments[ORDER_ARGUMENTS] = order.x;
    arguments[ORDER_ARGUMENTS + 1u] = order.y;
    arguments[MARCH_ARGUMENTS] = march.x;
    arguments[MARCH_ARGUMENTS + 1u] = march.y;
}
