//! Closes a sheet at eight pixels. The field in the sheet is a parabola along each ray. It is
//! classified, lit, and composited front to back together with the sheet's radiance.
//! `src/reference` has the definition; shaders/shared/sheet.wgsl does the same.

use super::{
    lamps::ReachingSheet,
    layer::{Layer, PARTS},
    plan::Plan,
    rays::Rays,
    vector::{Lanes, columns, dot, each, exp, four, log2, three},
    visible::NARROW,
};
use crate::{
    plan::{
        frame::Light,
        tables::{Factors, Values},
    },
    scene::Optics,
};
use fearless_simd::{Simd, f32x4, mask32x8, prelude::*};

/// The same for values far beyond the table, as a fraction of the value.
const NARROW_AFAR: f32 = 1e-6;
/// One light stands for a piece if the square of the relative change of its gradient, times the
/// gloss and the share of the light that the piece takes, is at most this.
const STEADY: f32 = 0.03;
/// The light of a piece that takes a smaller share than this counts as even.
const UNSEEN: f32 = 2e-3;
/// An optical depth that counts as opaque.
const MOST_DEPTH: f32 = 20.0;
/// Minimum divisor where optical depths are divided by.
const LEAST_DIVISOR: f32 = 1e-20;
/// A pixel that transmits less light is finished.
pub const OPAQUE: f32 = 0.0005;
/// A pixel without a value.
pub const NO_VALUE: f32 = -3e38;
/// A distance behind all others.
const BEHIND: f32 = 3e38;

/// Eight pixels of the picture, composited so far.
#[derive(Clone, Copy)]
pub struct Pixels<S: Simd> {
    pub color: [Lanes<S>; 3],
    pub through: Lanes<S>,
    /// The distance at which half of the light is absorbed, or the largest value.
    pub hit: Lanes<S>,
}

impl<S: Simd> Pixels<S> {
    #[inline(always)]
    pub fn new(simd: S, plan: &Plan) -> Self {
        let none = Lanes::splat(simd, 0.0);
        let hit = if plan.optics == Optics::Maximum { Lanes::splat(simd, NO_VALUE) } else { none };
        Self { color: [none; 3], through: Lanes::splat(simd, 1.0), hit }
    }

    /// Returns these pixels where a mask is set, and the others elsewhere.
    #[inline(always)]
    pub fn select(self, mask: mask32x8<S>, others: Self) -> Self {
        Self {
            color: three!(I => mask.select(self.color[I], others.color[I])),
            through: mask.select(self.through, others.through),
            hit: mask.select(self.hit, others.hit),
        }
    }

    /// Records where half of the light is absorbed, if that is between two distances with optical
    /// depth, and not on an isosurface there. `before` is the light that reaches the first.
    #[inline(always)]
    fn note_half(
        &mut self,
        simd: S,
        [start, stop]: [Lanes<S>; 2],
        before: Lanes<S>,
        depth: Lanes<S>,
        has_hit: mask32x8<S>,
    ) {
        let passes = before.simd_gt(0.5) & self.through.simd_le(0.5) & !has_hit;
        if passes.any_true() {
            // Inside the sheet, optical depth counts as evenly spread.
            let part = log2(simd, before * 2.0) * std::f32::consts::LN_2
                / depth.max(Lanes::splat(simd, LEAST_DIVISOR));
            self.hit = passes.select(part * (stop - start) + start, self.hit);
        }
    }
}

/// A packet of a tile: its rays and its pixels.
pub struct Packet<S: Simd> {
    /// Its place among the packets of the tile, row by row.
    pub number: usize,
    /// The rays, in the steps of the first field's lattice.
    pub rays: Rays<S>,
    /// The same rays in the steps of the other fields' lattices.
    pub others: Vec<Rays<S>>,
    pub pixels: Pixels<S>,
    /// No light gets through any of its pixels.
    pub is_done: bool,
}

impl<S: Simd> Packet<S> {
    /// Returns the rays in the steps of the lattice of a plan's field.
    #[inline(always)]
    pub fn rays_in(&self, plan: &Plan) -> &Rays<S> {
        match plan.number {
            0 => &self.rays,
            number => &self.others[usize::from(number) - 1],
        }
    }

    /// Returns the bit of this packet in masks of a tile's packets.
    #[inline(always)]
    pub fn bit(&self) -> u8 {
        1 << self.number
    }
}

/// The effect of a sheet on light.
struct Medium<S: Simd> {
    /// The light that reaches the sheet.
    before: Lanes<S>,
    through: Lanes<S>,
    depth: Lanes<S>,
    color: [Lanes<S>; 3],
    /// The distance at which an isosurface absorbed half of the light.
    hit: Lanes<S>,
    has_hit: mask32x8<S>,
    /// The largest value.
    peak: Lanes<S>,
}

/// What lies in a sheet at eight pixels: radiance, and the media of fields.
pub struct Media<S: Simd> {
    /// A field, if there is nothing else.
    only: Option<Medium<S>>,
    /// Everything together otherwise: colours times optical depth, and optical depth.
    mixed: Option<[Lanes<S>; 4]>,
    /// The nearest distance at which isosurfaces of a field absorbed half of the light.
    hit: Lanes<S>,
    has_hit: mask32x8<S>,
}

impl<S: Simd> Media<S> {
    /// Returns the radiance of a sheet: colour times optical depth, and optical depth.
    #[inline(always)]
    pub fn new(simd: S, radiance: Option<[Lanes<S>; 4]>) -> Self {
        Self {
            only: None,
            mixed: radiance,
            hit: Lanes::splat(simd, BEHIND),
            has_hit: mask32x8::splat(simd, false),
        }
    }

    pub fn is_empty(&self) -> bool {
        self.only.is_none() && self.mixed.is_none()
    }
}

/// A part of a sheet in which the transfer function is integrated at once.
struct Piece<S: Simd> {
    /// The pixels whose rays meet it.
    mask: mask32x8<S>,
    /// The distance at which it begins.
    begin: Lanes<S>,
    length: Lanes<S>,
    /// The places of both ends, from 0 at the sheet's front to 1 at its back, and the values there.
    places: [Lanes<S>; 2],
    values: [Lanes<S>; 2],
    /// How much the gradient changes in it, if it is lit.
    turn: Turn<S>,
}

/// How much the gradient changes in a sheet.
#[derive(Clone, Copy)]
struct Turn<S: Simd> {
    /// The square of its largest change within a piece, times the gloss: how much light changes
    /// with the gradient's direction.
    change2: Lanes<S>,
    /// The square of its least magnitude.
    least2: Lanes<S>,
    /// Where it is too short everywhere to have light.
    is_short: mask32x8<S>,
}

impl Plan<'_> {
    /// Returns extinction times colour, and extinction, averaged over the values between two
    /// values.
    #[inline(always)]
    fn between<S: Simd>(&self, simd: S, a: Lanes<S>, b: Lanes<S>) -> [Lanes<S>; 4] {
        let Values { last: end, place, .. } = self.field.values;
        let none = Lanes::splat(simd, 0.0);
        let all = Lanes::splat(simd, end);
        let middle = (a + b) * 0.5 + place;
        let reach =
            ((a - b).abs().max(Lanes::splat(simd, NARROW)) * 0.5).max(middle.abs() * NARROW_AFAR);
        let (low, high) = ((middle - reach).floor(), (middle + reach).ceil());
        let inverse = Lanes::splat(simd, 1.0) / (high - low);
        let (first, last) = (low.max(none).min(all), high.max(none).min(all));
        let [first_at, last_at]: [[f32; 8]; 2] = [first.into(), last.into()];
        let integrals = &self.tables.integrals;
        let within = columns(
            simd,
            each!([0, 1, 2, 3, 4, 5, 6, 7], L => {
                let from: f32x4<S> = integrals[first_at[L] as usize].simd_into(simd);
                let to: f32x4<S> = integrals[last_at[L] as usize].simd_into(simd);
                to - from
            }),
        );
        // Values before and behind the table count as those of its ends.
        let before = (high.min(none) - low.min(none)) * inverse;
        let behind = (high.max(all) - low.max(all)) * inverse;
        let [first, last] = self.field.beyond;
        four!(I => within[I] * inverse + before * first[I] + behind * last[I])
    }

    /// Returns extinction times colour, and extinction, for one value.
    #[inline(always)]
    fn one<S: Simd>(&self, simd: S, value: Lanes<S>) -> [Lanes<S>; 4] {
        let Values { last: end, place, .. } = self.field.values;
        let at = (value + place).max(Lanes::splat(simd, 0.0)).min(Lanes::splat(simd, end));
        let places: [f32; 8] = at.into();
        let [red, green, blue, extinction] = columns(
            simd,
            each!([0, 1, 2, 3, 4, 5, 6, 7], L => {
                let low = places[L] as usize;
                let from: f32x4<S> = self.tables.colors[low].simd_into(simd);
                let to: f32x4<S> = self.tables.colors[low + 1].simd_into(simd);
                (to - from).mul_add(f32x4::splat(simd, places[L].fract()), from)
            }),
        );
        [red * extinction, green * extinction, blue * extinction, extinction]
    }

    /// Returns the same for a value that is the same everywhere around.
    #[inline(always)]
    pub fn of_value<S: Simd>(&self, simd: S, value: Lanes<S>) -> [Lanes<S>; 4] {
        let mut emission = self.one(simd, value);
        if self.has_gradient_opacity {
            let factor = self.gradient_factor(simd, Lanes::splat(simd, 0.0));
            emission = four!(I => emission[I] * factor);
        }
        emission
    }

    /// Returns the factor on the extinction for a gradient's magnitude.
    #[inline(always)]
    fn gradient_factor<S: Simd>(&self, simd: S, magnitude: Lanes<S>) -> Lanes<S> {
        let Factors { first, per_magnitude } = self.field.gradients.factors;
        let factors = &self.tables.factors;
        let last = Lanes::splat(simd, (factors.len() - 2) as f32);
        let at: [f32; 8] =
            ((magnitude - first) * per_magnitude).max(Lanes::splat(simd, 0.0)).min(last).into();
        let factor = |at: f32| {
            let [low, high] = [factors[at as usize], factors[at as usize + 1]];
            low + (high - low) * at.fract()
        };
        at.map(factor).simd_into(simd)
    }

    /// Returns the colour of a piece in its mean light, that of four places: gradients change more
    /// within a piece than values do. If the light is steady, that of the middle stands for it.
    #[inline(always)]
    fn lit_piece<S: Simd>(
        &self,
        simd: S,
        color: [Lanes<S>; 3],
        (layer, reaching): (&Layer<S>, &ReachingSheet<S>),
        [place, next_place]: [Lanes<S>; 2],
        is_steady: bool,
    ) -> [Lanes<S>; 3] {
        if is_steady {
            let middle = (place + next_place) * 0.5;
            let gradient = (self.gradient(layer, middle), layer.share);
            return self.lit_field(simd, color, gradient, (layer.direction, &reaching.at(middle)));
        }
        let at = four!(N => (next_place - place) * ((N as f32 + 0.5) * 0.25) + place);
        let gradients = (four!(N => self.gradient(layer, at[N])), layer.share);
        let on = (layer.direction, four!(N => reaching.at(at[N])));
        self.lit_by_four(simd, color, gradients, on)
    }

    /// Returns how far the gradients of a sheet count behind the last clip before its end, by the
    /// depth of its middle.
    #[inline(always)]
    pub fn behind_clips<S: Simd>(&self, simd: S, layer: &Layer<S>, rays: &Rays<S>) -> Lanes<S> {
        let mut entered = rays.kept[0];
        for [from, to] in &rays.holes[..self.holes] {
            let is_before = from.simd_lt(*to) & to.simd_lt(layer.start + layer.thickness);
            entered = is_before.select(entered.max(*to), entered);
        }
        let (none, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
        let depth = layer.thickness.mul_add(0.5, layer.start) - entered;
        (depth * self.field.per_depth).max(none).min(one)
    }

    /// Adds the field in a sheet, at the pixels of a mask, to what lies in the sheet. In a maximum
    /// intensity picture, its largest value counts at once.
    #[inline(always)]
    pub fn add_field<S: Simd>(
        &self,
        simd: S,
        (layer, mask): (&Layer<S>, mask32x8<S>),
        packet: &mut Packet<S>,
        media: &mut Media<S>,
    ) {
        let Packet { rays, pixels, .. } = packet;
        let reaching = self.reaching(simd, layer, rays);
        let medium = self.pass(simd, (layer, &reaching), rays, mask, pixels.through);
        if self.optics == Optics::Maximum {
            pixels.hit = pixels.hit.max(medium.peak);
            return;
        }
        media.hit = medium.has_hit.select(medium.hit.min(media.hit), media.hit);
        media.has_hit |= medium.has_hit;
        let before = media.only.take();
        if before.is_none() && media.mixed.is_none() && self.optics != Optics::XRay {
            media.only = Some(medium);
            return;
        }
        let mut all = media.mixed.unwrap_or([Lanes::splat(simd, 0.0); 4]);
        if let Some(before) = &before {
            all = before.mixed_with(simd, all);
        }
        media.mixed = Some(medium.mixed_with(simd, all));
    }

    /// Adds a sheet, or a part of one between two distances, to a packet's pixels.
    #[inline(always)]
    pub fn close<S: Simd>(
        &self,
        simd: S,
        span: [Lanes<S>; 2],
        packet: &mut Packet<S>,
        media: &Media<S>,
    ) {
        let pixels = &mut packet.pixels;
        let none = Lanes::splat(simd, 0.0);
        let before = pixels.through;
        // Facets may have taken half of the light since the media were added.
        let has_hit = media.has_hit & before.simd_gt(0.5);
        pixels.hit = has_hit.select(media.hit, pixels.hit);
        if let Some(medium) = &media.only {
            // The field's colour is already composited within the sheet, so it is added as it is.
            pixels.color = three!(I => before.mul_add(medium.color[I], pixels.color[I]));
            pixels.through = before * medium.through;
            pixels.note_half(simd, span, before, medium.depth, has_hit);
            return;
        }
        let Some([red, green, blue, depth]) = media.mixed else { return };
        let mut premultiplied = [red, green, blue];
        if self.optics == Optics::XRay {
            premultiplied = [depth; 3];
        }
        let counts = depth.simd_gt(LEAST_DIVISOR);
        if !counts.any_true() {
            return;
        }
        let share = counts.select(before * taken(simd, depth), none);
        let per_depth = share / depth.max(Lanes::splat(simd, LEAST_DIVISOR));
        pixels.color = three!(I => per_depth.mul_add(premultiplied[I], pixels.color[I]));
        pixels.through = before - share;
        pixels.note_half(simd, span, before, depth, has_hit);
    }

    /// Returns the effect of a sheet's field on light, inside the lattice's box and what the clips
    /// leave.
    #[inline(always)]
    fn pass<S: Simd>(
        &self,
        simd: S,
        (layer, reaching): (&Layer<S>, &ReachingSheet<S>),
        rays: &Rays<S>,
        mask: mask32x8<S>,
        before: Lanes<S>,
    ) -> Medium<S> {
        let on = (layer, reaching);
        let none = Lanes::splat(simd, 0.0);
        let mut medium = Medium {
            before,
            through: Lanes::splat(simd, 1.0),
            depth: none,
            color: [none; 3],
            hit: none,
            has_hit: mask32x8::splat(simd, false),
            peak: Lanes::splat(simd, NO_VALUE),
        };
        if self.holes == 0 {
            let mask = mask & layer.begin.simd_lt(layer.end);
            self.pass_between(simd, on, [layer.begin, layer.end], mask, &mut medium);
            return medium;
        }
        let holes = &rays.holes[..self.holes];
        let mut begin = layer.begin;
        for _ in 0..=self.holes {
            // Skip the holes that contain `begin`; leaving one may lead into another.
            for _ in 0..self.holes {
                for [from, to] in holes {
                    let is_inside = from.simd_le(begin) & begin.simd_lt(*to);
                    begin = is_inside.select(*to, begin);
                }
            }
            let mut end = layer.end;
            for [from, to] in holes {
                let is_ahead = from.simd_gt(begin) & from.simd_lt(*to);
                end = is_ahead.select(end.min(*from), end);
            }
            let mask = mask & begin.simd_lt(end);
            if mask.any_true() {
                self.pass_between(simd, on, [begin, end], mask, &mut medium);
            }
            begin = begin.max(end);
        }
        medium
    }

    /// Returns the length of the rays between two distances that the clips leave.
    #[inline(always)]
    pub fn kept<S: Simd>(&self, simd: S, rays: &Rays<S>, [begin, end]: [Lanes<S>; 2]) -> Lanes<S> {
        let none = Lanes::splat(simd, 0.0);
        let (mut begin, end) = (begin.max(rays.inside[0]), end.min(rays.inside[1]));
        let holes = &rays.holes[..self.holes];
        let mut length = none;
        for _ in 0..=holes.len() {
            for _ in 0..holes.len() {
                for [from, to] in holes {
                    let is_inside = from.simd_le(begin) & begin.simd_lt(*to);
                    begin = is_inside.select(*to, begin);
                }
            }
            let mut next = end;
            for [from, to] in holes {
                let is_ahead = from.simd_gt(begin) & from.simd_lt(*to);
                next = is_ahead.select(next.min(*from), next);
            }
            length += (next - begin).max(none);
            begin = begin.max(next);
        }
        length
    }

    /// Adds the part of a sheet between two distances, piece by piece.
    #[inline(always)]
    fn pass_between<S: Simd>(
        &self,
        simd: S,
        (layer, reaching): (&Layer<S>, &ReachingSheet<S>),
        [begin, end]: [Lanes<S>; 2],
        mask: mask32x8<S>,
        medium: &mut Medium<S>,
    ) {
        let length = (end - begin).max(Lanes::splat(simd, 0.0));
        let is_curved = self.is_integrated || self.isosurfaces > 0;
        let per_thickness = Lanes::splat(simd, 1.0) / layer.thickness;
        let mut place = (begin - layer.start) * per_thickness;
        if self.optics == Optics::Maximum {
            let peak = layer.peak(place, length * per_thickness, is_curved);
            medium.peak = mask.select(medium.peak.max(peak), medium.peak);
            return;
        }
        let mut straight = None;
        if is_curved && self.isosurfaces == 0 {
            straight = layer.straight([place, place + length * per_thickness]);
        }
        let parts = if is_curved && straight.is_none() { PARTS } else { 1 };
        let step = length * (1.0 / parts as f32);
        let turn = self.turn(simd, layer, parts);
        let mut value = if is_curved { layer.parabola(place) } else { layer.mean() };
        for part in 0..parts {
            let begin = begin + step * part as f32;
            let next_place = place + step * per_thickness;
            let next = if is_curved { layer.parabola(next_place) } else { value };
            let values = straight.unwrap_or([value, next]);
            let places = [place, next_place];
            let piece = Piece { mask, begin, length: step, places, values, turn };
            self.pass_piece(simd, (layer, reaching), &piece, medium);
            place = next_place;
            value = next;
        }
    }

    /// Returns how much the gradient changes in each of the parts of a sheet, if it is lit.
    #[inline(always)]
    fn turn<S: Simd>(&self, simd: S, layer: &Layer<S>, parts: usize) -> Turn<S> {
        let none = Lanes::splat(simd, 0.0);
        if !self.is_lit {
            return Turn { change2: none, least2: none, is_short: none.simd_ge(none) };
        }
        let (change2, least2, most2) = match &layer.sections {
            Some([front, middle, back]) => {
                let changes = [difference2(front, middle), difference2(middle, back)];
                let sizes = [dot(*front, *front), dot(*middle, *middle), dot(*back, *back)];
                (
                    changes[0].max(changes[1]) * 4.0,
                    sizes[0].min(sizes[1]).min(sizes[2]),
                    sizes[0].max(sizes[1]).max(sizes[2]),
                )
            }
            None => {
                let [front, back] = each!([0, 1], I => {
                    self.gradient_of_faces(layer, Lanes::splat(simd, I as f32))
                });
                let sizes = [dot(front, front), dot(back, back)];
                (difference2(&front, &back), sizes[0].min(sizes[1]), sizes[0].max(sizes[1]))
            }
        };
        let Light { diffuse, specular, power, .. } = self.field.light;
        let gloss = (diffuse + specular * power) / (parts * parts) as f32;
        // A parabola exceeds its values at both ends and in the middle by at most a quarter.
        let low = self.field.certain_from * 0.8;
        Turn { change2: change2 * gloss, least2, is_short: most2.simd_le(low * low) }
    }

    /// Adds a piece of a sheet: what the transfer function shows in it, and the isosurfaces.
    #[inline(always)]
    fn pass_piece<S: Simd>(
        &self,
        simd: S,
        (layer, reaching): (&Layer<S>, &ReachingSheet<S>),
        piece: &Piece<S>,
        medium: &mut Medium<S>,
    ) {
        let none = Lanes::splat(simd, 0.0);
        let on = (layer, reaching);
        let left = medium.before * medium.through;
        let Some((color, depth)) = self.color_and_depth(simd, on, piece, left) else { return };
        let ([place, next_place], [value, next]) = (piece.places, piece.values);
        let mut done = none;
        for number in 0..self.isosurfaces {
            // In the order from the front value to the back value.
            let rises = next.simd_gt(value);
            let [up, down] = [number, self.isosurfaces - 1 - number]
                .map(|surface| &self.field.isosurfaces[surface]);
            let of_met =
                |up: f32, down: f32| rises.select(Lanes::splat(simd, up), Lanes::splat(simd, down));
            let level = of_met(up.value, down.value);
            let crosses = (value.simd_lt(level) ^ next.simd_lt(level)) & piece.mask;
            if !crosses.any_true() {
                continue;
            }
            let share = crosses.select((level - value) / (next - value), done);
            medium.pass(simd, depth * (share - done), color);
            done = share;
            let opacity = crosses.select(of_met(up.opacity, down.opacity), none);
            let taken = medium.through * opacity;
            let outside = medium.before * medium.through;
            medium.through -= taken;
            medium.depth += crosses.select(of_met(up.depth, down.depth), none);
            let inside = medium.before * medium.through;
            let hits = outside.simd_gt(0.5) & inside.simd_le(0.5) & crosses;
            medium.hit = hits.select(piece.begin + piece.length * share, medium.hit);
            medium.has_hit |= hits;
            let mut surface =
                [0, 1, 2].map(|channel| of_met(up.color[channel], down.color[channel]));
            if self.is_lit {
                let at = place + (next_place - place) * share;
                let normal = (self.gradient(layer, at), layer.share);
                let on = (layer.direction, &reaching.at(at));
                surface = self.lit_field(simd, surface, normal, on);
            }
            for (sum, channel) in medium.color.iter_mut().zip(surface) {
                *sum = taken.mul_add(channel, *sum);
            }
        }
        medium.pass(simd, depth * (Lanes::splat(simd, 1.0) - done), color);
    }

    /// Returns the colour and the optical depth that the transfer function shows in a piece, or
    /// `None` if the piece has no visible value and the transfer function no isosurface. `left` is
    /// the light that reaches the piece.
    #[inline(always)]
    fn color_and_depth<S: Simd>(
        &self,
        simd: S,
        (layer, reaching): (&Layer<S>, &ReachingSheet<S>),
        piece: &Piece<S>,
        left: Lanes<S>,
    ) -> Option<([Lanes<S>; 3], Lanes<S>)> {
        let (none, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
        let ([place, next_place], [value, next]) = (piece.places, piece.values);
        let mut emission = if self.is_integrated {
            self.between(simd, value, next)
        } else {
            self.one(simd, layer.mean())
        };
        let mut normal = [none; 3];
        if self.has_gradient_opacity {
            normal = self.gradient(layer, (place + next_place) * 0.5);
        }
        if self.has_gradient_opacity {
            let factor = self.gradient_factor(simd, dot(normal, normal).sqrt());
            emission = four!(I => emission[I] * factor);
        }
        let depth = piece.mask.select(emission[3].max(none) * piece.length * layer.filling, none);
        if !(depth.simd_gt(0.0).any_true() || self.isosurfaces > 0) {
            return None;
        }
        let inverse = one / emission[3].max(Lanes::splat(simd, 1e-20));
        let mut color = three!(I => (emission[I] * inverse).max(none).min(one));
        if self.is_lit {
            let is_steady = piece.turn.is_steady(depth.min(one) * left);
            let on = (layer, reaching);
            color = self.lit_piece(simd, color, on, piece.places, is_steady);
        }
        Some((color, depth))
    }

    /// Returns the gradient in view space, in entries per thickness of a sheet.
    #[inline(always)]
    pub fn gradient<S: Simd>(&self, layer: &Layer<S>, u: Lanes<S>) -> [Lanes<S>; 3] {
        if let Some([front, middle, back]) = &layer.sections {
            let v = 1.0 - u;
            let w = v - u;
            let shares = [v * w, u * v * 4.0, u * w];
            return three!(I => {
                front[I] * shares[0] + middle[I] * shares[1] - back[I] * shares[2]
            });
        }
        self.gradient_of_faces(layer, u)
    }

    /// Returns the gradient from those of the faces: across the ray linear between them, along the
    /// ray the derivative of the parabola.
    #[inline(always)]
    pub fn gradient_of_faces<S: Simd>(&self, layer: &Layer<S>, u: Lanes<S>) -> [Lanes<S>; 3] {
        let (a, b, c) = (layer.front.value, layer.middle, layer.back.value);
        let slope = a * (u * 4.0 - 3.0) + b * (4.0 - u * 8.0) + c * (u * 4.0 - 1.0);
        let along = slope * self.field.gradients.length / layer.thickness;
        let (front, back) = (layer.front.across, layer.back.across);
        three!(I => (back[I] - front[I]).mul_add(u, front[I]) + along * layer.direction[I])
    }
}

impl<S: Simd> Medium<S> {
    /// Adds the medium to others in the same sheet: colours times optical depth, and optical depth.
    #[inline(always)]
    fn mixed_with(&self, simd: S, [red, green, blue, depth]: [Lanes<S>; 4]) -> [Lanes<S>; 4] {
        let one = Lanes::splat(simd, 1.0);
        let tau = self.depth.min(Lanes::splat(simd, MOST_DEPTH));
        // Converts opacity to optical depth: τ / (1 − e^−τ). For small τ that ratio would lose its
        // digits.
        let ratio = tau.simd_lt(1e-2).select(tau * 0.5 + 1.0, tau / (one - exp(simd, -tau)));
        let [red, green, blue] = [
            ratio.mul_add(self.color[0], red),
            ratio.mul_add(self.color[1], green),
            ratio.mul_add(self.color[2], blue),
        ];
        [red, green, blue, depth + tau]
    }

    #[inline(always)]
    fn pass(&mut self, simd: S, depth: Lanes<S>, color: [Lanes<S>; 3]) {
        let share = self.through * taken(simd, depth);
        for (sum, channel) in self.color.iter_mut().zip(color) {
            *sum = share.mul_add(channel, *sum);
        }
        self.through -= share;
        self.depth += depth;
    }
}

impl<S: Simd> Turn<S> {
    /// Whether one light stands for a piece that takes this share of the light.
    #[inline(always)]
    fn is_steady(&self, share: Lanes<S>) -> bool {
        let is_even = (self.change2 * share).simd_le(self.least2 * STEADY);
        (is_even | share.simd_le(UNSEEN) | self.is_short).all_true()
    }
}

/// Returns the square of the distance of two vectors.
#[inline(always)]
fn difference2<S: Simd>(a: &[Lanes<S>; 3], b: &[Lanes<S>; 3]) -> Lanes<S> {
    let difference = three!(I => a[I] - b[I]);
    dot(difference, difference)
}

/// Returns the share of light that an optical depth absorbs. For small depths, subtracting from 1
/// would lose the result in rounding.
#[inline(always)]
fn taken<S: Simd>(simd: S, depth: Lanes<S>) -> Lanes<S> {
    let one = Lanes::splat(simd, 1.0);
    depth.simd_lt(1e-3).select(depth * (one - depth * 0.5), one - exp(simd, -depth))
}
