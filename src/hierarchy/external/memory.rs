//! How much memory conversions take.

use super::{ExternalOptions, Stage, StageWatch, survey::look};
use crate::{
    Error, Result,
    formats::{Counts, Stream},
    input::Limits,
    splat::Splat,
    surface::{Mesh, MeshPieces, SurfelOptions, Triangles},
};
use std::path::PathBuf;

/// What blocks at work take, and what a conversion in regions takes in any case.
pub const BLOCKS: u64 = 200 << 20;
/// What each triangle takes that cutting adds, with three quarters of a vertex.
const OF_CUT: u64 = 131;

/// About how many bytes making a hierarchy takes where all is in memory: of a mesh its arrays, which corners meet at its
/// vertices, and splats in parts and as a whole; of a cloud its arrays, the tree that finds neighbours, what is found of them,
/// and the edges along which sides are told; with splats, their order.
fn of_counts(counts: Counts) -> u64 {
    if counts.triangles > 0 {
        140 * counts.points + 26 * counts.triangles
    } else {
        330 * counts.points
    }
}

/// The counts once triangles are cut to so many: where none are neighbours, each is cut with corners of its own.
fn once_cut(counts: Counts, triangles: u64) -> Counts {
    let more = triangles.saturating_sub(counts.triangles);
    Counts { points: counts.points + more.div_ceil(4) * 3, triangles: counts.triangles + more }
}

/// How many triangles there may be, once they are cut, where so many bytes are to suffice.
fn room(counts: Counts, bytes: u64) -> usize {
    let spare = bytes.saturating_sub(of_counts(counts));
    usize::try_from(counts.triangles + spare / OF_CUT).unwrap_or(usize::MAX)
}

/// Between what lies how many bytes making a hierarchy takes of what has these counts, where all of it is in memory: without any
/// triangle cut, and with as many as cutting may lead to.
pub fn memory_between(counts: Counts, options: &SurfelOptions) -> [u64; 2] {
    let triangles = usize::try_from(counts.triangles).unwrap_or(usize::MAX);
    let most = if triangles == 0 { 0 } else { options.most_once_cut(triangles) as u64 };
    [0, most].map(|triangles| of_counts(once_cut(counts, triangles)))
}

/// About how many bytes splats take from when they are gathered until a hierarchy is made of them: twice their own, for a list of
/// them that grows moves.
pub fn memory_of_splats(splats: usize) -> u64 {
    (2 * size_of::<Splat>() * splats) as u64
}

/// About how many bytes making a hierarchy of a mesh or cloud takes, but for the [`BLOCKS`] at work; less where that is not more
/// than `enough` anyway.
///
/// # Errors
/// Those of [`Mesh::triangles_once_cut`].
pub fn memory_of_mesh(mesh: &Mesh, options: &SurfelOptions, enough: u64) -> Result<u64> {
    let counts =
        Counts { points: mesh.positions.len() as u64, triangles: mesh.triangles.len() as u64 };
    let [least, most] = memory_between(counts, options);
    if least > enough || most <= enough {
        return Ok(least);
    }
    Ok(of_counts(once_cut(counts, mesh.triangles_once_cut(options, room(counts, enough))? as u64)))
}

/// About how many bytes making a hierarchy of a file takes where all of it is in memory, but for the [`BLOCKS`] at work: it is
/// looked through for triangles that are cut. Where it is more than `enough`, it may be more than what is told.
///
/// # Errors
/// Those of reading the file.
pub fn memory_of_stream(stream: &mut Stream, options: &SurfelOptions, enough: u64) -> Result<u64> {
    stream.settle(&|_| ())?;
    let counts = stream.counts();
    if counts.triangles == 0 {
        return Ok(of_counts(counts));
    }
    let (_, seen) = look(stream, options, room(counts, enough), &|_, _, _| ())?;
    let others = counts.triangles.saturating_sub(seen.long.len() as u64);
    Ok(of_counts(once_cut(counts, others + seen.cut as u64)))
}

/// Looks at the triangles of a mesh that is converted in regions, and refuses one whose long triangles are too many to be cut
/// together.
pub(super) fn look_at_long(
    stream: &Stream,
    options: &ExternalOptions,
    watch: StageWatch<'_>,
) -> Result<(MeshPieces, Triangles)> {
    let most = options.memory.max(BLOCKS);
    let none = Counts { points: 0, triangles: 0 };
    let room = usize::try_from(stream.counts().triangles)
        .unwrap_or(usize::MAX)
        .saturating_add(room(none, most));
    let (pieces, seen) = look(stream, &options.surfels, room, watch)?;
    let need = |triangles: u64| of_counts(once_cut(none, triangles));
    if need(seen.cut as u64) <= most {
        return Ok((pieces, seen));
    }
    let [count, mib] = [seen.long.len() as u64, need(seen.cut as u64) >> 20];
    let message = format!(
        "{count} of them have edges longer than {:e}, and are cut into about {} together, which takes about {mib} MiB",
        pieces.length, seen.cut
    );
    let error: Error = stream.error("triangles", message);
    Err(error.hint("allow more memory"))
}

/// Refuses files as [`convert`](super::convert) does before it writes anything, as far as their headers, places and triangles
/// tell.
///
/// # Errors
/// Those of [`Stream::open`] and of reading on, and [`Error::Input`] for a mesh of so many long triangles, which are cut
/// together, that the memory does not suffice.
pub fn check(
    files: &[PathBuf],
    limits: &Limits,
    options: &ExternalOptions,
    watch: StageWatch<'_>,
) -> Result<()> {
    for file in files {
        let Some(mut stream) = Stream::open(file, limits)? else { continue };
        let points = stream.counts().points;
        stream.settle(&|done| watch(Stage::Reading, done, points))?;
        if stream.counts().triangles > 0 {
            let surfels = SurfelOptions { deadline: limits.deadline(), ..options.surfels.clone() };
            let options = ExternalOptions { surfels, ..options.clone() };
            look_at_long(&stream, &options, watch).map_err(|error| error.in_file(file))?;
        }
    }
    Ok(())
}
