// What the tiles of a pass have come to: for each the sheet that it goes on from; behind them, whether any is unfinished,
// whether one can't be finished, and how many tiles have entries, with the list of these.

const UNFINISHED: u32 = 0u;
const UNFINISHABLE: u32 = 1u;
const LISTED: u32 = 2u;

fn progress_word(word: u32) -> u32 {
    return frame.tiles.x * frame.tiles.y + word;
}

// Where a listed tile stands.
fn listed_tile(number: u32) -> u32 {
    return progress_word(LISTED) + 1u + number;
}
