// The progress of a frame: the words of the buffer `state`, which the CPU reads after a series of
// passes. Mirrors src/gpu/pipeline/state.rs.

// The needs of the whole frame, including hidden parts: entries, record words, splats.
const ENTRIES: u32 = 0u;
const WORDS: u32 = 1u;
const SPLATS: u32 = 2u;
// Depth passes so far.
const PASSES: u32 = 3u;
// The sheet and band at which the next pass starts.
const NEXT_SHEET: u32 = 4u;
const NEXT_BAND: u32 = 5u;
// Maximum number of entries of the next pass.
const TARGET: u32 = 6u;
// Everything is drawn.
const DONE: u32 = 7u;
// A tile of the last pass is unfinished: no pass begins until march has continued the tile.
const STALLED: u32 = 8u;
// A pass needed more than the capacity.
const OVERFLOW: u32 = 9u;
// Splats left out because the tiles in front of them are opaque.
const HIDDEN: u32 = 10u;
// Number of entries that were binned.
const BINNED: u32 = 11u;
// Number of tiles that the last pass drew in, and the maximum over all passes.
const TILES: u32 = 12u;
const TOUCHED: u32 = 13u;
// Number of passes that began, plus tiles that stopped after some entries. If this stays the same,
// the frame makes no progress.
const ADVANCED: u32 = 14u;
// The stalled pass: 8 words, and the first record words of the fields.
const HELD: u32 = 15u;
const STATE_WORDS: u32 = 32u;

// Indirect dispatches of a pass, as offsets in `arguments`: over the bins for clear and scan, over
// the bins for order, over the tiles with entries for march. Then over these once more if some are
// unfinished, and over all tiles.
const SCAN_ARGUMENTS: u32 = 0u;
const ORDER_ARGUMENTS: u32 = 4u;
const MARCH_ARGUMENTS: u32 = 8u;
const AGAIN_ARGUMENTS: u32 = 12u;
const TILE_ARGUMENTS: u32 = 16u;
