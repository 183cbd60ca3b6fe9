//! What sheets may show: the values that a transfer function makes visible, and about how deep.

use super::{
    layer::Layer,
    plan::Plan,
    vector::{Lanes, words},
};
use crate::plan::tables::Values;
use fearless_simd::{Simd, i32x8, prelude::*};

/// Values closer together than this, in entries of the table, are taken as this far apart.
pub const NARROW: f32 = 8.0;
/// Parts of an optical depth of 1, as [`Visible`] counts them, and the largest depth of an entry.
/// The sum over the entries of a table fits 31 bits.
const DEPTH_PARTS: f32 = 1024.0;
const MOST_PARTS_DEPTH: f32 = 64.0;
/// A range of more entries than this may lie mostly at those that show.
const WIDE_RANGE: f32 = 512.0;

/// For each entry of the transfer function's table, the sum of the optical depths of the entries
/// before it, in parts of [`DEPTH_PARTS`], of a ray through the thickest sheet. A visible entry
/// counts at least one part.
pub struct Visible(Vec<u32>);

impl Visible {
    /// Whether any value between two values, in entries of the table, is visible.
    pub fn may_show_between(&self, plan: &Plan, low: f32, high: f32) -> bool {
        let slack = 0.5 * NARROW + 1.0;
        let Values { last, place, .. } = plan.field.values;
        let at = |value: f32| (value + place).clamp(0.0, last) as usize;
        self.0[at(high + slack) + 1] > self.0[at(low - slack)]
    }

    pub fn new(plan: &Plan) -> Self {
        if !plan.has_field {
            return Self(Vec::new());
        }
        let Values { last, place, .. } = plan.field.values;
        let sheets = plan.planes[1..].windows(2).take(plan.sheets);
        let thickest = sheets.map(|ends| ends[1] - ends[0]).fold(0.0, f32::max);
        let parts = |extinction: f32| {
            let depth = (extinction * thickest).min(MOST_PARTS_DEPTH);
            if extinction > 0.0 { (depth * DEPTH_PARTS).ceil().max(1.0) as u32 } else { 0 }
        };
        let colors = &plan.tables.colors[..=last as usize];
        let mut depths: Vec<u32> = colors.iter().map(|entry| parts(entry[3])).collect();
        for surface in &plan.field.isosurfaces[..plan.isosurfaces] {
            let at = (surface.value + place).clamp(0.0, last) as usize;
            let end = (at + 2).min(depths.len());
            depths[at..end].fill(parts(f32::MAX));
        }
        let mut sum = 0;
        let mut before = vec![0];
        before.extend(depths.iter().map(|depth| {
            sum += depth;
            sum
        }));
        Self(before)
    }

    /// Whether any value that a sheet may have is visible.
    #[inline(always)]
    pub fn may_show<S: Simd>(&self, simd: S, plan: &Plan, layer: &Layer<S>) -> bool {
        self.depth(simd, plan, layer).simd_gt(0.0).any_true()
    }

    /// Returns about the optical depth of a sheet: the mean over the values that it may have, and
    /// above the mean if there are many. It is 0 only if none of these values is visible.
    #[inline(always)]
    pub fn depth<S: Simd>(&self, simd: S, plan: &Plan, layer: &Layer<S>) -> Lanes<S> {
        let (a, b, c) = (layer.front.value, layer.middle, layer.back.value);
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        // A parabola exceeds the range of its values at both ends and the middle by at most an
        // eighth of that range. Integrals cover at least NARROW entries.
        let slack = (high - low) * 0.125 + (0.5 * NARROW + 1.0);
        let Values { last, place, .. } = plan.field.values;
        let (none, last) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, last));
        let (low, high) = (low - slack + place, high + slack + place);
        let span = (high - low).min(Lanes::splat(simd, WIDE_RANGE));
        let low: [i32; 8] = i32x8::truncate_from(low.max(none).min(last)).into();
        let high: [i32; 8] = i32x8::truncate_from(high.max(none).min(last)).into();
        let before = words!(simd, L => self.0[low[L] as usize]);
        let behind = words!(simd, L => self.0[high[L] as usize + 1]);
        let parts = Lanes::float_from((behind - before).bitcast::<i32x8<S>>());
        parts * (1.0 / DEPTH_PARTS) / span
    }
}
