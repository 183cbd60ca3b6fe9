//! The first passes over an input: where its points are, and how long its triangles are.

use super::{
    super::{
        partition::Cube,
        sphere::{DIRECTIONS, Sphere},
    },
    ExternalOptions, Stage, StageWatch,
    guide::{Guide, Sample, Side},
    memory::scan_long,
    regions::{Ranges, Reach, Regions},
    solid::is_solid,
    tell,
};
use crate::{
    Result,
    formats::{Settled, Stream, StreamPoint},
    surface::MeshPieces,
};
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use std::collections::HashSet;

/// An input after the first passes.
pub struct Surveyed<'a> {
    pub stream: Stream<'a>,
    pub facts: Facts,
    pub regions: Regions,
    /// The positions of the corners of triangles to be subdivided. Surfels at these are made
    /// separately.
    pub long: HashSet<[u32; 3]>,
    pub guide: Guide,
    /// For each piece of the points, a box around them and all points that may be neighbours.
    pieces: Vec<PieceBox>,
}

/// Facts about an input, with few numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Facts {
    pub settled: Settled,
    /// A sphere around all points.
    pub around: Sphere,
    /// The mean of all points.
    pub center: DVec3,
    /// `None` for point clouds.
    pub mesh: Option<Triangulated>,
}

/// The properties of a mesh's triangles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Triangulated {
    pub pieces: MeshPieces,
    /// See [`Mesh::is_solid`](crate::surface::Mesh::is_solid).
    pub is_solid: bool,
    /// The longest edge that is not subdivided.
    pub longest: f32,
}

/// The facts about an input that take many numbers.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Tables {
    pub reaches: Vec<Reach>,
    pub pieces: Vec<PieceBox>,
    pub guide: Vec<Side>,
    /// Ascending.
    pub long: Vec<[u32; 3]>,
}

/// The corners of a box.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct PieceBox([[f32; 3]; 2]);

/// Identifies a position, regardless of the sign of zeros.
pub fn name(place: Vec3) -> [u32; 3] {
    (place + Vec3::ZERO).to_array().map(f32::to_bits)
}

impl<'a> Surveyed<'a> {
    /// Reads the input as often as necessary, and splits it into regions of at most `most` points.
    pub fn new(
        mut stream: Stream<'a>,
        most: u64,
        options: &ExternalOptions,
        watch: StageWatch<'_>,
    ) -> Result<Self> {
        let counted = stream.counts();
        stream.settle(&|done| tell(watch, Stage::Reading, done, counted.points))?;
        let is_cloud = counted.triangles == 0;
        let needs_guide = is_cloud && !stream.has_normals() && stream.point_count() > most;
        let sample = Sample::of(if needs_guide { stream.point_count() } else { 0 });
        let [low, high] = stream.bounds();
        let cube = Cube::around(low, high);
        let mut seen = Seen::default();
        let mut is_first = true;
        let cells = Regions::count_cells(most, |count| {
            let is_first = std::mem::take(&mut is_first);
            let mut done = 0;
            stream.points(
                |points| {
                    let place = |point: &StreamPoint| Vec3::from(point.position);
                    let keys: Vec<u64> =
                        points.iter().map(|point| cube.fine_key(place(point))).collect();
                    (keys, is_first.then(|| Seen::of(points, &sample)))
                },
                |(keys, part)| {
                    part.into_iter().for_each(|part| seen.join(part));
                    count(&keys);
                    done += keys.len() as u64;
                    tell(watch, Stage::Reading, done, stream.point_count());
                    Ok(())
                },
            )
        })?;
        let regions = Regions::of_cells(cube, most, &cells);
        let core = seen.extremes.core().center;
        let radius = Regions::radius(cube, &cells, [low, high], core);
        drop(cells);
        let (mesh, long) = match is_cloud {
            true => (None, HashSet::new()),
            false => {
                triangulated(&stream, options, watch).map(|(mesh, long)| (Some(mesh), long))?
            }
        };
        let center = seen.sum / stream.point_count().max(1) as f64;
        let guide = match regions.count() {
            1 => Guide::default(),
            _ => Guide::of(&seen.sample, center, &options.surfels)?,
        };
        let mut pieces = seen.pieces;
        if is_cloud {
            pieces.iter_mut().for_each(|piece| *piece = piece.grown(&regions));
        }
        let around = Sphere { center: core, radius };
        let facts = Facts { settled: stream.settled(), around, center, mesh };
        Ok(Self { stream, facts, regions, long, guide, pieces })
    }

    /// Continues with what the first passes over the same file found.
    ///
    /// # Errors
    /// A message if this cannot be what they found.
    pub fn resume(
        mut stream: Stream<'a>,
        facts: Facts,
        ranges: Ranges,
        tables: Tables,
    ) -> Result<Self, String> {
        tables.check(&facts, &ranges, stream.pieces())?;
        stream.resume(&facts.settled);
        let [low, high] = stream.bounds();
        let regions = Regions::new(Cube::around(low, high), ranges, &tables.reaches);
        let long = tables.long.into_iter().collect();
        let (guide, pieces) = (Guide(tables.guide), tables.pieces);
        Ok(Self { stream, facts, regions, long, guide, pieces })
    }

    /// Returns the facts that take many numbers.
    pub fn tables(&self) -> Tables {
        let mut long: Vec<[u32; 3]> = self.long.iter().copied().collect();
        long.sort_unstable();
        Tables {
            reaches: self.regions.reaches(),
            pieces: self.pieces.clone(),
            guide: self.guide.0.clone(),
            long,
        }
    }

    /// Returns the number of pieces of the points.
    pub fn pieces(&self) -> usize {
        self.pieces.len()
    }

    /// Returns the pieces of the points that regions may need, ascending.
    pub fn pieces_of(&self, wanted: &std::ops::Range<u32>) -> Vec<usize> {
        let all = 0..self.regions.count() as u32;
        let is_everywhere = wanted.end > all.end || *wanted == all;
        let boxes: Vec<[Vec3; 2]> = match is_everywhere {
            true => Vec::new(),
            false => wanted.clone().flat_map(|region| self.regions.boxes(region)).collect(),
        };
        let is_needed =
            |piece: &PieceBox| is_everywhere || boxes.iter().any(|corners| piece.meets(corners));
        (0..).zip(&self.pieces).filter(|(_, piece)| is_needed(piece)).map(|(at, _)| at).collect()
    }
}

impl PieceBox {
    const EMPTY: Self = Self([[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]]);

    /// Returns this box and all around it where its points may be neighbours.
    fn grown(self, regions: &Regions) -> Self {
        let [low, high] = self.0.map(Vec3::from);
        if low.cmpgt(high).any() {
            return self;
        }
        let reach = regions.reach_in([low, high]) * (1.0 + 1e-5);
        Self([(low - reach).to_array(), (high + reach).to_array()])
    }

    /// Whether it is empty, or from a low to a high corner.
    pub fn is_sound(&self) -> bool {
        let [low, high] = self.0.map(Vec3::from);
        *self == Self::EMPTY || low.is_finite() && high.is_finite() && low.cmple(high).all()
    }

    fn meets(&self, [low, high]: &[Vec3; 2]) -> bool {
        let [own_low, own_high] = self.0.map(Vec3::from);
        own_low.cmple(*high).all() && low.cmple(own_high).all()
    }
}

fn triangulated(
    stream: &Stream,
    options: &ExternalOptions,
    watch: StageWatch<'_>,
) -> Result<(Triangulated, HashSet<[u32; 3]>)> {
    let (pieces, seen) = scan_long(stream, options, watch)?;
    let longest = seen.longest.min(pieces.longest());
    let long = seen.long.into_iter().flatten().map(name).collect();
    let is_solid = match pieces.closing {
        Some(closing) => is_solid(stream, closing, options.memory, watch)?,
        None => false,
    };
    Ok((Triangulated { pieces, is_solid, longest }, long))
}

/// What the first visit to the points collects.
#[derive(Default)]
struct Seen {
    extremes: Extremes,
    sum: DVec3,
    sample: Vec<(u32, Vec3)>,
    pieces: Vec<PieceBox>,
}

impl Seen {
    /// Looks at the points of a piece.
    fn of(points: &[StreamPoint], sample: &Sample) -> Self {
        let mut seen = Self::default();
        let PieceBox([low, high]) = PieceBox::EMPTY;
        let [mut low, mut high] = [low, high].map(Vec3::from);
        for point in points {
            let place = Vec3::from(point.position);
            seen.extremes.add(place);
            seen.sum += place.as_dvec3();
            (low, high) = (low.min(place), high.max(place));
            if sample.takes(point.index) {
                seen.sample.push((point.index, place));
            }
        }
        seen.pieces = vec![PieceBox([low.to_array(), high.to_array()])];
        seen
    }

    /// Adds what the next piece has shown.
    fn join(&mut self, other: Self) {
        self.extremes.join(&other.extremes);
        self.sum += other.sum;
        self.sample.extend(other.sample);
        self.pieces.extend(other.pieces);
    }
}

/// The farthest positions in each of some directions, and in its opposite.
struct Extremes([[(f32, Vec3); 2]; DIRECTIONS.len()]);

impl Default for Extremes {
    fn default() -> Self {
        Self([[(f32::NEG_INFINITY, Vec3::ZERO); 2]; DIRECTIONS.len()])
    }
}

impl Extremes {
    fn add(&mut self, place: Vec3) {
        for (ends, direction) in self.0.iter_mut().zip(DIRECTIONS) {
            let along = place.dot(Vec3::from(direction));
            for (end, along) in ends.iter_mut().zip([along, -along]) {
                if along > end.0 {
                    *end = (along, place);
                }
            }
        }
    }

    fn join(&mut self, other: &Self) {
        for (end, other) in self.0.iter_mut().flatten().zip(other.0.iter().flatten()) {
            if other.0 > end.0 {
                *end = *other;
            }
        }
    }

    fn core(&self) -> Sphere {
        let places = self.0.iter().flatten().filter(|(along, _)| along.is_finite());
        let points: Vec<Sphere> =
            places.map(|(_, p)| Sphere { center: p.as_dvec3(), radius: 0.0 }).collect();
        Sphere::around(&points, 1 << 12)
    }
}
