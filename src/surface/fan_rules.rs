//! The rules by which the triangles around a vertex become surfels, shared by the scalar and the
//! vector code.

/// A surfel is perpendicular to its shading normal if that is at most this far from its triangles'
/// mean normal (cosine of 20°).
pub const ALIKE: f32 = 0.94;

/// A triangle is steep if its normal's dot product with the surfel's is less than this.
pub const STEEP: f32 = 0.95;

/// Covariance of a surfel, as a multiple of that of the triangles around its vertex. On a mesh of
/// equilateral triangles of side 1 the standard deviation is 0.35. The surfels' sum is then nowhere
/// below 0.767 times the strength of one.
pub const SPREAD: f32 = 0.35 * 0.35 * 24.0 / 5.0;

/// Largest squared distances, in standard deviations, of a surfel from three kinds of points. These
/// are the midpoints of the edges at its vertex, the centroids of the triangles, and the vertex
/// itself. Two surfels at the midpoint of an edge, and three at a centroid, then have 0.31 and 0.29
/// of the strength of one. Narrower surfels leave holes, wider ones reach over silhouettes.
pub const MIDDLE: f32 = 3.8;

pub const CENTROID: f32 = 4.7;

pub const CORNER: f32 = 5.0;

/// The thickness of a surfel, as a multiple of its smaller standard deviation.
pub const THICKNESS: f32 = 0.12;

/// The square of twice an area, in units, below which products of moments underflow in 32 bits:
/// edges of less than a millionth.
pub const LEAST_SQUARE: f32 = 1e-26;

/// A triangle is a line at the precision of 32 bits if its height is less than the root of this,
/// times its longest edge.
pub const LEAST_RATIO_SQUARED: f32 = 1e-12;

/// Height of a surfel above its vertex, as a fraction of the mean height of the triangles around
/// the vertex.
pub const SAG: f32 = 0.4;

/// Mixes the bits of a number, so that exclusive-or sums of different numbers do not cancel by
/// chance.
#[inline]
pub fn mixed(place: u32) -> u64 {
    let product = (u64::from(place) + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    product ^ (product >> 29)
}
