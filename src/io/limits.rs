//! What a reader may spend on one input. Allocation follows the bytes present, not the counts claimed.

/// Bounds for every reader. The defaults take the largest scans and volumes that a workstation handles and stop
/// what a hostile or broken file claims beyond that.
#[derive(Debug, Clone)]
pub struct Limits {
    /// Vertices, points or faces of one file.
    pub points: u64,
    /// Bytes that one file may occupy once read and unpacked.
    pub bytes: u64,
    /// Nesting of scene nodes and of files that refer to files.
    pub depth: usize,
    /// Pixels of one texture.
    pub texels: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { points: 1 << 31, bytes: 16 << 30, depth: 64, texels: 1 << 28 }
    }
}
