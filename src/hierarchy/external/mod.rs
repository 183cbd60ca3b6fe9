//! Converts files larger than memory to a hierarchy, one region after another.
//!
//! A first pass finds where the points are (`survey`) and splits space into regions with about
//! equally many points (`regions`). A second pass gives each region its points and those around
//! them (`distribute`), in files without names beside the output (`bins`). Then the surfels of each
//! region are made, built into blocks and written (`build`).
//!
//! The leaves are those of the same input converted in memory. For meshes they are identical,
//! unless subdividing a long edge puts a vertex at the position of another vertex that is on no
//! long edge. For point clouds, points are judged by neighbours within the region and some distance
//! beyond, and the orientation of normals is passed on from region to region.

mod bins;
mod build;
mod distribute;
mod memory;
mod regions;
mod solid;
mod survey;
mod triangles;

use super::{Preset, build::Builder, file::WriteOptions, sphere::Sphere};
use crate::{
    Error, Result,
    formats::Stream,
    hierarchy::file::Whole,
    input::Limits,
    math::Bounds,
    surface::{EXTENT, Paint, SurfelOptions},
};
use std::path::{Path, PathBuf};

pub use memory::{
    BLOCKS, check, memory_between, memory_of_mesh, memory_of_splats, memory_of_stream,
};

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
#[derive(Debug, Clone, PartialEq)]
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
    let most = (options.memory / OF_POINT).clamp(FEWEST_POINTS, MOST_POINTS);
    let mut inputs = Vec::new();
    for file in files {
        let stream = options.open(file, limits)?.ok_or_else(|| {
            Error::Argument(format!(
                "{}: a file of this kind can only be read as a whole",
                file.display()
            ))
        })?;
        stream.warn();
        // Long triangles are subdivided once to count them, and once to make surfels. Each has its
        // own deadline.
        let surfels = SurfelOptions { deadline: limits.deadline(), ..options.surfels.clone() };
        let options = &ExternalOptions { surfels, ..options.clone() };
        let input =
            survey::survey(stream, most, options, watch).map_err(|error| error.in_file(file))?;
        tracing::info!(file = %file.display(), regions = input.regions(), "split into regions");
        inputs.push(distribute::distribute(input, [most, options.memory], path, watch)?);
    }
    let Some(first) = inputs.first() else {
        return Err(Error::NothingToDraw("there are no files".into()));
    };
    let origin = first.input.stream.origin();
    let spheres: Vec<Sphere> = inputs.iter().map(|input| input.around(origin, options)).collect();
    let outer = Sphere::around(&spheres, 1 << 10);
    let mut done = Converted {
        points: inputs.iter().map(|input| input.input.stream.point_count()).sum(),
        splats: 0,
        closed: inputs
            .iter()
            .all(|input| input.input.mesh.as_ref().is_some_and(|mesh| mesh.is_solid)),
        regions: inputs.iter().map(|input| input.input.regions()).sum(),
    };
    let mut work = build::Work {
        builder: Builder::new(path, EXTENT, outer, options.preset, write)?,
        origin,
        bounds: Bounds::EMPTY,
        options,
        points: done.points,
        built: 0,
        splats: 0,
        watch,
        seconds: limits.seconds,
        deadline: limits.deadline(),
    };
    for (input, file) in inputs.into_iter().zip(files) {
        work.input(input, path).map_err(|error| error.in_file(file))?;
    }
    if work.splats == 0 {
        return Err(Error::NothingToDraw("no points are left, or no triangle has an area".into()));
    }
    done.splats = work.splats;
    tell(watch, Stage::Writing, 0, 0);
    let Converted { points, closed, .. } = done;
    work.builder.finish(&Whole { origin, bounds: work.bounds, closed, source_points: points })?;
    Ok(done)
}
