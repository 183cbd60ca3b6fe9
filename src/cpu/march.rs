//! Walks the rays of a tile through the sheets of a lattice's field, eight pixels at a time.

use super::{
    close::{Face, Look, Pixels, Sheet, Visible},
    field::{Field, Sample, offsets},
    skip::{Shown, TILE},
    vector::{Lanes, dot, dot_with, three},
};
use crate::{math::View, scene::Optics};
use fearless_simd::{Simd, mask32x8, prelude::*};

/// A pixel that lets less light through is finished.
const OPAQUE: f32 = 0.0005;
/// No value yet.
const NO_VALUE: f32 = -3e38;

/// What the tiles of a picture share.
pub struct March<'a, T> {
    pub look: Look<'a>,
    pub visible: Visible,
    pub field: Field<'a, T>,
    pub shown: &'a Shown,
    pub dims: [usize; 3],
    pub view: &'a View,
    pub planes: Vec<f32>,
    /// Convex parts that are kept.
    pub clips: usize,
}

/// A tile's pixels, row by row: premultiplied colour and opacity, and the distance of the hit or the largest value.
pub type Tile = [([f32; 4], f32); TILE * TILE];

/// Eight rays: four pixels beside each other in two rows.
struct Rays<S: Simd> {
    direction: [Lanes<S>; 3],
    /// In steps of the lattice: where they start, and their way a world unit.
    start: [Lanes<S>; 3],
    way: [Lanes<S>; 3],
    /// The distances between which they are in the lattice's box and in what the clips keep.
    enter: Lanes<S>,
    leave: Lanes<S>,
}

impl<T: Sample> March<'_, T> {
    /// Draws the tile at a column and a row; `sheets`: in which it may show something.
    #[inline(always)]
    pub fn tile<S: Simd>(&self, simd: S, [column, row]: [usize; 2], sheets: &[u64]) -> Tile {
        let mut tile = [([0.0; 4], 0.0); TILE * TILE];
        if sheets.iter().all(|word| *word == 0) {
            return tile;
        }
        for y in (0..TILE).step_by(2) {
            for x in (0..TILE).step_by(4) {
                let rays = self.rays(simd, [column * TILE + x, row * TILE + y]);
                let pixels = self.walk(simd, &rays, sheets);
                let through: [f32; 8] = pixels.through.into();
                let [red, green, blue]: [[f32; 8]; 3] = three!(I => pixels.color[I].into());
                let hit: [f32; 8] = pixels.hit.into();
                for lane in 0..8 {
                    let own = &mut tile[(y + lane / 4) * TILE + x + lane % 4];
                    *own = ([red[lane], green[lane], blue[lane], 1.0 - through[lane]], hit[lane]);
                }
            }
        }
        tile
    }

    #[inline(always)]
    fn rays<S: Simd>(&self, simd: S, [x, y]: [usize; 2]) -> Rays<S> {
        let frame = self.look.frame;
        let columns: Lanes<S> = [0.5, 1.5, 2.5, 3.5, 0.5, 1.5, 2.5, 3.5].simd_into(simd);
        let rows: Lanes<S> = [0.5, 0.5, 0.5, 0.5, 1.5, 1.5, 1.5, 1.5].simd_into(simd);
        let right = (columns + (x as f32 - frame.center[0])) * (1.0 / frame.scale);
        let down = (rows + (y as f32 - frame.center[1])) * (1.0 / frame.scale);
        let (none, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
        let (origin, direction) = if self.view.perspective {
            let cosine = one / (right * right + down * down + 1.0).sqrt();
            ([none; 3], [right * cosine, down * cosine, cosine])
        } else {
            ([right, down, none], [none, none, one])
        };
        let from: [Lanes<S>; 3] = three!(I => dot_with(frame.field_axes[I], origin));
        let way = three!(I => dot_with(frame.field_axes[I], direction));
        let start = three!(I => from[I] + frame.field_origin[I]);
        let (mut enter, mut leave) = part_in_box(simd, frame.field_low, frame.field_high, start, way);
        let rows: [[f32; 4]; 3] = three!(I => [frame.world[0][I], frame.world[1][I], frame.world[2][I], 0.0]);
        let (origin, toward) = (three!(I => dot_with(rows[I], origin)), three!(I => dot_with(rows[I], direction)));
        for [low, high] in &frame.clips[..self.clips] {
            let (from, to) = if high[3] > 0.0 {
                part_in_box(simd, *low, *high, origin, toward)
            } else {
                part_in_half_space(simd, *low, high[0], origin, toward)
            };
            (enter, leave) = (enter.max(from), leave.min(to));
        }
        Rays { direction, start, way, enter, leave }
    }

    /// Walks the sheets front to back.
    #[inline(always)]
    fn walk<S: Simd>(&self, simd: S, rays: &Rays<S>, sheets: &[u64]) -> Pixels<S> {
        let none = Lanes::splat(simd, 0.0);
        let is_maximum = self.look.optics == Optics::Maximum;
        let hit = if is_maximum { Lanes::splat(simd, NO_VALUE) } else { none };
        let mut pixels = Pixels { color: [none; 3], through: Lanes::splat(simd, 1.0), hit };
        // The face behind the last sheet that was closed.
        let mut last = (usize::MAX, Face { value: none, across: [none; 3] }, none);
        for (word, bits) in sheets.iter().enumerate() {
            let mut bits = *bits;
            while bits != 0 {
                let number = word * 64 + bits.trailing_zeros() as usize;
                bits &= bits - 1;
                let (start, stop) = (self.planes[number], self.planes[number + 1]);
                let begin = rays.enter.max(Lanes::splat(simd, start));
                let end = rays.leave.min(Lanes::splat(simd, stop));
                let inside = begin.simd_lt(end);
                if !inside.any_true() {
                    continue;
                }
                let mask = inside & self.may_show(simd, rays, [start, stop]);
                if !mask.any_true() {
                    continue;
                }
                if last.0 != number {
                    let (front, along) = self.face(simd, rays, start);
                    last = (number, front, along);
                }
                let (front, front_along) = (last.1, last.2);
                let (back, back_along) = self.face(simd, rays, stop);
                last = (number + 1, back, back_along);
                let thickness = stop - start;
                let sum = front.value + back.value;
                // Hermite: the mean of the ends and an eighth of how much the slopes there differ.
                let bend = (front_along - back_along) * thickness;
                let middle = sum * 0.5 + bend * 0.125;
                let mut sheet = Sheet { front, back, middle, start, thickness, begin, end, direction: rays.direction };
                if is_maximum || self.visible.may_show(simd, &self.look, &sheet) {
                    // The mean of the sheet is exact for fields of the fifth degree (Simpson's rule with slopes).
                    let inside = self.value(simd, rays, 0.5 * (start + stop));
                    let mean = (sum * 7.0 + inside * 16.0) * (1.0 / 30.0) + bend * (1.0 / 60.0);
                    sheet.middle = mean * 1.5 - sum * 0.25;
                    self.look.close(simd, &sheet, mask, &mut pixels);
                    if !is_maximum && !pixels.through.simd_ge(OPAQUE).any_true() {
                        return pixels;
                    }
                }
            }
        }
        pixels
    }

    #[inline(always)]
    fn place<S: Simd>(rays: &Rays<S>, distance: f32) -> [Lanes<S>; 3] {
        three!(I => rays.way[I] * distance + rays.start[I])
    }

    #[inline(always)]
    fn value<S: Simd>(&self, simd: S, rays: &Rays<S>, distance: f32) -> Lanes<S> {
        self.field.at(simd, Self::place(rays, distance)).0 * self.look.frame.transfer[1]
    }

    /// The field on the plane at a distance, and its change along the ray a world unit.
    #[inline(always)]
    fn face<S: Simd>(&self, simd: S, rays: &Rays<S>, distance: f32) -> (Face<S>, Lanes<S>) {
        let frame = self.look.frame;
        let per_value = frame.transfer[1];
        let (value, slopes) = self.field.at(simd, Self::place(rays, distance));
        // From steps of the lattice to view space.
        let axes = &frame.field_axes;
        let gradient = three!(I => {
            (slopes[0] * axes[0][I] + slopes[1] * axes[1][I] + slopes[2] * axes[2][I]) * per_value
        });
        let along = dot(gradient, rays.direction);
        let length = frame.gradients[2];
        let across = three!(I => (gradient[I] - along * rays.direction[I]) * length);
        (Face { value: value * per_value, across }, along)
    }

    /// Whether something may show around three places of each ray in a sheet. Where the sheet is no thicker than the lattice's
    /// steps, its middle alone is looked up: all of the sheet lies within half a step of there.
    #[inline(always)]
    fn may_show<S: Simd>(&self, simd: S, rays: &Rays<S>, [start, stop]: [f32; 2]) -> mask32x8<S> {
        let distances = [0.5 * (start + stop), start, stop];
        let is_thin = self.look.frame.field_axes.iter().all(|axis| {
            let [x, y, z, _] = *axis;
            (x * x + y * y + z * z) * (stop - start) * (stop - start) <= 1.0
        });
        let mut shows = [false; 8];
        for distance in &distances[..if is_thin { 1 } else { 3 }] {
            let place = Self::place(rays, *distance);
            let nearest = three!(I => {
                let last = Lanes::splat(simd, self.dims[I] as f32 - 1.0);
                (place[I] + 0.5).floor().max(Lanes::splat(simd, 0.0)).min(last)
            });
            for (shows, sample) in shows.iter_mut().zip(offsets(self.dims, nearest)) {
                *shows |= self.shown.samples[sample];
            }
        }
        let bits = shows.iter().rev().fold(0, |bits, shows| bits << 1 | u64::from(*shows));
        mask32x8::from_bitmask(simd, bits)
    }
}

/// The distances between which rays are in a box.
#[inline(always)]
fn part_in_box<S: Simd>(
    simd: S,
    low: [f32; 4],
    high: [f32; 4],
    origin: [Lanes<S>; 3],
    direction: [Lanes<S>; 3],
) -> (Lanes<S>, Lanes<S>) {
    let (mut enter, mut leave) = (Lanes::splat(simd, -3e38), Lanes::splat(simd, 3e38));
    for axis in 0..3 {
        // A ray along a face would divide 0 by 0.
        let own = direction[axis];
        let safe = own.abs().simd_lt(1e-20).select(Lanes::splat(simd, 1e-20), own);
        let a = (low[axis] - origin[axis]) / safe;
        let b = (high[axis] - origin[axis]) / safe;
        (enter, leave) = (enter.max(a.min(b)), leave.min(a.max(b)));
    }
    (enter, leave)
}

/// The distances between which rays are where normal·x ≤ offset.
#[inline(always)]
fn part_in_half_space<S: Simd>(
    simd: S,
    normal: [f32; 4],
    offset: f32,
    origin: [Lanes<S>; 3],
    direction: [Lanes<S>; 3],
) -> (Lanes<S>, Lanes<S>) {
    let slope = dot_with(normal, direction);
    let safe = slope.abs().simd_lt(1e-20).select(Lanes::splat(simd, 1e-20), slope);
    let (far, behind) = (Lanes::splat(simd, 3e38), Lanes::splat(simd, -3e38));
    let at = ((offset - dot_with(normal, origin)) / safe).max(behind).min(far);
    let is_outward = safe.simd_gt(0.0);
    (is_outward.select(behind, at), is_outward.select(at, far))
}
