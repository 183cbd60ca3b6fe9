//! Lines of a mesh as rods: tubes with round joints and ends.

use super::{
    Mesh, SurfelOptions,
    paint::{pack, point_color},
};
use crate::{
    Result,
    facet::{Facet, FacetSet, Relief, Rod, Size},
    memory,
    parallel::prelude::*,
};
use glam::Vec3;

/// Longer segments are cut, in diagonals of the mesh: the tiles and sheets that a long rod meets
/// are more than those that it fills.
const LONGEST: f32 = 1.0 / 40.0;

/// Most rods that cutting adds, unless as many as the segments are more.
const MOST: usize = 1 << 21;

/// The least radius of lines whose width is one of the world, in pixels.
const LEAST_PIXELS: f32 = 0.5;

/// The name of this module's work in errors.
const WORK: &str = "making tubes";

impl Mesh {
    /// Makes rods of the lines: tubes of [`line_width`](SurfelOptions::line_width), with round
    /// joints and ends, in the colours of the vertices. Long segments are cut. Segments between
    /// vertices at one place are left out unless nothing else is there. Returns `None` for a mesh
    /// without lines.
    ///
    /// # Errors
    /// As [`surfels`](Self::surfels).
    pub fn line_rods(&self, options: &SurfelOptions) -> Result<Option<FacetSet>> {
        if self.lines.is_empty() {
            return Ok(None);
        }
        let _span = tracing::info_span!("lines").entered();
        self.check(options)?;
        let place = |end: u32| self.positions[end as usize];
        let [low, high] = self.local_bounds().unwrap_or_default();
        let longest = LONGEST * low.distance(high);
        let parts = |longest: f32, [a, b]: [u32; 2]| {
            let parts = place(a).distance(place(b)) / longest;
            // NaN, from a mesh without a size, gives one.
            if parts > 1.0 { parts.ceil().min(1e6) as usize } else { 1 }
        };
        let count =
            |longest: f32| self.lines.par_iter().map(|line| parts(longest, *line)).sum::<usize>();
        let most = MOST.max(2 * self.lines.len());
        let mut longest = longest;
        while count(longest) > most {
            longest *= 2.0;
        }
        memory::room(WORK, (size_of::<Facet>() * count(longest)) as u64)?;
        let way = |[a, b]: [u32; 2]| (place(b) - place(a)).normalize_or_zero();
        let rods = (0..self.lines.len()).into_par_iter().flat_map_iter(|number| {
            let line = self.lines[number];
            // Neighbours in the list are neighbours of a line if they share a vertex.
            let neighbour = |other: Option<usize>| {
                let other = *self.lines.get(other?)?;
                Some((other, way(other))).filter(|(_, way)| *way != Vec3::ZERO)
            };
            let before = neighbour(number.checked_sub(1)).filter(|([_, end], _)| *end == line[0]);
            let after = neighbour(Some(number + 1)).filter(|([start, _], _)| *start == line[1]);
            let (direction, parts) = (way(line), parts(longest, line));
            let is_whole = direction != Vec3::ZERO;
            let before = before.filter(|_| is_whole).map(|(_, way)| way);
            let joints = (before, is_whole && after.is_some());
            self.cut_line(line, (direction, parts), joints, options)
        });
        let rods: Vec<Facet> = rods.collect();
        options.deadline.check(WORK)?;
        Ok(Some(FacetSet::of_rods(self.origin, rods)))
    }

    /// Returns the rods of a segment in a direction, cut into parts. `joints` are those of the
    /// whole segment ([`Rod::joints`]).
    fn cut_line(
        &self,
        [a, b]: [u32; 2],
        (way, parts): (Vec3, usize),
        joints: (Option<Vec3>, bool),
        options: &SurfelOptions,
    ) -> impl Iterator<Item = Facet> {
        let (radius, pixels) = match options.line_width.unwrap_or(SurfelOptions::LINE_WIDTH) {
            Size::World(width) => (0.5 * width, LEAST_PIXELS),
            Size::Pixels(width) => (0.0, 0.5 * width),
        };
        let [from, to] = [a, b].map(|end| self.positions[end as usize]);
        let colors =
            [a, b].map(|end| point_color(self, end as usize).map(|part| part.clamp(0.0, 1.0)));
        let at = move |part: usize| {
            let share = part as f32 / parts as f32;
            let place: Vec3 = if part == parts { to } else { from + (to - from) * share };
            let [from, to] = colors;
            let mixed = [0, 1, 2, 3].map(|i| from[i] + (to[i] - from[i]) * share);
            let [red, green, blue, _] = pack(mixed).to_le_bytes();
            (place, [red, green, blue])
        };
        (0..parts).map(move |part| {
            let [(a, from), (b, to)] = [at(part), at(part + 1)];
            let rod = Rod {
                ends: [a, b],
                radii: [radius; 2],
                pixels,
                colors: [from, to],
                relief: Relief::Round,
                joints: (
                    if part == 0 { joints.0 } else { Some(way) },
                    part + 1 < parts || joints.1,
                ),
            };
            rod.into()
        })
    }
}
