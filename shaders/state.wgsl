// How far a frame has come: words of the buffer `state`, which the CPU reads when a batch of passes is done. Mirrors
// engine/uniforms.rs.

// What the whole frame needs, hidden parts too: entries, record words, splats.
const ENTRIES: u32 = 0u;
const WORDS: u32 = 1u;
const SPLATS: u32 = 2u;
// Depth passes so far.
const PASSES: u32 = 3u;
// Where the next pass starts.
const NEXT_SHEET: u32 = 4u;
const NEXT_BAND: u32 = 5u;
// Entries that the next pass may need.
const TARGET: u32 = 6u;
// All is drawn.
const DONE: u32 = 7u;
// A tile of the last pass is unfinished: nothing goes on until march has gone on with it.
const STALLED: u32 = 8u;
// A pass needed more than there is room for.
const OVERFLOW: u32 = 9u;
// Splats left out because what lies before them is opaque.
const HIDDEN: u32 = 10u;
// Entries that were binned.
const BINNED: u32 = 11u;
// Tiles that the last pass drew in, and the most that a pass has.
const TILES: u32 = 12u;
const TOUCHED: u32 = 13u;
// Passes that began, and tiles that stopped after some entries: a frame in which this rests gets nowhere.
const ADVANCED: u32 = 14u;
// The stalled pass.
const HELD: u32 = 15u;
const STATE_WORDS: u32 = 24u;

// Indirect dispatches of a pass, as places in `arguments`: over the bins for clear and scan, over the bins for order, over
// the tiles that have entries for march, over them once more where some are unfinished, and over all tiles.
const SCAN_ARGUMENTS: u32 = 0u;
const ORDER_ARGUMENTS: u32 = 4u;
const MARCH_ARGUMENTS: u32 = 8u;
const AGAIN_ARGUMENTS: u32 = 12u;
const TILE_ARGUMENTS: u32 = 16u;
