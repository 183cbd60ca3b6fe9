//! A point as a reader in pieces finds it.

use glam::{DVec3, Vec3};

/// A point in the file's own coordinates.
pub(crate) struct RawPoint {
    pub row: usize,
    pub position: DVec3,
    pub normal: Vec3,
    pub color: [u8; 4],
}
