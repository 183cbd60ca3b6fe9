//! Visiting the triangles of a stream.

use super::{Stage, StageWatch, tell};
use crate::{
    Result,
    formats::Stream,
    surface::{MeshPieces, SurfelOptions, Triangles},
};

/// Visits the triangles until it is known which are subdivided, and into how many. Stops early if
/// there are more than `room` triangles after subdivision.
pub fn scan(
    stream: &Stream,
    options: &SurfelOptions,
    room: usize,
    watch: StageWatch<'_>,
) -> Result<(MeshPieces, Triangles)> {
    let counts = stream.counts();
    let visit = |length: f32| {
        let mut seen = Triangles::default();
        let mut done = 0;
        stream.triangles(
            |_, triangles| {
                let mut seen = Triangles::default();
                for &triangle in triangles {
                    seen.add(triangle, triangle.map(|vertex| stream.position(vertex)), length);
                }
                (seen, triangles.len() as u64)
            },
            |(more, count)| {
                seen.join(more);
                done += count;
                tell(watch, Stage::Reading, done, counts.triangles);
                Ok(())
            },
        )?;
        Ok(seen)
    };
    MeshPieces::new(
        [counts.points as usize, counts.triangles as usize],
        [stream.has_normals(), stream.has_uvs()],
        stream.bounds(),
        options,
        room,
        visit,
    )
}
