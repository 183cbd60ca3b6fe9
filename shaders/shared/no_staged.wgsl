// Each invocation loads the entries of its tile by itself.

const STAGED_ENTRIES: u32 = 64u;

fn entry_at(at: u32) -> u32 {
    return entries[at];
}

fn staged_bin(at: u32) -> u32 {
    return 0u;
}

fn staged_end(at: u32) -> u32 {
    return 0u;
}

fn begin_loads() {}

fn load_entries(
    first: u32,
    end: u32,
    tile_bins: u32,
    lane: u32,
    light: bool,
    turn: u32,
) -> bool {
    return true;
}

fn staged_round(place: u32) -> Round {
    return Round();
}

fn staged_general(place: u32) -> Loaded {
    return Loaded();
}
