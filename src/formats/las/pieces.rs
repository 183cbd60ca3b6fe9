//! Reads LAS and LAZ files in pieces.

use super::{
    super::{
        form::{self, Coloring, Counts, Form, Records, StreamPoint, in_batches},
        shared::{
            brightness::Brightness,
            cloud::{color_of_16_bits, grey},
            raw_point::RawPoint,
        },
    },
    Header, Point, attribute, describe, packed, plain_bytes,
};
use crate::{
    Error, Result,
    about::{About, Orientation},
    input::{Source, positions},
    parallel::prelude::*,
};
use glam::{DVec3, Vec3};
use laz::LazVlr;
use std::ops::Range;

/// Points per piece of an uncompressed file.
const POINTS: usize = 1 << 16;
/// Maximum points per piece of a compressed file: a chunk is unpacked as a whole. Writers make
/// chunks of about 50,000 points.
const MOST_POINTS: usize = 1 << 21;

pub struct Pieces {
    header: Header,
    packed: Option<(LazVlr, Vec<packed::Chunk>)>,
    /// Index of the first point of each piece.
    firsts: Vec<usize>,
    paint: Paint,
}

/// The source of the points' colours.
#[derive(Debug, Clone, Copy)]
enum Paint {
    None,
    Color { largest: u16 },
    Grey { low: f32, high: f32 },
}

/// What the first pass collects about points.
struct Seen {
    low: DVec3,
    high: DVec3,
    brightness: Brightness,
    /// Number of points with each intensity.
    intensities: Vec<u64>,
    bad: Option<(usize, DVec3)>,
    points: u64,
}

impl Pieces {
    /// Returns `None` if a chunk is too large to be a piece.
    pub fn find(source: &Source) -> Result<Option<Self>> {
        let header = Header::read(source)?;
        let packed = if header.packed {
            let layout = packed::layout(source, &header)?;
            let chunks = packed::chunks(source, &header, &layout)?;
            if chunks.iter().any(|chunk| chunk.points > MOST_POINTS) {
                return Ok(None);
            }
            Some((layout, chunks))
        } else {
            plain_bytes(source, &header)?;
            None
        };
        let mut next = 0;
        let firsts = match &packed {
            Some((_, chunks)) => {
                let first = |chunk: &packed::Chunk| {
                    next += chunk.points;
                    next - chunk.points
                };
                chunks.iter().map(first).collect()
            }
            None => (0..header.points).step_by(POINTS).collect(),
        };
        Ok(Some(Self { header, packed, firsts, paint: Paint::None }))
    }

    /// Returns the points of a piece with their indices. Withheld points are left out. Within a
    /// piece, the points are numbered without them.
    fn piece(&self, source: &Source, piece: usize) -> Result<impl Iterator<Item = (usize, Point)>> {
        let first = self.firsts[piece];
        let points: Vec<Point> = match &self.packed {
            Some((layout, chunks)) => packed::unpack(source, &self.header, layout, &chunks[piece])?,
            None => {
                let bytes = source.part(self.bytes(piece))?;
                let records = bytes.chunks_exact(self.header.size);
                records.filter_map(|record| self.header.point(record)).collect()
            }
        };
        Ok((first..).zip(points))
    }

    /// Calls `take` with the bytes of each point of a piece.
    fn visit(&self, source: &Source, piece: usize, mut take: impl FnMut(&[u8])) -> Result<()> {
        if let Some((layout, chunks)) = &self.packed {
            return packed::visit(source, &self.header, layout, &chunks[piece], take);
        }
        let bytes = source.part(self.bytes(piece))?;
        bytes.chunks_exact(self.header.size).for_each(&mut take);
        Ok(())
    }

    /// Returns the colour of a point.
    fn color(&self, point: &Point) -> [u8; 4] {
        match self.paint {
            Paint::None => [255; 4],
            Paint::Color { largest } => color_of_16_bits(point.color, largest),
            Paint::Grey { low, high } => grey(f32::from(point.intensity), low, high),
        }
    }

    fn scan(&self, source: &Source, piece: usize) -> Result<Seen> {
        let mut seen = Seen::nothing();
        for (row, point) in self.piece(source, piece)? {
            let position = self.header.position(&point);
            if !position.is_finite() {
                seen.bad.get_or_insert((row, position));
            }
            (seen.low, seen.high) = (seen.low.min(position), seen.high.max(position));
            let [red, green, blue] = point.color;
            seen.brightness.add(f64::from(red.max(green).max(blue)));
            seen.intensities[usize::from(point.intensity)] += 1;
            seen.points += 1;
        }
        Ok(seen)
    }
}

impl Form for Pieces {
    /// The points include withheld ones.
    fn counts(&self) -> Counts {
        Counts { points: self.header.points as u64, triangles: 0 }
    }

    fn pieces(&self) -> [usize; 2] {
        [self.firsts.len(), 0]
    }

    fn orientation(&self) -> Option<Orientation> {
        Some(Orientation::SURVEY)
    }

    fn crs(&self, source: &Source) -> String {
        describe::crs(source, &self.header)
    }

    fn bytes(&self, piece: usize) -> Range<usize> {
        let Header { start, points, size, .. } = self.header;
        let first = self.firsts[piece];
        match &self.packed {
            Some((_, chunks)) => chunks[piece].bytes.clone(),
            None => start + first * size..start + (first + POINTS).min(points) * size,
        }
    }

    fn has_normals(&self) -> bool {
        false
    }

    fn has_colors(&self) -> bool {
        !matches!(self.paint, Paint::None)
    }

    fn has_uvs(&self) -> bool {
        false
    }

    fn warn(&self, _: &Source) {}

    fn choose(&mut self, source: &Source, name: &str) -> Result<About> {
        self.header.choose(source, Some(name))?;
        Ok(self.header.attribute.as_ref().map_or(About::default(), |attribute| attribute.about()))
    }

    fn survey(&mut self, source: &Source, watch: &dyn Fn(u64)) -> Result<(u64, [DVec3; 2])> {
        let mut seen = Seen::nothing();
        let pieces = 0..self.firsts.len();
        in_batches(
            source,
            pieces,
            |piece| self.bytes(piece),
            |pieces| {
                source.restart_time();
                let scan = |&piece: &usize| self.scan(source, piece);
                let more: Vec<Seen> = pieces.par_iter().map(scan).collect::<Result<_>>()?;
                more.into_iter().for_each(|more| seen.join(more));
                source.release();
                watch(seen.points);
                Ok(())
            },
        )?;
        if let Some((point, position)) = seen.bad {
            return Err(positions::not_finite(source, format!("point {point}"), position));
        }
        if seen.points == 0 {
            return Err::<_, Error>(source.error("file", "contains no points"));
        }
        self.paint = seen.paint(&self.header);
        Ok((seen.points, [seen.low, seen.high]))
    }

    /// The largest channel of nearly all colours, or the ends of the greys.
    fn coloring(&self) -> Coloring {
        match self.paint {
            Paint::None => [None; 4],
            Paint::Color { largest } => [Some(f64::from(largest)), None, None, None],
            Paint::Grey { low, high } => [None, Some(f64::from(low)), Some(f64::from(high)), None],
        }
    }

    fn resume(&mut self, coloring: Coloring, _: u64) {
        self.paint = match coloring {
            [Some(largest), ..] => Paint::Color { largest: largest as u16 },
            [_, Some(low), Some(high), _] => Paint::Grey { low: low as f32, high: high as f32 },
            _ => Paint::None,
        };
    }

    fn points(&self, source: &Source, piece: usize, origin: DVec3) -> Result<Vec<StreamPoint>> {
        let settled = |(row, point): (usize, Point)| {
            let placed = RawPoint {
                row,
                position: self.header.position(&point),
                normal: Vec3::ZERO,
                color: match self.header.attribute {
                    Some(_) => point.value.to_le_bytes(),
                    None => self.color(&point),
                },
            };
            StreamPoint::new(&placed, origin)
        };
        Ok(self.piece(source, piece)?.map(settled).collect())
    }

    fn attributes(&self, source: &Source) -> Result<Vec<form::Attribute>> {
        let listed = attribute::listed(source, &self.header).into_iter();
        Ok(listed.map(|(described, _)| described).collect())
    }

    fn records(&self, source: &Source, piece: usize, names: &[String]) -> Result<Records> {
        let mut listed = attribute::listed(source, &self.header);
        listed.retain(|(described, _)| names.contains(&described.name));
        let mut records = Records { columns: vec![Vec::new(); listed.len()], ..Records::default() };
        let (has_colors, format) = (self.has_colors(), self.header.format);
        self.visit(source, piece, |record| {
            let Some(point) = self.header.point(record) else { return };
            records.positions.push(self.header.position(&point));
            if has_colors {
                records.colors.push(self.color(&point));
            }
            for (column, (_, attribute)) in records.columns.iter_mut().zip(&listed) {
                column.push(attribute.value(format, record));
            }
        })?;
        records.attributes = listed.into_iter().map(|(described, _)| described).collect();
        Ok(records)
    }

    fn grid(&self) -> Option<[DVec3; 2]> {
        Some([self.header.scale, self.header.offset])
    }

    fn are_greys(&self) -> bool {
        matches!(self.paint, Paint::Grey { .. })
    }

    fn triangles(&self, _: &Source, _: usize) -> Result<(usize, Vec<[u32; 3]>)> {
        Ok((0, Vec::new()))
    }

    fn vertex(&self, _: &Source, _: usize) -> Option<RawPoint> {
        None
    }

    fn position(&self, _: &Source, _: usize) -> Option<DVec3> {
        None
    }
}

impl Seen {
    fn nothing() -> Self {
        Self {
            low: DVec3::INFINITY,
            high: DVec3::NEG_INFINITY,
            brightness: Brightness::default(),
            intensities: vec![0; 1 << 16],
            bad: None,
            points: 0,
        }
    }

    fn join(&mut self, other: Self) {
        (self.low, self.high) = (self.low.min(other.low), self.high.max(other.high));
        self.brightness = self.brightness.with(other.brightness);
        self.intensities.iter_mut().zip(other.intensities).for_each(|(sum, more)| *sum += more);
        self.bad = self.bad.or(other.bad);
        self.points += other.points;
    }

    /// Returns how to colour the points: by their colours, or by greys from the first to the last
    /// percentile of intensities.
    fn paint(&self, header: &Header) -> Paint {
        let largest = self.brightness.largest() as u16;
        if header.color_at.is_some() && largest > 0 {
            return Paint::Color { largest };
        }
        let at = |rank: u64| {
            let mut below = 0;
            let place = self.intensities.iter().position(|&count| {
                below += count;
                below > rank
            });
            place.unwrap_or(0) as f32
        };
        let last = self.points - 1;
        let (low, high) = (at(last / 100), at(last - last / 100));
        if low < high { Paint::Grey { low, high } } else { Paint::None }
    }
}
