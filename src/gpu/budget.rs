//! How much a pass of the GPU engine may hold.

use crate::gpu::device::Gpu;

/// How much room a pass has. A frame that needs more is drawn in several passes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budget {
    /// (splat, tile, window) triples of a pass: 4 bytes each.
    pub entries: u32,
    /// Record words of a pass: an isotropic lattice sample takes one, any other splat four; 28 bytes each.
    pub record_words: u32,
    /// Entries that a pass takes at least, where it might end earlier to see what is hidden behind it. `None`: as many as
    /// another pass is worth.
    pub least_share: Option<u32>,
    /// Entries of a tile that one dispatch of march adds up; a tile with more goes on in another. `None`: as many as the
    /// adapter's driver bears.
    pub tile_entries: Option<u32>,
}

impl Default for Budget {
    fn default() -> Self {
        Self { entries: 1 << 24, record_words: 1 << 22, least_share: None, tile_entries: None }
    }
}

impl Budget {
    /// Records are numbered with 22 bits in an entry.
    const MOST_WORDS: u32 = 1 << 22;

    /// The budget within what a binding of this device holds.
    pub(crate) fn within(self, gpu: &Gpu) -> Self {
        let room = u32::try_from(gpu.binding_size() / 16).unwrap_or(u32::MAX);
        Self {
            entries: self.entries.clamp(1, room.saturating_mul(4)),
            record_words: self.record_words.clamp(4, room.min(Self::MOST_WORDS)),
            ..self
        }
    }
}
