//! Points that span what a picture shows of a scene, for cameras that are fitted to it.

use super::{
    Clip, Item, Scene,
    specks::{means_around, take_specks},
};
use crate::{
    Result,
    bricks::{Bricks, Level},
    cells::Tetrahedra,
    facet::FacetSet,
    gaussians::{Eye, Gaussians},
    hierarchy::{
        Hierarchy,
        file::{Page, there},
        needed::coarsest,
    },
    math::hull::{Kind, outermost, without_strays},
    parallel::prelude::*,
    splat::{SampleSplats, Splat, Surfels, TRAINED_OPACITIES},
    volume::{Lattice, TransferFunction, Volume, steps::Steps},
    warning,
};
use glam::{DVec3, Vec3};
use std::collections::HashSet;

/// How far a splat is seen from its centre, in standard deviations.
const REACH: f32 = 1.5;

/// Most pages of a hierarchy that are read. If there are more, its coarse nodes stand for it.
const MOST_PAGES: usize = 64;

/// Most samples of a volume that are looked at. Of larger volumes, some rows are left out.
const MOST_SAMPLES: usize = 1 << 24;

/// The share of the visible samples that may be lost on each side of a volume, as noise.
const NOISE: f64 = 0.001;

/// A block of samples is seen if it absorbs this share of the light that passes through it.
const FAINT: f64 = 0.1;

/// A fainter block is seen if it is part of a haze: a tenth of the volume's diagonal, filled with
/// the mean of the blocks around it, has this optical depth. Dust and veils have less.
const FAINT_HAZE: f64 = 0.15;

/// The blocks around a block reach one part in so many of the longest side, in each direction.
const AROUND: usize = 24;

/// The optical depth of a block of samples that is opaque.
const OPAQUE: f64 = 3.0;

impl Scene {
    /// Returns points, in world coordinates, that span what a picture shows of the scene. Of
    /// splats, these are the outermost ones and their reach; of volumes and cells, the outermost
    /// samples that the transfer function shows.
    /// [`Camera::fit_points`](crate::math::Camera::fit_points) makes them fill a picture.
    ///
    /// A few splats far away from all others are left out, with a warning that counts them. These
    /// are on each side up to a thousandth beyond half the size of the rest, a hundredth beyond 4
    /// diagonals, and a twentieth beyond 20 diagonals. Of trained scenes the background too, a
    /// fifth beyond 1.5 diagonals if it lies all around.
    ///
    /// So are specks of a volume apart from the rest, up to a thousandth of what is seen. Dust and
    /// veils that take less than about a tenth of the light are too, unless all is that faint.
    ///
    /// The time is linear in the number of splats and samples; of large hierarchies and bricks only
    /// coarse levels are read. If an item shows nothing, or the clips remove it, the corners of its
    /// box stand for it.
    ///
    /// # Errors
    /// Those of reading pages and bricks.
    pub fn seen(&self, clips: &[Clip]) -> Result<Vec<DVec3>> {
        let _span = tracing::info_span!("seen").entered();
        let mut points = Vec::new();
        for (number, item) in self.items.iter().enumerate() {
            let kind = if item.is_trained() { Kind::Trained } else { Kind::Measured };
            let spread = |points: &[Vec3], origin| near(points, kind, number, origin);
            let pose = self.view_pose(number);
            // A box that is cut out of a turned item is left out of the question.
            let clips = &pose.clips(clips).unwrap_or_default();
            let outermost = match item {
                Item::Radiance(set) => of_splats(set.origin, &set.splats, |_| true, clips, spread),
                Item::Scalar(set, transfer) => of_samples(set, transfer, clips, spread),
                Item::Facets(set) => of_facets(set, clips, number),
                // Its facets end at the clips.
                Item::Solid(solid) => of_facets(&solid.facets(clips), &[], number),
                Item::Gaussians(set) => of_gaussians(set, clips, spread),
                Item::Hierarchy(hierarchy) => {
                    let set = coarse(hierarchy)?;
                    of_splats(set.origin, &set.splats, |_| true, clips, spread)
                }
                Item::Cells(cells, transfer) => of_cells(cells, transfer, clips),
                Item::Volume(volume, _, transfer) => of_volume(volume, transfer, clips),
                Item::Bricks(bricks, _, transfer) => {
                    of_volume(&bricks.volume_there(overview(bricks))?, transfer, clips)
                }
            };
            points.extend(outermost.into_iter().map(|point| pose.apply(point)));
        }
        if points.is_empty() {
            points.extend((0..self.items.len()).flat_map(|item| self.bounds_of(item).corners()));
        }
        Ok(points)
    }
}

/// Returns the corners of the box around points that belong together ([`without_strays`]). Warns if
/// others lie farther away, which the picture may not show.
fn near(points: &[Vec3], kind: Kind, item: usize, origin: DVec3) -> Option<[Vec3; 2]> {
    let [low, high] = without_strays(points, kind)?;
    let middle = 0.5 * (low + high);
    let is_left = |point: &&Vec3| !(point.cmpge(low).all() && point.cmple(high).all());
    let left = points.iter().filter(is_left);
    let away = |point: &Vec3| point.distance(middle);
    let (count, farthest) = left.fold((0usize, None), |(count, farthest), &point| {
        let is_farther = farthest.is_none_or(|known| away(&point) > away(&known));
        (count + 1, if is_farther { Some(point) } else { farthest })
    });
    // What lies just outside is in the picture, or nearly.
    let farthest = farthest.filter(|point| away(point) > 2.0 * low.distance(high));
    if let Some(point) = farthest {
        let [x, y, z] = (origin + point.as_dvec3()).as_vec3().to_array();
        let (all, item, lie) = (points.len(), item + 1, if count == 1 { "lies" } else { "lie" });
        warning::give!(
            "input {item}: {count} of {all} splats {lie} far from the others, outside of what the \
             camera is fitted to; the farthest is at {x}, {y}, {z}"
        );
    }
    Some([low, high])
}

/// Returns the outermost of the splats that `shows` chooses, with their reach. `near` returns the
/// corners of the box around those that belong together.
fn of_splats(
    origin: DVec3,
    splats: &[Splat],
    shows: impl Fn(&Splat) -> bool,
    clips: &[Clip],
    near: impl Fn(&[Vec3], DVec3) -> Option<[Vec3; 2]>,
) -> Vec<DVec3> {
    let world = |point: Vec3| origin + point.as_dvec3();
    let kept = |point: Vec3| clips.iter().all(|clip| clip.keeps(world(point)));
    let visible = splats.iter().filter(|splat| shows(splat) && kept(Vec3::from(splat.center)));
    let mut splats: Vec<&Splat> = visible.collect();
    let mut centers: Vec<Vec3> = splats.iter().map(|splat| Vec3::from(splat.center)).collect();
    let Some([low, high]) = near(&centers, origin) else { return Vec::new() };
    let is_near = |center: &Vec3| center.cmpge(low).all() && center.cmple(high).all();
    splats.retain(|splat| is_near(&Vec3::from(splat.center)));
    centers.retain(is_near);
    let reach = |index: u32| {
        let (center, reach) =
            (centers[index as usize], REACH * splats[index as usize].deviations());
        [(Vec3::X, reach.x), (Vec3::Y, reach.y), (Vec3::Z, reach.z)]
            .into_iter()
            .flat_map(move |(axis, reach)| [center - reach * axis, center + reach * axis])
    };
    outermost(&centers).into_iter().flat_map(reach).map(world).collect()
}

/// Returns the outermost of the Gaussians that can be seen, with their reach.
fn of_gaussians(
    set: &Gaussians,
    clips: &[Clip],
    near: impl Fn(&[Vec3], DVec3) -> Option<[Vec3; 2]>,
) -> Vec<DVec3> {
    let splats = set.seen_from(Eye::Along(DVec3::Z)).splats;
    let shows = |splat: &Splat| f64::from(-splat.strength) >= TRAINED_OPACITIES[0];
    of_splats(set.origin, &splats, shows, clips, near)
}

/// Returns the outermost corners of facets.
fn of_facets(set: &FacetSet, clips: &[Clip], item: usize) -> Vec<DVec3> {
    if set.rods.is_some() {
        return of_rods(set, clips, item);
    }
    let world = |point: Vec3| set.origin + point.as_dvec3();
    let kept = |point: &Vec3| clips.iter().all(|clip| clip.keeps(world(*point)));
    let corners = set.facets.iter().flat_map(|facet| facet.corners.map(Vec3::from));
    let mut corners: Vec<Vec3> = corners.filter(kept).collect();
    let near = near(&corners, Kind::Modelled, item, set.origin);
    let Some([low, high]) = near else { return Vec::new() };
    corners.retain(|corner| corner.cmpge(low).all() && corner.cmple(high).all());
    outermost(&corners).into_iter().map(|index| world(corners[index as usize])).collect()
}

/// Returns the outermost ends of rods, with their radii, and corners of the triangles beside them.
fn of_rods(set: &FacetSet, clips: &[Clip], item: usize) -> Vec<DVec3> {
    let world = |point: Vec3| set.origin + point.as_dvec3();
    let places = set.facets.iter().flat_map(|facet| {
        let [a, b, c] = facet.corners.map(Vec3::from);
        // The second end of a ball is that of the first.
        let count = if !facet.is_rod() { 3 } else { 1 + usize::from(a != b) };
        let radius = if facet.is_rod() { c.x.max(c.y) } else { 0.0 };
        [a, b, c].into_iter().take(count).map(move |place| (place, radius))
    });
    let kept = |point: Vec3| clips.iter().all(|clip| clip.keeps(world(point)));
    let (mut places, mut radii): (Vec<Vec3>, Vec<f32>) =
        places.filter(|(place, _)| kept(*place)).unzip();
    let near = near(&places, Kind::Measured, item, set.origin);
    let Some([low, high]) = near else { return Vec::new() };
    let is_near = |place: Vec3| place.cmpge(low).all() && place.cmple(high).all();
    let mut each = places.iter().map(|place| is_near(*place));
    radii.retain(|_| each.next().unwrap_or(false));
    places.retain(|place| is_near(*place));
    let reach = |index: u32| {
        let (place, radius) = (places[index as usize], radii[index as usize]);
        [Vec3::X, Vec3::Y, Vec3::Z]
            .into_iter()
            .flat_map(move |axis| [place - radius * axis, place + radius * axis])
    };
    outermost(&places).into_iter().flat_map(reach).map(world).collect()
}

/// Returns the outermost samples that a transfer function shows.
fn of_samples(
    set: &SampleSplats,
    transfer: &TransferFunction,
    clips: &[Clip],
    near: impl Fn(&[Vec3], DVec3) -> Option<[Vec3; 2]>,
) -> Vec<DVec3> {
    let values = set.splats.iter().map(|splat| f64::from(splat.strength));
    let sides = Sides::of(transfer, values);
    let shows = |splat: &Splat| sides.show(transfer, f64::from(splat.strength));
    of_splats(set.origin, &set.splats, shows, clips, near)
}

/// Returns the outermost corners of the tetrahedra that a transfer function shows.
fn of_cells(cells: &Tetrahedra, transfer: &TransferFunction, clips: &[Clip]) -> Vec<DVec3> {
    let mut is_seen = vec![false; cells.points.len()];
    for (number, corners) in cells.corners.iter().enumerate() {
        if transfer.visible(cells.range_of(number)) {
            corners.iter().for_each(|corner| is_seen[*corner as usize] = true);
        }
    }
    let world = |point: Vec3| cells.origin + point.as_dvec3();
    let kept = |point: Vec3| clips.iter().all(|clip| clip.keeps(world(point)));
    let seen =
        cells.points.iter().zip(is_seen).filter(|(point, is_seen)| *is_seen && kept(**point));
    let seen: Vec<Vec3> = seen.map(|(point, _)| *point).collect();
    outermost(&seen).into_iter().map(|index| world(seen[index as usize])).collect()
}

/// Returns the leaves of a hierarchy, or, if it has many pages, the nodes of its coarse pages.
fn coarse(hierarchy: &Hierarchy) -> Result<Surfels> {
    if hierarchy.page_count() as usize <= MOST_PAGES
        && let Some(leaves) = there(hierarchy.leaves())?
    {
        return Ok(leaves);
    }
    let read: Vec<u32> =
        coarsest(hierarchy, MOST_PAGES)?.into_iter().map(|needed| needed.page).collect();
    let pages = hierarchy.read_there(&read)?;
    let mut known: HashSet<u32> = read.iter().copied().collect();
    let mut pages: Vec<(u32, Page)> =
        read.iter().zip(pages).filter_map(|(number, page)| Some((*number, page?))).collect();
    if hierarchy.is_in_parts() {
        let are_there: HashSet<u32> = pages.iter().map(|(number, _)| *number).collect();
        let closed = hierarchy.closed(read, |page| are_there.contains(&page))?;
        known = closed.into_iter().collect();
        pages.retain(|(number, _)| known.contains(number));
    }
    if pages.is_empty() {
        // Not even the root has come.
        hierarchy.read_page(0)?;
    }
    let of_page = |(_, page): &(u32, Page)| {
        let last = |at: &usize| !known.contains(&page.child_pages[*at]);
        let nodes = (0..page.nodes.len()).filter(last);
        nodes.map(|at| page.nodes[at].splat).collect::<Vec<Splat>>()
    };
    let pages: Vec<Vec<Splat>> = pages.par_iter().map(of_page).collect();
    let header = hierarchy.header();
    Ok(Surfels { origin: header.origin, splats: pages.concat(), extent: header.extent })
}

/// Returns the finest level of bricks that is read quickly, or the coarsest.
fn overview(bricks: &Bricks) -> usize {
    const QUICK: usize = 1 << 22;
    let is_quick = |level: &Level| level.dims.iter().product::<usize>() <= QUICK;
    bricks.levels().iter().position(is_quick).unwrap_or(bricks.levels().len() - 1)
}

/// For each isosurface, its value and whether the values above it are the fewer: those inside.
struct Sides(Vec<(f64, bool)>);

impl Sides {
    fn of(transfer: &TransferFunction, values: impl Iterator<Item = f64> + Clone) -> Self {
        let side = |value: f64| {
            let (all, above) = values.clone().fold((0usize, 0usize), |(all, above), v| {
                (all + 1, above + usize::from(v >= value))
            });
            (value, 2 * above <= all)
        };
        Self(transfer.isosurfaces.iter().map(|surface| side(surface.value)).collect())
    }

    /// Returns whether a sample of this value is shown, or lies inside an isosurface.
    fn show(&self, transfer: &TransferFunction, value: f64) -> bool {
        let inside = |&(surface, above): &(f64, bool)| (value >= surface) == above;
        transfer.opacity(value) > 0.0 || self.0.iter().any(inside)
    }
}

/// Returns the extinction of values from one to another: that of the first, unless the function is
/// clear at both and shows something between.
fn extinction_in(transfer: &TransferFunction, [from, to]: [f64; 2]) -> f64 {
    let first = transfer.extinction(from);
    if first > 0.0 || transfer.extinction(to) > 0.0 {
        return first;
    }
    let inside = transfer.opacity.iter().filter(|(value, _)| (from..to).contains(value));
    inside.map(|&(value, _)| transfer.extinction(value)).fold(0.0, f64::max)
}

/// The rows of a volume that are looked at, and what is seen in them.
struct Rows<'a> {
    volume: &'a Volume,
    clips: &'a [Clip],
    steps: Steps,
    /// The extinction of samples in each step of 1/255 of the range; infinite inside isosurfaces.
    extinction: [f32; 256],
    /// The extinction of each label of a label map, from the smallest on.
    of_labels: Vec<f32>,
    /// Only every so many rows and slices are looked at.
    stride: usize,
    /// The share of what is seen that may be noise, on each side.
    noise: f64,
    /// Whether anything is seen in each block of 4 × 4 × 4 of the samples that are looked at.
    blocks: Vec<bool>,
}

/// Samples along each side of a block.
const BLOCK: usize = 4;

/// Returns the outermost samples of a volume that its transfer function shows.
fn of_volume(volume: &Volume, transfer: &TransferFunction, clips: &[Clip]) -> Vec<DVec3> {
    let rows = Rows::new(volume, transfer, clips);
    let Some(limits) = rows.limits() else { return Vec::new() };
    let lattice = &volume.lattice;
    let middle = lattice.position(lattice.step_range().center());
    let ends = rows.ends(&limits);
    let places: Vec<Vec3> = ends
        .iter()
        .map(|&index| (lattice.position(lattice.steps(index)) - middle).as_vec3())
        .collect();
    let half = |index: [usize; 3]| 0.5 * (rows.stride as f64).min(2.0) * lattice.unit(index);
    let reach = |at: u32| {
        let index = ends[at as usize];
        let (steps, half) = (lattice.steps(index), half(index));
        DVec3::AXES.into_iter().flat_map(move |axis| {
            [lattice.position(steps - half * axis), lattice.position(steps + half * axis)]
        })
    };
    outermost(&places).into_iter().flat_map(reach).collect()
}

/// Returns which blocks of a volume are seen, from their mean extinctions: those from the first
/// limit on, and others where the mean of the blocks around them is above the second.
fn seen_blocks(means: &[f32], dims: [usize; 3], limits: [f64; 2]) -> Vec<bool> {
    // What is fainter is seen only if nothing is more opaque.
    let most = means.iter().copied().fold(0.0, f32::max);
    let [least, haze] = limits.map(|limit| (limit as f32).min(0.05 * most));
    let around = means_around(means, dims, dims[0].max(dims[1]).max(dims[2]) / AROUND);
    let is_seen = |(&mean, &around): (&f32, &f32)| mean > 0.0 && (mean >= least || around >= haze);
    means.iter().zip(&around).map(is_seen).collect()
}

impl<'a> Rows<'a> {
    fn new(volume: &'a Volume, transfer: &TransferFunction, clips: &'a [Clip]) -> Self {
        let [low, high] = volume.range;
        let value = |step: usize| low + (high - low) * step as f64 / 255.0;
        let mut rows = Self {
            volume,
            clips,
            steps: Steps::new(volume.samples.scalar(), volume.range),
            extinction: [0.0; 256],
            of_labels: Vec::new(),
            stride: 1,
            // Each sample of a label map is meant.
            noise: if volume.is_label_map() { 0.0 } else { NOISE },
            blocks: Vec::new(),
        };
        let [nx, ny, nz] = volume.lattice.dims;
        while nx * ny.div_ceil(rows.stride) * nz.div_ceil(rows.stride) > MOST_SAMPLES {
            rows.stride += 1;
        }
        let sides = rows.sides(transfer);
        for step in 0..256 {
            let inside = |&(surface, above): &(f64, bool)| (value(step) >= surface) == above;
            let extinction = extinction_in(transfer, [value(step), value(step + 1)]) as f32;
            rows.extinction[step] =
                if sides.0.iter().any(inside) { f32::INFINITY } else { extinction };
        }
        if volume.is_label_map() {
            let count = (high - low) as usize + 1;
            rows.of_labels =
                (0..count).map(|at| transfer.extinction(low + at as f64) as f32).collect();
        }
        let (means, dims) = (rows.block_means(), rows.block_dims());
        let diagonal = volume.bounds().diagonal();
        let side = diagonal * BLOCK as f64 / nx.max(ny).max(nz) as f64;
        rows.blocks = if rows.noise > 0.0 {
            seen_blocks(&means, dims, [FAINT / side, FAINT_HAZE / (0.1 * diagonal)])
        } else {
            means.iter().map(|mean| *mean > 0.0).collect()
        };
        // More than what makes a block opaque does not count.
        let weights: Vec<f32> = means.iter().map(|mean| mean.min((OPAQUE / side) as f32)).collect();
        take_specks(&mut rows.blocks, dims, &weights, rows.noise);
        rows
    }

    /// Returns the numbers of blocks along the axes.
    fn block_dims(&self) -> [usize; 3] {
        let [nx, ny, nz] = self.volume.lattice.dims;
        let blocks_along = |count: usize| count.div_ceil(self.stride).div_ceil(BLOCK);
        [nx.div_ceil(BLOCK), blocks_along(ny), blocks_along(nz)]
    }

    /// Writes the extinctions of a row of samples, from sample number `first` on. `scratch` is as
    /// long as the row.
    fn write(&self, first: usize, scratch: &mut [[u8; 2]], row: &mut [f32]) {
        if self.of_labels.is_empty() {
            let samples = self.volume.samples.bytes();
            self.steps.write(self.steps.from(samples, first), scratch);
            for (extinction, [step, _]) in row.iter_mut().zip(scratch) {
                *extinction = self.extinction[usize::from(*step)];
            }
            return;
        }
        for (at, extinction) in row.iter_mut().enumerate() {
            let label = self.volume.value(first + at) - self.volume.range[0];
            *extinction = self.of_labels[label as usize];
        }
    }

    /// Returns the mean extinction of each block: single samples of noise are lost in it.
    fn block_means(&self) -> Vec<f32> {
        let [nx, ny, nz] = self.volume.lattice.dims;
        let [columns, lines, layers] = self.block_dims();
        let of_layer = |layer: usize| {
            let mut sums = vec![0.0f32; columns * lines];
            let (mut scratch, mut row) = (vec![[0u8; 2]; nx], vec![0.0; nx]);
            let slices = (layer * BLOCK..(layer + 1) * BLOCK).map(|k| k * self.stride);
            for k in slices.filter(|k| *k < nz) {
                for j in (0..ny).step_by(self.stride) {
                    self.write((k * ny + j) * nx, &mut scratch, &mut row);
                    let line = &mut sums[j / self.stride / BLOCK * columns..][..columns];
                    for (sum, samples) in line.iter_mut().zip(row.chunks(BLOCK)) {
                        *sum += samples.iter().sum::<f32>();
                    }
                }
            }
            sums
        };
        let layers: Vec<Vec<f32>> = (0..layers).into_par_iter().map(of_layer).collect();
        let count = (BLOCK * BLOCK * BLOCK) as f32;
        layers.concat().into_iter().map(|sum| sum / count).collect()
    }

    /// Returns, for each isosurface, which side of it is inside.
    fn sides(&self, transfer: &TransferFunction) -> Sides {
        if transfer.isosurfaces.is_empty() {
            return Sides(Vec::new());
        }
        let volume = self.volume;
        let step = volume.len().div_ceil(1 << 20);
        Sides::of(transfer, (0..volume.len()).step_by(step).map(|index| volume.value(index)))
    }

    /// Visits the seen samples of every row of a slice that is looked at.
    fn visit(&self, k: usize, mut visit: impl FnMut([usize; 3])) {
        let [nx, ny, _] = self.volume.lattice.dims;
        let [columns, lines, _] = self.block_dims();
        let (mut scratch, mut row) = (vec![[0u8; 2]; nx], vec![0.0; nx]);
        for j in (0..ny).step_by(self.stride) {
            let [line, layer] = [j, k].map(|at| at / self.stride / BLOCK);
            let blocks = &self.blocks[(layer * lines + line) * columns..][..columns];
            if !blocks.contains(&true) {
                continue;
            }
            self.write((k * ny + j) * nx, &mut scratch, &mut row);
            for (block, samples) in row.chunks(BLOCK).enumerate().filter(|(at, _)| blocks[*at]) {
                for (at, _) in samples.iter().enumerate().filter(|(_, sample)| **sample > 0.0) {
                    let index = [block * BLOCK + at, j, k];
                    if self.is_kept(index) {
                        visit(index);
                    }
                }
            }
        }
    }

    fn is_kept(&self, index: [usize; 3]) -> bool {
        let lattice: &Lattice = &self.volume.lattice;
        self.clips.is_empty() || {
            let place = lattice.position(lattice.steps(index));
            self.clips.iter().all(|clip| clip.keeps(place))
        }
    }

    /// Returns the slices that are looked at.
    fn slices(&self) -> Vec<usize> {
        (0..self.volume.lattice.dims[2]).step_by(self.stride).collect()
    }

    /// Returns the first and the last index along each axis between which nearly all of the seen
    /// samples lie, with a tenth more on each side; `None` if none is seen.
    fn limits(&self) -> Option<[[usize; 2]; 3]> {
        let dims = self.volume.lattice.dims;
        let count = |k: &usize| {
            let mut counts = [0, 1, 2].map(|axis| vec![0u64; dims[axis]]);
            self.visit(*k, |index| (0..3).for_each(|axis| counts[axis][index[axis]] += 1));
            counts
        };
        let add = |mut sum: [Vec<u64>; 3], other: [Vec<u64>; 3]| {
            for (sum, other) in sum.iter_mut().zip(other) {
                sum.iter_mut().zip(other).for_each(|(sum, other)| *sum += other);
            }
            sum
        };
        let none = || [0, 1, 2].map(|axis| vec![0u64; dims[axis]]);
        let slices = self.slices();
        let counts = slices.par_iter().map(count).reduce(none, add);
        let total: u64 = counts[0].iter().sum();
        if total == 0 {
            return None;
        }
        let most = (total as f64 * self.noise) as u64;
        Some([0, 1, 2].map(|axis| {
            let passed = |counts: &mut dyn Iterator<Item = (usize, &u64)>| {
                let mut sum = 0;
                let mut beyond = counts.skip_while(|(_, count)| {
                    sum += **count;
                    sum <= most
                });
                beyond.next().map_or(0, |(at, _)| at)
            };
            let first = passed(&mut counts[axis].iter().enumerate());
            let last = passed(&mut counts[axis].iter().enumerate().rev());
            let slack = (last - first).div_ceil(10);
            [first.saturating_sub(slack), last + slack]
        }))
    }

    /// Returns the first and the last seen sample of each row, between limits.
    fn ends(&self, limits: &[[usize; 2]; 3]) -> Vec<[usize; 3]> {
        let is_within = |index: &[usize; 3]| {
            index.iter().zip(limits).all(|(at, [first, last])| first <= at && at <= last)
        };
        let of_slice = |k: &usize| {
            let mut ends: Vec<[usize; 3]> = Vec::new();
            self.visit(*k, |index| {
                if !is_within(&index) {
                    return;
                }
                match ends[..] {
                    // The third sample of a row replaces the second.
                    [.., [_, a, _], [_, b, _]] if a == index[1] && b == index[1] => {
                        ends.pop();
                    }
                    _ => {}
                }
                ends.push(index);
            });
            ends
        };
        let slices = self.slices();
        slices.par_iter().map(of_slice).collect::<Vec<_>>().concat()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        math::{Bounds, ClipShape, Kernel},
        surface::{Mesh, SurfelOptions},
        volume::{Isosurface, Samples},
    };

    fn ends(points: &[DVec3]) -> Bounds {
        points
            .iter()
            .fold(Bounds::EMPTY, |all, &point| all.union(Bounds { min: point, max: point }))
    }

    /// A ball of radius 9 in a box of 32 samples along each side, and some noise in a corner.
    fn ball() -> Volume {
        let at = |index: usize| {
            DVec3::new((index % 32) as f64, (index / 32 % 32) as f64, (index / 1024) as f64)
        };
        let value = |index: usize| {
            let is_noise = index == 31 * 1024 + 40;
            let ball = 9.0 - at(index).distance(DVec3::new(12.0, 13.0, 14.0));
            if is_noise { 90 } else { (20.0 * ball.max(0.0)) as u8 }
        };
        let lattice = Lattice::with_spacing([32; 3], DVec3::ONE);
        let volume = Volume::new(lattice, Samples::U8((0..32 * 1024).map(value).collect()));
        volume.unwrap()
    }

    fn visible_bounds(transfer: TransferFunction, clips: &[Clip]) -> Bounds {
        ends(&Scene::new().with_volume(ball(), Kernel::default(), transfer).seen(clips).unwrap())
    }

    #[test]
    fn what_a_transfer_function_shows_is_seen() {
        let opaque = |low: f64| TransferFunction {
            opacity: vec![(low, 0.0), (low + 1.0, 0.9)],
            ..TransferFunction::default()
        };
        let all = visible_bounds(opaque(0.0), &[]);
        assert!((all.min - DVec3::new(3.0, 4.0, 5.0)).abs().max_element() < 1.1, "{all:?}");
        assert!((all.max - DVec3::new(21.0, 22.0, 23.0)).abs().max_element() < 1.1, "{all:?}");
        let inner = visible_bounds(opaque(100.0), &[]);
        assert!((inner.max - DVec3::new(16.0, 17.0, 18.0)).abs().max_element() < 1.1, "{inner:?}");
        let surface = Isosurface { value: 100.0, color: [1.0; 3], opacity: 1.0 };
        let only = TransferFunction {
            opacity: vec![(0.0, 0.0)],
            isosurfaces: vec![surface],
            ..TransferFunction::default()
        };
        let surface = visible_bounds(only, &[]);
        assert!((surface.max - inner.max).abs().max_element() < 1.1, "{surface:?}");
        let shape = ClipShape::HalfSpace { normal: DVec3::X, offset: 12.0 };
        let half = visible_bounds(opaque(0.0), &[Clip { shape, inside: true }]);
        assert!((half.max.x - 12.5).abs() < 0.6 && half.max.y > 14.0, "{half:?}");
        // If nothing is seen, the box is.
        assert!(visible_bounds(opaque(300.0), &[]).max.x > 31.0);
    }

    /// A volume of 64 samples a side: an opaque ball in a corner, and values elsewhere.
    fn seen_beside_a_ball(value: impl Fn(DVec3) -> u8) -> Bounds {
        let at = |index: usize| {
            DVec3::new((index % 64) as f64, (index / 64 % 64) as f64, (index / 4096) as f64)
        };
        let is_ball = |place: DVec3| place.distance(DVec3::splat(44.0)) < 12.0;
        let sample = |index| if is_ball(at(index)) { 200 } else { value(at(index)) };
        let lattice = Lattice::with_spacing([64; 3], DVec3::ONE);
        let samples = Samples::U8((0..64 * 4096).map(sample).collect());
        let transfer = TransferFunction {
            opacity: vec![(0.0, 0.0), (200.0, 0.8)],
            ..TransferFunction::default()
        };
        let volume = Volume::new(lattice, samples).unwrap();
        ends(&Scene::new().with_volume(volume, Kernel::default(), transfer).seen(&[]).unwrap())
    }

    #[test]
    fn dust_and_veils_are_left_out_and_thin_things_are_not() {
        let ball = seen_beside_a_ball(|_| 0);
        assert!((ball.min - DVec3::splat(32.0)).abs().max_element() < 1.1, "{ball:?}");
        // Dust: one sample in some hundreds, all over the volume. A veil: a slice of 1 % opacity.
        let dust = |place: DVec3| (31.0 * place.x + 17.0 * place.y + 7.0 * place.z) % 383.0 < 1.0;
        let dusty = seen_beside_a_ball(|place| if dust(place) { 15 } else { 0 });
        let veiled = seen_beside_a_ball(|place| if place.x < 2.0 { 2 } else { 0 });
        for bounds in [dusty, veiled] {
            let far = (bounds.min - ball.min).abs().max((bounds.max - ball.max).abs());
            assert!(far.max_element() < 1.1, "{bounds:?}");
        }
        // An antenna of one sample, spray of eight samples a drop, and fog of 1 % opacity.
        let is_antenna = |place: DVec3| place.x == 44.0 && place.y == 44.0;
        let antenna = seen_beside_a_ball(|place| if is_antenna(place) { 200 } else { 0 });
        assert!(antenna.min.z < 2.1, "{antenna:?}");
        let is_drop = |place: DVec3| (place % 16.0).max_element() < 2.0;
        let spray = seen_beside_a_ball(|place| if is_drop(place) { 200 } else { 0 });
        let fog = seen_beside_a_ball(|_| 4);
        for bounds in [spray, fog] {
            assert!(bounds.min.max_element() < 2.1, "{bounds:?}");
        }
    }

    #[test]
    fn splats_far_away_are_left_out() {
        let mut mesh = Mesh::sphere(4);
        let count = mesh.positions.len();
        let options = SurfelOptions::default();
        let seen = |mesh: &Mesh| {
            ends(&Scene::new().with_splats(mesh.surfels(&options).unwrap()).seen(&[]).unwrap())
        };
        let whole = seen(&mesh);
        assert!((whole.diagonal() - 12f64.sqrt()).abs() < 0.05, "{whole:?}");
        mesh.triangles.clear();
        let points = seen(&mesh);
        assert!((points.diagonal() - 12f64.sqrt()).abs() < 0.4, "{points:?}");
        mesh.positions.extend((0..count / 1000).map(|n| Vec3::splat(50.0 + n as f32)));
        assert!((seen(&mesh).diagonal() - points.diagonal()).abs() < 0.1);
        // So are more of them, if they lie much farther away.
        let few = mesh.positions.len();
        mesh.positions.extend((0..count / 150).map(|n| Vec3::splat(80.0 + n as f32)));
        assert!((seen(&mesh).diagonal() - points.diagonal()).abs() < 0.1);
        // What is nearer, or substantial, is a part of the scene.
        mesh.positions.truncate(few);
        mesh.positions.extend((0..count / 150).map(|n| Vec3::splat(5.0 + 0.01 * n as f32)));
        assert!(seen(&mesh).diagonal() > 8.0);
        mesh.positions.truncate(few);
        mesh.positions.extend((0..count / 8).map(|n| Vec3::splat(80.0 + n as f32)));
        assert!(seen(&mesh).diagonal() > 100.0);
    }
}
