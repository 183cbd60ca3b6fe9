//! Reads the points and triangles of a file in pieces, as often as needed, for callers that cannot
//! hold all of them.

use super::{
    FORMATS,
    form::{Attribute, Coloring, Counts, Form, Records, StreamPoint, in_order},
    format::{InPieces, by_extension},
};
use crate::{
    Result,
    about::Orientation,
    color::{ColorScale, Spread},
    input::{Limits, Source, positions},
    surface::{Mesh, Paint, Values},
};
use bytemuck::Zeroable;
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Pieces that are read to learn something of all points.
const PIECES: usize = 64;

/// Values of which percentiles are taken: of more, every second, third, … one.
const MOST_SAMPLED: u64 = 1 << 20;

/// What the first pass over a file finds. Another stream of the same file, with the same paint, can
/// take it instead of making that pass.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Settled {
    /// Points that are not withheld.
    pub points: u64,
    /// World position that the points are relative to.
    pub origin: DVec3,
    /// The corners of the box around all points.
    pub bounds: [Vec3; 2],
    /// What the file's colours are scaled by.
    coloring: Coloring,
    /// The values with the first and the last colour, if values colour the points.
    range: Option<[f64; 2]>,
}

impl Settled {
    /// Checks numbers that come from a file. An error names the field.
    pub fn check(&self) -> Result<(), String> {
        let Self { points, origin, bounds: [low, high], coloring, range } = self;
        let is_box = low.is_finite() && high.is_finite() && low.cmple(*high).all();
        let ascends = |[low, high]: &[f64; 2]| low <= high && (high - low).is_finite();
        if u32::try_from(*points).is_err() {
            Err(format!("points is {points}; {} are the most", u32::MAX))
        } else if !origin.is_finite() {
            Err(format!("origin is {origin}; finite numbers are expected"))
        } else if !(is_box && (*high - *low).is_finite()) {
            Err(format!("bounds is [{low}, {high}]; the corners of a box are expected"))
        } else if !coloring.iter().flatten().all(|value| value.is_finite()) {
            Err(format!("coloring is {coloring:?}; finite numbers are expected"))
        } else if !range.as_ref().is_none_or(ascends) {
            Err(format!("range is {range:?}; two numbers that ascend are expected"))
        } else {
            Ok(())
        }
    }
}

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
    /// What colours the points instead of the file's colours.
    paint: Option<Paint>,
}

impl<'a> Stream<'a> {
    /// Checks that the file has not changed since it was opened.
    ///
    /// # Errors
    /// [`Error::Input`](crate::Error::Input) that says how it has changed.
    pub(crate) fn intact(&self) -> Result<()> {
        self.source.intact()
    }

    /// Opens a file and reads its header only. Returns `None` for a file that can only be read as a
    /// whole. A remote LAS, LAZ or COPC object is fetched piece by piece, any other as a whole.
    ///
    /// # Errors
    /// Those of opening the file; [`Error::Input`](crate::Error::Input) for a malformed header and
    /// for a file that ends before its last point; [`Error::Limit`](crate::Error::Limit) for more
    /// points than the limits allow.
    pub fn open(path: &'a (impl AsRef<Path> + ?Sized), limits: &'a Limits) -> Result<Option<Self>> {
        let path = path.as_ref();
        let format = by_extension(FORMATS, path, |_| true);
        let in_parts = matches!(
            format.map(|format| format.pieces),
            Some(InPieces::Points { in_parts: true, .. })
        );
        Self::of(match in_parts {
            true => Source::open_in_parts(path, limits)?,
            false => Source::open(path, limits)?,
        })
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
        Ok(form.map(|form| Self { source, form, points: 0, origin, bounds, paint: None }))
    }

    /// Colours the points by a paint instead of the file's colours, as
    /// [`Mesh::paint`](crate::surface::Mesh::paint) does. `scalar` names the attribute of
    /// [`Values::Own`].
    ///
    /// # Errors
    /// [`Error::Input`](crate::Error::Input) if the points have no attribute of the name.
    pub fn painted(mut self, paint: Paint, scalar: Option<&str>) -> Result<Self> {
        if let Paint::Values { of: Values::Own, .. } = paint {
            let Some(name) = scalar else { return Err(no_values(&self.source)) };
            let chosen = self.form.choose(&self.source, name);
            self.source.unless_changed(chosen)?;
        }
        self.paint = Some(paint);
        Ok(self)
    }

    /// Returns the counts in the header.
    pub fn counts(&self) -> Counts {
        self.form.counts()
    }

    /// Warns if the file contains more than the points, because only those are read.
    pub(crate) fn warn(&self) {
        self.form.warn(&self.source);
    }

    /// Returns how its points stand, if the file or its format's convention says so.
    pub fn orientation(&self) -> Option<Orientation> {
        self.form.orientation()
    }

    /// Returns the coordinate reference system, as the file says it; empty if it does not.
    pub(crate) fn crs(&self) -> String {
        self.form.crs(&self.source)
    }

    /// Guesses how its points stand ([`Mesh::guess_orientation`]), from pieces spread over the
    /// file.
    ///
    /// # Errors
    /// [`Error::Input`](crate::Error::Input) for damaged pieces.
    pub fn guess_orientation(&self) -> Result<Option<Orientation>> {
        let Some((_, positions)) = self.some_positions(PIECES)? else { return Ok(None) };
        Ok(Mesh { positions, ..Mesh::default() }.guess_orientation())
    }

    /// Returns the world positions of some points of pieces spread over the file.
    fn sample(&self, pieces: usize) -> Result<Vec<DVec3>> {
        let Some((origin, positions)) = self.some_positions(pieces)? else { return Ok(Vec::new()) };
        let step = positions.len().div_ceil(positions::MOST_SAMPLED).max(1);
        Ok(positions.iter().step_by(step).map(|place| origin + place.as_dvec3()).collect())
    }

    /// Returns some points of up to `most` pieces spread over the file, and what they are relative
    /// to; `None` for a file without points.
    fn some_positions(&self, most: usize) -> Result<Option<(DVec3, Vec<Vec3>)>> {
        const MOST_POINTS: usize = 1 << 20;
        let pieces = self.form.pieces()[0];
        let read = |piece: usize, origin: DVec3| {
            self.source.restart_time();
            let points = self.form.points(&self.source, piece, origin);
            let points = self.source.unless_changed(points);
            self.source.release();
            points
        };
        if pieces == 0 {
            return Ok(None);
        }
        // Around the first point, large coordinates keep their precision.
        let first = read(0, DVec3::ZERO)?.first().map(|point| Vec3::from(point.position));
        let origin = first.unwrap_or_default().as_dvec3();
        let chosen: Vec<usize> = (0..pieces).step_by(pieces.div_ceil(most)).collect();
        self.source.fetch(chosen.iter().map(|piece| self.form.bytes(*piece)))?;
        let mut positions = Vec::new();
        for &piece in &chosen {
            let points = read(piece, origin)?;
            let step = points.len().div_ceil(MOST_POINTS / chosen.len()).max(1);
            positions.extend(points.iter().step_by(step).map(|point| Vec3::from(point.position)));
        }
        Ok(Some((origin, positions)))
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
        // A few points that lie close together, at the beginning, make it worth looking at more.
        let mut sampled = self.sample(1)?;
        if positions::are_crowded(&sampled, [low, high]) {
            sampled = self.sample(PIECES)?;
        }
        self.origin = positions::origin(&self.source, [low, high], &sampled)?;
        self.bounds = [(low - self.origin).as_vec3(), (high - self.origin).as_vec3()];
        self.settle_scale()
    }

    /// Spreads the scale of the colours over the values, unless its range is given.
    fn settle_scale(&mut self) -> Result<()> {
        let Some(Paint::Values { mut scale, spread: Some(spread), .. }) = self.paint else {
            return Ok(());
        };
        let step = self.points.div_ceil(MOST_SAMPLED).max(1) as usize;
        let mut sampled = Vec::new();
        let of_piece = |points: &[StreamPoint]| {
            let some = points.iter().filter(|point| (point.index as usize).is_multiple_of(step));
            let chosen: Vec<f32> = some.map(StreamPoint::value).collect();
            let all: Vec<f32> = points.iter().map(StreamPoint::value).collect();
            (chosen, Spread::Full.range(&all, scale.is_log))
        };
        let mut ends: Option<[f64; 2]> = None;
        self.points(of_piece, |(chosen, of_piece)| {
            sampled.extend(chosen);
            ends = match (ends, of_piece) {
                (Some([a, b]), Some([c, d])) => Some([f64::min(a, c), f64::max(b, d)]),
                (one, other) => one.or(other),
            };
            Ok(())
        })?;
        let range =
            if spread == Spread::Full { ends } else { spread.range(&sampled, scale.is_log) };
        scale.range = range.ok_or_else(|| no_values(&self.source))?;
        if let Some(Paint::Values { scale: stored, spread, .. }) = &mut self.paint {
            (*stored, *spread) = (scale, None);
        }
        Ok(())
    }

    /// Returns what the first pass has found.
    pub(crate) fn settled(&self) -> Settled {
        Settled {
            points: self.points,
            origin: self.origin,
            bounds: self.bounds,
            coloring: self.form.coloring(),
            range: self.scale().map(|scale| scale.range),
        }
    }

    /// Returns the number of pieces of the points.
    pub(crate) fn pieces(&self) -> usize {
        self.form.pieces()[0]
    }

    /// Takes what the first pass over the same file has found.
    pub(crate) fn resume(&mut self, settled: &Settled) {
        (self.points, self.origin, self.bounds) = (settled.points, settled.origin, settled.bounds);
        self.form.resume(settled.coloring, settled.points);
        if let (Some(Paint::Values { scale, spread, .. }), Some(range)) =
            (&mut self.paint, settled.range)
        {
            (scale.range, *spread) = (range, None);
        }
    }

    /// Returns how the values of the points become colours; `None` if they have colours.
    pub(crate) fn scale(&self) -> Option<ColorScale> {
        match self.paint {
            Some(Paint::Values { scale, .. }) => Some(scale),
            _ => None,
        }
    }

    /// Returns whether a point is opaque.
    pub(crate) fn is_opaque(&self, point: &StreamPoint) -> bool {
        self.paint.is_some() || point.color[3] == 255
    }

    /// Paints a point that the form has read.
    fn paint(&self, point: &mut StreamPoint) {
        match &self.paint {
            Some(Paint::Plain(color)) => point.color = Paint::bytes(*color),
            Some(Paint::Values { of: Values::Height(up), .. }) => {
                let place = self.origin + Vec3::from(point.position).as_dvec3();
                point.color = (place.dot(*up) as f32).to_le_bytes();
            }
            _ => {}
        }
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
        match self.paint {
            Some(Paint::Plain(_)) => true,
            Some(_) => false,
            None => self.form.has_colors(),
        }
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
        self.points_of(0..self.form.pieces()[0], map, take)
    }

    /// As [`points`](Self::points), of some of the pieces, in ascending order.
    pub(crate) fn points_of<T: Send>(
        &self,
        pieces: impl IntoIterator<Item = usize>,
        map: impl Fn(&[StreamPoint]) -> T + Sync,
        take: impl FnMut(T) -> Result<()>,
    ) -> Result<()> {
        let of_piece = |piece: usize| {
            let mut points = self.form.points(&self.source, piece, self.origin)?;
            points.iter_mut().for_each(|point| self.paint(point));
            Ok(map(&points))
        };
        in_order(&self.source, pieces, |piece| self.form.bytes(piece), of_piece, take)
    }

    /// Returns the attributes that points have beside positions, normals and colours.
    pub(crate) fn attributes(&self) -> Result<Vec<Attribute>> {
        self.source.unless_changed(self.form.attributes(&self.source))
    }

    /// Returns the steps and the offset of the positions, if the file stores whole numbers.
    pub(crate) fn grid(&self) -> Option<[DVec3; 2]> {
        self.form.grid()
    }

    /// Returns whether 32-bit floats do not hold the positions.
    pub(crate) fn is_wide(&self) -> bool {
        self.form.is_wide()
    }

    /// Returns whether the colours are greys that stand for another attribute.
    pub(crate) fn are_greys(&self) -> bool {
        self.form.are_greys()
    }

    /// Returns the path of the file.
    pub(crate) fn path(&self) -> &Path {
        self.source.path
    }

    /// As [`points`](Self::points), for points in the world with the attributes of these names.
    pub(crate) fn records<T: Send>(
        &self,
        names: &[String],
        map: impl Fn(Records) -> T + Sync,
        take: impl FnMut(T) -> Result<()>,
    ) -> Result<()> {
        let of_piece = |piece: usize| Ok(map(self.form.records(&self.source, piece, names)?));
        let pieces = 0..self.form.pieces()[0];
        in_order(&self.source, pieces, |piece| self.form.bytes(piece), of_piece, take)
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
        in_order(&self.source, 0..self.form.pieces()[1], |_| 0..0, of_piece, take)
    }

    /// Returns the position of a vertex of a mesh.
    pub(crate) fn position(&self, index: u32) -> Vec3 {
        let position = self.form.position(&self.source, index as usize);
        position.map_or(Vec3::ZERO, |position| (position - self.origin).as_vec3())
    }

    /// Returns a vertex of a mesh.
    pub(crate) fn vertex(&self, index: u32) -> StreamPoint {
        let vertex = self.form.vertex(&self.source, index as usize);
        let mut point = vertex
            .map_or_else(StreamPoint::zeroed, |vertex| StreamPoint::new(&vertex, self.origin));
        self.paint(&mut point);
        point
    }
}

fn no_values(source: &Source) -> crate::Error {
    source.error("points", "have no values to colour by")
}
