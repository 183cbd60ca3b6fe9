// What survey counts and plan reads: per sheet and band of tile rows.

const CENSUS_KINDS: u32 = 7u;
// Entries of windows that start in the sheet.
const WINDOW_TILES: u32 = 0u;
// Tiles, and record words, of splats whose first (last) sheet this is.
const FIRST_TILES: u32 = 1u;
const LAST_TILES: u32 = 2u;
const FIRST_WORDS: u32 = 3u;
const LAST_WORDS: u32 = 4u;
// Tiles, and record words, of splats that reach in from the sheets before; filled by plan.
const OPEN_TILES: u32 = 5u;
const OPEN_WORDS: u32 = 6u;

// Behind the bands of a sheet stand the sums over them.
fn census_index(sheet: u32, band: u32) -> u32 {
    return (sheet * (BANDS + 1u) + band) * CENSUS_KINDS;
}

// What the whole frame needs; sums stop at the largest number instead of wrapping.
struct Totals {
    entries: u32,
    words: u32,
    splats: u32,
}

fn fits(totals: Totals) -> bool {
    return totals.entries <= frame.entry_capacity && totals.words <= frame.record_capacity;
}
