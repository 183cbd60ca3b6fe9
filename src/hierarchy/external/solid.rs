//! Whether a closed mesh that is read in pieces is solid.

use super::{Stage, StageWatch};
use crate::{
    Result,
    io::Stream,
    math::weld::first_of_equals,
    surface::{Parts, PiecesClosing, Sides},
};
use glam::Vec3;

/// Bytes that are taken in any case.
const LEAST_MEMORY: u64 = 32 << 20;
/// Bytes of a vertex: which part it is in; and, where those at one place are one, the places, their order and the first ones.
const OF_PART: u64 = 4;
const OF_PLACE: u64 = 24;

/// As [`Mesh::is_solid`](crate::surface::Mesh::is_solid), of a mesh that is closed this way. Where half of `memory` does not
/// hold what names the parts of its vertices, the answer is no: then nothing is left out of pictures.
pub fn is_solid(stream: &Stream, closing: PiecesClosing, memory: u64, watch: StageWatch<'_>) -> Result<bool> {
    let points = stream.counts().points;
    let need = points * if closing == PiecesClosing::Places { OF_PART + OF_PLACE } else { OF_PART };
    if need > (memory / 2).max(LEAST_MEMORY) {
        tracing::info!(need, "too little memory to tell whether all parts are turned outward: backs will be drawn");
        return Ok(false);
    }
    let first = match closing {
        PiecesClosing::Vertices => None,
        PiecesClosing::Places => {
            let mut places = Vec::with_capacity(points as usize);
            stream.points(
                |points| points.iter().map(|point| Vec3::from(point.position)).collect::<Vec<_>>(),
                |more| {
                    places.extend(more);
                    Ok(())
                },
            )?;
            Some(first_of_equals(&places))
        }
    };
    let name = |vertex: u32| first.as_ref().map_or(vertex, |first| first[vertex as usize]);
    let parts = Parts::new(points as u32);
    let mut seen = Seen { done: 0, of: stream.counts().triangles, watch };
    stream.triangles(
        |triangles| {
            triangles.iter().for_each(|triangle| parts.join(triangle.map(name)));
            triangles.len()
        },
        |count| seen.add(count),
    )?;
    let mut sides = Sides::default();
    seen.done = 0;
    stream.triangles(
        |triangles| {
            let mut sides = Sides::default();
            for &triangle in triangles {
                let corners = triangle.map(|vertex| stream.vertex(vertex));
                let is_opaque = corners.iter().all(|corner| corner.color[3] == 255);
                let [places, normals] =
                    [corners.map(|corner| corner.position.into()), corners.map(|corner| corner.normal.into())];
                sides.add(parts.of(name(triangle[0])), places, normals, is_opaque);
            }
            (sides, triangles.len())
        },
        |(more, count)| {
            sides.join(more);
            seen.add(count)
        },
    )?;
    Ok(sides.are_solid())
}

/// Tells how far a look through the triangles is.
struct Seen<'a> {
    done: u64,
    of: u64,
    watch: StageWatch<'a>,
}

impl Seen<'_> {
    fn add(&mut self, count: usize) -> Result<()> {
        self.done += count as u64;
        (self.watch)(Stage::Reading, self.done, self.of);
        Ok(())
    }
}
