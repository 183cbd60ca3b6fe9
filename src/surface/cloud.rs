//! Surfels of a point cloud: the plane and the spacing of each point come from its nearest
//! neighbours. Points on no surface are rods: balls or discs.

use super::{
    Mesh, PointStyle, SurfelOptions,
    ellipse::{Tensor, factor},
    opacity::{Absorbed, share_of},
    orient::{Known, orient},
    paint::{of_normal, pack, point_color},
    planar::{COUNT, Nearest, is_flat_of_few, off_surface, scatter},
};
use crate::{
    Result,
    deadline::Clock,
    facet::{Facet, REACH, Relief, Rod, Size},
    math::{eigen, lower, neighbours::Neighbours, sets::Sets},
    memory,
    parallel::prelude::*,
    splat::{NO_NORMAL, Splat, encode_normal},
};
use glam::{DVec3, Vec3};
use std::{collections::HashMap, f32::consts::PI};

/// Standard deviation of a surfel, in units of the median distance to the neighbours. On a square
/// grid of points that is 1.2 spacings, and 0.39 would be enough; the rest is for irregular point
/// clouds.
const SPREAD: f32 = 0.45;
/// A point is drawn at most this many times as wide as its neighbours, measured by their own
/// neighbours. In correct data the spacing changes gradually.
const WIDER: f32 = 2.0;
/// A point is isolated if its neighbours are this many times as far from it as from their own
/// neighbours.
const LONE: f32 = 4.0;
/// No point is drawn more than this many times as wide as the median one. Scanners sample distant
/// surfaces this much more coarsely than near ones.
const LARGEST: f32 = 16.0;

/// A patch is some neighbouring points whose spacing is more than this many times the median one.
/// One of fewer than [`FEWEST_IN_PATCH`] points is no surface far from a scanner, but strays: its
/// points are drawn as wide as the median one.
const COARSE: f32 = 3.0;
const FEWEST_IN_PATCH: usize = 50;

/// The name of this module's work in errors.
const WORK: &str = "finding the neighbours of points";
/// Bytes of temporary memory per point: the tree, its neighbourhood, the edges of the graph that
/// orients normals, and its surfel.
const OF_POINT: u64 = 344;

/// The radius of a ball, as a part of the usual distance of points on no surface from their nearest
/// neighbours: they nearly touch.
const BALL: f32 = 0.45;
/// The least radius of points of automatic size, and of those whose size is one of the world, in
/// pixels.
const LEAST_PIXELS: [f32; 2] = [1.0, 0.5];

/// The neighbourhood of a point.
#[derive(Default)]
struct Surroundings {
    /// Median distance to the neighbours; 0 without any.
    distance: f32,
    /// The area that the point stands for, in squares of that distance.
    area: f32,
    /// Unit normal of the plane of the neighbours, of either sign; zero if they define none.
    normal: Vec3,
    /// The direction in which the neighbours are furthest apart, and the ratio to the extent across
    /// it, at most 2.
    long: Vec3,
    stretch: f32,
    /// Points at the place of this one, which counts too.
    crowd: u8,
    /// Distance to the nearest neighbour.
    first: f32,
    /// The neighbours lie on a plane.
    is_flat: bool,
}

/// What a cloud is drawn as.
#[derive(Default)]
pub(super) struct Parts {
    /// The surfels of the points on surfaces.
    pub surfels: Vec<Splat>,
    /// The other points, which are rods.
    pub dots: Vec<Facet>,
}

/// Makes surfels in the order of the points. Of points that coincide, only the first produces one.
///
/// # Errors
/// [`Error::Timeout`](crate::Error::Timeout) and [`Error::Memory`](crate::Error::Memory).
pub(super) fn surfels(mesh: &Mesh, options: &SurfelOptions) -> Result<Vec<Splat>> {
    let judged = Judged::new(mesh, Known::default(), options)?;
    Ok(judged.places.par_iter().map(|&place| judged.surfel(place as usize, options)).collect())
}

/// Makes the surfels of the points on surfaces and the rods of the others, as the options say, each
/// in the order of the points. Where some point is not opaque, all are surfels: rods are opaque.
///
/// # Errors
/// Those of [`surfels`].
pub(super) fn parts(mesh: &Mesh, options: &SurfelOptions) -> Result<Parts> {
    let judged = Judged::new(mesh, Known::default(), options)?;
    let wants = |place: u32| judged.dots.off[place as usize];
    let is_opaque = |&place: &u32| {
        let color = point_color(mesh, judged.kept[place as usize] as usize);
        options.absorbed(color[3], || 1.0).alpha == 1.0
    };
    let (dots, others): (Vec<u32>, Vec<u32>) =
        match judged.places.par_iter().all(|place| !wants(*place) || is_opaque(place)) {
            true => judged.places.iter().partition(|&&place| wants(place)),
            false => (Vec::new(), judged.places.clone()),
        };
    options.deadline.check(WORK)?;
    Ok(Parts {
        surfels: others.par_iter().map(|&at| judged.surfel(at as usize, options)).collect(),
        dots: dots.par_iter().map(|&at| judged.rod(at as usize, options).into()).collect(),
    })
}

/// Makes the surfels of the wanted points, and returns them with their indices. `known` refers to
/// points by index.
pub(super) fn some_surfels(
    mesh: &Mesh,
    options: &SurfelOptions,
    known: Known,
    is_wanted: impl Fn(usize) -> bool + Sync,
) -> Result<Vec<(u32, Splat)>> {
    let judged = Judged::new(mesh, known, options)?;
    let wanted = judged.places.par_iter().map(|&place| place as usize);
    let wanted = wanted.filter(|&place| is_wanted(judged.kept[place] as usize));
    Ok(wanted.map(|place| (judged.kept[place], judged.surfel(place, options))).collect())
}

/// Returns the normals of all points, without those that the file has: those of the planes of their
/// neighbours, turned to one side. A normal is zero where there is no plane.
pub(super) fn normals(mesh: &Mesh, options: &SurfelOptions) -> Result<Vec<Vec3>> {
    let judged = Judged::new(mesh, Known::default(), options)?;
    let mut normals = vec![Vec3::ZERO; mesh.positions.len()];
    for (index, normal) in judged.kept.iter().zip(&judged.normals) {
        normals[*index as usize] = *normal;
    }
    let first = Neighbours::first_of_equals(&mesh.positions);
    Ok(first.into_iter().map(|first| normals[first as usize]).collect())
}

/// Results for the points at different positions, in an order in which neighbours are close to each
/// other.
struct Judged<'a> {
    mesh: &'a Mesh,
    /// The rank of each point in that order.
    places: Vec<u32>,
    /// The index of each in the mesh.
    kept: Vec<u32>,
    points: Vec<Vec3>,
    around: Vec<Surroundings>,
    spacing: Vec<f32>,
    lone: Vec<bool>,
    normals: Vec<Vec3>,
    free: Vec<bool>,
    dots: Dots,
}

/// The points that are drawn as rods, because they lie on no surface.
struct Dots {
    /// Whether each point is one.
    off: Vec<bool>,
    /// The usual distance from the nearest neighbour around each; empty if no point is a rod.
    gaps: Vec<f32>,
    /// The size of a pixel where pixels have none: that of a picture of the whole cloud.
    pixel: f32,
}

impl<'a> Judged<'a> {
    fn new(mesh: &'a Mesh, mut known: Known, options: &SurfelOptions) -> Result<Self> {
        let deadline = options.deadline;
        memory::room(WORK, OF_POINT.saturating_mul(mesh.positions.len() as u64))?;
        let first = Neighbours::first_of_equals(&mesh.positions);
        let kept: Vec<u32> = (0..)
            .zip(first)
            .filter(|&(index, first)| index == first)
            .map(|(index, _)| index)
            .collect();
        let points: Vec<Vec3> =
            kept.par_iter().map(|&index| mesh.positions[index as usize]).collect();
        deadline.check(WORK)?;
        let tree = Neighbours::new(&points);
        // From here on everything is in the tree's order, in which neighbours are close in memory
        // too.
        let order = tree.order();
        let mut places = vec![0u32; points.len()];
        order.iter().zip(0..).for_each(|(&point, place)| places[point as usize] = place);
        let clock = Clock::new(deadline);
        let surroundings = |place: usize, crowd: usize| {
            let is_over = clock.is_over(place);
            if is_over {
                Default::default()
            } else {
                surroundings(&points, &tree, [order[place], crowd as u32], &places)
            }
        };
        let judge = |crowd: usize| -> (Vec<Nearest>, Vec<Surroundings>) {
            let of = |place| surroundings(place, crowd);
            (0..order.len()).into_par_iter().map(of).unzip()
        };
        let (mut nearest, mut around) = judge(1);
        let crowd = crowd(&around);
        if crowd > 1 {
            tracing::info!(crowd, "points lie close together; these are taken as one place");
            (nearest, around) = judge(crowd);
        }
        clock.finish(WORK)?;
        drop(tree);
        let points: Vec<Vec3> = order.par_iter().map(|&point| points[point as usize]).collect();
        // Normals are dropped for points that coincide with an earlier one.
        known.normals.retain_mut(|(index, _)| {
            let renumbered = kept.binary_search(index).map(|point| *index = places[point]);
            renumbered.is_ok()
        });
        let kept: Vec<u32> = order.into_par_iter().map(|point| kept[point as usize]).collect();
        let (spacing, lone) = spacings(&around, &nearest, known.spacing);
        report(mesh.positions.len() - points.len(), &lone);
        let mut normals: Vec<Vec3> = around.par_iter().map(|around| around.normal).collect();
        let free = settle_known(mesh, &kept, &mut normals);
        if free.par_iter().any(|&free| free) {
            deadline.check(WORK)?;
            orient(&points, &spacing, &nearest, &free, &known, &mut normals);
        }
        deadline.check(WORK)?;
        let dots = Dots::new(mesh, (&points, &nearest, &around), &kept, &spacing, options)?;
        Ok(Self { mesh, places, kept, points, around, spacing, lone, normals, free, dots })
    }

    /// Makes the rod of the point at a rank in the order: a ball, or a disc that faces the eye.
    fn rod(&self, at: usize, options: &SurfelOptions) -> Rod {
        let index = self.kept[at] as usize;
        let [radius, pixels] = self.radius(at, options);
        let given = self.mesh.given_normal(index);
        let [red, green, blue, _] = match (options.color_by_normal, given) {
            (true, Some(normal)) => pack(of_normal(encode_normal(normal))).to_le_bytes(),
            _ => pack(point_color(self.mesh, index)).to_le_bytes(),
        };
        let ball = Rod::ball(self.points[at], radius, [red, green, blue]);
        let is_flat = options.points == PointStyle::Dots;
        let relief = if is_flat { Relief::Flat(given) } else { Relief::Round };
        Rod { pixels, relief, ..ball }
    }

    /// Makes the splat that stands for a point's rod where only splats are drawn.
    fn round_splat(&self, at: usize, options: &SurfelOptions) -> Splat {
        let [mut radius, pixels] = self.radius(at, options);
        if radius == 0.0 {
            radius = pixels * self.dots.pixel;
        }
        let mut color = point_color(self.mesh, self.kept[at] as usize);
        let Absorbed { strength, alpha } = options.absorbed(color[3], || 1.0);
        color[3] = alpha;
        let width = f64::from((radius / REACH).max(f32::MIN_POSITIVE));
        Splat {
            center: self.points[at].to_array(),
            strength,
            factor: lower([DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * width)),
            color: pack(color),
            normal: NO_NORMAL,
        }
    }

    /// Returns the radius of a point's rod in world units, and the least one in pixels.
    fn radius(&self, at: usize, options: &SurfelOptions) -> [f32; 2] {
        let [automatic, least] = LEAST_PIXELS;
        let given = self.mesh.radii.get(self.kept[at] as usize);
        let [radius, pixels] = match (given.filter(|radius| radius.is_finite()), options.point_size)
        {
            (Some(radius), _) => [radius.max(0.0), least],
            (None, Some(Size::World(size))) => [0.5 * size, least],
            (None, Some(Size::Pixels(size))) => [0.0, 0.5 * size],
            (None, None) => [BALL * self.dots.gaps[at], automatic],
        };
        [radius * options.radius_scale, pixels * options.radius_scale.min(1.0)]
    }

    /// Makes the surfel of the point at a rank in the order.
    fn surfel(&self, at: usize, options: &SurfelOptions) -> Splat {
        if self.dots.off[at] {
            return self.round_splat(at, options);
        }
        // Points with spacings near the smallest float still have a width.
        let width =
            f64::from((self.spacing[at] * SPREAD * options.radius_scale).max(f32::MIN_POSITIVE));
        // The plane of an isolated point's neighbours is not its own.
        let known = !self.lone[at] || !self.free[at];
        let normal =
            Some(self.normals[at].as_dvec3()).filter(|normal| known && *normal != DVec3::ZERO);
        let packed = normal.map_or(NO_NORMAL, |normal| encode_normal(normal.as_vec3()));
        let mut color = match options.color_by_normal {
            true => of_normal(packed),
            false => point_color(self.mesh, self.kept[at] as usize),
        };
        // Surfels made narrower show as dots of the surface's opacity.
        let wider = options.radius_scale.max(1.0).powi(2);
        let share = || share_of(self.around[at].area, SPREAD * SPREAD * wider);
        let Absorbed { strength, alpha } = options.absorbed(color[3], share);
        color[3] = alpha;
        Splat {
            center: self.points[at].to_array(),
            strength,
            factor: shape(&self.around[at], width, normal),
            color: pack(color),
            normal: packed,
        }
    }
}

impl Dots {
    fn new(
        mesh: &Mesh,
        (points, nearest, around): (&[Vec3], &[Nearest], &[Surroundings]),
        kept: &[u32],
        spacing: &[f32],
        options: &SurfelOptions,
    ) -> Result<Self> {
        let is_sized = options.point_size.is_some() || !mesh.radii.is_empty();
        let off = match options.points {
            PointStyle::Surfels => vec![false; points.len()],
            PointStyle::Auto if !is_sized => {
                let is_flat: Vec<bool> = around.par_iter().map(|around| around.is_flat).collect();
                let has_normal = |at: usize| mesh.given_normal(kept[at] as usize).is_some();
                off_surface(points, nearest, &is_flat, has_normal, options.deadline, WORK)?
            }
            PointStyle::Auto | PointStyle::Spheres | PointStyle::Dots => vec![true; points.len()],
        };
        let count = off.par_iter().filter(|off| **off).count();
        if count > 0 && options.points == PointStyle::Auto {
            tracing::info!(count, "points lie on no surface; they are drawn as balls");
        }
        let gaps = if count > 0 { gaps(around, nearest, spacing) } else { Vec::new() };
        let diagonal = mesh.local_bounds().map_or(0.0, |[low, high]| low.distance(high));
        Ok(Self { off, gaps, pixel: diagonal * Size::PIXEL })
    }
}

/// Returns the usual distance from the nearest neighbour around each point.
fn gaps(around: &[Surroundings], nearest: &[Nearest], spacing: &[f32]) -> Vec<f32> {
    let gap = |(at, nearest): (usize, &Nearest)| {
        let mut others = nearest.map(|index| around[index as usize].first);
        let usual = *others.select_nth_unstable_by(COUNT / 2, f32::total_cmp).1;
        // Points that coincide have no distance.
        if usual > 0.0 { usual.min(spacing[at]) } else { 0.5 * spacing[at] }
    };
    nearest.par_iter().enumerate().map(gap).collect()
}

/// Returns the spacing around each point, and which points are isolated. An isolated point takes
/// the spacing of its neighbours, and one of a small patch the median spacing. `typical` is about
/// the median spacing, if known.
fn spacings(
    around: &[Surroundings],
    nearest: &[Nearest],
    typical: Option<f32>,
) -> (Vec<f32>, Vec<bool>) {
    let median = || {
        let mut distances: Vec<f32> = around.par_iter().map(|around| around.distance).collect();
        let middle = distances.len() / 2;
        if distances.is_empty() {
            0.0
        } else {
            *distances.select_nth_unstable_by(middle, f32::total_cmp).1
        }
    };
    let typical = typical.unwrap_or_else(median);
    // A single point has no scale of its own. It becomes a ball of about unit diameter.
    let typical = if typical > 0.0 { typical } else { 0.5 };
    let (mut spacing, lone): (Vec<f32>, Vec<bool>) = around
        .par_iter()
        .zip(nearest)
        .map(|(point, nearest)| {
            let mut others = nearest.map(|index| around[index as usize].distance);
            let usual = *others.select_nth_unstable_by(COUNT / 2, f32::total_cmp).1;
            let lone = point.distance > usual * LONE;
            let distance = if lone { usual } else { point.distance.min(usual * WIDER) };
            (if distance > 0.0 { distance.min(typical * LARGEST) } else { typical }, lone)
        })
        .unzip();
    for at in in_small_patches(&spacing, nearest, typical * COARSE) {
        spacing[at as usize] = typical;
    }
    (spacing, lone)
}

/// Returns the points of small patches: of fewer than [`FEWEST_IN_PATCH`] points that are joined by
/// being neighbours, and whose spacing is above `coarse`.
fn in_small_patches(spacing: &[f32], nearest: &[Nearest], coarse: f32) -> Vec<u32> {
    let is_coarse = |at: u32| spacing[at as usize] > coarse;
    let mut found: Vec<u32> =
        (0..spacing.len() as u32).into_par_iter().filter(|&at| is_coarse(at)).collect();
    // A cloud this small shows too little.
    if found.is_empty() || spacing.len() < FEWEST_IN_PATCH {
        return Vec::new();
    }
    let mut patches = Sets::new(spacing.len());
    for &at in &found {
        for &other in nearest[at as usize].iter().filter(|&&other| is_coarse(other)) {
            patches.join(at, other);
        }
    }
    let mut sizes = HashMap::new();
    for &at in &found {
        *sizes.entry(patches.root(at)).or_insert(0usize) += 1;
    }
    found.retain(|&at| sizes[&patches.root(at)] < FEWEST_IN_PATCH);
    found
}

/// Sets the normals that the file has, and turns normals towards the scanner that saw the point.
/// Returns which normals are still free to be turned.
fn settle_known(mesh: &Mesh, kept: &[u32], normals: &mut [Vec3]) -> Vec<bool> {
    let mut free: Vec<bool> = normals
        .par_iter_mut()
        .zip(kept)
        .map(|(normal, &index)| {
            let given = mesh.given_normal(index as usize);
            *normal = given.unwrap_or(*normal);
            given.is_none()
        })
        .collect();
    normals.par_iter_mut().zip(&mut free).zip(kept).filter(|((_, free), _)| **free).for_each(
        |((normal, free), &index)| {
            let at = mesh.sensors.partition_point(|sensor| sensor.points.start <= index as usize);
            let sensor = at.checked_sub(1).map(|at| &mesh.sensors[at]);
            if let Some(sensor) = sensor.filter(|sensor| sensor.points.contains(&(index as usize)))
            {
                let sight = sensor.position - mesh.positions[index as usize];
                *normal = if normal.dot(sight) < 0.0 { -*normal } else { *normal };
                *free = false;
            }
        },
    );
    free
}

fn report(coincident: usize, lone: &[bool]) {
    let lone = lone.par_iter().filter(|&&lone| lone).count();
    if coincident > 0 {
        tracing::info!(coincident, "points at the position of another point are left out");
    }
    if lone > 0 {
        tracing::info!(lone, "points far from all others are drawn no wider than their neighbours");
    }
}

/// Returns the factor of a point's surfel: a disc in the plane of its normal, stretched along the
/// direction in which the neighbours are further apart. Without a normal it is a ball.
fn shape(around: &Surroundings, width: f64, normal: Option<DVec3>) -> [f32; 6] {
    let Some(normal) = normal else {
        return lower([DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * width));
    };
    let long = around.long.as_dvec3();
    let x = (long - normal * normal.dot(long))
        .try_normalize()
        .unwrap_or_else(|| normal.any_orthonormal_vector());
    let (variance, stretch) = (width * width, f64::from(around.stretch));
    let tensor = Tensor { xx: variance * stretch, xy: 0.0, yy: variance / stretch };
    factor(tensor, x, normal.cross(x), normal)
}

/// Two points lie at one place if their distance is at most this part of that to the farthest
/// neighbour. Of points on a surface by chance, one in ten has such a neighbour.
const SAME_PLACE: f32 = 0.1;

/// Returns how many points lie at the place of a point: usually 1. Scans that were registered and
/// joined have several, within their noise. The median counts, so that a few do not matter.
fn crowd(around: &[Surroundings]) -> usize {
    let mut crowds: Vec<u8> = around.par_iter().map(|around| around.crowd).collect();
    let middle = crowds.len() / 2;
    if crowds.is_empty() { 1 } else { usize::from(*crowds.select_nth_unstable(middle).1).max(1) }
}

/// Computes the neighbourhood of a point; `places` gives the ranks of its neighbours. If several
/// points make a `crowd` at one place, so many times as many neighbours are looked at, and only the
/// last of each crowd counts for distances.
fn surroundings(
    points: &[Vec3],
    tree: &Neighbours,
    [index, crowd]: [u32; 2],
    places: &[u32],
) -> (Nearest, Surroundings) {
    let crowd = crowd as usize;
    let neighbours = tree.of(index, COUNT * crowd);
    let center = points[index as usize];
    let offsets =
        || neighbours.iter().map(|&(_, index)| (points[index as usize] - center).as_dvec3());
    let (values, axes) = eigen(scatter(offsets));
    let [large, middle, _] = values;
    let is_plane = middle > large * 1e-4;
    let mut nearest = [places[index as usize]; COUNT];
    let last = neighbours.last().map_or(0.0, |&(distance, _)| distance);
    let same =
        neighbours.iter().take_while(|&&(distance, _)| distance <= SAME_PLACE * last).count();
    nearest
        .iter_mut()
        .zip(neighbours.iter().skip(crowd - 1).step_by(crowd))
        .for_each(|(slot, &(_, index))| *slot = places[index as usize]);
    let distance = neighbours.get(neighbours.len() / 2).map_or(0.0, |&(distance, _)| distance);
    let around = Surroundings {
        distance,
        area: area(&neighbours, distance, crowd),
        crowd: same as u8 + 1,
        first: neighbours.get(crowd - 1).map_or(0.0, |&(distance, _)| distance),
        is_flat: is_flat_of_few(values),
        normal: if is_plane { axes[2].as_vec3() } else { Vec3::ZERO },
        long: axes[0].as_vec3(),
        stretch: if is_plane { (large / middle).sqrt().min(2.0) as f32 } else { 1.0 },
    };
    (nearest, around)
}

/// The neighbours by which the area of a point is measured: those around the median one.
const MEASURED: std::ops::Range<usize> = 4..8;

/// Returns the area that a point stands for, in squares of a distance. If points lie on a surface
/// by chance, the disc that reaches to the nth neighbour has n times the area of a point in the
/// mean. On a grid the mean over a few neighbours is right within a few hundredths.
fn area(neighbours: &[(f32, u32)], unit: f32, crowd: usize) -> f32 {
    let discs = (1..).zip(neighbours).skip(MEASURED.start * crowd).take(MEASURED.len() * crowd);
    let discs = discs.map(|(n, &(distance, _))| PI * (distance / unit).powi(2) / n as f32);
    let (count, sum) = discs.fold((0u32, 0.0), |(count, sum), disc| (count + 1, sum + disc));
    // Too few points to measure: as on a square grid.
    if count > 0 && unit > 0.0 { sum / count as f32 } else { 0.5 }
}

#[cfg(test)]
mod tests;
