//! Closes a sheet at eight pixels: the field in it, a parabola along each ray, is classified, lit and composited front to back.
//! The definition is that of `src/reference`; shaders/sheet.wgsl does the same.

use super::vector::{Lanes, dot, exp, exp2, four, log2, three};
use crate::{
    engine::{tables::Tables, uniforms::Frame},
    scene::Optics,
};
use fearless_simd::{Simd, mask32x8, prelude::*};

/// Parts of a sheet in which the transfer function is integrated.
const PARTS: usize = 3;
/// Values nearer to each other than this many entries of the table are taken as that far apart.
const NARROW: f32 = 8.0;
/// The same for values far beyond the table, as a part of them.
const NARROW_AFAR: f32 = 1e-6;
/// Optical depth that counts as opaque.
const MOST_DEPTH: f32 = 20.0;
/// A gradient shorter than this has no direction.
const LEAST_GRADIENT: f32 = 1e-20;

/// What decides how sheets are closed, the same for all of a picture.
pub struct Look<'a> {
    pub frame: &'a Frame,
    pub tables: &'a Tables,
    pub optics: Optics,
    pub is_lit: bool,
    pub has_gradient_opacity: bool,
    /// The transfer function is integrated between values, instead of looked up at the mean of a sheet.
    pub is_integrated: bool,
    pub isosurfaces: usize,
}

/// Eight pixels of the picture so far.
pub struct Pixels<S: Simd> {
    pub color: [Lanes<S>; 3],
    pub through: Lanes<S>,
    /// The distance at which half of the light is taken, or the largest value.
    pub hit: Lanes<S>,
}

/// The field on a plane between two sheets: its value, in entries of the table, and its change across the ray.
#[derive(Clone, Copy)]
pub struct Face<S: Simd> {
    pub value: Lanes<S>,
    pub across: [Lanes<S>; 3],
}

/// One sheet at eight pixels.
pub struct Sheet<S: Simd> {
    pub front: Face<S>,
    pub back: Face<S>,
    /// The value in the middle.
    pub middle: Lanes<S>,
    /// Where it begins, how thick it is, and the part of the rays that counts.
    pub start: f32,
    pub thickness: f32,
    pub begin: Lanes<S>,
    pub end: Lanes<S>,
    pub direction: [Lanes<S>; 3],
}

/// What a sheet does to the light.
struct Medium<S: Simd> {
    through: Lanes<S>,
    depth: Lanes<S>,
    color: [Lanes<S>; 3],
    hit: Lanes<S>,
}

/// How many entries of the transfer function's table up to each show something.
pub struct Visible(Vec<u32>);

impl Visible {
    pub fn new(look: &Look) -> Self {
        let [_, _, last, place] = look.frame.transfer;
        let mut shows: Vec<bool> = look.tables.entries[..=last as usize].iter().map(|entry| entry[3] > 0.0).collect();
        for surface in &look.frame.isosurfaces[..look.isosurfaces] {
            let at = (surface[0][0] + place).clamp(0.0, last) as usize;
            let end = (at + 2).min(shows.len());
            shows[at..end].fill(true);
        }
        let mut sum = 0;
        let mut before = vec![0];
        before.extend(shows.iter().map(|shows| {
            sum += u32::from(*shows);
            sum
        }));
        Self(before)
    }

    /// Whether any of the values that a sheet may have show something.
    #[inline(always)]
    pub fn may_show<S: Simd>(&self, simd: S, look: &Look, sheet: &Sheet<S>) -> bool {
        let (a, b, c) = (sheet.front.value, sheet.middle, sheet.back.value);
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        // A parabola leaves the range of its values at both ends and the middle by an eighth of it at most; integrals are taken
        // over NARROW entries.
        let slack = (high - low) * 0.125 + (0.5 * NARROW + 1.0);
        let [_, _, last, place] = look.frame.transfer;
        let (none, last) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, last));
        let low: [f32; 8] = (low - slack + place).max(none).min(last).into();
        let high: [f32; 8] = (high + slack + place).max(none).min(last).into();
        low.iter().zip(high).any(|(low, high)| self.0[high as usize + 1] > self.0[*low as usize])
    }
}

impl Look<'_> {
    /// Means over the values between two: extinction times colour, and extinction.
    #[inline(always)]
    fn between<S: Simd>(&self, simd: S, a: Lanes<S>, b: Lanes<S>) -> [Lanes<S>; 4] {
        let [_, _, end, place] = self.frame.transfer;
        let none = Lanes::splat(simd, 0.0);
        let all = Lanes::splat(simd, end);
        let middle = (a + b) * 0.5 + place;
        let reach = ((a - b).abs().max(Lanes::splat(simd, NARROW)) * 0.5).max(middle.abs() * NARROW_AFAR);
        let (low, high) = ((middle - reach).floor(), (middle + reach).ceil());
        let inverse = Lanes::splat(simd, 1.0) / (high - low);
        let (first, last) = (low.max(none).min(all), high.max(none).min(all));
        let [first_at, last_at]: [[f32; 8]; 2] = [first.into(), last.into()];
        let integrals = &self.tables.entries[self.tables.starts[0] as usize..];
        let mut differences = [[0.0f32; 8]; 4];
        for (lane, (first, last)) in first_at.into_iter().zip(last_at).enumerate() {
            let (from, to) = (integrals[first as usize], integrals[last as usize]);
            for (part, own) in differences.iter_mut().enumerate() {
                own[lane] = to[part] - from[part];
            }
        }
        let within: [Lanes<S>; 4] = four!(I => differences[I].simd_into(simd));
        // Values before and behind the table are those of its ends.
        let before = (high.min(none) - low.min(none)) * inverse;
        let behind = (high.max(all) - low.max(all)) * inverse;
        let [first, last] = self.frame.beyond;
        four!(I => within[I] * inverse + before * first[I] + behind * last[I])
    }

    /// Extinction times colour, and extinction, of one value.
    #[inline(always)]
    fn one<S: Simd>(&self, simd: S, value: Lanes<S>) -> [Lanes<S>; 4] {
        let [_, _, end, place] = self.frame.transfer;
        let at = (value + place).max(Lanes::splat(simd, 0.0)).min(Lanes::splat(simd, end));
        let mut found = [[0.0f32; 8]; 4];
        let places: [f32; 8] = at.into();
        for (lane, at) in places.into_iter().enumerate() {
            let (low, part) = (at as usize, at.fract());
            let (a, b) = (self.tables.entries[low], self.tables.entries[low + 1]);
            for (channel, own) in found.iter_mut().enumerate() {
                own[lane] = a[channel] + (b[channel] - a[channel]) * part;
            }
        }
        let [red, green, blue, extinction]: [Lanes<S>; 4] = four!(I => found[I].simd_into(simd));
        [red * extinction, green * extinction, blue * extinction, extinction]
    }

    /// The factor on the extinction where the gradient has a magnitude.
    #[inline(always)]
    fn gradient_factor<S: Simd>(&self, simd: S, magnitude: Lanes<S>) -> Lanes<S> {
        let [first, per_magnitude, ..] = self.frame.gradients;
        let factors = &self.tables.entries[self.tables.starts[1] as usize..self.tables.starts[2] as usize];
        let last = Lanes::splat(simd, (factors.len() - 2) as f32);
        let at: [f32; 8] = ((magnitude - first) * per_magnitude).max(Lanes::splat(simd, 0.0)).min(last).into();
        let factor = |at: f32| {
            let [low, high] = [factors[at as usize][0], factors[at as usize + 1][0]];
            low + (high - low) * at.fract()
        };
        at.map(factor).simd_into(simd)
    }

    /// Light at the eye, on both sides (Blinn 1977).
    #[inline(always)]
    fn lit<S: Simd>(&self, simd: S, color: [Lanes<S>; 3], normal: [Lanes<S>; 3], along: Lanes<S>) -> [Lanes<S>; 3] {
        let [ambient, diffuse, specular, power] = self.frame.volume_shade;
        let one = Lanes::splat(simd, 1.0);
        let size = dot(normal, normal).sqrt();
        let has_direction = size.simd_gt(LEAST_GRADIENT);
        let facing = (along.abs() / size.max(Lanes::splat(simd, LEAST_GRADIENT))).min(one);
        let facing = has_direction.select(facing, one);
        let highlight = exp2(simd, log2(simd, facing.max(Lanes::splat(simd, 1e-6))) * power) * specular;
        let highlight = has_direction.select(highlight, Lanes::splat(simd, 0.0));
        let share = facing * diffuse + ambient;
        three!(I => color[I].mul_add(share, highlight).min(one))
    }

    /// Adds a sheet to the picture, at the pixels of `mask`.
    #[inline(always)]
    pub fn close<S: Simd>(&self, simd: S, sheet: &Sheet<S>, mask: mask32x8<S>, pixels: &mut Pixels<S>) {
        let none = Lanes::splat(simd, 0.0);
        let one = Lanes::splat(simd, 1.0);
        let length = (sheet.end - sheet.begin).max(none);
        let parts = if self.is_integrated || self.isosurfaces > 0 { PARTS } else { 1 };
        let step = length * (1.0 / parts as f32);
        let per_thickness = 1.0 / sheet.thickness;
        let mut place = (sheet.begin - sheet.start) * per_thickness;
        let mut value = sheet.parabola(place);
        if self.optics == Optics::Maximum {
            let mut peak = value;
            for _ in 0..parts {
                place += step * per_thickness;
                peak = peak.max(sheet.parabola(place));
            }
            pixels.hit = mask.select(pixels.hit.max(peak), pixels.hit);
            return;
        }
        let before = pixels.through;
        let mut medium = Medium { through: one, depth: none, color: [none; 3], hit: pixels.hit };
        let mut has_hit = mask32x8::splat(simd, false);
        for part in 0..parts {
            let near = sheet.begin + step * part as f32;
            let next_place = place + step * per_thickness;
            let next = sheet.parabola(next_place);
            let mut shown =
                if self.is_integrated { self.between(simd, value, next) } else { self.one(simd, sheet.mean()) };
            let (mut normal, mut along) = ([none; 3], none);
            if self.is_lit || self.has_gradient_opacity {
                (normal, along) = self.gradient(sheet, (place + next_place) * 0.5);
            }
            if self.has_gradient_opacity {
                let factor = self.gradient_factor(simd, dot(normal, normal).sqrt());
                shown = four!(I => shown[I] * factor);
            }
            let depth = mask.select(shown[3].max(none) * step, none);
            if !(depth.simd_gt(0.0).any_true() || self.isosurfaces > 0) {
                place = next_place;
                value = next;
                continue;
            }
            let inverse = one / shown[3].max(Lanes::splat(simd, 1e-20));
            let mut color = three!(I => (shown[I] * inverse).max(none).min(one));
            if self.is_lit {
                color = self.lit(simd, color, normal, along);
            }
            let mut done = none;
            for number in 0..self.isosurfaces {
                // From the value at the front to that at the back.
                let rises = next.simd_gt(value);
                let [up, down] = [number, self.isosurfaces - 1 - number].map(|i| self.frame.isosurfaces[i]);
                let own = |row: usize, column: usize| {
                    rises.select(Lanes::splat(simd, up[row][column]), Lanes::splat(simd, down[row][column]))
                };
                let level = own(0, 0);
                let crosses = (value.simd_lt(level) ^ next.simd_lt(level)) & mask;
                if !crosses.any_true() {
                    continue;
                }
                let share = crosses.select((level - value) / (next - value), done);
                medium.pass(simd, depth * (share - done), color);
                done = share;
                let opacity = crosses.select(own(0, 1), none);
                let taken = medium.through * opacity;
                let outside = before * medium.through;
                medium.through -= taken;
                medium.depth += crosses.select(own(0, 2), none);
                let hits = outside.simd_gt(0.5) & (before * medium.through).simd_le(0.5) & crosses;
                medium.hit = hits.select(near + step * share, medium.hit);
                has_hit |= hits;
                let mut surface = [0, 1, 2].map(|channel| own(1, channel));
                if self.is_lit {
                    let (normal, along) = self.gradient(sheet, place + (next_place - place) * share);
                    surface = self.lit(simd, surface, normal, along);
                }
                for (sum, channel) in medium.color.iter_mut().zip(surface) {
                    *sum = taken.mul_add(channel, *sum);
                }
            }
            medium.pass(simd, depth * (one - done), color);
            place = next_place;
            value = next;
        }
        self.composite(simd, sheet, medium, has_hit, pixels);
    }

    #[inline(always)]
    fn composite<S: Simd>(
        &self,
        simd: S,
        sheet: &Sheet<S>,
        medium: Medium<S>,
        has_hit: mask32x8<S>,
        pixels: &mut Pixels<S>,
    ) {
        let before = pixels.through;
        let depth = medium.depth.min(Lanes::splat(simd, MOST_DEPTH));
        if self.optics == Optics::XRay {
            let share = before * taken(simd, depth);
            pixels.color = three!(I => pixels.color[I] + share);
            pixels.through = before - share;
        } else {
            for (sum, channel) in pixels.color.iter_mut().zip(medium.color) {
                *sum = before.mul_add(channel, *sum);
            }
            pixels.through = before * (Lanes::splat(simd, 1.0) - taken(simd, depth));
        }
        let passes = before.simd_gt(0.5) & pixels.through.simd_le(0.5) & !has_hit;
        pixels.hit = has_hit.select(medium.hit, pixels.hit);
        if passes.any_true() {
            // Inside the sheet, optical depth counts as evenly spread.
            let share = log2(simd, before * 2.0) * std::f32::consts::LN_2 / depth.max(Lanes::splat(simd, 1e-20));
            pixels.hit = passes.select(share * sheet.thickness + sheet.start, pixels.hit);
        }
    }

    /// The gradient in view space, in entries per thickness of a sheet, and its part along the ray.
    #[inline(always)]
    fn gradient<S: Simd>(&self, sheet: &Sheet<S>, u: Lanes<S>) -> ([Lanes<S>; 3], Lanes<S>) {
        let (a, b, c) = (sheet.front.value, sheet.middle, sheet.back.value);
        let slope = a * (u * 4.0 - 3.0) + b * (4.0 - u * 8.0) + c * (u * 4.0 - 1.0);
        let along = slope * (self.frame.gradients[2] / sheet.thickness);
        let (front, back) = (sheet.front.across, sheet.back.across);
        let normal = three!(I => (back[I] - front[I]).mul_add(u, front[I]) + along * sheet.direction[I]);
        (normal, along)
    }
}

impl<S: Simd> Sheet<S> {
    #[inline(always)]
    fn parabola(&self, u: Lanes<S>) -> Lanes<S> {
        let v = 1.0 - u;
        let w = v - u;
        self.front.value * v * w + self.middle * u * v * 4.0 - self.back.value * u * w
    }

    #[inline(always)]
    fn mean(&self) -> Lanes<S> {
        (self.front.value + self.middle * 4.0 + self.back.value) * (1.0 / 6.0)
    }
}

impl<S: Simd> Medium<S> {
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

/// The share of light that an optical depth takes; where it is small, the difference to 1 is lost in rounding.
#[inline(always)]
fn taken<S: Simd>(simd: S, depth: Lanes<S>) -> Lanes<S> {
    let one = Lanes::splat(simd, 1.0);
    depth.simd_lt(1e-3).select(depth * (one - depth * 0.5), one - exp(simd, -depth))
}
