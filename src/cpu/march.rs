//! Draws the sheets of a tile front to back: splats and the lattice are added to a sheet, then it
//! is closed.

use super::{
    bins::Entry,
    cells::{CellField, CellTile},
    close::{OPAQUE, Packet, Pixels, Visible},
    footprint::Record,
    gather::{Gather, Last},
    plan::Plan,
    rays::{HIGH, PACKETS, Rays, WIDE},
    scatter::{OpenTile, Window},
    skip::is_marked,
    sums::{Sums, WINDOW, differences},
    vector::{each, four, three},
};
use crate::{
    plan::TILE,
    scene::{Mode, Optics, Order},
};
use fearless_simd::{Simd, prelude::*};

/// A tile's pixels, row by row: premultiplied colour and opacity, and the depth of the hit or the
/// largest value.
pub type Tile = [([f32; 4], f32); TILE * TILE];

/// An empty tile.
pub const EMPTY: Tile = [([0.0; 4], 0.0); TILE * TILE];

/// The input of all tiles.
pub struct March<'a> {
    pub plan: &'a Plan<'a>,
    pub gather: Option<Gather<'a>>,
    pub cells: Option<CellField<'a>>,
    pub visible: &'a Visible,
    pub records: &'a [Vec<Record>],
}

/// The windows of a tile's splats that are still to be added.
struct Ahead<'a> {
    /// The splats whose first window has not begun, sorted by first sheet.
    entries: &'a [Entry],
    /// The splats whose next window begins at each of the sheets ahead.
    continued: [Vec<u32>; WINDOW],
}

impl March<'_> {
    /// Draws a tile. `entries` are its splats, sorted by first sheet. `marks` has a bit for each
    /// sheet in which the lattice may be visible.
    #[inline(always)]
    pub fn tile<S: Simd>(
        &self,
        simd: S,
        at: [usize; 2],
        entries: &[Entry],
        marks: &[u64],
        drawn: &mut u64,
    ) -> Tile {
        let plan = self.plan;
        let corner = plan.corner(at);
        let cells = self.cells.as_ref().and_then(|field| CellTile::new(simd, field, corner));
        if entries.is_empty() && cells.is_none() && marks.iter().all(|word| *word == 0) {
            return EMPTY;
        }
        let packets = each!([0, 1, 2, 3, 4, 5, 6, 7], I => {
            let first = [corner[0] + (I % 2 * WIDE) as i32, corner[1] + (I / 2 * HIGH) as i32];
            Packet {
                number: I,
                rays: Rays::new(simd, plan, first),
                pixels: Pixels::new(simd, plan),
                is_done: false,
            }
        });
        let mut tile = OpenTile { corner, packets, sums: Sums::new(simd, plan), cells };
        match plan.single() {
            Some(order) => self.one_by_one(simd, entries, order, &mut tile, drawn),
            None => self.sheets(simd, entries, marks, &mut tile, drawn),
        }
        self.finished(simd, &tile.packets)
    }

    /// Adds the splats one by one.
    #[inline(always)]
    fn one_by_one<S: Simd>(
        &self,
        simd: S,
        entries: &[Entry],
        order: Order,
        tile: &mut OpenTile<'_, S>,
        drawn: &mut u64,
    ) {
        for entry in entries {
            let window = Window { front: usize::from(entry.sheet), is_continued: false };
            tile.add(simd, self.plan, record_of(self.records, entry.record), window);
            *drawn += 1;
            if order == Order::FrontToBack {
                for packet in &mut tile.packets {
                    packet.is_done = !packet.pixels.through.simd_ge(OPAQUE).any_true();
                }
                if tile.packets.iter().all(|packet| packet.is_done) {
                    return;
                }
            }
        }
    }

    #[inline(always)]
    fn sheets<S: Simd>(
        &self,
        simd: S,
        entries: &[Entry],
        marks: &[u64],
        tile: &mut OpenTile<'_, S>,
        drawn: &mut u64,
    ) {
        let mut ahead = Ahead { entries, continued: std::array::from_fn(|_| Vec::new()) };
        let mut last = [Last::new(simd); PACKETS];
        let mut sheet = 0;
        // Number of sheets with sums, from `sheet` on.
        let mut open = 0;
        while sheet <= self.plan.sheets {
            if open == 0 {
                let entry = ahead.entries.first();
                let entry = entry.map_or(usize::MAX, |entry| usize::from(entry.sheet));
                let next = entry.min(next_mark(marks, sheet));
                let next = tile.cells.as_ref().map_or(next, |cells| next.min(cells.next(sheet)));
                let Some(first) = next.checked_add(1) else { return };
                sheet = first - 1;
            }
            if let Some(cells) = &mut tile.cells {
                *drawn += cells.add(simd, self.plan, sheet, &tile.packets);
            }
            let added = self.add(simd, sheet, &mut ahead, tile);
            *drawn += added;
            if added > 0 {
                open = WINDOW;
            }
            if sheet > 0 {
                self.close(simd, sheet, marks, tile, &mut last);
                let is_done = tile.packets.iter().all(|packet| packet.is_done);
                if is_done && self.plan.optics != Optics::Maximum {
                    return;
                }
            }
            tile.sums.clear(sheet);
            if let Some(cells) = &mut tile.cells {
                cells.clear(simd, sheet);
            }
            open = open.saturating_sub(1);
            sheet += 1;
        }
    }

    /// Adds the windows that begin at a sheet. Returns their number.
    #[inline(always)]
    fn add<S: Simd>(
        &self,
        simd: S,
        sheet: usize,
        ahead: &mut Ahead,
        tile: &mut OpenTile<'_, S>,
    ) -> u64 {
        let mut continued = std::mem::take(&mut ahead.continued[sheet % WINDOW]);
        let begins = |entry: &&Entry| usize::from(entry.sheet) <= sheet;
        let count = ahead.entries.iter().take_while(begins).count();
        let (begun, later) = ahead.entries.split_at(count);
        ahead.entries = later;
        let begun = begun.iter().map(|entry| (entry.record, false));
        let mut added = 0;
        for (number, is_continued) in continued.iter().map(|number| (*number, true)).chain(begun) {
            let record = record_of(self.records, number);
            tile.add(simd, self.plan, record, Window { front: sheet, is_continued });
            added += 1;
            if usize::from(record.sheets[1]) >= sheet + WINDOW && !self.plan.is_whole() {
                ahead.continued[(sheet + WINDOW - 1) % WINDOW].push(number);
            }
        }
        // This sheet's slot is next used by the sheet four further on, which reuses the memory.
        continued.clear();
        let own = &mut ahead.continued[sheet % WINDOW];
        if own.is_empty() {
            *own = continued;
        }
        added
    }

    #[inline(always)]
    fn close<S: Simd>(
        &self,
        simd: S,
        sheet: usize,
        marks: &[u64],
        tile: &mut OpenTile<'_, S>,
        last: &mut [Last<S>; PACKETS],
    ) {
        let (plan, sums) = (self.plan, &mut tile.sums);
        let has_lattice = is_marked(marks, sheet);
        let has_sums = plan.has_field && sums.has_field[sheet % WINDOW] != 0;
        let values = (plan.central && has_sums)
            .then(|| [sums.values_on(simd, plan, sheet), sums.values_on(simd, plan, sheet + 1)]);
        for (packet, last) in tile.packets.iter_mut().zip(last) {
            if packet.is_done {
                continue;
            }
            let mut radiance = sums.take_radiance(simd, plan, packet, sheet);
            let own = tile.cells.as_ref().and_then(
                #[inline(always)]
                |cells| cells.radiance(simd, plan, packet, sheet),
            );
            if let Some(own) = own {
                radiance = radiance.map_or(Some(own), |all| Some(four!(I => all[I] + own[I])));
            }
            let cells = tile.cells.as_mut().and_then(
                #[inline(always)]
                |cells| cells.layer(simd, plan, packet, sheet),
            );
            let field = match &self.gather {
                _ if cells.is_some() => cells,
                Some(gather) if has_lattice => gather.layer(simd, packet, sheet, marks, last),
                Some(_) => None,
                None if has_sums => {
                    let number = packet.number;
                    let slopes = values
                        .as_ref()
                        .map(|values| values.each_ref().map(|on| differences(simd, on, number)));
                    let layer = sums.resolve(simd, plan, packet, sheet, slopes);
                    let is_maximum = plan.optics == Optics::Maximum;
                    layer
                        .filter(|(layer, _)| is_maximum || self.visible.may_show(simd, plan, layer))
                }
                None => None,
            };
            let facets = sums.take_facets(simd, packet, sheet);
            if field.is_none() && radiance.is_none() && facets.is_none() {
                continue;
            }
            let field = field.as_ref().map(|(layer, mask)| (layer, *mask));
            if field.is_some() || radiance.is_some() {
                plan.close(simd, sheet, packet, field, radiance);
            }
            if let Some(facets) = &facets {
                facets.absorb(simd, &mut packet.pixels);
            }
            packet.is_done =
                plan.optics != Optics::Maximum && !packet.pixels.through.simd_ge(OPAQUE).any_true();
        }
    }

    #[inline(always)]
    fn finished<S: Simd>(&self, simd: S, packets: &[Packet<S>; PACKETS]) -> Tile {
        let mut tile = EMPTY;
        for (number, Packet { rays, pixels, .. }) in packets.iter().enumerate() {
            let through: [f32; 8] = pixels.through.into();
            let [red, green, blue]: [[f32; 8]; 3] = three!(I => pixels.color[I].into());
            let mut hit = pixels.hit;
            if self.plan.mode == Mode::AxisSheets {
                // Convert the place along the sheets' normal to the distance along the ray.
                let normal = self.plan.frame.sheet_normal;
                let slope = super::vector::dot_with(normal, rays.direction);
                hit = if self.plan.view.perspective {
                    hit / slope.abs().max(fearless_simd::f32x8::splat(simd, 1e-6))
                } else {
                    (hit - rays.aside[0] * normal[0] - rays.aside[1] * normal[1]) / slope
                };
            }
            if self.plan.optics != Optics::Maximum {
                // Convert the distance to the view's z.
                hit *= rays.cosine;
            }
            let hit: [f32; 8] = hit.into();
            for lane in 0..8 {
                let own = &mut tile
                    [(number / 2 * HIGH + lane / WIDE) * TILE + number % 2 * WIDE + lane % WIDE];
                *own = ([red[lane], green[lane], blue[lane], 1.0 - through[lane]], hit[lane]);
            }
        }
        tile
    }
}

/// Returns the record with a number that [`super::bins`] assigned.
fn record_of(records: &[Vec<Record>], number: u32) -> &Record {
    let (batch, own) = super::bins::place_of(number);
    &records[batch][own]
}

/// Returns the first marked sheet at or after `sheet`.
fn next_mark(marks: &[u64], sheet: usize) -> usize {
    let bit = sheet.max(1) - 1;
    let mut word = bit / 64;
    let mut rest = marks.get(word).map_or(0, |own| own & u64::MAX << (bit % 64));
    while rest == 0 {
        word += 1;
        match marks.get(word) {
            Some(own) => rest = *own,
            None => return usize::MAX,
        }
    }
    word * 64 + rest.trailing_zeros() as usize + 1
}
