//! Builds all levels at once, from the slices of the finest as they arrive. Of each level, memory
//! holds only what its next bricks and the next level need.

use super::{Level, REACH, SIDE, cut::Slices, halve::halve, level::levels};
use crate::{Result, volume::Scalar};

/// Levels that grow from the slices of level 0.
pub struct Pyramid {
    scalar: Scalar,
    growing: Vec<Growing>,
}

/// The part of a level that is in memory.
struct Growing {
    level: Level,
    /// The first slice in memory.
    first: usize,
    samples: Vec<u8>,
    /// Slices that the next level has been computed from.
    halved: usize,
    /// Layers of bricks that have been cut.
    layers: usize,
}

impl Pyramid {
    pub fn new(scalar: Scalar, dims: [usize; 3]) -> Self {
        let growing =
            |level| Growing { level, first: 0, samples: Vec::new(), halved: 0, layers: 0 };
        Self { scalar, growing: levels(dims).into_iter().map(growing).collect() }
    }

    /// Bytes of samples in memory.
    #[cfg(test)]
    pub fn held(&self) -> usize {
        self.growing.iter().map(|growing| growing.samples.capacity()).sum()
    }

    /// Adds the next slices of level 0, as the bytes of their samples. Calls `layer` for each layer
    /// of bricks that can be cut now, with its level, its number, and slices that hold what its
    /// bricks need. The layers of a level come in order.
    pub fn push(
        &mut self,
        slices: &[u8],
        mut layer: impl FnMut(usize, usize, &Slices) -> Result<()>,
    ) -> Result<()> {
        let mut coarse: Vec<u8>;
        let mut next = slices;
        for number in 0..self.growing.len() {
            let is_last = number + 1 == self.growing.len();
            let growing = &mut self.growing[number];
            // Reserve no more capacity than the new slices need.
            growing.samples.reserve_exact(next.len());
            growing.samples.extend_from_slice(next);
            coarse = if is_last { Vec::new() } else { growing.halve(self.scalar) };
            growing.cut(self.scalar, |at, slices| layer(number, at, slices))?;
            growing.forget(self.scalar, is_last);
            if coarse.is_empty() {
                break;
            }
            next = &coarse;
        }
        Ok(())
    }
}

impl Growing {
    fn slice_bytes(&self, scalar: Scalar) -> usize {
        self.level.slice() * scalar.bytes()
    }

    /// Returns the number of slices that have arrived, and whether that is all.
    fn arrived(&self, scalar: Scalar) -> (usize, bool) {
        let count = self.first + self.samples.len() / self.slice_bytes(scalar);
        (count, count == self.level.dims[2])
    }

    /// Returns the slices of the next level that can be computed now.
    fn halve(&mut self, scalar: Scalar) -> Vec<u8> {
        let (arrived, is_whole) = self.arrived(scalar);
        let end = if is_whole { arrived } else { arrived & !1 };
        if end == self.halved {
            return Vec::new();
        }
        let slice = self.slice_bytes(scalar);
        let held = &self.samples[(self.halved - self.first) * slice..(end - self.first) * slice];
        let [nx, ny, _] = self.level.dims;
        let made = halve(scalar, held, [nx, ny, end - self.halved]);
        self.halved = end;
        made
    }

    fn cut(
        &mut self,
        scalar: Scalar,
        mut layer: impl FnMut(usize, &Slices) -> Result<()>,
    ) -> Result<()> {
        let (arrived, is_whole) = self.arrived(scalar);
        let slices = Slices::whole(self.level, scalar, self.first, &self.samples);
        while self.layers < self.level.brick_dims[2]
            && (is_whole || arrived >= (self.layers + 1) * SIDE + REACH)
        {
            layer(self.layers, &slices)?;
            self.layers += 1;
        }
        Ok(())
    }

    /// Drops the slices that neither the next bricks nor the next level need.
    fn forget(&mut self, scalar: Scalar, is_last: bool) {
        let cut = (self.layers * SIDE).saturating_sub(REACH);
        let (arrived, _) = self.arrived(scalar);
        let needed = if is_last { cut } else { cut.min(self.halved) }.min(arrived);
        if needed > self.first {
            let bytes = (needed - self.first) * self.slice_bytes(scalar);
            self.samples.drain(..bytes);
            self.first = needed;
        }
    }
}
