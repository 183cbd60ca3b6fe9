//! Reads the points and triangles of a file in pieces, as often as needed, for callers that cannot
//! hold all of them.

use super::{
    FORMATS,
    form::{Counts, Form, StreamPoint, in_order},
    format::{InPieces, by_extension},
};
use crate::{
    Result,
    input::{Limits, Source, positions},
};
use bytemuck::Zeroable;
use glam::{DVec3, Vec3};
use std::path::Path;

/// A point cloud or mesh file that is read in pieces: binary PLY of points or triangles, LAS and
/// LAZ.
///
/// It yields the same data as [`load_mesh`](super::load_mesh): around the same origin, in the same
/// colours, in the same order. It regularly returns the pages of the file that were read to the
/// system.
pub struct Stream<'a> {
    source: Source<'a>,
    form: Box<dyn Form>,
    /// Number of points that are not withheld.
    points: u64,
    origin: DVec3,
    bounds: [Vec3; 2],
}

impl<'a> Stream<'a> {
    /// Opens a file and reads its header only. Returns `None` for a file that can only be read as a
    /// whole.
    ///
    /// # Errors
    /// Those of opening the file; [`Error::Input`](crate::Error::Input) for a malformed header and
    /// for a file that ends before its last point; [`Error::Limit`](crate::Error::Limit) for more
    /// points than the limits allow.
    pub fn open(path: &'a (impl AsRef<Path> + ?Sized), limits: &'a Limits) -> Result<Option<Self>> {
        Self::of(Source::open(path.as_ref(), limits)?)
    }

    /// As [`open`](Self::open), but takes an open source, which may be in memory
    /// ([`Source::from_bytes`]).
    ///
    /// # Errors
    /// Those of [`open`](Self::open), except those of opening the file.
    pub fn of(source: Source<'a>) -> Result<Option<Self>> {
        let format = by_extension(FORMATS, source.path, |_| true);
        let form = match format.map(|format| format.pieces) {
            Some(InPieces::Points { find, .. }) => source.unless_changed(find(&source))?,
            _ => source.unless_changed(Ok(None))?,
        };
        let (origin, bounds) = (DVec3::ZERO, [Vec3::ZERO; 2]);
        Ok(form.map(|form| Self { source, form, points: 0, origin, bounds }))
    }

    /// Returns the counts in the header.
    pub fn counts(&self) -> Counts {
        self.form.counts()
    }

    /// Warns if the file contains more than the points, because only those are read.
    pub(crate) fn warn(&self) {
        self.form.warn(&self.source);
    }

    /// Returns whether the third axis of its points is up, as for
    /// [`Mesh::z_is_up`](crate::surface::Mesh::z_is_up).
    pub fn z_is_up(&self) -> bool {
        self.form.z_is_up()
    }

    /// The first pass over all points: finds their bounds and what their colours are scaled by.
    /// Calls `watch` with the number of points visited so far.
    pub(crate) fn settle(&mut self, watch: &dyn Fn(u64)) -> Result<()> {
        let counted = self.counts().points;
        if counted > u64::from(u32::MAX) {
            let message = format!(
                "counts {counted} points, but a file read in pieces may have at most {}",
                u32::MAX
            );
            return Err(self
                .source
                .error("header", message)
                .hint("split it into several files and convert them together"));
        }
        let surveyed = self.form.survey(&self.source, watch);
        let (points, [low, high]) = self.source.unless_changed(surveyed)?;
        self.points = points;
        self.origin = positions::origin(&self.source, low, high)?;
        self.bounds = [(low - self.origin).as_vec3(), (high - self.origin).as_vec3()];
        Ok(())
    }

    /// Creates an error at a place in the file.
    pub(crate) fn error(&self, place: &str, message: impl Into<String>) -> crate::Error {
        self.source.error(place, message)
    }

    /// Returns the world position that the points are relative to.
    pub(crate) fn origin(&self) -> DVec3 {
        self.origin
    }

    /// Returns the corners of the bounding box of all points.
    pub(crate) fn bounds(&self) -> [Vec3; 2] {
        self.bounds
    }

    /// Returns the number of points that are not withheld.
    pub(crate) fn point_count(&self) -> u64 {
        self.points
    }

    pub(crate) fn has_normals(&self) -> bool {
        self.form.has_normals()
    }

    pub(crate) fn has_colors(&self) -> bool {
        self.form.has_colors()
    }

    pub(crate) fn has_uvs(&self) -> bool {
        self.form.has_uvs()
    }

    /// Visits all points in order. `map` converts the pieces, several in parallel. `take` receives
    /// the results one after the other, in order.
    pub(crate) fn points<T: Send>(
        &self,
        map: impl Fn(&[StreamPoint]) -> T + Sync,
        take: impl FnMut(T) -> Result<()>,
    ) -> Result<()> {
        let of_piece =
            |piece: usize| Ok(map(&self.form.points(&self.source, piece, self.origin)?));
        in_order(&self.source, self.form.pieces()[0], of_piece, take)
    }

    /// As [`points`](Self::points), for the triangles. `map` also gets the index of the piece's
    /// first triangle.
    pub(crate) fn triangles<T: Send>(
        &self,
        map: impl Fn(usize, &[[u32; 3]]) -> T + Sync,
        take: impl FnMut(T) -> Result<()>,
    ) -> Result<()> {
        let of_piece = |piece: usize| {
            let (first, triangles) = self.form.triangles(&self.source, piece)?;
            Ok(map(first, &triangles))
        };
        in_order(&self.source, self.form.pieces()[1], of_piece, take)
    }

    /// Returns the position of a vertex of a mesh.
    pub(crate) fn position(&self, index: u32) -> Vec3 {
        let position = self.form.position(&self.source, index as usize);
        position.map_or(Vec3::ZERO, |position| (position - self.origin).as_vec3())
    }

    /// Returns a vertex of a mesh.
    pub(crate) fn vertex(&self, index: u32) -> StreamPoint {
        let found = self.form.vertex(&self.source, index as usize);
        found.map_or_else(StreamPoint::zeroed, |found| StreamPoint::new(&found, self.origin))
    }
}
