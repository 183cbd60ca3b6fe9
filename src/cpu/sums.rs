//! The sums of the open sheets of a tile: everything that splats have added to them so far.
//!
//! A splat adds to a window of four sheets, and to the three planes between them. Sheet and plane n
//! use slot n mod 4.

use super::{
    close::{Packet, Pixels},
    layer::{Face, Layer},
    plan::Plan,
    rays::{PACKETS, Rays},
    vector::{Lanes, three},
};
use crate::plan::TILE;
use fearless_simd::{Simd, mask32x8, prelude::*};

/// Sheets of a window.
pub const WINDOW: usize = 4;
/// A sheet with less optical depth than this has no colour: the sum may be a rounding remainder.
const LEAST_DEPTH: f32 = 1e-5;
/// Beside trained Gaussians, a sheet is fully lit from the inverse of this share of normals on.
const LIT_BY: f32 = 2.0;

/// The radiance sums of eight pixels: optical depth; then the facing weights, colours and normals,
/// each weighted by optical depth. If no splat has a normal, facing weights are all 1, and neither
/// these nor normals are added.
pub type Radiance<S> = [Lanes<S>; 8];

/// Sums of a field in a sheet at eight pixels: weights and weighted values.
#[derive(Clone, Copy)]
pub struct FieldSums<S: Simd> {
    pub weight: Lanes<S>,
    pub value: Lanes<S>,
}

/// The same on a plane, with the negated derivatives of both per pixel to the right and down.
#[derive(Clone, Copy)]
pub struct FaceSums<S: Simd> {
    pub weight: Lanes<S>,
    pub value: Lanes<S>,
    pub weight_slope: [Lanes<S>; 2],
    pub value_slope: [Lanes<S>; 2],
}

/// Sums of the facets in a sheet at eight pixels.
#[derive(Clone, Copy)]
pub struct FacetSums<S: Simd> {
    /// The shares of the pixels that fronts and backs fill. Rods count as backs, and of several the
    /// largest.
    pub shares: [Lanes<S>; 2],
    /// The shares of what is seen of their images.
    pub seen: Lanes<S>,
    /// Lit colours times shares that are seen.
    pub color: [Lanes<S>; 3],
    /// Shares that count less the farther a facet is; distances and lit colours times these.
    pub weight: Lanes<S>,
    pub distance: Lanes<S>,
    pub nearest: [Lanes<S>; 3],
}

/// The facets of a sheet at eight pixels: the share of the pixels that they fill, and their mean
/// distance and colour.
pub struct Cover<S: Simd> {
    pub share: Lanes<S>,
    /// The opacity of this share.
    pub opacity: Lanes<S>,
    pub distance: Lanes<S>,
    pub color: [Lanes<S>; 3],
}

impl<S: Simd> Cover<S> {
    /// Adds the facets to pixels. They absorb the light of the share that they fill, from the light
    /// that is left: neighbours in another sheet fill the rest, without a gap between them.
    #[inline(always)]
    pub fn absorb(&self, simd: S, pixels: &mut Pixels<S>) {
        let before = pixels.through;
        let one = Lanes::splat(simd, 1.0);
        // Neighbours that are clear take less from the light that translucent ones have left.
        let whole = self.opacity * self.opacity;
        let light = (one - before).mul_add(whole * whole, before);
        let light = self.opacity.simd_ge(one).select(one, light);
        let share = (self.share * light).min(before) * self.opacity;
        pixels.color = three!(I => share.mul_add(self.color[I], pixels.color[I]));
        pixels.through = before - share;
        let half = Lanes::splat(simd, 0.5);
        let passes = before.simd_gt(half) & pixels.through.simd_le(half);
        pixels.hit = passes.select(self.distance, pixels.hit);
    }

    /// Returns the distances between two planes at which the facets lie: the second plane where
    /// there are none.
    #[inline(always)]
    pub fn place(&self, simd: S, [start, stop]: [f32; 2]) -> Lanes<S> {
        let [start, stop] = [Lanes::splat(simd, start), Lanes::splat(simd, stop)];
        let is_covered = self.share.simd_gt(0.0);
        is_covered.select(self.distance.max(start).min(stop), stop)
    }
}

/// The sums of splats that carry their own colour.
pub struct Sums<S: Simd> {
    /// Empty in a picture without radiance.
    pub radiance: Vec<[Radiance<S>; PACKETS]>,
    /// The packets that have radiance, as bits.
    pub has_radiance: [u8; WINDOW],
    /// Empty in a scene without facets.
    pub facets: Vec<[FacetSums<S>; PACKETS]>,
    pub has_facets: [u8; WINDOW],
    /// Facets show images, of which parts may not be seen, or are rods, which may fill the same
    /// part of a pixel.
    has_seen: bool,
    none: Lanes<S>,
}

/// The sums of a scattered field.
pub struct ScalarSums<S: Simd> {
    pub field: [[FieldSums<S>; PACKETS]; WINDOW],
    pub faces: [[FaceSums<S>; PACKETS]; WINDOW],
    /// The packets that have a field, as bits.
    pub has_field: [u8; WINDOW],
    none: Lanes<S>,
}

/// A value on a plane, and where it exists.
struct Resolved<S: Simd> {
    face: Face<S>,
    has_value: mask32x8<S>,
}

impl<S: Simd> FacetSums<S> {
    #[inline(always)]
    fn none(none: Lanes<S>) -> Self {
        Self {
            shares: [none; 2],
            seen: none,
            color: [none; 3],
            weight: none,
            distance: none,
            nearest: [none; 3],
        }
    }
}

impl<S: Simd> Sums<S> {
    #[inline(always)]
    pub fn new(simd: S, plan: &Plan) -> Self {
        let none = Lanes::splat(simd, 0.0);
        let no_facets = [FacetSums::none(none); PACKETS];
        let no_radiance = [[none; 8]; PACKETS];
        let has_radiance = plan.has_radiance || plan.is_classified;
        Self {
            radiance: if has_radiance { vec![no_radiance; WINDOW] } else { Vec::new() },
            has_radiance: [0; WINDOW],
            facets: if plan.has_facets { vec![no_facets; WINDOW] } else { Vec::new() },
            has_seen: !plan.with_images.is_empty() || plan.has_rods,
            has_facets: [0; WINDOW],
            none,
        }
    }

    /// Takes the radiance of a sheet at a packet: colour times optical depth, and optical depth.
    /// Returns `None` if none was added.
    #[inline(always)]
    pub fn take_radiance(
        &mut self,
        simd: S,
        plan: &Plan,
        packet: &Packet<S>,
        sheet: usize,
    ) -> Option<[Lanes<S>; 4]> {
        let slot = sheet % WINDOW;
        if self.has_radiance[slot] & packet.bit() == 0 {
            return None;
        }
        self.has_radiance[slot] &= !packet.bit();
        let [depth, mut facing, red, green, blue, x, y, z] =
            std::mem::replace(&mut self.radiance[slot][packet.number], [self.none; 8]);
        if !plan.has_normals {
            facing = depth;
        }
        let one = Lanes::splat(simd, 1.0);
        // If next to nothing faces the eye, rounding may have left a weight of any sign.
        let inverse = one / facing.max(Lanes::splat(simd, 1e-12));
        let sum = [red, green, blue];
        let most = Lanes::splat(simd, plan.brightest);
        let mut color = three!(I => (sum[I] * inverse).max(self.none).min(most));
        if plan.lit_surfaces {
            let normal = [x, y, z];
            let middle = 0.5 * (plan.planes[sheet] + plan.planes[sheet + 1]);
            let on = (&packet.rays, Lanes::splat(simd, middle));
            let lit = plan.lit_surface(simd, color, normal, on);
            let size2 = x * x + y * y + z * z;
            let has_normal = size2.simd_gt(0.0);
            if plan.has_trained {
                // The share of what is lit: Gaussians are not.
                let share = (size2.sqrt() * inverse * LIT_BY).min(one);
                color = three!(I => share.mul_add(lit[I] - color[I], color[I]));
            } else {
                color = three!(I => has_normal.select(lit[I], color[I]));
            }
        }
        let counts = depth.simd_ge(LEAST_DEPTH);
        let depth = counts.select(depth, self.none);
        Some([color[0] * depth, color[1] * depth, color[2] * depth, depth])
    }

    /// Takes the facets of a sheet at a packet. Returns `None` if none were added.
    #[inline(always)]
    pub fn take_facets(&mut self, simd: S, packet: &Packet<S>, sheet: usize) -> Option<Cover<S>> {
        let slot = sheet % WINDOW;
        if self.has_facets[slot] & packet.bit() == 0 {
            return None;
        }
        self.has_facets[slot] &= !packet.bit();
        let none = FacetSums::none(self.none);
        let sums = std::mem::replace(&mut self.facets[slot][packet.number], none);
        let [front, back] = sums.shares;
        let one = Lanes::splat(simd, 1.0);
        let inverse = one / sums.weight.max(Lanes::splat(simd, 1e-37));
        let mut all = front + back;
        let seen = if self.has_seen { sums.seen } else { all };
        all = all.max(seen);
        let least = Lanes::splat(simd, 1e-37);
        let per_share = one / seen.max(least);
        // What is more than the whole pixel lies behind something.
        let hidden = (all - one).max(self.none).min(one);
        let part = hidden * hidden;
        let color = three!(I => {
            let (mean, nearest) = (sums.color[I] * per_share, sums.nearest[I] * inverse);
            part.mul_add(nearest - mean, mean).max(self.none).min(one)
        });
        // At a fold, both sides fill the same part of a pixel.
        let share = front.max(back).min(one);
        let opacity = if self.has_seen { (seen / share.max(least)).min(one) } else { one };
        Some(Cover { share, opacity, distance: sums.distance * inverse, color })
    }

    /// Clears the slot of a sheet, for the sheet four further on.
    #[inline(always)]
    pub fn clear(&mut self, sheet: usize) {
        let slot = sheet % WINDOW;
        if self.has_radiance[slot] != 0 {
            // Not taken yet: the sheet is not drawn, or a packet is done.
            for (packet, sums) in self.radiance[slot].iter_mut().enumerate() {
                if self.has_radiance[slot] & (1 << packet) != 0 {
                    *sums = [self.none; 8];
                }
            }
            self.has_radiance[slot] = 0;
        }
        if self.has_facets[slot] != 0 {
            for (packet, sums) in self.facets[slot].iter_mut().enumerate() {
                if self.has_facets[slot] & (1 << packet) != 0 {
                    *sums = FacetSums::none(self.none);
                }
            }
            self.has_facets[slot] = 0;
        }
    }
}

impl<S: Simd> ScalarSums<S> {
    #[inline(always)]
    pub fn new(simd: S) -> Self {
        let none = Lanes::splat(simd, 0.0);
        Self {
            field: [[FieldSums { weight: none, value: none }; PACKETS]; WINDOW],
            faces: [[FaceSums {
                weight: none,
                value: none,
                weight_slope: [none; 2],
                value_slope: [none; 2],
            }; PACKETS]; WINDOW],
            has_field: [0; WINDOW],
            none,
        }
    }

    /// Returns the field of a sheet at a packet, or `None` if none was added. `slopes` are those
    /// per pixel to the right and down, on the planes in front of and behind the sheet, if they are
    /// differences of neighbouring pixels.
    #[inline(always)]
    pub fn resolve(
        &self,
        simd: S,
        plan: &Plan,
        packet: &Packet<S>,
        sheet: usize,
        slopes: Option<[[Lanes<S>; 2]; 2]>,
    ) -> Option<(Layer<S>, mask32x8<S>)> {
        let (slot, rays) = (sheet % WINDOW, packet.rays_in(plan));
        if self.has_field[slot] & packet.bit() == 0 {
            return None;
        }
        let [start, stop] = [plan.planes[sheet], plan.planes[sheet + 1]];
        let thickness = stop - start;
        let sums = &self.field[slot][packet.number];
        let has_value = sums.weight.simd_gt(plan.field.least_sum * thickness);
        let value = sums.value / sums.weight.max(Lanes::splat(simd, 1e-37));
        let one = Lanes::splat(simd, 1.0);
        let filling =
            if plan.on_lattice { one } else { (sums.weight * (1.0 / thickness)).min(one) };
        let front = self.face(simd, plan, packet, sheet, slopes.map(|[front, _]| front));
        let back = self.face(simd, plan, packet, sheet + 1, slopes.map(|[_, back]| back));
        let either = |a: &Resolved<S>, b: &Resolved<S>| {
            let across = three!(I => a
                .has_value
                .select(a.face.across[I], b.has_value.select(b.face.across[I], self.none)));
            Face { value: a.has_value.select(a.face.value, value), across }
        };
        let (front, back) = (either(&front, &back), either(&back, &front));
        let middle = value * 1.5 - (front.value + back.value) * 0.25;
        let begin = rays.inside[0].max(Lanes::splat(simd, start));
        let end = rays.inside[1].min(Lanes::splat(simd, stop));
        let layer = Layer {
            front,
            back,
            middle,
            start: Lanes::splat(simd, start),
            thickness: Lanes::splat(simd, thickness),
            begin,
            end,
            filling,
            weight: one,
            direction: rays.direction,
            sections: None,
            share: None,
        };
        Some((layer, has_value))
    }

    #[inline(always)]
    fn face(
        &self,
        simd: S,
        plan: &Plan,
        packet: &Packet<S>,
        plane: usize,
        differences: Option<[Lanes<S>; 2]>,
    ) -> Resolved<S> {
        let sums = &self.faces[plane % WINDOW][packet.number];
        let has_value = sums.weight.simd_gt(plan.field.least_sum);
        let inverse = Lanes::splat(simd, 1.0) / sums.weight.max(Lanes::splat(simd, 1e-37));
        let value = sums.value * inverse;
        let mut across = [self.none; 3];
        if plan.has_gradients() {
            let of =
                |axis: usize| (value * sums.weight_slope[axis] - sums.value_slope[axis]) * inverse;
            let slopes = differences.unwrap_or([of(0), of(1)]);
            across = across_of(simd, plan, &packet.rays, slopes, plan.planes[plane]);
        }
        Resolved { face: Face { value, across }, has_value }
    }

    /// Returns the values of a tile on a plane, row by row, for differences between neighbouring
    /// pixels; NaN where there is none.
    #[inline(always)]
    pub fn values_on(&self, simd: S, plan: &Plan, plane: usize) -> [[f32; TILE]; TILE] {
        let mut values = [[f32::NAN; TILE]; TILE];
        for (packet, sums) in self.faces[plane % WINDOW].iter().enumerate() {
            let has_value = sums.weight.simd_gt(plan.field.least_sum);
            let value = sums.value / sums.weight.max(Lanes::splat(simd, 1e-37));
            let value: [f32; 8] = has_value.select(value, Lanes::splat(simd, f32::NAN)).into();
            for (lane, value) in value.into_iter().enumerate() {
                values[packet / 2 * 2 + lane / 4][packet % 2 * 4 + lane % 4] = value;
            }
        }
        values
    }

    /// Clears the slots of a sheet and of the plane in front of it, for the sheet and plane four
    /// further on.
    #[inline(always)]
    pub fn clear(&mut self, sheet: usize) {
        let slot = sheet % WINDOW;
        if self.has_field[slot] != 0 {
            let none = self.none;
            self.field[slot] = [FieldSums { weight: none, value: none }; PACKETS];
            self.faces[slot] = [FaceSums {
                weight: none,
                value: none,
                weight_slope: [none; 2],
                value_slope: [none; 2],
            }; PACKETS];
            self.has_field[slot] = 0;
        }
    }
}

/// Returns the gradient's component across the ray, from the slopes per pixel to the right and down
/// on the plane at a distance.
#[inline(always)]
fn across_of<S: Simd>(
    simd: S,
    plan: &Plan,
    rays: &Rays<S>,
    slopes: [Lanes<S>; 2],
    distance: f32,
) -> [Lanes<S>; 3] {
    let to_world = plan.field.gradients.pixels;
    let scale = if plan.view.perspective {
        Lanes::splat(simd, to_world) / (rays.cosine * distance)
    } else {
        Lanes::splat(simd, to_world)
    };
    let [x, y] = [slopes[0] * scale, slopes[1] * scale];
    let [along_x, along_y, along_z] = rays.direction;
    [x, y, -(x * along_x + y * along_y) / along_z]
}

/// Returns the slopes of the values around the pixels of a packet: central differences, one-sided
/// where a neighbour has no value.
#[inline(always)]
pub fn differences<S: Simd>(simd: S, values: &[[f32; TILE]; TILE], packet: usize) -> [Lanes<S>; 2] {
    let mut slopes = [[0.0f32; 8]; 2];
    for lane in 0..8 {
        let (row, column) = (packet / 2 * 2 + lane / 4, packet % 2 * 4 + lane % 4);
        let center = values[row][column];
        let last = TILE - 1;
        let pairs = [
            [values[row][column.max(1) - 1], values[row][(column + 1).min(last)]],
            [values[row.max(1) - 1][column], values[(row + 1).min(last)][column]],
        ];
        for (slopes, [before, after]) in slopes.iter_mut().zip(pairs) {
            let span = f32::from(u8::from(!before.is_nan()) + u8::from(!after.is_nan()));
            let or_center = |value: f32| if value.is_nan() { center } else { value };
            slopes[lane] = (or_center(after) - or_center(before)) / span.max(1.0);
        }
    }
    let [x, y] = slopes;
    [x.simd_into(simd), y.simd_into(simd)]
}
