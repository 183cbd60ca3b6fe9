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
use std::{collections::HashSet, path::Path};

/// An input split into regions. Each region owns its points, and also holds those around them. In a
/// mesh, the last region owns the corners of triangles to be subdivided, wherever they are.
pub struct Distributed<'a> {
    pub input: Surveyed<'a>,
    pub points: Bins<StreamPoint>,
    pub triangles: Option<Bins<[u32; 3]>>,
    /// Distance from the centre of the core to the farthest point.
    pub radius: f64,
}

impl Surveyed<'_> {
    /// Returns the number of regions that own points.
    pub fn regions(&self) -> usize {
        self.regions.count() + usize::from(self.long_region().is_some())
    }

    /// Returns the region that owns the corners of triangles to be subdivided, if there are any.
    pub fn long_region(&self) -> Option<u32> {
        let has_long = self.mesh.as_ref().is_some_and(|mesh| !mesh.long.is_empty());
        has_long.then_some(self.regions.count() as u32)
    }

    /// Returns the region that owns a point at a position.
    pub fn owner(&self, place: Vec3) -> u32 {
        match &self.mesh {
            Some(mesh) if !mesh.long.is_empty() && mesh.long.contains(&name(place)) => {
                self.regions.count() as u32
            }
            _ => self.regions.of(place),
        }
    }
}

/// The items that a part of the input contributes to each region, in order.
struct Shares<T> {
    items: Vec<(u32, T)>,
    seen: u64,
    radius: f64,
}

/// Distributes an input to files beside `wanted`, in regions of at most `most` points, using up to
/// `memory` bytes.
pub fn distribute<'a>(
    input: Surveyed<'a>,
    [most, memory]: [u64; 2],
    wanted: &Path,
    watch: StageWatch<'_>,
) -> Result<Distributed<'a>> {
    let bins = input.regions();
    let mut points = Bins::beside(wanted, bins, memory)?;
    let mut radius = 0.0f64;
    let total = input.stream.point_count();
    let mut done = 0;
    // Points at the same position count as one. Once a region is full, only the first at each
    // position is kept.
    let mut crowd = Crowd::new(&input, most);
    let share = |found: &[StreamPoint]| shares(&input, found);
    input.stream.points(share, |shares| {
        radius = radius.max(shares.radius);
        done += shares.seen;
        tell(watch, Stage::Distributing, done, total);
        for (region, point) in shares.items {
            if crowd.takes(&mut points, region, &point)? {
                points.push(region, point)?;
            }
        }
        Ok(())
    })?;
    let mut triangles = None;
    if input.mesh.is_some() {
        let mut bins = Bins::beside(wanted, bins, memory)?;
        let total = input.stream.counts().triangles;
        let mut done = 0;
        input.stream.triangles(
            |_, found| (triangle_shares(&input, found), found.len() as u64),
            |((corners, foreign), seen)| {
                done += seen;
                tell(watch, Stage::Distributing, done, total);
                corners
                    .into_iter()
                    .try_for_each(|(region, triangle)| bins.push(region, triangle))?;
                foreign.into_iter().try_for_each(|(region, point)| points.push(region, point))
            },
        )?;
        bins.settle()?;
        triangles = Some(bins);
    }
    points.settle()?;
    Ok(Distributed { input, points, triangles, radius })
}

/// Returns the points of a part with their owners and, for a point cloud, with the regions around
/// them.
fn shares(input: &Surveyed, found: &[StreamPoint]) -> Shares<StreamPoint> {
    let mut items = Vec::with_capacity(found.len() + found.len() / 8);
    let mut around = Vec::new();
    let mut radius = 0.0f64;
    for point in found {
        let place = Vec3::from(point.position);
        radius = radius.max(place.as_dvec3().distance(input.core.center));
        items.push((input.owner(place), *point));
        if input.mesh.is_none() {
            input.regions.around(place, &mut around);
            items.extend(around.iter().map(|&region| (region, *point)));
        }
    }
    Shares { items, seen: found.len() as u64, radius }
}

type Owned<T> = Vec<(u32, T)>;

/// Returns the triangles of a part for every region that owns a corner, and the corners that this
/// region does not own.
fn triangle_shares(input: &Surveyed, found: &[[u32; 3]]) -> (Owned<[u32; 3]>, Owned<StreamPoint>) {
    let mut triangles = Vec::with_capacity(found.len() + found.len() / 8);
    let mut foreign = Vec::new();
    for &triangle in found {
        let owners = triangle.map(|vertex| input.owner(input.stream.position(vertex)));
        for (corner, &region) in owners.iter().enumerate() {
            if owners[..corner].contains(&region) {
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
    /// The region of triangles to be subdivided.
    long: Option<u32>,
    /// For each full region, the positions of points added since it was full.
    places: Vec<Option<HashSet<[u32; 3]>>>,
}

impl<'a> Crowd<'a> {
    fn new(input: &'a Surveyed<'_>, most: u64) -> Self {
        // Points around a region may double it.
        let most = usize::try_from(most).unwrap_or(usize::MAX).saturating_mul(2);
        let places = vec![None; input.regions()];
        Self {
            stream: &input.stream,
            most,
            is_cloud: input.mesh.is_none(),
            long: input.long_region(),
            places,
        }
    }

    /// Returns whether a region keeps a point.
    ///
    /// # Errors
    /// [`Error::Input`](crate::Error::Input) if too many points are too close together to be
    /// distinguished, compared with the distance to the farthest points.
    fn takes(
        &mut self,
        points: &mut Bins<StreamPoint>,
        region: u32,
        point: &StreamPoint,
    ) -> Result<bool> {
        let held = points.count(region);
        // The triangles to be subdivided are limited by memory, not by the points in a region.
        if held >= self.most.saturating_mul(MOST_TIMES) && Some(region) != self.long {
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
        Ok(self.places[region as usize]
            .get_or_insert_default()
            .insert(name(Vec3::from(point.position))))
    }
}
