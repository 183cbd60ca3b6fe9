// The progress of the tiles of a pass. Each tile has 0, or one more than the slot that holds its
// sums (saved.wgsl), or FINISHED. Behind the tiles: whether any is unfinished, how often one
// stopped, which slots are taken, how many tiles have entries, and the list of these tiles. For a
// gathered lattice also: how many tiles gather.wgsl has drawn, how many sheets of tiles are marked
// (mark.wgsl), and for each tile the first sheet whose field is not drawn yet.

// A tile that needs no more work.
const FINISHED: u32 = 0xffffffffu;

const UNFINISHED: u32 = 0u;
const STOPS: u32 = 1u;
const SLOTS: u32 = 2u;
// Words of bits for the slots; mirrors src/gpu/targets.rs.
const SLOT_WORDS: u32 = 32u;
const LISTED: u32 = SLOTS + SLOT_WORDS;

fn progress_word(word: u32) -> u32 {
    return frame.tiles.x * frame.tiles.y + word;
}

// Returns the place of a listed tile.
fn listed_tile(number: u32) -> u32 {
    return progress_word(LISTED) + 1u + number;
}

fn gathered_word() -> u32 {
    return listed_tile(frame.tiles.x * frame.tiles.y);
}

fn marked_word() -> u32 {
    return gathered_word() + 1u;
}

fn next_of(tile: u32) -> u32 {
    return gathered_word() + 2u + tile;
}
