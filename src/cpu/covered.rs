//! What facets and rods add to the open sheets of a tile.

use super::{
    close::Packet,
    plan::Plan,
    scatter::{OpenTile, Window},
    sums::{Sums, WINDOW},
    vector::{Lanes, each, exp, three},
};
use crate::facet::NEARER;
use fearless_simd::{Simd, mask32x8, prelude::*};

/// A facet further behind the front of its sheet than this, over the length by which nearness is
/// measured, counts as this far.
const FARTHEST: f32 = 60.0;
/// Smaller shares of a pixel are not added.
pub const LEAST_SHARE: f32 = 1e-6;

/// The side of a facet that is seen.
#[derive(Clone, Copy)]
pub enum Side {
    Front,
    Back,
    /// The facet is a rod.
    Rod,
}

/// What a facet covers of eight pixels.
pub struct Covered<S: Simd> {
    pub share: Lanes<S>,
    /// The part of the share that is seen, if the facet shows an image.
    pub seen: Lanes<S>,
    pub distance: Lanes<S>,
    /// Lit.
    pub color: [Lanes<S>; 3],
    /// Pixels of which the facet covers a part.
    pub covers: mask32x8<S>,
    pub side: Side,
}

/// A facet or a rod on its way to the pixels of a tile.
pub trait Covering<S: Simd> {
    /// Returns what it covers of a packet, if it covers any part. Pixels where it lies outside the
    /// window may be left out.
    fn covered(
        &self,
        simd: S,
        plan: &Plan,
        window: Window,
        packet: &Packet<S>,
    ) -> Option<Covered<S>>;
}

impl<S: Simd> OpenTile<'_, S> {
    /// Adds the window of a facet or a rod to the packets that it meets, given as bits.
    #[inline(always)]
    pub fn add_covering(
        &mut self,
        simd: S,
        plan: &Plan,
        drawn: &impl Covering<S>,
        window: Window,
        mut packets: u8,
    ) {
        while packets != 0 {
            let packet = &self.packets[packets.trailing_zeros() as usize];
            packets &= packets - 1;
            if packet.is_done && !plan.central {
                continue;
            }
            if let Some(covered) = drawn.covered(simd, plan, window, packet) {
                Self::add_covered(simd, plan, &covered, window, packet, &mut self.sums);
            }
        }
    }

    /// Adds what a facet or rod covers in a window of sheets.
    #[inline(always)]
    fn add_covered(
        simd: S,
        plan: &Plan,
        covered: &Covered<S>,
        window: Window,
        packet: &Packet<S>,
        sums: &mut Sums<S>,
    ) {
        let Covered { share, seen, distance, color, covers, side } = *covered;
        let none = Lanes::splat(simd, 0.0);
        for offset in usize::from(window.is_continued)..WINDOW {
            let [front, back] = each!([0, 1], NEXT => plan.planes[window.front + offset + NEXT]);
            let mut inside: mask32x8<S> = distance.simd_lt(back) & covers;
            if offset > 0 {
                inside &= distance.simd_ge(front);
            }
            if !inside.any_true() {
                continue;
            }
            let (share, seen) = (inside.select(share, none), inside.select(seen, none));
            let pixel = if plan.view.perspective { front.max(1e-30) } else { 1.0 };
            let per_pixel = NEARER as f32 * plan.frame.scale / pixel;
            let behind =
                ((distance - front) * per_pixel).max(none).min(Lanes::splat(simd, FARTHEST));
            let weight = seen * exp(simd, none - behind);
            let slot = (window.front + offset) % WINDOW;
            sums.has_facets[slot] |= packet.bit();
            let sums = &mut sums.facets[slot][packet.number];
            match side {
                Side::Front => sums.shares[0] += share,
                Side::Back => sums.shares[1] += share,
                // Where rods meet, they fill the same part of a pixel.
                Side::Rod => sums.shares[1] = sums.shares[1].max(share),
            }
            sums.seen += seen;
            sums.weight += weight;
            sums.distance = weight.mul_add(distance, sums.distance);
            sums.color = three!(I => seen.mul_add(color[I], sums.color[I]));
            sums.nearest = three!(I => weight.mul_add(color[I], sums.nearest[I]));
        }
    }
}
