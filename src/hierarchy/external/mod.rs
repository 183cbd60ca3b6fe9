//! Converts files larger than memory to a hierarchy, one region after another, or in parts that
//! several programs make.
//!
//! A first pass finds where the points are (`survey`) and splits space into regions with about
//! equally many points (`regions`). A second pass gives each region its points and those around
//! them (`distribute`), in files without names beside the output (`bins`). Then the surfels of each
//! region are made and built into blocks (`build`), whose pages are written (`made`). At the end,
//! the top of the tree is built over all blocks, and the pages are copied (`join`).
//!
//! No region needs the result of another. So a [`Plan`] may keep what the first pass found, and
//! others make the regions, as parts with files of their own (`part_file`). [`convert`] is the same
//! with one part.
//!
//! The leaves are those of the same input converted in memory. For meshes they are identical,
//! unless subdividing a long edge puts a vertex at the position of another vertex that is on no
//! long edge. For point clouds, points are judged by neighbours within the region and some distance
//! beyond, and which side of them is outside is decided by a sample of the whole cloud (`guide`).

mod bins;
mod build;
mod distribute;
mod field;
mod guide;
mod inputs;
mod join;
mod made;
mod memory;
mod part_file;
mod plan;
mod regions;
mod solid;
mod sound;
mod survey;
mod triangles;

use super::{Preset, file::WriteOptions, sphere::Sphere};
use crate::{
    Deadline, Error, Result,
    container::Spill,
    disk::Scratch,
    formats::Stream,
    input::Limits,
    surface::{Paint, SurfelOptions},
};
use build::Work;
use glam::DVec3;
use made::PartWriter;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use survey::Surveyed;

pub use memory::{
    BLOCKS, check, memory_between, memory_of_mesh, memory_of_splats, memory_of_stream,
};
pub use plan::{PartMade, Plan};

/// The stage of a conversion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Reading the input.
    Reading,
    /// Distributing points and triangles to the regions.
    Distributing,
    /// Making surfels and building blocks of them.
    Building,
    /// Assembling the file.
    Writing,
}

impl Stage {
    /// Returns what a progress bar calls the stage.
    pub fn name(self) -> &'static str {
        match self {
            Self::Reading => "Scanning the input",
            Self::Distributing => "Distributing to regions",
            Self::Building => "Building the hierarchy",
            Self::Writing => "Writing the file",
        }
    }
}

/// Called after each finished part, with the stage, its progress and its total, in points,
/// triangles or splats. A stage may start again for the next input, or for the next pass over it.
/// `None`: nobody wants to know.
pub type StageWatch<'a> = Option<&'a (dyn Fn(Stage, u64, u64) + Sync)>;

/// Says how far a stage is.
fn tell(watch: StageWatch<'_>, stage: Stage, done: u64, total: u64) {
    if let Some(watch) = watch {
        watch(stage, done, total);
    }
}

/// Options for converting a file in regions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExternalOptions {
    /// The approximate memory to use, in bytes. Regions are made as small as this requires, down to
    /// a thousand points. A few hundred million bytes are used in any case.
    pub memory: u64,
    /// How much time to spend on the quality of each block's tree.
    pub preset: Preset,
    /// Splats in a block.
    pub block_splats: usize,
    /// How points and triangles become splats.
    pub surfels: SurfelOptions,
    /// What colours the points instead of the files' own colours.
    pub paint: Option<Paint>,
    /// The attribute of the files that [`Values::Own`](crate::surface::Values::Own) means.
    pub scalar: Option<String>,
    /// The number of parts of a [`Plan`]; `None` makes a part of every region. Regions are small
    /// enough for this many parts of about equal size, down to a thousand points. The file depends
    /// on the regions, but not on their grouping to parts.
    pub parts: Option<u32>,
}

impl Default for ExternalOptions {
    fn default() -> Self {
        Self {
            memory: 4 << 30,
            preset: Preset::default(),
            block_splats: super::BuildOptions::default().block_splats,
            surfels: SurfelOptions::default(),
            paint: None,
            scalar: None,
            parts: None,
        }
    }
}

impl ExternalOptions {
    /// Opens a file, and colours its points as the options say.
    fn open<'a>(&self, file: &'a Path, limits: &'a Limits) -> Result<Option<Stream<'a>>> {
        let Some(stream) = Stream::open(file, limits)? else { return Ok(None) };
        match &self.paint {
            None => Ok(Some(stream)),
            Some(paint) => stream.painted(paint.clone(), self.scalar.as_deref()).map(Some),
        }
    }
}

/// The result of a conversion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Converted {
    /// Points in the source: vertices or samples.
    pub points: u64,
    /// Splats at the finest level.
    pub splats: u64,
    /// See [`Tree::closed`](super::Tree::closed).
    pub closed: bool,
    /// The number of regions that the input was split into.
    pub regions: usize,
}

/// The most bytes that a region needs for each of its points, with its triangles, neighbours,
/// surfels and their blocks.
const OF_POINT: u64 = 1000;
/// The most points in a region; larger regions bring no benefit.
const MOST_POINTS: u64 = 1 << 22;
const FEWEST_POINTS: u64 = 1 << 10;

/// Converts files, each read as a [`Stream`], to one hierarchy, like the one that
/// [`build_file`](super::build_file) makes of the surfels of all files.
///
/// Memory is needed for one region at a time. Meanwhile the disk of `path` needs about 40 bytes a
/// point and 14 a triangle.
///
/// # Errors
/// After an error, nothing is left of the file.
///
/// - Those of [`Stream::open`] and of reading the files.
/// - [`Error::Argument`] for a file that can only be read as a whole, and for options of
///   [`Mesh::surfels`](crate::surface::Mesh::surfels) that are not positive numbers.
/// - [`Error::Input`] for a mesh with so many long triangles, which are subdivided together, that
///   the memory does not suffice.
/// - [`Error::NothingToDraw`] if no splats are left.
/// - [`Error::Timeout`] if counting long triangles, or a region, takes longer than
///   [`Limits::seconds`].
/// - [`Error::Memory`] if there is too little memory.
/// - [`Error::Output`] if something cannot be written.
pub fn convert(
    files: &[PathBuf],
    limits: &Limits,
    path: impl AsRef<Path>,
    options: &ExternalOptions,
    write: &WriteOptions,
    watch: StageWatch<'_>,
) -> Result<Converted> {
    let _span = tracing::info_span!("convert").entered();
    let path = path.as_ref();
    let (inputs, shape) = survey_all(files, limits, options, watch)?;
    let mut work = Work {
        part: PartWriter::new(Scratch::beside(path)?, write.lossless, path),
        shape: &shape,
        options,
        points: shape.points,
        built: 0,
        watch,
        seconds: limits.seconds,
        deadline: Deadline::NEVER,
    };
    for (input, file) in inputs.into_iter().zip(files) {
        let all = 0..input.count();
        work.input(&input, all, path).map_err(|error| error.stated_in(file, "content"))?;
    }
    tell(watch, Stage::Writing, 0, 0);
    let (pages, length, made) = work.part.end()?;
    let parts = std::iter::once((&made, 0));
    join::write(&shape, parts, Spill::over(pages, length), path, options, write)
}

/// Properties of the whole hierarchy on which its regions depend.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Shape {
    /// The most points in a region.
    most: u64,
    /// The number of regions of all inputs.
    regions: usize,
    /// Points in the source.
    points: u64,
    /// See [`Tree::closed`](super::Tree::closed).
    closed: bool,
    /// World position of the origin of all positions.
    origin: DVec3,
    /// A sphere around all footprints, relative to the origin.
    outer: Sphere,
}

/// Makes the first passes over all inputs.
fn survey_all<'a>(
    files: &'a [PathBuf],
    limits: &'a Limits,
    options: &ExternalOptions,
    watch: StageWatch<'_>,
) -> Result<(Vec<Surveyed<'a>>, Shape)> {
    let open = |file: &'a PathBuf| {
        options.open(file, limits)?.ok_or_else(|| {
            Error::Argument(format!(
                "{}: a file of this kind can only be read as a whole",
                file.display()
            ))
        })
    };
    options.surfels.validate()?;
    let streams: Vec<Stream> = files.iter().map(open).collect::<Result<_>>()?;
    let points = streams.iter().map(|stream| stream.counts().points).sum();
    let most = most_points(points, options);
    let mut inputs = Vec::new();
    for (stream, file) in streams.into_iter().zip(files) {
        stream.warn();
        // Long triangles are subdivided once to count them, and once to make surfels. Each has its
        // own deadline.
        let surfels = SurfelOptions { deadline: limits.deadline(), ..options.surfels.clone() };
        let options = &ExternalOptions { surfels, ..options.clone() };
        let input = Surveyed::new(stream, most, options, watch);
        let input = input.map_err(|error| error.stated_in(file, "content"))?;
        tracing::info!(file = %file.display(), regions = input.count(), "split into regions");
        inputs.push(input);
    }
    let Some(first) = inputs.first() else {
        return Err(Error::NothingToDraw("there are no files".into()));
    };
    let origin = first.stream.origin();
    let spheres: Vec<Sphere> = inputs.iter().map(|input| input.around(origin, options)).collect();
    let is_solid = |input: &Surveyed| input.facts.mesh.as_ref().is_some_and(|mesh| mesh.is_solid);
    let shape = Shape {
        most,
        regions: inputs.iter().map(|input| input.count() as usize).sum(),
        points: inputs.iter().map(|input| input.stream.point_count()).sum(),
        closed: inputs.iter().all(is_solid),
        origin,
        outer: Sphere::around(&spheres, 1 << 10),
    };
    Ok((inputs, shape))
}

/// Returns the most points in a region, for inputs of this many points: as many as memory allows,
/// but so that all parts can have equally many.
fn most_points(points: u64, options: &ExternalOptions) -> u64 {
    let most = (options.memory / OF_POINT).clamp(FEWEST_POINTS, MOST_POINTS);
    let Some(parts) = options.parts else { return most };
    let of_part = points.div_ceil(u64::from(parts.max(1))).max(1);
    of_part.div_ceil(of_part.div_ceil(most)).max(FEWEST_POINTS)
}
