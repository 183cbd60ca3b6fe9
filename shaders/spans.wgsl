// What a candidate meets of the picture, in 32 bits: enough to tell which passes need it.

// Bands of tile rows, in which a sheet can be cut that is too much for one pass.
const BANDS: u32 = 16u;

fn band_start(band: u32) -> u32 {
    return band * frame.tiles.y / BANDS;
}

fn band_of(row: u32) -> u32 {
    return ((row + 1u) * BANDS - 1u) / frame.tiles.y;
}

// The sheets and bands that a candidate meets: first and last sheet (12 bits each), first and last band (4 each).
const NO_SPAN: u32 = 0xffffffffu;

fn pack_span(first_sheet: u32, last_sheet: u32, first_row: u32, last_row: u32) -> u32 {
    return first_sheet | (last_sheet << 12u) | (band_of(first_row) << 24u) | (band_of(last_row) << 28u);
}

fn in_pass(span: u32, stage: Pass) -> bool {
    let first_sheet = span & 0xfffu;
    let last_sheet = (span >> 12u) & 0xfffu;
    let first_band = (span >> 24u) & 0xfu;
    let last_band = span >> 28u;
    return span != NO_SPAN && first_sheet < stage.end_sheet && last_sheet >= stage.first_sheet
        && first_band < stage.end_band && last_band >= stage.first_band;
}
