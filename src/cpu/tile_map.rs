//! The optical depths of a tile's sheets, for a map of what the scene absorbs.

use super::{
    close::Packet,
    plan::Plan,
    rays::{HIGH, PACKETS, WIDE},
    vector::Lanes,
};
use crate::plan::TILE;
use fearless_simd::{Simd, prelude::*};

/// The largest optical depth of a sheet.
const MOST_DEPTH: f32 = 16.0;

/// The optical depths of a tile's pixels.
pub struct TileMap<'a> {
    /// The distances of the planes.
    planes: &'a [f32],
    /// For each pixel, row by row, what is added up to each plane since the plane before.
    depths: Vec<f32>,
}

impl<'a> TileMap<'a> {
    pub fn new(planes: &'a [f32]) -> Self {
        Self { planes, depths: vec![0.0; TILE * TILE * planes.len()] }
    }

    /// Returns the numbers of all pixels.
    pub fn into_depths(self) -> Vec<f32> {
        self.depths
    }

    /// Takes a sheet's optical depth from the light of packets. They have all light again for the
    /// next sheet.
    #[inline(always)]
    pub fn take<S: Simd>(
        &mut self,
        simd: S,
        plan: &Plan,
        sheet: usize,
        packets: &mut [Packet<S>; PACKETS],
    ) {
        let [start, stop] = [plan.planes[sheet], plan.planes[sheet + 1]];
        for packet in packets {
            let through: [f32; 8] = packet.pixels.through.into();
            if through == [1.0; 8] {
                continue;
            }
            packet.is_done = false;
            packet.pixels.through = Lanes::splat(simd, 1.0);
            let corner = packet.number / 2 * HIGH * TILE + packet.number % 2 * WIDE;
            for (lane, through) in through.into_iter().enumerate().filter(|(_, left)| *left < 1.0) {
                let depth = (-through.max(f32::MIN_POSITIVE).ln()).min(MOST_DEPTH);
                let pixel = corner + lane / WIDE * TILE + lane % WIDE;
                self.add(pixel, [start, stop], depth);
            }
        }
    }

    /// Adds an optical depth that grows evenly between two distances.
    fn add(&mut self, pixel: usize, [start, stop]: [f32; 2], depth: f32) {
        let count = self.planes.len();
        let depths = &mut self.depths[pixel * count..][..count];
        let first = self.planes.partition_point(|plane| *plane <= start);
        let mut before = 0.0;
        for (sum, plane) in depths.iter_mut().zip(self.planes).skip(first) {
            let share = ((plane - start) / (stop - start)).min(1.0);
            *sum += depth * (share - before);
            before = share;
            if share >= 1.0 {
                break;
            }
        }
    }
}
