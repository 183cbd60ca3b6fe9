//! Points and triangles of a file in pieces, as often as they are wanted, for those who cannot hold all of them.

use super::{las, ply};
use crate::{
    Result,
    input::{Limits, Source, positions},
};
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::path::Path;

/// What a file's header counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Counts {
    pub points: u64,
    pub triangles: u64,
}

/// A point as the file has it.
pub(super) struct Found {
    pub row: usize,
    pub position: DVec3,
    pub normal: Vec3,
    pub color: [u8; 4],
}

/// A point relative to the stream's origin.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct StreamPoint {
    /// Its number in the file.
    pub index: u32,
    pub position: [f32; 3],
    /// Unit length; zero where the file has none.
    pub normal: [f32; 3],
    /// As of [`Mesh::colors`](crate::surface::Mesh::colors); white where the file has none.
    pub color: [u8; 4],
}

/// A file of points, or of a mesh, that is read in pieces: binary PLY of triangles or points, LAS and LAZ.
///
/// What it gives is what [`load_mesh`](super::load_mesh) gives of the file: around the same origin, in the same colours, in
/// the same order. The pages of the file that were read go back to the system again and again.
pub struct Stream<'a> {
    source: Source<'a>,
    form: Form,
    /// Of points that are not withheld.
    points: u64,
    origin: DVec3,
    bounds: [Vec3; 2],
}

enum Form {
    Ply(ply::Pieces),
    Las(las::Pieces),
}

impl<'a> Stream<'a> {
    /// Looks at a file's header alone. `None` for one that can only be read as a whole.
    ///
    /// # Errors
    /// Those of opening the file; [`Error::Input`](crate::Error::Input) for a malformed header and for a file that ends
    /// before its last point, [`Error::Limit`](crate::Error::Limit) for more points than the limits allow.
    pub fn open(path: &'a Path, limits: &'a Limits) -> Result<Option<Self>> {
        Self::of(Source::open(path, limits)?)
    }

    /// As [`open`](Self::open), of what is open already, which may be in memory ([`Source::from_bytes`]).
    ///
    /// # Errors
    /// Those of [`open`](Self::open) but for opening.
    pub fn of(source: Source<'a>) -> Result<Option<Self>> {
        let extension =
            source.path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
        let form = match extension.as_str() {
            "ply" => ply::Pieces::find(&source).map(|pieces| pieces.map(Form::Ply)),
            "las" | "laz" => las::Pieces::find(&source).map(|pieces| pieces.map(Form::Las)),
            _ => Ok(None),
        };
        let form = source.unless_changed(form)?;
        let (origin, bounds) = (DVec3::ZERO, [Vec3::ZERO; 2]);
        Ok(form.map(|form| Self { source, form, points: 0, origin, bounds }))
    }

    /// What the header counts.
    pub fn counts(&self) -> Counts {
        let (points, triangles) = match &self.form {
            Form::Ply(pieces) => (pieces.points(), pieces.triangles()),
            Form::Las(pieces) => (pieces.points(), 0),
        };
        Counts { points: points as u64, triangles: triangles as u64 }
    }

    /// Warns where the file holds more than its points, which alone are read.
    pub(crate) fn warn(&self) {
        if let Form::Ply(pieces) = &self.form
            && pieces.are_gaussians
        {
            ply::warn_of_gaussians(&self.source);
        }
    }

    /// Whether the third axis of its points is up, as for [`Mesh::z_is_up`](crate::surface::Mesh::z_is_up).
    pub fn z_is_up(&self) -> bool {
        matches!(self.form, Form::Las(_))
    }

    /// The first pass over all points: where they are, and what their colours are made from. `watch` is told how many have
    /// been seen.
    pub(crate) fn settle(&mut self, watch: &dyn Fn(u64)) -> Result<()> {
        let counted = self.counts().points;
        if counted > u64::from(u32::MAX) {
            let message = format!(
                "counts {counted} points, but a file that is read in pieces has {} at most",
                u32::MAX
            );
            return Err(self
                .source
                .error("header", message)
                .hint("cut it in several files and convert them together"));
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

    /// What is wrong at a place of the file.
    pub(crate) fn error(&self, place: &str, message: impl Into<String>) -> crate::Error {
        self.source.error(place, message)
    }

    /// World position that the points are relative to.
    pub(crate) fn origin(&self) -> DVec3 {
        self.origin
    }

    /// The corners of the box around all points.
    pub(crate) fn bounds(&self) -> [Vec3; 2] {
        self.bounds
    }

    /// Points that are not withheld.
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

    /// Goes through all points in their order: `map` makes something of each piece, beside the others; `take` takes that of
    /// one piece after the other.
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

    /// As [`points`](Self::points), of the triangles; `map` also gets the number of the first one.
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

    /// The place of a vertex of a mesh.
    pub(crate) fn position(&self, index: u32) -> Vec3 {
        match &self.form {
            Form::Ply(pieces) => {
                (pieces.position(&self.source, index as usize) - self.origin).as_vec3()
            }
            Form::Las(_) => Vec3::ZERO,
        }
    }

    /// A vertex of a mesh.
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
        let batch = 2 * rayon::current_num_threads();
        for first in (0..pieces).step_by(batch) {
            self.source.restart_time();
            let made: Vec<Result<T>> =
                (first..(first + batch).min(pieces)).into_par_iter().map(&make).collect();
            // Nothing that was made of a file and half of another is taken.
            self.source.intact()?;
            for made in made {
                take(made?)?;
            }
            self.source.release();
        }
        // What was taken may have looked at single points.
        self.source.intact()
    }
}
