//! Which way up a surface stands, guessed from its shape.
//!
//! People see a thing the right way up if it rests as it would on a table. Fu, Cohen-Or, Dror and
//! Sheffer (2008, “Upright orientation of man-made objects”) therefore compare the poses in which a
//! shape is stable. They do so by the size of its base, by how far it may be tilted, by symmetry
//! and by how much of it is seen. This module does the same for the six directions of the
//! coordinate axes, because files are nearly always drawn or scanned along one of them. A pose is
//! judged by
//!
//! - its **base**: the convex hull of the lowest samples, as a share of the shadow from above;
//! - its **balance**: by how many degrees it may be tilted until the centre of mass leaves the
//!   base;
//! - its **feet**: three or more separate contacts that fill little of a base are legs, hooves or
//!   wheels, if they are as flat as feet are, not pointed as wings or fingers;
//! - **symmetry**: things that stand are alike on both sides of an upright plane, so the best of
//!   the three planes of symmetry contains the up axis;
//! - the **height** of its centre of mass, which lies low in stable poses;
//! - **openness**: the share of the samples that a viewer sees from around and above. An inverted
//!   bowl hides its inside, a table shows its underside to a viewer below its edge.
//!
//! Units, names and the order of vertices do not count. Hardly any file has +X or a negative axis
//! up, so these need three to four times the evidence for +Y and +Z, and ten times for flat sheets.
//! Things that are known well, such as scans of animals and furniture, have more than that.

use super::Mesh;
use crate::{
    about::Orientation,
    math::{
        hull::{Kind, area, depth_inside, hull, without_strays},
        neighbours::Neighbours,
    },
    parallel::prelude::*,
};
use glam::{DVec2, DVec3, Vec3};

/// The number of samples that a shape is judged by.
const SAMPLES: usize = 20_000;

/// The number of samples whose mirror images are compared with the shape.
const MIRRORED: usize = 1500;

/// Shares of the height up to which samples touch the ground: of a flat base, and of an uneven one.
const FLAT: f64 = 0.008;
const UNEVEN: f64 = 0.02;

/// A pose: the axis that is up, and its sign.
struct Pose {
    axis: usize,
    sign: f64,
    /// Everything but the openness, which takes the longest.
    score: f64,
}

/// A shape, as evenly spread samples relative to its centre of mass.
struct Shape {
    samples: Vec<DVec3>,
    low: DVec3,
    high: DVec3,
    /// How badly the shape's mirror images fit it, for mirrors across each axis, as a share of its
    /// diagonal.
    skew: [f64; 3],
}

impl Mesh {
    /// Guesses how the mesh or point cloud stands, from its shape alone: as it would rest on a
    /// table. Considers the six directions of the coordinate axes. Returns `None` for shapes that
    /// rest no better one way than the other, because they have no extent or are flat.
    ///
    /// The front is where an animal on four legs or a person on two looks, if the shape is one,
    /// else the convention's: −Y if Z is up, otherwise +Z. The time is linear in the number of
    /// vertices and triangles, and below 0.1 s for a million.
    ///
    /// Source: Fu, Cohen-Or, Dror & Sheffer (2008), with other measures of stability.
    pub fn guess_orientation(&self) -> Option<Orientation> {
        let _span = tracing::info_span!("orientation").entered();
        let samples = if self.triangles.is_empty() { self.thinned() } else { self.spread() };
        guess(samples)
    }

    /// Returns samples evenly spread over the area of the triangles.
    fn spread(&self) -> Vec<Vec3> {
        let corners = |triangle: &[u32; 3]| {
            let corner = |index: u32| self.positions.get(index as usize).copied();
            let [a, b, c] = triangle.map(corner);
            Some([a?, b?, c?]).filter(|corners| corners.iter().all(|corner| corner.is_finite()))
        };
        let size = |[a, b, c]: [Vec3; 3]| {
            let [a, b, c] = [a, b, c].map(|corner| corner.as_dvec3());
            0.5 * (b - a).cross(c - a).length()
        };
        let total: f64 = self.triangles.iter().filter_map(corners).map(size).sum();
        let step = total / SAMPLES as f64;
        if !(step > 0.0 && step.is_finite()) {
            return Vec::new();
        }
        let mut samples = Vec::with_capacity(SAMPLES + 1);
        let mut passed = 0.5 * step;
        for [a, b, c] in self.triangles.iter().filter_map(corners) {
            passed += size([a, b, c]);
            while passed >= step {
                passed -= step;
                // A sequence that fills the unit square evenly (Roberts 2018), folded into the
                // triangle.
                let number = samples.len() as f64 + 1.0;
                let [u, v] = [0.754_877_666, 0.569_840_291].map(|part| (number * part).fract());
                let [u, v] = if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] };
                samples.push(a + u as f32 * (b - a) + v as f32 * (c - a));
            }
        }
        samples
    }

    /// Returns points that are no denser in one place than in another, if there are many: one of
    /// each cell of a grid.
    fn thinned(&self) -> Vec<Vec3> {
        // The box is twice as long as the shape along each axis.
        const CELLS: usize = 192;
        let finite = || self.positions.iter().copied().filter(|point| point.is_finite());
        let Some([low, high]) = without_strays(&finite().collect::<Vec<_>>(), Kind::Measured)
        else {
            return Vec::new();
        };
        let size = (high - low).max_element().max(f32::MIN_POSITIVE) / CELLS as f32;
        let mut taken = vec![false; CELLS * CELLS * CELLS];
        let mut samples = Vec::new();
        for point in finite().filter(|p| p.cmpge(low).all() && p.cmple(high).all()) {
            let at = ((point - low) / size).to_array().map(|at| (at as usize).min(CELLS - 1));
            let cell = &mut taken[(at[2] * CELLS + at[1]) * CELLS + at[0]];
            if !std::mem::replace(cell, true) {
                samples.push(point);
            }
        }
        let step = samples.len().div_ceil(SAMPLES).max(1);
        samples.into_iter().step_by(step).collect()
    }
}

/// Guesses how evenly spread samples of a shape stand.
fn guess(samples: Vec<Vec3>) -> Option<Orientation> {
    let shape = Shape::new(samples)?;
    let poses: Vec<(usize, f64)> =
        (0..3).flat_map(|axis| [1.0, -1.0].map(|sign| (axis, sign))).collect();
    let judge = |(axis, sign): (usize, f64)| Pose { axis, sign, score: shape.score(axis, sign) };
    let mut poses: Vec<Pose> = poses.into_par_iter().map(judge).collect();
    poses.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut best: Option<(f64, usize, f64)> = None;
    for Pose { axis, sign, score } in poses {
        // Openness only lowers the score.
        if best.is_some_and(|(best, ..)| best >= score) {
            break;
        }
        let score = score * shape.openness(axis, sign).powi(4);
        if best.is_none_or(|(best, ..)| score > best) {
            best = Some((score, axis, sign));
        }
    }
    best.map(|(_, axis, sign)| {
        let usual = Orientation::with_up(sign * DVec3::AXES[axis]);
        Orientation { front: shape.front(axis, sign).unwrap_or(usual.front), ..usual }
    })
}

impl Shape {
    /// Returns `None` for shapes without extent, and for flat ones.
    fn new(samples: Vec<Vec3>) -> Option<Self> {
        const FEWEST: usize = 20;
        let [low, high] = without_strays(&samples, Kind::Measured)?;
        let near = |p: &Vec3| p.cmpge(low).all() && p.cmple(high).all();
        let samples: Vec<Vec3> = samples.into_iter().filter(near).collect();
        if samples.len() < FEWEST {
            return None;
        }
        let sum: DVec3 = samples.iter().map(|sample| sample.as_dvec3()).sum();
        let middle = (sum / samples.len() as f64).as_vec3();
        let samples: Vec<Vec3> = samples.into_iter().map(|sample| sample - middle).collect();
        let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let (low, high) = samples.iter().fold(none, |(low, high), p| (low.min(*p), high.max(*p)));
        let sides = high - low;
        if sides.min_element() < 1e-4 * sides.max_element() || !sides.is_finite() {
            return None;
        }
        let tree = Neighbours::new(&samples);
        let step = samples.len().div_ceil(MIRRORED);
        let skew = |axis: usize| {
            let apart = |sample: &Vec3| {
                let mut mirrored = *sample;
                mirrored[axis] = -mirrored[axis];
                tree.distance(mirrored).powi(2)
            };
            let chosen: Vec<&Vec3> = samples.iter().step_by(step).collect();
            let sum: f64 = chosen.par_iter().map(|sample| apart(sample)).sum();
            (sum / chosen.len() as f64).sqrt() / f64::from(sides.length())
        };
        let skew = [skew(0), skew(1), skew(2)];
        let samples: Vec<DVec3> = samples.iter().map(|sample| sample.as_dvec3()).collect();
        Some(Self { samples, low: low.as_dvec3(), high: high.as_dvec3(), skew })
    }

    /// Returns the heights above the ground and the places on the ground of all samples.
    fn above_ground(&self, axis: usize, sign: f64) -> impl Iterator<Item = (f64, DVec2)> + Clone {
        let ground = if sign > 0.0 { self.low[axis] } else { -self.high[axis] };
        let [u, v] = across(axis);
        self.samples.iter().map(move |p| (sign * p[axis] - ground, DVec2::new(p[u], p[v])))
    }

    /// Judges a pose by all measures but its openness.
    fn score(&self, axis: usize, sign: f64) -> f64 {
        let above = self.above_ground(axis, sign);
        let height = self.high[axis] - self.low[axis];
        let below = |share: f64| {
            let lowest = above.clone().filter(move |(up, _)| *up <= share * height);
            lowest.map(|(_, place)| place).collect::<Vec<DVec2>>()
        };
        let shadow = area(&hull(above.clone().map(|(_, place)| place).collect()));
        let touching = below(UNEVEN);
        let base = hull(touching.clone());
        let [flat, uneven] = [area(&hull(below(FLAT))), area(&base)].map(|size| size / shadow);
        if uneven.is_nan() || uneven <= 0.0 {
            return 0.0;
        }
        let center = if sign > 0.0 { -self.low[axis] } else { self.high[axis] };
        let tilt = depth_inside(&base, DVec2::ZERO).atan2(center).to_degrees();
        let balance = ((tilt + 2.0) / 17.0).clamp(0.02, 1.0);
        let feet = self.feet(&touching, shadow, uneven * shadow) * flat / uneven;
        let [u, v] = across(axis);
        let best = self.skew.iter().copied().fold(f64::INFINITY, f64::min);
        let symmetry = 1.0 / (1.0 + (self.skew[u].min(self.skew[v]) - best) / 0.02);
        let low = 1.0 - center / (self.high - self.low).length();
        let habit = self.habit(axis, sign);
        flat.sqrt() * balance * (1.0 + 3.0 * feet) * symmetry * low * habit
    }

    /// Returns how usual a direction is for up.
    fn habit(&self, axis: usize, sign: f64) -> f64 {
        let height = self.high[axis] - self.low[axis];
        // A flat sheet, such as a terrain, may be turned over without a difference.
        let is_sheet = height < 0.25 * (self.high - self.low).length();
        match (axis, sign > 0.0) {
            (1, true) => 1.0,
            (2, true) => 0.99,
            (0, true) => 0.3,
            _ if is_sheet => 0.1,
            _ => 0.25,
        }
    }

    /// Returns how much of a base is empty, if what touches the ground has three parts or more.
    fn feet(&self, touching: &[DVec2], shadow: f64, base: f64) -> f64 {
        // About one sample in each cell of a dense contact.
        let cells = 24.0 * (self.samples.len() as f64 / SAMPLES as f64).sqrt();
        let size = shadow.sqrt() / cells.max(6.0);
        let Some(contacts) = contacts(touching, size).filter(|contacts| contacts.len() > 2) else {
            return 0.0;
        };
        let filled = contacts.iter().sum::<usize>() as f64 * size * size;
        (1.0 - filled / base).max(0.0)
    }

    /// Returns the share of the samples that a viewer sees from above, or from two of sixteen
    /// places around. These are eight above the thing, eight a little below its middle, who do not
    /// see through the ground. Samples on the ground count as seen.
    fn openness(&self, axis: usize, sign: f64) -> f64 {
        let [u, v] = across(axis);
        let mut views = vec![(sign * DVec3::AXES[axis], 0.0)];
        for turn in 0..8 {
            let (sin, cos) = (f64::from(turn) * std::f64::consts::FRAC_PI_4).sin_cos();
            for elevation in [30.0f64, -12.0] {
                let (up, along) = elevation.to_radians().sin_cos();
                let mut direction = DVec3::ZERO;
                (direction[u], direction[v], direction[axis]) =
                    (along * cos, along * sin, sign * up);
                views.push((direction, (-up / along).max(0.0)));
            }
        }
        let seen: Vec<Vec<bool>> = views
            .into_par_iter()
            .map(|(toward, drop)| self.seen_from(toward, drop, (axis, sign)))
            .collect();
        let height = self.high[axis] - self.low[axis];
        let mut open = 0.0;
        for (index, (up, _)) in self.above_ground(axis, sign).enumerate() {
            let times = seen.iter().filter(|seen| seen[index]).count();
            open += if up <= UNEVEN * height { 1.0 } else { (0.5 * times as f64).min(1.0) };
        }
        open / self.samples.len() as f64
    }

    /// Returns which samples a viewer far away in the direction `toward` sees. A line to that
    /// viewer goes down by `drop` for each unit along the ground, and must leave the thing above
    /// the ground.
    fn seen_from(&self, toward: DVec3, drop: f64, (axis, sign): (usize, f64)) -> Vec<bool> {
        let cells = ((self.samples.len() as f64).sqrt() / 3.5).clamp(8.0, 40.0);
        let (right, up) = toward.any_orthonormal_pair();
        let middle = 0.5 * (self.high + self.low);
        let offsets = self
            .samples
            .iter()
            .map(|p| (*p - middle).dot(right).abs().max((*p - middle).dot(up).abs()));
        let reach = offsets.fold(0.0, f64::max);
        let size = 2.0 * reach / cells;
        let width = cells as usize + 2;
        let cell = |p: DVec3| {
            let p = p - middle;
            let at =
                |along: DVec3| (((p.dot(along) + reach) / size).max(0.0) as usize).min(width - 1);
            at(up) * width + at(right)
        };
        let mut nearest = vec![f64::NEG_INFINITY; width * width];
        for sample in &self.samples {
            let place = &mut nearest[cell(*sample)];
            *place = place.max(sample.dot(toward));
        }
        let [u, v] = across(axis);
        let flat = DVec2::new(toward[u], toward[v]).normalize_or_zero();
        let center = DVec2::new(middle[u], middle[v]);
        let radius =
            0.5 * DVec2::new(self.high[u] - self.low[u], self.high[v] - self.low[v]).length();
        let leaves = |(height, place): (f64, DVec2)| {
            // The rest of the way inside the circle around the thing.
            let place = place - center;
            let along = place.dot(flat);
            let rest = (radius * radius - place.length_squared() + along * along).max(0.0).sqrt();
            height > drop * (rest - along)
        };
        let above = self.above_ground(axis, sign);
        let pairs = self.samples.iter().zip(above);
        pairs
            .map(|(sample, above)| {
                sample.dot(toward) > nearest[cell(*sample)] - 1.3 * size
                    && (drop == 0.0 || leaves(above))
            })
            .collect()
    }
}

/// Returns the other two axes.
fn across(axis: usize) -> [usize; 2] {
    [(axis + 1) % 3, (axis + 2) % 3]
}

/// Returns the sizes of the connected contacts that touch these places on the ground, in cells of
/// this size; `None` for no place, or for far too many cells.
fn contacts(touching: &[DVec2], size: f64) -> Option<Vec<usize>> {
    let low = touching.iter().copied().reduce(DVec2::min)?;
    let high = touching.iter().copied().reduce(DVec2::max)?;
    let cell = |place: DVec2| ((place - low) / size).as_usizevec2();
    let last = cell(high);
    if last.max_element() > 4096 {
        return None;
    }
    let (width, rows) = (last.x + 3, last.y + 3);
    let mut is_touched = vec![false; width * rows];
    for place in touching {
        let at = cell(*place);
        is_touched[(at.y + 1) * width + at.x + 1] = true;
    }
    Some(parts(&mut is_touched, width))
}

/// Returns the sizes of the connected parts of a grid with an empty border, and empties it.
fn parts(grid: &mut [bool], width: usize) -> Vec<usize> {
    let mut sizes = Vec::new();
    let mut open = Vec::new();
    for start in 0..grid.len() {
        if !std::mem::replace(&mut grid[start], false) {
            continue;
        }
        let mut size = 0;
        open.push(start);
        while let Some(at) = open.pop() {
            size += 1;
            for row in [at - width, at, at + width] {
                for (next, is_set) in (row - 1..).zip(&mut grid[row - 1..=row + 1]) {
                    if std::mem::replace(is_set, false) {
                        open.push(next);
                    }
                }
            }
        }
        sizes.push(size);
    }
    sizes
}

mod front;
#[cfg(test)]
mod tests;
