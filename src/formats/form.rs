//! What a format offers if the points of its files are read in pieces.

use super::shared::raw_point::RawPoint;
use crate::{
    Result,
    about::{About, Orientation},
    input::Source,
    parallel::{self, prelude::*},
};
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};
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

/// The type of a number in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say the bits")]
pub enum NumberType {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F32,
    F64,
}

impl NumberType {
    /// Returns the least and the greatest whole number of the type; `None` for floats.
    pub fn whole(self) -> Option<[f64; 2]> {
        match self {
            Self::U8 => Some([0.0, f64::from(u8::MAX)]),
            Self::I8 => Some([f64::from(i8::MIN), f64::from(i8::MAX)]),
            Self::U16 => Some([0.0, f64::from(u16::MAX)]),
            Self::I16 => Some([f64::from(i16::MIN), f64::from(i16::MAX)]),
            Self::U32 => Some([0.0, f64::from(u32::MAX)]),
            Self::I32 => Some([f64::from(i32::MIN), f64::from(i32::MAX)]),
            Self::U64 => Some([0.0, u64::MAX as f64]),
            Self::I64 => Some([i64::MIN as f64, i64::MAX as f64]),
            Self::F32 | Self::F64 => None,
        }
    }
}

/// An attribute of points: a number that each has beside its position, normal and colour.
#[derive(Debug, Clone, PartialEq)]
pub struct Attribute {
    /// Its name in the file.
    pub name: String,
    /// The type of its numbers.
    pub kind: NumberType,
}

/// Points with their attributes, list by list. Lists of normals and colours may be empty, all
/// others are as long as the positions.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Records {
    /// Positions in the world.
    pub positions: Vec<DVec3>,
    /// Unit normals; zero where a point has none.
    pub normals: Vec<Vec3>,
    /// Red, green, blue and opacity.
    pub colors: Vec<[u8; 4]>,
    /// The attributes.
    pub attributes: Vec<Attribute>,
    /// The values of each attribute; NaN where a point has none.
    pub columns: Vec<Vec<f64>>,
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

    /// Returns the coordinate reference system; empty if the file does not say.
    fn crs(&self, _: &Source) -> String {
        String::new()
    }

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

    /// Returns the attributes of the points.
    fn attributes(&self, source: &Source) -> Result<Vec<Attribute>>;

    /// Returns the points of a piece in the world, with the attributes of these names.
    fn records(&self, source: &Source, piece: usize, names: &[String]) -> Result<Records>;

    /// Returns the steps and the offset of the positions, if the file stores whole numbers.
    fn grid(&self) -> Option<[DVec3; 2]> {
        None
    }

    /// Returns whether 32-bit floats do not hold the positions.
    fn is_wide(&self) -> bool {
        self.grid().is_some()
    }

    /// Returns whether the colours are greys that stand for another attribute.
    fn are_greys(&self) -> bool {
        false
    }

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
