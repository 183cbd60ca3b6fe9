//! Draws the sheets of a tile front to back: splats and fields are added to a sheet, then it is
//! closed.

use super::{
    bins::Entry,
    cells::{CellField, CellTile},
    close::{OPAQUE, Packet, Pixels},
    footprint::Record,
    gather::{Gather, Last},
    layer::Layer,
    plan::Plan,
    rays::{HIGH, PACKETS, Rays, WIDE},
    scatter::{OpenField, OpenTile, Window},
    skip::is_marked,
    split::Split,
    sums::{ScalarSums, Sums, WINDOW, differences},
    tile_map::TileMap,
    vector::{apart, each, four, lanes, three},
    visible::Visible,
};
use crate::{
    plan::TILE,
    scene::{Mode, Optics, Order},
};
use fearless_simd::{Level, Simd, mask32x8, prelude::*};
use std::ops::Range;

/// A tile's pixels, row by row: premultiplied colour and opacity, and the depth of the hit or the
/// largest value.
pub type Tile = [([f32; 4], f32); TILE * TILE];

/// An empty tile.
pub const EMPTY: Tile = [([0.0; 4], 0.0); TILE * TILE];

/// The input of all tiles.
pub struct March<'a> {
    /// The plans of the fields, or the only plan. The first also is that of what carries colours of
    /// its own.
    pub plans: &'a [Plan<'a>],
    pub fields: Vec<DrawnField<'a>>,
    pub records: &'a [Vec<Record>],
}

/// A field of the scene.
pub struct DrawnField<'a> {
    pub plan: &'a Plan<'a>,
    pub means: Means<'a>,
    pub visible: &'a Visible,
    /// Of a gathered field: for each tile, a bit for each sheet in which it may be visible.
    pub marks: Vec<Vec<u64>>,
}

/// How a field comes to the sheets.
pub enum Means<'a> {
    Gathered(Gather<'a>),
    Cells(CellField<'a>),
    Scattered,
    /// Nothing of it is visible, or it comes as radiance.
    Nothing,
}

/// A gathered field in a tile.
struct Seen<'a, S: Simd> {
    marks: &'a [u64],
    last: Option<Box<[Last<S>; PACKETS]>>,
}

/// The windows of a tile's splats that are still to be added.
struct Ahead<'a> {
    /// The splats whose first window has not begun, sorted by first sheet.
    near: Near<'a>,
    /// The splats whose next window begins at each of the sheets ahead.
    continued: [Vec<u32>; WINDOW],
}

/// The splats of a tile that are next. Their records lie anywhere in memory, so a few are copied
/// from there together, and wait for it together.
struct Near<'a> {
    records: &'a [Vec<Record>],
    entries: &'a [Entry],
    copied: [Record; NEAR],
    /// Of the copied records, those that are still to come.
    left: Range<usize>,
}

/// Records copied together.
const NEAR: usize = 8;

impl<'a> Near<'a> {
    fn new(records: &'a [Vec<Record>], entries: &'a [Entry]) -> Self {
        Self { records, entries, copied: [Record::NONE; NEAR], left: 0..0 }
    }

    /// Returns the first sheet of the next splat.
    fn sheet(&self) -> Option<usize> {
        self.entries.first().map(|entry| usize::from(entry.sheet))
    }

    /// Returns the next splat.
    #[inline(always)]
    fn next(&mut self) -> Option<(Entry, &Record)> {
        let (entry, later) = self.entries.split_first()?;
        if self.left.is_empty() {
            for (copy, entry) in self.copied.iter_mut().zip(self.entries) {
                *copy = *record_of(self.records, entry.record);
            }
            self.left = 0..NEAR;
        }
        self.entries = later;
        let place = self.left.next()?;
        Some((*entry, &self.copied[place]))
    }
}

impl DrawnField<'_> {
    /// Returns the number of pairs of a tile and a sheet in which a gathered field may be visible.
    pub fn marked(&self) -> u64 {
        let words = self.marks.iter().flatten();
        words.map(|word| u64::from(word.count_ones())).sum()
    }

    /// Returns the number of tetrahedra in the picture.
    pub fn crossed(&self) -> u64 {
        if let Means::Cells(cells) = &self.means { cells.count() } else { 0 }
    }

    /// Returns the field of a sheet at a packet and the rays on which it counts, or `None` if it is
    /// invisible.
    #[inline(always)]
    fn layer<S: Simd>(
        &self,
        simd: S,
        packet: &Packet<S>,
        sheet: usize,
        open: &mut OpenField<'_, S>,
        seen: &mut Seen<'_, S>,
    ) -> Option<(Layer<S>, mask32x8<S>)> {
        let (plan, number) = (self.plan, packet.number);
        match &self.means {
            Means::Gathered(gather) => {
                let last = &mut seen.last.as_mut()?[number];
                if !is_marked(seen.marks, sheet) {
                    return None;
                }
                gather.layer(simd, packet, sheet, seen.marks, last)
            }
            Means::Cells(_) => open.cells.as_mut()?.layer(simd, plan, packet, sheet),
            Means::Scattered => {
                let sums = open.sums.as_ref()?;
                let slopes = open
                    .values
                    .as_ref()
                    .map(|values| values.each_ref().map(|on| differences(simd, on, number)));
                let resolved = sums.resolve(simd, plan, packet, sheet, slopes)?;
                let is_maximum = plan.optics == Optics::Maximum;
                (is_maximum || self.visible.may_show(simd, plan, &resolved.0)).then_some(resolved)
            }
            Means::Nothing => None,
        }
    }
}

impl<S: Simd> OpenField<'_, S> {
    /// Finds the values around a sheet, if gradients are their differences.
    #[inline(always)]
    fn find_values(&mut self, simd: S, plan: &Plan, sheet: usize) {
        let sums = self.sums.as_ref().filter(|sums| sums.has_field[sheet % WINDOW] != 0);
        self.values = match sums {
            Some(sums) if plan.central => {
                Some([sums.values_on(simd, plan, sheet), sums.values_on(simd, plan, sheet + 1)])
            }
            _ => None,
        };
    }
}

impl March<'_> {
    /// Draws a tile with the processor's vectors. `entries` are its splats, sorted by first sheet.
    /// If there is a map, the optical depths of all sheets go there, and nothing hides what lies
    /// behind it.
    // Not inlined: the code is long, and one copy is enough.
    #[inline(never)]
    pub fn draw(
        &self,
        level: Level,
        at: [usize; 2],
        entries: &[Entry],
        drawn: &mut u64,
        map: Option<&mut TileMap>,
    ) -> Tile {
        lanes!(level, simd => self.tile(simd, at, entries, drawn, map))
    }

    #[inline(always)]
    fn tile<S: Simd>(
        &self,
        simd: S,
        at: [usize; 2],
        entries: &[Entry],
        drawn: &mut u64,
        map: Option<&mut TileMap>,
    ) -> Tile {
        let plan = &self.plans[0];
        let corner = plan.corner(at);
        let number = at[1] * plan.tiles()[0] + at[0];
        let mut fields = Vec::with_capacity(self.fields.len());
        let mut seen = Vec::with_capacity(self.fields.len());
        let mut is_empty = entries.is_empty();
        for field in &self.fields {
            let marks = field.marks.get(number).map_or(&[][..], Vec::as_slice);
            let mut cells = None;
            if let Means::Cells(cell_field) = &field.means {
                cells = CellTile::new(simd, cell_field, corner);
            }
            is_empty &= cells.is_none() && marks.iter().all(|word| *word == 0);
            fields.push(OpenField { sums: None, values: None, cells });
            seen.push(Seen { marks, last: None });
        }
        if is_empty {
            return EMPTY;
        }
        for ((field, open), seen) in self.fields.iter().zip(&mut fields).zip(&mut seen) {
            match field.means {
                Means::Scattered => open.sums = Some(Box::new(ScalarSums::new(simd))),
                Means::Gathered(_) => seen.last = Some(Box::new([Last::new(simd); PACKETS])),
                Means::Cells(_) | Means::Nothing => {}
            }
        }
        let packets = each!([0, 1, 2, 3, 4, 5, 6, 7], I => self.packet(simd, corner, I));
        let mut tile = OpenTile { corner, packets, sums: Sums::new(simd, plan), fields };
        match plan.single() {
            Some(order) => self.one_by_one(simd, entries, order, &mut tile, drawn),
            None => self.sheets(simd, entries, &mut seen, (&mut tile, map), drawn),
        }
        self.finished(simd, &tile.packets)
    }

    /// Returns a packet of the tile with a first pixel.
    #[inline(always)]
    fn packet<S: Simd>(&self, simd: S, corner: [i32; 2], number: usize) -> Packet<S> {
        let first =
            [corner[0] + (number % 2 * WIDE) as i32, corner[1] + (number / 2 * HIGH) as i32];
        let mut others = Vec::new();
        for plan in &self.plans[1..] {
            others.push(Rays::new(simd, plan, first));
        }
        let plan = &self.plans[0];
        let (rays, pixels) = (Rays::new(simd, plan, first), Pixels::new(simd, plan));
        Packet { number, rays, others, pixels, is_done: false }
    }

    /// Returns the plan of a record's field.
    #[inline(always)]
    fn plan_of(&self, record: &Record) -> &Plan<'_> {
        &self.plans[usize::from(record.field)]
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
        let mut near = Near::new(self.records, entries);
        while let Some((entry, record)) = near.next() {
            let window = Window { front: usize::from(entry.sheet), is_continued: false };
            tile.add(simd, self.plan_of(record), record, window);
            *drawn += 1;
            let is_done = |packet: &Packet<S>| packet.is_done;
            if order == Order::FrontToBack && tile.packets.iter().all(is_done) {
                return;
            }
        }
    }

    #[inline(always)]
    fn sheets<S: Simd>(
        &self,
        simd: S,
        entries: &[Entry],
        seen: &mut [Seen<'_, S>],
        (tile, mut map): (&mut OpenTile<'_, S>, Option<&mut TileMap>),
        drawn: &mut u64,
    ) {
        let plan = &self.plans[0];
        let near = Near::new(self.records, entries);
        let mut ahead = Ahead { near, continued: std::array::from_fn(|_| Vec::new()) };
        let mut sheet = 0;
        // Number of sheets with sums, from `sheet` on.
        let mut open = 0;
        while sheet <= plan.sheets {
            if open == 0 {
                let mut next = ahead.near.sheet().unwrap_or(usize::MAX);
                for (open_field, seen) in tile.fields.iter().zip(seen.iter()) {
                    next = next.min(next_mark(seen.marks, sheet));
                    next =
                        open_field.cells.as_ref().map_or(next, |cells| next.min(cells.next(sheet)));
                }
                let Some(first) = next.checked_add(1) else { return };
                sheet = first - 1;
            }
            for (field, open_field) in self.fields.iter().zip(&mut tile.fields) {
                if let Some(cells) = &mut open_field.cells {
                    *drawn += cells.add(simd, field.plan, sheet, &tile.packets);
                }
            }
            let added = self.add(simd, sheet, &mut ahead, tile);
            *drawn += added;
            if added > 0 {
                open = WINDOW;
            }
            if sheet > 0 {
                apart(
                    simd,
                    #[inline(always)]
                    || self.close(simd, sheet, tile, seen),
                );
                if let Some(map) = &mut map {
                    map.take(simd, plan, sheet, &mut tile.packets);
                }
                let is_done = tile.packets.iter().all(|packet| packet.is_done);
                if is_done && plan.optics != Optics::Maximum {
                    return;
                }
            }
            tile.sums.clear(sheet);
            for open_field in &mut tile.fields {
                if let Some(sums) = &mut open_field.sums {
                    sums.clear(sheet);
                }
                if let Some(cells) = &mut open_field.cells {
                    cells.clear(simd, sheet);
                }
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
        let mut added = 0;
        let later = &mut ahead.continued[(sheet + WINDOW - 1) % WINDOW];
        let mut add = |number: u32, record: &Record, is_continued: bool| {
            let plan = self.plan_of(record);
            tile.add(simd, plan, record, Window { front: sheet, is_continued });
            added += 1;
            if usize::from(record.sheets[1]) >= sheet + WINDOW && !plan.is_whole() {
                later.push(number);
            }
        };
        for &number in &continued {
            add(number, record_of(self.records, number), true);
        }
        while ahead.near.sheet().is_some_and(|first| first <= sheet) {
            let Some((entry, record)) = ahead.near.next() else { break };
            add(entry.record, record, false);
        }
        // This sheet's slot is next used by the sheet four further on, which reuses the memory.
        continued.clear();
        let slot = &mut ahead.continued[sheet % WINDOW];
        if slot.is_empty() {
            *slot = continued;
        }
        added
    }

    #[inline(always)]
    fn close<S: Simd>(
        &self,
        simd: S,
        sheet: usize,
        tile: &mut OpenTile<'_, S>,
        seen: &mut [Seen<'_, S>],
    ) {
        let plan = &self.plans[0];
        for (field, open) in self.fields.iter().zip(&mut tile.fields) {
            open.find_values(simd, field.plan, sheet);
        }
        let OpenTile { packets, sums, fields, .. } = tile;
        for packet in packets {
            if packet.is_done {
                continue;
            }
            let planes = [plan.planes[sheet], plan.planes[sheet + 1]];
            let region = plan.region.map(|_| (packet.rays.in_region(planes), packet.pixels));
            if region.is_some_and(|(inside, _)| !inside.any_true()) {
                continue;
            }
            let mut radiance = sums.take_radiance(simd, plan, packet, sheet);
            for (field, open) in self.fields.iter().zip(fields.iter()) {
                let Some(cells) = &open.cells else { continue };
                let Some(part) = cells.radiance(simd, field.plan, packet, sheet) else { continue };
                radiance = match radiance {
                    Some(all) => Some(four!(I => all[I] + part[I])),
                    None => Some(part),
                };
            }
            let facets = sums.take_facets(simd, packet, sheet);
            let split = Split::new(simd, planes, facets.as_ref());
            let mut media = split.media(simd, radiance);
            for ((field, open), seen) in self.fields.iter().zip(fields.iter_mut()).zip(&mut *seen) {
                let field_layer = field.layer(simd, packet, sheet, open, seen);
                if let Some((mut layer, mask)) = field_layer {
                    if field.plan.has_clips() {
                        layer.share = Some(field.plan.behind_clips(simd, &layer, &packet.rays));
                    }
                    let ends = [layer.begin, layer.end];
                    for (part, media) in media.iter_mut().take(split.parts).enumerate() {
                        [layer.begin, layer.end] = split.within(part, ends);
                        field.plan.add_field(simd, (&layer, mask), packet, media);
                    }
                }
            }
            if facets.is_none() && media[0].is_empty() {
                continue;
            }
            for (part, media) in media.iter().take(split.parts).enumerate() {
                if !media.is_empty() {
                    plan.close(simd, split.span(part), packet, media);
                }
                if let Some(facets) = facets.as_ref().filter(|_| part == 0) {
                    facets.absorb(simd, &mut packet.pixels);
                }
            }
            if let Some((inside, before)) = region {
                packet.pixels = packet.pixels.select(inside, before);
            }
            packet.is_done =
                plan.optics != Optics::Maximum && !packet.pixels.through.simd_ge(OPAQUE).any_true();
        }
    }

    #[inline(always)]
    fn finished<S: Simd>(&self, simd: S, packets: &[Packet<S>; PACKETS]) -> Tile {
        let (plan, mut tile) = (&self.plans[0], EMPTY);
        for (number, Packet { rays, pixels, .. }) in packets.iter().enumerate() {
            let through: [f32; 8] = pixels.through.into();
            let [red, green, blue]: [[f32; 8]; 3] = three!(I => pixels.color[I].into());
            let mut hit = pixels.hit;
            if plan.mode == Mode::AxisSheets {
                // Convert the place along the sheets' normal to the distance along the ray.
                let normal = plan.frame.sheet_normal.to_array();
                let slope = super::vector::dot_with(normal, rays.direction);
                hit = if plan.view.perspective {
                    hit / slope.abs().max(fearless_simd::f32x8::splat(simd, 1e-6))
                } else {
                    (hit - rays.aside[0] * normal[0] - rays.aside[1] * normal[1]) / slope
                };
            }
            // Sheets by centres already are depths along the view's axis.
            if plan.optics != Optics::Maximum && !plan.by_centers {
                // Convert the distance to the view's z.
                hit *= rays.cosine;
            }
            let hit: [f32; 8] = hit.into();
            for lane in 0..8 {
                let pixel = &mut tile
                    [(number / 2 * HIGH + lane / WIDE) * TILE + number % 2 * WIDE + lane % WIDE];
                *pixel = ([red[lane], green[lane], blue[lane], 1.0 - through[lane]], hit[lane]);
            }
        }
        tile
    }
}

/// Returns the record with a number that [`super::bins`] assigned.
fn record_of(records: &[Vec<Record>], number: u32) -> &Record {
    let (batch, place) = super::bins::place_of(number);
    &records[batch][place]
}

/// Returns the first marked sheet at or after `sheet`.
fn next_mark(marks: &[u64], sheet: usize) -> usize {
    let bit = sheet.max(1) - 1;
    let mut word = bit / 64;
    let mut rest = marks.get(word).map_or(0, |bits| bits & u64::MAX << (bit % 64));
    while rest == 0 {
        word += 1;
        match marks.get(word) {
            Some(bits) => rest = *bits,
            None => return usize::MAX,
        }
    }
    word * 64 + rest.trailing_zeros() as usize + 1
}
