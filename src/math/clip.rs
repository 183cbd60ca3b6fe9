//! Half-spaces and boxes that cut a scene.

use super::Bounds;
use glam::DVec3;

/// A shape that cuts the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clip {
    /// The shape that bounds the part.
    pub shape: ClipShape,
    /// Whether to keep what is inside the shape (`true`) or outside it (`false`).
    pub inside: bool,
}

/// The shape of a [`Clip`], in world coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ClipShape {
    /// The points x with normal·x ≤ offset are inside.
    HalfSpace {
        /// The direction out of the half-space, in world coordinates; it need not have unit length.
        normal: DVec3,
        /// The distance of its face from the world's origin, times the length of `normal`.
        offset: f64,
    },
    /// A box along the world's axes.
    Box(Bounds),
}

impl Clip {
    /// Returns whether the clip keeps a point.
    pub fn keeps(&self, point: DVec3) -> bool {
        let inside = match self.shape {
            ClipShape::HalfSpace { normal, offset } => normal.dot(point) <= offset,
            ClipShape::Box(bounds) => bounds.contains(point),
        };
        inside == self.inside
    }
}
