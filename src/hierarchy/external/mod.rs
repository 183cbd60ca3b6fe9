//! From files larger than memory to a hierarchy: in regions, one after the other.
//!
//! A first look finds where the points are (`survey`) and cuts space in regions of about as many points each (`regions`). A
//! second one gives each region its points and what is around them (`distribute`), by way of files without names beside the
//! one that is wanted (`bins`). Then each region's surfels are made, built into blocks and written (`build`).
//!
//! The leaves are those of the whole that fits in memory: of meshes exactly, but where cutting long edges puts a vertex at
//! the place of another that no long edge meets. Points of a cloud are judged by the neighbours found within the region and
//! some way beyond; sides of normals are handed on from region to region.

mod bins;
mod build;
mod distribute;
mod memory;
mod regions;
mod solid;
mod survey;

use super::{Preset, build::Builder, file::WriteOptions, sphere::Sphere};
use crate::{
    Error, Result,
    formats::Stream,
    hierarchy::file::Whole,
    input::Limits,
    math::Bounds,
    surface::{EXTENT, SurfelOptions},
};
use std::path::{Path, PathBuf};

pub use memory::{
    BLOCKS, check, memory_between, memory_of_mesh, memory_of_splats, memory_of_stream,
};

/// What is at work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Going through the input.
    Reading,
    /// Giving points and triangles to the regions.
    Distributing,
    /// Making surfels and blocks of them.
    Building,
    /// Putting the file together.
    Writing,
}

/// Told of each finished part: how much of a stage is done, of how much; points, triangles or splats. A stage may begin anew
/// for the next input, or the next look at it.
pub type StageWatch<'a> = &'a (dyn Fn(Stage, u64, u64) + Sync);

/// How a file is converted in regions.
#[derive(Debug, Clone, PartialEq)]
pub struct ExternalOptions {
    /// Bytes of memory that are to suffice, about; regions are made as small as that needs, down to a thousand points. A
    /// few hundred million are taken in any case.
    pub memory: u64,
    pub preset: Preset,
    /// Splats of a block.
    pub block_splats: usize,
    pub surfels: SurfelOptions,
}

/// What was converted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Converted {
    pub points: u64,
    pub splats: u64,
    /// See [`Tree::closed`](super::Tree::closed).
    pub closed: bool,
    pub regions: usize,
}

/// Bytes that a region takes for each of its points at most, with its triangles, neighbours, surfels and their blocks.
const OF_POINT: u64 = 1000;
/// The most points of a region; larger ones make nothing better.
const MOST_POINTS: u64 = 1 << 22;
const FEWEST_POINTS: u64 = 1 << 10;

/// Converts files, each read as a [`Stream`], to one hierarchy, as [`build_file`](super::build_file) makes it of the surfels
/// of all. Memory is for one region at a time; the disk beside `path` has to hold about 40 bytes a point and 14 a triangle
/// meanwhile.
///
/// # Errors
/// Those of [`Stream::open`] and of reading on; [`Error::Argument`] for a file that can only be read as a whole, and for
/// options of [`Mesh::surfels`](crate::surface::Mesh::surfels) that are no positive numbers; [`Error::Input`] for a mesh
/// of so many long triangles, which are cut together, that the memory does not suffice; [`Error::NothingToDraw`] where
/// nothing is left; [`Error::Timeout`] where counting long triangles, or a region, takes longer than
/// [`Limits::seconds`]; [`Error::Memory`] where there is too little; [`Error::Output`] where something cannot be written. Then nothing is left of the file.
pub fn convert(
    files: &[PathBuf],
    limits: &Limits,
    path: &Path,
    options: &ExternalOptions,
    write: &WriteOptions,
    watch: StageWatch<'_>,
) -> Result<Converted> {
    let _span = tracing::info_span!("convert").entered();
    let most = (options.memory / OF_POINT).clamp(FEWEST_POINTS, MOST_POINTS);
    let mut inputs = Vec::new();
    for file in files {
        let stream = Stream::open(file, limits)?.ok_or_else(|| {
            Error::Argument(format!(
                "{}: a file of this kind can only be read as a whole",
                file.display()
            ))
        })?;
        stream.warn();
        // Long triangles are cut once to be counted, and once to be drawn.
        let surfels = SurfelOptions { deadline: limits.deadline(), ..options.surfels.clone() };
        let options = &ExternalOptions { surfels, ..options.clone() };
        let input =
            survey::survey(stream, most, options, watch).map_err(|error| error.in_file(file))?;
        tracing::info!(file = %file.display(), regions = input.regions(), "cut in regions");
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
        return Err(Error::NothingToDraw("no point is left, or no triangle has an area".into()));
    }
    done.splats = work.splats;
    watch(Stage::Writing, 0, 0);
    let Converted { points, closed, .. } = done;
    work.builder.finish(&Whole { origin, bounds: work.bounds, closed, source_points: points })?;
    Ok(done)
}
