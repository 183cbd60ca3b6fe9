//! What a format offers if the points of its files are read in pieces.

use super::shared::raw_point::RawPoint;
use crate::{
    Result,
    about::{About, Orientation},
    input::Source,
    parallel::{self, prelude::*},
};
use bytemuck::{Pod, Zeroable};
use glam::DVec3;
use std::ops::Range;

/// The counts in a file's header.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Counts {
    /// The number of points, or of vertices of a mesh.
    pub points: u64,
    /// The number of triangles; 0 for a point cloud.
    pub triangles: u64,
}

/// A point relative to the stream's origin.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct StreamPoint {
    /// Its index in the file.
    pub index: u32,
    pub position: [f32; 3],
    /// Unit length; zero if the file has none.
    pub normal: [f32; 3],
    /// As in [`Mesh::colors`](crate::surface::Mesh::colors); white if the file has none. If an
    /// attribute colours the points, the bytes of its value.
    pub color: [u8; 4],
}

impl StreamPoint {
    /// Returns the value that takes the place of the colour.
    pub fn value(&self) -> f32 {
        f32::from_le_bytes(self.color)
    }

    pub fn new(point: &RawPoint, origin: DVec3) -> Self {
        Self {
            index: point.row as u32,
            position: (point.position - origin).as_vec3().to_array(),
            normal: point.normal.to_array(),
            color: point.color,
        }
    }
}

/// Numbers by which a form scales colours; each form has its own.
pub(super) type Coloring = [Option<f64>; 4];

/// Where the points of a file are, and its triangles if it is a mesh.
pub(super) trait Form: Send + Sync {
    fn counts(&self) -> Counts;

    /// Returns the number of pieces of points, and of triangles.
    fn pieces(&self) -> [usize; 2];

    /// Returns where the bytes of a piece of points are. Only forms that read objects in parts say
    /// so.
    fn bytes(&self, _: usize) -> Range<usize> {
        0..0
    }

    /// Returns how the points stand, if the file or the format's convention says so.
    fn orientation(&self) -> Option<Orientation>;

    fn has_normals(&self) -> bool;

    fn has_colors(&self) -> bool;

    fn has_uvs(&self) -> bool;

    /// Warns if the file contains more than the points, because only those are read.
    fn warn(&self, source: &Source);

    /// Chooses the attribute of a name. From then on, the colours of points are the four bytes of
    /// its value, a 32-bit float, the lowest first. Returns its name and unit.
    fn choose(&mut self, source: &Source, name: &str) -> Result<About>;

    /// The first pass over all points: returns their number, without withheld ones, and the corners
    /// of their bounding box, and finds what their colours are scaled by. Calls `watch` with the
    /// number of points visited so far.
    fn survey(&mut self, source: &Source, watch: &dyn Fn(u64)) -> Result<(u64, [DVec3; 2])>;

    /// Returns the numbers by which colours are scaled, as [`survey`](Self::survey) found them.
    fn coloring(&self) -> Coloring;

    /// Takes what a survey of the same file found: the numbers by which colours are scaled, and the
    /// number of points.
    fn resume(&mut self, coloring: Coloring, points: u64);

    /// Returns the points of a piece, relative to an origin.
    fn points(&self, source: &Source, piece: usize, origin: DVec3) -> Result<Vec<StreamPoint>>;

    /// Returns the index of a piece's first triangle, and the piece's triangles.
    fn triangles(&self, source: &Source, piece: usize) -> Result<(usize, Vec<[u32; 3]>)>;

    /// Returns a vertex of a mesh; `None` for a point cloud.
    fn vertex(&self, source: &Source, index: usize) -> Option<RawPoint>;

    /// Returns the position of a vertex of a mesh; `None` for a point cloud.
    fn position(&self, source: &Source, index: usize) -> Option<DVec3>;
}

/// Makes something of each of these pieces, several in parallel. `take` receives the results one
/// after the other, in order. The pages of the file that were read are returned to the system.
pub(super) fn in_order<T: Send>(
    source: &Source,
    pieces: impl IntoIterator<Item = usize>,
    bytes: impl Fn(usize) -> Range<usize>,
    make: impl Fn(usize) -> Result<T> + Sync,
    mut take: impl FnMut(T) -> Result<()>,
) -> Result<()> {
    in_batches(source, pieces, bytes, |pieces| {
        source.restart_time();
        let made: Vec<Result<T>> = pieces.par_iter().map(|&piece| make(piece)).collect();
        // If the file has changed, the results may mix old and new content, so none is taken.
        source.intact()?;
        for made in made {
            take(made?)?;
        }
        source.release();
        Ok(())
    })?;
    // `take` may have read single points from the file.
    source.intact()
}

/// Bytes of pieces of a remote object that are fetched together.
const AHEAD: usize = 32 << 20;

/// Calls `read` with a few pieces at a time, as many as are worth reading in parallel. `bytes` says
/// where their bytes are: those of a remote object are fetched ahead.
pub(super) fn in_batches(
    source: &Source,
    pieces: impl IntoIterator<Item = usize>,
    bytes: impl Fn(usize) -> Range<usize>,
    mut read: impl FnMut(&[usize]) -> Result<()>,
) -> Result<()> {
    let batch = 2 * parallel::current_num_threads();
    let pieces: Vec<usize> = pieces.into_iter().collect();
    let (mut next, mut fetched) = (0, 0);
    while next < pieces.len() {
        let end = pieces.len().min(next + batch);
        if fetched < end {
            let mut sum = 0;
            let more = pieces[end..].iter().take_while(|piece| {
                sum += bytes(**piece).len();
                sum < AHEAD
            });
            fetched = end + more.count();
            source.fetch(pieces[next..fetched].iter().map(|piece| bytes(*piece)))?;
        }
        read(&pieces[next..end])?;
        next = end;
    }
    Ok(())
}
