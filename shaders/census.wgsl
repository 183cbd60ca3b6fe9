// What survey counts and plan reads: the needs of runs by the sheet in which they start and that in which they end, in each
// band of tile rows and in all together.

// Bands of tile rows, in which a sheet can be cut that is too much for one pass.
const BANDS: u32 = 16u;

fn band_start(band: u32) -> u32 {
    return band * frame.tiles.y / BANDS;
}

fn band_of(row: u32) -> u32 {
    return ((row + 1u) * BANDS - 1u) / frame.tiles.y;
}

const CENSUS_KINDS: u32 = 6u;
// Entries, how often these have passed 32 bits, and record words of the runs that start in the sheet. Summed up by plan: in
// those before it.
const STARTING: u32 = 0u;
// Those of the runs that end in it, or in those before it.
const ENDING: u32 = 3u;

// Behind the bands of a sheet stands the whole picture.
fn census_index(sheet: u32, band: u32) -> u32 {
    return (sheet * (BANDS + 1u) + band) * CENSUS_KINDS;
}
