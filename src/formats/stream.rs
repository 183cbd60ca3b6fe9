//! Reads the points and triangles of a file in pieces, as often as needed, for callers that cannot
//! hold all of them.

use super::{
    FORMATS,
    form::Form,
    format::{InPieces, by_extension},
    ply,
    shared::found::Found,
};
use crate::{
    Result,
    input::{Limits, Source, positions},
    parallel::{self, prelude::*},
};
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};
use std::path::Path;

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
    /// As in [`Mesh::colors`](crate::surface::Mesh::colors); white if the file has none.
    pub color: [u8; 4],
}

/// A point cloud or mesh file that is read in pieces: binary PLY of points or triangles, LAS and
/// LAZ.
///
/// It yields the same data as [`load_mesh`](super::load_mesh): around the same origin, in the same
/// colours, in the same order. It regularly returns the pages of the file that were read to the
/// system.
pub struct Stream<'a> {
    source: Source<'a>,
    form: Form,
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
        let (points, triangles) = match &self.form {
            Form::Ply(pieces) => (pieces.points(), pieces.triangles()),
            Form::Las(pieces) => (pieces.points(), 0),
        };
        Counts { points: points as u64, triangles: triangles as u64 }
    }

    /// Warns if the file contains more than the points, because only those are read.
    pub(crate) fn warn(&self) {
        if let Form::Ply(pieces) = &self.form
            && pieces.are_gaussians
        {
            ply::warn_of_gaussians(&self.source);
        }
    }

    /// Returns whether the third axis of its points is up, as for
    /// [`Mesh::z_is_up`](crate::surface::Mesh::z_is_up).
    pub fn z_is_up(&self) -> bool {
        matches!(self.form, Form::Las(_))
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
        let (points, [low, high]) = match &mut self.form {
            Form::Las(pieces) => self.source.unless_changed(pieces.survey(&self.source, watch))?,
            Form::Ply(_) => self.survey_ply(watch)?,
        };
        self.points = points;
        self.origin = positions::origin(&self.source, low, high)?;
        self.bounds = [(low - self.origin).as_vec3(), (high - self.origin).as_vec3()];
        Ok(())
    }

    fn survey_ply(&mut self, watch: &dyn Fn(u64)) -> Result<(u64, [DVec3; 2])> {
        let Form::Ply(pieces) = &self.form else { return Ok((0, [DVec3::ZERO; 2])) };
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let mut brightest = [0.0; 4];
        let asks_for_colors = pieces.asks_for_colors();
        let of_piece = |piece: usize| {
            let mut around = (DVec3::INFINITY, DVec3::NEG_INFINITY);
            let mut brightest = [0.0; 4];
            for row in pieces.rows(piece) {
                let position = pieces.position(&self.source, row);
                if !position.is_finite() {
                    return Err(pieces.not_finite(&self.source, row));
                }
                around = (around.0.min(position), around.1.max(position));
                if asks_for_colors {
                    brightest = ply::larger(brightest, pieces.channels(&self.source, row));
                }
            }
            Ok((around, brightest, pieces.rows(piece).end as u64))
        };
        self.in_order(pieces.pieces()[0], of_piece, |(around, of_piece, seen)| {
            (low, high) = (low.min(around.0), high.max(around.1));
            brightest = ply::larger(brightest, of_piece);
            watch(seen);
            Ok(())
        })?;
        let points = pieces.points() as u64;
        if let Form::Ply(pieces) = &mut self.form {
            pieces.settle_colors(brightest);
        }
        Ok((points, [low, high]))
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
        matches!(&self.form, Form::Ply(pieces) if pieces.has_normals)
    }

    pub(crate) fn has_colors(&self) -> bool {
        match &self.form {
            Form::Ply(pieces) => pieces.has_colors,
            Form::Las(pieces) => pieces.has_colors(),
        }
    }

    pub(crate) fn has_uvs(&self) -> bool {
        matches!(&self.form, Form::Ply(pieces) if pieces.has_uvs)
    }

    /// Visits all points in order. `map` converts the pieces, several in parallel. `take` receives
    /// the results one after the other, in order.
    pub(crate) fn points<T: Send>(
        &self,
        map: impl Fn(&[StreamPoint]) -> T + Sync,
        take: impl FnMut(T) -> Result<()>,
    ) -> Result<()> {
        let settled = |found: Found| self.settled(found);
        match &self.form {
            Form::Ply(pieces) => {
                let of_piece = |piece: usize| {
                    let rows = pieces.rows(piece);
                    let points: Vec<_> =
                        rows.map(|row| settled(pieces.vertex(&self.source, row))).collect();
                    Ok(map(&points))
                };
                self.in_order(pieces.pieces()[0], of_piece, take)
            }
            Form::Las(pieces) => {
                let of_piece = |piece: usize| {
                    let points: Vec<_> =
                        pieces.found(&self.source, piece)?.into_iter().map(settled).collect();
                    Ok(map(&points))
                };
                self.in_order(pieces.pieces(), of_piece, take)
            }
        }
    }

    /// As [`points`](Self::points), for the triangles. `map` also gets the index of the piece's
    /// first triangle.
    pub(crate) fn triangles<T: Send>(
        &self,
        map: impl Fn(usize, &[[u32; 3]]) -> T + Sync,
        take: impl FnMut(T) -> Result<()>,
    ) -> Result<()> {
        let Form::Ply(pieces) = &self.form else { return Ok(()) };
        let of_piece = |piece: usize| {
            let (first, triangles) = pieces.triangle_piece(&self.source, piece)?;
            Ok(map(first, &triangles))
        };
        self.in_order(pieces.pieces()[1], of_piece, take)
    }

    /// Returns the position of a vertex of a mesh.
    pub(crate) fn position(&self, index: u32) -> Vec3 {
        match &self.form {
            Form::Ply(pieces) => {
                (pieces.position(&self.source, index as usize) - self.origin).as_vec3()
            }
            Form::Las(_) => Vec3::ZERO,
        }
    }

    /// Returns a vertex of a mesh.
    pub(crate) fn vertex(&self, index: u32) -> StreamPoint {
        match &self.form {
            Form::Ply(pieces) => self.settled(pieces.vertex(&self.source, index as usize)),
            Form::Las(_) => StreamPoint::zeroed(),
        }
    }

    fn settled(&self, found: Found) -> StreamPoint {
        StreamPoint {
            index: found.row as u32,
            position: (found.position - self.origin).as_vec3().to_array(),
            normal: found.normal.to_array(),
            color: found.color,
        }
    }

    fn in_order<T: Send>(
        &self,
        pieces: usize,
        make: impl Fn(usize) -> Result<T> + Sync,
        mut take: impl FnMut(T) -> Result<()>,
    ) -> Result<()> {
        let batch = 2 * parallel::current_num_threads();
        for first in (0..pieces).step_by(batch) {
            self.source.restart_time();
            let made: Vec<Result<T>> =
                (first..(first + batch).min(pieces)).into_par_iter().map(&make).collect();
            // If the file has changed, the results may mix old and new content, so none is taken.
            self.source.intact()?;
            for made in made {
                take(made?)?;
            }
            self.source.release();
        }
        // `take` may have read single points from the file.
        self.source.intact()
    }
}
