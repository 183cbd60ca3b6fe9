// The counts that survey makes and plan reads: the needs of batches by the sheets in which they
// start and end, for each band of tile rows and for all bands together.

// Bands of tile rows. A sheet that needs too much for one pass is divided into bands.
const BANDS: u32 = 16u;

fn band_start(band: u32) -> u32 {
    return band * frame.tiles.y / BANDS;
}

fn band_of(row: u32) -> u32 {
    return ((row + 1u) * BANDS - 1u) / frame.tiles.y;
}

const CENSUS_KINDS: u32 = 6u;
// Entries (low and high 32 bits) and record words of the batches that start in the sheet.
// `accumulate` in plan replaces them by the sums over the sheets before.
const STARTING: u32 = 0u;
// The same for the batches that end in the sheet.
const ENDING: u32 = 3u;

// The whole picture comes behind the bands of a sheet.
fn census_index(sheet: u32, band: u32) -> u32 {
    return (sheet * (BANDS + 1u) + band) * CENSUS_KINDS;
}
