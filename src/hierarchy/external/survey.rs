//! The first passes over an input: where its points are, and how long its triangles are.

use super::{
    super::{
        partition::Cube,
        sphere::{DIRECTIONS, Sphere},
    },
    ExternalOptions, Stage, StageWatch,
    memory::look_at_long,
    regions::Regions,
    solid::is_solid,
    tell,
};
use crate::{Result, formats::Stream, surface::MeshPieces};
use glam::{DVec3, Vec3};
use std::collections::HashSet;

/// An input after the first passes.
pub struct Surveyed<'a> {
    pub stream: Stream<'a>,
    pub regions: Regions,
    /// Nearly the smallest sphere around the points that are farthest in some directions.
    pub core: Sphere,
    /// The mean of all points.
    pub center: DVec3,
    /// `None` for point clouds.
    pub mesh: Option<Triangulated>,
}

/// The properties of a mesh's triangles.
pub struct Triangulated {
    pub pieces: MeshPieces,
    /// See [`Mesh::is_solid`](crate::surface::Mesh::is_solid).
    pub is_solid: bool,
    /// The positions of the corners of triangles to be subdivided. Surfels at these are made
    /// separately.
    pub long: HashSet<[u32; 3]>,
    /// The longest edge that is not subdivided.
    pub longest: f32,
}

/// Identifies a position, regardless of the sign of zeros.
pub fn name(place: Vec3) -> [u32; 3] {
    (place + Vec3::ZERO).to_array().map(f32::to_bits)
}

/// Reads the input as often as necessary, and splits it into regions of at most `most` points.
pub fn survey<'a>(
    mut stream: Stream<'a>,
    most: u64,
    options: &ExternalOptions,
    watch: StageWatch<'_>,
) -> Result<Surveyed<'a>> {
    let counted = stream.counts();
    stream.settle(&|done| tell(watch, Stage::Reading, done, counted.points))?;
    let [low, high] = stream.bounds();
    let cube = Cube::around(low, high);
    let (mut extremes, mut sum) = (Extremes::default(), DVec3::ZERO);
    let mut is_first = true;
    let regions = Regions::cut(cube, most, |count| {
        let wants_extremes = std::mem::take(&mut is_first);
        let mut done = 0;
        stream.points(
            |points| {
                let places = || points.iter().map(|point| Vec3::from(point.position));
                let keys: Vec<u64> = places().map(|place| cube.fine_key(place)).collect();
                let mut found = Extremes::default();
                if wants_extremes {
                    places().for_each(|place| found.add(place));
                }
                (keys, found, places().map(Vec3::as_dvec3).sum::<DVec3>())
            },
            |(keys, found, more)| {
                if wants_extremes {
                    extremes.join(&found);
                    sum += more;
                }
                count(&keys);
                done += keys.len() as u64;
                tell(watch, Stage::Reading, done, stream.point_count());
                Ok(())
            },
        )
    })?;
    let mesh =
        if counted.triangles > 0 { Some(triangulated(&stream, options, watch)?) } else { None };
    let center = sum / stream.point_count().max(1) as f64;
    Ok(Surveyed { core: extremes.core(), stream, regions, center, mesh })
}

fn triangulated(
    stream: &Stream,
    options: &ExternalOptions,
    watch: StageWatch<'_>,
) -> Result<Triangulated> {
    let (pieces, seen) = look_at_long(stream, options, watch)?;
    let longest = seen.longest.min(pieces.longest());
    let long = seen.long.into_iter().flatten().map(name).collect();
    let is_solid = match pieces.closing {
        Some(closing) => is_solid(stream, closing, options.memory, watch)?,
        None => false,
    };
    Ok(Triangulated { pieces, is_solid, long, longest })
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
