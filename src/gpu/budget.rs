//! The capacity of a depth pass of the GPU engine.

use crate::gpu::device::Gpu;

/// Words of a general record.
pub const RECORD_WORDS: u32 = 4;

/// Maximum number of elements of one prefix sum.
pub const SCAN_CAPACITY: u32 = 1 << 24;

/// The capacity of a depth pass. A frame that needs more is drawn in several passes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budget {
    /// (splat, tile, window) triples of a pass, of 4 bytes each.
    pub entries: u32,
    /// Record words of a pass, of 16 bytes each, with 16 bytes more for each record. An isotropic
    /// lattice sample takes one word, any other splat four. A pass has no more than the scene's
    /// splats could take, and no more records than an entry can number (4 million).
    pub record_words: u32,
    /// Minimum number of entries in a pass that could end earlier to find out which splats it
    /// hides. `None`: as many as make another pass worthwhile.
    pub least_share: Option<u32>,
    /// Entries of a tile that one dispatch of march adds up. A tile with more continues in another
    /// dispatch. `None`: as many as the adapter's driver allows.
    pub tile_entries: Option<u32>,
    /// Whether the 64 invocations of a tile load and sort its entries together, in the memory of
    /// their workgroup, and evaluate a gathered field without asking first what its samples show.
    /// That is faster on a GPU and slower on a processor; the picture is the same. `None`: on a
    /// GPU.
    pub staged: Option<bool>,
}

impl Default for Budget {
    fn default() -> Self {
        Self {
            entries: 1 << 24,
            record_words: 1 << 24,
            least_share: None,
            tile_entries: None,
            staged: None,
        }
    }
}

impl Budget {
    /// An entry has 22 bits for the number of a record.
    const MOST_RECORDS: u32 = 1 << 22;

    /// Returns the budget, limited to what a binding of this device can hold, and to what this
    /// number of splats can take, whose records begin at multiples of `unit` words.
    pub(crate) fn within(self, gpu: &Gpu, splats: u32, unit: u32) -> Self {
        let room = u32::try_from(gpu.binding_size() / 16).unwrap_or(u32::MAX);
        let most = splats.saturating_mul(RECORD_WORDS).min(Self::MOST_RECORDS * unit).min(room);
        Self {
            entries: self.entries.clamp(1, room.saturating_mul(4)),
            record_words: self.record_words.clamp(4, most.max(4)),
            ..self
        }
    }
}
