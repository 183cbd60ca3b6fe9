//! Determines whether a closed mesh that is read in pieces is solid.

use super::{Stage, StageWatch, tell};
use crate::{
    Result,
    formats::{Counts, Stream},
    math::weld::first_of_equals,
    surface::{Evidence, Joining, PiecesClosing, Sides},
};
use glam::Vec3;

/// Bytes that may be used in any case.
const LEAST_MEMORY: u64 = 32 << 20;
/// Bytes for each vertex if coincident vertices count as one: the positions, their order, and the
/// first vertex at each.
const OF_PLACE: u64 = 24;

/// Returns the same as [`Mesh::is_solid`](crate::surface::Mesh::is_solid), for a mesh that is
/// closed in the given way. If half of `memory` cannot hold the data that joins triangles into
/// parts, and the state of each part, the answer is `false`. Then nothing is culled.
pub fn is_solid(
    stream: &Stream,
    closing: PiecesClosing,
    memory: u64,
    watch: StageWatch<'_>,
) -> Result<bool> {
    let Counts { points, triangles } = stream.counts();
    let is_by_place = closing == PiecesClosing::Places;
    let of_places = if is_by_place { OF_PLACE * points } else { 0 };
    let fits = |more: u64| of_places + more <= (memory / 2).max(LEAST_MEMORY);
    let give_up = || {
        tracing::info!(
            "too little memory to check whether all parts face outward: back faces will be drawn"
        );
        Ok(false)
    };
    if !fits(Joining::memory(triangles, 0)) || u32::try_from(triangles).is_err() {
        return give_up();
    }
    let first = if is_by_place { Some(first_of_equals(&places(stream)?)) } else { None };
    let name = |vertex: u32| first.as_ref().map_or(vertex, |first| first[vertex as usize]);
    let mut seen = Seen { done: 0, of: triangles, watch };
    let joining = Joining::new(triangles as usize);
    let (mut open, mut count) = (Vec::new(), 0);
    stream.triangles(
        |first, batch| (joining.add(first as u32, batch, name), batch.len()),
        |(more, visited)| {
            count += more.len() as u64;
            if fits(Joining::memory(triangles, count)) {
                open.extend(more);
            }
            seen.add(visited)
        },
    )?;
    if !fits(Joining::memory(triangles, count)) {
        return give_up();
    }
    let parts = joining.parts(open);
    if !fits(Joining::memory(triangles, 0) + Sides::memory(parts.count())) {
        return give_up();
    }
    seen.done = 0;
    let mut sides = Sides::new(parts.count());
    stream.triangles(
        |first, triangles| {
            let mut evidence = Evidence::default();
            for (number, triangle) in (first..).zip(triangles) {
                let corners = triangle.map(|vertex| stream.vertex(vertex));
                let is_opaque = corners.iter().all(|corner| stream.is_opaque(corner));
                let [places, normals] = [
                    corners.map(|corner| corner.position.into()),
                    corners.map(|corner| corner.normal.into()),
                ];
                evidence.add(parts.of(number), places, normals, is_opaque);
            }
            (evidence, triangles.len())
        },
        |(evidence, count)| {
            sides.add(evidence);
            seen.add(count)
        },
    )?;
    Ok(sides.are_solid())
}

/// Reports the progress of a visit to the triangles.
struct Seen<'a> {
    done: u64,
    of: u64,
    watch: StageWatch<'a>,
}

impl Seen<'_> {
    fn add(&mut self, count: usize) -> Result<()> {
        self.done += count as u64;
        tell(self.watch, Stage::Reading, self.done, self.of);
        Ok(())
    }
}

/// Returns the positions of all vertices.
fn places(stream: &Stream) -> Result<Vec<Vec3>> {
    let mut places = Vec::with_capacity(stream.counts().points as usize);
    stream.points(
        |points| points.iter().map(|point| Vec3::from(point.position)).collect::<Vec<_>>(),
        |more| {
            places.extend(more);
            Ok(())
        },
    )?;
    Ok(places)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::{Limits, testing::Folder};

    /// Returns a binary PLY file of separate tetrahedra, which share no vertices.
    fn tetrahedra(count: u32) -> Vec<u8> {
        let mut out =
            format!("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", 4 * count);
        ["x", "y", "z"].iter().for_each(|axis| out += &format!("property float {axis}\n"));
        out += &format!(
            "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
            4 * count
        );
        let mut out = out.into_bytes();
        for i in 0..count {
            let place = Vec3::new((i % 500) as f32, (i / 500) as f32, 0.0);
            for corner in [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z] {
                (place + corner * 0.5)
                    .to_array()
                    .iter()
                    .for_each(|value| out.extend(value.to_le_bytes()));
            }
        }
        for first in (0..count).map(|i| 4 * i) {
            for triangle in [[0u32, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]] {
                out.push(3);
                triangle.iter().for_each(|corner| out.extend((first + corner).to_le_bytes()));
            }
        }
        out
    }

    /// The memory that may be used in any case holds the triangles, but not the state of each part.
    #[test]
    fn parts_that_take_too_much_memory_are_not_solid() {
        let folder = Folder::new();
        let count = 360_000;
        let path = folder.write("parts.ply", tetrahedra(count as u32));
        let limits = Limits::default();
        let mut stream = Stream::open(&path, &limits).unwrap().unwrap();
        stream.settle(&|_| ()).unwrap();
        let solid = |memory| is_solid(&stream, PiecesClosing::Vertices, memory, None).unwrap();
        let triangles = Joining::memory(4 * count, 0);
        let need = triangles + Sides::memory(count as usize);
        assert!(2 * triangles < LEAST_MEMORY);
        assert_eq!([0, 2 * need - 1, 2 * need].map(solid), [false, false, true]);
    }
}
