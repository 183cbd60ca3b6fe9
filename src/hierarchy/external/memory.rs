//! How much memory conversions take.

use super::{ExternalOptions, survey::look};
use crate::{
    Error, Result,
    io::{Counts, Stream},
    surface::{Mesh, MeshPieces, SurfelOptions, Triangles},
};

/// What blocks at work take, and what a conversion in regions takes in any case.
const BLOCKS: u64 = 200 << 20;

/// About how many bytes making a hierarchy takes where all is in memory: of a mesh its arrays, which corners meet at its
/// vertices, and splats in parts and as a whole; of a cloud its arrays, the tree that finds neighbours, what is found of them,
/// and the edges along which sides are told; with splats, their order.
fn of_counts(counts: Counts) -> u64 {
    if counts.triangles > 0 { 140 * counts.points + 26 * counts.triangles } else { 330 * counts.points }
}

/// The counts once triangles are cut to about so many: where none are neighbours, each is cut with corners of its own.
fn once_cut(counts: Counts, triangles: u64) -> Counts {
    let more = triangles.saturating_sub(counts.triangles);
    Counts { points: counts.points + more / 4 * 3, triangles: counts.triangles + more }
}

/// Whether the counts tell by themselves if that is more than `enough`.
fn is_clear(counts: Counts, options: &SurfelOptions, enough: u64) -> bool {
    let need = |triangles: u64| of_counts(once_cut(counts, triangles));
    counts.triangles == 0 || need(0) > enough || need(options.most_triangles as u64) <= enough
}

/// About how many bytes making a hierarchy of a mesh or cloud takes, but for the blocks at work; less where that is not more
/// than `enough` anyway.
pub fn memory_of_mesh(mesh: &Mesh, options: &SurfelOptions, enough: u64) -> u64 {
    let counts = Counts { points: mesh.positions.len() as u64, triangles: mesh.triangles.len() as u64 };
    let is_clear = is_clear(counts, options, enough);
    of_counts(once_cut(counts, if is_clear { 0 } else { mesh.triangles_once_cut(options) as u64 }))
}

/// About how many bytes making a hierarchy of a file takes where all of it is in memory. Where it depends on how many triangles
/// are cut whether that is more than `enough`, the file is looked through.
///
/// # Errors
/// Those of reading the file.
pub fn memory_of_stream(stream: &mut Stream, options: &SurfelOptions, enough: u64) -> Result<u64> {
    let counts = stream.counts();
    let need = |triangles: u64| BLOCKS + of_counts(once_cut(counts, triangles));
    if is_clear(counts, options, enough.saturating_sub(BLOCKS)) {
        return Ok(need(0));
    }
    stream.settle(&|_| ())?;
    let (_, seen) = look(stream, options, &|_, _, _| ())?;
    Ok(need(seen.expected as u64))
}

/// Refuses a mesh whose long triangles are too many to be cut together.
pub(super) fn check_long(
    stream: &Stream,
    pieces: &MeshPieces,
    seen: &Triangles,
    options: &ExternalOptions,
) -> Result<()> {
    let triangles = seen.expected_of_long as u64;
    let need = of_counts(once_cut(Counts { points: 0, triangles: 0 }, triangles));
    if need <= options.memory.max(BLOCKS) {
        return Ok(());
    }
    let [count, mib] = [seen.long.len() as u64 / 3, need >> 20];
    let message = format!(
        "{count} of them have edges longer than {:e}, and are cut into about {triangles} together, which takes about {mib} MiB",
        pieces.length
    );
    let error: Error = stream.error("triangles", message);
    Err(error.hint("allow more memory"))
}
