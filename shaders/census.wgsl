// What survey counts and plan reads: per sheet and band of tile rows.

const CENSUS_KINDS: u32 = 5u;
// Entries of windows that start in the sheet.
const WINDOW_TILES: u32 = 0u;
// Tiles, and record words, of splats whose first (last) sheet this is.
const FIRST_TILES: u32 = 1u;
const LAST_TILES: u32 = 2u;
const FIRST_WORDS: u32 = 3u;
const LAST_WORDS: u32 = 4u;

// What the whole frame needs; sums stop at the largest number instead of wrapping.
struct Totals {
    entries: u32,
    words: u32,
}

fn fits(totals: Totals) -> bool {
    return totals.entries <= frame.entry_capacity && totals.words <= frame.record_capacity;
}
