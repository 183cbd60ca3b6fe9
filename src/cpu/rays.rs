//! The rays of eight pixels: four columns in two rows.

use super::{
    plan::Plan,
    vector::{Lanes, dot_with, three},
};
use crate::{
    plan::{TILE, frame::Convex},
    scene::Settings,
};
use fearless_simd::{Simd, mask32x8, prelude::*};
use glam::Vec3;

/// Packets of a tile.
pub const PACKETS: usize = TILE * TILE / 8;
/// Width and height of a packet, in pixels.
pub const WIDE: usize = 4;
pub const HIGH: usize = 2;

/// A place in front of or behind all others.
const BEFORE: f32 = -3e38;
const BEHIND: f32 = 3e38;

/// A part of each ray, from one distance to another; empty if the first is the larger.
pub type Part<S> = [Lanes<S>; 2];

/// Eight rays in view space.
pub struct Rays<S: Simd> {
    /// Pixel coordinates of the pixels' centres.
    pub pixel: [Lanes<S>; 2],
    /// Place in the image plane, at distance 1 in perspective.
    pub aside: [Lanes<S>; 2],
    pub direction: [Lanes<S>; 3],
    /// The cosine to the optical axis; 1 in orthographic views.
    pub cosine: Lanes<S>,
    /// In steps of the lattice: the rays' starts, and their directions per world unit.
    pub start: [Lanes<S>; 3],
    pub way: [Lanes<S>; 3],
    /// The part that the clips keep, and its part inside the lattice's box.
    pub kept: Part<S>,
    pub inside: Part<S>,
    /// The part in the region that is drawn.
    region: Part<S>,
    /// The parts that boxes cut out.
    pub holes: [Part<S>; Settings::MAX_CLIPS],
}

impl<S: Simd> Rays<S> {
    /// Returns the rays of the packet whose first pixel is at a place.
    #[inline(always)]
    pub fn new(simd: S, plan: &Plan, [x, y]: [i32; 2]) -> Self {
        let frame = &plan.frame;
        let columns: Lanes<S> = [0.5, 1.5, 2.5, 3.5, 0.5, 1.5, 2.5, 3.5].simd_into(simd);
        let rows: Lanes<S> = [0.5, 0.5, 0.5, 0.5, 1.5, 1.5, 1.5, 1.5].simd_into(simd);
        let pixel = [columns + x as f32, rows + y as f32];
        let right = (columns + (x as f32 - frame.center[0])) * (1.0 / frame.scale);
        let down = (rows + (y as f32 - frame.center[1])) * (1.0 / frame.scale);
        let (none, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
        let (origin, direction) = if plan.view.perspective {
            let cosine = one / (right * right + down * down + 1.0).sqrt();
            ([none; 3], [right * cosine, down * cosine, cosine])
        } else {
            ([right, down, none], [none, none, one])
        };
        let rows: [[f32; 3]; 3] = three!(I => frame.to_world.row(I).to_array());
        let (from, toward) =
            (three!(I => dot_with(rows[I], origin)), three!(I => dot_with(rows[I], direction)));
        let mut kept = [Lanes::splat(simd, BEFORE), Lanes::splat(simd, BEHIND)];
        for convex in &frame.clips {
            let part = match convex {
                Convex::Box(corners) => part_in_box(simd, corners_of(corners), from, toward),
                Convex::HalfSpace { normal, offset } => {
                    part_in_half_space(simd, normal.to_array(), *offset, from, toward)
                }
            };
            kept = [kept[0].max(part[0]), kept[1].min(part[1])];
        }
        let mut holes = [[none; 2]; Settings::MAX_CLIPS];
        for (part, corners) in holes.iter_mut().zip(&frame.holes) {
            *part = part_in_box(simd, corners_of(corners), from, toward);
        }
        let region = match &plan.region {
            Some(corners) => part_in_box(simd, corners_of(corners), from, toward),
            None => [Lanes::splat(simd, BEFORE), Lanes::splat(simd, BEHIND)],
        };
        let field = &plan.field;
        let start = three!(I => dot_with(field.axes[I], origin) + field.origin[I]);
        let way = three!(I => dot_with(field.axes[I], direction));
        let mut inside = kept;
        if plan.has_field && plan.on_lattice {
            let part = part_in_box(simd, [field.low, field.high], start, way);
            inside = [kept[0].max(part[0]), kept[1].min(part[1])];
        }
        Self {
            pixel,
            aside: [right, down],
            direction,
            cosine: direction[2],
            start,
            way,
            kept,
            inside,
            region,
            holes,
        }
    }

    /// Returns the part of each ray in the box of the samples, widened by `wider` steps.
    #[inline(always)]
    pub fn in_lattice(&self, simd: S, plan: &Plan, wider: f32) -> Part<S> {
        let (low, high) =
            (plan.field.low.map(|low| low - wider), plan.field.high.map(|high| high + wider));
        part_in_box(simd, [low, high], self.start, self.way)
    }

    /// Returns the rays on which a sheet between two planes belongs to the region that is drawn:
    /// its middle does. So each sheet belongs to one region of several that fill space.
    #[inline(always)]
    pub fn in_region(&self, [start, stop]: [f32; 2]) -> mask32x8<S> {
        let middle = 0.5 * (start + stop);
        self.region[0].simd_le(middle) & self.region[1].simd_gt(middle)
    }

    /// Returns the places at distances, in steps of the lattice.
    #[inline(always)]
    pub fn places(&self, distances: Lanes<S>) -> [Lanes<S>; 3] {
        three!(I => self.way[I].mul_add(distances, self.start[I]))
    }

    /// Returns the place at a distance, in steps of the lattice.
    #[inline(always)]
    pub fn place(&self, distance: f32) -> [Lanes<S>; 3] {
        three!(I => self.way[I] * distance + self.start[I])
    }
}

fn corners_of(corners: &[Vec3; 2]) -> [[f32; 3]; 2] {
    corners.map(|corner| corner.to_array())
}

/// Returns the distances between which rays are inside a box with these corners.
#[inline(always)]
fn part_in_box<S: Simd>(
    simd: S,
    [low, high]: [[f32; 3]; 2],
    origin: [Lanes<S>; 3],
    direction: [Lanes<S>; 3],
) -> Part<S> {
    let (mut enter, mut leave) = (Lanes::splat(simd, BEFORE), Lanes::splat(simd, BEHIND));
    for axis in 0..3 {
        // A ray along a face would divide 0 by 0.
        let along = direction[axis];
        let safe = along.abs().simd_lt(1e-20).select(Lanes::splat(simd, 1e-20), along);
        let a = (low[axis] - origin[axis]) / safe;
        let b = (high[axis] - origin[axis]) / safe;
        (enter, leave) = (enter.max(a.min(b)), leave.min(a.max(b)));
    }
    [enter, leave]
}

/// Returns the distances between which rays have normal·x ≤ offset.
#[inline(always)]
fn part_in_half_space<S: Simd>(
    simd: S,
    normal: [f32; 3],
    offset: f32,
    origin: [Lanes<S>; 3],
    direction: [Lanes<S>; 3],
) -> Part<S> {
    let slope = dot_with(normal, direction);
    let safe = slope.abs().simd_lt(1e-20).select(Lanes::splat(simd, 1e-20), slope);
    let (before, behind) = (Lanes::splat(simd, BEFORE), Lanes::splat(simd, BEHIND));
    let at = ((offset - dot_with(normal, origin)) / safe).max(before).min(behind);
    let is_outward = safe.simd_gt(0.0);
    [is_outward.select(before, at), is_outward.select(at, behind)]
}
