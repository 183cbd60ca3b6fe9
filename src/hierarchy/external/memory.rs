//! Memory needed by conversions.

use super::{ExternalOptions, Stage, StageWatch, tell, triangles::scan};
use crate::{
    Error, Result,
    formats::{Counts, Stream},
    input::Limits,
    splat::Splat,
    surface::{Mesh, MeshPieces, SurfelOptions, Triangles},
};
use std::path::PathBuf;

/// Bytes for the blocks that are built at once, and the minimum for a conversion in regions.
pub const BLOCKS: u64 = 200 << 20;
/// Bytes for each triangle that subdivision adds, with three quarters of a vertex.
const OF_CUT: u64 = 131;

/// Estimates the bytes needed to build a hierarchy in memory.
///
/// For a mesh: its arrays, the corners that meet at each vertex, and the splats in parts and as a
/// whole. For a point cloud: its arrays, the tree for finding neighbours, the neighbours found, the
/// edges along which normals are oriented, and the splats with their order.
fn of_counts(counts: Counts) -> u64 {
    if counts.triangles > 0 {
        140 * counts.points + 26 * counts.triangles
    } else {
        330 * counts.points
    }
}

/// Returns the counts after subdivision into `triangles`. Assumes the worst case, in which no long
/// triangles are neighbours, so each is subdivided with its own corners.
fn once_cut(counts: Counts, triangles: u64) -> Counts {
    let more = triangles.saturating_sub(counts.triangles);
    Counts { points: counts.points + more.div_ceil(4) * 3, triangles: counts.triangles + more }
}

/// Returns how many triangles may exist after subdivision if `bytes` are available.
fn room(counts: Counts, bytes: u64) -> usize {
    let spare = bytes.saturating_sub(of_counts(counts));
    usize::try_from(counts.triangles + spare / OF_CUT).unwrap_or(usize::MAX)
}

/// Returns a lower and an upper bound, in bytes, on the memory needed to build a hierarchy from an
/// in-memory mesh or point cloud with these counts. The lower bound assumes that no triangle is
/// subdivided, the upper bound the most that `options` allow.
pub fn memory_between(counts: Counts, options: &SurfelOptions) -> [u64; 2] {
    let triangles = usize::try_from(counts.triangles).unwrap_or(usize::MAX);
    let most = if triangles == 0 { 0 } else { options.most_once_cut(triangles) as u64 };
    [0, most].map(|triangles| of_counts(once_cut(counts, triangles)))
}

/// Estimates the bytes that splats need from when they are collected until a hierarchy is built of
/// them. That is twice their size, because a growing list is moved.
pub fn memory_of_splats(splats: usize) -> u64 {
    (2 * size_of::<Splat>() * splats) as u64
}

/// Estimates the bytes needed to build a hierarchy of a mesh or point cloud, without the [`BLOCKS`]
/// built at once. The estimate is only as precise as a comparison with `enough` needs: if the
/// bounds decide it, returns the lower bound.
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

/// Estimates the bytes needed to build a hierarchy of a file in memory, without the [`BLOCKS`]
/// built at once. This visits the triangles to count those that are subdivided. If the result is
/// more than `enough`, the true value may be larger still.
///
/// # Errors
/// Those of reading the file.
pub fn memory_of_stream(stream: &mut Stream, options: &SurfelOptions, enough: u64) -> Result<u64> {
    stream.settle(&|_| ())?;
    let counts = stream.counts();
    if counts.triangles == 0 {
        return Ok(of_counts(counts));
    }
    let (_, seen) = scan(stream, options, room(counts, enough), None)?;
    let others = counts.triangles.saturating_sub(seen.long.len() as u64);
    Ok(of_counts(once_cut(counts, others + seen.cut as u64)))
}

/// Visits the triangles of a mesh that is converted in regions. Returns an error if there are too
/// many long ones to be subdivided together.
pub(super) fn scan_long(
    stream: &Stream,
    options: &ExternalOptions,
    watch: StageWatch<'_>,
) -> Result<(MeshPieces, Triangles)> {
    let most = options.memory.max(BLOCKS);
    let none = Counts { points: 0, triangles: 0 };
    let room = usize::try_from(stream.counts().triangles)
        .unwrap_or(usize::MAX)
        .saturating_add(room(none, most));
    let (pieces, seen) = scan(stream, &options.surfels, room, watch)?;
    let need = |triangles: u64| of_counts(once_cut(none, triangles));
    if need(seen.cut as u64) <= most {
        return Ok((pieces, seen));
    }
    let [count, mib] = [seen.long.len() as u64, need(seen.cut as u64) >> 20];
    let message = format!(
        "{count} of them have edges longer than {:e}; subdivided together into about {} \
         triangles, they need about {mib} MiB",
        pieces.length, seen.cut
    );
    let error: Error = stream.error("triangles", message);
    Err(error.hint("allow more memory"))
}

/// Rejects files that [`convert`](super::convert) would reject before it writes anything, as far as
/// headers, positions and triangles show.
///
/// # Errors
/// Those of [`Stream::open`] and of reading the file; [`Error::Input`] for a mesh with so many long
/// triangles, which are subdivided together, that the memory does not suffice.
pub fn check(
    files: &[PathBuf],
    limits: &Limits,
    options: &ExternalOptions,
    watch: StageWatch<'_>,
) -> Result<()> {
    for file in files {
        let Some(mut stream) = options.open(file, limits)? else { continue };
        let points = stream.counts().points;
        stream.settle(&|done| tell(watch, Stage::Reading, done, points))?;
        if stream.counts().triangles > 0 {
            let surfels = SurfelOptions { deadline: limits.deadline(), ..options.surfels.clone() };
            let options = ExternalOptions { surfels, ..options.clone() };
            scan_long(&stream, &options, watch).map_err(|error| error.in_file(file))?;
        }
    }
    Ok(())
}
