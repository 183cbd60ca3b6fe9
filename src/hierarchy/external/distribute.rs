//! The second pass over an input: gives every point and triangle to the regions that need it.

use super::{
    Stage, StageWatch,
    bins::Bins,
    survey::{Surveyed, name},
    tell,
};
use crate::{
    Result,
    formats::{Stream, StreamPoint},
};
use glam::Vec3;
use std::{collections::HashSet, ops::Range, path::Path};

/// The points and triangles of some of an input's regions. Each region owns its points, and also
/// holds those around them. In a mesh, the last region owns the corners of triangles to be
/// subdivided, wherever they are.
pub struct Distributed {
    pub points: Bins<StreamPoint>,
    pub triangles: Option<Bins<[u32; 3]>>,
}

impl Surveyed<'_> {
    /// Returns the number of regions that own points.
    pub fn count(&self) -> u32 {
        (self.regions.count() + usize::from(self.long_region().is_some())) as u32
    }

    /// Returns the region that owns the corners of triangles to be subdivided, if there are any.
    pub fn long_region(&self) -> Option<u32> {
        (!self.long.is_empty()).then_some(self.regions.count() as u32)
    }

    /// Returns the region that owns a point at a position.
    pub fn owner(&self, place: Vec3) -> u32 {
        if !self.long.is_empty() && self.long.contains(&name(place)) {
            return self.regions.count() as u32;
        }
        self.regions.of(place)
    }

    fn is_cloud(&self) -> bool {
        self.facts.mesh.is_none()
    }
}

/// The items that a part of the input contributes to each region, in order.
struct Shares<T> {
    items: Vec<(u32, T)>,
    seen: u64,
}

/// Distributes what the `wanted` regions need of an input to files beside `path`, using up to
/// `memory` bytes. Regions have at most `most` points.
pub fn distribute(
    input: &Surveyed,
    wanted: &Range<u32>,
    [most, memory]: [u64; 2],
    path: &Path,
    watch: StageWatch<'_>,
) -> Result<Distributed> {
    let bins = wanted.len();
    let bin = |region: u32| region - wanted.start;
    let mut points = Bins::beside(path, bins, memory)?;
    let pieces = input.pieces_of(wanted);
    // Pieces have about equally many points.
    let total = input.stream.point_count() * pieces.len() as u64 / input.pieces().max(1) as u64;
    let mut done = 0;
    // Points at the same position count as one. Once a region is full, only the first at each
    // position is kept.
    let mut crowd = Crowd::new(input, most, wanted);
    input.stream.points_of(
        pieces,
        |batch| shares(input, wanted, batch),
        |shares| {
            done += shares.seen;
            tell(watch, Stage::Distributing, done.min(total), total);
            for (region, point) in shares.items {
                if crowd.takes(&mut points, bin(region), &point)? {
                    points.push(bin(region), point)?;
                }
            }
            Ok(())
        },
    )?;
    let mut triangles = None;
    if !input.is_cloud() {
        let mut bins = Bins::beside(path, bins, memory)?;
        let total = input.stream.counts().triangles;
        let mut done = 0;
        input.stream.triangles(
            |_, batch| (triangle_shares(input, wanted, batch), batch.len() as u64),
            |((corners, foreign), seen)| {
                done += seen;
                tell(watch, Stage::Distributing, done, total);
                corners
                    .into_iter()
                    .try_for_each(|(region, triangle)| bins.push(bin(region), triangle))?;
                foreign.into_iter().try_for_each(|(region, point)| points.push(bin(region), point))
            },
        )?;
        bins.settle()?;
        triangles = Some(bins);
    }
    points.settle()?;
    Ok(Distributed { points, triangles })
}

/// Returns the points of a part that the wanted regions own or, in a point cloud, have around
/// them.
fn shares(input: &Surveyed, wanted: &Range<u32>, points: &[StreamPoint]) -> Shares<StreamPoint> {
    let mut items = Vec::with_capacity(points.len() + points.len() / 8);
    let mut around = Vec::new();
    let mut add = |region: u32, point: &StreamPoint| {
        if wanted.contains(&region) {
            items.push((region, *point));
        }
    };
    for point in points {
        let place = Vec3::from(point.position);
        add(input.owner(place), point);
        if input.is_cloud() {
            input.regions.around(place, &mut around);
            around.iter().for_each(|&region| add(region, point));
        }
    }
    Shares { items, seen: points.len() as u64 }
}

type Owned<T> = Vec<(u32, T)>;

/// Returns the triangles of a part for every wanted region that owns a corner, and the corners that
/// this region does not own.
fn triangle_shares(
    input: &Surveyed,
    wanted: &Range<u32>,
    batch: &[[u32; 3]],
) -> (Owned<[u32; 3]>, Owned<StreamPoint>) {
    let mut triangles = Vec::with_capacity(batch.len() + batch.len() / 8);
    let mut foreign = Vec::new();
    for &triangle in batch {
        let owners = triangle.map(|vertex| input.owner(input.stream.position(vertex)));
        for (corner, &region) in owners.iter().enumerate() {
            if owners[..corner].contains(&region) || !wanted.contains(&region) {
                continue;
            }
            triangles.push((region, triangle));
            let others = triangle.iter().zip(owners).filter(|&(_, owner)| owner != region);
            foreign.extend(others.map(|(&vertex, _)| (region, input.stream.vertex(vertex))));
        }
    }
    (triangles, foreign)
}

/// How far a region may exceed its limit of points, as a factor.
const MOST_TIMES: usize = 4;

/// Keeps coincident points from filling a region of a point cloud.
struct Crowd<'a> {
    stream: &'a Stream<'a>,
    most: usize,
    is_cloud: bool,
    /// The bin of the region of triangles to be subdivided.
    long: Option<u32>,
    /// For each full region, the positions of points added since it was full.
    places: Vec<Option<HashSet<[u32; 3]>>>,
}

impl<'a> Crowd<'a> {
    fn new(input: &'a Surveyed<'_>, most: u64, wanted: &Range<u32>) -> Self {
        // Points around a region may double it.
        let most = usize::try_from(most).unwrap_or(usize::MAX).saturating_mul(2);
        let long = input.long_region().filter(|long| wanted.contains(long));
        Self {
            stream: &input.stream,
            most,
            is_cloud: input.is_cloud(),
            long: long.map(|long| long - wanted.start),
            places: vec![None; wanted.len()],
        }
    }

    /// Returns whether the region of a bin keeps a point.
    ///
    /// # Errors
    /// [`Error::Input`](crate::Error::Input) if too many points are too close together to be
    /// distinguished, compared with the distance to the farthest points.
    fn takes(
        &mut self,
        points: &mut Bins<StreamPoint>,
        bin: u32,
        point: &StreamPoint,
    ) -> Result<bool> {
        let held = points.count(bin);
        // The triangles to be subdivided are limited by memory, not by the points in a region.
        if held >= self.most.saturating_mul(MOST_TIMES) && Some(bin) != self.long {
            let message = format!(
                "more than {held} points lie within a two-millionth of the distance to the \
                 farthest ones, and do not fit in memory together"
            );
            return Err(self
                .stream
                .error("points", message)
                .hint("remove points that are far away, or allow more memory"));
        }
        if !self.is_cloud || held < self.most {
            return Ok(true);
        }
        Ok(self.places[bin as usize]
            .get_or_insert_default()
            .insert(name(Vec3::from(point.position))))
    }
}
